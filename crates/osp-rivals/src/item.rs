use osp::{math::Aabb, polygon::PolygonId};

/// A polygon as a builder moves it about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Aabb,
    pub(super) id: PolygonId,
}
