//! Small files of every format, written here.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use glam::Vec3;
use osp_session::recording::{Event, Notes, OpenOptions, RecordingError, open};
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

/// How many events of each kind, and the bounds of the points.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    pub(crate) begins: u64,
    pub(crate) points: u64,
    pub(crate) ends: u64,
    pub(crate) heads: u64,
    pub(crate) erases: u64,
    pub(crate) polygons: u64,
    pub(crate) lowest: Vec3,
    pub(crate) highest: Vec3,
}

impl Counts {
    pub(crate) fn add(&mut self, event: &Event) {
        match event {
            Event::Begin { .. } => self.begins += 1,
            Event::Point { p, .. } => {
                (self.lowest, self.highest) =
                    if self.points == 0 { (*p, *p) } else { (self.lowest.min(*p), self.highest.max(*p)) };
                self.points += 1;
            }
            Event::End { .. } => self.ends += 1,
            Event::Head { .. } => self.heads += 1,
            Event::Erase { .. } => self.erases += 1,
            Event::Polygon { .. } => self.polygons += 1,
            other => panic!("no importer makes {other:?}"),
        }
    }
}

pub(crate) fn count(events: &[Event]) -> Counts {
    let mut counts = Counts::default();
    events.iter().for_each(|event| counts.add(event));
    counts
}

/// What a reader gave: its events, the error that ended them, what it noticed.
#[derive(Debug, Default)]
pub(crate) struct Read {
    pub(crate) events: Vec<Event>,
    pub(crate) error: Option<RecordingError>,
    pub(crate) notes: Notes,
}

/// Most events that any file written here can give, however it is damaged.
const MOST_EVENTS: usize = 100_000;

/// Reads a file to the end or the first error, and checks the contract of a source: sound events, no event after an
/// error or the end.
pub(crate) fn read(path: &Path, lenient: bool) -> Read {
    let mut read = Read::default();
    let mut session = match open(path, &OpenOptions { lenient, ..OpenOptions::default() }) {
        Ok(session) => session,
        Err(error) => return Read { error: Some(error), ..read },
    };
    loop {
        match session.events.next_event() {
            Ok(Some(event)) => {
                assert_eq!(event.check(), Ok(()), "{event:?}");
                read.events.push(event);
                assert!(read.events.len() < MOST_EVENTS, "events without end");
            }
            Ok(None) => break,
            Err(error) => {
                read.error = Some(error);
                break;
            }
        }
    }
    assert!(matches!(session.events.next_event(), Ok(None)), "an event after the end");
    read.notes = session.events.notes();
    read
}

/// Reads a file that is sound.
pub(crate) fn read_sound(path: &Path) -> Vec<Event> {
    let read = read(path, false);
    assert!(read.error.is_none(), "{:?}", read.error);
    assert_eq!(read.notes, Notes::default());
    read.events
}

/// Writes a file into a folder, with the folders above it.
pub(crate) fn write(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Little-endian bytes of mixed values.
#[derive(Clone, Default)]
pub(crate) struct Bytes(pub(crate) Vec<u8>);

impl Bytes {
    pub(crate) fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }
    pub(crate) fn u16(mut self, value: u16) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }
    pub(crate) fn u32s(mut self, values: &[u32]) -> Self {
        values.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
        self
    }
    pub(crate) fn f32s(mut self, values: &[f32]) -> Self {
        values.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
        self
    }
    pub(crate) fn text(mut self, text: &str) -> Self {
        self.0.extend(text.as_bytes());
        self
    }
    pub(crate) fn append(mut self, other: &Self) -> Self {
        self.0.extend(&other.0);
        self
    }
}

/// A control point as both binary formats store it: position, quaternion, pressure, milliseconds.
pub(crate) type RawPoint = ([f32; 3], [f32; 4], f32, u32);

/// Points on a slanted line, turned by a third of a turn, 10 ms apart.
pub(crate) fn raw_points(count: u32, from: [f32; 3], first_ms: u32) -> Vec<RawPoint> {
    let point = |i: u32| {
        let s = i as f32 * 0.25;
        let at = [from[0] + s, from[1] + 0.5 * s, from[2] - s];
        (at, [0.5, 0.5, 0.5, 0.5], 0.5 + 0.01 * i as f32, first_ms + 10 * i)
    };
    (0..count).map(point).collect()
}

fn push_points(mut bytes: Bytes, points: &[RawPoint]) -> Bytes {
    for (position, orientation, pressure, milliseconds) in points {
        bytes = bytes.f32s(position).f32s(orientation).f32s(&[*pressure]).u32s(&[*milliseconds]);
    }
    bytes
}

