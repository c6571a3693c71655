//! Figures and messages that two commands give of one thing are the same, and name what the user knows.

use std::fs;

use osp_session::brush::{self, Brush};

use super::exporting::painted;
use crate::OSP;
use osp_testkit::{stderr, stdout, temp};

#[test]
fn info_counts_the_polygons_that_are_drawn() {
    let folder = temp();
    let offered: Vec<&Brush> = brush::all().iter().filter(|brush| brush.is_offered).collect();
    let names: Vec<&str> = offered.iter().map(|brush| brush.name.as_str()).collect();
    let painted = painted(&names);
    // The last stroke is in a hidden layer. Hulls that grow around what they were need fewer polygons than before.
    let at = painted.rfind(",seed:3").expect("a stroke");
    let mut text = format!("{},hidden:true{}", &painted[..at], &painted[at..]);
    let round =
        (0..40).map(|i| (i as f32 * 0.7, i as f32 * 1.1)).map(|(a, b)| [a.cos() * b.sin(), a.sin(), b.cos()]);
    let around = [[-9.0, -9.0, -9.0], [9.0, -9.0, -9.0], [0.0, 9.0, -9.0], [0.0, 0.0, 30.0]];
    for (stroke, hidden) in [(900, ""), (901, ",hidden:true")] {
        let paint = format!("(brush:\"MatteHull\",seed:3{hidden})");
        text += &format!("Begin(t:0,stroke:{stroke},tool:Ribbon,width:0.01,color:(1,1,1,1),paint:{paint})\n");
        for [x, y, z] in round.clone().chain(around) {
            text += &format!("Point(t:0,stroke:{stroke},p:({x},{y},{z}))\n");
        }
        text += &format!("End(t:0,stroke:{stroke})\n");
    }
    fs::write(folder.path().join("a.ron"), text).expect("written");
    let exported = OSP.run_in(folder.path(), ["export", "a.ron", "a.glb"]);
    assert!(stderr(&exported).contains("strokes in hidden layers are not written: 2\n"), "{exported:?}");
    let info = OSP.json_in(folder.path(), ["info", "a.ron", "--json"]);
    let count = |key: &str| info[key].as_u64().expect("a count");
    let (drawn, hidden) = (count("polygons_visible_at_end"), count("polygons_hidden_at_end"));
    let rows = info["brushes"].as_array().expect("brushes").iter();
    let in_rows: u64 = rows.map(|row| row["polygons"].as_u64().expect("a count")).sum();
    assert!(hidden > 0 && count("polygons_without_area") > 0, "{info}");
    assert_eq!(in_rows, drawn + hidden);
    // The hidden hull has as many polygons without area, which are not counted.
    assert_eq!(count("polygons"), drawn + hidden + 2 * count("polygons_without_area"));
    let said = stdout(&exported).replace(',', "");
    assert!(said.contains(&format!(" {drawn} polygons ")), "{drawn}: {said}");
    let text = stdout(&OSP.run_in(folder.path(), ["info", "a.ron"])).replace(',', "");
    let without = count("polygons_without_area");
    let line =
        format!("({drawn} in the model at the end {hidden} hidden {without} without area are not drawn)");
    assert!(text.contains(&line), "{line}: {text}");
}

#[cfg(feature = "window")]
#[test]
fn a_window_makes_no_folder_for_a_session() {
    let folder = temp();
    for path in ["missing/a.ron", "missing/more/a.ron"] {
        let output = OSP.run_in(folder.path(), ["sketch", path, "--autosave", "autosaves"]);
        let missing = path.trim_end_matches("/a.ron");
        super::assert_refused(&output, &[path, &format!("the folder {missing} does not exist")]);
        assert!(!folder.path().join("missing").exists());
    }
}
