//! `osp verify --all`: verifies every session in folders, and prints a table of all sessions.

use std::{
    io::Read,
    path::{Path, PathBuf},
    str::FromStr,
};

use anyhow::Context;
use walkdir::WalkDir;

use super::{output::warn, study_lines};
use osp::occlusion::Soundness;
use osp_lab::{
    report::thousands,
    rows::Rows,
    verify::{Trial, Verifier},
};
use osp_session::{
    atomic_file::is_unfinished,
    recording::{is_pipe, looks_like_session},
};

/// Number of bytes at the beginning of a file that decide whether the file is a session.
const START_BYTES: u64 = 4096;

/// A part of the sessions, `K/N` on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Number of the part, from 0.
    number: usize,
    parts: usize,
}

impl Part {
    /// All sessions.
    pub(super) const WHOLE: Self = Self { number: 0, parts: 1 };

    fn holds(self, place: usize) -> bool {
        place % self.parts == self.number
    }
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number, parts)) if (1..=parts).contains(&number) => Ok(Self { number: number - 1, parts }),
            _ => Err("expected K/N, the K-th of N parts, such as 2/7".to_owned()),
        }
    }
}

/// Returns the named sessions and the sessions in the named folders, sorted by path. Returns only the sessions of
/// `part`.
pub(super) fn sessions(paths: &[PathBuf], part: Part) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in paths {
        // A missing path is an error: probably a typing error.
        if is_pipe(path) {
            found.push(path.clone());
            continue;
        }
        std::fs::metadata(path).with_context(|| path.display().to_string())?;
        if !path.is_dir() || looks_like_session(path, &[]) {
            found.push(path.clone());
            continue;
        }
        let mut walk = WalkDir::new(path).sort_by_file_name().into_iter();
        while let Some(entry) = walk.next() {
            let entry = match entry {
                Ok(entry) => entry,
                // The reader of the session reports the error.
                Err(error) => {
                    found.extend(error.path().map(Path::to_owned));
                    continue;
                }
            };
            let path = entry.path();
            if is_unfinished(path) {
                continue;
            }
            if entry.file_type().is_dir() {
                // A .tilt may be a folder.
                if looks_like_session(path, &[]) {
                    found.push(path.to_owned());
                    walk.skip_current_dir();
                }
            } else if entry.file_type().is_file() {
                if begins_like_session(path) {
                    found.push(path.to_owned());
                }
            } else if entry.depth() > 0
                && let Some(what) = not_followed(path)
            {
                warn(&format!("warning: {}: {what} is skipped; name it to include it", path.display()));
            }
        }
    }
    anyhow::ensure!(!found.is_empty(), "expected sessions; found none in {}", join(paths));
    Ok(found.into_iter().enumerate().filter(|(place, _)| part.holds(*place)).map(|(_, path)| path).collect())
}

/// Returns the path of a session relative to the named folder.
pub(super) fn name_in(paths: &[PathBuf], session: &Path) -> String {
    let below = paths.iter().filter(|path| path.is_dir()).find_map(|path| session.strip_prefix(path).ok());
    let below = below.filter(|below| !below.as_os_str().is_empty());
    below.unwrap_or(session).to_string_lossy().into_owned()
}

fn join(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// Whether a file looks like a session. True for an unreadable file, so that its reader reports the error.
fn begins_like_session(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(START_BYTES).read_to_end(&mut start));
    // A file of `osp study` is also JSON, but no session.
    read.is_err() || (looks_like_session(path, &start) && !start.starts_with(study_lines::START))
}

/// Describes an entry of a folder that is neither a file nor a folder: `None` for a link to a file that is no session.
fn not_followed(path: &Path) -> Option<&'static str> {
    let is_link = path.is_symlink();
    match std::fs::metadata(path) {
        Err(_) => Some("a link that leads nowhere"),
        Ok(data) if data.is_dir() => Some("a link to a folder"),
        Ok(data) if data.is_file() => begins_like_session(path).then_some("a link to a session"),
        Ok(_) if is_link => Some("a link to a pipe or a device"),
        Ok(_) => Some("a pipe or a device"),
    }
}

const PART: &str = "verify-all";
const ALL: &str = "all sessions";

/// The results of all sessions, one line each.
#[derive(Default)]
pub(super) struct Overview {
    rows: Rows,
    sessions: usize,
    views: u64,
    wrong: u64,
    unread: usize,
}

impl Overview {
    pub(super) fn add(&mut self, name: &str, polygons: u64, verifier: &Verifier) {
        let views = verifier.views();
        let mean = |sum: u64| sum as f64 / views.views.max(1) as f64;
        let is_conservative = |trial: &&Trial| trial.soundness() == Soundness::Conservative;
        let conservative = || verifier.trials().iter().filter(is_conservative);
        let most_hidden =
            conservative().map(|trial| trial.totals().hidden_culled_percent()).max_by(f64::total_cmp);
        let wrong = views.lost + conservative().map(|trial| trial.totals().false_culls).sum::<u64>();
        self.rows.part(PART, "All sessions");
        self.rows
            .of(PART, ALL, name)
            .value("polygons", "polygons", polygons as f64)
            .value("views", "views", views.views as f64)
            .value("in_view", "polygons", mean(views.in_view))
            .value("visible", "polygons", mean(views.visible))
            .value("hidden", "polygons", mean(views.hidden))
            .maybe("most_hidden", "%", most_hidden.filter(|_| views.hidden > 0))
            .value("wrong", "polygons", wrong as f64);
        self.sessions += 1;
        self.views += views.views;
        self.wrong += wrong;
    }

    /// Counts a session that could not be read.
    pub(super) fn add_unread(&mut self) {
        self.unread += 1;
    }

    pub(super) fn text(&self) -> String {
        let Self { rows, sessions, views, wrong, unread } = self;
        let unread = if *unread > 0 { format!("; {unread} could not be read") } else { String::new() };
        let [views, wrong] = [views, wrong].map(|count| thousands(*count));
        format!(
            "{}\n{sessions} sessions, {views} views: conservative methods culled {wrong} visible polygons{unread}",
            rows.all_tables(|_| true)
        )
    }
}
