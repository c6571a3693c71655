//! The time and the stroke at each vertex of an exported model, read as any reader of glTF reads attributes.

use std::{fs, path::Path};

use crate::OSP;
use osp_testkit::temp;
use serde_json::Value;

struct Model {
    json: Value,
    binary: Vec<u8>,
}

impl Model {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).expect("a model");
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
        let json_end = 20 + word(12);
        let json = serde_json::from_slice(&bytes[20..json_end]).expect("JSON");
        Self { json, binary: bytes[json_end + 8..].to_vec() }
    }

    /// All numbers of an attribute of floats in all primitives, a list for each vertex.
    fn floats(&self, attribute: &str) -> Vec<Vec<f32>> {
        let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let meshes = self.json["meshes"].as_array().expect("meshes");
        let primitives = meshes.iter().flat_map(|mesh| mesh["primitives"].as_array().expect("primitives"));
        let mut all = Vec::new();
        for primitive in primitives {
            let at = primitive["attributes"][attribute].as_u64().expect(attribute) as usize;
            let accessor = &self.json["accessors"][at];
            assert_eq!(accessor["componentType"], 5126, "floats");
            let width = if accessor["type"] == "SCALAR" { 1 } else { 3 };
            let view = &self.json["bufferViews"][number(&accessor["bufferView"])];
            let start = number(&view["byteOffset"]) + number(&accessor["byteOffset"]);
            for vertex in 0..number(&accessor["count"]) {
                let at = start + vertex * number(&view["byteStride"]);
                let bytes = self.binary[at..at + 4 * width].chunks(4);
                all.push(bytes.map(|b| f32::from_le_bytes(b.try_into().expect("four"))).collect());
            }
        }
        all
    }

    /// Time, stroke, and the position along x of each vertex.
    fn vertices(&self) -> Vec<(f32, f32, f32)> {
        let [times, strokes, places] = ["_TIMESTAMP", "_STROKE", "POSITION"].map(|name| self.floats(name));
        assert_eq!((times.len(), strokes.len()), (places.len(), places.len()));
        (0..places.len()).map(|i| (times[i][0], strokes[i][0], places[i][0])).collect()
    }
}

/// Two hands draw at once, half a second a sample, 0.1 m a sample; a face without a stroke comes last. The session begins at
/// an hour.
fn session() -> String {
    let mut text = String::from("Header(format:1,name:\"x\",source:\"y\")\n");
    for stroke in [3, 7] {
        text += &format!("Begin(t:3600,stroke:{stroke},tool:Ribbon,width:0.02,color:(1,0,0,1))\n");
    }
    for i in 0..40 {
        for stroke in [3, 7] {
            let (t, x) = (3600.0 + i as f64 * 0.5, i as f32 * 0.1);
            text += &format!("Point(t:{t},stroke:{stroke},p:({x},{stroke},0))\n");
        }
    }
    text += "End(t:3620,stroke:3)\nEnd(t:3620,stroke:7)\n";
    text + "Polygon(t:3630,vertices:[(9,0,0),(10,0,0),(9,1,0)],color:(1,1,1,1))\n"
}

fn exported(pace: &str) -> Vec<(f32, f32, f32)> {
    let folder = temp();
    fs::write(folder.path().join("a.ron"), session()).expect("written");
    OSP.done_in(folder.path(), ["export", "a.ron", "a.glb", "--pace", pace]);
    Model::read(&folder.path().join("a.glb")).vertices()
}

#[test]
fn each_vertex_knows_when_it_was_drawn_and_by_which_stroke() {
    let vertices = exported("samples:1");
    let quads: Vec<_> = vertices.chunks(4).take_while(|quad| quad[0].1 >= 0.0).collect();
    assert_eq!(quads.len(), 2 * 39);
    for quad in quads {
        let far = quad.iter().map(|vertex| vertex.2).fold(0.0, f32::max);
        let (secs, stroke, _) = quad[0];
        assert!((secs - far * 5.0).abs() < 1.0e-3, "a quad up to {far} m at {secs} s");
        assert!(stroke == 3.0 || stroke == 7.0, "{stroke}");
        assert!(quad.iter().all(|vertex| (vertex.0, vertex.1) == (secs, stroke)));
    }
    assert_eq!(&vertices[vertices.len() - 3..], [(30.0, -1.0, 9.0), (30.0, -1.0, 10.0), (30.0, -1.0, 9.0)]);
}

#[test]
fn samples_that_a_frame_takes_at_once_keep_their_order_and_nearly_their_times() {
    for pace in ["samples:16", "samples:1000"] {
        let vertices = exported(pace);
        for &(secs, stroke, x) in vertices.iter().filter(|vertex| vertex.1 >= 0.0) {
            // A quad is up to a sample long, and a frame has one quad less than samples where the stroke begins.
            assert!((secs - x * 5.0).abs() <= 1.01, "{pace}, stroke {stroke}: {x} m at {secs} s");
        }
    }
}
