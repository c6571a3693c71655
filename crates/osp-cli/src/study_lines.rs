//! The lines of a study, and the file that holds them.

use std::{
    collections::HashMap,
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use serde::{Deserialize, Serialize};

use super::{outputs::Outputs, study_contents::Contents, version::COMMIT};
use osp_lab::{Machine, report::ReplayReport};
use osp_session::{atomic_file::Destination, platform::host_name, small_file::open_regular};

/// First bytes of a study's results.
pub(super) const START: &[u8] = b"{\"osp_study\":";

const VERSION: u32 = 1;
/// Longest line that osp reads, in bytes. Lines of osp are far shorter.
const MOST_LINE_BYTES: u64 = 16 << 20;

/// The line of one session. docs/study.md describes the fields.
#[derive(Serialize)]
pub(super) struct StudyLine<'a> {
    /// Version of the fields. This field comes first, so that osp recognises its own lines.
    osp_study: u32,
    pub(super) file: &'a str,
    pub(super) file_hash: Option<String>,
    pub(super) file_bytes: Option<u64>,
    pub(super) format: Option<&'static str>,
    pub(super) error: Option<String>,
    pub(super) remarks: Vec<String>,
    pub(super) skipped: Option<u64>,
    pub(super) measuring_s: f64,
    pub(super) options: &'a str,
    pub(super) machine: &'a Place,
    pub(super) report: Option<ReplayReport>,
}

impl<'a> StudyLine<'a> {
    /// Creates a line without results.
    pub(super) fn new(file: &'a str, options: &'a str, machine: &'a Place) -> Self {
        Self {
            osp_study: VERSION,
            file,
            file_hash: None,
            file_bytes: None,
            format: None,
            error: None,
            remarks: Vec::new(),
            skipped: None,
            measuring_s: 0.0,
            options,
            machine,
            report: None,
        }
    }
}

/// The machine and the build of osp.
#[derive(PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Place {
    host: String,
    processor: String,
    threads: usize,
    system: String,
    simd: String,
    osp_version: String,
    osp_commit: String,
    /// Hash of the program, if the commit is unknown or had changes.
    osp_program: Option<String>,
    optimized: bool,
}

impl Place {
    pub(super) fn here() -> anyhow::Result<Self> {
        let Machine { processor, threads, system, simd, version, commit, optimized, .. } =
            Machine::here(COMMIT);
        let osp_program = match commit.ends_with("-dirty") || commit == "unknown" {
            true => Some(Contents::of(&std::env::current_exe()?)?.hash),
            false => None,
        };
        Ok(Self {
            host: host_name(),
            processor,
            threads,
            system,
            simd,
            osp_version: version,
            osp_commit: commit,
            osp_program,
            optimized,
        })
    }
}

/// The result of a session.
#[derive(Clone)]
pub(super) enum Found {
    Agreement,
    /// Two indexes found different polygons.
    Disagreement,
    Error(String),
}

impl Found {
    fn new(error: Option<String>, indexes_agree: bool) -> Self {
        match error {
            Some(error) => Self::Error(error),
            None if indexes_agree => Self::Agreement,
            None => Self::Disagreement,
        }
    }
}

impl Found {
    /// Returns the same result for another session with the same contents. An error text contains the names of both
    /// sessions.
    pub(super) fn of(self, name: &str) -> Self {
        match self {
            Self::Error(error) if !error.contains(name) => {
                Self::Error(format!("{name}: its contents could not be read before: {error}"))
            }
            found => found,
        }
    }
}

impl StudyLine<'_> {
    pub(super) fn found(&self) -> Found {
        let disagreement = self.report.as_ref().and_then(ReplayReport::first_disagreement);
        Found::new(self.error.clone(), disagreement.is_none())
    }
}

/// The fields of a line that decide whether a session needs a measurement.
#[derive(Deserialize)]
struct Head {
    file_hash: Option<String>,
    error: Option<String>,
    options: String,
    machine: Place,
    report: Option<Verdict>,
}

#[derive(Deserialize)]
struct Verdict {
    indexes_agree: bool,
}

/// The output file of a study, and its lines for sessions with the same options on the same machine.
pub(super) struct StudyFile {
    path: PathBuf,
    file: File,
    /// End of the last complete line that was read.
    read_to: u64,
    known: HashMap<String, Found>,
}

