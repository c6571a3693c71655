use super::desk::{Desk, OspWindow};
use osp_testkit::shipped_session;

/// Stops a session that plays.
fn stop(window: &mut OspWindow<'_>) {
    window.key("space");
    window.until("a stop", |frames| {
        frames.len() > 1 && frames[frames.len() - 1]["position"] == frames[frames.len() - 2]["position"]
    });
}

#[test]
fn a_recording_is_played_stopped_and_entered_anywhere() {
    let Some(desk) = Desk::new() else { return };
    let recording = shipped_session("scribble");
    let mut window = desk.open(&["replay", &recording, "--window", "--paused"]);
    assert_eq!(window.number("position"), 0);
    window.point(590, 300);
    window.key("space");
    window.until_last("some frames played", |frame| frame["position"].as_u64() > Some(20));
    window.until_last("times of drawing", |frame| frame["drawings_measured"].as_u64() > Some(20));
    stop(&mut window);
    let (position, polygons) = (window.number("position"), window.number("polygons"));
    // Back and forth leads to the same model.
    window.key("comma");
    window.until_last("one frame back", |frame| frame["position"] == position - 1);
    window.key("period");
    window.until_last("one frame on", |frame| frame["position"] == position);
    assert_eq!(window.number("polygons"), polygons);
    assert!(window.close().success());
}

#[test]
fn a_frozen_camera_shows_what_is_left_out_and_why() {
    let Some(desk) = Desk::new() else { return };
    let recording = shipped_session("room");
    let args = ["replay", &recording, "--window", "--paused", "--pace=samples:64", "--occlusion=msvbsp"];
    let mut window = desk.open(&args);
    window.point(590, 300);
    window.key("space");
    window.until_last("some frames played", |frame| frame["position"].as_u64() > Some(40));
    stop(&mut window);
    // On to a moment at which the head looks at a wall with much behind it.
    for _ in 0..80 {
        if window.number("occluded") > 50 {
            break;
        }
        let position = window.number("position");
        window.key("period");
        window.until_last("a step", |frame| frame["position"] == position + 1);
    }
    window.settle();
    let (visible, occluded) = (window.number("visible"), window.number("occluded"));
    let drawn = window.number("drawn");
    assert_eq!(drawn, visible - occluded);
    assert!(occluded > 50, "{occluded} of {visible} hidden");
    window.key("c");
    window.until_last("a frozen camera", |frame| frame["frozen"] == true);
    // The eye goes where it sees everything; the culling stays.
    window.key("h");
    window.drag(3, &[(590, 300), (640, 290), (700, 280), (790, 265)]);
    window.settle();
    assert_eq!((window.number("visible"), window.number("occluded")), (visible, occluded));
    window.key("F2");
    window.settle();
    window.keep_picture("window.png");
    let (pixels, ..) = window.picture();
    let count =
        |is_so: fn([u32; 3]) -> bool| pixels.iter().filter(|pixel| is_so(pixel.map(u32::from))).count();
    let out_of_view = count(|[r, g, b]| r > 90 && r > 2 * g.max(b));
    assert!(out_of_view > 2000, "{out_of_view} red pixels");
    assert!(window.close().success());
}

#[test]
fn the_window_tells_what_is_found_while_drawing() {
    let Some(desk) = Desk::new() else { return };
    let recording = shipped_session("portrait");
    let args = ["replay", &recording, "--window", "--paused", "--pace=samples:1000", "--occlusion=hzb"];
    let mut window = desk.open(&args);
    window.point(590, 300);
    for position in 1..=6 {
        window.key("period");
        window.until_last("a step", |frame| frame["position"] == position);
    }
    window.settle();
    // The figures of a frame come back some frames later.
    window.point(600, 310);
    window.until_last("figures", |frame| {
        let of = |name: &str| frame["while_drawing"][name].as_u64();
        let (Some(in_view), Some(hidden), Some(drawn)) = (of("in_view"), of("hidden"), of("second_pass"))
        else {
            return false;
        };
        in_view > 1000 && in_view == hidden + drawn && of("groups_tested") == Some(in_view)
    });
    // The next way to find what is hidden does so, too.
    window.key("o");
    window.until_last("another way", |frame| frame["occlusion"] != "hzb");
    assert!(window.close().success());
}
