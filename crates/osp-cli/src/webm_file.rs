//! Writes films as WebM files with pictures in AV1. The index of the pictures that a player can jump to is at the end.

use std::{
    fs::File,
    io::{self, BufWriter, Seek, SeekFrom, Write},
    num::NonZeroU32,
    sync::{Arc, Mutex, PoisonError},
};

use openh264::formats::{RgbaSliceU8, YUVBuffer, YUVSource};
use rav1e::{
    color::{ColorDescription, ColorPrimaries, MatrixCoefficients, PixelRange, TransferCharacteristics},
    data::Rational,
    prelude::{Config, Context, EncoderConfig, EncoderStatus, FrameType},
};
use webm::mux::{Segment, SegmentBuilder, VideoCodecId, VideoTrack, Writer};

use osp_session::{atomic_file::AtomicFile, output_file::FILM_MARK};

/// The fastest of the encoder's presets, 0 to 10. Preset 8 takes 1.5 times as long and halves the file.
const SPEED: u8 = 10;
/// Base quantizer of all pictures, 0 to 255: about the quality of the films in MP4.
const QUANTIZER: usize = 80;
/// Time between pictures that a player can jump to, seconds.
const KEY_PERIOD_S: u64 = 2;
/// Number of parts of a picture that the encoder can encode at the same time.
const TILES: usize = 4;

/// A film that is being written.
pub(super) struct WebmFile {
    file: AtomicFile,
    encoder: Context<u8>,
    segment: Segment<Keeping>,
    track: VideoTrack,
    failure: Failure,
    picture: YUVBuffer,
    size: (usize, usize),
    pictures_a_second: u64,
    /// Number of pictures passed to the encoder.
    pictures: u64,
}

impl WebmFile {
    /// Starts a film of this size in pixels. The sides must be even, and at least 16.
    pub(super) fn begin(
        mut file: AtomicFile,
        (width, height): (u32, u32),
        pictures_a_second: NonZeroU32,
    ) -> io::Result<Self> {
        let size = (width as usize, height as usize);
        let rate = u64::from(pictures_a_second.get());
        let mut config = EncoderConfig {
            width: size.0,
            height: size.1,
            time_base: Rational::new(1, rate),
            // The conversion to YUV has the matrix of BT.601; the pixels have the colours of screens (BT.709).
            pixel_range: PixelRange::Limited,
            color_description: Some(ColorDescription {
                color_primaries: ColorPrimaries::BT709,
                transfer_characteristics: TransferCharacteristics::BT709,
                matrix_coefficients: MatrixCoefficients::BT601,
            }),
            quantizer: QUANTIZER,
            tiles: TILES,
            // Pictures leave the encoder in the order in which they are shown.
            low_latency: true,
            ..EncoderConfig::with_speed_preset(SPEED)
        };
        config.set_key_frame_interval(0, rate * KEY_PERIOD_S);
        let encoder: Context<u8> =
            Config::new().with_encoder_config(config).new_context().map_err(io::Error::other)?;
        let failure = Failure::default();
        let out = Keeping { out: BufWriter::new(file.handle()?), failure: failure.clone() };
        let (builder, track) = SegmentBuilder::new(Writer::new(out))
            .and_then(|builder| builder.set_writing_app(FILM_MARK))
            .and_then(|builder| builder.add_video_track(width, height, VideoCodecId::AV1, None))
            .and_then(|(builder, track)| {
                Ok((builder.set_codec_private(track, &encoder.container_sequence_header())?, track))
            })
            .map_err(|error| failure.cause(error))?;
        Ok(Self {
            file,
            encoder,
            segment: builder.build(),
            track,
            failure,
            picture: YUVBuffer::new(size.0, size.1),
            size,
            pictures_a_second: rate,
            pictures: 0,
        })
    }

    /// Appends a picture and shows it for this number of pictures. `rgba` has red, green, blue and alpha bytes in rows
    /// from the top.
    pub(super) fn add(&mut self, rgba: &[u8], pictures: u32) -> io::Result<()> {
        self.picture.read_rgba8(RgbaSliceU8::new(rgba, self.size));
        let mut frame = self.encoder.new_frame();
        let (y_stride, u_stride, v_stride) = self.picture.strides();
        let planes =
            [(self.picture.y(), y_stride), (self.picture.u(), u_stride), (self.picture.v(), v_stride)];
        for (plane, (bytes, stride)) in frame.planes.iter_mut().zip(planes) {
            plane.copy_from_raw_u8(bytes, stride, 1);
            // The encoder can do this only for a frame with one owner.
            plane.pad(self.size.0, self.size.1);
        }
        let frame = Arc::new(frame);
        for _ in 0..pictures {
            self.encoder.send_frame(Arc::clone(&frame)).map_err(io::Error::other)?;
            self.pictures += 1;
            self.write_encoded()?;
        }
        Ok(())
    }

    /// Writes the pictures that the encoder has finished.
    fn write_encoded(&mut self) -> io::Result<()> {
        loop {
            match self.encoder.receive_packet() {
                Ok(packet) => {
                    let at_ns = packet.input_frameno * 1_000_000_000 / self.pictures_a_second;
                    let is_key = packet.frame_type == FrameType::KEY;
                    self.segment
                        .add_frame(self.track, &packet.data, at_ns, is_key)
                        .map_err(|error| self.failure.cause(error))?;
                }
                Err(EncoderStatus::Encoded) => {}
                Err(EncoderStatus::NeedMoreData | EncoderStatus::LimitReached) => return Ok(()),
                Err(status) => return Err(io::Error::other(status)),
            }
        }
    }

    /// Finishes the film: writes its last pictures and its index.
    pub(super) fn finish(mut self) -> io::Result<AtomicFile> {
        self.encoder.flush();
        self.write_encoded()?;
        // The format counts milliseconds.
        let length_ms = self.pictures * 1000 / self.pictures_a_second;
        let written = self.segment.finalize(Some(length_ms));
        let mut out =
            written.map_err(|_| self.failure.cause("the index cannot be written"))?.into_inner().out;
        out.flush()?;
        Ok(self.file)
    }
}

/// The first error of a file. The library that writes the format only reports that there was one.
#[derive(Clone, Default)]
struct Failure(Arc<Mutex<Option<io::Error>>>);

impl Failure {
    /// Returns the file's error, or this error if the file had none.
    fn cause(&self, error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> io::Error {
        let first = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        first.unwrap_or_else(|| io::Error::other(error))
    }
}

/// A file that stores its first error.
struct Keeping {
    out: BufWriter<File>,
    failure: Failure,
}

impl Keeping {
    fn noted<T>(&self, outcome: io::Result<T>) -> io::Result<T> {
        outcome.map_err(|error| {
            let kind = error.kind();
            self.failure.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            kind.into()
        })
    }
}

impl Write for Keeping {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let outcome = self.out.write(bytes);
        self.noted(outcome)
    }

    fn flush(&mut self) -> io::Result<()> {
        let outcome = self.out.flush();
        self.noted(outcome)
    }
}

impl Seek for Keeping {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let outcome = self.out.seek(to);
        self.noted(outcome)
    }

    /// Unlike the default, this keeps the buffer. The library reads the position before each element.
    fn stream_position(&mut self) -> io::Result<u64> {
        let outcome = self.out.stream_position();
        self.noted(outcome)
    }
}
