//! Files of sets that are damaged, forged, or of another model: each is refused, in bounded memory.

use std::fs;

use glam::{UVec3, Vec3};
use osp::polygon::PolygonId;
use osp_lab::pvs::{Pvs, PvsError, ViewCells};
use osp_session::{
    recording::{Author, Event},
    scene::Scene,
};
use osp_testkit::events::polygon;
use xxhash_rust::xxh3::xxh3_64;

/// Where the sets begin in a file.
const HEAD_BYTES: usize = 62;

/// `polygons` triangles, the last of which is as opaque as said.
fn model(polygons: u32, last_alpha: f32) -> Scene {
    let mut scene = Scene::new();
    for i in 0..polygons {
        let corner = Vec3::new(i as f32, 0.0, 0.0);
        let vertices = vec![corner, corner + Vec3::Y, corner + Vec3::Z];
        let alpha = if i + 1 == polygons { last_alpha } else { 1.0 };
        let event = polygon(None, vertices, (0.5, 0.5, 0.5, alpha));
        scene.apply(&event, &mut Vec::new());
    }
    scene
}

fn cells() -> ViewCells {
    ViewCells { min: Vec3::ZERO, side_m: 1.0, count: UVec3::new(3, 2, 1) }
}

/// Sets of different groups in each cell.
fn sets(scene: &Scene) -> Pvs {
    let mut pvs = Pvs::new(scene, cells(), 9).expect("a few bytes");
    for cell in 0..pvs.cells.len() {
        pvs.set_cell(cell, &[0x9E37_79B9_7F4A_7C15u64.wrapping_mul(cell as u64 + 1) & 0x1FFF]);
    }
    pvs
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn read(&self, bytes: &[u8], scene: &Scene) -> Result<Pvs, PvsError> {
        let path = self.0.path().join("sets.pvs");
        fs::write(&path, bytes).expect("written");
        Pvs::read(&path, scene)
    }
}

fn bytes_of(pvs: &Pvs) -> Vec<u8> {
    let mut bytes = Vec::new();
    pvs.write_to(&mut bytes).expect("memory");
    bytes
}

/// The same file with other bytes from `at` on, and a checksum that fits.
fn forged(bytes: &[u8], at: usize, with: &[u8]) -> Vec<u8> {
    let mut forged = bytes[..bytes.len() - 8].to_vec();
    forged[at..at + with.len()].copy_from_slice(with);
    let sum = xxh3_64(&forged);
    forged.extend(sum.to_le_bytes());
    forged
}

#[test]
fn sets_come_back_as_they_were() {
    let (scene, folder) = (model(200, 1.0), Folder::new());
    let pvs = sets(&scene);
    assert_eq!(folder.read(&bytes_of(&pvs), &scene).expect("whole"), pvs);
    let empty = Pvs::new(&Scene::new(), cells(), 9).expect("no bytes");
    assert_eq!(folder.read(&bytes_of(&empty), &Scene::new()).expect("whole"), empty);
}

#[test]
fn a_file_is_refused_whichever_bit_is_turned() {
    let (scene, folder) = (model(200, 1.0), Folder::new());
    let bytes = bytes_of(&sets(&scene));
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let error = folder.read(&damaged, &scene).expect_err("damaged").to_string();
        assert!(error.contains("sets.pvs, byte ") && error.contains("expected "), "{bit}: {error}");
    }
}

