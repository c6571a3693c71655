//! The command line: each subcommand has arguments and a function `run`.
//!
//! Exit codes: 0 done, 1 a check failed, 2 bad input or usage.
//!
//! This crate may use every other crate; no crate uses it.

mod allocations;
mod author_rows;
mod batch;
mod brush_rows;
mod built;
mod numbers;
mod output;
mod outputs;
mod parsers;
mod played;
mod progress;
mod query;
mod ray_search;
mod reading;
mod session;
mod structure_args;
mod version;

mod bake;
#[cfg(feature = "bench")]
mod bench;
#[cfg_attr(not(feature = "bench"), allow(dead_code, reason = "options of a command that this build lacks"))]
mod bench_args;
#[cfg(feature = "bench")]
mod bench_paper;
#[cfg_attr(not(feature = "bench"), allow(dead_code, reason = "options of a command that this build lacks"))]
mod bench_paper_args;
mod convert;
mod cost;
#[cfg_attr(not(feature = "bench"), allow(dead_code, reason = "options of commands that this build lacks"))]
mod draw_args;
#[cfg(feature = "bench")]
mod draw_index;
#[cfg(feature = "bench")]
mod draw_insertion;
#[cfg(feature = "bench")]
mod draw_occlusion;
#[cfg(feature = "render")]
mod drawing;
mod export;
#[cfg(feature = "render")]
mod film;
#[cfg(feature = "render")]
mod film_file;
#[cfg(any(feature = "bench", feature = "render"))]
mod gif_file;
mod import;
mod info;
#[cfg(feature = "live")]
mod join;
#[cfg_attr(not(feature = "live"), allow(dead_code, reason = "options of a command that this build lacks"))]
mod join_args;
#[cfg(feature = "live")]
mod join_player;
#[cfg(feature = "live")]
mod join_recording;
#[cfg(feature = "live")]
mod join_report;
#[cfg(feature = "render")]
mod mp4_file;
#[cfg(feature = "bench")]
mod race;
#[cfg(feature = "bench")]
mod race_view;
mod read_session;
#[cfg(feature = "render")]
mod render;
#[cfg_attr(not(feature = "render"), allow(dead_code, reason = "options of a command that this build lacks"))]
mod render_args;
#[cfg(feature = "render")]
mod render_order;
#[cfg(feature = "render")]
mod render_painter;
#[cfg(feature = "render")]
mod render_pictures;
mod replay;
mod replay_args;
mod replay_session;
mod rig;
mod rig_args;
#[cfg(feature = "window")]
mod send;
#[cfg(feature = "live")]
mod shared;
#[cfg(feature = "window")]
mod sketch;
#[cfg_attr(not(feature = "window"), allow(dead_code, reason = "options of a command that this build lacks"))]
mod sketch_args;
mod study;
mod study_contents;
mod study_lines;
mod synth;
#[cfg(feature = "render")]
mod thumbs;
#[cfg(feature = "window")]
mod tracker;
mod verify;
mod verify_all;
#[cfg_attr(not(feature = "render"), path = "verify_not_drawn.rs")]
mod verify_drawn;
mod verify_method;

pub use allocations::CountingAllocator;
use output::Outcome;

use std::{
    error::Error,
    ffi::OsString,
    num::{IntErrorKind, ParseIntError},
    path::Path,
    process::ExitCode,
};

use clap::{
    Args, CommandFactory, FromArgMatches, Parser, Subcommand,
    error::{ContextKind, ContextValue, ErrorKind},
};

