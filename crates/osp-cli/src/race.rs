//! `osp race`: runs structures on one session in turns, frame by frame.

use std::io;

use anyhow::Context;

use super::{
    bench::command,
    bench_args::RaceArgs,
    gif_file::GifFile,
    output::{Outcome, file_name, print_result, warn},
    outputs::Output,
    progress,
    race_view::RaceView,
    read_session::{Keep, ReadSession},
    version,
};
use osp::view::View;
use osp_lab::{
    Machine,
    bench::{FilmError, Race, RaceError, RaceFilm, RaceInput, RaceReport, race},
};
use osp_session::{
    recording::{Event, RecordingError, SynthKind, synthesize},
    replay::{CameraPath, main_bounds, whole_view},
};

/// Duration of a film without the pause at its end, hundredths of a second.
const GROWING: usize = 1300;
/// Duration of the pause at the end of a film, hundredths of a second.
const END: u16 = 300;

pub(super) fn run(args: &RaceArgs) -> anyhow::Result<Outcome> {
    args.check()?;
    let mut outputs = args.force.outputs().reads(&args.file);
    let csv = outputs.add_any(args.csv.as_ref(), &[])?;
    let film = outputs.add_any(args.film.as_ref(), &[".gif"])?;
    let report = match (&args.file, args.synth) {
        (Some(file), _) => {
            let session = ReadSession::at(file, &args.reading, args.pace, Keep::Events)?;
            args.reading.check_frames(file, &session.summary, args.pace)?;
            race_on(args, &file_name(file), &session, film)
        }
        (None, polygons) => {
            let session = synthesize(SynthKind::Scribble, polygons.unwrap_or_default(), 1);
            let header = session.header.clone();
            let (session, read) = ReadSession::of(header, session, args.pace, Keep::Events, |_, _| {});
            read?;
            race_on(args, &session.header.source, &session, film)
        }
    };
    let report = match report {
        Err(error) if matches!(error.downcast_ref(), Some(RaceError::Differ { .. })) => {
            warn(&error.to_string());
            return Ok(Outcome::CheckFailed);
        }
        report => report?,
    };
    if let Some(output) = csv {
        output.write(report.rows.to_csv().as_bytes())?;
    }
    print_result(&if args.json { serde_json::to_string(&report)? } else { report.to_text() })?;
    Ok(Outcome::Done)
}

fn race_on(
    args: &RaceArgs,
    name: &str,
    session: &ReadSession,
    film: Option<Output>,
) -> anyhow::Result<RaceReport> {
    let ReadSession { header, summary, end, direction_to_artist, .. } = session;
    let summary = *summary;
    // The view of the film.
    let bounds = main_bounds(&end.scene, &summary.bounds);
    let whole = whole_view(&bounds, *direction_to_artist, RaceFilm::MODEL_ASPECT);
    let camera = CameraPath::new(args.camera, header.camera, &summary.bounds);
    let input = RaceInput {
        recording: name.to_owned(),
        summary,
        pace: args.pace,
        camera: (camera, args.camera.name()),
        root: session.index.root,
        kinds: args.kinds(),
    };
    let mut view = RaceView::new(args.runs);
    let mut run = || {
        view.begin();
        race(&input, session.events(), |race| view.show(race)).map_err(|error| match error {
            // Unwraps the error, because the hint about a damaged session needs its type.
            RaceError::Recording(error) => error.into(),
            error => anyhow::Error::from(error),
        })
    };
    let mut race = run()?;
    for _ in 1..args.runs {
        race = race.least(&run()?);
    }
    view.finish();
    if let Some(output) = film {
        write_film(&output, &race, whole, session.events())?;
    }
    Ok(RaceReport::new(&race, Machine::here(version::COMMIT), command()))
}

/// Writes the film of a race. It plays `events` and shows the model in `view`.
fn write_film(
    output: &Output,
    race: &Race,
    view: View,
    events: impl Iterator<Item = Result<Event, RecordingError>>,
) -> anyhow::Result<()> {
    let film = RaceFilm::new(race, &Machine::here(version::COMMIT));
    let name = || output.path().display().to_string();
    anyhow::ensure!(film.frames() > 0, "{}: there is no frame to draw", name());
    let delay = (GROWING / film.frames()) as u16;
    let mut file = GifFile::begin(output.create()?, film.size()).with_context(name)?;
    let progress = progress::bar(film.frames() as u64, "frames", &name());
    let mut drawn = 0;
    let take = |rgb: &[u8]| -> io::Result<()> {
        drawn += 1;
        progress.inc(1);
        file.add(rgb, if drawn == film.frames() { delay + END } else { delay })
    };
    film.draw(view, events, take).map_err(|error| match error {
        // Unwraps the error, because the hint about a damaged session needs its type.
        FilmError::Recording(error) => error.into(),
        error => anyhow::Error::from(error).context(name()),
    })?;
    progress.finish_and_clear();
    output.commit(file.finish().with_context(name)?)?;
    Ok(())
}
