//! What glTF files become: groups, polygons, camera and light; and what of them is refused.

use std::path::Path;

use glam::{Quat, Vec3};
use osp_session::{
    export::{ExportOptions, Objects, write_glb},
    recording::{
        Event, GroupId, Header, Limits, OpenOptions, StrokeId, SynthKind, Transform, open, synthesize,
    },
    scene::Scene,
};

use osp_testkit::events::{SOLE, polygon};

use super::files::{glb, read, read_sound, small_glb, small_gltf, write};

fn scene_of(path: &Path) -> (Header, Scene) {
    let session = open(path, &OpenOptions::default()).unwrap();
    let header = session.header.clone();
    let events: Vec<Event> = session.map(Result::unwrap).collect();
    let mut scene = Scene::new();
    scene.apply_all(&events, &mut Vec::new());
    assert_eq!(scene.counts().ignored_events, 0);
    (header, scene)
}

fn corners(scene: &Scene) -> Vec<Vec<Vec3>> {
    scene.visible_ids().map(|id| scene.polygon(id).vertices().to_vec()).collect()
}

fn is_near(a: &[Vec3], b: &[[f32; 3]]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.abs_diff_eq(Vec3::from(*b), 1.0e-5))
}

#[test]
fn nodes_become_nested_named_groups() {
    let folder = tempfile::tempdir().unwrap();
    let (header, mut scene) = scene_of(&write(folder.path(), "a.glb", &small_glb()));
    assert_eq!((header.name.as_str(), header.source.as_str()), ("a", "glTF 2.0 by a test"));
    let tree = scene.group_tree();
    let rows: Vec<_> = tree.iter().map(|n| (n.name.as_deref(), n.depth, n.strokes, n.polygons)).collect();
    assert_eq!(rows, [(Some("arm"), 0, 3, 4), (Some("hand"), 1, 2, 3), (Some("square"), 2, 1, 1)]);
    // World from arm: twice as large, a quarter turn about y (x becomes -z), moved.
    let polygons = corners(&scene);
    assert!(is_near(&polygons[0], &[[1.0, 2.0, 3.0], [1.0, 2.0, 1.0], [1.0, 4.0, 1.0], [1.0, 4.0, 3.0]]));
    // The hand's mirror went into its vertices: x backwards is +z here.
    let strips = [&polygons[1], &polygons[2]];
    assert!(is_near(strips[0], &[[1.0, 4.0, 3.0], [1.0, 4.0, 5.0], [1.0, 6.0, 3.0]]), "{strips:?}");
    assert!(is_near(strips[1], &[[1.0, 6.0, 3.0], [1.0, 4.0, 5.0], [2.0, 6.0, 5.0]]), "{strips:?}");
    // Below the mirror the child's way of 5 goes backwards, too.
    assert!(is_near(&polygons[3], &[[1.0, 4.0, 13.0], [1.0, 4.0, 15.0], [1.0, 6.0, 15.0], [1.0, 6.0, 13.0]]));
    let bounds = tree[0].bounds;
    assert!(is_near(&[bounds.min, bounds.max], &[[1.0, 2.0, 1.0], [2.0, 6.0, 15.0]]), "{bounds:?}");
}

#[test]
fn colours_are_base_colours_times_the_mean_of_vertices() {
    let folder = tempfile::tempdir().unwrap();
    let (_, scene) = scene_of(&write(folder.path(), "a.glb", &small_glb()));
    let colors: Vec<_> = scene.visible_ids().map(|id| scene.color(id)).collect();
    let byte = |n: u8| f32::from(n) / 255.0;
    assert_eq!(colors[0], (0.5019608, 0.5019608, 1.0, 1.0), "linear 0.214 is half of sRGB");
    assert_eq!(colors[1], (1.0, 0.0, 0.0, byte(128)));
    assert_eq!(colors[2], colors[1]);
    // As MASK: whole above the cutoff, else not there.
    let (json, buffer) = small_gltf();
    for (cutoff, alphas) in [("0.6", &[][..]), ("0.4", &[1.0, 1.0])] {
        let json = json.replace("\"BLEND\"", &format!("\"MASK\",\"alphaCutoff\":{cutoff}"));
        let (_, scene) = scene_of(&write(folder.path(), "m.glb", &glb(&json, &buffer)));
        let found: Vec<f32> = scene.visible_ids().map(|id| scene.stroke_of(id).color().3).collect();
        assert_eq!(found[1..found.len() - 1], *alphas);
    }
}

