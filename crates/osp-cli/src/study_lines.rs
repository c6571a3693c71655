//! The lines of a study, and the file that holds them.

use std::{
    collections::HashMap,
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::{outputs::Outputs, study_contents::Contents, version::COMMIT};
use osp_lab::{Machine, report::ReplayReport};
use osp_session::{
    atomic_file::Destination, output_file::OutputKind, platform::host_name, small_file::open_regular,
};

/// Version of the fields.
const VERSION: u32 = 1;
/// Longest line that osp reads; real lines are far shorter.
const MOST_LINE_BYTES: u64 = 16 << 20;

/// One session. docs/study.md describes the fields.
#[derive(Serialize)]
pub(super) struct StudyLine<'a> {
    /// Version of the fields. It comes first, so that osp recognises its own lines.
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
    /// A line without results.
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
    /// Hash of the program if the commit is unknown or had changes.
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
    /// Two indexes saw different polygons.
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

/// The output file of a study.
pub(super) struct StudyFile {
    path: PathBuf,
    file: File,
}

impl StudyFile {
    /// Opens or creates the file. It must be none of the `inputs`, the sessions.
    pub(super) fn open(path: &Path, inputs: &[PathBuf], force: bool) -> anyhow::Result<Self> {
        let named = || path.display().to_string();
        if !matches!(Destination::of(path).with_context(named)?, Destination::File(_)) {
            bail!("{}: expected a regular file to add lines to; found a pipe or a device", named());
        }
        Outputs::new(force).reads(inputs).add("--out", path, OutputKind::Study)?;
        let file = File::options().create(true).read(true).append(true).open(path).with_context(named)?;
        let mut file = Self { path: path.to_owned(), file };
        if force {
            file.file.set_len(0).with_context(named)?;
        }
        file.end_line().with_context(named)?;
        Ok(file)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Ends an incomplete line, which a killed process may have left.
    fn end_line(&mut self) -> io::Result<()> {
        if self.file.metadata()?.len() == 0 {
            return Ok(());
        }
        let mut last = [0];
        self.file.seek(SeekFrom::End(-1))?;
        self.file.read_exact(&mut last)?;
        if last == *b"\n" { Ok(()) } else { self.file.write_all(b"\n") }
    }

    /// Adds a line with one write, because other processes may add to the same file.
    pub(super) fn add(&mut self, text: &str) -> anyhow::Result<()> {
        self.file.write_all(format!("{text}\n").as_bytes()).with_context(|| self.path.display().to_string())
    }

    /// Results with the same options and machine, by the hash of the contents. Skips incomplete lines.
    pub(super) fn known(&self, options: &str, machine: &Place) -> anyhow::Result<HashMap<String, Found>> {
        let named = || self.path.display().to_string();
        let mut lines = BufReader::new(open_regular(&self.path).with_context(named)?);
        let (mut known, mut line) = (HashMap::new(), Vec::new());
        for number in 1_u64.. {
            line.clear();
            let read =
                lines.by_ref().take(MOST_LINE_BYTES).read_until(b'\n', &mut line).with_context(named)?;
            match read as u64 {
                0 => break,
                MOST_LINE_BYTES => {
                    bail!("{}: line {number}: expected fewer than {MOST_LINE_BYTES} bytes", named())
                }
                _ => {}
            }
            // Other readers refuse a line that is not UTF-8, even if its damage is in other fields.
            let head = str::from_utf8(&line).ok().and_then(|line| serde_json::from_str::<Head>(line).ok());
            let Some(head) = head.filter(|head| head.options == options && head.machine == *machine) else {
                continue;
            };
            if let Some(hash) = head.file_hash {
                known.insert(
                    hash,
                    Found::new(head.error, head.report.is_none_or(|report| report.indexes_agree)),
                );
            }
        }
        Ok(known)
    }
}
