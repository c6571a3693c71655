//! The nodes of a tree of shadow volumes, each with its cell of the window.

use std::fmt::Write;

use glam::DVec3;

use super::structure::dot_head;
use osp::{
    occlusion::{
        ShadowVolume,
        kernels::{Child, ShadowTree, Side, Span, clip, reach},
    },
    view::ViewWindow,
};

/// A corner of a cell counts as in a plane if the sine of its angle to the plane is at most this.
const IN_PLANE_SINE: f64 = 1.0e-9;

/// A plane or a leaf of a tree of shadow volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowNode {
    /// Index of the parent node, and the side of the parent's plane on which this node lies.
    pub parent: Option<(usize, Side)>,
    /// Depth of the node; 0 at the top.
    pub depth: u32,
    /// Directions from the eye to the corners of the node's cell, in order; none if the cell is empty.
    pub cell: Vec<DVec3>,
    /// The node's plane, or the shadows of a leaf.
    pub holds: ShadowHolds,
}

/// Contents of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum ShadowHolds {
    /// A plane through the eye.
    Plane {
        /// Index of the plane in the order in which the planes were added, from 0.
        number: usize,
        /// Index of the occluder that has this shadow plane.
        occluder: Option<usize>,
        /// The two directions between which the plane cuts the cell; `None` if the cell lies on one side of
        /// the plane.
        cut: Option<[DVec3; 2]>,
    },
    /// A leaf in the shadow of these occluders. An unoccluded leaf has none.
    Leaf {
        /// Indices of the occluders.
        occluders: Vec<usize>,
    },
}

/// The nodes of a tree in depth-first order, the child in front of a plane first.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowStructure {
    nodes: Vec<ShadowNode>,
    planes: usize,
}

impl ShadowStructure {
    /// Lists the nodes of a tree. `tree` must have been built from these occluders for this window.
    pub fn of(tree: &ShadowTree, window: &ViewWindow, occluders: &[ShadowVolume]) -> Self {
        let mut nodes = Vec::new();
        let mut waiting = vec![(tree.top(), None, 0, window.corners().to_vec())];
        while let Some((child, parent, depth, cell)) = waiting.pop() {
            let holds = match child.read() {
                Ok(number) => {
                    let node = tree.node(number);
                    let at = Some(nodes.len());
                    let mut halve = |child: Child, side, normal| {
                        waiting.push((child, at.map(|at| (at, side)), depth + 1, part(&cell, normal)));
                    };
                    halve(node.back, Side::Back, -node.normal);
                    halve(node.front, Side::Front, node.normal);
                    let occluder = occluders.iter().position(|o| o.sides().contains(&node.normal));
                    ShadowHolds::Plane { number: number as usize, occluder, cut: cut(&cell, node.normal) }
                }
                Err(caps) => {
                    let mut found = Vec::new();
                    for cap in tree.caps_of(caps) {
                        found.extend(owner(cap, &cell, occluders, &found));
                    }
                    ShadowHolds::Leaf { occluders: found }
                }
            };
            nodes.push(ShadowNode { parent, depth, cell, holds });
        }
        Self { nodes, planes: tree.node_count() }
    }

    /// The nodes.
    pub fn nodes(&self) -> &[ShadowNode] {
        &self.nodes
    }

    /// Number of planes.
    pub fn planes(&self) -> usize {
        self.planes
    }

