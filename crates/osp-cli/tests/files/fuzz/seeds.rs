//! Small sound inputs of every target, made here.

use std::fs;

use super::{
    super::importers::files::{
        METADATA, OBJ, POSES, gzip, small_apa, small_cassie, small_glb, small_gltf, small_sketch, small_tilt,
    },
    fuzzing::read_bytes::{FORMATS, Packing},
};
use osp::glam::{Quat, UVec3, Vec3};
use osp_lab::pvs::{GROUP, Pvs, ViewCells};
use osp_session::recording::{Environment, Flush, Header, Layer, RonWriter};
use zip::CompressionMethod;

/// The beginnings of the shipped recordings, a synthetic session, and small files of every foreign format.
pub fn recordings() -> Vec<Vec<u8>> {
    let (history, raw) = small_cassie();
    let mut ron = vec![events()];
    for name in ["grow", "portrait", "room", "scribble"] {
        let text = fs::read(osp_testkit::at("recordings").join(name).with_extension("ron"))
            .expect("a shipped recording");
        ron.push(text.split_inclusive(|&b| b == b'\n').take(60).flatten().copied().collect());
    }
    let zst = |text: &[u8]| zstd::encode_all(text, 3).expect("zstd packs");
    let mut seeds = Vec::new();
    let mut add = |name: &str, packing: Packing, bytes: Vec<u8>| {
        let format = FORMATS.iter().position(|&f| f == (name, packing)).expect("a known format");
        seeds.push([&[format as u8], bytes.as_slice()].concat());
    };
    for text in ron {
        add("a.ron.zst", Packing::Whole, zst(&text));
        add("b.ron.zst", Packing::Zstd, text.clone());
        add("a", Packing::Whole, text.clone());
        add("a.ron", Packing::Whole, text);
    }
    add("a.tilt", Packing::Whole, small_tilt(CompressionMethod::Stored));
    add("a.tilt", Packing::Whole, small_tilt(CompressionMethod::Deflated));
    add("b.tilt", Packing::Sketch, small_sketch().0);
    add("c.tilt", Packing::Folder, small_sketch().0);
    add("d.tilt", Packing::Metadata, METADATA.into());
    add("a.apa", Packing::Whole, small_apa());
    for json in [history, raw] {
        add("a", Packing::Whole, json.clone().into_bytes());
        add("a.json", Packing::Whole, json.into_bytes());
    }
    add("a.poses", Packing::Whole, POSES.into());
    add("a.poses.gz", Packing::Gzip, POSES.into());
    add("a.obj", Packing::Whole, OBJ.into());
    add("a.obj.gz", Packing::Gzip, OBJ.into());
    add("b.obj.gz", Packing::Whole, gzip(OBJ.as_bytes()));
    add("a.glb", Packing::Whole, small_glb());
    let inside =
        "{\"byteLength\":124,\"uri\":\"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAA\"}";
    add("a.gltf", Packing::Whole, small_gltf().0.replace("{\"byteLength\":124}", inside).into_bytes());
    seeds
}

/// Every kind of event, by the generator of the other targets.
fn events() -> Vec<u8> {
    let noise: Vec<u8> = (0..6000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let mut u = super::fuzzing::input::Input::new(&noise);
    let mut bytes = Vec::new();
    let environment = Environment {
        preset: "Standard".into(),
        sky: [Vec3::splat(0.25), Vec3::new(0.0, 0.25, 1.0)],
        sky_rotation: Quat::from_xyzw(0.5, 0.5, 0.5, 0.5),
        room_rotation: Quat::from_xyzw(0.0, 0.6, 0.0, 0.8),
        floor: Some(Vec3::splat(0.05)),
        fog: (Vec3::X, 0.025),
        ambient: Vec3::splat(0.4),
        lights: [(Vec3::NEG_Y, Vec3::ONE), (Vec3::X, Vec3::splat(2.5))],
        reflection: 0.3,
        ..Environment::default()
    };
    let header = Header {
        environment: Some(Box::new(environment)),
        layers: vec![Layer { name: "a".into(), hidden: false }, Layer { name: "b".into(), hidden: true }],
        left_out: vec!["2 models (a.glb, b)".into()],
        ..Header::new("seed", "fuzz")
    };
    let mut writer = RonWriter::new(&mut bytes, "seed.ron", &header, Flush::AtEnd).expect("a header");
    for _ in 0..80 {
        writer.write(&super::fuzzing::input::event(&mut u)).expect("a sound event");
    }
    writer.flush().expect("memory");
    drop(writer);
    bytes
}

/// Sets of a small model: as a file, and what is packed in it.
pub fn sets() -> Vec<Vec<u8>> {
    let scene = super::fuzzing::pvs::model();
    let cells = ViewCells { min: Vec3::splat(-1.0), side_m: 0.5, count: UVec3::new(3, 2, 4) };
    let mut sets = Pvs::new(&scene, cells, 3).expect("a small model");
    let words = sets.bytes() / 8 / cells.len();
    let groups = sets.polygons.div_ceil(GROUP);
    assert!(words == 1 && groups < 64, "a small model: {groups} groups");
    for cell in 0..cells.len() {
        sets.set_cell(cell, &[0x5A5A_0F0F_3333_8001u64.rotate_left(cell as u32) & ((1 << groups) - 1)]);
    }
    let mut file = Vec::new();
    sets.write_to(&mut file).expect("memory");
    let content = zstd::decode_all(&file[62..file.len() - 8]).expect("what was packed");
    vec![[&[0], file.as_slice()].concat(), [&[1], &file[26..62], content.as_slice()].concat()]
}

pub fn arguments() -> Vec<Vec<u8>> {
    let noise: Vec<u8> = (0..700u32).map(|i| (i.wrapping_mul(2_246_822_519) >> 11) as u8).collect();
    let words = [
        "recorded,samples:1,osp",
        "samples:4294967295,grow",
        "udp://127.0.0.1:9327,-",
        "dual-wall,hzb,auto,pvs",
    ];
    words.iter().map(|words| [format!("{words:24}").as_bytes(), &noise].concat()).collect()
}

#[cfg(feature = "window")]
pub fn tracker() -> Vec<Vec<u8>> {
    use osp_app::tracker::{osc_packet, parse_line};
    let lines = "head 0 1.6 0 0 0 0 1\nhand 0.1 1.2 -0.3 0.5 0.5 0.5 0.5 0.75\nhand 1 2 3 0 0 0 1 0 7\n\
        brush tube 0.05 1 0.5 0.25 1 3 side-x\nerase 0.1 0.2 0.3\nundo\nredo\n# a comment\n";
    let packets: Vec<Vec<u8>> = lines
        .lines()
        .filter_map(|line| parse_line(line).expect("a sound line"))
        .map(|message| osc_packet(&message))
        .collect();
    let mut bundle = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
    for packet in &packets {
        bundle.extend((packet.len() as u32).to_be_bytes());
        bundle.extend(packet);
    }
    let mut outer = b"#bundle\0\0\0\0\0\0\0\0\x01".to_vec();
    outer.extend((bundle.len() as u32).to_be_bytes());
    outer.extend(&bundle);
    [vec![lines.into(), bundle, outer], packets].concat()
}
