use std::{
    borrow::Cow,
    collections::{BTreeSet, HashMap},
    io::{self, BufRead, Read, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use osp_session::{
    platform::{fs, zstd},
    recording::{
        self, Event, EventSource, Flush, Header, OpenOptions, RecordingError, RonReader, RonWriter, StrokeId,
        read_event,
    },
    small_file::open_regular,
};

/// Size of a block of text that is compressed in one call, bytes. Compressing a block takes the window's thread about a
/// quarter of a millisecond.
const BLOCK_BYTES: usize = 1 << 16;
/// Longest line that is kept unchanged from the file, bytes.
const KEPT_LINE_BYTES: usize = 512;
/// The fastest compression level that halves a session's size or better.
const COMPRESSION_LEVEL: i32 = 1;

/// The lines of all events of a session in memory, the same as in its file. If the file is lost or damaged, the session
/// is written again from these lines.
///
/// A session that another file holds compactly has no lines until the first of them is needed.
#[derive(Debug)]
pub(super) struct History {
    lines: RonWriter<Text>,
    /// The file with all events, until the lines are written.
    source: Option<SourceFile>,
    header: Header,
    /// For each stroke, the range of bytes from its first line to the end of its last line.
    strokes: HashMap<StrokeId, (u64, u64)>,
}

impl History {
    pub(super) fn new(header: Header) -> Result<Self, RecordingError> {
        let lines = RonWriter::new(Text::default(), "the session", &header, Flush::EachEvent)?;
        Ok(Self { lines, source: None, header, strokes: HashMap::new() })
    }

    /// The empty history of a session that is then read from this file.
    pub(super) fn hold(&mut self, source: SourceFile) {
        self.source = Some(source);
    }

    /// Writes the lines of all events, if the history has none. Without this call only [`History::events`],
    /// [`History::push`] and [`History::log`] are available.
    pub(super) fn write_lines(&mut self) -> Result<(), RecordingError> {
        let Some(source) = &self.source else { return Ok(()) };
        let mut written = Self::new(self.header.clone())?;
        let mut session = source.open()?;
        while let Some(event) = session.events.next_event()? {
            let line = session.events.line().filter(|line| line.len() <= KEPT_LINE_BYTES);
            written.push_with(&event, line.unwrap_or_default())?;
        }
        *self = written;
        Ok(())
    }

    pub(super) fn header(&self) -> &Header {
        &self.header
    }

    pub(super) fn push(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.write_lines()?;
        self.push_with(event, "")
    }

    /// Appends events that were read, with their lines if the file has lines.
    pub(super) fn push_read(&mut self, lines: &Lines) -> Result<(), RecordingError> {
        if let Some(source) = &mut self.source {
            source.events += lines.events.len() as u64;
            let invalid = lines.events.iter().find(|event| event.check().is_err());
            return invalid.map_or(Ok(()), |event| self.lines.write(event));
        }
        let mut start = 0;
        for (event, &end) in lines.events.iter().zip(&lines.ends) {
            self.push_with(event, &lines.text[start..end])?;
            start = end;
        }
        Ok(())
    }

    /// Appends an event with its line, or with a new line if this one is empty.
    fn push_with(&mut self, event: &Event, line: &str) -> Result<(), RecordingError> {
        let start = self.bytes();
        match line {
            "" => self.lines.write(event)?,
            line => self.lines.write_line(line)?,
        }
        let end = self.bytes();
        match event {
            Event::Begin { stroke, .. } | Event::Polygon { stroke: Some(stroke), .. } => {
                self.strokes.entry(*stroke).or_insert((start, end)).1 = end;
            }
            // A damaged file may have millions of strokes without a beginning; such strokes must take no memory.
            Event::Point { stroke, .. } | Event::End { stroke, .. } => {
                if let Some(lines) = self.strokes.get_mut(stroke) {
                    lines.1 = end;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The events that drew these strokes, in order. Decompresses only the blocks with these events.
    pub(super) fn events_of(&self, strokes: &BTreeSet<StrokeId>) -> io::Result<Vec<Event>> {
        let mut ranges: Vec<(u64, u64)> =
            strokes.iter().filter_map(|stroke| self.strokes.get(stroke)).copied().collect();
        ranges.sort_unstable();
        // Ranges in the same block are read together, so that the block is decompressed once.
        ranges.dedup_by(|next, last| {
            let is_near = next.0 <= last.1 + BLOCK_BYTES as u64;
            if is_near {
                last.1 = last.1.max(next.1);
            }
            is_near
        });
        let mut events = Vec::new();
        let mut line = String::new();
        for (start, end) in ranges {
            let mut reader = self.text(start);
            let mut at = start;
            while at < end {
                line.clear();
                let count = reader.read_line(&mut line)?;
                if count == 0 {
                    break;
                }
                at += count as u64;
                let event = read_event(&line);
                events.extend(event.filter(|event| match event {
                    Event::Begin { stroke, .. }
                    | Event::Point { stroke, .. }
                    | Event::End { stroke, .. }
                    | Event::Polygon { stroke: Some(stroke), .. } => strokes.contains(stroke),
                    _ => false,
                }));
            }
        }
        Ok(events)
    }

    pub(super) fn bytes(&self) -> u64 {
        let text = self.lines.get_ref();
        text.sealed_bytes + text.open.len() as u64
    }

    pub(super) fn events(&self) -> u64 {
        self.source.as_ref().map_or(self.lines.lines() - 1, |source| source.events)
    }

    /// The text from byte `from` on. If a line begins at this byte, each piece that the reader fills consists of whole
    /// lines.
    pub(super) fn text(&self, from: u64) -> TextReader<'_> {
        self.lines.get_ref().reader(from)
    }

    /// A copy of all events for another thread. It shares the memory of the compressed blocks or of the file.
    pub(super) fn log(&self) -> Log {
        match &self.source {
            Some(source) => Log::Source(source.clone()),
            None => Log::Text(self.lines.get_ref().clone()),
        }
    }
}

/// All events of a session so far.
#[derive(Debug)]
pub(crate) enum Log {
    Source(SourceFile),
    Text(Text),
}

impl Log {
    pub(crate) fn read(&self) -> Result<Box<dyn EventSource + '_>, RecordingError> {
        Ok(match self {
            Self::Source(source) => source.open()?.events,
            Self::Text(text) => Box::new(text.read()?),
        })
    }
}

/// A session's file in memory, in a format that takes less memory than the lines of its events.
#[derive(Clone, Debug)]
pub(crate) struct SourceFile {
    path: PathBuf,
    bytes: Arc<[u8]>,
    options: OpenOptions,
    events: u64,
}

impl SourceFile {
    /// Reads a file of this format into memory. `None` if its lines take less memory, or it is too large.
    pub(crate) fn read(
        path: &Path,
        format: &str,
        options: OpenOptions,
    ) -> Result<Option<Self>, RecordingError> {
        if !["tilt", "apa", "ron.zst"].contains(&format) || !fs::is_file(path) {
            return Ok(None);
        }
        let (mut bytes, most) = (Vec::new(), options.limits.whole_bytes());
        let read = open_regular(path).and_then(|file| file.take(most + 1).read_to_end(&mut bytes));
        read.map_err(|error| RecordingError::io(path, error))?;
        let source = Self { path: path.to_owned(), bytes: bytes.into(), options, events: 0 };
        Ok(Some(source).filter(|source| source.bytes.len() as u64 <= most))
    }

    pub(crate) fn open(&self) -> Result<recording::Session, RecordingError> {
        recording::open_bytes(&self.path, Arc::clone(&self.bytes), &self.options)
    }
}

/// Events that were read from a file, and their lines if the file has lines.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    events: Vec<Event>,
    text: String,
    /// End of each event's line in `text`. An event without a line takes no bytes.
    ends: Vec<usize>,
    bytes: usize,
}

impl Lines {
    /// Adds an event, and the line that it was read from. A very long line is not kept but written again from its
    /// event, because the line may contain a comment of any length.
    pub(crate) fn push(&mut self, event: Event, line: Option<&str>) {
        self.events.push(event);
        self.bytes += line.map_or(0, str::len);
        self.text.push_str(line.filter(|line| line.len() <= KEPT_LINE_BYTES).unwrap_or_default());
        self.ends.push(self.text.len());
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(crate) fn events(&self) -> &[Event] {
        &self.events
    }
}

/// Lines in blocks. All blocks except the last are compressed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Text {
    blocks: Vec<Arc<Block>>,
    sealed_bytes: u64,
    open: Vec<u8>,
}

impl Text {
    fn reader(&self, from: u64) -> TextReader<'_> {
        let next = self.blocks.partition_point(|block| block.end <= from);
        let start = next.checked_sub(1).map_or(0, |last| self.blocks[last].end);
        TextReader { text: self, next, skips: (from - start) as usize, piece: Cow::Borrowed(&[]), read: 0 }
    }

    fn read(&self) -> Result<RonReader<TextReader<'_>>, RecordingError> {
        RonReader::new(self.reader(0), "the session", OpenOptions::default())
    }
}

#[derive(Debug)]
struct Block {
    /// Size of the text up to the block's end, bytes.
    end: u64,
    plain_bytes: usize,
    packed: Packed,
}

#[derive(Debug)]
enum Packed {
    Zstd(Vec<u8>),
    Plain(Vec<u8>),
}

impl Block {
    fn unpack(&self) -> io::Result<Cow<'_, [u8]>> {
        match &self.packed {
            Packed::Plain(bytes) => Ok(Cow::Borrowed(bytes)),
            Packed::Zstd(bytes) => zstd::bulk::decompress(bytes, self.plain_bytes).map(Cow::Owned),
        }
    }
}

