//! The nodes of an index, reduced to as many levels as can be shown, and as text for Graphviz.

use std::fmt::Write;

use super::numbers::thousands;
use osp::{
    index::{Node, SpatialIndex, Visit, Visitor},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};

/// Largest number of nodes in a picture of a tree.
pub(super) const MOST_TREE_NODES: usize = 500;

/// A node of an index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StructureNode {
    /// A box around all polygons of the node's subtree.
    pub bounds: Aabb,
    /// Depth of the node, 0 for the root.
    pub depth: u32,
    /// Number of polygons of the subtree, as the index counts them.
    pub polygons: usize,
    /// Index of the parent node.
    pub parent: Option<usize>,
    /// Number of descendants that [`Structure::collapsed`] left out.
    pub left_out: usize,
}

/// The nodes of an index in depth-first order, each before its descendants.
#[derive(Clone, Debug, Default)]
pub struct Structure {
    nodes: Vec<StructureNode>,
    /// The polygons, each with the index of the deepest node that contains it.
    members: Vec<(PolygonId, usize)>,
}

struct Collector(Structure);

impl Visitor for Collector {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        let nodes = &mut self.0.nodes;
        // The parent is the last visited node with a smaller depth, because nodes are visited depth first.
        let mut parent = nodes.len().checked_sub(1);
        while let Some(at) = parent
            && nodes[at].depth >= node.depth
        {
            parent = nodes[at].parent;
        }
        nodes.push(StructureNode {
            bounds: *node.bounds,
            depth: node.depth,
            polygons: node.polygons,
            parent,
            left_out: 0,
        });
        Visit::Descend
    }

    fn polygons(&mut self, ids: &[PolygonId], _asked: Visit) {
        // The polygons belong to the last visited node.
        if let Some(node) = self.0.nodes.len().checked_sub(1) {
            self.0.members.extend(ids.iter().map(|&id| (id, node)));
        }
    }
}

impl Structure {
    /// The nodes of an index that are not empty.
    pub fn of(index: &dyn SpatialIndex) -> Self {
        let mut collector = Collector(Self::default());
        index.traverse(&Frustum::everything(), &mut collector);
        collector.0
    }

    /// The nodes.
    pub fn nodes(&self) -> &[StructureNode] {
        &self.nodes
    }

    /// The polygons, each with the index of the deepest node that contains it.
    pub fn members(&self) -> &[(PolygonId, usize)] {
        &self.members
    }

    /// Depth of the deepest node.
    pub fn depth(&self) -> u32 {
        self.nodes.iter().map(|node| node.depth).max().unwrap_or(0)
    }