#[test]
fn camera_and_lights_are_those_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let header = open(&write(folder.path(), "a.glb", &small_glb()), &OpenOptions::default()).unwrap().header;
    let camera = header.camera.expect("the file has one");
    assert_eq!((camera.p, camera.q, camera.near_m), (Vec3::new(0.0, 1.5, 4.0), Quat::IDENTITY, Some(0.01)));
    assert!((camera.fov_degrees - 45.0).abs() < 1.0e-4);
    let environment = header.environment.expect("the file has suns");
    let [(way, color), (way_2, color_2)] = environment.lights;
    assert_eq!((way, color), (Vec3::NEG_Z, Vec3::X), "the brighter one is the first, at full strength");
    assert!(way_2.abs_diff_eq(Vec3::NEG_Y, 1.0e-5) && color_2 == Vec3::splat(0.25), "{way_2} {color_2}");
    assert_eq!(
        header.left_out,
        [
            "1 light that is not one of the two brightest directional ones".to_owned(),
            "1 mesh of points or lines".to_owned()
        ]
    );
}

#[test]
fn buffers_lie_in_the_file_beside_it_or_in_its_text() {
    let folder = tempfile::tempdir().unwrap();
    let expected = read_sound(&write(folder.path(), "a.glb", &small_glb()));
    let (json, buffer) = small_gltf();
    write(folder.path(), "parts/a b.bin", &buffer);
    let with_uri = |uri: &str| {
        json.replace("{\"byteLength\":124}", &format!("{{\"byteLength\":124,\"uri\":\"{uri}\"}}"))
    };
    let beside = write(folder.path(), "b.gltf", with_uri("parts/a%20b.bin").as_bytes());
    assert_eq!(read_sound(&beside), expected);
    let text = base64(&buffer);
    let inside = with_uri(&format!("data:application/octet-stream;base64,{text}"));
    assert_eq!(read_sound(&write(folder.path(), "c.gltf", inside.as_bytes())), expected);
    // Whatever it is called.
    assert_eq!(read_sound(&write(folder.path(), "d", &small_glb())), expected);
}

/// A symbolic link beside a model leads no further than a URI does.
#[cfg(unix)]
#[test]
fn a_link_out_of_the_folder_is_not_followed() {
    use std::os::unix::fs::symlink;

    let folder = tempfile::tempdir().unwrap();
    let (json, buffer) = small_gltf();
    let secret = write(folder.path(), "elsewhere/secret.bin", &buffer);
    let inside = write(folder.path(), "models/parts/own.bin", &buffer);
    let models = folder.path().join("models");
    symlink(&secret, models.join("file.bin")).unwrap();
    symlink(secret.parent().unwrap(), models.join("folder")).unwrap();
    symlink(&inside, models.join("own.bin")).unwrap();
    let model = |uri: &str| {
        let json = json.replace("{\"byteLength\":124}", &format!("{{\"byteLength\":124,\"uri\":\"{uri}\"}}"));
        write(&models, "a.gltf", json.as_bytes())
    };
    for uri in ["file.bin", "folder/secret.bin"] {
        let path = model(uri);
        let error = read(&path, false).error.unwrap_or_else(|| panic!("{uri} was followed")).to_string();
        let expected = "expected the URI of a buffer in the same folder or below";
        let found = format!("`{uri}`, a link that leads out of the folder");
        assert_eq!(error, format!("{}: {expected}; found {found}", path.display()));
        // Who reads damaged files gets nothing of it either.
        let lenient = read(&path, true);
        assert!(!lenient.events.iter().any(|event| matches!(event, Event::Polygon { .. })), "{uri}");
    }
    // Within the folder links lead anywhere; so does the way to the folder.
    let expected = read_sound(&write(folder.path(), "a.glb", &small_glb()));
    assert_eq!(read_sound(&model("own.bin")), expected);
    symlink(&models, folder.path().join("way")).unwrap();
    assert_eq!(read_sound(&folder.path().join("way/a.gltf")), expected);
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word =
            chunk.iter().fold(0u32, |word, &byte| word << 8 | u32::from(byte)) << (8 * (3 - chunk.len()));
        for i in 0..=chunk.len() {
            text.push(LETTERS[(word >> (18 - 6 * i) & 63) as usize] as char);
        }
    }
    text
}

