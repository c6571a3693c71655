//! Writes films as MP4 files with pictures in H.264. The index is at the beginning, so a player can begin during a
//! download.

use std::{
    io::{self, Seek, SeekFrom, Write},
    num::NonZeroU32,
};

use openh264::{
    OpenH264API,
    encoder::{
        BitRate, ColorPrimaries, Complexity, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod,
        QpRange, RateControlMode, TransferCharacteristics, VuiConfig,
    },
    formats::{RgbaSliceU8, YUVBuffer},
};
use shiguredo_mp4::{
    TrackKind, Utf8String,
    bitstream::h264::{
        H264NalUnitType, H264SampleEntryConfig, LengthSize, build_avc1_box_from_annexb,
        parse_annexb_nal_units,
    },
    boxes::SampleEntry,
    mux::{Mp4FileMuxer, Mp4FileMuxerOptions, Sample, TrackMetadata, estimate_maximum_moov_box_size},
};

use osp_session::atomic_file::AtomicFile;

/// Quantizer of all pictures, 0 to 51. A quantizer larger by six halves the file, but thin strokes begin to
/// smear.
const QUANTIZER: u8 = 22;
/// Bit rate, bits a second, from which the encoder derives the level that the file declares. The true rate
/// depends on the quantizer alone.
const DECLARED_BITS: u32 = 20_000_000;
/// Time between pictures that a player can jump to, seconds.
const KEY_PERIOD_S: u32 = 2;

/// A film that is being written.
pub(super) struct Mp4File {
    file: AtomicFile,
    /// Number of bytes written.
    position: u64,
    muxer: Mp4FileMuxer,
    encoder: Encoder,
    picture: YUVBuffer,
    size: (usize, usize),
    pictures_a_second: NonZeroU32,
}

impl Mp4File {
    /// Starts a film of this size in pixels and this number of pictures. The sides must be even and within the limits.
    pub(super) fn begin(
        mut file: AtomicFile,
        (width, height): (u32, u32),
        pictures_a_second: NonZeroU32,
        pictures: u64,
    ) -> io::Result<Self> {
        let rate = pictures_a_second.get();
        let config = EncoderConfig::new()
            // This control chooses a quantizer within a range. The range has one value, so all pictures have the same
            // quality and take as many bits as they need.
            .rate_control_mode(RateControlMode::Bufferbased)
            .qp(QpRange::new(QUANTIZER, QUANTIZER))
            .bitrate(BitRate::from_bps(DECLARED_BITS))
            .skip_frames(false)
            .complexity(Complexity::High)
            .max_frame_rate(FrameRate::from_hz(rate as f32))
            .intra_frame_period(IntraFramePeriod::from_num_frames(rate * KEY_PERIOD_S))
            // The conversion to YUV has the matrix of BT.601; the pixels have the colours of screens (BT.709).
            .vui(
                VuiConfig::bt601()
                    .color_primaries(ColorPrimaries::Bt709)
                    .transfer_characteristics(TransferCharacteristics::Bt709),
            );
        let encoder =
            Encoder::with_api_config(OpenH264API::from_source(), config).map_err(io::Error::other)?;
        let pictures = usize::try_from(pictures).map_err(io::Error::other)?;
        let muxer = Mp4FileMuxer::with_options(Mp4FileMuxerOptions {
            reserved_moov_box_size: estimate_maximum_moov_box_size(&[pictures]),
            video_track: TrackMetadata {
                name: Utf8String::new("osp film").unwrap_or_default(),
                ..TrackMetadata::default()
            },
            ..Mp4FileMuxerOptions::default()
        })
        .map_err(io::Error::other)?;
        file.write_all(muxer.initial_boxes_bytes())?;
        let position = muxer.initial_boxes_bytes().len() as u64;
        let size = (width as usize, height as usize);
        let picture = YUVBuffer::new(size.0, size.1);
        Ok(Self { file, position, muxer, encoder, picture, size, pictures_a_second })
    }

    /// Appends a picture and shows it for this number of pictures. `rgba` has red, green, blue and alpha bytes in rows
    /// from the top.
    pub(super) fn add(&mut self, rgba: &[u8], pictures: u32) -> io::Result<()> {
        self.picture.read_rgba8(RgbaSliceU8::new(rgba, self.size));
        (0..pictures).try_for_each(|_| self.encode())
    }

    fn encode(&mut self) -> io::Result<()> {
        let encoded = self.encoder.encode(&self.picture).map_err(io::Error::other)?;
        let keyframe = encoded.frame_type() == FrameType::IDR;
        let stream = encoded.to_vec();
        let mut bytes = Vec::with_capacity(stream.len());
        for unit in parse_annexb_nal_units(&stream).map_err(io::Error::other)? {
            // Skips the parameter sets, which are in the head of the file.
            if !matches!(unit.nal_unit_type, H264NalUnitType::Sps | H264NalUnitType::Pps) {
                bytes.extend(u32::try_from(unit.data.len()).map_err(io::Error::other)?.to_be_bytes());
                bytes.extend(unit.data);
            }
        }
        if bytes.is_empty() {
            return Err(io::Error::other("the encoder skipped a picture"));
        }
        let is_first = self.position == self.muxer.initial_boxes_bytes().len() as u64;
        let config = H264SampleEntryConfig { length_size: LengthSize::FourBytes };
        let entry = is_first.then(|| build_avc1_box_from_annexb(&stream, &config)).transpose();
        let sample_entry = entry.map_err(io::Error::other)?.map(SampleEntry::Avc1);
        self.file.write_all(&bytes)?;
        self.muxer
            .append_sample(&Sample {
                track_kind: TrackKind::Video,
                sample_entry,
                keyframe,
                timescale: self.pictures_a_second,
                duration: 1,
                composition_time_offset: None,
                data_offset: self.position,
                data_size: bytes.len(),
            })
            .map_err(io::Error::other)?;
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// Finishes the film: writes its head into the bytes reserved for it.
    pub(super) fn finish(mut self) -> io::Result<AtomicFile> {
        let mut out = self.file.handle()?;
        for (offset, bytes) in self.muxer.finalize().map_err(io::Error::other)?.offset_and_bytes_pairs() {
            out.seek(SeekFrom::Start(offset))?;
            out.write_all(bytes)?;
        }
        Ok(self.file)
    }
}
