//! Films in MP4, read by a demultiplexer and a decoder.

use std::fs;

use openh264::{decoder::Decoder, formats::YUVSource};
use shiguredo_mp4::{
    bitstream::h264::{LengthSize, length_prefixed_to_annexb},
    boxes::SampleEntry,
    demux::{Input, Mp4FileDemuxer},
};

/// The pictures of a film, red, green and blue, and what its head says.
pub(crate) struct Mp4Film {
    pub(crate) size: (usize, usize),
    pub(crate) pictures: Vec<Vec<[u8; 3]>>,
    /// Numbers of the pictures that a player can jump to.
    pub(crate) keys: Vec<usize>,
    pub(crate) seconds: f64,
    /// Whether a player can begin before it has the whole file.
    pub(crate) head_is_first: bool,
}

impl Mp4Film {
    pub(crate) fn open(path: &str) -> Self {
        let bytes = fs::read(path).expect("a film");
        let at = |name: &[u8; 4]| bytes.windows(4).position(|part| part == name).expect("a box");
        let head_is_first = at(b"moov") < at(b"mdat");
        let mut demuxer = Mp4FileDemuxer::new();
        while demuxer.required_input().is_some() {
            demuxer.handle_input(Input { position: 0, data: &bytes });
        }
        let [track] = demuxer.tracks().expect("an MP4") else { panic!("one track") };
        let seconds = track.duration as f64 / f64::from(track.timescale.get());
        let (mut decoder, mut pictures) = (Decoder::new().expect("a decoder"), Vec::new());
        let (mut size, mut keys) = ((0, 0), Vec::new());
        while let Some(sample) = demuxer.next_sample().expect("a whole film") {
            let number = pictures.len();
            assert_eq!((sample.timestamp, sample.duration), (number as u64, 1), "an even rate");
            let mut stream = Vec::new();
            if let Some(SampleEntry::Avc1(entry)) = sample.sample_entry {
                size = (usize::from(entry.visual.width), usize::from(entry.visual.height));
                for set in entry.avcc_box.sps_list.iter().chain(&entry.avcc_box.pps_list) {
                    stream.extend([0, 0, 0, 1]);
                    stream.extend(set);
                }
            }
            if sample.keyframe {
                keys.push(number);
            }
            let data = &bytes[sample.data_offset as usize..][..sample.data_size];
            stream.extend(length_prefixed_to_annexb(data, LengthSize::FourBytes).expect("units"));
            let decoded = decoder.decode(&stream).expect("a picture").expect("no picture waits for others");
            assert_eq!(decoded.dimensions(), size, "the head says the size of the pictures");
            let mut rgb = vec![0; size.0 * size.1 * 3];
            decoded.write_rgb8(&mut rgb);
            pictures.push(rgb.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect());
        }
        Self { size, pictures, keys, seconds, head_is_first }
    }
}
