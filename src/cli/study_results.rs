//! What is done with the results of studies: `osp study merge`, `check`, `report`.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow};
use xxhash_rust::xxh3::xxh3_128;

use super::{
    Outcome,
    output::{complain, say},
    outputs::{Output, Outputs},
    study::{CheckArgs, MergeArgs, ReportArgs},
};
use crate::{
    atomic_file::AtomicFile,
    lab::{
        report::thousands,
        study::{
            Compared, Disagreements, StudyReader, StudyRow, StudyWriter, WorkFolder, is_study, study_page,
        },
    },
    output_file::OutputKind,
};

/// Most sessions with different fingerprints that are named.
const MOST_NAMED: usize = 20;

/// Hands over every row of tables and work folders; memory holds a group of rows at a time.
fn each_row(from: &[PathBuf], mut each: impl FnMut(StudyRow) -> anyhow::Result<()>) -> anyhow::Result<()> {
    // What is none is said before the first row is taken.
    for path in from {
        match path.is_dir() {
            true => drop(WorkFolder::open(path)?),
            false => drop(StudyReader::open(path)?),
        }
    }
    for path in from {
        if path.is_dir() {
            for part in WorkFolder::open(path)?.parts()? {
                part?.rows.into_iter().try_for_each(&mut each)?;
            }
        } else {
            for row in StudyReader::open(path)? {
                each(row?)?;
            }
        }
    }
    Ok(())
}

/// A table on its way.
pub(super) struct Table {
    output: Output,
    writer: StudyWriter<AtomicFile>,
}

impl Table {
    /// Checks the place of a table; a Parquet file that is no study is somebody else's.
    pub(super) fn checked(outputs: &mut Outputs, path: &Path, force: bool) -> anyhow::Result<Output> {
        let output = outputs.add("--out", path, OutputKind::Parquet)?;
        if !force && output.replaces_its_kind() && !is_study(path) {
            return Err(anyhow!(
                "{}: holds a table of another program, or a damaged one; --force replaces it",
                path.display()
            ));
        }
        Ok(output)
    }

    pub(super) fn begin(output: Output) -> anyhow::Result<Self> {
        let writer = StudyWriter::new(output.create()?);
        let writer = writer.with_context(|| output.path().display().to_string())?;
        Ok(Self { output, writer })
    }

    pub(super) fn add(&mut self, row: StudyRow) -> anyhow::Result<()> {
        self.writer.write(row).with_context(|| self.output.path().display().to_string())
    }

    pub(super) fn path(&self) -> &Path {
        self.output.path()
    }

    /// Gives the table its name; its number of rows.
    pub(super) fn commit(self) -> anyhow::Result<u64> {
        let (file, rows) = self.writer.finish().with_context(|| self.output.path().display().to_string())?;
        self.output.commit(file)?;
        Ok(rows)
    }
}

pub(super) fn merge(args: &MergeArgs) -> anyhow::Result<Outcome> {
    let mut outputs = Outputs::new(args.force).reads(&args.results.from);
    let mut table = Table::begin(Table::checked(&mut outputs, &args.out, args.force)?)?;
    // A hash a row, not the row.
    let mut seen = HashSet::new();
    let mut twice = 0;
    each_row(&args.results.from, |row| {
        let is_new = seen.insert(xxh3_128(&serde_json::to_vec(&row)?));
        twice += u64::from(!is_new);
        if is_new { table.add(row) } else { Ok(()) }
    })?;
    let rows = table.commit()?;
    let twice = if twice > 0 { format!("; {} were there twice", thousands(twice)) } else { String::new() };
    say(&format!("{}: {} rows{twice}", args.out.display(), thousands(rows)))?;
    Ok(Outcome::Done)
}

pub(super) fn check(args: &CheckArgs) -> anyhow::Result<Outcome> {
    let mut disagreements = Disagreements::default();
    each_row(&args.results.from, |row| {
        disagreements.add(&row);
        Ok(())
    })?;
    let (compared, incomplete) = disagreements.counts();
    let found: Vec<_> = disagreements.found().collect();
    for disagreement in found.iter().take(MOST_NAMED) {
        complain(&disagreement.text());
    }
    if found.len() > MOST_NAMED {
        complain(&format!("and {} more", thousands((found.len() - MOST_NAMED) as u64)));
    }
    let left_out = match incomplete {
        0 => String::new(),
        n => format!("; {} could not be compared: frames were left out (--budget)", thousands(n)),
    };
    if compared == 0 {
        say(&format!(
            "Nothing could be compared: no session was measured by two indexes, machines or builds{left_out}."
        ))?;
        return Ok(Outcome::Done);
    }
    let compared = thousands(compared);
    if found.is_empty() {
        say(&format!(
            "All machines and indexes saw the same polygons: {compared} results compared{left_out}."
        ))?;
        return Ok(Outcome::Done);
    }
    let found = thousands(found.len() as u64);
    say(&format!(
        "{found} sessions look different on different machines, builds or indexes; {compared} results compared{left_out}."
    ))?;
    Ok(Outcome::CheckFailed)
}

pub(super) fn report(args: &ReportArgs) -> anyhow::Result<Outcome> {
    let mut outputs = Outputs::new(args.force).reads(&args.results.from);
    let output = outputs.add("--out", &args.out, OutputKind::Html)?;
    let (mut compared, mut disagreements) = (Compared::default(), Disagreements::default());
    each_row(&args.results.from, |row| {
        compared.add(&row);
        disagreements.add(&row);
        Ok(())
    })?;
    let names: Vec<String> = args.results.from.iter().map(|path| path.display().to_string()).collect();
    let page = study_page(&compared, &disagreements, &names.join(", "))
        .map_err(|error| anyhow!("{}: {error}", output.path().display()))?;
    output.write(page.as_bytes())?;
    Ok(Outcome::Done)
}
