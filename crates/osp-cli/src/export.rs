//! `osp export`: writes the model of a session in a format that other programs read.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};

use super::{
    output::{Outcome, one_line, print_result, warn},
    outputs::{ForceArgs, Output},
    played::{FrameArgs, Played},
};
use osp_lab::report::thousands;
use osp_session::{
    export::{ExportOptions, MeshFormat, Objects, PolygonTimes, write_glb, write_mesh},
    platform::fs::has_ending,
    recording::Event,
    scene::Scene,
};

/// Endings of a model's name.
pub(super) const MODEL: &[&str] = &[".glb", ".stl", ".ply", ".obj"];

/// Write the model of a session as binary glTF, for Blender, engines and viewers, or as STL, PLY or OBJ.
///
/// This command writes the polygons of one frame. `osp convert` also converts whole folders, and writes .tilt files,
/// which have the strokes of a whole session.
///
/// The file has a mesh for each layer or stroke, in metres, +y up, with the colours of the strokes at the vertices. It
/// also has the session's camera. Each brush has a material and a texture: unlit brushes and brushes of light use
/// KHR_materials_unlit, others KHR_materials_specular. Lights use KHR_lights_punctual, up to eight, because glTF has no
/// ambient light. The scene's extras describe sky and fog.
///
/// The name of the file decides the format. STL is for printers: millimetres, z up, without colours. PLY and OBJ have
/// metres, y up, and a colour at each vertex. These three have neither textures nor opacity: paint is as wide as its
/// polygons.
///
/// Some brushes look different in other programs. glTF cannot add light, so brushes of light are blended by their
/// brightness, without halos. Moving brushes stand still. Particles and soap films face the session's camera, not the
/// eye. --static writes one mesh with few materials, smaller vertices (KHR_mesh_quantization) and no times, for viewers and
/// the web.
///
/// Each vertex has two attributes of osp. _TIMESTAMP is the time from the session's beginning until the polygon was
/// drawn, seconds; with this attribute Blender can let the drawing grow. _STROKE is the number of the stroke (-1:
/// none). In each frame, the times of a stroke's samples are spread over its new polygons; with --pace samples:1 the
/// times are exact.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp export sketch.tilt sketch.glb
  osp export recordings/portrait.ron portrait.glb --objects strokes
  osp export sketch.tilt web.glb --compress
  osp export sketch.tilt half.glb --frame 200
  osp export sketch.tilt print.stl")]
pub(super) struct ExportArgs {
    #[command(flatten)]
    session: FrameArgs,
    /// The model to write: .glb, .stl, .ply or .obj.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Parts of the session that become objects of the file.
    #[arg(long, value_enum, default_value_t = ObjectsArg::Layers, conflicts_with_all = ["is_static", "compress"])]
    objects: ObjectsArg,
    #[command(flatten)]
    whole: StaticArgs,
    #[command(flatten)]
    force: ForceArgs,
}

/// Options of a static model.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct StaticArgs {
    /// Write one object with few draw calls and smaller vertices, without _TIMESTAMP and _STROKE.
    #[arg(long = "static")]
    is_static: bool,
    /// Compress the buffers of a static model (EXT_meshopt_compression). three.js, Babylon.js and other web viewers read it;
    /// Blender does not.
    #[arg(long)]
    compress: bool,
}

impl StaticArgs {
    /// Returns the objects of a static model, if one of these options is given.
    pub(super) fn objects(self) -> Option<Objects> {
        self.given().map(|_| Objects::Whole { is_compressed: self.compress })
    }

    /// Returns the first of these options that is given.
    pub(super) fn given(self) -> Option<&'static str> {
        let options = [("--static", self.is_static), ("--compress", self.compress)];
        options.into_iter().find_map(|(name, is_given)| is_given.then_some(name))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ObjectsArg {
    /// Each layer of the session.
    Layers,
    /// Each stroke.
    Strokes,
}

pub(super) fn run(args: &ExportArgs) -> anyhow::Result<Outcome> {
    let output = args.force.outputs().reads([&args.session.file]).add(&args.out, MODEL)?;
    if let (Some(option), Some(_)) = (args.whole.given(), mesh_format(&args.out)) {
        bail!("{option} is for .glb only; found {}", args.out.display());
    }
    let objects = args.whole.objects().unwrap_or(match args.objects {
        ObjectsArg::Layers => Objects::Layers,
        ObjectsArg::Strokes => Objects::Strokes,
    });
    write_model(&args.session, objects, &output)?.print(&args.out)
}

/// Report of a written model: one line about its contents, and remarks about missing or changed parts.
pub(super) struct Model {
    pub(super) line: String,
    pub(super) remarks: Vec<String>,
}

impl Model {
    /// Prints the remarks, then the file's name and the line about the contents.
    pub(super) fn print(&self, out: &Path) -> anyhow::Result<Outcome> {
        self.remarks.iter().for_each(|remark| warn(&format!("warning: {remark}")));
        print_result(&format!("{}: {}", one_line(&out.to_string_lossy()), self.line))?;
        Ok(Outcome::Done)
    }
}

/// The format of plain triangles by the ending of a file's name.
fn mesh_format(path: &Path) -> Option<MeshFormat> {
    let formats = [(".stl", MeshFormat::Stl), (".ply", MeshFormat::Ply), (".obj", MeshFormat::Obj)];
    formats.into_iter().find(|(ending, _)| has_ending(path, ending)).map(|(_, format)| format)
}

pub(super) fn write_model(session: &FrameArgs, objects: Objects, output: &Output) -> anyhow::Result<Model> {
    let mut times = PolygonTimes::default();
    let note = |events: &[Event], scene: &Scene| times.note(events, scene);
    let Played { header, scene, .. } = Played::model(session, note)?;
    let options = ExportOptions {
        objects,
        layer_names: header.layers.iter().map(|layer| layer.name.clone()).collect(),
        times: Some(times),
        eye_in_world: header.camera.map(|camera| camera.p),
        camera: header.camera,
        environment: header.environment.map(|environment| *environment),
    };
    let name = session.file.file_stem().unwrap_or_default().to_string_lossy();
    let mut file = output.create()?;
    let named = || output.path().display().to_string();
    let counts = match mesh_format(output.path()) {
        Some(format) => write_mesh(&scene, &options.layer_names, format, options.eye_in_world, &mut file),
        None => write_glb(&scene, &name, &options, &mut file),
    }
    .with_context(named)?;
    file.flush().with_context(named)?;
    let bytes = output.commit(file)?;
    let mut remarks = Vec::new();
    if counts.not_finite > 0 {
        remarks.push(format!("polygons at infinity skipped: {}", thousands(counts.not_finite)));
    }
    if counts.hidden > 0 {
        remarks.push(format!("strokes in hidden layers are not written: {}", thousands(counts.hidden)));
    }
    if counts.polygons == 0 {
        bail!("{}: no polygon to write", session.file.display());
    }
    if counts.turned > 0 && options.eye_in_world.is_none() {
        remarks.push(format!(
            "{} particles face a fixed direction: the session has no camera that they could face",
            thousands(counts.turned)
        ));
    }
    let line = format!(
        "{} objects, {} polygons, {} triangles{}",
        thousands(counts.objects),
        thousands(counts.polygons),
        thousands(counts.triangles),
        bytes.map_or(String::new(), |bytes| format!(", {} bytes", thousands(bytes))),
    );
    Ok(Model { line, remarks })
}
