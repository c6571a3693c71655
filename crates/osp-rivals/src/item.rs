use osp::{math::Aabb, polygon::PolygonId};

/// A polygon in the form that builders move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Aabb,
    pub(super) id: PolygonId,
}