impl StudyFile {
    /// Opens or creates the file. It must not be one of the `inputs`, the sessions.
    pub(super) fn open(path: &Path, inputs: &[PathBuf], force: bool) -> anyhow::Result<Self> {
        let named = || path.display().to_string();
        if !matches!(Destination::of(path).with_context(named)?, Destination::File(_)) {
            bail!("{}: expected a regular file to add lines to; found a pipe or a device", named());
        }
        Outputs::new(force).reads(inputs).adds_to(path, &[".ndjson"])?;
        if !force && path.exists() {
            let mut start = Vec::new();
            open_regular(path)?.take(START.len() as u64).read_to_end(&mut start).with_context(named)?;
            // A killed process may have left only a part of the first line.
            ensure!(
                START.starts_with(&start),
                "{}: holds no lines of `osp study`; --force empties it",
                named()
            );
        }
        let file = File::options().create(true).read(true).append(true).open(path).with_context(named)?;
        if force {
            file.set_len(0).with_context(named)?;
        }
        Ok(Self { path: path.to_owned(), file, read_to: 0, known: HashMap::new() })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Ends an incomplete line, which a killed process may have written.
    fn end_line(&mut self) -> io::Result<()> {
        if self.file.metadata()?.len() == 0 {
            return Ok(());
        }
        let mut last = [0];
        self.file.seek(SeekFrom::End(-1))?;
        self.file.read_exact(&mut last)?;
        if last == *b"\n" { Ok(()) } else { self.file.write_all(b"\n") }
    }

    /// Returns the result of a session with these contents, options and machine, if the file has one. First reads the
    /// lines that other processes have added.
    pub(super) fn find(
        &mut self,
        hash: &str,
        options: &str,
        machine: &Place,
    ) -> anyhow::Result<Option<&Found>> {
        self.read_on(options, machine)?;
        Ok(self.known.get(hash))
    }

    /// Adds a line, unless another process has meanwhile added a line for the same session. Locks the file meanwhile.
    /// Ends an incomplete line of another process first. Removes its own line after a write error.
    pub(super) fn add(&mut self, line: &StudyLine<'_>) -> anyhow::Result<()> {
        let text = serde_json::to_string(line)?;
        // Some file systems of clusters have no locks. There, writes the line in one call without a lock.
        let is_locked = self.file.lock().is_ok();
        let added = self.add_locked(line, &text);
        if is_locked {
            self.file.unlock().with_context(|| self.path.display().to_string())?;
        }
        added.with_context(|| self.path.display().to_string())
    }

    fn add_locked(&mut self, line: &StudyLine<'_>, text: &str) -> anyhow::Result<()> {
        if let Some(hash) = &line.file_hash
            && self.find(hash, line.options, line.machine)?.is_some()
        {
            return Ok(());
        }
        self.end_line()?;
        let end = self.file.metadata()?.len();
        if let Err(error) = self.file.write_all(format!("{text}\n").as_bytes()) {
            self.file.set_len(end)?;
            return Err(error.into());
        }
        Ok(())
    }

    /// Reads the lines that were added since the last time. Skips incomplete lines.
    fn read_on(&mut self, options: &str, machine: &Place) -> anyhow::Result<()> {
        let named = || self.path.display().to_string();
        let mut lines = BufReader::new(&self.file);
        lines.seek(SeekFrom::Start(self.read_to)).with_context(named)?;
        let mut line = Vec::new();
        loop {
            line.clear();
            lines.by_ref().take(MOST_LINE_BYTES).read_until(b'\n', &mut line).with_context(named)?;
            if line.len() as u64 == MOST_LINE_BYTES {
                bail!(
                    "{}: byte {}: expected a line of fewer than {MOST_LINE_BYTES} bytes; name another file, or --force",
                    named(),
                    self.read_to
                );
            }
            if line.last() != Some(&b'\n') {
                // The line may still grow.
                return Ok(());
            }
            self.read_to += line.len() as u64;
            // Skips a line that is not UTF-8, because other readers refuse it.
            let head = str::from_utf8(&line).ok().and_then(|line| serde_json::from_str::<Head>(line).ok());
            let Some(head) = head.filter(|head| head.options == options && head.machine == *machine) else {
                continue;
            };
            // Skips a damaged line with neither an error nor a report.
            let agree = head.report.map(|report| report.indexes_agree);
            if let Some(hash) = head.file_hash
                && (head.error.is_some() || agree.is_some())
            {
                self.known.insert(hash, Found::new(head.error, agree.unwrap_or(true)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn line<'a>(name: &'a str, hash: &str, machine: &'a Place) -> StudyLine<'a> {
        let error = Some("bad".to_owned());
        StudyLine { file_hash: Some(hash.to_owned()), error, ..StudyLine::new(name, "options", machine) }
    }

    #[test]
    fn lines_of_several_processes_stay_whole_and_come_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, machine) = (folder.path().join("a.ndjson"), Place::here().expect("a machine"));
        let open = || StudyFile::open(&path, &[], false).expect("a file");
        let (mut a, mut b) = (open(), open());
        a.add(&line("one", "1", &machine)).expect("added");
        // A process dies in the middle of a line while another one has the file open.
        let mut text = fs::read_to_string(&path).expect("a line");
        text.push_str(&text.clone()[..40]);
        fs::write(&path, &text).expect("half a line");
        b.add(&line("two", "2", &machine)).expect("added");
        // Both have measured the same session.
        b.add(&line("one again", "1", &machine)).expect("not added");
        a.add(&line("two again", "2", &machine)).expect("not added");
        let text = fs::read_to_string(&path).expect("lines");
        let whole = text.lines().filter(|line| serde_json::from_str::<Head>(line).is_ok());
        assert_eq!((whole.count(), text.lines().count()), (2, 3), "{text}");
        assert!(a.find("2", "options", &machine).expect("read").is_some());
        assert!(a.find("2", "others", &machine).expect("read").is_some(), "it was read before");
        assert!(open().find("2", "others", &machine).expect("read").is_none());
        // A line that has lost its report is measured again.
        fs::write(&path, text.replace("\"error\":\"bad\"", "\"errOr\":\"bad\"")).expect("damaged");
        assert!(open().find("1", "options", &machine).expect("read").is_none());
    }
}
