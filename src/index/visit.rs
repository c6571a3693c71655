use crate::{
    math::{Aabb, Containment},
    polygon::PolygonId,
};

/// A node as a [`Visitor`] receives it.
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    /// Box around every polygon of the node and of its descendants.
    pub bounds: &'a Aabb,
    /// Level of the node; 0 at the top.
    pub depth: u32,
    /// Outcome of the frustum test of the node's box, never [`Containment::Outside`]. Unspecified in
    /// [`super::SpatialIndex::thin_out`].
    pub containment: Containment,
    /// Number of polygons in the node and its descendants, or an upper bound of this number.
    pub polygons: usize,
    /// Whether the node has no children.
    pub is_leaf: bool,
}

/// A visitor's decision about a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// Skip the node with all its descendants: their polygons are not reported, or are removed.
    Skip,
    /// Visit the children.
    Descend,
    /// Report or keep all polygons of the node and its descendants that pass the frustum test, without a visit to the
    /// descendants.
    Take,
}

/// Guides a [`super::SpatialIndex::traverse`] and receives its polygons. For [`super::SpatialIndex::thin_out`], it decides
/// which nodes and polygons stay.
pub trait Visitor {
    /// Decides about a node.
    fn node(&mut self, node: &Node<'_>) -> Visit;

    /// Whether the traversal calls [`Visitor::leaves`] once for neighbouring leaves, instead of [`Visitor::node`] for
    /// each leaf. In this case the polygon of a leaf with one polygon counts as taken ([`Visit::Take`]), because the
    /// leaf's box is the polygon's box.
    fn tests_together(&self) -> bool {
        false
    }

    /// Decides about at most sixteen leaves at once; leaf `i` holds `polygons[i]` polygons. Their parent is the node of
    /// the last call of [`Visitor::node`].
    fn leaves(&mut self, _bounds: &[Aabb], _polygons: &[u8], answers: &mut [Visit]) {
        answers.fill(Visit::Descend);
    }

    /// Receives polygons that pass the frustum test. `decision` is the decision about their node: [`Visit::Descend`] or
    /// [`Visit::Take`].
    fn polygons(&mut self, ids: &[PolygonId], decision: Visit);

    /// [`super::SpatialIndex::thin_out`] keeps nodes with fewer polygons and does not call [`Visitor::node`] for them.
    fn least_polygons(&self) -> usize {
        1
    }

    /// Whether [`super::SpatialIndex::thin_out`] calls [`Visitor::hidden_of`] for the leaves to which it descends.
    fn tests_polygons(&self) -> bool {
        false
    }

    /// The hidden polygons among at most sixteen with these boxes, a bit for each box.
    fn hidden_of(&mut self, _boxes: &[Aabb]) -> u16 {
        0
    }
}
