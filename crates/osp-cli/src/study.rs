//! `osp study`: measures many sessions and writes a line of JSON for each.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, bail, ensure};
use clap::Args;
use indicatif::ProgressBar;

use super::{
    output::{Outcome, print_result, warn},
    outputs::ForceArgs,
    progress,
    replay_args::{PlayArgs, TuningArgs},
    replay_session::{ReplayContext, Replayed, replay},
    session::Reader,
    study_contents::Contents,
    study_lines::{Found, Place, StudyFile, StudyLine},
    verify_all::{Part, name_in, sessions},
};
use osp::frame::AutoBasis;
use osp_session::recording::RecordingError;

/// Measure sessions and write a line of JSON for each.
///
/// A line holds the output of `osp replay --json`, the file and a hash of its contents, the options, the machine and the
/// build of osp. If osp cannot read a session, the line holds the error.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp study sketches --out results.ndjson
  osp study sketch.tilt --index osp,octree-rebuild,bvh-sah --camera inside
  find sketches -name '*.tilt' | parallel osp study {} --out results.ndjson

osp adds lines to FILE. It skips a session if FILE has a result for the same session contents, options, machine and \
build of osp. So the same command continues after an interruption. Several processes may add to one FILE.
Exit codes: 1 if two indexes find different visible polygons in a session, else 2 if osp cannot read a session.
docs/study.md describes the fields, recipes for GNU parallel, Slurm and Ray, and SQL queries.
`osp replay --help` describes the indexes and the methods of occlusion culling.")]
pub(super) struct StudyArgs {
    /// The sessions, of any format that replay reads, or folders of them.
    #[arg(required = true, value_name = "FILES_OR_FOLDERS")]
    files: Vec<PathBuf>,
    /// The file to add lines to, .ndjson [default: print the lines].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    play: PlayArgs,
}

struct Study<'a> {
    play: &'a PlayArgs,
    options: String,
    place: Place,
    /// The file that gets the lines. `None` prints the lines.
    file: Option<StudyFile>,
    /// Results of the sessions measured so far, by the hash of their contents. Used without a file.
    printed: HashMap<String, Found>,
    measured: usize,
}

pub(super) fn run(args: &StudyArgs) -> anyhow::Result<Outcome> {
    if let Some(method) = args.play.occlusion.iter().find(|method| method.is_while_drawing()) {
        bail!("osp study draws nothing: expected methods that run on the CPU; found `{}`", method.name());
    }
    args.play.check(false)?;
    let sessions = sessions(&args.files, Part::WHOLE)?;
    let (options, place) = (args.play.in_one_line(), Place::here()?);
    let out = args.out.as_deref().filter(|out| *out != Path::new("-"));
    let file = out.map(|out| StudyFile::open(out, &sessions, args.force.force)).transpose()?;
    let mut study = Study { play: &args.play, options, place, file, printed: HashMap::new(), measured: 0 };

    let (mut unread, mut disagreeing) = (0, 0);
    let bar = match &study.file {
        Some(_) => progress::bar(sessions.len() as u64, "sessions", "study"),
        // The printed lines show the progress.
        None => ProgressBar::hidden(),
    };
    for path in &sessions {
        let name = name_in(&args.files, path);
        let name = if cfg!(windows) { name.replace('\\', "/") } else { name };
        match study.found(path, &name)? {
            Found::Agreement => {}
            Found::Disagreement => {
                disagreeing += 1;
                warn(&format!("{name}: two indexes found different polygons"));
            }
            Found::Error(error) => {
                unread += 1;
                warn(&format!("warning: {error}"));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let many = sessions.len();
    if let Some(file) = &study.file {
        let (now, path) = (study.measured, file.path().display());
        print_result(&format!("{many} sessions: {now} measured now, {} before; {path}", many - now))?;
    }
    match (disagreeing, unread) {
        (0, 0) => Ok(Outcome::Done),
        (0, _) => bail!("{unread} of {many} sessions could not be read"),
        _ => Ok(Outcome::CheckFailed),
    }
}

impl Study<'_> {
    /// Returns the result of a session. Measures a new session and writes its line.
    fn found(&mut self, path: &Path, name: &str) -> anyhow::Result<Found> {
        let contents = Contents::of(path).with_context(|| path.display().to_string());
        if let Ok(Contents { hash, .. }) = &contents {
            let found = match &mut self.file {
                Some(file) => file.find(hash, &self.options, &self.place)?,
                None => self.printed.get(hash),
            };
            if let Some(found) = found {
                return Ok(found.clone().of(name));
            }
        }
        self.measured += 1;
        let start = Instant::now();
        let mut line = StudyLine::new(name, &self.options, &self.place);
        if let Err(error) = self.measure(path, contents, &mut line) {
            line.error = Some(format!("{error:#}"));
        }
        line.measuring_s = start.elapsed().as_secs_f64();
        let found = line.found();
        match &mut self.file {
            Some(file) => file.add(&line)?,
            None => {
                print_result(&serde_json::to_string(&line)?)?;
                line.file_hash.and_then(|hash| self.printed.insert(hash, found.clone()));
            }
        }
        Ok(found)
    }

    fn measure(
        &self,
        path: &Path,
        contents: anyhow::Result<Contents>,
        line: &mut StudyLine<'_>,
    ) -> anyhow::Result<()> {
        let contents = contents?;
        line.file_bytes = Some(contents.bytes);
        let context = ReplayContext {
            // Other processes may use the other cores, so there is no reader thread.
            reader: Reader::Here,
            basis: AutoBasis::Work,
            progress: |_, _| ProgressBar::hidden(),
            remark: &mut |remark| line.remarks.push(remark.to_owned()),
            rig: None,
            csv: None,
            verify_frames: 0,
            #[cfg(feature = "render")]
            draw: None,
        };
        let replayed = replay(self.play, &TuningArgs::default(), path, context);
        // If the file changed during the measurement, the hash is not that of the measured contents.
        let is_the_same = Contents::of(path).is_ok_and(|now| now == contents);
        ensure!(is_the_same, "{}: the session changed during the measurement", path.display());
        // After an I/O error, a later run may succeed. It measures a session again if the line has no hash.
        if !replayed.as_ref().is_err_and(is_of_the_system) {
            line.file_hash = Some(contents.hash);
        }
        let Replayed { report, format, skipped } = replayed?;
        (line.format, line.skipped, line.report) = (Some(format), Some(skipped), Some(report));
        Ok(())
    }
}

fn is_of_the_system(error: &anyhow::Error) -> bool {
    let cause = error.chain().find_map(|cause| cause.downcast_ref::<RecordingError>());
    matches!(cause, Some(RecordingError::Io { .. }))
}