/// See, draw, film and convert 3D sketches, and cull 3D models in real time while somebody draws them. `osp sketch.tilt`
/// opens the window. The commands for measurements replay recorded sessions through the OSP tree and rival structures.
#[derive(Parser, Debug)]
#[command(name = "osp", version = version::VERSION.as_str(), arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  osp sketch.tilt         opens the window, as does osp sketch
  osp sketch house.ron
  osp render recordings/room.ron room.png
  osp film sketch.tilt film.mp4
  osp export sketch.tilt sketch.glb
  osp convert sketches --to glb --out models
  osp convert edited.ron sketch.tilt
  osp info painting.apa
  osp import painting.apa painting.ron
  osp thumbs sketches --out thumbs
  osp replay recordings/portrait.ron
  osp replay sketch.tilt --chart frames.png
  osp race recordings/portrait.ron
  osp bench recordings/*.ron --quick --html bench.html
  osp verify recordings/room.ron
  osp study sketches --out results.ndjson
  osp synth room --polygons 12000 room.ron
  osp bake recordings/room.ron room.pvs
  osp join nats://127.0.0.1/house
  osp replay --help       describes the indexes and the methods of --occlusion

Sessions may be .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .poses.gz, .obj, .obj.gz, .glb or .gltf.
Exit codes: 0 done, 1 a check failed, 2 bad input or usage.";

#[derive(Subcommand, Debug)]
enum Command {
    Sketch(Box<sketch_args::SketchArgs>),
    Render(Box<render_args::RenderArgs>),
    Film(render_args::FilmArgs),
    Export(export::ExportArgs),
    Convert(convert::ConvertArgs),
    Info(info::InfoArgs),
    Import(import::ImportArgs),
    Thumbs(render_args::ThumbsArgs),
    Replay(Box<replay::ReplayArgs>),
    Race(bench_args::RaceArgs),
    Bench(bench_args::BenchArgs),
    Verify(verify::VerifyArgs),
    Study(study::StudyArgs),
    Query(query::QueryArgs),
    Synth(synth::SynthArgs),
    DrawIndex(draw_args::DrawIndexArgs),
    DrawInsertion(draw_args::DrawInsertionArgs),
    DrawOcclusion(draw_args::DrawOcclusionArgs),
    Bake(bake::BakeArgs),
    Join(Box<join_args::JoinArgs>),
    Rig(rig::RigCommand),
    Send(sketch_args::SendArgs),
    Completions(CompletionsArgs),
}

/// Print a completion script for a shell.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp completions bash > ~/.local/share/bash-completion/completions/osp
  osp completions zsh > ~/.zfunc/_osp
  osp completions fish > ~/.config/fish/completions/osp.fish")]
struct CompletionsArgs {
    /// The shell.
    shell: clap_complete::Shell,
}

fn complete(args: &CompletionsArgs) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "osp", &mut script);
    output::print_result(String::from_utf8(script)?.trim_end())?;
    Ok(Outcome::Done)
}

/// Runs a command that needs a feature. A build without the feature has already refused the command.
macro_rules! of_feature {
    ($feature:literal, $run:path, $args:ident) => {{
        #[cfg(feature = $feature)]
        let outcome = $run($args);
        #[cfg(not(feature = $feature))]
        let outcome = {
            let _ = $args;
            Err(anyhow::anyhow!("this build lacks the feature `{}`", $feature))
        };
        outcome
    }};
}

impl Command {
    fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Replay(args) => replay::run(args),
            Self::Info(args) => info::run(args),
            Self::Bake(args) => bake::run(args),
            Self::Import(args) => import::run(args),
            Self::Convert(args) => convert::run(args),
            Self::Export(args) => export::run(args),
            Self::Bench(args) => of_feature!("bench", bench::run, args),
            Self::DrawIndex(args) => of_feature!("bench", draw_index::run, args),
            Self::DrawInsertion(args) => of_feature!("bench", draw_insertion::run, args),
            Self::DrawOcclusion(args) => of_feature!("bench", draw_occlusion::run, args),
            Self::Race(args) => of_feature!("bench", race::run, args),
            Self::Query(args) => query::run(args),
            Self::Study(args) => study::run(args),
            Self::Synth(args) => synth::run(args),
            Self::Render(args) => of_feature!("render", render::run, args),
            Self::Film(args) => of_feature!("render", film::run, args),
            Self::Thumbs(args) => of_feature!("render", thumbs::run, args),
            Self::Verify(args) => verify::run(args),
            Self::Completions(args) => complete(args),
            Self::Rig(args) => rig::run(args),
            Self::Join(args) => of_feature!("live", join::run, args),
            Self::Sketch(args) => of_feature!("window", sketch::run, args),
            Self::Send(args) => of_feature!("window", send::run, args),
        }
    }
}

/// Runs the program with the arguments of the process.
pub fn run() -> ExitCode {
    let parsed = Cli::command().try_get_matches_from(with_command(std::env::args_os().collect()));
    let parsed = parsed.and_then(|matches| Ok((Cli::from_arg_matches(&matches)?, matches)));
    let (command, matches) = match parsed {
        Ok((Cli { command }, matches)) => (command, matches),
        Err(error) => return usage(&error),
    };
    #[cfg(unix)]
    if let Err(error) = osp_session::atomic_file::remove_unfinished_on_signals() {
        output::warn(&format!("warning: if a signal ends osp, an unfinished file will remain: {error}"));
    }
    let outcome = built::check(&matches).and_then(|()| command.run());
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        Err(error) => {
            let rescue = session::rescue(&error).unwrap_or_default();
            output::warn(&format!("error: {error:#}{rescue}"));
            ExitCode::from(2)
        }
    }
}

/// Adds the command that opens the window to arguments that begin with a session, in a build with a window.
fn with_command(mut args: Vec<OsString>) -> Vec<OsString> {
    let is_named =
        |arg: &OsString| is_session(Path::new(arg)) && Cli::command().find_subcommand(arg).is_none();
    if cfg!(feature = "window") && args.get(1).is_some_and(is_named) {
        args.insert(1, "sketch".into());
    }
    args
}

/// Whether a path may be a session: a file, or an unpacked `.tilt`, which is a folder. `osp sketch` refuses another folder.
fn is_session(path: &Path) -> bool {
    path.exists()
}

/// Prints the help, or the error in the arguments.
fn usage(error: &clap::Error) -> ExitCode {
    if error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // The error quotes the arguments, which may have several lines.
        output::warn_lines(usage_error(error).trim_end());
    } else {
        // A closed pipe is no error.
        let _ = error.print();
    }
    ExitCode::from(if error.use_stderr() { 2 } else { 0 })
}

/// Formats a clap error. Replaces the standard library's message for a malformed number with the expected form. If the
/// user named a file instead of a command, adds a hint, or reports that the file is missing.
fn usage_error(error: &clap::Error) -> String {
    if let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand)
        && name.contains(['.', '/', '\\'])
        && !Path::new(name).exists()
    {
        return format!(
            "error: {name}: there is no such file, and no such command (osp --help lists the commands)"
        );
    }
    let mut text = error.render().to_string();
    if let Some(cause) = error.source().and_then(|cause| cause.downcast_ref::<ParseIntError>()) {
        let expected = match cause.kind() {
            IntErrorKind::PosOverflow => "expected a smaller number",
            IntErrorKind::NegOverflow => "expected a larger number",
            _ => "expected a whole number without a sign",
        };
        text = text.replacen(&cause.to_string(), expected, 1);
    }
    if let Some(ContextValue::String(name)) = error.get(ContextKind::InvalidSubcommand)
        && is_session(Path::new(name))
    {
        let name = session::quoted(name);
        let see = "to see it in a window, build osp with --features window";
        text = format!("{}\n\n{see}\nto replay it: osp replay {name}", text.trim_end());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_in_place_of_a_command_is_opened_in_a_build_with_a_window() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        let of = |args: &[&str]| with_command(args.iter().map(OsString::from).collect());
        let opened: &[&str] =
            if cfg!(feature = "window") { &["osp", "sketch", file, "-h"] } else { &["osp", file, "-h"] };
        assert_eq!(of(&["osp", file, "-h"]), opened);
        let folder = tempfile::tempdir().expect("a folder");
        let unpacked = folder.path().join("a.tilt");
        std::fs::create_dir(&unpacked).expect("created");
        let unpacked = unpacked.to_str().expect("utf-8");
        assert_eq!(of(&["osp", unpacked]).len(), if cfg!(feature = "window") { 3 } else { 2 });
        for same in [&["osp"][..], &["osp", "replay", file], &["osp", "no-such-file.ron"], &["osp", "--help"]]
        {
            assert_eq!(of(same), same);
        }
    }
}
