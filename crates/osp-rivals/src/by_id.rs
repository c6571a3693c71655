//! Values that indexes store by a polygon's number.

use osp::polygon::PolygonId;
pub(super) use osp::{index::kernels::InsertedBoxes, polygon::ById};

/// The id in a hole of an array, which belongs to no polygon. It is above [`PolygonId::LIMIT`].
pub(super) const NO_POLYGON: PolygonId = PolygonId(u32::MAX);
