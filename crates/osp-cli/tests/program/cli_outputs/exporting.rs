//! `osp export`: what is in the file, and what is refused. (Whether it is glTF, Khronos's validator says:
//! `tests/gltf_validator`.)

use std::{fs, path::Path};

use osp_session::brush::{self, Brush, Draw, Lighting};
use serde_json::{Value, json};

use super::{assert_refused, names, write_session};
use crate::OSP;
use osp_testkit::{stderr, stdout, temp};

/// The JSON of a binary glTF file.
fn document(path: &Path) -> Value {
    let bytes = fs::read(path).expect("a model");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    serde_json::from_slice(&bytes[20..20 + word(12)]).expect("JSON")
}

fn list<'a>(json: &'a Value, key: &str) -> &'a [Value] {
    json[key].as_array().map_or(&[], Vec::as_slice)
}

/// A session of one stroke a brush, each in another colour; without a name it is plain, and half transparent.
pub(crate) fn painted(brushes: &[&str]) -> String {
    let mut text = String::from("Header(format:2,name:\"painted\",source:\"test\")\n");
    for (stroke, brush) in brushes.iter().enumerate() {
        let paint = format!(",paint:(brush:\"{brush}\",seed:3,layer:{})", stroke % 2);
        let (paint, alpha) = if brush.is_empty() { (String::new(), 0.5) } else { (paint, 1.0) };
        let green = stroke as f32 / brushes.len() as f32;
        text += &format!(
            "Begin(t:0,stroke:{stroke},tool:Ribbon,width:0.05,color:(1,{green},0,{alpha}){paint})\n"
        );
        for i in 0..30 {
            let (x, y) = (i as f32 * 0.02, stroke as f32 + (i as f32 * 0.4).sin() * 0.05);
            text += &format!("Point(t:0,stroke:{stroke},p:({x},{y},{}))\n", 0.03 * (i as f32 * 0.4).cos());
        }
        text += &format!("End(t:0,stroke:{stroke})\n");
    }
    text
}

fn material<'a>(json: &'a Value, name: &str) -> &'a Value {
    list(json, "materials").iter().find(|material| material["name"] == name).expect(name)
}

#[test]
fn every_brush_gets_the_material_that_its_facts_say() {
    let folder = temp();
    let offered: Vec<&Brush> = brush::all().iter().filter(|brush| brush.is_offered).collect();
    let mut names: Vec<&str> = offered.iter().map(|brush| brush.name.as_str()).collect();
    names.push("");
    fs::write(folder.path().join("a.ron"), painted(&names)).expect("written");
    let output = OSP.run_in(folder.path(), ["export", "a.ron", "a.glb", "--objects", "strokes"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).starts_with(&format!("a.glb: {} objects, ", names.len())), "{}", stdout(&output));
    assert!(stderr(&output).contains("particles face a fixed direction"), "{}", stderr(&output));
    let json = document(&folder.path().join("a.glb"));
    assert_eq!(list(&json, "nodes").len(), names.len());
    assert_eq!(json["extensionsUsed"], json!(["KHR_materials_specular", "KHR_materials_unlit"]));
    let (mut cut, mut unlit, mut textured) = (0, 0, 0);
    for brush in offered {
        let material = material(&json, &brush.name);
        let mode = match brush.draw {
            Draw::Opaque => "OPAQUE",
            Draw::Cutout => "MASK",
            Draw::Additive | Draw::Blended => "BLEND",
        };
        assert_eq!(material["alphaMode"], mode, "{}", brush.name);
        assert_eq!(material.get("alphaCutoff").is_some(), brush.draw == Draw::Cutout, "{}", brush.name);
        cut += u32::from(brush.draw == Draw::Cutout);
        assert_eq!(material["doubleSided"], true);
        let extensions = &material["extensions"];
        let texture = material["pbrMetallicRoughness"]["baseColorTexture"]["index"].as_u64();
        assert!(texture.is_some() || brush.picture.is_none(), "{} has no texture", brush.name);
        textured += u32::from(texture.is_some());
        if brush.lighting == Lighting::Unlit || brush.draw == Draw::Additive {
            assert!(extensions.get("KHR_materials_unlit").is_some(), "{}", brush.name);
            unlit += 1;
        } else if let Lighting::Specular { gloss, .. } = brush.lighting {
            let roughness = material["pbrMetallicRoughness"]["roughnessFactor"].as_f64().expect("a number");
            assert!((roughness - f64::from(1.0 - gloss)).abs() < 1e-6, "{}", brush.name);
        }
    }
    assert!(cut > 5 && unlit > 5 && textured > 20, "{cut} cut out, {unlit} unlit, {textured} with textures");
    // Brushes share pictures.
    assert!(list(&json, "images").len() < textured as usize, "{} images", list(&json, "images").len());
    assert_eq!(material(&json, "transparent")["alphaMode"], "BLEND");
}

