//! `osp study FILES`: measures what has not been measured yet, and writes the table.

use std::{
    collections::{HashMap, HashSet},
    num::NonZero,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::Mutex,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::Instant,
};

use anyhow::{anyhow, bail};
use indicatif::ProgressBar;

use super::{
    Outcome,
    output::{complain, say},
    outputs::{Output, Outputs},
    replay_args::{PlayArgs, ReplayArgs},
    replay_session::{Around, Replayed, replay},
    session::Reader,
    study::MeasureArgs,
    study_files::{Contents, StudyFile, study_files},
    study_progress::StudyProgress,
    study_results::{Table, check_no_row_is_lost, row_hash},
    verify_all::Part,
};
use osp::frame::AutoBasis;
use osp_lab::{
    bench::Machine,
    report::thousands,
    study::{PartError, StudyPart, StudyRow, WorkFolder},
};
use osp_session::{atomic_file::Destination, platform::host_name, recording::RecordingError};

/// What a session is played on: the main thread's size on Linux.
const STACK_BYTES: usize = 8 << 20;
/// Remarks of a session that are kept.
const MOST_REMARKS: usize = 10;

/// How everything is measured.
struct Study<'a> {
    play: &'a PlayArgs,
    options: String,
    machine: Machine,
    /// Which build of osp measures.
    build: String,
    host: String,
    jobs: usize,
    folder: WorkFolder,
}

pub(super) fn measure(args: &MeasureArgs) -> anyhow::Result<Outcome> {
    args.play.check(false)?;
    let mut files = study_files(&args.files)?;
    let paths: Vec<PathBuf> = files.iter().map(|file| file.path.clone()).collect();
    let mut outputs = Outputs::new(args.force).reads(&paths);
    let output = args.out.as_ref().map(|out| Table::checked(&mut outputs, out, args.force)).transpose()?;
    let jobs = args.jobs.map_or_else(|| thread::available_parallelism().map_or(1, NonZero::get), usize::from);
    let machine = Machine::here(super::version::COMMIT);
    let study = Study {
        play: &args.play,
        options: args.play.in_one_line(),
        host: host_name(),
        jobs,
        folder: WorkFolder::create(&work_folder(args)?)?,
        build: build(&machine)?,
        machine,
    };

    let progress = StudyProgress::new("files read", files.iter().map(|_| 1).sum());
    let contents = in_parallel(jobs, files.len(), |i| {
        let contents = Contents::of(&files[i].path);
        progress.done(1);
        Ok(contents)
    })?;
    progress.end();
    files.iter_mut().zip(contents).for_each(|(file, contents)| file.contents = contents);
    let shard = args.shard.unwrap_or(Part::WHOLE);
    files.retain(|file| file.contents.is_in(shard, &file.name));

    if let Some(output) = &output {
        study.check_replaced(&files, output, args.force)?;
    }
    let missing = study.missing(&files)?;
    let progress = StudyProgress::new("sessions measured", missing.iter().map(|file| weight(file)).sum());
    progress.speak_before_a_signal_ends(&study.folder);
    let unread = in_parallel(jobs, missing.len(), |i| {
        let unread = study.measure_and_keep(missing[i])?;
        progress.done(weight(missing[i]));
        Ok(unread)
    })?;
    progress.end();
    let unread = unread.into_iter().flatten().filter_map(|row| Some((row.file_hash.clone()?, row)));
    study.write(&files, missing.len(), &unread.collect(), output)
}

/// What tells builds apart that may measure differently. Where the commit does not say what was built, the program's bytes do.
fn build(machine: &Machine) -> anyhow::Result<String> {
    let Machine { version, commit, optimized, simd, .. } = machine;
    let program = match commit.ends_with("-dirty") || commit == "unknown" {
        true => Contents::of(&std::env::current_exe()?).hash.map_err(|error| anyhow!(error))?,
        false => String::new(),
    };
    Ok(format!("{version} {commit} {optimized} {simd} {program}"))
}

/// The folder of what is kept.
fn work_folder(args: &MeasureArgs) -> anyhow::Result<PathBuf> {
    let folder = match (&args.work, &args.out) {
        (Some(work), _) => return Ok(work.clone()),
        (None, Some(out)) => match Destination::of(out) {
            Ok(Destination::File(_)) => {
                let mut name = out.clone().into_os_string();
                name.push(".parts");
                Some(PathBuf::from(name))
            }
            _ => None,
        },
        (None, None) => None,
    };
    folder.ok_or_else(|| {
        anyhow!("--out names no file: --work has to name the folder in which sessions are kept")
    })
}

/// How long a session takes, before anybody knows: as its size, and a little for each.
fn weight(file: &StudyFile) -> u64 {
    file.contents.bytes + 4096
}

