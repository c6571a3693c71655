//! Work on many sessions, with one output file for each. Skips finished files and lists the errors at the end.

use std::{
    collections::{HashMap, HashSet},
    fs,
    io::Read,
    num::NonZero,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
    thread,
    time::SystemTime,
};

use anyhow::{Context, bail};

use super::{
    output::{Outcome, print_result, warn},
    progress,
    verify_all::{Part, sessions},
};
use osp_session::{
    output_file::{OutputError, is_same_file, lies_in},
    platform::fs::has_ending,
    recording::{import::files_beside, looks_like_session},
    small_file::open_regular,
};

/// File endings of sessions, which the ending of a target replaces. Longer endings come first.
const ENDINGS: [&str; 11] =
    [".ron.zst", ".poses.gz", ".obj.gz", ".ron", ".tilt", ".apa", ".json", ".poses", ".obj", ".glb", ".gltf"];

/// Number of leading bytes that identify the kind of a file.
const START_BYTES: u64 = 4096;

/// A session and the file to make from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Job {
    pub(super) source: PathBuf,
    pub(super) target: PathBuf,
    /// Whether the target may be replaced: somebody has asked for it, or osp has made the target from an older session.
    pub(super) replaces: bool,
}

/// The work on the sessions that a command line names.
#[derive(Debug)]
pub(super) struct Batch {
    jobs: Vec<Job>,
    /// Number of targets that are newer than their sessions.
    finished: usize,
    /// Number of sessions that already have the target's format.
    same: usize,
}

impl Batch {
    /// Plans the work on the named sessions, and on the sessions in the named folders.
    ///
    /// Targets get `ending`. A target lies beside its session. With `out`, the path of a target
    /// below `out` is the path of its session below the named folder. With `force`, finished targets are made again.
    ///
    /// # Errors
    /// A path leads nowhere, `out` is no folder, or there is no session. Two sessions would have the same target, or a
    /// target is a link to a session.
    pub(super) fn plan(
        paths: &[PathBuf],
        out: Option<&Path>,
        ending: &str,
        force: bool,
    ) -> anyhow::Result<Self> {
        if let Some(out) = out.filter(|out| fs::metadata(out).is_ok_and(|data| !data.is_dir())) {
            bail!("{}: expected a folder; found a file", out.display());
        }
        let mut found = each_once(sessions(paths, Part::WHOLE)?)?;
        // A set, because there may be thousands of paths.
        let named_ones: HashSet<&Path> = paths.iter().map(PathBuf::as_path).collect();
        let folders: Vec<&Path> = paths.iter().map(PathBuf::as_path).filter(|path| path.is_dir()).collect();
        // Skips files that a previous run wrote into a folder below the sessions.
        let is_below =
            |out: &&Path| folders.iter().any(|path| lies_in(out, path) && !is_same_file(out, path));
        let mut left_out = Vec::new();
        if let Some(out) = out.filter(is_below) {
            let is_output =
                |session: &mut PathBuf| !named_ones.contains(session.as_path()) && lies_in(session, out);
            left_out.extend(found.extract_if(.., is_output));
        }
        let same: Vec<PathBuf> = found.extract_if(.., |session| has_ending(session, ending)).collect();
        // Skips models that osp wrote into the folder of their session.
        let models: HashSet<PathBuf> =
            found.iter().flat_map(|session| [named(session, ".glb"), with(session, ".glb")]).collect();
        found.retain(|session| {
            let is_model = models.contains(session) && is_made(session);
            !is_model || named_ones.contains(session.as_path())
        });
        let places: Vec<PathBuf> = found.iter().map(|session| place_of(&folders, session, out)).collect();
        let targets = targets(&places, ending);
        let made: HashSet<PathBuf> = targets.iter().map(|target| absolute(target)).collect();
        left_out.retain(|session| !made.contains(&absolute(session)));
        if let (Some(out), false) = (out, left_out.is_empty()) {
            let left_out = match left_out.len() {
                1 => "1 session in the folder of the outputs is skipped; name it to include it".to_owned(),
                many => format!(
                    "{many} sessions in the folder of the outputs are skipped; name them to include them"
                ),
            };
            warn(&format!("warning: {}: {left_out}", out.display()));
        }
        let mut jobs: Vec<Job> = found
            .into_iter()
            .zip(targets)
            .map(|(source, target)| Job { source, target, replaces: force })
            .collect();
        let mut sources = HashMap::<&Path, &Path>::new();
        for job in &jobs {
            if let Some(other) = sources.insert(&job.target, &job.source) {
                let (one, target) = (job.source.display(), job.target.display());
                bail!(
                    "{} and {one} would both become {target}; give each folder its own --out",
                    other.display()
                );
            }
        }
        let named_too = same.iter().filter(|session| named_ones.contains(session.as_path()));
        let sources = jobs.iter().map(|job| &job.source);
        let read: HashSet<PathBuf> =
            sources.chain(named_too).filter_map(|path| path.canonicalize().ok()).collect();
        let all = jobs.len();
        jobs.retain(|job| force || !is_finished(job));
        jobs.iter_mut().for_each(|job| job.replaces |= is_made(&job.target));
        let mut written = HashSet::new();
        for Job { target, replaces, .. } in &jobs {
            // A link leads to its file.
            let Ok(file) = target.canonicalize() else { continue };
            if *replaces && read.contains(&file) {
                return Err(OutputError::Input { path: target.clone() }.into());
            }
            if !written.insert(file) {
                bail!("{}: is a link to the target of another session", target.display());
            }
        }
        Ok(Self { finished: all - jobs.len(), jobs, same: same.len() })
    }

