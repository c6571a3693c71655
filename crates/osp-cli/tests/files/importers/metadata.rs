//! What the metadata of a `.tilt` say besides the camera: light, layers, what is not in the file.

use std::path::Path;

use super::{
    files::{METADATA, layer_stroke, raw_points, read, read_sound, sketch, write},
    left_out::header_of,
};
use glam::{Quat, Vec3};
use osp::math::rotate;
use osp_session::{
    brush,
    recording::{Environment, Event, Layer, OpenOptions, open},
};

fn light_of(metadata: &str) -> Environment {
    let (header, warnings) = header_of(metadata, false);
    assert_eq!(warnings, [""; 0]);
    *header.environment.expect("an environment")
}

fn near(a: Vec3, b: [f32; 3]) -> bool {
    a.abs_diff_eq(Vec3::from_array(b), 1e-5)
}

#[test]
fn a_preset_gives_sky_floor_fog_and_lights() {
    let standard = light_of(r#"{"EnvironmentPreset":"AB080599-e465-4a6d-8587-43bf495af68b"}"#);
    assert_eq!(standard.preset, "Standard");
    assert!(near(standard.sky[0] - 0.275, [0.0, 0.0, 0.043]) && near(standard.sky[1], [0.035, 0.035, 0.086]));
    assert!(near(standard.floor.expect("a dark floor"), [14.0 / 255.0, 14.0 / 255.0, 16.0 / 255.0]));
    // 0.0025 for each decimetre.
    assert!((standard.fog.1 - 0.025).abs() < 1e-7, "{:?}", standard.fog);
    // Forward there is -z here.
    assert!(standard.lights[0].0.abs_diff_eq(Vec3::new(0.0, -0.866, -0.5), 1e-4), "{:?}", standard.lights);
    assert!(near(standard.lights[0].1, [0.778, 0.816, 0.991]));
    assert!(standard.lights[1].0.abs_diff_eq(Vec3::new(0.0, -0.643, 0.766), 1e-3));
    // A picture of a sky is a gradient of what it amounts to, and what a gradient does not show is named.
    let (header, _) = header_of(r#"{"EnvironmentPreset":"0ca88298-e5e8-4e94-aad8-4b4f6c80ae52"}"#, false);
    let blue = header.environment.expect("an environment");
    let up = [149.0 * 0.463, 149.0 * 0.529, 156.0 * 0.698].map(|byte| byte * 1.46 / 255.0);
    assert!(near(blue.sky[1], up), "{:?}", blue.sky);
    assert_eq!(header.left_out, [""; 0]);
    let (header, _) = header_of(r#"{"EnvironmentPreset":"96cf6f36-47b6-44f4-bdbf-63be2ddac909"}"#, false);
    assert_eq!(header.left_out, [""; 0]);
    let space = header.environment.expect("an environment");
    assert_eq!(space.lights[1], (Vec3::ZERO, Vec3::ZERO), "its second light is off");
    let (header, _) = header_of(r#"{"EnvironmentPreset":"ab080511-e565-4a6d-8587-53bf495af68b"}"#, false);
    assert_eq!(header.left_out, ["the snow and the snowman of the environment Snowman"]);
}

#[test]
fn the_artist_changes_sky_and_lights() {
    let light = light_of(METADATA);
    assert_eq!(light.preset, "Standard");
    assert!(near(light.sky[0], [0.0, 0.2, 0.4]) && near(light.sky[1], [1.0, 0.8, 0.6]));
    // (0.5, 0.5, 0.5, 0.5) takes y to z: forward there, -z here.
    let up = rotate(light.sky_rotation, Vec3::Y);
    assert!(near(up, [0.0, 0.0, -1.0]), "{up}");
    assert!(near(light.fog.0, [0.2, 0.0, 0.0]) && (light.fog.1 - 0.04).abs() < 1e-7, "{:?}", light.fog);
    assert_eq!(light.reflection, 0.7);
    assert!(near(light.ambient, [0.2, 0.4, 0.6]));
    // Turned by 90 degrees about y forward becomes right; about x it becomes down.
    assert!(near(light.lights[0].0, [1.0, 0.0, 0.0]) && near(light.lights[1].0, [0.0, -1.0, 0.0]));
    assert_eq!(light.lights.map(|(_, color)| color.x), [2.0, 0.25]);
    assert!(light.floor.is_some(), "the floor is not the sky's");
}

#[test]
fn light_that_cannot_be_is_left_out_with_a_warning() {
    let preset = r#""EnvironmentPreset":"9b89b0a4-c41e-4b78-82a1-22f10a238357""#;
    let white = light_of(&format!("{{{preset}}}"));
    for (damaged, expected) in [
        (r#""Environment":{"GradientColors":[[1,2,3,4]]}"#, "`Environment`"),
        (r#""Environment":{"GradientColors":[[1,2,3,256],[1,2,3,4]]}"#, "`Environment`"),
        (r#""Environment":{"FogDensity":-1}"#, "density of fog"),
        (r#""Environment":{"FogDensity":1e300}"#, "density of fog"),
        (r#""Environment":{"FogDensity":1e999}"#, "`Environment`"),
        (r#""Environment":{"GradientColors":[[1,2,3,4],[1,2,3,4]],"GradientSkew":[0,0,0,0]}"#, "quaternion"),
        (r#""Environment":[3]"#, "`Environment`"),
        (r#""Environment":{"ReflectionIntensity":-0.5}"#, "reflection"),
        (r#""Lights":{"Ambient":"red"}"#, "`Lights`"),
        (r#""Lights":{"Shadow":{"Orientation":[0,0,0,0],"Color":[1,1,1,1]}}"#, "of length 1"),
        (r#""Lights":{"Shadow":{"Orientation":[0,0,0,1],"Color":[1e30,1,1,1]}}"#, "colours"),
        (r#""Lights":3"#, "`Lights`"),
    ] {
        let (header, warnings) = header_of(&format!("{{{preset},{damaged}}}"), false);
        assert_eq!(header.environment.as_deref(), Some(&white), "{damaged}");
        let [warning] = &warnings[..] else { panic!("{damaged}: {warnings:?}") };
        assert!(warning.contains("metadata.json") && warning.contains(expected), "{warning}");
        assert!(warning.contains("expected") && warning.contains("read without it"), "{warning}");
    }
    for preset in ["\"no-such-guid\"", "7", "{}"] {
        let (header, warnings) = header_of(&format!(r#"{{"EnvironmentPreset":{preset}}}"#), false);
        assert_eq!(header.environment, None, "{preset}");
        assert_eq!(warnings.len(), 1, "{preset}: {warnings:?}");
    }
    // The changes to an unknown one are kept.
    let (header, warnings) = header_of(&METADATA.replace("ab080599", "12345678"), false);
    let light = header.environment.expect("what the artist changed");
    assert_eq!((light.preset.as_str(), light.floor, light.reflection), ("", None, 0.7));
    assert_eq!(warnings.len(), 1, "{warnings:?}");
}

#[test]
fn a_sketch_that_says_nothing_of_light_has_none() {
    let (header, warnings) =
        header_of(r#"{"Environment":null,"Lights":null,"Layers":null,"ModelIndex":null}"#, false);
    assert_eq!((header.environment, warnings.len(), header.left_out.len()), (None, 0, 0));
    assert_eq!(header.layers, []);
}

#[test]
fn strokes_of_a_hidden_layer_are_hidden() {
    let folder = tempfile::tempdir().unwrap();
    let stroke = |layer| layer_stroke(layer, [1.0; 4], 1.0, 1.0, &raw_points(3, [0.0; 3], 0));
    // Of the third layer nothing is known.
    write(folder.path(), "data.sketch", &sketch(5, &[stroke(0), stroke(1), stroke(2)]).0);
    write(folder.path(), "metadata.json", METADATA.as_bytes());
    let layer = |name: &str, hidden| Layer { name: name.to_owned(), hidden };
    let header = open(folder.path(), &OpenOptions::default()).unwrap().header;
    assert_eq!(header.layers, [layer("Main Canvas", false), layer("Notes", true)]);
    let hidden: Vec<(u32, bool)> = read_sound(folder.path())
        .iter()
        .filter_map(|event| match event {
            Event::Begin { paint: Some(paint), .. } => Some((paint.layer, paint.hidden)),
            _ => None,
        })
        .collect();
    assert_eq!(hidden, [(0, false), (1, true), (2, false)]);
}

#[test]
fn what_the_file_only_names_is_said() {
    let (header, _) = header_of(METADATA, false);
    assert_eq!(header.left_out, ["2 models (a.glb, b)", "1 picture (c.png)", "1 placed light"]);
    let video = format!(r#"{{"FilePath":"{}.mp4"}},"#, "v".repeat(500)).repeat(1000);
    let named = r#""ModelIndex":"none","Environment":{"Skybox":"sky.jpg"}"#;
    let videos = format!(r#"{{"Videos":[{}],{named}}}"#, video.trim_end_matches(','));
    let (header, warnings) = header_of(&videos, false);
    assert_eq!(header.left_out[0], "the sky picture sky.jpg");
    assert!(header.left_out[1].starts_with("1000 videos (vvv") && header.left_out[1].ends_with(", …)"));
    assert!(header.left_out.iter().all(|line| line.len() < 400), "{:?}", header.left_out);
    let [damaged, long] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(damaged.contains("`ModelIndex`") && long.contains("at most 262144 bytes"), "{warnings:?}");
}

#[test]
fn the_camera_of_old_sketches_is_read() {
    let camera = r#"{"position":[-8,10,30],"orientation":[0.70710678,0,0,0.70710678]}"#;
    let (header, _) = header_of(&format!(r#"{{"ThumbnailCameraTransform":{camera}}}"#), false);
    let camera = header.camera.expect("a camera");
    assert!(camera.p.abs_diff_eq(Vec3::new(-0.8, 1.0, -3.0), 1e-6), "{}", camera.p);
    // It looks down.
    assert!(near(rotate(camera.q, Vec3::NEG_Z), [0.0, -1.0, 0.0]), "{}", camera.q);
    let (header, warnings) = header_of(r#"{"ThumbnailCameraTransform":{"position":[1,2]}}"#, false);
    assert!(header.camera.is_none() && warnings.len() == 1, "{warnings:?}");
}

#[test]
fn the_sketches_of_the_corpus_have_the_light_of_their_presets() {
    let Some(corpus) = std::env::var_os("OSP_CORPUS") else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    let mut sketches = 0;
    for entry in std::fs::read_dir(Path::new(&corpus).join("tilt")).expect("sketches") {
        let path = entry.expect("an entry").path();
        let read = read(&path, false);
        assert!(
            read.error.is_none() && read.notes.warnings.is_empty(),
            "{}: {:?}",
            path.display(),
            read.notes
        );
        let header = open(&path, &OpenOptions::default()).expect("it was read").header;
        let environment = header.environment.expect("every sketch has one");
        assert!(!environment.preset.is_empty(), "{}", path.display());
        assert!(header.camera.is_some(), "{}", path.display());
        for event in &read.events {
            if let Event::Begin { paint, .. } = event {
                let paint = paint.as_ref().expect("every stroke has a brush");
                assert!(brush::find(&paint.brush).is_some(), "{}: {}", path.display(), paint.brush);
            }
        }
        if path.ends_with("tb_Promoted_TiltMech.tilt") {
            // Its sky stands nearly upright, but leans.
            let up = rotate(environment.sky_rotation, Vec3::Y);
            assert!(up.y > 0.97 && environment.sky_rotation != Quat::IDENTITY, "{up}");
        }
        sketches += 1;
    }
    assert!(sketches > 15, "{sketches} sketches");
}
