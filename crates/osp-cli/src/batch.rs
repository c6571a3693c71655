//! Work on many sessions, with one output file for each. Skips finished files and lists the errors at the end.

use std::{
    collections::HashMap,
    fs,
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
    outcome::Outcome,
    output::{complain, say},
    progress,
    verify_all::{Part, sessions},
};
use osp_session::{
    output_file::{is_same_file, lies_in},
    recording::import::files_beside,
};

/// File endings of sessions. A target gets its own ending in their place. Longer endings come first.
const ENDINGS: [&str; 11] =
    [".ron.zst", ".poses.gz", ".obj.gz", ".ron", ".tilt", ".apa", ".json", ".poses", ".obj", ".glb", ".gltf"];

/// A session and the file to make of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Job {
    pub(super) source: PathBuf,
    pub(super) target: PathBuf,
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
    /// Targets get `ending`. A target lies beside its session. With `out`, it lies below `out` in the same place that
    /// its session has below its folder. With `force`, finished targets are made again.
    ///
    /// # Errors
    /// A path leads nowhere, there is no session, or two sessions would have the same target.
    pub(super) fn plan(
        paths: &[PathBuf],
        out: Option<&Path>,
        ending: &str,
        force: bool,
    ) -> anyhow::Result<Self> {
        let mut found = sessions(paths, Part::WHOLE)?;
        // A former run wrote the files in a folder below the sessions, so they are no sessions to work on.
        let is_below = |out: &&Path| {
            paths.iter().any(|path| path.is_dir() && lies_in(out, path) && !is_same_file(out, path))
        };
        if let Some(out) = out.filter(is_below) {
            found.retain(|session| !lies_in(session, out));
        }
        let many = found.len();
        found.retain(|session| !has_ending(session, ending));
        let same = many - found.len();
        let mut jobs: Vec<Job> =
            found.into_iter().map(|source| Job { target: place_of(paths, &source, out), source }).collect();
        let mut sharing = HashMap::<PathBuf, usize>::new();
        for job in &jobs {
            *sharing.entry(named(&job.target, ending)).or_default() += 1;
        }
        for job in &mut jobs {
            let short = named(&job.target, ending);
            // Two sessions may differ only in their endings.
            job.target = if sharing[&short] == 1 { short } else { with(&job.target, ending) };
        }
        let mut targets = HashMap::<&Path, &Path>::new();
        for job in &jobs {
            if let Some(other) = targets.insert(&job.target, &job.source) {
                let (one, target) = (job.source.display(), job.target.display());
                bail!(
                    "{}: and {one} would both become {target}; give each folder its own --out",
                    other.display()
                );
            }
        }
        let all = jobs.len();
        jobs.retain(|job| force || !is_finished(job));
        Ok(Self { finished: all - jobs.len(), jobs, same })
    }

    /// Does the work on `threads` threads. Each gets its own `worker`, which returns remarks. `done` and `kind` are
    /// words for the last line. Errors are listed before it.
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
                let source = job.source.display();
                match made(job, &mut worker) {
                    Ok(remarks) => {
                        remarks.iter().for_each(|remark| complain(&format!("warning: {source}: {remark}")));
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
            let source = self.jobs[*at].source.display().to_string();
            let named = if error.starts_with(&source) { String::new() } else { format!("{source}: ") };
            complain(&format!("error: {named}{error}"));
        }
        let (many, failed) = (self.jobs.len() + self.finished, errors.len());
        let same = if self.same > 0 { format!(", {} are {kind} already", self.same) } else { String::new() };
        say(&format!(
            "{many} sessions: {} {done} now, {} before, {failed} failed{same}",
            self.jobs.len() - failed,
            self.finished
        ))?;
        if failed > 0 {
            bail!("{failed} of {many} sessions could not be {done}");
        }
        Ok(Outcome::Done)
    }
}

/// Returns the number of cores, or 1 if it is unknown.
pub(super) fn every_core() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

fn made<W: FnMut(&Job) -> anyhow::Result<Vec<String>>>(
    job: &Job,
    work: &mut W,
) -> anyhow::Result<Vec<String>> {
    if let Some(folder) = job.target.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    work(job)
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().to_ascii_lowercase().ends_with(ending))
}

/// Returns the place of a session's target, still with the session's name: beside the session, or below `out`.
fn place_of(paths: &[PathBuf], session: &Path, out: Option<&Path>) -> PathBuf {
    let Some(out) = out else { return session.to_owned() };
    let below = paths.iter().filter(|path| path.is_dir()).find_map(|path| session.strip_prefix(path).ok());
    let below = below.filter(|below| !below.as_os_str().is_empty());
    out.join(below.unwrap_or_else(|| Path::new(session.file_name().unwrap_or(session.as_os_str()))))
}

/// Returns the path with `ending` in place of the session's ending.
fn named(path: &Path, ending: &str) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // An ending is ASCII, so it has the same length as that part of the name, in upper or lower case.
    let own = ENDINGS.iter().find(|own| has_ending(path, own) && name.len() > own.len());
    path.with_file_name(format!("{}{ending}", &name[..name.len() - own.map_or(0, |own| own.len())]))
}

/// Returns the path with `ending` appended to the whole name.
fn with(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// Whether a target is at least as new as all files of its session. A target appears whole or not at all.
fn is_finished(job: &Job) -> bool {
    let changed = |path: &Path| fs::metadata(path).and_then(|data| data.modified()).ok();
    let parts = || -> Option<SystemTime> {
        let mut newest = changed(&job.source)?;
        let inside = fs::read_dir(&job.source).into_iter().flatten().flatten().map(|entry| entry.path());
        for path in inside.chain(files_beside(&job.source)) {
            newest = changed(&path).map_or(newest, |time| time.max(newest));
        }
        Some(newest)
    };
    changed(&job.target).zip(parts()).is_some_and(|(target, newest)| target >= newest)
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
