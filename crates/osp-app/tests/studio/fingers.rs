//! Fingers on a touch screen, in the form of the window system's events: the first finger is also the pointer.

use egui::{Event, Pos2, TouchDeviceId, TouchId, TouchPhase, Vec2};
use egui_kittest::Harness;
use osp::glam::Vec3;
use osp_app::{Command, ToolChoice};
use osp_session::recording::Tool;

use crate::panel::{Person, Window, button, sketch};

/// The point around which the camera of an empty sketch turns.
const TARGET: Vec3 = Vec3::new(0.0, 1.2, 0.0);
/// Number of frames after which a finger rests: each takes a quarter of a second of the harness's clock.
const RESTING: usize = 2;
const MIDDLE: Pos2 = Pos2::new(640.0, 430.0);

fn touch(harness: &Harness<'_, Window>, finger: u64, phase: TouchPhase, pos: Pos2) {
    let device_id = TouchDeviceId(1);
    harness.event(Event::Touch { device_id, id: TouchId(finger), phase, pos, force: None });
    // The first finger moves the pointer, too.
    if finger == 0 {
        let events = match phase {
            TouchPhase::Start => vec![Event::PointerMoved(pos), button(pos, true)],
            TouchPhase::Move => vec![Event::PointerMoved(pos)],
            TouchPhase::End => vec![button(pos, false), Event::PointerGone],
            TouchPhase::Cancel => vec![Event::PointerGone],
        };
        events.into_iter().for_each(|event| harness.event(event));
    }
}

fn touch_and_step(harness: &mut Harness<'_, Window>, finger: u64, phase: TouchPhase, pos: Pos2) {
    touch(harness, finger, phase, pos);
    harness.step();
}

/// Several fingers side by side come down one frame after the other, move and spread, and are lifted.
fn together(harness: &mut Harness<'_, Window>, fingers: u64, by: Vec2, apart: f32) {
    let place = |finger: u64, part: f32| {
        let side = finger as f32 - (fingers - 1) as f32 * 0.5;
        MIDDLE + by * part + Vec2::new(side * (80.0 + apart * part), 0.0)
    };
    for finger in 0..fingers {
        touch_and_step(harness, finger, TouchPhase::Start, place(finger, 0.0));
    }
    for step in 1..=10 {
        for finger in 0..fingers {
            touch(harness, finger, TouchPhase::Move, place(finger, step as f32 * 0.1));
        }
        harness.step();
    }
    for finger in (0..fingers).rev() {
        touch_and_step(harness, finger, TouchPhase::End, place(finger, 1.0));
    }
}

fn strokes(harness: &Harness<'_, Window>) -> usize {
    let scene = harness.state().studio.scene();
    scene.strokes().iter().filter(|stroke| stroke.is_visible()).count()
}

/// Returns the place of the eye and its direction.
fn eye(harness: &Harness<'_, Window>) -> (Vec3, Vec3) {
    let view = harness.state().studio.views()[0].view;
    (view.eye_in_world, view.world_from_view * Vec3::NEG_Z)
}

#[test]
fn a_finger_that_rests_uses_the_tool_and_a_tap_is_a_click() {
    let mut harness = sketch();
    let is_dragging = |harness: &Harness<'_, Window>| harness.state().studio.is_dragging();
    touch_and_step(&mut harness, 0, TouchPhase::Start, MIDDLE);
    assert!(!is_dragging(&harness), "it may be the first of several");
    assert!(harness.state().studio.next_frame_in().is_some(), "it is looked at again");
    harness.run_steps(RESTING);
    assert!(is_dragging(&harness));
    touch(&harness, 0, TouchPhase::Move, MIDDLE + Vec2::new(4.0, 0.0));
    touch_and_step(&mut harness, 0, TouchPhase::End, MIDDLE + Vec2::new(4.0, 0.0));
    assert_eq!(strokes(&harness), 1);
    // A tap selects.
    harness.state_mut().studio.command(Command::Tool(ToolChoice::Select));
    touch_and_step(&mut harness, 0, TouchPhase::Start, MIDDLE);
    touch_and_step(&mut harness, 0, TouchPhase::End, MIDDLE);
    assert_eq!(harness.state().studio.selection().strokes().len(), 1);
}

#[test]
fn two_fingers_turn_the_camera_and_draw_nothing() {
    let mut harness = sketch();
    let (from, to) = eye(&harness);
    together(&mut harness, 2, Vec2::new(150.0, 40.0), 0.0);
    let (turned, looks) = eye(&harness);
    assert_eq!(strokes(&harness), 0);
    assert!(looks.dot(to) < 0.95 && turned.distance(from) > 0.1, "{looks} {to}");
    // The camera turns around the centre of the view, so its distance stays.
    let far = from.distance(TARGET);
    assert!((turned.distance(TARGET) - far).abs() < 0.01 * far, "{turned} {from}");
    // The next finger draws again.
    together(&mut harness, 1, Vec2::new(200.0, 0.0), 0.0);
    assert_eq!(strokes(&harness), 1);
}

