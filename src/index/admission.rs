use super::IndexError;
use crate::{math::Aabb, polygon::PolygonId};

/// Checks a polygon before its insertion: the checks that all indexes share.
#[inline]
pub fn admit(id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
    admit_id(id)?;
    if bounds.is_valid() { Ok(()) } else { Err(IndexError::InvalidBounds(id)) }
}

/// Checks the id alone, for an index that stores the box in another form.
#[inline]
pub(crate) fn admit_id(id: PolygonId) -> Result<(), IndexError> {
    if id.0 < PolygonId::LIMIT { Ok(()) } else { Err(IndexError::IdBeyondLimit(id)) }
}
