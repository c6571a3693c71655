//! Trees of shadow volumes as graphs.

use std::fmt::Write;

use super::structure::dot_head;
use crate::shadows::{ShadowHolds, ShadowStructure, occluder_name, occluder_names};
use osp::occlusion::kernels::Side;

impl ShadowStructure {
    /// The tree in the language of Graphviz' `dot`.
    pub fn to_dot(&self, name: &str) -> String {
        let mut dot = dot_head("shadows", name);
        // Writing to a string does not fail.
        for (i, node) in self.nodes.iter().enumerate() {
            let label = match &node.holds {
                ShadowHolds::Plane { number, occluder, .. } => match occluder {
                    Some(of) => format!("plane {} of occluder {}", number + 1, occluder_name(*of)),
                    None => format!("plane {}", number + 1),
                },
                ShadowHolds::Leaf { occluders } if occluders.is_empty() => "unoccluded".to_owned(),
                ShadowHolds::Leaf { occluders } => format!("in the shadow of {}", occluder_names(occluders)),
            };
            let _ = writeln!(dot, "  n{i} [label=\"{label}\"];");
            if let Some((parent, side)) = node.parent {
                let side = if side == Side::Front { "in front" } else { "behind" };
                let _ = writeln!(dot, "  n{parent} -> n{i} [label=\"{side}\"];");
            }
        }
        dot.push_str("}\n");
        dot
    }
}
