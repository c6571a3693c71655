//! The nodes of a tree of shadow volumes, each with its cell of the window.

use glam::DVec3;

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
    pub parent: Option<(usize, Side)>,
    pub depth: u32,
    /// Directions from the eye to the corners of the node's cell, in order; none if the cell is empty.
    pub cell: Vec<DVec3>,
    /// The node's plane, or the shadows of a leaf.
    pub holds: ShadowHolds,
}

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
    Leaf { occluders: Vec<usize> },
}

/// The nodes of a tree in depth-first order, the child in front of a plane first.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowStructure {
    pub nodes: Vec<ShadowNode>,
    pub planes: usize,
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

    pub fn levels(&self) -> u32 {
        self.nodes.iter().map(|node| node.depth).max().unwrap_or(0)
    }
}

/// The name of an occluder: A to Z, then A1 to Z1, and so on.
pub fn occluder_name(number: usize) -> String {
    let letter = char::from(b'A' + (number % 26) as u8);
    if number < 26 { letter.to_string() } else { format!("{letter}{}", number / 26) }
}

/// The names of some occluders, the best occluder first.
pub fn occluder_names(occluders: &[usize]) -> String {
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
    use super::*;

    #[test]
    fn occluders_are_named_by_letters() {
        assert_eq!([0, 25, 26, 53].map(occluder_name), ["A", "Z", "A1", "B2"]);
        assert_eq!(occluder_names(&[2, 0]), "A C");
    }
}