    /// Does the work on `threads` threads. Each thread creates its own worker, which returns the remarks on a job.
    /// Prints the errors, then a summary with the words `done` and `kind`.
    pub(super) fn run<W: FnMut(&Job) -> anyhow::Result<Vec<String>>>(
        self,
        threads: usize,
        [done, kind]: [&str; 2],
        worker: impl Fn() -> anyhow::Result<W> + Sync,
    ) -> anyhow::Result<Outcome> {
        let bar = progress::bar(self.jobs.len() as u64, "sessions", done);
        let next = AtomicUsize::new(0);
        let errors = Mutex::new(Vec::<(usize, String)>::new());
        let work = || -> anyhow::Result<()> {
            let mut worker = worker()?;
            while let at = next.fetch_add(1, Relaxed)
                && let Some(job) = self.jobs.get(at)
            {
                match made(job, &mut worker) {
                    Ok(remarks) => {
                        let about = |remark| format!("warning: {}", of_session(job, remark));
                        remarks.iter().for_each(|remark| warn(&about(remark)));
                    }
                    Err(error) => {
                        let mut errors = errors.lock().unwrap_or_else(PoisonError::into_inner);
                        errors.push((at, format!("{error:#}")));
                    }
                }
                bar.inc(1);
            }
            Ok(())
        };
        let threads = threads.min(self.jobs.len());
        thread::scope(|scope| {
            let running: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            running.into_iter().try_for_each(|thread| match thread.join() {
                Ok(outcome) => outcome,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        bar.finish_and_clear();
        let mut errors = errors.into_inner().unwrap_or_else(PoisonError::into_inner);
        errors.sort();
        for (at, error) in &errors {
            warn(&format!("error: {}", of_session(&self.jobs[*at], error)));
        }
        let (many, failed) = (self.jobs.len() + self.finished, errors.len());
        let again = if self.finished > 0 { " (--force makes them again)" } else { "" };
        let same = if self.same > 0 { format!(", {} are {kind} already", self.same) } else { String::new() };
        print_result(&format!(
            "{many} sessions: {} {done} now, {} before{again}, {failed} failed{same}",
            self.jobs.len() - failed,
            self.finished
        ))?;
        if failed > 0 {
            bail!("{failed} of {many} sessions could not be {done}");
        }
        Ok(Outcome::Done)
    }
}

/// Removes duplicates: a file may be named together with its folder. Replaces a path without a file name by the full
/// path, for example if `.` is the folder of a .tilt.
fn each_once(sessions: Vec<PathBuf>) -> anyhow::Result<Vec<PathBuf>> {
    let mut once = Vec::new();
    let mut known = HashSet::new();
    for session in sessions {
        let session = match session.file_name() {
            Some(_) => session,
            None => session.canonicalize().with_context(|| session.display().to_string())?,
        };
        if known.insert(absolute(&session)) {
            once.push(session);
        }
    }
    Ok(once)
}

/// Returns the number of cores, for one thread on each.
pub(super) fn every_core() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// Returns a remark or an error, preceded by the name of its session.
fn of_session(job: &Job, text: &str) -> String {
    let source = job.source.display().to_string();
    if text.starts_with(&source) { text.to_owned() } else { format!("{source}: {text}") }
}

fn made<W: FnMut(&Job) -> anyhow::Result<Vec<String>>>(
    job: &Job,
    work: &mut W,
) -> anyhow::Result<Vec<String>> {
    if let Some(folder) = job.target.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    // Writing to a pipe without a reader would never end.
    if fs::metadata(&job.target).is_ok_and(|data| !data.is_file()) {
        bail!("{}: expected a file; found a folder, a pipe or a device", job.target.display());
    }
    let read = newest(&job.source);
    let remarks = work(job)?;
    let is_changed = newest(&job.source) != read;
    // The next run compares the times of session and target. If the session has changed or a clock is wrong, the target
    // gets the time of the session that was read.
    if let Some(read) = read
        && (is_changed || changed(&job.target).is_some_and(|target| target < read))
    {
        let target = fs::File::options().write(true).open(&job.target);
        target.and_then(|file| file.set_modified(read)).with_context(|| job.target.display().to_string())?;
    }
    if is_changed {
        bail!("it changed while it was read; --force makes {} again", job.target.display());
    }
    Ok(remarks)
}

/// Returns the path of a session's target before its ending is replaced: in the session's folder, or below `out`.
fn place_of(folders: &[&Path], session: &Path, out: Option<&Path>) -> PathBuf {
    let Some(out) = out else { return session.to_owned() };
    let below = folders.iter().find_map(|folder| session.strip_prefix(folder).ok());
    let below = below.filter(|below| !below.as_os_str().is_empty());
    out.join(below.unwrap_or_else(|| Path::new(session.file_name().unwrap_or(session.as_os_str()))))
}

/// Returns the targets of sessions at these paths. If several sessions would get the same target, their targets keep
/// the sessions' endings, too. Upper and lower case count as equal, because some file systems do not distinguish them.
fn targets(places: &[PathBuf], ending: &str) -> Vec<PathBuf> {
    let key = |target: &Path| target.to_string_lossy().to_lowercase();
    let mut targets: Vec<PathBuf> = places.iter().map(|place| named(place, ending)).collect();
    loop {
        let mut sharing = HashMap::<String, usize>::new();
        targets.iter().for_each(|target| *sharing.entry(key(target)).or_default() += 1);
        let mut is_done = true;
        for (target, place) in targets.iter_mut().zip(places) {
            let whole = with(place, ending);
            if sharing[&key(target)] > 1 && *target != whole {
                (*target, is_done) = (whole, false);
            }
        }
        if is_done {
            return targets;
        }
    }
}

/// Returns the path with `ending` in place of a session's ending. Appends it to a name that is not UTF-8.
fn named(path: &Path, ending: &str) -> PathBuf {
    let Some(name) = path.file_name().unwrap_or_default().to_str() else { return with(path, ending) };
    // Endings are ASCII, so upper and lower case have the same number of bytes.
    let own = ENDINGS.iter().find(|own| has_ending(path, own) && name.len() > own.len());
    path.with_file_name(format!("{}{ending}", &name[..name.len() - own.map_or(0, |own| own.len())]))
}

fn with(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// Whether the target is a session or made by osp, and at least as new as all files of its session. An existing target is
/// complete, because osp writes targets completely or not at all.
fn is_finished(job: &Job) -> bool {
    let target = &job.target;
    let is_new = changed(target).zip(newest(&job.source)).is_some_and(|(target, read)| target >= read);
    let is_session = || !has_ending(target, ".glb") && looks_like_session(target, &start_of(target));
    is_new && (is_made(target) || is_session())
}

/// Whether osp has made this picture or model. Its beginning names osp.
fn is_made(path: &Path) -> bool {
    let start = start_of(path);
    let mark: &[u8] = match start.get(..4) {
        Some(b"glTF") => b"{\"asset\":{\"generator\":\"osp ",
        Some(b"\x89PNG") => b"tEXtSoftware\0osp",
        _ => return false,
    };
    start.windows(mark.len()).any(|part| part == mark)
}

/// Returns the first bytes of a file; no bytes if it cannot be read.
fn start_of(path: &Path) -> Vec<u8> {
    let mut start = Vec::new();
    let _ = open_regular(path).and_then(|file| file.take(START_BYTES).read_to_end(&mut start));
    start
}

fn changed(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).and_then(|data| data.modified()).ok()
}

/// Returns the time of the last change of a session's files.
fn newest(session: &Path) -> Option<SystemTime> {
    let mut newest = changed(session)?;
    let inside = fs::read_dir(session).into_iter().flatten().flatten().map(|entry| entry.path());
    for path in inside.chain(files_beside(session)) {
        newest = changed(&path).map_or(newest, |time| time.max(newest));
    }
    Some(newest)
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_is_named_as_its_session() {
        for (session, target) in [
            ("a/b.tilt", "a/b.glb"),
            ("b.ron.zst", "b.glb"),
            ("B.OBJ.gz", "B.glb"),
            ("no-ending", "no-ending.glb"),
            (".tilt", ".tilt.glb"),
            ("a.b.json", "a.b.glb"),
        ] {
            assert_eq!(named(Path::new(session), ".glb"), Path::new(target));
        }
        assert_eq!(with(Path::new("a/b.tilt"), ".glb"), Path::new("a/b.tilt.glb"));
    }
}
