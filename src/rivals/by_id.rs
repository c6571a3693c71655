//! What indexes keep by a polygon's number.

use crate::polygon::PolygonId;
pub(super) use crate::{index::filed_boxes::FiledBoxes, polygon::ById};

/// Stands for "no polygon" where an array has a hole; it is beyond [`PolygonId::LIMIT`].
pub(super) const NO_POLYGON: PolygonId = PolygonId(u32::MAX);
