use crate::{
    math::{Aabb, Containment},
    polygon::PolygonId,
};

/// A node, as passed to a [`Visitor`].
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    /// Box around every polygon of the node and of those below.
    pub bounds: &'a Aabb,
    /// 0 at the top.
    pub depth: u32,
    /// Outcome of the frustum test of the node's box, never [`Containment::Outside`].
    pub containment: Containment,
    /// Number of polygons in the node and below, or an upper bound of it.
    pub polygons: usize,
    /// Whether the node has no nodes below.
    pub is_leaf: bool,
}

/// Decision about a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// Omit the node and all below.
    Skip,
    /// Visit the nodes below.
    Descend,
    /// Report all polygons of the node and below that pass the frustum, without visiting the nodes.
    Take,
}

/// Selects nodes and receives polygons in a [`super::SpatialIndex::traverse`].
pub trait Visitor {
    /// Decides about a node.
    fn node(&mut self, node: &Node<'_>) -> Visit;

    /// Whether [`Visitor::leaves`] decides about neighbouring leaves together. A polygon whose own box was passed there then
    /// counts as taken ([`Visit::Take`]).
    fn asks_together(&self) -> bool {
        false
    }

    /// Decides about at most sixteen leaves; leaf `i` holds `polygons[i]` polygons. All of them lie in the last inner node that was
    /// passed to [`Visitor::node`].
    fn leaves(&mut self, _bounds: &[Aabb], _polygons: &[u8], answers: &mut [Visit]) {
        answers.fill(Visit::Descend);
    }

    /// Receives polygons that pass the frustum. `asked` is the decision about their node, [`Visit::Descend`] or [`Visit::Take`].
    fn polygons(&mut self, ids: &[PolygonId], asked: Visit);
}

/// The occlusion test of a [`super::SpatialIndex::thin_out`].
pub trait Thinner {
    /// Nodes of fewer polygons are kept without a test.
    fn least_polygons(&self) -> usize;

    /// Whether the polygons of leaves are tested one by one.
    fn asks_polygons(&self) -> bool;

    /// Tests a node with this box and at most this many polygons: [`Visit::Skip`] if all of it is hidden,
    /// [`Visit::Take`] if no part can be hidden.
    fn node(&mut self, bounds: &Aabb, polygons: usize) -> Visit;

    /// [`Thinner::node`] for at most sixteen boxes, with at most `polygons[i]` polygons in box `i`.
    fn nodes(&mut self, bounds: &[Aabb], polygons: &[u8], answers: &mut [Visit]) {
        for ((answer, bounds), &polygons) in answers.iter_mut().zip(bounds).zip(polygons) {
            *answer = self.node(bounds, usize::from(polygons));
        }
    }

    /// Whether a polygon with this box is hidden.
    fn is_hidden(&mut self, bounds: &Aabb) -> bool;

    /// The hidden ones among at most sixteen polygons with these boxes, a bit for each.
    fn hidden_of(&mut self, boxes: &[Aabb]) -> u16 {
        boxes
            .iter()
            .enumerate()
            .fold(0, |hidden, (i, bounds)| hidden | u16::from(self.is_hidden(bounds)) << i)
    }
}