/// Positions that are only in the sparse part, and whole numbers that stand for parts of 1.
#[test]
fn sparse_and_quantised_positions() {
    let folder = tempfile::tempdir().unwrap();
    let accessor = |more: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["KHR_mesh_quantization"],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"count":3,"type":"VEC3",{more}}}],
            "bufferViews":[{{"buffer":0,"byteLength":24,"byteStride":8}},{{"buffer":0,"byteOffset":24,"byteLength":4}},
            {{"buffer":0,"byteOffset":28,"byteLength":24}}],"buffers":[{{"byteLength":52}}]}}"#
        )
    };
    let mut bytes: Vec<u8> =
        [0u16, 0, 0, 9, u16::MAX, 0, 0, 9, 0, 32768, 0, 9].iter().flat_map(|n| n.to_le_bytes()).collect();
    bytes.extend([1, 2, 0, 0]);
    bytes.extend([1.0f32, 0.0, 0.0, 0.0, 3.0, 0.0].iter().flat_map(|n| n.to_le_bytes()));
    let quantised = accessor(r#""componentType":5123,"normalized":true,"bufferView":0"#);
    let sparse = accessor(
        r#""componentType":5126,"sparse":{"count":2,"indices":{"bufferView":1,"componentType":5121},
        "values":{"bufferView":2}}"#,
    );
    for (json, third) in [(quantised, 32768.0 / 65535.0), (sparse, 3.0)] {
        let (_, scene) = scene_of(&write(folder.path(), "a.glb", &glb(&json, &bytes)));
        let found = corners(&scene);
        assert!(is_near(&found[0], &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, third, 0.0]]), "{found:?}");
    }
}

/// The models of our own sessions come back, however they are written: as many polygons, of the same area, opacity and
/// place. Small vertices lie on a grid of at most half a millimetre, and float ones where they were.
#[test]
fn what_was_exported_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let room = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../recordings/room.ron"));
    let glass = |x: f32| polygon(None, [Vec3::X * x, Vec3::Y, Vec3::Z], (0.2, 0.4, 0.6, 0.5));
    let whole = |is_compressed| Objects::Whole { is_compressed };
    for (objects, length_m, step_m) in [
        (Objects::Layers, 1.0, 0.0),
        (Objects::Strokes, 1.0, 0.0),
        (whole(false), 1.0, 5.0e-4),
        (whole(cfg!(feature = "render")), 1.0, 5.0e-4),
        // Sixteen bits are too few for a model of a kilometre.
        (whole(false), 1000.0, 0.0),
    ] {
        let (_, mut scene) = scene_of(room);
        scene.apply(&glass(length_m), &mut Vec::new());
        let mut bytes = Vec::new();
        let options = ExportOptions { objects, ..ExportOptions::default() };
        let counts = write_glb(&scene, "a", &options, &mut bytes).unwrap();
        let (_, back) = scene_of(&write(folder.path(), "back.glb", &bytes));
        // On the grid, the triangles of a quad may lie in two planes.
        let most = if step_m > 0.0 { counts.triangles } else { counts.polygons };
        assert!((counts.polygons..=most).contains(&back.counts().visible), "{objects:?}: {counts:?}");
        let of = |scene: &Scene| {
            let ids = || scene.visible_ids();
            let area = ids().map(|id| f64::from(scene.polygon(id).area_m2())).sum::<f64>();
            let glass = ids().filter(|&id| (scene.color(id).3 - 0.5).abs() < 0.01).count();
            (area, glass, ids().map(|id| scene.bounds(id)).reduce(|a, b| a.union(&b)).unwrap())
        };
        let ((area, glass, bounds), (area_back, glass_back, bounds_back)) = (of(&scene), of(&back));
        assert!((area_back / area - 1.0).abs() < if step_m > 0.0 { 1.0e-3 } else { 1.0e-9 }, "{objects:?}");
        assert_eq!((glass, glass_back), (1, 1), "{objects:?}");
        let off = (bounds.min - bounds_back.min).abs().max((bounds.max - bounds_back.max).abs());
        assert!(off.max_element() <= step_m, "{objects:?}: {bounds:?}, {bounds_back:?}");
    }
}

