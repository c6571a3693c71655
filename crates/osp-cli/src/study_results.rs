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
use osp_lab::{
    report::thousands,
    study::{
        Compared, Disagreements, StudyError, StudyReader, StudyRow, StudyWriter, TableFormat, WorkFolder,
        is_study, study_page,
    },
};
use osp_session::{
    atomic_file::{AtomicFile, Destination},
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
    /// Checks the path of a table. A table of another program is replaced only with `force`.
    pub(super) fn checked(outputs: &mut Outputs, path: &Path, force: bool) -> anyhow::Result<Output> {
        let kind = match format_of(path)? {
            format if !format.is_built() => return Err(StudyError::NotBuilt { path: path.to_owned() }.into()),
            TableFormat::Lines => OutputKind::Study,
            TableFormat::Parquet => OutputKind::Parquet,
        };
        let output = outputs.add("--out", path, kind)?;
        if !force && output.replaces_its_kind() && !is_study(path) {
            return Err(anyhow!(
                "{}: holds a table of another program, or a damaged one; --force replaces it",
                path.display()
            ));
        }
        Ok(output)
    }

    pub(super) fn begin(output: Output) -> anyhow::Result<Self> {
        let writer = StudyWriter::new(output.create()?, format_of(output.path())?);
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

/// The format of a table by its name. For standard output, pipes and devices, lines are the default.
fn format_of(path: &Path) -> anyhow::Result<TableFormat> {
    let target = match Destination::of(path) {
        Ok(Destination::File(target)) => target,
        Ok(_) => return Ok(TableFormat::named_by(path).unwrap_or(TableFormat::Lines)),
        Err(error) => return Err(error).with_context(|| path.display().to_string()),
    };
    let format = TableFormat::named_by(path).or_else(|| TableFormat::named_by(&target));
    format.ok_or_else(|| anyhow!("{}: expected a name that ends in .ndjson or .parquet", path.display()))
}

/// Tells rows apart.
pub(super) fn row_hash(row: &StudyRow) -> anyhow::Result<u128> {
    Ok(xxh3_128(&serde_json::to_vec(row)?))
}

/// Refuses to replace a table by one that lacks rows of it, without `force`. `is_missing`: whether the new table lacks a row.
pub(super) fn check_no_row_is_lost(
    output: &Output,
    force: bool,
    mut is_missing: impl FnMut(&StudyRow) -> anyhow::Result<bool>,
) -> anyhow::Result<()> {
    if force || !output.replaces_its_kind() {
        return Ok(());
    }
    let path = output.path();
    let (mut missing, mut first) = (0_u64, None);
    for row in StudyReader::open(path)? {
        let row = row.map_err(|error| anyhow!("{error}; --force replaces it"))?;
        if is_missing(&row)? {
            missing += 1;
            first.get_or_insert(row.file);
        }
    }
    let Some(first) = first else { return Ok(()) };
    Err(anyhow!(
        "{}: holds rows of another study ({}, the first of {first}); --force replaces it",
        path.display(),
        thousands(missing)
    ))
}

pub(super) fn merge(args: &MergeArgs) -> anyhow::Result<Outcome> {
    let mut outputs = Outputs::new(args.force).reads(&args.results.from);
    let output = Table::checked(&mut outputs, &args.out, args.force)?;
    let mut table = Table::begin(output.clone())?;
    // A hash a row, not the row.
    let mut seen = HashSet::new();
    let mut twice = 0;
    each_row(&args.results.from, |row| {
        let is_new = seen.insert(row_hash(&row)?);
        twice += u64::from(!is_new);
        if is_new { table.add(row) } else { Ok(()) }
    })?;
    check_no_row_is_lost(&output, args.force, |row| Ok(!seen.contains(&row_hash(row)?)))?;
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
