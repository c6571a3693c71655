//! The command line: one file for each subcommand, each a set of arguments and a `run`.
//!
//! Exit codes: 0 done, 1 a check failed, 2 bad input or usage.
//!
//! It may use every other module; no module uses it.

mod allocations;
mod author_rows;
mod brush_rows;
mod new_recording;
#[cfg(not(all(feature = "live", feature = "serve", feature = "window", feature = "worlds")))]
mod not_built;
mod numbers;
mod occlusion_tests;
mod output;
mod outputs;
#[cfg(feature = "worlds")]
mod pack;
mod parsers;
mod pick;
mod played;
mod polygon_tally;
mod progress;
mod query;
mod reading;
mod session;
mod version;

mod bake;
mod bench;
mod bench_paper;
mod completions;
mod config;
mod defaults;
mod draw_index;
#[cfg(feature = "render")]
mod drawing;
mod export;
mod frame_choice;
mod import;
mod info;
#[cfg(feature = "live")]
mod join;
#[cfg(feature = "live")]
mod join_player;
#[cfg(feature = "live")]
mod join_recording;
#[cfg(feature = "live")]
mod join_report;
mod man;
#[cfg(feature = "render")]
mod render;
#[cfg(feature = "render")]
mod render_order;
#[cfg(feature = "render")]
mod render_painter;
#[cfg(feature = "render")]
mod render_pictures;
mod replay;
mod replay_args;
mod replay_outputs;
mod replay_session;
mod replay_text;
#[cfg(feature = "worlds")]
mod replay_world;
mod rig;
mod rig_args;
#[cfg(feature = "window")]
mod send;
mod serve;
#[cfg(feature = "serve")]
mod serve_answer;
#[cfg(feature = "serve")]
mod serve_http;
#[cfg(feature = "live")]
mod shared_args;
#[cfg(feature = "window")]
mod sketch;
mod study;
mod study_files;
mod study_measure;
mod study_progress;
mod study_results;
mod synth;
#[cfg(feature = "window")]
mod tracker_args;
mod verify;
mod verify_all;
#[cfg_attr(not(feature = "render"), path = "verify_not_drawn.rs")]
mod verify_drawn;
mod verify_json;
mod verify_method;
#[cfg(feature = "live")]
mod wall;
#[cfg(feature = "live")]
mod wall_text;
#[cfg(feature = "worlds")]
mod world_args;
#[cfg(feature = "worlds")]
mod world_report;

pub use allocations::CountingAllocator;

use std::{ffi::OsString, process::ExitCode, sync::OnceLock};

use clap::{CommandFactory, Parser, Subcommand, error::ErrorKind};