#[test]
fn forged_numbers_take_no_memory() {
    let (scene, folder) = (model(200, 1.0), Folder::new());
    let bytes = bytes_of(&sets(&scene));
    assert!(folder.read(&forged(&bytes, 0, b""), &scene).is_ok(), "the forger forges well");
    let u32s = |numbers: &[u32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    let refused = |at: usize, with: &[u8], named_at: usize, expected: &str| {
        let error = folder.read(&forged(&bytes, at, with), &scene).expect_err(expected).to_string();
        let place = format!("sets.pvs, byte {named_at}: ");
        assert!(error.contains(&place) && error.contains(expected), "{error}");
    };
    // Polygons, and with them the words of each cell; then cells.
    for polygons in [0u64, 199, 201, 1 << 32, u64::MAX] {
        refused(10, &polygons.to_le_bytes(), 10, "expected 200 polygons with the fingerprint");
    }
    refused(26, &u32s(&[32]), 26, "expected 16 polygons that share a bit; found 32");
    for count in [[0, 2, 1], [u32::MAX; 3], [1 << 16, 1 << 16, 1], [1 << 20, 2, 1]] {
        refused(30, &u32s(&count), 30, "expected 1 to 1048576 cells");
    }
    // A million cells are allowed, but the file does not hold their sets.
    refused(30, &u32s(&[1 << 20, 1, 1]), HEAD_BYTES, "bytes of sets, packed");
    refused(30, &u32s(&[1, 1, 1]), HEAD_BYTES, "expected 8 bytes of sets, packed; found more");
    for float in [f32::NAN, f32::INFINITY] {
        refused(46, &float.to_le_bytes(), 46, "expected a finite corner");
    }
    for side_m in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        refused(58, &side_m.to_le_bytes(), 46, "a side above 0");
    }
    let packed = bytes.len() - 8 - HEAD_BYTES;
    refused(HEAD_BYTES, &vec![0xFF; packed], HEAD_BYTES, "bytes of sets, packed");
}

#[test]
fn sets_too_large_for_memory_are_refused_before_it_is_taken() {
    // 140,000 / 16 groups x 1,048,576 cells take 1.15 GB.
    let scene = model(140_000, 1.0);
    let many = ViewCells { count: UVec3::new(1 << 10, 1 << 10, 1), ..cells() };
    let error = Pvs::new(&scene, many, 1).expect_err("too many").to_string();
    assert!(error.contains("expected at most 1073741824"), "{error}");
    // A file that claims as much.
    let bytes = bytes_of(&Pvs::new(&scene, cells(), 1).expect("a few bytes"));
    let count: Vec<u8> = [1u32 << 10, 1 << 10, 1].iter().flat_map(|n| n.to_le_bytes()).collect();
    let error = Folder::new().read(&forged(&bytes, 30, &count), &scene).expect_err("too many").to_string();
    assert!(error.contains("byte 62: expected sets of at most 1073741824 bytes"), "{error}");
}

#[test]
fn sets_of_another_model_or_of_another_state_of_it_are_refused() {
    let (scene, folder) = (model(200, 1.0), Folder::new());
    let bytes = bytes_of(&sets(&scene));
    let mut moved = model(199, 1.0);
    let vertices =
        vec![Vec3::new(199.0, 0.0, 1.0e-6), Vec3::new(199.0, 1.0, 0.0), Vec3::new(199.0, 0.0, 1.0)];
    let event = Event::Polygon {
        author: Author::SOLE,
        t: 0.0,
        stroke: None,
        vertices,
        shading: None,
        color: (0.5, 0.5, 0.5, 1.0),
    };
    moved.apply(&event, &mut Vec::new());
    let mut undone = model(200, 1.0);
    undone.apply(&Event::Undo { author: Author::SOLE, t: 0.0 }, &mut Vec::new());
    // What is behind glass can be seen: the sets of the opaque model would hide it.
    let glass = model(200, 0.5);
    for (other, what) in [(model(199, 1.0), "fewer"), (moved, "moved"), (undone, "undone"), (glass, "glass")]
    {
        let error = folder.read(&bytes, &other).expect_err(what).to_string();
        assert!(error.contains("byte 10: made of another model: expected"), "{what}: {error}");
        assert!(error.contains("osp bake makes it again"), "{what}: {error}");
    }
    assert!(folder.read(&bytes, &model(200, 1.0)).is_ok(), "the same model, made again");
}

#[test]
fn a_set_culls_what_it_does_not_hold() {
    let scene = model(200, 1.0);
    let pvs = sets(&scene);
    let ids: Vec<PolygonId> = scene.visible_ids().collect();
    let mut drawn = Vec::new();
    assert!(pvs.cull(Vec3::splat(0.5), ids.iter().copied(), &mut drawn));
    assert!(drawn.len() > 16 && drawn.len() < 200, "{}", drawn.len());
}