#[test]
fn camera_light_and_sky_are_those_of_the_session() {
    let folder = temp();
    let camera = "camera:Some((p:(1,2,3),q:(0,0,0,1),fov_degrees:80,near_m:0.5))";
    let light = "environment:Some((sky:((0.1,0.2,0.3),(0,0,0)),ambient:(0.4,0.4,0.4),\
         lights:(((0,-1,0),(0.5,0.4,0.3)),((0,0,0),(0,0,0)))))";
    let text =
        painted(&["Flat"]).replacen("source:\"test\"", &format!("source:\"test\",{camera},{light}"), 1);
    fs::write(folder.path().join("a.ron"), text).expect("written");
    OSP.done_in(folder.path(), ["export", "a.ron", "a.glb"]);
    let json = document(&folder.path().join("a.glb"));
    let perspective = &json["cameras"][0]["perspective"];
    let angle = perspective["yfov"].as_f64().expect("a number").to_degrees();
    assert!((angle - 80.0).abs() < 1.0e-3 && perspective["znear"] == 0.5, "{perspective}");
    let node = list(&json, "nodes").iter().find(|node| node["camera"] == 0).expect("a node");
    assert_eq!(node["translation"], json!([1.0, 2.0, 3.0]));
    let lights = list(&json["extensions"]["KHR_lights_punctual"], "lights");
    assert!(lights.len() > 2 && lights.iter().all(|light| light["type"] == "directional"), "{lights:?}");
    let red = json["scenes"][0]["extras"]["environment"]["sky"]["down"][0].as_f64().expect("a number");
    assert!((red - 0.1).abs() < 1.0e-6, "{red}");
}

