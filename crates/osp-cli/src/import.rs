//! `osp import`: writes a session of any format as a recording.

use std::{io, path::PathBuf};

use anyhow::anyhow;
use clap::Args;

use super::{
    output::{Outcome, one_line, print_result, warn},
    outputs::{ForceArgs, Output},
    reading::ReadArgs,
    session::OpenSession,
};
use osp_lab::report::thousands;
use osp_session::{
    atomic_file::AtomicFile,
    recording::{Event, Flush, Header, RecordingError, RecordingFile, RonWriter},
};

/// Endings of a recording's name.
pub(super) const RECORDING: &[&str] = &[".ron", ".ron.zst"];

/// Convert a session to osp's own format.
///
/// The format is text with one event a line, plain or compressed. The output is in metres and right-handed, with y up. The events keep the order of the input. The output file appears
/// only when it is complete.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp import sketch.tilt sketch.ron.zst
  osp import painting.apa painting.ron
  osp import sketch_history/chair.json chair.ron   (also reads raw_data/)
  osp import cut-off.tilt rescued.ron --lenient")]
pub(super) struct ImportArgs {
    /// The session: .tilt (file or folder), .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb, .gltf, .ron or .ron.zst.
    input: PathBuf,
    /// The recording to write: .ron, or .ron.zst to compress it.
    output: PathBuf,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    reading: ReadArgs,
}

#[derive(Default)]
pub(super) struct Counts {
    events: u64,
    strokes: u64,
    points: u64,
    polygons: u64,
    heads: u64,
    edits: u64,
}

impl Counts {
    fn add(&mut self, event: &Event) {
        self.events += 1;
        match event {
            Event::Begin { .. } => self.strokes += 1,
            Event::Point { .. } => self.points += 1,
            Event::Polygon { .. } => self.polygons += 1,
            Event::Head { .. } => self.heads += 1,
            Event::Join { .. } | Event::Leave { .. } => {}
            Event::End { .. } | Event::Step { .. } | Event::Layer { .. } | Event::View { .. } => {}
            Event::Erase { .. }
            | Event::Undo { .. }
            | Event::Redo { .. }
            | Event::Move { .. }
            | Event::Group { .. }
            | Event::Assign { .. }
            | Event::Place { .. } => self.edits += 1,
        }
    }

    /// Returns the counts by kind as text. Strokes and points are always listed, the other kinds only if they are not
    /// zero.
    pub(super) fn text(&self) -> String {
        let rest = [(self.polygons, "faces"), (self.heads, "head poses"), (self.edits, "edits")];
        [(self.strokes, "strokes"), (self.points, "points")]
            .into_iter()
            .chain(rest.into_iter().filter(|&(count, _)| count > 0))
            .map(|(count, of)| format!("{} {of}", thousands(count)))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

pub(super) fn run(args: &ImportArgs) -> anyhow::Result<Outcome> {
    let mut outputs = args.force.outputs().reads([&args.input]);
    let output = outputs.add(&args.output, RECORDING)?;

    let mut session = OpenSession::open(&args.input, &args.reading)?.counted();
    let (counts, bytes) = convert(&mut session, output, args.reading.lenient)?;

    session.warn();
    let notes = session.notes();
    if notes.skipped > 0 {
        warn(&format!("damaged parts skipped: {}", thousands(notes.skipped)));
    }
    print_result(&format!(
        "{} ({}) -> {}: {}{}",
        one_line(&args.input.to_string_lossy()),
        session.format,
        one_line(&args.output.to_string_lossy()),
        counts.text(),
        bytes.map_or_else(String::new, |bytes| format!("; {} bytes", thousands(bytes))),
    ))?;
    Ok(Outcome::Done)
}

/// Writes the whole session. Returns the counts of its parts, and the size of the file in bytes.
pub(super) fn convert(
    session: &mut OpenSession,
    output: Output,
    lenient: bool,
) -> anyhow::Result<(Counts, Option<u64>)> {
    let mut recording = NewRecording::create(output, &session.header)?;
    let mut counts = Counts::default();
    for event in session.by_ref() {
        let event = event.map_err(|error| explain(&error, lenient))?;
        recording.write(&event)?;
        counts.add(&event);
    }
    Ok((counts, recording.finish()?))
}

pub(super) fn explain(error: &RecordingError, lenient: bool) -> anyhow::Error {
    let hint = if lenient { "" } else { " (--lenient keeps what can be read)" };
    anyhow!("{error}; nothing was written{hint}")
}

/// A recording that a command writes. The file appears under its name only when it is complete.
pub(super) struct NewRecording {
    // Rust drops fields in this order, so the writer closes before the file gets its name or is removed.
    writer: RonWriter<RecordingFile>,
    file: AtomicFile,
    output: Output,
    /// Whether the reader of the pipe has closed it, which is no error.
    nobody_reads: bool,
}

impl NewRecording {
    /// Creates a temporary file in the folder of the output.
    pub(super) fn create(output: Output, header: &Header) -> anyhow::Result<Self> {
        let path = output.path();
        let mut file = output.create()?;
        let under = file.handle().and_then(|handle| RecordingFile::over(handle, path));
        let under = under.map_err(|error| RecordingError::io(path, error))?;
        let writer = RonWriter::new(under, path, header, Flush::AtEnd)?;
        Ok(Self { writer, file, output, nobody_reads: false })
    }

    pub(super) fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        if !self.nobody_reads {
            self.nobody_reads = !is_read(self.writer.write(event))?;
        }
        Ok(())
    }

    /// Gives the recording its name. Returns its size in bytes if it is a file.
    pub(super) fn finish(self) -> anyhow::Result<Option<u64>> {
        if !self.nobody_reads {
            is_read(self.writer.finish())?;
        }
        self.output.commit(self.file)
    }
}

/// Whether the output still has a reader.
fn is_read(written: Result<(), RecordingError>) -> Result<bool, RecordingError> {
    match written {
        Ok(()) => Ok(true),
        Err(RecordingError::Io { cause, .. }) if cause.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(error),
    }
}
