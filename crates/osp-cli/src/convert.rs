//! `osp convert`: writes sessions, or folders of them, in another format.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};

use super::{
    batch::{Batch, Job, every_core},
    export::{Model, StaticArgs, write_model},
    import,
    output::Outcome,
    outputs::{ForceArgs, Output, Outputs},
    played::FrameArgs,
    reading::ReadArgs,
    session::{OpenSession, Reader},
};
use osp_lab::report::thousands;
use osp_session::{
    export::{KeptStrokes, Objects, write_tilt},
    recording::import::tilt_thumbnail,
};

/// Convert a session, or all sessions in folders, to another format.
///
/// A .tilt file holds the data of Tilt Brush and Open Brush: strokes with brushes, control points and pressures,
/// layers, groups, camera and light. Erased strokes are skipped, and moved strokes are written in their new places. A
/// session that came from a .tilt file gets all its metadata back, and osp reads its unchanged strokes back bit for bit.
/// A warning names each thing that .tilt cannot hold. Only this command and the window write .tilt. `osp export` writes
/// the polygons of one frame, and `osp import` writes every event.
///
/// With --to, the command converts all sessions in the folders, on all cores. It skips a target that is newer than its
/// session, so the same command continues after an interruption. Each file appears only when it is complete. If there
/// were errors, they are listed at the end, and the exit code is 2.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp convert edited.ron sketch.tilt
  osp convert sketches --to glb --static --out models
  osp convert sketches more/*.apa --to ron.zst
  osp convert recordings --to tilt --out tilt")]
pub(super) struct ConvertArgs {
    /// The session and the file to write. With --to: sessions, and folders of them.
    #[arg(required = true, value_name = "FILE OUT|FILES_OR_FOLDERS")]
    paths: Vec<PathBuf>,
    /// The format: binary glTF, plain triangles (STL, PLY, OBJ), osp's recording, the same compressed, or Tilt Brush.
    #[arg(long, value_name = "FORMAT", value_enum)]
    to: Option<Format>,
    /// The folder for the files. They get the same subfolders as the sessions [default: beside each session].
    #[arg(long, value_name = "FOLDER", requires = "to")]
    out: Option<PathBuf>,
    #[command(flatten)]
    whole: StaticArgs,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    reading: ReadArgs,
}

/// A format to convert sessions to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Glb,
    Stl,
    Ply,
    Obj,
    Ron,
    #[value(name = "ron.zst")]
    RonZst,
    Tilt,
}

impl Format {
    fn ending(self) -> &'static str {
        match self {
            Self::Glb => ".glb",
            Self::Stl => ".stl",
            Self::Ply => ".ply",
            Self::Obj => ".obj",
            Self::Ron => ".ron",
            Self::RonZst => ".ron.zst",
            Self::Tilt => ".tilt",
        }
    }
}

pub(super) fn run(args: &ConvertArgs) -> anyhow::Result<Outcome> {
    let Some(format) = args.to else { return one(args) };
    check(args, format)?;
    if args.paths.iter().any(|path| path == Path::new("-")) {
        bail!("-: standard input has no name for its target; expected `osp convert - OUT`");
    }
    let batch = Batch::plan(&args.paths, args.out.as_deref(), format.ending(), args.force.force)?;
    batch.run(every_core(), ["converted", format.ending()], || {
        Ok(|job: &Job| Ok(converted(args, job, format)?.remarks))
    })
}

/// Runs `osp convert FILE OUT`.
fn one(args: &ConvertArgs) -> anyhow::Result<Outcome> {
    let [source, target] = &args.paths[..] else {
        bail!("expected a session and the file to write, or --to FORMAT; found {} paths", args.paths.len());
    };
    let name = target.to_string_lossy().to_ascii_lowercase();
    let format = Format::value_variants().iter().find(|format| name.ends_with(format.ending()));
    let Some(&format) = format else {
        bail!(
            "{}: expected a name that ends in .glb, .stl, .ply, .obj, .ron, .ron.zst or .tilt",
            target.display()
        );
    };
    check(args, format)?;
    converted(
        args,
        &Job { source: source.clone(), target: target.clone(), replaces: args.force.force },
        format,
    )?
    .print(target)
}

/// Rejects options that the format lacks.
fn check(args: &ConvertArgs, format: Format) -> anyhow::Result<()> {
    match args.whole.given() {
        Some(option) if format != Format::Glb => {
            bail!("{option} is for .glb only; found {}", format.ending())
        }
        _ => Ok(()),
    }
}

fn converted(args: &ConvertArgs, job: &Job, format: Format) -> anyhow::Result<Model> {
    let mut outputs = Outputs::new(job.replaces).reads([&job.source]);
    let output = outputs.add(&job.target, &[])?;
    match format {
        Format::Glb | Format::Stl | Format::Ply | Format::Obj => {
            let session = FrameArgs::end_of(job.source.clone(), args.reading);
            write_model(&session, args.whole.objects().unwrap_or(Objects::Layers), &output)
        }
        Format::Ron | Format::RonZst => {
            let mut session = OpenSession::read_by(Reader::Here, &job.source, &args.reading)?;
            let (counts, bytes) = import::convert(&mut session, output, args.reading.lenient)?;
            Ok(model(&session, counts.text(), bytes, Vec::new()))
        }
        Format::Tilt => sketch(args, job, &output),
    }
}

/// Writes the strokes of a session as a `.tilt` file.
fn sketch(args: &ConvertArgs, job: &Job, output: &Output) -> anyhow::Result<Model> {
    let mut session = OpenSession::read_by(Reader::Here, &job.source, &args.reading)?;
    let mut kept = KeptStrokes::default();
    for event in session.by_ref() {
        kept.note(&event.map_err(|error| import::explain(&error, args.reading.lenient))?);
    }
    // Copies the thumbnail of a .tilt. Sessions of other formats have none.
    let thumbnail = tilt_thumbnail(&job.source);
    let mut lost = Vec::new();
    if session.format == "tilt" && !job.source.is_file() && !job.source.is_dir() {
        lost.push("a sketch from a pipe loses its thumbnail; name its file to keep it".to_owned());
    }
    let mut file = output.create()?;
    let named = || output.path().display().to_string();
    let counts =
        write_tilt(&mut kept, &session.header, thumbnail.as_deref(), &mut file).with_context(named)?;
    file.flush().with_context(named)?;
    let bytes = output.commit(file)?;
    let line = format!("{} strokes, {} points", thousands(counts.strokes), thousands(counts.points));
    lost.extend(counts.notes);
    Ok(model(&session, line, bytes, lost))
}

fn model(session: &OpenSession, line: String, bytes: Option<u64>, mut remarks: Vec<String>) -> Model {
    let notes = session.notes();
    remarks.extend(notes.warnings.iter().cloned());
    if notes.skipped > 0 {
        remarks.push(format!("damaged parts skipped: {}", thousands(notes.skipped)));
    }
    let bytes = bytes.map_or_else(String::new, |bytes| format!("; {} bytes", thousands(bytes)));
    Model { line: format!("{line}{bytes}"), remarks }
}