/// Does pieces of work, each once, on several threads; the results in their order. After an error nothing new is begun.
fn in_parallel<T: Send>(
    threads: usize,
    pieces: usize,
    work: impl Fn(usize) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let failed: Mutex<Option<anyhow::Error>> = Mutex::new(None);
    let loops = || {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= pieces {
                return;
            }
            match work(i) {
                Ok(result) => lock(&done).push((i, result)),
                Err(error) => {
                    next.store(pieces, Ordering::Relaxed);
                    lock(&failed).get_or_insert(error);
                }
            }
        }
    };
    thread::scope(|scope| {
        let loops = &loops;
        for number in 0..threads.min(pieces) {
            let name = format!("study {number}");
            let builder = thread::Builder::new().name(name).stack_size(STACK_BYTES);
            if let Err(error) = builder.spawn_scoped(scope, loops) {
                next.store(pieces, Ordering::Relaxed);
                lock(&failed).get_or_insert(anyhow!("a thread to measure on: {error}"));
            }
        }
    });
    if let Some(error) = failed.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        return Err(error);
    }
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(i, _)| *i);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// What is behind it is whole whatever its holder did.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl Study<'_> {
    /// A part of another machine, or of other threads side by side, has other times: it is another part.
    fn name_of(&self, hash: &str) -> String {
        WorkFolder::name_of(
            hash,
            &format!("{} --jobs {} on {}", self.options, self.jobs, self.host),
            &self.build,
        )
    }

    /// Refuses to replace a table that has rows of other sessions, or rows that are neither kept nor measured again.
    fn check_replaced(&self, files: &[StudyFile], output: &Output, force: bool) -> anyhow::Result<()> {
        let names: HashSet<&str> = files.iter().map(|file| &*file.name).collect();
        let hashes: HashSet<&str> =
            files.iter().filter_map(|file| file.contents.hash.as_deref().ok()).collect();
        // Another file with the same contents may have been measured, under its own name.
        let hash_of = |row: &StudyRow| row_hash(&StudyRow { file: String::new(), ..row.clone() });
        let mut kept = None;
        check_no_row_is_lost(output, force, |row| {
            let is_there = row.file_hash.as_deref().is_some_and(|hash| hashes.contains(hash));
            if !is_there && !names.contains(&*row.file) {
                return Ok(true);
            }
            if row.error.is_some() || (is_there && self.measures_like(row)) {
                return Ok(false);
            }
            if kept.is_none() {
                let mut rows = HashSet::new();
                // `missing` warns of damaged parts and has them measured again.
                for row in self.folder.parts()?.flatten().flat_map(|part| part.rows) {
                    rows.insert(hash_of(&row)?);
                }
                kept = Some(rows);
            }
            let hash = hash_of(row)?;
            Ok(!kept.as_ref().is_some_and(|kept| kept.contains(&hash)))
        })
    }

    /// Whether this study has the options, build and machine of the row, so that it measures the session anew.
    fn measures_like(&self, row: &StudyRow) -> bool {
        let here = StudyRow::default().on(&self.machine, &self.host);
        let build = |row: &StudyRow| (row.osp_version.clone(), row.osp_commit.clone(), row.optimized);
        let place = |row: &StudyRow| (row.host.clone(), row.processor.clone(), row.simd.clone());
        row.options == self.options
            && row.jobs == self.jobs as u64
            && build(row) == build(&here)
            && place(row) == place(&here)
    }

    /// The sessions that are not kept, each once, the largest first: so that none of them is the last one alone.
    fn missing<'f>(&self, files: &'f [StudyFile]) -> anyhow::Result<Vec<&'f StudyFile>> {
        let (mut seen, mut missing) = (HashSet::new(), Vec::new());
        for file in files {
            let Ok(hash) = &file.contents.hash else { continue };
            if !seen.insert(hash) {
                continue;
            }
            match self.folder.part(&self.name_of(hash)) {
                Ok(Some(_)) => {}
                Ok(None) => missing.push(file),
                // The new part could not be written there either.
                Err(error @ PartError::NoFile { .. }) => return Err(error.into()),
                Err(error) => {
                    complain(&format!("warning: {error}; the session is measured again"));
                    missing.push(file);
                }
            }
        }
        missing.sort_by_key(|file| std::cmp::Reverse(file.contents.bytes));
        Ok(missing)
    }

    /// The beginning of every row of a session.
    fn row(&self, file: &StudyFile) -> StudyRow {
        let row = StudyRow {
            file: file.name.clone(),
            file_hash: file.contents.hash.clone().ok(),
            file_bytes: file.contents.bytes,
            pace: self.play.pace.to_string(),
            camera: self.play.camera.name().to_owned(),
            lenient: self.play.reading.lenient,
            max_polygons: self.play.reading.options().limits.polygons,
            options: self.options.clone(),
            jobs: self.jobs as u64,
            ..StudyRow::default()
        };
        row.on(&self.machine, &self.host)
    }

    fn failed(&self, file: &StudyFile, error: String) -> StudyRow {
        StudyRow { error: Some(error), ..self.row(file) }
    }

    /// Measures a session and keeps what was found. What cannot be read now may be readable later: that is not kept but
    /// handed back.
    fn measure_and_keep(&self, file: &StudyFile) -> anyhow::Result<Option<StudyRow>> {
        let Ok(hash) = &file.contents.hash else { return Ok(None) };
        let start = Instant::now();
        let mut remarks = Vec::new();
        // A session that brings osp down is an error of its row, not the end of a night's work.
        let replayed = catch_unwind(AssertUnwindSafe(|| self.replay(&file.path, &mut remarks)));
        // Somebody may draw on it meanwhile: what was measured is then not what the hash is of.
        if Contents::of(&file.path).hash.as_ref() != Ok(hash) {
            let error = format!("{}: it was changed while it was measured", file.path.display());
            return Ok(Some(self.failed(file, error)));
        }
        let rows = match replayed {
            Ok(Ok(replayed)) => self.rows(file, &replayed, &remarks, start.elapsed().as_secs_f64()),
            Ok(Err(error)) if is_passing(&error) => return Ok(Some(self.failed(file, format!("{error:#}")))),
            Ok(Err(error)) => vec![self.failed(file, format!("{error:#}"))],
            Err(panic) => {
                let said = panic.downcast_ref::<String>().map(String::as_str);
                let said = said.or(panic.downcast_ref::<&str>().copied()).unwrap_or_default();
                vec![self.failed(file, format!("{}: osp failed: {said}", file.path.display()))]
            }
        };
        self.folder.keep(&self.name_of(hash), &StudyPart::new(rows))?;
        Ok(None)
    }

    fn replay(&self, path: &Path, remarks: &mut Vec<String>) -> anyhow::Result<Replayed> {
        let around = Around {
            // Each core has one session: a reader beside it would be in its way.
            reader: Reader::Here,
            basis: AutoBasis::Work,
            progress: |_, _| ProgressBar::hidden(),
            remark: &mut |remark| remarks.push(remark.to_owned()),
        };
        replay(&ReplayArgs::plain(self.play.clone()), path, None, None, around)
    }

    fn rows(&self, file: &StudyFile, replayed: &Replayed, remarks: &[String], secs: f64) -> Vec<StudyRow> {
        let report = &replayed.report;
        let remarks = &remarks[..remarks.len().min(MOST_REMARKS)];
        let row = StudyRow {
            format: Some(replayed.format.to_owned()),
            remarks: (!remarks.is_empty()).then(|| remarks.join("; ")),
            skipped: Some(replayed.skipped),
            strokes: Some(report.strokes),
            points: Some(report.points),
            polygons: Some(report.polygons),
            frames: Some(report.frames),
            indexes_agree: Some(report.first_disagreement().is_none()),
            measuring_s: secs,
            ..self.row(file)
        };
        report.runs.iter().map(|run| row.clone().with_run(run)).collect()
    }

    /// Writes the table and says what is in it. `unread`: rows of sessions of which nothing is kept, by hash.
    fn write(
        &self,
        files: &[StudyFile],
        missing: usize,
        unread: &HashMap<String, StudyRow>,
        output: Option<Output>,
    ) -> anyhow::Result<Outcome> {
        let mut table = output.map(Table::begin).transpose()?;
        let (mut contents, mut failed, mut disagreeing) = (HashSet::new(), 0_u64, Vec::new());
        for file in files {
            let rows = match &file.contents.hash {
                Ok(hash) => {
                    contents.insert(hash.as_str());
                    let part = self.folder.part(&self.name_of(hash))?;
                    match (part, unread.get(hash)) {
                        (Some(part), _) => part.rows,
                        (None, Some(row)) => vec![row.clone()],
                        (None, None) => bail!("{}: what was measured of it is gone", file.path.display()),
                    }
                }
                Err(error) => vec![self.failed(file, error.clone())],
            };
            if let Some(error) = rows.iter().find_map(|row| row.error.as_ref()) {
                failed += 1;
                complain(&format!("warning: {error}"));
            }
            if rows.iter().any(|row| row.indexes_agree == Some(false)) {
                disagreeing.push(&file.name);
            }
            if let Some(table) = &mut table {
                // Another file with the same contents may have been measured, under its own name.
                let name = |row| StudyRow { file: file.name.clone(), ..row };
                rows.into_iter().map(name).try_for_each(|row| table.add(row))?;
            }
        }
        for name in &disagreeing {
            complain(&format!("{name}: two indexes saw different polygons"));
        }
        let path = table.as_ref().map(|table| table.path().display().to_string());
        let rows = table.map(Table::commit).transpose()?;
        let before = contents.len().saturating_sub(missing);
        let failed =
            if failed > 0 { format!(", {} could not be read", thousands(failed)) } else { String::new() };
        let rows = path.zip(rows).map(|(path, rows)| format!("; {path}: {} rows", thousands(rows)));
        say(&format!(
            "{} sessions: {} measured now, {} before{failed}{}",
            thousands(files.len() as u64),
            thousands(missing as u64),
            thousands(before as u64),
            rows.unwrap_or_default()
        ))?;
        Ok(if disagreeing.is_empty() { Outcome::Done } else { Outcome::CheckFailed })
    }
}

/// Whether another try may find the file readable.
fn is_passing(error: &anyhow::Error) -> bool {
    let cause = error.chain().find_map(|cause| cause.downcast_ref::<RecordingError>());
    matches!(cause, Some(RecordingError::Io { .. }))
}
