use std::io::{self, Read};
use std::path::Path;

use super::{Excess, Limits, Place, RecordingError};

/// A reader of the decompressed bytes of a compressed file, up to the limit for its compressed size.
pub(super) struct Unpacked<R> {
    input: R,
    packed: u64,
    most: u64,
    left: u64,
}

#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error("more than {most} bytes from {packed} packed ones")]
struct TooMany {
    most: u64,
    packed: u64,
}

impl<R> Unpacked<R> {
    /// A reader of `input`, the decompressed bytes of a file of `packed` compressed bytes.
    pub(super) fn new(input: R, packed: u64, limits: &Limits) -> Self {
        let most = limits.unpacked_bytes(packed);
        Self { input, packed, most, left: most }
    }
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // The read may return one byte more than allowed. The additional byte distinguishes a longer file from a file
        // that ends at the limit.
        let most = usize::try_from(self.left.saturating_add(1)).unwrap_or(usize::MAX).min(buffer.len());
        let read = self.input.read(&mut buffer[..most])?;
        match self.left.checked_sub(read as u64) {
            Some(left) => self.left = left,
            None => return Err(io::Error::other(TooMany { most: self.most, packed: self.packed })),
        }
        Ok(read)
    }
}

/// Returns the error of the exceeded limit, if a read failed because of it.
pub(super) fn beyond(error: &io::Error, path: &Path, place: Place) -> Option<RecordingError> {
    let &TooMany { most, packed } = error.get_ref()?.downcast_ref()?;
    Some(RecordingError::Limit(Box::new(Excess {
        path: path.to_owned(),
        place,
        most,
        what: format!("bytes unpacked from {packed}"),
        option: "--max-polygons N",
        read: None,
    })))
}
