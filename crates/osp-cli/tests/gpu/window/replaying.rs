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