    /// The upper part of the tree: as many complete levels as have at most `most` nodes together, and always the first
    /// level.
    #[must_use]
    pub fn collapsed(&self, most: usize) -> Self {
        let mut counts = vec![0; self.depth() as usize + 1];
        self.nodes.iter().for_each(|node| counts[node.depth as usize] += 1);
        let mut sum = 0;
        let levels = counts.iter().take_while(|&&count| {
            sum += count;
            sum <= most
        });
        let levels = levels.count().max(1) as u32;
        let mut kept = Self::default();
        // For each node, its index among the kept nodes, or that of the kept ancestor.
        let mut place = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let parent = node.parent.map(|at| place[at]);
            match parent {
                Some(above) if node.depth >= levels => {
                    let above: usize = above;
                    kept.nodes[above].left_out += 1;
                    place.push(above);
                }
                _ => {
                    place.push(kept.nodes.len());
                    kept.nodes.push(StructureNode { parent, ..*node });
                }
            }
        }
        kept.members.extend(self.members.iter().map(|&(id, node)| (id, place[node])));
        kept
    }

    /// The tree in the language of Graphviz' `dot`, collapsed if it is large.
    pub fn to_dot(&self, name: &str) -> String {
        let mut dot = String::from("digraph index {\n  node [shape=box, fontname=\"sans-serif\"];\n");
        // Writing to a string never fails.
        let _ = writeln!(dot, "  label=\"{}\";", name.replace('\\', "\\\\").replace('"', "\\\""));
        for (i, node) in self.collapsed(MOST_TREE_NODES).nodes.iter().enumerate() {
            let mut label = format!("{} polygons", thousands(node.polygons as u64));
            if node.left_out > 0 {
                let _ = write!(label, "\\n+{} nodes", thousands(node.left_out as u64));
            }
            let corner = |p: glam::Vec3| format!("{:.2} {:.2} {:.2}", p.x, p.y, p.z);
            let (min, max) = (corner(node.bounds.min), corner(node.bounds.max));
            let _ = writeln!(dot, "  n{i} [label=\"{label}\\n{min} to\\n{max} m\"];");
            if let Some(parent) = node.parent {
                let _ = writeln!(dot, "  n{parent} -> n{i};");
            }
        }
        dot.push_str("}\n");
        dot
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use osp::index::IndexConfig;
    use osp_rivals::IndexKind;

    fn filled(kind: IndexKind) -> Box<dyn SpatialIndex> {
        let mut index = kind.create(&IndexConfig::default());
        for i in 0..4000u32 {
            let at = Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32) * 0.2 - Vec3::ONE;
            index.insert(PolygonId(i), &Aabb::cube(at, 0.02)).expect("finite boxes, each id once");
        }
        index.commit();
        index
    }

    #[test]
    fn children_lie_below_and_within_their_parents() {
        for &kind in IndexKind::ALL {
            let structure = Structure::of(&*filled(kind));
            for (i, node) in structure.nodes().iter().enumerate() {
                let Some(parent) = node.parent else { continue };
                let above = structure.nodes()[parent];
                assert!(parent < i && above.depth < node.depth, "{}: node {i}", kind.name());
                assert!(above.bounds.contains(&node.bounds), "{}: node {i}", kind.name());
            }
        }
    }

    #[test]
    fn whole_levels_are_left_out_and_counted() {
        let structure = Structure::of(&*filled(IndexKind::BvhMedian));
        let all = structure.nodes().len();
        assert!(all > 50, "{all}");
        for most in [0, 1, 2, 3, 10, 30, all, all + 1] {
            let upper = structure.collapsed(most);
            let kept = upper.nodes().len();
            assert!(kept <= most.max(1) && (most < all || kept == all), "{kept} of at most {most}");
            let left_out: usize = upper.nodes().iter().map(|node| node.left_out).sum();
            assert_eq!(kept + left_out, all);
            let whole = structure.nodes().iter().filter(|node| node.depth <= upper.depth()).count();
            assert_eq!(kept, whole, "levels are kept whole");
        }
        assert_eq!(Structure::default().collapsed(5).nodes().len(), 0);
    }

    #[test]
    fn dot_has_a_line_for_each_node_and_edge_and_quotes_its_name() {
        let structure = Structure::of(&*filled(IndexKind::BvhMedian)).collapsed(7);
        let dot = structure.to_dot("a \"name\"");
        assert!(dot.contains(r#"label="a \"name\"";"#), "{dot}");
        assert_eq!(dot.matches(" polygons").count(), 7);
        assert_eq!(dot.matches(" -> ").count(), 6);
        assert!(dot.contains("4,000 polygons") && dot.contains(r"\n+"), "{dot}");
        assert!(dot.contains(r"\n-1.01 -1.01 -1.01 to\n2.81 2.81 0.81 m"), "{dot}");
    }

    #[test]
    fn every_polygon_is_a_member_of_one_node_that_holds_it() {
        for &kind in IndexKind::ALL {
            let index = filled(kind);
            let structure = Structure::of(&*index);
            for structure in [structure.collapsed(9), structure] {
                let mut ids: Vec<u32> = structure.members().iter().map(|(id, _)| id.0).collect();
                ids.sort_unstable();
                let all = if structure.nodes().is_empty() { 0 } else { 4000 };
                assert!(ids.iter().copied().eq(0..all), "{}: {}", kind.name(), ids.len());
                for &(id, node) in structure.members() {
                    let i = id.0;
                    let at =
                        Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32) * 0.2 - Vec3::ONE;
                    assert!(
                        structure.nodes()[node].bounds.contains(&Aabb::cube(at, 0.02)),
                        "{}",
                        kind.name()
                    );
                }
            }
        }
    }
}