/// A stroke of `data.sketch` as the programs write it: stroke mask 0x1b (flags, scale, seed, layer), point mask 3.
pub(crate) fn sketch_stroke(color: [f32; 4], size: f32, scale: f32, points: &[RawPoint]) -> Bytes {
    layer_stroke(0, color, size, scale, points)
}

pub(crate) fn layer_stroke(layer: u32, color: [f32; 4], size: f32, scale: f32, points: &[RawPoint]) -> Bytes {
    let head = Bytes::default().u32s(&[0]).f32s(&color).f32s(&[size]).u32s(&[0x1b, 3]);
    let head = head.u32s(&[2]).f32s(&[scale]).u32s(&[77, layer]);
    push_points(head.u32s(&[points.len() as u32]), points)
}

pub(crate) fn sketch(version: u32, strokes: &[Bytes]) -> Bytes {
    let head = Bytes::default().u32s(&[0xC576_A5CD, version, 0, 0, strokes.len() as u32]);
    strokes.iter().fold(head, |all, stroke| all.append(stroke))
}

/// A sketch of three strokes with 4, 1 and 6 points.
pub(crate) fn small_sketch() -> Bytes {
    let strokes = [(4, [1.0, 2.0, 3.0]), (1, [0.0, 10.0, 0.0]), (6, [-5.0, 12.0, 8.0])];
    let strokes: Vec<Bytes> = strokes
        .into_iter()
        .zip(1..)
        .map(|((count, from), i)| {
            sketch_stroke([0.1, 0.2, 0.3, 1.0], 0.5, 2.0, &raw_points(count, from, 1000 * i))
        })
        .collect();
    sketch(5, &strokes)
}

pub(crate) const METADATA: &str = r#"{"EnvironmentPreset":"ab080599-e465-4a6d-8587-43bf495af68b","Authors":["Ann","Bob"],
 "SceneTransformInRoomSpace":[[1.0,2.0,3.0],[0.0,0.70710678,0.0,0.70710678],0.5],
 "ThumbnailCameraTransformInRoomSpace":[[6.0,2.0,3.0],[0.0,0.70710678,0.0,0.70710678],1.0],"SchemaVersion":2,
 "BrushIndex":["2d35bcf0-e4d8-452c-97b1-3311be063130"],
 "Environment":{"GradientColors":[[0,51,102,255],[255,204,153,255]],"GradientSkew":[0.5,0.5,0.5,0.5],
  "FogColor":[51,0,0,255],"FogDensity":0.004,"ReflectionIntensity":0.7},
 "Lights":{"Ambient":[51,102,153,255],"Shadow":{"Orientation":[0.0,0.70710678,0.0,0.70710678],"Color":[2.0,1.0,0.5,1.0]},
  "NoShadow":{"Orientation":[0.70710678,0.0,0.0,0.70710678],"Color":[0.25,0.5,0.75,1.0]}},
 "Layers":[{"Name":"Main Canvas","Visible":true},{"Name":"Notes","Visible":false}],
 "ModelIndex":[{"FilePath":"Models\\a.glb","RawTransforms":[[[0,0,0],[0,0,0,1],1]]},{"AssetId":"b"}],
 "ImageIndex":[{"FileName":"c.png","AspectRatio":1.5}],"Videos":[],"LightIndex":[{"Intensity":1}]}"#;

/// A `.tilt` file: its head and a zip of these entries.
pub(crate) fn tilt(entries: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default().compression_method(method)).unwrap();
        zip.write_all(bytes).unwrap();
    }
    let zip = zip.finish().unwrap().into_inner();
    let mut file = Bytes::default().text("tilT").u16(16).u16(1).u32s(&[0, 0]).0;
    file.extend(zip);
    file
}

pub(crate) fn small_tilt(method: CompressionMethod) -> Vec<u8> {
    let sketch = small_sketch().0;
    tilt(
        &[("thumbnail.png", b"PNG"), ("data.sketch", &sketch), ("metadata.json", METADATA.as_bytes())],
        method,
    )
}

/// An A-Painter drawing of strokes: colour, size, points.
pub(crate) fn apa(strokes: &[([f32; 3], f32, Vec<RawPoint>)]) -> Vec<u8> {
    let mut bytes =
        Bytes::default().u8(8).text("apainter").u16(1).u8(2).u8(4).text("flat").u8(6).text("smooth");
    bytes = bytes.u32s(&[strokes.len() as u32]);
    for (color, size, points) in strokes {
        bytes = bytes.u8(1).f32s(color).f32s(&[*size]).u32s(&[points.len() as u32]);
        bytes = push_points(bytes, points);
    }
    bytes.0
}