#[test]
fn fingers_that_go_apart_come_nearer_and_three_move_along() {
    let mut harness = sketch();
    let (from, to) = eye(&harness);
    together(&mut harness, 2, Vec2::ZERO, 80.0);
    let (near, looks) = eye(&harness);
    // Their distance doubled.
    assert!((near.distance(TARGET) / from.distance(TARGET) - 0.5).abs() < 0.02, "{near} {from}");
    assert!(looks.dot(to) > 0.999);
    together(&mut harness, 3, Vec2::new(0.0, 120.0), 0.0);
    let (moved, looks) = eye(&harness);
    assert!(looks.dot(to) > 0.999 && (moved - near).dot(to).abs() < 0.01, "{moved} {near}");
    assert!((moved - near).length() > 0.05);
    assert_eq!(strokes(&harness), 0);
}

#[test]
fn a_stroke_that_was_meant_stays_when_a_second_finger_comes_down() {
    let mut harness = sketch();
    touch_and_step(&mut harness, 0, TouchPhase::Start, MIDDLE);
    harness.run_steps(RESTING);
    touch_and_step(&mut harness, 0, TouchPhase::Move, MIDDLE + Vec2::new(60.0, 0.0));
    touch_and_step(&mut harness, 1, TouchPhase::Start, MIDDLE + Vec2::new(160.0, 0.0));
    touch(&harness, 1, TouchPhase::End, MIDDLE + Vec2::new(160.0, 0.0));
    touch_and_step(&mut harness, 0, TouchPhase::End, MIDDLE + Vec2::new(60.0, 0.0));
    assert_eq!(strokes(&harness), 1);
    together(&mut harness, 2, Vec2::new(0.0, 150.0), 0.0);
    assert_eq!(strokes(&harness), 1);
}

#[test]
fn turning_the_camera_is_no_edit() {
    let mut harness = sketch();
    for y in [-100.0, 0.0, 100.0] {
        together(&mut harness, 1, Vec2::new(200.0, y), 0.0);
    }
    [Command::Undo, Command::Undo].into_iter().for_each(|command| harness.command(command));
    for tool in [ToolChoice::Draw(Tool::Ribbon), ToolChoice::Erase, ToolChoice::Select] {
        harness.state_mut().studio.command(Command::Tool(tool));
        together(&mut harness, 2, Vec2::new(0.0, 30.0), 0.0);
        assert_eq!(strokes(&harness), 1, "{tool:?}");
    }
    // An undone edit can still be redone.
    [Command::Redo, Command::Redo].into_iter().for_each(|command| harness.command(command));
    assert_eq!(strokes(&harness), 3);
}

#[test]
fn a_finger_that_the_system_takes_away_ends_its_stroke() {
    let mut harness = sketch();
    touch(&harness, 0, TouchPhase::Start, MIDDLE);
    touch_and_step(&mut harness, 0, TouchPhase::Move, MIDDLE + Vec2::new(60.0, 0.0));
    assert!(harness.state().studio.is_dragging());
    touch_and_step(&mut harness, 0, TouchPhase::Cancel, MIDDLE + Vec2::new(60.0, 0.0));
    assert!(!harness.state().studio.is_dragging());
    assert_eq!(strokes(&harness), 1);
    // A finger that has not started anything leaves nothing.
    touch_and_step(&mut harness, 0, TouchPhase::Start, MIDDLE);
    touch_and_step(&mut harness, 0, TouchPhase::Cancel, MIDDLE);
    harness.run_steps(RESTING);
    assert_eq!(strokes(&harness), 1);
}

#[test]
fn the_hand_that_holds_a_pen_does_not_end_its_stroke() {
    let mut harness = sketch();
    for event in [Event::PointerMoved(MIDDLE), button(MIDDLE, true)] {
        harness.event(event);
        harness.step();
    }
    let before = eye(&harness);
    for (finger, phase) in [(5, TouchPhase::Start), (6, TouchPhase::Start), (5, TouchPhase::Move)] {
        touch_and_step(&mut harness, finger, phase, MIDDLE + Vec2::new(finger as f32 * 20.0, 90.0));
    }
    harness.event(Event::PointerMoved(MIDDLE + Vec2::new(80.0, 0.0)));
    harness.step();
    assert!(harness.state().studio.is_dragging());
    assert_eq!(eye(&harness), before);
    harness.event(button(MIDDLE, false));
    harness.step();
    assert_eq!(strokes(&harness), 1);
}