#[test]
fn a_static_model_has_one_part_a_material() {
    let folder = temp();
    let brushes = ["NeonPulse", "Flat", "NeonPulse", "Spikes", "Ink", "Ink"];
    fs::write(folder.path().join("a.ron"), painted(&brushes)).expect("written");
    let parts = |json: &Value| -> Vec<Value> {
        list(json, "meshes").iter().flat_map(|mesh| list(mesh, "primitives").to_vec()).collect()
    };
    OSP.done_in(folder.path(), ["export", "a.ron", "layers.glb"]);
    OSP.done_in(folder.path(), ["export", "a.ron", "static.glb", "--static"]);
    let [layers, whole] = ["layers.glb", "static.glb"].map(|name| document(&folder.path().join(name)));
    assert_eq!(parts(&layers).len(), 5, "two brushes of one layer, three of the other");
    // Flat and Spikes are matte, and differ in nothing but their names.
    assert_eq!(parts(&whole).len(), 3);
    assert!(parts(&whole).iter().all(|part| part["attributes"].get("_STROKE").is_none()));
    let bytes = |name: &str| fs::metadata(folder.path().join(name)).expect("a model").len();
    assert!(bytes("static.glb") < bytes("layers.glb"));
    // Its vertices are small, and read again as the same model.
    assert_eq!(list(&whole, "extensionsRequired"), [json!("KHR_mesh_quantization")]);
    let bounds = |name: &str| -> Vec<[f64; 3]> {
        let info: Value =
            serde_json::from_str(&OSP.done_in(folder.path(), ["info", name, "--json"])).expect("JSON");
        serde_json::from_value(info["bounds_m"].clone()).expect("two corners")
    };
    // Without ink, whose picture is cut out of its polygons.
    fs::write(folder.path().join("b.ron"), painted(&brushes[..4])).expect("written");
    OSP.done_in(folder.path(), ["export", "b.ron", "b.glb"]);
    OSP.done_in(folder.path(), ["export", "b.ron", "b-static.glb", "--static"]);
    let (again, before) = (bounds("b-static.glb").concat(), bounds("b.glb").concat());
    assert!(again.iter().zip(&before).all(|(a, b)| (a - b).abs() < 5.0e-4), "{again:?} {before:?}");
    if !cfg!(feature = "render") {
        let said = OSP.refused_in(folder.path(), ["export", "a.ron", "web.glb", "--compress"]);
        assert!(said.contains("--features render"), "{said}");
        return;
    }
    OSP.done_in(folder.path(), ["export", "a.ron", "web.glb", "--compress"]);
    assert!(bytes("web.glb") * 3 < bytes("static.glb") * 2);
    OSP.done_in(folder.path(), ["export", "b.ron", "b-web.glb", "--compress"]);
    let packed = bounds("b-web.glb").concat();
    assert!(packed.iter().zip(&before).all(|(a, b)| (a - b).abs() < 5.0e-4), "{packed:?} {before:?}");
}

#[test]
fn an_object_is_a_layer_or_a_stroke() {
    let folder = temp();
    fs::write(folder.path().join("a.ron"), painted(&["Light", "Ink", "MatteHull"])).expect("written");
    let mut found = Vec::new();
    for objects in ["layers", "strokes"] {
        OSP.done_in(folder.path(), ["export", "a.ron", "a.glb", "--objects", objects, "--force"]);
        let json = document(&folder.path().join("a.glb"));
        found.push(list(&json, "nodes").iter().map(|node| node["name"].to_string()).collect::<Vec<_>>());
        // A part of a mesh for each of its materials.
        let parts: usize = list(&json, "meshes").iter().map(|mesh| list(mesh, "primitives").len()).sum();
        assert_eq!(parts, 3);
    }
    assert_eq!(found[0], ["\"layer 0\"", "\"layer 1\""]);
    assert_eq!(found[1], ["\"stroke 0 (Light)\"", "\"stroke 1 (Ink)\"", "\"stroke 2 (MatteHull)\""]);
    // The first frame of a session has less in it.
    let whole = fs::metadata(folder.path().join("a.glb")).expect("a model").len();
    let first = ["--objects", "strokes", "--frame", "0", "--force"];
    OSP.done_in(folder.path(), ["export", "a.ron", "a.glb"].iter().chain(&first));
    assert!(fs::metadata(folder.path().join("a.glb")).expect("a model").len() < whole);
}

#[test]
fn an_export_writes_nothing_of_what_it_cannot_read() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let at = |name: &str| folder.path().join(name);
    let text = fs::read_to_string(at("a.ron")).expect("a session");
    fs::write(at("damaged.ron"), text.replacen("Point(", "Pint(", 1)).expect("written");
    for (args, words) in [
        (&["a.ron", "a.gltf"][..], &["a.gltf", ".glb"]),
        (&["a.ron", "a.glb", "--frame", "100000"], &["100000", ""]),
        (&["damaged.ron", "a.glb"], &["damaged.ron", "line"]),
    ] {
        assert_refused(&OSP.run_in(folder.path(), [&["export"], args].concat()), words);
    }
    assert_eq!(names(folder.path()), ["a.ron", "damaged.ron"]);
}
