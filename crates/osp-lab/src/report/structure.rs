//! The nodes of an index, reduced to as many levels as can be shown, and as text for Graphviz.

use std::{any::Any, fmt::Write};

use glam::Vec3;

use super::numbers::thousands;
use osp::{
    index::{Node, SpatialIndex, Visit, Visitor},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};
use osp_rivals::OspPaper;

pub(super) const MOST_TREE_NODES: usize = 500;

/// Largest number of polygons of a node whose numbers are written.
const MOST_NAMES: usize = 6;

/// A plane that splits a node, clipped to the node.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitOutline {
    /// Level of the node; 0 at the top.
    pub depth: u32,
    /// Remaining corners of the plane, in order around it.
    pub corners: Vec<Vec3>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StructureNode {
    /// A box around all polygons of the node's subtree.
    pub bounds: Aabb,
    pub depth: u32,
    /// Number of polygons of the subtree, as the index counts them.
    pub polygons: usize,
    pub parent: Option<usize>,
    /// Number of descendants that [`Structure::collapsed`] skipped.
    pub left_out: usize,
    /// Fields of a node that was made before the first polygon.
    pub fields: Option<NodeFields>,
}

/// The plane and the flags of a node of the paper's tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeFields {
    /// The axis that the node's plane cuts.
    pub axis: usize,
    pub plane_m: f32,
    /// The paper's `IsLeaf`.
    pub is_leaf: bool,
    /// The paper's `IsPolygon`.
    pub is_polygon: bool,
    /// The paper's `IsSubnode`.
    pub is_subnode: bool,
    pub center: Vec3,
    pub width_m: f32,
}

impl NodeFields {
    /// The plane of a node that has children, and the first letters of the flags that are set: L, P and S.
    pub(super) fn label(&self) -> String {
        let mut label = match self.is_leaf {
            true => String::new(),
            false => format!("{} = {:.2}", ["x", "y", "z"][self.axis], self.plane_m),
        };
        let flags = [(self.is_leaf, "L"), (self.is_polygon, "P"), (self.is_subnode, "S")];
        let set: String = flags.iter().filter(|flag| flag.0).map(|flag| flag.1).collect();
        if !label.is_empty() && !set.is_empty() {
            label.push_str(", ");
        }
        label + &set
    }

    /// The paper's `Centerpoint` and `Width`.
    pub(super) fn place(&self) -> [String; 2] {
        [format!("centre {}", coordinates(self.center)), format!("width {:.2} m", self.width_m)]
    }
}

pub(super) fn coordinates(p: Vec3) -> String {
    format!("{:.2} {:.2} {:.2}", p.x, p.y, p.z)
}