    /// Number of levels of planes.
    pub fn levels(&self) -> u32 {
        self.nodes.iter().map(|node| node.depth).max().unwrap_or(0)
    }

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
                ShadowHolds::Leaf { occluders } => format!("in the shadow of {}", names(occluders)),
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

/// The name of an occluder: A to Z, then A1 to Z1, and so on.
pub fn occluder_name(number: usize) -> String {
    let letter = char::from(b'A' + (number % 26) as u8);
    if number < 26 { letter.to_string() } else { format!("{letter}{}", number / 26) }
}

/// The names of some occluders, the best occluder first.
pub(super) fn names(occluders: &[usize]) -> String {
    let mut sorted = occluders.to_vec();
    sorted.sort_unstable();
    sorted.iter().map(|&of| occluder_name(of)).collect::<Vec<_>>().join(" ")
}

/// Finds the occluder that a cap belongs to, except the occluders in `found`. If several occluders have the same cap,
/// the one whose shadow covers the cell is returned.
fn owner(
    (normal, distance_m): (DVec3, f64),
    cell: &[DVec3],
    occluders: &[ShadowVolume],
    found: &[usize],
) -> Option<usize> {
    let has_cap = |i: &usize| {
        let occluder = &occluders[*i];
        occluder.cap_normal() == normal && occluder.cap_distance_m() == distance_m && !found.contains(i)
    };
    let covers = |i: &usize| occluders[*i].sides().iter().all(|side| reach(*side, cell).0 >= -IN_PLANE_SINE);
    let mut owners = (0..occluders.len()).filter(has_cap);
    owners.clone().find(covers).or_else(|| owners.next())
}

/// The part of a cell in front of a plane; empty if the whole cell lies behind it.
fn part(cell: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    if cell.len() < 3 {
        return Vec::new();
    }
    let mut points = cell.to_vec();
    let front = clip(&mut points, Span { start: 0, len: cell.len() as u32 }, normal);
    points.drain(..front.start as usize);
    if points.len() < 3 { Vec::new() } else { points }
}

/// The two directions between which a plane cuts a cell; `None` if the cell lies on one side of the plane.
fn cut(cell: &[DVec3], normal: DVec3) -> Option<[DVec3; 2]> {
    let (low, high) = reach(normal, cell);
    if cell.len() < 3 || low > -IN_PLANE_SINE || high < IN_PLANE_SINE {
        return None;
    }
    let front = part(cell, normal);
    let mut ends = front.into_iter().filter(|p| normal.dot(*p).abs() <= IN_PLANE_SINE);
    Some([ends.next()?, ends.next_back()?])
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{super::shadow_look::ShadowForm, *};
    use osp::view::{Projection, View};

    /// A square in the middle of the window, two metres away.
    fn structure(form: ShadowForm, planes: usize) -> ShadowStructure {
        let projection = Projection::symmetric(90.0, 1.0, 0.1, 10.0);
        let window = View::look_at(Vec3::ZERO, Vec3::NEG_Z, projection).window().expect("a window");
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| Vec3::new(x, y, -2.0));
        let occluders = [ShadowVolume::of_polygon(&corners, &window).expect("an occluder")];
        let tree = form.tree(&window, &occluders).first(planes);
        ShadowStructure::of(&tree, &window, &occluders)
    }

    #[test]
    fn four_planes_of_a_square_leave_one_cell_in_its_shadow() {
        for form in [ShadowForm::Sound, ShadowForm::Paper] {
            let whole = structure(form, 9);
            assert_eq!((whole.planes(), whole.levels(), whole.nodes().len()), (4, 4, 9));
            let is_dark = |node: &&ShadowNode| matches!(&node.holds, ShadowHolds::Leaf { occluders } if occluders == &[0]);
            let dark: Vec<_> = whole.nodes().iter().filter(is_dark).collect();
            assert_eq!(dark.len(), 1);
            assert_eq!((dark[0].cell.len(), dark[0].depth), (4, 4));
            let all_cut = |node: &ShadowNode| match node.holds {
                ShadowHolds::Plane { occluder, cut, .. } => occluder == Some(0) && cut.is_some(),
                ShadowHolds::Leaf { .. } => true,
            };
            assert!(whole.nodes().iter().all(all_cut));
            let part = structure(form, 3);
            assert_eq!((part.planes(), part.nodes().iter().filter(is_dark).count()), (3, 0));
        }
    }

    #[test]
    fn dot_names_planes_and_shadows() {
        let dot = structure(ShadowForm::Sound, 9).to_dot("a \"name\"");
        assert!(dot.contains(r#"label="a \"name\"";"#), "{dot}");
        assert_eq!(dot.matches(" of occluder A\"").count(), 4);
        assert_eq!(dot.matches("\"unoccluded\"").count(), 4);
        assert_eq!(dot.matches("\"in the shadow of A\"").count(), 1);
        assert_eq!(dot.matches(" -> ").count(), 8);
    }

    #[test]
    fn occluders_are_named_by_letters() {
        assert_eq!([0, 25, 26, 53].map(occluder_name), ["A", "Z", "A1", "B2"]);
        assert_eq!(names(&[2, 0]), "A C");
    }
}
