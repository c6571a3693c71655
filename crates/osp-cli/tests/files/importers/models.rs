//! Models of other programs: what each becomes, or how it is refused. Files in `tests/files/models`.

use std::path::{Path, PathBuf};

use osp_session::{
    recording::{Event, OpenOptions, Up, open},
    scene::Scene,
};

use super::files::{gzip, read, write};

fn path(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/files/models")).join(name)
}

fn scene_of(path: &Path, options: &OpenOptions) -> Scene {
    let events: Vec<Event> = open(path, options).unwrap().map(Result::unwrap).collect();
    let mut scene = Scene::new();
    scene.apply_all(&events, &mut Vec::new());
    assert_eq!(scene.counts().ignored_events, 0);
    scene
}

/// Colours of all polygons in bytes, without repetitions.
fn colors(scene: &Scene) -> Vec<[u8; 4]> {
    let byte = |c: f32| (c * 255.0).round() as u8;
    let mut all: Vec<[u8; 4]> =
        scene.visible_ids().map(|id| scene.color(id)).map(|(r, g, b, a)| [r, g, b, a].map(byte)).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn size(scene: &Scene) -> glam::Vec3 {
    let bounds = scene.visible_ids().map(|id| scene.bounds(id)).reduce(|a, b| a.union(&b)).unwrap();
    bounds.max - bounds.min
}

#[test]
fn models_have_their_polygons_and_sizes() {
    let options = OpenOptions::STRICT;
    for (name, polygons, expected) in [
        ("bom_shift.obj", 3, [1.0, 1.0, 1.0]),
        ("groups.obj", 2, [6.0, 1.0, 0.0]),
        ("instancing.glb", 25 * 72, [7.0, 7.0, 0.1989]),
        ("scene_no_nodes.gltf", 72, [1.0, 1.0, 0.1989]),
        ("vrm.gltf", 72, [1.0, 1.0, 0.1989]),
        ("lights_ibl.gltf", 72, [1.0, 1.0, 0.1989]),
        ("animation_pointer.gltf", 72, [1.0, 1.0, 0.1989]),
        #[cfg(feature = "render")]
        ("meshopt.glb", 72, [1.0, 1.0, 0.1989]),
        #[cfg(feature = "render")]
        ("draco.glb", 72, [1.0, 1.0, 0.1989]),
    ] {
        let scene = scene_of(&path(name), &options);
        assert_eq!(scene.visible_ids().count(), polygons, "{name}");
        let found = size(&scene);
        assert!(found.abs_diff_eq(expected.into(), 1.0e-4), "{name}: {found}");
    }
    // A square in the coordinates of a map, where `f32` rounds to half a metre.
    let folder = tempfile::tempdir().unwrap();
    let utm =
        "v 448262.123 5411932.678 250\nv 448262.125 5411932.678 250\nv 448262.123 5411932.680 250\nf 1 2 3\n";
    let found = size(&scene_of(&write(folder.path(), "utm.obj", utm.as_bytes()), &options));
    assert!(found.abs_diff_eq(glam::Vec3::new(0.002, 0.002, 0.0), 1.0e-6), "{found}");
    let mut scene = scene_of(&path("groups.obj"), &options);
    let names: Vec<_> = scene.group_tree().into_iter().map(|group| group.name).collect();
    assert_eq!(names, [Some("chair".to_owned()), Some("table".to_owned())]);
}

#[test]
fn models_have_their_colours() {
    let of = |name: &str| colors(&scene_of(&path(name), &OpenOptions::STRICT));
    let expected = [[13, 26, 230, 255], [26, 204, 26, 77], [230, 13, 13, 255]];
    let found = of("mtl_colours.obj");
    let is_near = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= 1;
    assert!(found.as_flattened().iter().zip(expected.as_flattened()).all(is_near), "{found:?}");
    assert_eq!(of("vertex_colours.obj"), [[0, 0, 255, 255], [255, 0, 0, 255]]);
    let chess = of("textured.glb");
    assert_eq!(chess.len(), 2, "{chess:?}");
    // The whole square is 1 x 1, the masked disc about half of it.
    let scene = scene_of(&path("alpha_mask.glb"), &OpenOptions::STRICT);
    let area: f32 = scene.visible_ids().map(|id| scene.polygon(id).area_m2()).sum();
    assert!((0.3..0.7).contains(&area), "{area}");
    let corners = of("corner_colours.gltf");
    for pure in [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]] {
        let is_near = |found: &&[u8; 4]| found.iter().zip(pure).all(|(a, b): (&u8, u8)| a.abs_diff(b) < 70);
        assert!(corners.iter().any(|found| is_near(&found)), "{pure:?} in {corners:?}");
    }
}

