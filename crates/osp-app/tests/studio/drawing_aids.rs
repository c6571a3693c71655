//! A straight edge, a mirror, and a brush with the same width on the screen from any distance.

use crate::drawing::{Table, across};
use osp::{
    glam::{Vec2, Vec3},
    math::Aabb,
};
use osp_app::{Aids, Button, Command, Held, Input, ToolChoice};
use osp_session::recording::{StrokeId, Tool};

const SIZE_PX: Vec2 = Vec2::new(800.0, 600.0);

fn aids(table: &mut Table, aids: Aids) {
    table.studio.command(Command::Aids(aids));
}

fn strokes(table: &Table) -> Vec<StrokeId> {
    let strokes = table.studio.scene().strokes().iter().filter(|stroke| stroke.is_visible());
    strokes.filter_map(|stroke| stroke.id()).collect()
}

fn corners(table: &Table, stroke: StrokeId) -> Vec<Vec3> {
    let scene = table.studio.scene();
    let ids = scene.stroke(stroke).expect("a stroke").polygon_ids();
    ids.flat_map(|id| scene.polygon(id).vertices().to_vec()).collect()
}

fn bounds(table: &Table, stroke: StrokeId) -> Aabb {
    let corners = corners(table, stroke);
    let (min, max) = corners.iter().fold((Vec3::MAX, Vec3::MIN), |(min, max), p| (min.min(*p), max.max(*p)));
    Aabb { min, max }
}

/// A curved path from the left to the right.
const WANDERING: [(f32, f32); 5] = [(-0.5, 0.0), (-0.3, 0.4), (0.0, -0.3), (0.3, 0.5), (0.5, 0.0)];

#[test]
fn a_straight_stroke_is_a_line_between_its_ends_whatever_the_hand_does() {
    for (tool, is_held) in
        [(Tool::Ribbon, false), (Tool::Ribbon, true), (Tool::Tube, false), (Tool::Wall, false)]
    {
        let mut table = Table::new();
        table.studio.command(Command::Tool(ToolChoice::Draw(tool)));
        aids(&mut table, Aids { straight: !is_held, ..Aids::default() });
        let held = Held { shift: is_held, ..Held::default() };
        table.studio.input(Input::Move(Vec2::from(WANDERING[0])), held, SIZE_PX);
        table.studio.input(Input::Press(Button::Primary), held, SIZE_PX);
        for &at in &WANDERING[1..] {
            table.studio.input(Input::Move(Vec2::from(at)), held, SIZE_PX);
            table.frame();
            if tool != Tool::Wall {
                assert_eq!(table.visible(), 0, "nothing is drawn before the line is");
            }
        }
        table.studio.input(Input::Release(Button::Primary), held, SIZE_PX);
        table.frame();
        let drawn = strokes(&table);
        assert_eq!(drawn.len(), 1);
        let extent = bounds(&table, drawn[0]).extent();
        if tool == Tool::Wall {
            assert!(extent.y > 0.3, "a wall has no straight edge: {extent}");
            continue;
        }
        assert!(extent.x > 1.0 && extent.y < 0.06, "{tool:?}: {extent}");
        assert!(table.studio.scene().stroke(drawn[0]).expect("a stroke").point_count() > 10);
        table.studio.command(Command::Undo);
        assert_eq!(table.visible(), 0);
    }
}

#[test]
fn a_mirrored_stroke_is_two_and_one_step() {
    for straight in [false, true] {
        let mut table = Table::new();
        aids(&mut table, Aids { mirror_x: Some(0.2), straight, ..Aids::default() });
        let rising: Vec<(f32, f32)> = (0..20).map(|i| (0.2 + i as f32 * 0.03, i as f32 * 0.02)).collect();
        table.drag(Button::Primary, &rising);
        let drawn = strokes(&table);
        assert_eq!(drawn.len(), 2);
        let (left, right) = (corners(&table, drawn[0]), corners(&table, drawn[1]));
        assert_eq!(left.len(), right.len());
        for p in &left {
            let image = Vec3::new(0.4 - p.x, p.y, p.z);
            let nearest = right.iter().map(|q| q.distance(image)).fold(f32::MAX, f32::min);
            assert!(nearest < 1.0e-4, "{image}: {nearest}");
        }
        table.studio.command(Command::Undo);
        assert!(strokes(&table).is_empty(), "both at once");
        table.studio.command(Command::Redo);
        assert_eq!(strokes(&table), drawn);
        aids(&mut table, Aids::default());
        table.drag(Button::Primary, &across(-0.5));
        assert_eq!(strokes(&table).len(), 3);
        table.studio.command(Command::Undo);
        assert_eq!(strokes(&table), drawn);
        // The selection is mirrored on the mirror, too.
        aids(&mut table, Aids { mirror_x: Some(3.0), ..Aids::default() });
        table.studio.command(Command::SelectAll);
        let before = table.studio.selection_bounds();
        table.studio.command(Command::Alter(osp_app::Altering::Mirror));
        let after = table.studio.selection_bounds();
        assert!((after.min.x - (6.0 - before.max.x)).abs() < 1.0e-4, "{after:?} {before:?}");
    }
}

#[test]
fn a_brush_of_the_screen_is_finer_where_the_model_is_nearer() {
    let mut table = Table::new();
    table.frame();
    let width_px = table.studio.width_px();
    aids(&mut table, Aids { width_px: Some(width_px), ..Aids::default() });
    table.drag(Button::Primary, &across(0.0));
    for _ in 0..10 {
        table.studio.input(Input::Wheel(1.0), Held::default(), SIZE_PX);
    }
    table.frame();
    assert!((table.studio.width_px() - width_px).abs() < 0.01, "as many pixels as before");
    table.drag(Button::Primary, &across(0.5));
    let drawn = strokes(&table);
    // The view looks down a little, so a ribbon leans: this is its extent in all directions.
    let width = |stroke| {
        let extent = bounds(&table, stroke).extent();
        extent.y.hypot(extent.z)
    };
    let (far, near) = (width(drawn[0]), width(drawn[1]));
    assert!(near < far * 0.5, "{near} {far}");
    table.studio.command(Command::Widen(3.0));
    assert!(table.studio.aids().width_px.expect("pixels") > width_px * 1.3);
}