/// A polygon at infinity is counted, not written; and nothing is a file, too.
#[test]
fn what_a_file_cannot_hold_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let triangle = |stroke| polygon(stroke, [Vec3::X, Vec3::Y, Vec3::Z], (1.0, 0.5, 0.0, 1.0));
    let far = |group| SOLE.placed(group, Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0e30 });
    let (inner, outer) = (GroupId(1), GroupId(2));
    let events = [
        triangle(None),
        triangle(Some(StrokeId(1))),
        SOLE.grouped(outer, [], None),
        SOLE.grouped(inner, [StrokeId(1)], Some(outer)),
        far(inner),
        far(outer),
    ];
    let mut scene = Scene::new();
    scene.apply_all(&events, &mut Vec::new());
    let written = |scene: &Scene| {
        let mut bytes = Vec::new();
        let counts = write_glb(scene, "a", &ExportOptions::default(), &mut bytes).unwrap();
        (counts, write(folder.path(), "a.glb", &bytes))
    };
    let (counts, path) = written(&scene);
    assert_eq!((counts.polygons, counts.not_finite), (1, 1));
    assert_eq!(scene_of(&path).1.counts().visible, 1);
    let (counts, path) = written(&Scene::new());
    assert_eq!(counts.polygons, 0);
    let error = read(&path, false).error.unwrap().to_string();
    assert!(error.contains("none in 0 meshes"), "{error}");
}

/// A brush comes back as itself: as many polygons of each brush and colour, with the same texture.
#[test]
fn brushes_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let events: Vec<Event> = synthesize(SynthKind::Brushes, 20_000, 1).map(Result::unwrap).collect();
    let mut scene = Scene::new();
    scene.apply_all(&events, &mut Vec::new());
    let mut bytes = Vec::new();
    write_glb(&scene, "a", &ExportOptions::default(), &mut bytes).unwrap();
    let (_, back) = scene_of(&write(folder.path(), "back.glb", &bytes));
    let seen = |scene: &Scene| {
        let all = scene.visible_ids().filter(|id| scene.has_area(*id)).map(|id| {
            let (stroke, surface) = (scene.stroke_of(id), scene.surface(id));
            let color = scene.color(id);
            let color = [color.0, color.1, color.2].map(|c| (c * 255.0).round() as u8);
            let slope = ((surface.uv(1) - surface.uv(0)).length() * 100.0).round() as i32;
            let alpha = (surface.alpha(0) * 255.0).round() as u8;
            (stroke.brush().map(|brush| brush.name.clone()), color, slope, alpha)
        });
        let mut all: Vec<_> = all.collect();
        all.sort();
        all
    };
    let (before, after) = (seen(&scene), seen(&back));
    assert_eq!(before.len(), after.len());
    for (a, b) in before.iter().zip(&after) {
        assert!((&a.0, a.1, a.3) == (&b.0, b.1, b.3) && (a.2 - b.2).abs() <= 1, "{a:?}, {b:?}");
    }
}

