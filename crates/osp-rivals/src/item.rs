use osp::{math::Aabb, polygon::PolygonId};

/// A polygon as builders sort it: its box and its id.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Aabb,
    pub(super) id: PolygonId,
}
