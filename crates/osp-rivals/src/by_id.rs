//! Values that indexes store by a polygon's number.

use osp::polygon::PolygonId;
pub(super) use osp::{index::kernels::InsertedBoxes, polygon::ById};

/// Stands for no polygon in a hole of an array; beyond [`PolygonId::LIMIT`].
pub(super) const NO_POLYGON: PolygonId = PolygonId(u32::MAX);
