//! The part of the crate `zstd` that osp uses, without C code, so that only a Rust compiler is needed to build the web
//! page. It decompresses everything. It compresses whole buffers, to a larger size than `zstd`, but no streams.
#![allow(missing_debug_implementations, reason = "as in what it stands for")]

use std::{
    io::{self, BufRead, BufReader, ErrorKind, Read},
    marker::PhantomData,
};

#[cfg(target_arch = "wasm32")]
use std::io::Write;

use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

/// The default level of the crate `zstd`; all levels give the same result here.
#[cfg(target_arch = "wasm32")]
pub const DEFAULT_COMPRESSION_LEVEL: i32 = 3;

pub mod bulk {
    use super::{Decoder, Read, io};

    /// Compresses at the fastest level; `_level` is ignored.
    pub fn compress(bytes: &[u8], _level: i32) -> io::Result<Vec<u8>> {
        Ok(ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest))
    }

    pub fn decompress(packed: &[u8], most_bytes: usize) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        Decoder::new(packed)?.take(most_bytes as u64).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

#[cfg(target_arch = "wasm32")]
pub mod stream {
    pub mod read {
        pub use super::super::Decoder;
    }
    pub mod write {
        pub use super::super::Encoder;
    }
}

/// Decompresses consecutive frames.
pub struct Decoder<'a, R> {
    input: R,
    frames: FrameDecoder,
    state: State,
    of_context: PhantomData<&'a ()>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// Before a frame, or after the last frame.
    Between,
    Inside,
    /// The state after an error.
    Done,
}

impl<R: Read> Decoder<'static, BufReader<R>> {
    /// A decoder of the bytes of `input`.
    pub fn new(input: R) -> io::Result<Self> {
        let (frames, state) = (FrameDecoder::new(), State::Between);
        Ok(Self { input: BufReader::new(input), frames, state, of_context: PhantomData })
    }
}

impl<R: BufRead> Decoder<'_, R> {
    /// Limits the window of a frame to two to the power of `log` bytes; frames with larger windows are errors.
    pub fn window_log_max(&mut self, log: u32) -> io::Result<()> {
        self.frames.set_max_window_size(1 << log);
        Ok(())
    }

    fn begin(&mut self) -> io::Result<bool> {
        if self.input.fill_buf()?.is_empty() {
            return Ok(false);
        }
        match self.frames.reset(&mut self.input) {
            Ok(()) => Ok(true),
            Err(error) => Err(self.failure(error)),
        }
    }

    /// Returns different errors for data that end too early and for damaged data.
    fn failure(&mut self, error: impl std::error::Error + Send + Sync + 'static) -> io::Error {
        self.state = State::Done;
        match self.input.fill_buf() {
            Ok([]) => io::Error::new(ErrorKind::UnexpectedEof, "incomplete frame"),
            _ => io::Error::other(error),
        }
    }
}

impl<R: BufRead> Read for Decoder<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            match self.state {
                State::Done => return Ok(0),
                State::Between => match self.begin()? {
                    true => self.state = State::Inside,
                    false => return Ok(0),
                },
                State::Inside => {}
            }
            if self.frames.can_collect() > 0 {
                return self.frames.read(buffer);
            }
            if self.frames.is_finished() {
                if let (Some(found), Some(expected)) =
                    (self.frames.get_calculated_checksum(), self.frames.get_checksum_from_data())
                    && found != expected
                {
                    self.state = State::Done;
                    return Err(io::Error::other("Restored data doesn't match checksum"));
                }
                self.state = State::Between;
                continue;
            }
            if let Err(error) =
                self.frames.decode_blocks(&mut self.input, BlockDecodingStrategy::UptoBlocks(1))
            {
                return Err(self.failure(error));
            }
        }
    }
}

/// An encoder that cannot be created, because compression of streams is not supported.
#[cfg(target_arch = "wasm32")]
pub struct Encoder<'a, W> {
    out: W,
    of_context: PhantomData<&'a ()>,
}

#[cfg(target_arch = "wasm32")]
impl<W: Write> Encoder<'_, W> {
    pub fn new(_out: W, _level: i32) -> io::Result<Self> {
        Err(io::Error::new(
            ErrorKind::Unsupported,
            "nothing is compressed on a page: leave `.zst` out of the name",
        ))
    }

    pub fn include_checksum(&mut self, _on: bool) -> io::Result<()> {
        Ok(())
    }

    pub fn finish(self) -> io::Result<W> {
        Ok(self.out)
    }
}

#[cfg(target_arch = "wasm32")]
impl<W: Write> Write for Encoder<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use std::io::Write;

    use super::*;

    fn unpacked(bytes: &[u8]) -> (Vec<u8>, Option<ErrorKind>) {
        let mut all = Vec::new();
        let error = Decoder::new(bytes).and_then(|mut decoder| {
            decoder.window_log_max(27)?;
            decoder.read_to_end(&mut all)
        });
        (all, error.err().map(|error| error.kind()))
    }

    #[test]
    fn it_unpacks_what_the_crate_packs_and_tells_a_cut_from_damage() {
        let text: Vec<u8> = (0..60_000u32).flat_map(|i| format!("{}\n", i * i % 977).into_bytes()).collect();
        let pack = |text: &[u8]| {
            let mut encoder = zstd::Encoder::new(Vec::new(), 3).expect("an encoder");
            encoder.include_checksum(true).expect("known");
            encoder.write_all(text).expect("packed");
            encoder.finish().expect("packed")
        };
        let mut packed = pack(&text[..100_000]);
        let first = packed.len();
        packed.extend(pack(&text[100_000..]));
        assert_eq!(unpacked(&packed), (text.clone(), None));
        for cut in [2, first / 2, first + 3, packed.len() - 2] {
            let (start, error) = unpacked(&packed[..cut]);
            assert_eq!(error, Some(ErrorKind::UnexpectedEof), "{cut}");
            assert!(text.starts_with(&start));
        }
        let mut damaged = packed;
        damaged[first - 2] ^= 1;
        assert_eq!(unpacked(&damaged), (text[..100_000].to_vec(), Some(ErrorKind::Other)));
        let small = bulk::compress(&text, 1).expect("packed");
        assert!(small.len() < text.len());
        assert_eq!(zstd::bulk::decompress(&small, text.len()).expect("sound"), text);
        assert_eq!(bulk::decompress(&small, text.len()).expect("sound"), text);
    }
}