/// Nodes far below one another: those too deep for a group go into the one above them.
#[test]
fn a_chain_of_nodes_may_be_long() {
    let folder = tempfile::tempdir().unwrap();
    let nodes: Vec<String> = (0..200)
        .map(|i| {
            format!(
                "{{\"translation\":[1,0,0],{}}}",
                if i < 199 { format!("\"children\":[{}]", i + 1) } else { "\"mesh\":0".into() }
            )
        })
        .collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":3,"type":"VEC3","bufferView":0}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36}}]}}"#,
        nodes.join(",")
    );
    let triangle: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|n| n.to_le_bytes()).collect();
    let (_, mut scene) = scene_of(&write(folder.path(), "a.glb", &glb(&json, &triangle)));
    assert!(is_near(&corners(&scene)[0], &[[200.0, 0.0, 0.0], [201.0, 0.0, 0.0], [200.0, 1.0, 0.0]]));
    assert_eq!(scene.group_tree().len(), 60);
}

#[test]
fn a_model_ends_at_the_limits() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.glb", &small_glb());
    let error = |path: &Path, polygons: u64| {
        let options = OpenOptions { limits: Limits { polygons, ..Limits::DEFAULT }, ..OpenOptions::STRICT };
        let mut session = match open(path, &options) {
            Ok(session) => session,
            Err(error) => return error.to_string(),
        };
        session.find_map(Result::err).map_or(String::new(), |error| error.to_string())
    };
    assert_eq!(error(&path, 1000), "");
    let said = error(&path, 100);
    assert!(said.contains("expected at most 6 objects in its JSON (--max-polygons N allows more)"), "{said}");
    // One mesh of a thousand nodes.
    let nodes = ["{\"mesh\":0}"; 1000].join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":900,"type":"VEC3","bufferView":0}}],
        "bufferViews":[{{"buffer":0,"byteLength":10800}}],"buffers":[{{"byteLength":10800}}]}}"#
    );
    let corners: Vec<u8> =
        (0..2700u32).flat_map(|i| ((i % 1009 * (i % 1009) % 1009) as f32).to_le_bytes()).collect();
    let path = write(folder.path(), "b.glb", &glb(&json, &corners));
    let said = error(&path, 200_000);
    assert!(said.contains("b.glb: expected at most 200000 polygons"), "{said}");
    assert_eq!(error(&path, 400_000), "");
}

/// A mesh whose vertices are painted in more colours than can be strokes.
#[test]
fn a_painted_mesh_is_not_a_stroke_for_each_triangle() {
    let folder = tempfile::tempdir().unwrap();
    let count = 30_000u32;
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"COLOR_0":1}}}}]}}],
        "accessors":[{{"componentType":5126,"count":{count},"type":"VEC3","bufferView":0}},
        {{"componentType":5121,"normalized":true,"count":{count},"type":"VEC3","bufferView":1}}],
        "bufferViews":[{{"buffer":0,"byteLength":{a}}},{{"buffer":0,"byteOffset":{a},"byteLength":{b}}}],
        "buffers":[{{"byteLength":{c}}}]}}"#,
        a = 12 * count,
        b = 3 * count,
        c = 15 * count
    );
    let mut bytes: Vec<u8> =
        (0..3 * count).flat_map(|i| ((i % 1009 * (i % 1009) % 1009) as f32).to_le_bytes()).collect();
    bytes.extend((0..3 * count).map(|i| (i / 9 * 37 % 251) as u8));
    let (_, scene) = scene_of(&write(folder.path(), "a.glb", &glb(&json, &bytes)));
    let counts = scene.counts();
    assert!(counts.polygons + counts.drops.degenerate == 10_000, "{counts:?}");
    assert!(counts.strokes < 3000, "{counts:?}");
}
