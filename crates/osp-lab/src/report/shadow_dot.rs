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

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use osp::{
        occlusion::ShadowVolume,
        view::{Projection, View},
    };

    use crate::shadows::{ShadowForm, ShadowSteps};

    #[test]
    fn dot_names_planes_and_shadows() {
        let projection = Projection::symmetric(90.0, 1.0, 0.1, 10.0);
        let window = View::look_at(Vec3::ZERO, Vec3::NEG_Z, projection).window().expect("a window");
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| Vec3::new(x, y, -2.0));
        let occluders = [ShadowVolume::of_polygon(&corners, &window).expect("an occluder")];
        let step =
            ShadowSteps::new(ShadowForm::Conservative, &window, &occluders).step(9, &window, &occluders);
        let dot = step.structure.to_dot("a \"name\"");
        assert!(dot.contains(r#"label="a \"name\"";"#), "{dot}");
        assert_eq!(dot.matches(" of occluder A\"").count(), 4);
        assert_eq!(dot.matches("\"unoccluded\"").count(), 4);
        assert_eq!(dot.matches("\"in the shadow of A\"").count(), 1);
        assert_eq!(dot.matches(" -> ").count(), 8);
    }
}