pub(crate) fn small_apa() -> Vec<u8> {
    apa(&[
        ([0.1, 0.2, 0.3], 0.02, raw_points(5, [0.0, 1.0, 0.0], 500)),
        ([0.9, 0.8, 0.7], 0.05, raw_points(3, [1.0, 1.5, -1.0], 900)),
    ])
}

/// Two files of one CASSIE sketch: `sketch_history` and `raw_data`.
pub(crate) fn small_cassie() -> (String, String) {
    let history = r#"[
 {"id": 0, "input_samples": [[0.0,1.0,0.5],[0.03,1.0,0.5],[0.06,1.0,0.5]], "curve_type": "line",
  "ctrl_pts": [[[0,0,0],[1,1,1]]], "creation_time": 100.5, "deletion_time": 103.0},
 {"id": 1, "input_samples": [[0.25,1.0,0.5],[0.22,1.0,0.5],[0.19,1.0,0.5]], "curve_type": "line",
  "ctrl_pts": [], "creation_time": 100.5, "deletion_time": null},
 {"id": 3, "input_samples": [[0,1,0],[0,1.1,0],[0,1.2,0],[0,1.3,0],[0,1.4,0]], "curve_type": "line",
  "ctrl_pts": [], "creation_time": 100.7, "deletion_time": null}]"#;
    let vec = |x: f32, y: f32, z: f32| format!(r#"{{"x":{x},"y":{y},"z":{z}}}"#);
    let rot = |x: f32, y: f32, z: f32, w: f32| format!(r#"{{"x":{x},"y":{y},"z":{z},"w":{w}}}"#);
    let mut states = Vec::new();
    for (kind, time, element, head, canvas_scale) in [
        (0, 98.0, -1, vec(0.0, 0.0, 0.0), 1.0),
        (0, 99.0, -1, vec(0.0, 1.2, 0.1), 1.0),
        (1, 100.5, 0, vec(3.0, 2.6, 0.2), 2.0),
        (1, 100.7, 3, vec(3.0, 2.6, 0.2), 2.0),
        (2, 103.0, 0, vec(3.0, 2.6, 0.2), 2.0),
    ] {
        let canvas = if canvas_scale == 1.0 { vec(0.0, 0.0, 0.0) } else { vec(3.0, 0.6, -0.8) };
        let turn = if canvas_scale == 1.0 { rot(0.0, 0.0, 0.0, -1.0) } else { rot(0.0, 1.0, 0.0, 0.0) };
        let mut state =
            format!(r#"{{"interactionType":{kind},"time":{time},"elementID":{element},"mirroring":true,"#);
        write!(state, r#""headPos":{head},"headRot":{},"primaryHandPos":{head},"#, rot(0.0, 0.0, 0.0, 1.0))
            .unwrap();
        write!(state, r#""canvasPos":{canvas},"canvasRot":{turn},"canvasScale":{canvas_scale}}}"#).unwrap();
        states.push(state);
    }
    let stroke = |id: i32, samples: &[[f32; 3]]| {
        let samples: Vec<String> = samples.iter().map(|p| vec(p[0], p[1], p[2])).collect();
        format!(r#"{{"id":{id},"ctrlPts":[],"inputSamples":[{}],"planar":false}}"#, samples.join(","))
    };
    let strokes = [
        stroke(0, &[[0.0, 1.0, 0.5], [0.03, 1.0, 0.5], [0.06, 1.0, 0.5]]),
        stroke(3, &[[0.0, 1.0, 0.0], [0.0, 1.1, 0.0], [0.0, 1.2, 0.0], [0.0, 1.3, 0.0], [0.0, 1.4, 0.0]]),
    ];
    let raw = format!(
        "{{\"sketchSystem\":2,\n\"systemStates\":[{}],\n\"allSketchedStrokes\":[{}],\n\"allCreatedPatches\":[]}}",
        states.join(",\n"),
        strokes.join(",\n")
    );
    (history.to_owned(), raw)
}

/// Writes both files of the CASSIE sketch; gives their paths.
pub(crate) fn write_cassie(folder: &Path) -> (PathBuf, PathBuf) {
    let (history, raw) = small_cassie();
    let history = write(folder, "sketch_history/a.json", history.as_bytes());
    (history, write(folder, "raw_data/a.json", raw.as_bytes()))
}

pub(crate) const POSES: &str = "# time_s x y z qw qx qy qz\n\
    10.00 0.1 0.2 0.3 1 0 0 0\n\
    10.01 0.1 0.2 0.4 1 0 0 0\n\
    \n\
    10.02 0.1 0.2 0.5 0.5 0.5 -0.5 0.5\n\
    10.50 0.1 0.2 0.5 1 0 0 0\n\
    10.51 0.1 0.2 0.5 1 0 0 0\n\
    10.52 0.9 0.2 0.5 1 0 0 0\n";

pub(crate) const OBJ: &str = "# a cube's corner\ns off\no thing\n\
    v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 1.0\nvt 0 0\nvn 0 0 1\n\
    f 1 2 3\nf 1/1 2/1 3/1 4/1\nusemtl wall\nf 1//1 2//1 3//1\nf -4/1/1 -3/1/1 \\\n-2/1/1\n";

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A binary glTF file of some JSON and a binary chunk.
pub(crate) fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let padded = |mut bytes: Vec<u8>, with: u8| {
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, binary) = (padded(json.into(), b' '), padded(binary.into(), 0));
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut file = Bytes::default().text("glTF").u32s(&[2, length as u32, json.len() as u32]).text("JSON");
    file.0.extend(json);
    let mut file = file.u32s(&[binary.len() as u32]).text("BIN\0");
    file.0.extend(binary);
    file.0
}

/// JSON and buffer of a model: an arm (turned, scaled by 2) with a hand (a mirror) on it, a square as a fan, a strip with
/// colours, lines; a camera, two suns and a lamp.
pub(crate) fn small_gltf() -> (String, Vec<u8>) {
    let positions: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let bent: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.5];
    let buffer = Bytes::default()
        .f32s(&positions)
        .f32s(&bent)
        .u16(0)
        .u16(1)
        .u16(2)
        .u16(0)
        .u16(2)
        .u16(3)
        .append(&Bytes(vec![255, 0, 0, 128, 255, 0, 0, 128, 255, 0, 0, 128, 255, 0, 0, 128]))
        // What nobody reads.
        .u32s(&[0, 0]);
    let json = r#"{"asset":{"version":"2.0","generator":"a test"},"scene":0,"scenes":[{"nodes":[0,3,4,5,6]}],
"extensionsUsed":["KHR_lights_punctual"],
"extensions":{"KHR_lights_punctual":{"lights":[
 {"type":"directional","color":[1,1,1],"intensity":2.0},{"type":"directional","color":[1,0,0],"intensity":8.0},
 {"type":"point"}]}},
"nodes":[
 {"name":"arm","mesh":0,"children":[1],"translation":[1,2,3],"rotation":[0,0.70710678,0,0.70710678],"scale":[2,2,2]},
 {"name":"hand","mesh":1,"children":[2],"translation":[0,1,0],"scale":[-1,1,1]},
 {"mesh":0,"translation":[5,0,0]},
 {"name":"eye","camera":0,"translation":[0,1.5,4]},
 {"name":"sun","rotation":[-0.70710678,0,0,0.70710678],"extensions":{"KHR_lights_punctual":{"light":0}}},
 {"name":"red sun","extensions":{"KHR_lights_punctual":{"light":1}}},
 {"name":"lamp","extensions":{"KHR_lights_punctual":{"light":2}}}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.7853981634,"znear":0.01}}],
"materials":[{"doubleSided":true,"pbrMetallicRoughness":{"baseColorFactor":[0.21404114,0.21404114,1,1]}},
 {"alphaMode":"BLEND","doubleSided":true}],
"meshes":[
 {"name":"square","primitives":[{"attributes":{"POSITION":0},"indices":2,"material":0},
  {"attributes":{"POSITION":0},"mode":1}]},
 {"name":"strip","primitives":[{"attributes":{"POSITION":1,"COLOR_0":3},"mode":5,"material":1}]}],
"accessors":[
 {"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
 {"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0.5]},
 {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},
 {"bufferView":2,"componentType":5121,"count":4,"type":"VEC4","normalized":true}],
"bufferViews":[
 {"buffer":0,"byteOffset":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":12},
 {"buffer":0,"byteOffset":108,"byteLength":16}],
"buffers":[{"byteLength":124}]}"#;
    (json.to_owned(), buffer.0)
}

pub(crate) fn small_glb() -> Vec<u8> {
    let (json, buffer) = small_gltf();
    glb(&json, &buffer)
}