impl Write for Text {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open.extend_from_slice(bytes);
        if self.open.len() >= BLOCK_BYTES {
            let plain_bytes = self.open.len();
            self.sealed_bytes += plain_bytes as u64;
            // If there is no memory for compression, the text stays uncompressed.
            let packed = match zstd::bulk::compress(&self.open, COMPRESSION_LEVEL) {
                Ok(packed) => Packed::Zstd(packed),
                Err(_) => Packed::Plain(self.open.clone()),
            };
            self.blocks.push(Arc::new(Block { end: self.sealed_bytes, plain_bytes, packed }));
            self.open.clear();
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A reader of a part of a history's text, block by block.
#[derive(Debug)]
pub(crate) struct TextReader<'h> {
    text: &'h Text,
    /// The next block; after the last block the open text.
    next: usize,
    /// Number of bytes of the next block that are not read.
    skips: usize,
    piece: Cow<'h, [u8]>,
    read: usize,
}

impl Read for TextReader<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.fill_buf()?.read(out)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for TextReader<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.read == self.piece.len() && self.next <= self.text.blocks.len() {
            self.piece = match self.text.blocks.get(self.next) {
                Some(block) => block.unpack()?,
                None => Cow::Borrowed(&self.text.open[..]),
            };
            self.read = std::mem::take(&mut self.skips).min(self.piece.len());
            self.next += 1;
        }
        Ok(&self.piece[self.read..])
    }

    fn consume(&mut self, count: usize) {
        self.read += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::recording::{Author, NormalRule, Tool};

    fn begin(stroke: u32) -> Event {
        Event::Begin {
            author: Author::SOLE,
            t: f64::from(stroke),
            stroke: StrokeId(stroke),
            tool: Tool::Ribbon,
            width: 0.01,
            color: (1.0, 1.0, 1.0, 1.0),
            paint: None,
            thinnest: 1.0,
            normal: NormalRule::default(),
        }
    }

    fn history(events: u32) -> History {
        let mut history = History::new(Header::new("a", "a test")).expect("a header");
        (0..events).for_each(|stroke| history.push(&begin(stroke)).expect("an event"));
        history
    }

    #[test]
    fn the_text_is_the_text_from_any_line_on() {
        let history = history(20_000);
        assert!(history.lines.get_ref().blocks.len() > 5, "several blocks");
        assert_eq!(history.events(), 20_000);
        let text = |from: usize| {
            let mut text = Vec::new();
            history.text(from as u64).read_to_end(&mut text).expect("memory");
            text
        };
        let whole = text(0);
        assert_eq!(whole.len() as u64, history.bytes());
        let starts = whole.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at + 1);
        for start in starts.step_by(777).chain([0, whole.len()]) {
            assert!(text(start) == whole[start..], "from byte {start}");
        }
        let packed: usize = history
            .lines
            .get_ref()
            .blocks
            .iter()
            .map(|block| match &block.packed {
                Packed::Zstd(bytes) => bytes.len(),
                Packed::Plain(_) => panic!("compressed"),
            })
            .sum();
        assert!(packed * 2 < whole.len(), "{packed} of {}", whole.len());
    }

    #[test]
    fn what_was_pushed_is_read() {
        let history = history(10_000);
        let log = history.log();
        let mut reader = log.read().expect("a header");
        for expected in 0..10_000 {
            let event = reader.next_event().expect("an event").expect("one more");
            assert_eq!(event, begin(expected));
        }
        assert_eq!(reader.next_event().expect("the end"), None);
    }

    #[test]
    fn the_events_of_a_stroke_are_found_wherever_they_lie() {
        let mut history = history(20_000);
        let event = Event::Polygon {
            author: Author::SOLE,
            t: 1.0,
            stroke: Some(StrokeId(5)),
            vertices: vec![glam::Vec3::ZERO, glam::Vec3::X, glam::Vec3::Y],
            shading: None,
            color: (1.0, 1.0, 1.0, 1.0),
        };
        history.push(&event).expect("an event");
        let stray = Event::End { t: 2.0, stroke: StrokeId(40_000) };
        history.push(&stray).expect("an event");
        let end = Event::End { t: 2.0, stroke: StrokeId(7) };
        history.push(&end).expect("an event");
        let of = |strokes: &[u32]| {
            history.events_of(&strokes.iter().map(|&stroke| StrokeId(stroke)).collect()).expect("memory")
        };
        assert_eq!(of(&[7, 19_999]), [begin(7), begin(19_999), end]);
        assert_eq!(of(&[5, 6, 40_000]), [begin(5), begin(6), event]);
        assert_eq!(history.strokes.len(), 20_000);
        assert_eq!(of(&[]), []);
    }

    #[test]
    fn what_no_recording_can_hold_changes_nothing() {
        let mut history = history(3);
        let before = history.bytes();
        history.push(&Event::Undo { author: Author::SOLE, t: f64::NAN }).expect_err("no time");
        assert_eq!((history.bytes(), history.events()), (before, 3));
    }
}
