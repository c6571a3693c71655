//! `osp race`: structures on one session in turns, frame by frame.

use super::{
    bench::command,
    outcome::Outcome,
    output::{complain, file_name, say},
    outputs::{Output, Outputs},
    race_args::RaceArgs,
    race_film,
    race_view::RaceView,
    session::{OpenSession, Reader},
    version,
};
use glam::Vec3;
use osp::{
    math::{rotate, unit},
    view::View,
};
use osp_lab::{
    Machine,
    bench::{RaceError, RaceFilm, RaceInput, RaceReport, race},
};
use osp_session::{
    output_file::OutputKind,
    recording::{Event, Header, RecordingError, SynthKind, synthesize},
    replay::{ArtistSide, CameraPath, Summary, main_bounds, root_cube, summarize, whole_view},
};

pub(super) fn run(args: &RaceArgs) -> anyhow::Result<Outcome> {
    args.check()?;
    let mut outputs = Outputs::new(args.force).reads(&args.file);
    let csv = outputs.add_any("--csv", args.csv.as_ref(), OutputKind::Csv)?;
    let film = outputs.add_any("--film", args.film.as_ref(), OutputKind::Gif)?;
    let report = match (&args.file, args.synth) {
        (Some(file), _) => {
            // A thread that reads ahead would take a core from the structures, or their own.
            let open = || OpenSession::read_by(Reader::Here, file, &args.reading);
            let mut session = open()?;
            let header = session.header.clone();
            let (summary, view, read) = look(args, &header, &mut session);
            session.notes().warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
            read?;
            args.reading.check_frames(file, &summary, args.pace)?;
            let name = file_name(file);
            race_on(args, &name, &header, summary, open, film.map(|film| (film, view)))
        }
        (None, polygons) => {
            let open = || synthesize(SynthKind::Scribble, polygons.unwrap_or_default(), 1);
            let session = open();
            let header = session.header.clone();
            let (summary, view, read) = look(args, &header, session);
            read?;
            race_on(args, &header.source, &header, summary, || Ok(open()), film.map(|film| (film, view)))
        }
    };
    let report = match report {
        Err(error) if matches!(error.downcast_ref(), Some(RaceError::Differ { .. })) => {
            complain(&error.to_string());
            return Ok(Outcome::CheckFailed);
        }
        report => report?,
    };
    if let Some(output) = csv {
        output.write(report.rows.to_csv().as_bytes())?;
    }
    say(&if args.json { report.to_json() } else { report.to_text() })?;
    Ok(Outcome::Done)
}

/// The contents of a session, and a view of its finished model for the film.
fn look(
    args: &RaceArgs,
    header: &Header,
    events: impl Iterator<Item = Result<Event, RecordingError>>,
) -> (Summary, View, Result<(), RecordingError>) {
    let mut artist = ArtistSide::default();
    let events = events.inspect(|event| event.iter().for_each(|event| artist.note(event)));
    let (summary, model, read) = summarize(events, args.pace);
    let of_camera = header.camera.map(|camera| rotate(unit(camera.q), Vec3::Z));
    let backwards = of_camera.or_else(|| artist.backwards());
    let view = whole_view(&main_bounds(&model, &summary.bounds), backwards, RaceFilm::MODEL_ASPECT);
    (summary, view, read)
}

fn race_on<I>(
    args: &RaceArgs,
    name: &str,
    header: &Header,
    summary: Summary,
    open: impl Fn() -> anyhow::Result<I>,
    film: Option<(Output, View)>,
) -> anyhow::Result<RaceReport>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let camera = CameraPath::new(args.camera, header.camera, &summary.bounds);
    let input = RaceInput {
        recording: name.to_owned(),
        summary,
        pace: args.pace,
        camera: (camera, args.camera.name()),
        root: root_cube(header, &summary.bounds),
        kinds: args.index.clone(),
    };
    let mut view = RaceView::new(args.runs);
    let mut run = || {
        view.begin();
        race(&input, open()?, |race| view.show(race)).map_err(|error| match error {
            // It names the file, so that its readers can be told how to get at the rest.
            RaceError::Recording(error) => error.into(),
            error => anyhow::Error::from(error),
        })
    };
    let mut race = run()?;
    for _ in 1..args.runs {
        race = race.least(&run()?);
    }
    view.finish();
    if let Some((output, view)) = film {
        race_film::write(&output, &race, view, open()?)?;
    }
    Ok(RaceReport::new(&race, Machine::here(version::COMMIT), command()))
}