/// Keep a 3D model drawable in real time while somebody draws it: replay recorded sketching sessions through the OSP
/// tree and rival structures, and see what each frame costs.
#[derive(Parser, Debug)]
#[command(name = "osp", version = version::VERSION.as_str(), arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "Examples:
  osp replay recordings/portrait.ron
  osp replay sketch.tilt --chart frames.png
  osp info painting.apa
  osp import painting.apa painting.ron
  osp export sketch.tilt sketch.glb
  osp bench recordings/*.ron --quick --html bench.html
  osp study sketches --out results.ndjson
  osp synth room --polygons 12000 room.ron
  osp verify recordings/room.ron
  osp render recordings/room.ron room.png
  osp bake recordings/room.ron room.pvs
  osp pack recordings/*.ron --out sketches.world
  osp sketch house.ron
  osp serve
  osp join nats://127.0.0.1/house
  osp wall --hub nats://127.0.0.1/house --rig cave4
  osp replay --help       describes the indexes and the methods of occlusion culling

Sessions may be .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
Exit codes: 0 done, 1 a check failed, 2 bad input or usage.";

#[derive(Subcommand, Debug)]
enum Command {
    Replay(replay::ReplayArgs),
    Info(info::InfoArgs),
    Bake(bake::BakeArgs),
    Import(import::ImportArgs),
    Export(export::ExportArgs),
    Bench(bench::BenchArgs),
    DrawIndex(draw_index::DrawIndexArgs),
    #[cfg(feature = "worlds")]
    Pack(pack::PackArgs),
    #[cfg(not(feature = "worlds"))]
    Pack(not_built::NotBuilt),
    Pick(pick::PickArgs),
    Query(query::QueryArgs),
    Study(study::StudyArgs),
    Synth(synth::SynthArgs),
    #[cfg(feature = "render")]
    Render(render::RenderArgs),
    #[cfg(not(feature = "render"))]
    Render(not_built::NotBuilt),
    Verify(verify::VerifyArgs),
    Completions(completions::CompletionsArgs),
    Config(config::ConfigArgs),
    Man(man::ManArgs),
    Rig(rig::RigCommand),
    Serve(serve::ServeArgs),
    #[cfg(feature = "live")]
    Join(Box<join::JoinArgs>),
    #[cfg(not(feature = "live"))]
    Join(not_built::NotBuilt),
    #[cfg(feature = "live")]
    Wall(Box<wall::WallArgs>),
    #[cfg(not(feature = "live"))]
    Wall(not_built::NotBuilt),
    #[cfg(feature = "window")]
    Sketch(sketch::SketchArgs),
    #[cfg(feature = "window")]
    Send(send::SendArgs),
    #[cfg(not(feature = "window"))]
    Sketch(not_built::NotBuilt),
    #[cfg(not(feature = "window"))]
    Send(not_built::NotBuilt),
}

/// How a command ended, other than by bad input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Done,
    CheckFailed,
}

/// The words of the command line, the user's defaults among them.
static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// The command line that was obeyed.
fn command_line() -> Vec<String> {
    let words = WORDS.get().into_iter().flatten();
    words.map(|word| word.to_string_lossy().into_owned()).collect()
}

/// Runs the program with the arguments of the process.
pub fn run() -> ExitCode {
    let words: Vec<OsString> = std::env::args_os().collect();
    let all = match defaults::added(&Cli::command(), &words) {
        Ok(all) => all,
        Err(error) => {
            output::complain(&format!("error: {error:#}"));
            return ExitCode::from(2);
        }
    };
    let command = match Cli::try_parse_from(&all) {
        Ok(Cli { command }) => command,
        Err(error) => {
            let code = usage(&error);
            if error.use_stderr() && all.len() > words.len() {
                output::complain(
                    "osp config shows which options have defaults of yours; they count as given here",
                );
            }
            return code;
        }
    };
    WORDS.get_or_init(|| all);
    #[cfg(unix)]
    if let Err(error) = crate::atomic_file::remove_unfinished_on_signals() {
        output::complain(&format!(
            "warning: an unfinished file will stay behind if a signal ends this: {error}"
        ));
    }
    let outcome = match command {
        Command::Replay(args) => replay::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Bake(args) => bake::run(&args),
        Command::Import(args) => import::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::DrawIndex(args) => draw_index::run(&args),
        #[cfg(feature = "worlds")]
        Command::Pack(args) => pack::run(&args),
        #[cfg(not(feature = "worlds"))]
        Command::Pack(_) => not_built::refuse("pack", "worlds"),
        Command::Pick(args) => pick::run(&args),
        Command::Query(args) => query::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Synth(args) => synth::run(&args),
        #[cfg(feature = "render")]
        Command::Render(args) => render::run(&args),
        #[cfg(not(feature = "render"))]
        Command::Render(_) => not_built::refuse("render", "render"),
        Command::Verify(args) => verify::run(&args),
        Command::Completions(args) => completions::run(&args, Cli::command()),
        Command::Config(args) => config::run(&args, Cli::command()),
        Command::Rig(args) => rig::run(&args),
        Command::Serve(args) => serve::run(&args),
        #[cfg(feature = "live")]
        Command::Join(args) => join::run(&args),
        #[cfg(not(feature = "live"))]
        Command::Join(_) => not_built::refuse("join", "live"),
        #[cfg(feature = "live")]
        Command::Wall(args) => wall::run(&args),
        #[cfg(not(feature = "live"))]
        Command::Wall(_) => not_built::refuse("wall", "live"),
        Command::Man(args) => man::run(&args, Cli::command()),
        #[cfg(feature = "window")]
        Command::Sketch(args) => sketch::run(&args),
        #[cfg(feature = "window")]
        Command::Send(args) => send::run(&args),
        #[cfg(not(feature = "window"))]
        Command::Sketch(_) => not_built::refuse("sketch", "window"),
        #[cfg(not(feature = "window"))]
        Command::Send(_) => not_built::refuse("send", "window"),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        Err(error) => {
            let rescue = session::rescue(&error).unwrap_or_default();
            output::complain(&format!("error: {error:#}{rescue}"));
            ExitCode::from(2)
        }
    }
}

/// Prints the help that was asked for, or what is wrong with the arguments.
fn usage(error: &clap::Error) -> ExitCode {
    if error.use_stderr() && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // Arguments are quoted in it.
        output::complain_at_length(error.render().to_string().trim_end());
    } else {
        // A closed pipe is no error.
        let _ = error.print();
    }
    ExitCode::from(if error.use_stderr() { 2 } else { 0 })
}
