//! Escape cancels the stroke, the erasure or the movement of the pointer.

use osp::glam::Vec2;
use osp_app::{Aids, Button, Command, Held, Input, ToolChoice};
use osp_session::recording::Tool;

use crate::drawing::ribbons;

#[test]
fn escape_takes_back_the_stroke_under_the_hand() {
    let (mut table, strokes) = ribbons(&[0.3]);
    let (polygons, events) = (table.visible(), table.studio.session().event_count());
    // A freehand stroke, the half of a line, an erasure, and a movement of the selection.
    for (tool, is_straight) in [
        (ToolChoice::Draw(Tool::Ribbon), false),
        (ToolChoice::Draw(Tool::Ribbon), true),
        (ToolChoice::Draw(Tool::Wall), false),
        (ToolChoice::Erase, false),
        (ToolChoice::Select, false),
    ] {
        table.studio.command(Command::Tool(tool));
        let aids = table.studio.aids();
        table.studio.command(Command::Aids(Aids { straight: is_straight, ..aids }));
        if tool == ToolChoice::Select {
            table.click((0.0, 0.3), Held::default());
            assert_eq!(table.studio.selection().strokes(), strokes);
        }
        table.input(Input::Move(Vec2::new(0.0, 0.3)));
        table.input(Input::Press(Button::Primary));
        for i in 1..12 {
            table.input(Input::Move(Vec2::new(i as f32 * 0.03, 0.3 - i as f32 * 0.02)));
            table.frame();
        }
        assert!(table.studio.is_dragging() && table.studio.can(&Command::CancelGesture));
        table.act([Command::CancelGesture]);
        assert_eq!(
            (table.visible(), table.studio.is_dragging()),
            (polygons, false),
            "{tool:?} {is_straight}"
        );
        // The rest of the movement and the release do nothing.
        table.input(Input::Move(Vec2::new(0.5, 0.5)));
        table.input(Input::Release(Button::Primary));
        table.frame();
        assert_eq!(table.visible(), polygons, "{tool:?} {is_straight}");
        assert!(!table.studio.can(&Command::CancelGesture));
    }
    assert!(table.studio.session().event_count() > events);
    assert_eq!(table.studio.scene().strokes().iter().filter(|stroke| stroke.is_visible()).count(), 1);
}

#[test]
fn a_cancelled_stroke_comes_back_by_a_redo() {
    let (mut table, _) = ribbons(&[]);
    table.input(Input::Move(Vec2::new(-0.3, 0.0)));
    table.input(Input::Press(Button::Primary));
    for i in 1..12 {
        table.input(Input::Move(Vec2::new(-0.3 + i as f32 * 0.05, 0.0)));
        table.frame();
    }
    let drawn = table.visible();
    table.act([Command::CancelGesture]);
    assert!(drawn > 0 && table.visible() == 0);
    table.act([Command::Redo]);
    assert!(table.visible() >= drawn);
}
