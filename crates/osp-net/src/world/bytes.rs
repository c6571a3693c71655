//! Little-endian numbers of an object, read one after the other.

use glam::Vec3;

use super::WorldError;
use osp::math::Aabb;

/// The bytes of an object, or of a part of it, and the number of bytes already read.
pub(super) struct Reader<'a> {
    object: &'a dyn Fn() -> String,
    /// Offset of the bytes in the object.
    start: u64,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// A reader of `bytes`, which begin at byte `start` of the object. `object` returns the object's full name, for
    /// errors.
    pub(super) fn new(object: &'a dyn Fn() -> String, start: u64, bytes: &'a [u8]) -> Self {
        Self { object, start, bytes, at: 0 }
    }

    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The error for a value with unexpected contents, which began `back` bytes before the current position.
    pub(super) fn damaged(
        &self,
        back: usize,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> WorldError {
        WorldError::Damaged {
            object: (self.object)(),
            byte: self.start + (self.at - back) as u64,
            expected: expected.into(),
            found: found.to_string(),
        }
    }

    pub(super) fn take(&mut self, count: usize, what: &str) -> Result<&'a [u8], WorldError> {
        match self.bytes.get(self.at..).and_then(|rest| rest.get(..count)) {
            Some(taken) => {
                self.at += count;
                Ok(taken)
            }
            None => Err(self.damaged(
                0,
                format!("{count} bytes: {what}"),
                format!("the end after {}", self.left()),
            )),
        }
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], WorldError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    pub(super) fn u32(&mut self, what: &str) -> Result<u32, WorldError> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self, what: &str) -> Result<u64, WorldError> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub(super) fn floats<const N: usize>(&mut self, what: &str) -> Result<[f32; N], WorldError> {
        let (bytes, _) = self.take(4 * N, what)?.as_chunks();
        let mut floats = [0.0; N];
        floats.iter_mut().zip(bytes).for_each(|(float, bytes)| *float = f32::from_le_bytes(*bytes));
        Ok(floats)
    }

    /// Reads a box with finite corners.
    pub(super) fn bounds(&mut self, what: &str) -> Result<Aabb, WorldError> {
        let [a, b, c, d, e, f] = self.floats(what)?;
        let bounds = Aabb::new(Vec3::new(a, b, c), Vec3::new(d, e, f));
        match bounds.is_valid() {
            true => Ok(bounds),
            false => Err(self.damaged(24, format!("{what} with finite corners, the least first"), {
                format!("{} to {}", bounds.min, bounds.max)
            })),
        }
    }
}

pub(super) fn put_bounds(out: &mut Vec<u8>, bounds: &Aabb) {
    put_floats(out, &bounds.min.to_array());
    put_floats(out, &bounds.max.to_array());
}

pub(super) fn put_floats(out: &mut Vec<u8>, floats: &[f32]) {
    floats.iter().for_each(|float| out.extend(float.to_le_bytes()));
}
