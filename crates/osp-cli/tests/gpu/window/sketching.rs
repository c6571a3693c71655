use super::desk::Desk;
use crate::OSP;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{self, OpenOptions},
    scene::Scene,
};
use osp_testkit::{ROOT, stderr, wait_until};

/// The model's part of a window of 1280 by 800 lies between the panels.
const MIDDLE: (i32, i32) = (590, 380);

/// Places from left to right through the middle, `rise` pixels up on the way.
fn line(rise: i32, count: i32) -> Vec<(i32, i32)> {
    (0..=count).map(|i| (MIDDLE.0 - 150 + 300 * i / count, MIDDLE.1 + 60 - rise * i / count)).collect()
}

fn scene_of(path: &std::path::Path) -> Scene {
    let mut scene = Scene::new();
    for event in recording::open(path, &OpenOptions::default()).expect("a recording") {
        scene.apply(&event.expect("an event"), &mut Vec::new());
    }
    scene
}

#[test]
fn a_session_from_the_first_stroke_to_the_last_click() {
    let Some(desk) = Desk::new() else { return };
    let file = desk.folder().join("first.ron");
    let mut window = desk.open(&["sketch", file.to_str().expect("a path"), "--window", "1280x800"]);
    assert_eq!(window.number("polygons"), 0);
    assert!(!file.exists(), "nothing is written before something is drawn");
    let (before, width, _) = window.picture();

    // Drag, and there is a stroke: polygons in the model and pixels on the screen.
    window.drag(1, &line(120, 24));
    window.until_last("a stroke", |frame| frame["polygons"].as_u64() > Some(8));
    window.settle();
    let drawn = window.number("polygons");
    let changed = |a: &[[u8; 3]], b: &[[u8; 3]]| {
        let differ = |x: usize, y: usize| a[y * width + x] != b[y * width + x];
        (250..900).flat_map(|x| (150..600).map(move |y| (x, y))).filter(|&(x, y)| differ(x, y)).count()
    };
    let (after, ..) = window.picture();
    assert!(changed(&before, &after) > 1500, "{} pixels changed", changed(&before, &after));

    // What the hand did between two frames is in the frame that follows: no frame has samples that it does not show.
    let late = window.frames().windows(2).filter(|pair| {
        let inserted = |frame: &serde_json::Value| frame["inserted"].as_u64() > Some(0);
        // The first two samples of a stroke make no polygon yet.
        pair[1]["samples"].as_u64() > Some(2) && !inserted(&pair[1])
    });
    assert_eq!(late.count(), 0, "every frame shows the samples that came before it");

    // Undo and redo.
    window.key("ctrl+z");
    window.until_last("undo", |frame| frame["polygons"] == 0);
    window.key("ctrl+y");
    window.until_last("redo", |frame| frame["polygons"] == drawn);

    // A second stroke with the tube, then erase the first by touching it.
    window.key("3");
    window.until_last("the tube", |frame| frame["tool"] == "tube");
    window.drag(1, &[(500, 250), (530, 240), (560, 235), (600, 238), (640, 250)]);
    window.until_last("a tube", |frame| frame["strokes"] == 2 && frame["polygons"].as_u64() > Some(drawn));
    window.settle();
    let both = window.number("polygons");
    window.key("x");
    window.click(MIDDLE.0, MIDDLE.1);
    window.until_last("the first stroke erased", |frame| frame["polygons"] == both - drawn);

    // Other indexes hold the same, and so does another way to find what is hidden.
    assert_eq!(window.last()["index"], "osp");
    let shown = window.number("drawn");
    let kinds = IndexKind::ALL;
    let after = kinds.iter().position(|kind| *kind == IndexKind::Osp).expect("a kind") + 1;
    for next in [kinds[after], kinds[after + 1]] {
        window.key("i");
        let name = next.name();
        window.until_last(name, |frame| frame["index"] == name && frame["drawn"] == shown);
    }
    let before = window.last()["occlusion"].clone();
    window.key("o");
    window.until_last("another occlusion", |frame| frame["occlusion"] != before && frame["drawn"] == shown);

    // Freeze the culling camera, turn away: as much is drawn as before.
    window.key("c");
    window.until_last("a frozen camera", |frame| frame["frozen"] == true);
    let visible = window.number("visible");
    window.drag(3, &[(590, 380), (700, 380), (800, 380), (860, 380)]);
    window.until_last("a frame after turning", |frame| frame["frozen"] == true);
    assert_eq!(window.number("visible"), visible);
    window.key("c");
    window.until_last("a camera that follows", |frame| frame["frozen"] == false);

    // Smaller and larger.
    for (w, h) in [(700, 500), (1300, 900)] {
        window.resize(w, h);
        window.until_last("the new size", |frame| {
            frame["window"] == serde_json::json!([w, h]) && frame["shown"] == true
        });
    }

    // A picture and a copy, by their dialogs.
    let picture = desk.folder().join("picture.png");
    window.key("ctrl+p");
    window.settle();
    window.key("ctrl+a");
    window.write(picture.to_str().expect("a path"));
    window.key("Return");
    wait_until("a picture", || std::fs::read(&picture).is_ok_and(|bytes| bytes.starts_with(b"\x89PNG")));
    window.settle();
    let copy = desk.folder().join("copy.ron");
    window.key("ctrl+shift+s");
    window.settle();
    window.write(copy.to_str().expect("a path"));
    window.key("Return");
    window
        .until_last("the copy", |frame| frame["message"].as_str().is_some_and(|m| m.starts_with("saved as")));
    let polygons = window.number("polygons");
    assert!(window.close().success());
    for path in [&file, &copy] {
        assert_eq!(scene_of(path).counts().visible, polygons, "{}", path.display());
    }
}

#[test]
fn without_a_display_there_is_one_clear_line() {
    let autosaves = std::env::temp_dir().join("osp-no-display");
    let output = OSP
        .without_display_in(ROOT, ["sketch", "--autosave", autosaves.to_str().expect("a path")])
        .output()
        .expect("osp");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: no window can be opened") && said.lines().count() == 1, "{said}");
    assert!(!said.contains("os error at"), "a place in the window system's source: {said}");
}
