//! `osp info --cost`: what makes a sketch heavy.

use std::fs;

use serde_json::Value;

use super::exporting::painted;
use crate::OSP;
use osp_testkit::{stdout, temp};

#[test]
fn costs_are_those_of_the_exported_model_and_add_up() {
    let folder = temp();
    let mut session = painted(&["Ink", "Light", "Wire", ""]);
    session += "Polygon(vertices: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], color: (1, 1, 1, 1))\n";
    session += "Erase(t: 9, stroke: 0)\n";
    fs::write(folder.path().join("a.ron"), session).expect("written");
    let said = OSP.done_in(folder.path(), ["export", "a.ron", "a.glb"]);
    let exported = said;
    let output =
        OSP.run_in(folder.path(), ["info", "a.ron", "--cost", "--json", "--budget-triangles", "100"]);
    let info: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let cost = &info["cost"];
    let number = |value: &Value| value.as_u64().expect("a number");
    let triangles = number(&cost["triangles"]);
    assert!(exported.contains(&format!(" {triangles} triangles")), "{triangles}: {exported}");
    assert!(triangles > 500 && number(&cost["vertices"]) > triangles, "{cost}");
    let brushes = cost["brushes"].as_array().expect("a list");
    // The erased Ink is not there; a plain ribbon is half transparent, the polygon is not.
    let mut names: Vec<(&str, bool)> = brushes
        .iter()
        .map(|row| (row["brush"].as_str().expect("a name"), row["is_blended"].as_bool().expect("a bool")))
        .collect();
    names.sort_unstable();
    assert_eq!(names, [("(none)", false), ("(none)", true), ("Light", true), ("Wire", false)]);
    assert_eq!(brushes[0]["brush"], "Wire", "a tube has most");
    let sum = |key: &str| brushes.iter().map(|row| number(&row[key])).sum::<u64>();
    assert_eq!((sum("triangles"), sum("vertices")), (triangles, number(&cost["vertices"])));
    let blended = brushes.iter().filter(|row| row["is_blended"] == true);
    assert_eq!(blended.map(|row| number(&row["triangles"])).sum::<u64>(), number(&cost["blended_triangles"]));
    let layers = cost["blended_layers"].as_f64().expect("a number");
    assert!(layers > 0.0 && layers < 1.0, "two thin ribbons cover a part of the picture: {layers}");
    let expensive = cost["most_expensive_strokes"].as_array().expect("a list");
    assert_eq!((&expensive[0]["stroke"], &expensive[0]["brush"]), (&2.into(), &"Wire".into()));
    let shares: f64 = expensive.iter().map(|row| row["share"].as_f64().expect("a number")).sum();
    assert!((shares - 1.0).abs() < 1.0e-9 && expensive.len() == 4, "{shares}");

    let text = |budget: &str| {
        stdout(&OSP.run_in(folder.path(), ["info", "a.ron", "--cost", "--budget-triangles", budget]))
    };
    assert!(text("100").contains(&format!("the budget of 100 triangles, {} over it", triangles - 100)));
    assert!(text("1000000").contains("the budget of 1,000,000 triangles, within it"));
    let plain = stdout(&OSP.run_in(folder.path(), ["info", "a.ron", "--json"]));
    assert!(!plain.contains("\"cost\""), "only on request");
}
