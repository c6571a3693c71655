use super::IndexError;
use crate::{math::Aabb, polygon::PolygonId};

/// What every index checks before it inserts a polygon.
#[inline]
pub fn admit(id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
    admit_id(id)?;
    if bounds.is_valid() { Ok(()) } else { Err(IndexError::InvalidBounds(id)) }
}

/// The part of [`admit`] that looks at the id alone, for an index that has the box in another form.
#[inline]
pub(crate) fn admit_id(id: PolygonId) -> Result<(), IndexError> {
    if id.0 < PolygonId::LIMIT { Ok(()) } else { Err(IndexError::IdBeyondLimit(id)) }
}