/// The nodes of an index in depth-first order, each before its descendants.
#[derive(Clone, Debug, Default)]
pub struct Structure {
    pub nodes: Vec<StructureNode>,
    /// The polygons, each with the index of the deepest node that contains it.
    pub members: Vec<(PolygonId, usize)>,
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
            fields: None,
        });
        Visit::Descend
    }

    fn polygons(&mut self, ids: &[PolygonId], _decision: Visit) {
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

    /// All nodes of an index whose nodes exist before its polygons, with their fields, also the empty nodes. For other
    /// indexes the same as [`Structure::of`].
    pub fn with_empty_nodes(index: &dyn SpatialIndex) -> Self {
        let Some(paper) = (index as &dyn Any).downcast_ref::<OspPaper>() else { return Self::of(index) };
        let mut all = Self::default();
        let mut waiting = vec![(0, None)];
        while let Some((number, parent)) = waiting.pop() {
            let Some(node) = paper.node(number) else { continue };
            let at = all.nodes.len();
            all.nodes.push(StructureNode {
                bounds: node.bounds(),
                depth: node.depth,
                polygons: node.polygons as usize,
                parent,
                left_out: 0,
                fields: Some(NodeFields {
                    axis: node.axis,
                    plane_m: node.plane_m(),
                    is_leaf: node.is_leaf,
                    is_polygon: node.is_polygon,
                    is_subnode: node.is_subnode,
                    center: node.center,
                    width_m: node.width_m,
                }),
            });
            all.members.extend(node.tri_names.iter().map(|&id| (id, at)));
            if !node.is_leaf {
                waiting.extend([(2 * number + 2, Some(at)), (2 * number + 1, Some(at))]);
            }
        }
        let (outside, bounds) = paper.outside();
        if !outside.is_empty() {
            let (at, polygons) = (all.nodes.len(), outside.len());
            all.nodes.push(StructureNode {
                bounds,
                depth: 0,
                polygons,
                parent: None,
                left_out: 0,
                fields: None,
            });
            all.members.extend(outside.iter().map(|&id| (id, at)));
        }
        all
    }

    /// The planes of nodes that are not leaves, each clipped by its node: whole levels from the top, at most `most` planes.
    pub fn splits(&self, most: usize) -> Vec<SplitOutline> {
        let of = |node: &StructureNode| {
            let fields = node.fields.filter(|fields| !fields.is_leaf)?;
            let corners = plane_corners(&node.bounds, fields.axis, fields.plane_m).to_vec();
            Some(SplitOutline { depth: node.depth, corners })
        };
        let mut splits: Vec<SplitOutline> = self.collapsed(most).nodes.iter().filter_map(of).collect();
        splits.sort_by_key(|split| split.depth);
        splits
    }

    #[must_use]
    pub fn upper(&self, levels: u32) -> Self {
        self.cut_below(levels.max(1))
    }

    /// For each node the numbers of its own polygons as text, at most [`MOST_NAMES`] numbers.
    pub(super) fn names(&self) -> Vec<String> {
        let mut names = vec![String::new(); self.nodes.len()];
        let mut counts = vec![0; self.nodes.len()];
        for &(id, node) in &self.members {
            counts[node] += 1;
            let _ = match counts[node] {
                1 => write!(names[node], "{}", id.0),
                2..=MOST_NAMES => write!(names[node], " {}", id.0),
                many if many == MOST_NAMES + 1 => write!(names[node], " ..."),
                _ => Ok(()),
            };
        }
        names
    }

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
        self.cut_below(levels.count().max(1) as u32)
    }

    fn cut_below(&self, levels: u32) -> Self {
        let mut kept = Self::default();
        // For each node, its index among the kept nodes, or the index of its kept ancestor.
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

    /// The tree in the language of Graphviz' `dot`, collapsed if it is large. With `named`, it has the numbers of the
    /// polygons.
    pub fn to_dot(&self, name: &str, named: bool) -> String {
        let mut dot = dot_head("index", name);
        let shown = self.collapsed(MOST_TREE_NODES);
        let names = if named { shown.names() } else { Vec::new() };
        for (i, node) in shown.nodes.iter().enumerate() {
            let mut label = format!("{} polygons", thousands(node.polygons as u64));
            if node.left_out > 0 {
                let _ = write!(label, "\\n+{} nodes", thousands(node.left_out as u64));
            }
            if let Some(fields) = node.fields {
                let _ = write!(label, "\\n{}\\n{}", fields.label(), fields.place().join(", "));
            }
            if let Some(name) = names.get(i).filter(|name| !name.is_empty()) {
                let _ = write!(label, "\\nown: {name}");
            }
            let (min, max) = (coordinates(node.bounds.min), coordinates(node.bounds.max));
            let _ = writeln!(dot, "  n{i} [label=\"{label}\\n{min} to\\n{max} m\"];");
            if let Some(parent) = node.parent {
                let _ = writeln!(dot, "  n{parent} -> n{i};");
            }
        }
        dot.push_str("}\n");
        dot
    }
}

/// The first lines of a graph for Graphviz, with its quoted title.
pub(super) fn dot_head(graph: &str, title: &str) -> String {
    let title = title.replace('\\', "\\\\").replace('"', "\\\"");
    format!("digraph {graph} {{\n  node [shape=box, fontname=\"sans-serif\"];\n  label=\"{title}\";\n")
}

/// Corners of the plane at `plane_m` across an axis, within a box, in order around it.
pub(super) fn plane_corners(bounds: &Aabb, axis: usize, plane_m: f32) -> [Vec3; 4] {
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    [(false, false), (true, false), (true, true), (false, true)].map(|(u, v)| {
        let mut p = bounds.min;
        p[axis] = plane_m;
        p[a] = if u { bounds.max[a] } else { p[a] };
        p[b] = if v { bounds.max[b] } else { p[b] };
        p
    })
}

#[cfg(test)]
mod tests {
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
    fn whole_levels_are_left_out_and_counted() {
        let structure = Structure::of(&*filled(IndexKind::BvhMedian));
        let all = structure.nodes.len();
        assert!(all > 50, "{all}");
        for most in [0, 1, 2, 3, 10, 30, all, all + 1] {
            let upper = structure.collapsed(most);
            let kept = upper.nodes.len();
            assert!(kept <= most.max(1) && (most < all || kept == all), "{kept} of at most {most}");
            let left_out: usize = upper.nodes.iter().map(|node| node.left_out).sum();
            assert_eq!(kept + left_out, all);
            let whole = structure.nodes.iter().filter(|node| node.depth <= upper.depth()).count();
            assert_eq!(kept, whole, "levels are kept whole");
        }
        assert_eq!(Structure::default().collapsed(5).nodes.len(), 0);
    }

    #[test]
    fn dot_has_a_line_for_each_node_and_edge_and_quotes_its_name() {
        let structure = Structure::of(&*filled(IndexKind::BvhMedian)).collapsed(7);
        let dot = structure.to_dot("a \"name\"", false);
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
                let mut ids: Vec<u32> = structure.members.iter().map(|(id, _)| id.0).collect();
                ids.sort_unstable();
                let all = if structure.nodes.is_empty() { 0 } else { 4000 };
                assert!(ids.iter().copied().eq(0..all), "{}: {}", kind.name(), ids.len());
                for &(id, node) in &structure.members {
                    let i = id.0;
                    let at =
                        Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32) * 0.2 - Vec3::ONE;
                    assert!(structure.nodes[node].bounds.contains(&Aabb::cube(at, 0.02)), "{}", kind.name());
                }
            }
        }
    }
}
