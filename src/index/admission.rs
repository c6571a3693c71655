use super::IndexError;
use crate::{math::Aabb, scene::PolygonId};

/// Every index refuses ids from here on. Ids are numbers in order of arrival, and some indexes keep an array as long as
/// the highest: 24 bytes an id, so 3.2 GB at the limit. Larger: a stray id can take more memory than there is. (To make
/// 2^27 polygons, somebody draws tubes at 90 samples a second for two days.)
pub const ID_LIMIT: u32 = 1 << 27;

/// What every index checks before it files a polygon.
#[inline]
pub(super) fn admit(id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
    admit_id(id)?;
    if bounds.is_valid() { Ok(()) } else { Err(IndexError::InvalidBounds(id)) }
}

/// The part of [`admit`] that looks at the id alone, for an index that has the box in another form.
#[inline]
pub(super) fn admit_id(id: PolygonId) -> Result<(), IndexError> {
    if id.0 < ID_LIMIT { Ok(()) } else { Err(IndexError::IdBeyondLimit(id)) }
}