/// Materials in a folder of their own name a picture in another one.
#[test]
fn materials_find_their_pictures() {
    const RED: &[u8] = b"RIFF\x18\x00\x00\x00WEBPVP8L\x0c\x00\x00\x00/\x00\x00\x00\x00(J\xcdK\xd1\xff\x00";
    let folder = tempfile::tempdir().unwrap();
    for name in ["materials", "pictures"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    write(folder.path(), "pictures/a.webp", RED);
    for line in ["map_Kd ../pictures/a.webp", "map_Kd pictures\\a.webp"] {
        write(folder.path(), "materials/a.mtl", format!("newmtl a\n{line}\n").as_bytes());
        let text = "mtllib materials/a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let path = write(folder.path(), "a.obj", text.as_bytes());
        assert_eq!(colors(&scene_of(&path, &OpenOptions::STRICT)), [[230, 40, 20, 255]], "{line}");
        assert_eq!(osp_session::recording::import::files_beside(&path).len(), 2);
    }
    write(folder.path(), "pictures/a.webp", &RED[..30]);
    let said = read(&folder.path().join("a.obj"), false).notes.warnings.join("\n");
    assert!(said.contains("a damaged WebP"), "{said}");
}

/// Triangles of a centimetre, in the coordinates of a map.
#[test]
fn far_nodes_keep_their_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    let nodes = [r#""children":[1,2],"translation":[448262.123,250,-5411932.678]"#, r#""mesh":0"#];
    let far = r#""matrix":[1,0,0,0,0,1,0,0,0,0,1,0,-448262.121,-250,5411932.678,1],"children":[3]"#;
    let back = r#""mesh":0,"translation":[448262.123,250,-5411932.678]"#;
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{{}}},{{{}}},{{{far}}},{{{back}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":3,"type":"VEC3","bufferView":0,"min":[0,0,0],"max":[0.01,0.01,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36}}]}}"#,
        nodes[0], nodes[1]
    );
    let corners = [0.0f32, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01, 0.0].map(f32::to_le_bytes).concat();
    let path = write(folder.path(), "a.glb", &super::files::glb(&json, &corners));
    let scene = scene_of(&path, &OpenOptions::STRICT);
    let bounds: Vec<_> = scene.visible_ids().map(|id| scene.bounds(id)).collect();
    assert_eq!(bounds.len(), 2);
    // The last one comes back to the first, two millimetres beside it.
    let beside = bounds[1].min - bounds[0].min;
    assert!(beside.abs_diff_eq(glam::Vec3::new(0.002, 0.0, 0.0), 1.0e-6), "{bounds:?}");
}

#[test]
fn what_cannot_be_read_is_named() {
    for (name, expected) in [
        ("lfs_pointer.obj", "a pointer of Git LFS"),
        ("lines_only.obj", "expected faces (`f`); found none; 4 vertices, statements 1 `l`, 1 `p`"),
        ("v1.gltf", "glTF 1.0"),
        #[cfg(not(feature = "render"))]
        ("draco.glb", "a build without it"),
    ] {
        let error = read(&path(name), false).error.unwrap_or_else(|| panic!("{name} was read")).to_string();
        assert!(error.contains(expected), "{error}");
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "b.bin", b"version https://git-lfs.github.com/spec/v1\n");
    for (bytes, expected) in [
        (&b"<!DOCTYPE html><title>404"[..], "a page of HTML"),
        (b"\xFF\xFEv\0 \x001\0", "UTF-16"),
        (
            br#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"b.bin"}]}"#,
            "a pointer of Git LFS",
        ),
        (b"\x67\x6C\x54\x46\x01\0\0\0\x20\0\0\0", "glTF 1.0"),
    ] {
        let error = read(&write(folder.path(), "a.glb", bytes), false).error.expect("refused").to_string();
        assert!(error.contains(expected), "{error}");
    }
}

/// The reader counts and names the lines that it skips. Options give the up axis and the unit, which the format lacks.
#[test]
fn obj_counts_what_it_skips_and_follows_its_options() {
    let folder = tempfile::tempdir().unwrap();
    let text = "# File units = centimeters\nf 3 2 1\nmtllib none.mtl\nv 0 0 0\nv 100 0 0\nv 0 0 100\n\
                usemtl a\nf 1 2 3\ncurv 0 1 1 2\nl 1 2\nfrob\n";
    let found = read(&write(folder.path(), "a.obj", text.as_bytes()), false);
    assert!(found.error.is_none(), "{:?}", found.error);
    let said = found.notes.warnings.join("\n");
    for part in ["1 `curv`, 1 `frob`, 1 `l`", "no materials `none.mtl`"] {
        assert!(said.contains(part), "{said}");
    }
    let path = folder.path().join("a.obj");
    assert_eq!(size(&scene_of(&path, &OpenOptions::STRICT)), glam::Vec3::new(1.0, 0.0, 1.0));
    let options = OpenOptions { up: Some(Up::Z), unit_m: Some(1.0), ..OpenOptions::STRICT };
    let turned = scene_of(&path, &options);
    assert_eq!((size(&turned), turned.visible_ids().count()), (glam::Vec3::new(100.0, 100.0, 0.0), 2));
    // A line that goes on and on takes time in proportion to its length.
    let long = [b"v 0 0 0\n".as_slice(), &b"l 1 \\\n".repeat(1 << 20)].concat();
    assert!(read(&write(folder.path(), "b.obj.gz", &gzip(&long)), true).events.is_empty());
}

#[test]
fn poses_in_nanoseconds_take_their_time() {
    let found = read(&path("euroc_ns.poses"), false);
    let last = found.events.last().expect("poses").time_secs();
    assert!((last - 0.195).abs() < 1.0e-6, "{last}");
    assert!(found.notes.warnings[0].contains("1e-9 seconds"), "{:?}", found.notes);
}
