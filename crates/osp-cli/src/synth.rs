//! `osp synth`: writes a synthetic session that depends on a seed.

use std::path::PathBuf;

use clap::Args;
use indicatif::HumanBytes;

use super::{
    import::{NewRecording, RECORDING},
    output::{Outcome, one_line, print_result},
    outputs::ForceArgs,
    parsers::named,
    progress,
};
use osp_lab::report::thousands;
use osp_session::recording::{Event, SynthKind, synthesize};

/// Generate a session from a seed.
///
/// The same kind, number of polygons and seed give the same file, byte for byte, on every machine.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp synth room --polygons 12000 --seed 1 room.ron
  osp synth brushes --polygons 2304 brushes.ron
  osp synth scribble --polygons 1000000 --seed 7 long.ron.zst

Kinds:
  portrait  dense small strokes on a bust; the artist walks around it
  room      walls, furniture and ribbons in several rooms; the artist walks
            through them
  scribble  long loose strokes that fill the whole 4 m volume
  brushes   a card of all brushes: each brush draws a wave, in rows (--polygons
            2304: each brush once)")]
pub(super) struct SynthArgs {
    /// Kind of the session.
    #[arg(value_parser = named(&SynthKind::ALL, SynthKind::name))]
    kind: SynthKind,
    /// File to write, `.ron` or `.ron.zst`.
    out: PathBuf,
    /// Number of polygons to draw. The session ends after the stroke that reaches this number.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    polygons: u32,
    /// Seed of the random numbers; another seed gives another session of the same kind.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    force: ForceArgs,
}

pub(super) fn run(args: &SynthArgs) -> anyhow::Result<Outcome> {
    let session = synthesize(args.kind, args.polygons, args.seed);
    let output = args.force.outputs().add(&args.out, RECORDING)?;
    let mut recording = NewRecording::create(output, &session.header)?;
    let progress = progress::events(&args.out.to_string_lossy());
    let (mut strokes, mut points, mut events) = (0, 0, 0);
    for event in session {
        let event = event?;
        strokes += u64::from(matches!(event, Event::Begin { .. }));
        points += u64::from(matches!(event, Event::Point { .. }));
        events += 1;
        recording.write(&event)?;
        if events % 4096 == 0 {
            progress.set_position(events);
        }
    }
    progress.finish_and_clear();
    let bytes = recording.finish()?;
    print_result(&format!(
        "{}: {}, {} strokes, {} points, {} events{}",
        one_line(&args.out.to_string_lossy()),
        args.kind,
        thousands(strokes),
        thousands(points),
        thousands(events),
        bytes.map_or_else(String::new, |bytes| format!(", {}", HumanBytes(bytes))),
    ))?;
    Ok(Outcome::Done)
}
