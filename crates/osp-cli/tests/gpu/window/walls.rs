//! A rig's screens on monitors: a window without panels on each, and one to control them.

use super::desk::Desk;
use osp_testkit::{shipped_session, stdout};

const LEFT: &str =
    "lower_left: (-1.69706, 0.3, 0.0), lower_right: (0.0, 0.3, -1.69706), upper_left: (-1.69706, 2.1, 0.0)";
const RIGHT: &str =
    "lower_left: (0.0, 0.3, -1.69706), lower_right: (1.69706, 0.3, 0.0), upper_left: (0.0, 2.1, -1.69706)";

/// A dual wall with these outputs, in a file of the desk's.
fn rig(desk: &Desk, stereo: &str, left: &str, right: &str) -> String {
    let path = desk.folder().join("walls.ron");
    let text = format!(
        "(name: \"walls\", head: (0.0, 1.6, 0.0), stereo: {stereo}, screens: [\
         (name: \"left\", {LEFT}, outputs: [{left}]), (name: \"right\", {RIGHT}, outputs: [{right}])])"
    );
    std::fs::write(&path, text).expect("a file");
    path.to_str().expect("a path").to_owned()
}

fn greenest(pixels: &[[u8; 3]]) -> usize {
    pixels.iter().filter(|[r, g, b]| *g > 150 && *r < 130 && *b < 170).count()
}

fn most_magenta(pixels: &[[u8; 3]]) -> usize {
    pixels.iter().filter(|[r, g, b]| *r > 150 && *b > 130 && *g < 140).count()
}

/// Two screens side by side on one monitor, the left eye's pictures above the right eye's: each in its own quarter.
#[test]
fn viewports_of_one_monitor_show_screens_and_eyes() {
    let Some(desk) = Desk::new() else { return };
    let rig = rig(
        &desk,
        "TopBottom",
        "(monitor: \"1\", viewport: (0, 0, 0.5, 1))",
        "(monitor: \"1\", viewport: (0.5, 0, 0.5, 1))",
    );
    let mut window = desk.open(&["sketch", "--rig", &rig, "--window", "700x500"]);
    window.settle();
    // The switch of the test pattern, in the panel of the room.
    window.click(170, 439);
    window.settle();
    let walls = desk.windows("osp wall: ");
    let [([0, 0, 1400, 1000], title)] = &walls[..] else {
        panic!("a wall that covers the monitor: {walls:?}")
    };
    assert_eq!(title, "osp wall: left, right");
    // The control window hides a part of the only monitor: it is moved out of sight.
    window.move_away();
    window.draw_again();
    desk.keep_picture("walls-one-monitor.png");
    for (x, y) in [(0, 0), (700, 0), (0, 500), (700, 500)] {
        let pixels = desk.picture([x, y, 700, 500]);
        let (green, magenta) = (greenest(&pixels), most_magenta(&pixels));
        let (own, other) = if y == 0 { (green, magenta) } else { (magenta, green) };
        assert!(own > 1500 && other < own / 20, "at {x}, {y}: {green} green, {magenta} magenta");
    }
    assert!(window.close().success());
}

#[test]
fn a_dual_wall_on_two_monitors() {
    let Some(desk) = Desk::with_three_monitors() else { return };
    let listed = desk.osp(&["rig", "monitors"]);
    let listed = stdout(&listed);
    assert_eq!(
        listed.lines().collect::<Vec<_>>(),
        ["1 `DUMMY0` (1280x720 at 0,0)", "2 `DUMMY1` (800x600 at 1280,0)", "3 `DUMMY2` (800x600 at 2080,0)"]
    );
    let of_room = rig(&desk, "Mono", "(monitor: \"DUMMY1\")", "(monitor: \"3\")");
    let room = shipped_session("room");
    let mut window = desk.open(&[
        "replay",
        &room,
        "--window",
        "--rig",
        &of_room,
        "--camera",
        "inside",
        "--pace",
        "samples:64",
    ]);
    window.until_last("a part of the room", |frame| frame["polygons"].as_u64() > Some(3000));
    let walls = desk.windows("osp wall: ");
    assert_eq!(
        walls,
        [
            ([1280, 0, 800, 600], "osp wall: left".to_owned()),
            ([2080, 0, 800, 600], "osp wall: right".to_owned())
        ]
    );
    let control = desk.windows("room.ron (replay)");
    let [([x, _, width, _], _)] = &control[..] else { panic!("one control window: {control:?}") };
    assert!(*x + *width <= 1280 + 8, "it lies on the monitor that is left free: {control:?}");
    window.key("space");
    window.draw_again();
    desk.keep_picture("walls-two-monitors.png");
    let colors =
        |place: [i32; 4]| desk.picture(place).into_iter().collect::<std::collections::HashSet<_>>().len();
    let seen = [colors([1280, 0, 800, 600]), colors([2080, 0, 800, 600])];
    assert!(seen.iter().all(|&colors| colors > 50), "something is seen on both: {seen:?}");
    assert!(window.close().success());
}
