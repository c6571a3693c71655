//! `osp study`: many sessions, measured on one machine or on many.

use std::path::PathBuf;

use clap::{Args, Subcommand};

#[cfg(feature = "bench")]
use super::{Outcome, study_measure::measure, study_results};
use super::{replay_args::PlayArgs, verify_all::Part};

/// Measure many sessions, and keep the figures as a table (lines of JSON, or Parquet) with a row for each session and index.
///
/// All cores work, each on one session at a time. A session that cannot be read is a row with its error. What was measured is
/// kept, a file a session, in the folder --work: the same command goes on where it was stopped, by whatever. A row holds the
/// figures of `osp replay --json`, and names the file and its hash, the build of osp and the machine.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:
  osp study sketches --out results.ndjson
  osp study sketches --index osp,octree-rebuild,bvh-sah --camera inside --out inside.ndjson
  osp study sketches --shard 2/8 --out part-2.ndjson
  osp study merge part-*.ndjson --out all.ndjson
  osp study check all.ndjson
  osp study report all.ndjson --out report.html

A session is measured again if its contents, an option that matters or the build of osp differs from
what is kept. Names do not matter: a session that lies there twice is measured once, and has its rows
under both names. On many machines each takes a shard and writes a table of its own (docs/study.md has
recipes for GNU parallel, Slurm and HyperQueue, and questions to the tables in SQL).
Parquet is in builds with the feature `parquet`; `osp study merge` makes one format of the other.
`osp replay --help` describes the indexes and the methods of occlusion culling."
)]
pub(super) struct StudyArgs {
    #[command(subcommand)]
    command: Option<StudyCommand>,
    #[command(flatten)]
    measure: MeasureArgs,
}

#[derive(Subcommand, Debug)]
enum StudyCommand {
    Merge(MergeArgs),
    Check(CheckArgs),
    Report(ReportArgs),
}

/// The sessions, and how they are measured.
#[derive(Args, Debug)]
pub(super) struct MeasureArgs {
    /// The sessions, of any format that replay reads, or folders of them.
    #[arg(required = true, value_name = "FILES_OR_FOLDERS")]
    pub(super) files: Vec<PathBuf>,
    /// The table to write: .ndjson, a line of JSON for each row, or .parquet. It may be left out with --work: `osp study merge` makes a table later.
    #[arg(long, value_name = "FILE", required_unless_present = "work")]
    pub(super) out: Option<PathBuf>,
    /// The folder in which each session that was measured is kept [default: the name of --out with `.parts`].
    #[arg(long, value_name = "DIR")]
    pub(super) work: Option<PathBuf>,
    /// Of the sessions only the I-th of N shards. A hash of its contents says which shard a session belongs to.
    #[arg(long, value_name = "I/N")]
    pub(super) shard: Option<Part>,
    /// How many sessions are measured at the same time [default: the hardware threads that osp may use].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) jobs: Option<u16>,
    /// Let the table replace a table of another study or a file of another kind, but never a file that is read.
    #[arg(long)]
    pub(super) force: bool,
    #[command(flatten)]
    pub(super) play: PlayArgs,
}

/// Where results are read from.
#[derive(Args, Debug)]
pub(super) struct ResultArgs {
    /// Tables (.ndjson or .parquet) of `osp study`, and folders that --work named.
    #[arg(required = true, value_name = "TABLE_OR_DIR")]
    pub(super) from: Vec<PathBuf>,
}

/// Make one table of several, and of folders of measured sessions. A row that is there twice is taken once.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  osp study merge part-*.ndjson node7.ndjson.parts --out all.ndjson")]
pub(super) struct MergeArgs {
    #[command(flatten)]
    pub(super) results: ResultArgs,
    /// The table to write: .ndjson, a line of JSON for each row, or .parquet.
    #[arg(long, value_name = "FILE")]
    pub(super) out: PathBuf,
    /// Let the table replace a table of another study or a file of another kind, but never a file that is read.
    #[arg(long)]
    pub(super) force: bool,
}

/// Say whether all machines, builds and indexes saw the same polygons: exit code 1 if a session has several fingerprints.
///
/// Compared are the rows of the same contents of a file with the same pace and camera. Rows of which frames were left out
/// (`--budget`) are not.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  osp study check laptop.ndjson cluster.ndjson")]
pub(super) struct CheckArgs {
    #[command(flatten)]
    pub(super) results: ResultArgs,
}

/// Write a page with a verdict, charts and a row for each session.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  osp study report results.ndjson --out report.html")]
pub(super) struct ReportArgs {
    #[command(flatten)]
    pub(super) results: ResultArgs,
    /// The page to write, .html.
    #[arg(long, value_name = "FILE")]
    pub(super) out: PathBuf,
    /// Let the page replace a file of another kind, but never a file that is read.
    #[arg(long)]
    pub(super) force: bool,
}

#[cfg(feature = "bench")]
pub(super) fn run(args: &StudyArgs) -> anyhow::Result<Outcome> {
    match &args.command {
        None => measure(&args.measure),
        Some(StudyCommand::Merge(args)) => study_results::merge(args),
        Some(StudyCommand::Check(args)) => study_results::check(args),
        Some(StudyCommand::Report(args)) => study_results::report(args),
    }
}
