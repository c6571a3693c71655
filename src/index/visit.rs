use crate::{
    math::{Aabb, Containment},
    polygon::PolygonId,
};

/// A node as a visitor sees it.
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    /// Holds every polygon of the node and below.
    pub bounds: &'a Aabb,
    /// 0 at the top.
    pub depth: u32,
    /// How the node's box lies to the frustum (never [`Containment::Outside`]).
    pub containment: Containment,
    /// Polygons in the node and below; an upper bound where the structure does not know it exactly.
    pub polygons: usize,
    /// Whether nothing is below.
    pub is_leaf: bool,
}

/// What to do with a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// Leave it and everything below out.
    Skip,
    /// Go on: ask again for the nodes below.
    Descend,
    /// Take it and everything below that passes the frustum, without asking again.
    Take,
}

/// Asked at every node of a [`super::SpatialIndex::traverse`].
pub trait Visitor {
    /// Decides about a node.
    fn node(&mut self, node: &Node<'_>) -> Visit;

    /// Whether it would rather decide about neighbouring leaves together, by [`Visitor::leaves`]. Polygons whose own box was asked
    /// about there are then received as if the answer had been [`Visit::Take`].
    fn asks_together(&self) -> bool {
        false
    }

    /// Decides about at most sixteen leaves; leaf `i` holds `polygons[i]` polygons. All of them lie in the last node, leaves not
    /// counted, that [`Visitor::node`] was asked about.
    fn leaves(&mut self, _bounds: &[Aabb], _polygons: &[u8], answers: &mut [Visit]) {
        answers.fill(Visit::Descend);
    }

    /// Receives polygons that pass the frustum. `asked` is
    /// [`Visit::Descend`] or [`Visit::Take`], whatever was answered for the node that they are in.
    fn polygons(&mut self, ids: &[PolygonId], asked: Visit);
}

/// Says in a [`super::SpatialIndex::thin_out`] what is hidden.
pub trait Thinner {
    /// A node of fewer polygons is kept without a question.
    fn least_polygons(&self) -> usize;

    /// Whether the polygons of leaves are asked about one by one.
    fn asks_polygons(&self) -> bool;

    /// Decides about a node with this box and at most so many polygons: [`Visit::Skip`] if all of it is hidden,
    /// [`Visit::Take`] if nothing of it can be.
    fn node(&mut self, bounds: &Aabb, polygons: usize) -> Visit;

    /// [`Thinner::node`] for at most sixteen boxes, with at most so many polygons each.
    fn nodes(&mut self, bounds: &[Aabb], polygons: &[u8], answers: &mut [Visit]) {
        for ((answer, bounds), &polygons) in answers.iter_mut().zip(bounds).zip(polygons) {
            *answer = self.node(bounds, usize::from(polygons));
        }
    }

    /// Whether a polygon with this box is hidden.
    fn is_hidden(&mut self, bounds: &Aabb) -> bool;

    /// Which of at most sixteen polygons with these boxes are hidden, a bit for each.
    fn hidden_of(&mut self, boxes: &[Aabb]) -> u16 {
        boxes
            .iter()
            .enumerate()
            .fold(0, |hidden, (i, bounds)| hidden | u16::from(self.is_hidden(bounds)) << i)
    }
}
