//! A change of the selection is one step for undo, is stored in the session's file, and loses nothing on the way.

use osp_testkit::events::{SOLE, events_in, scene_of};
use std::path::Path;

use egui::{Event as UiEvent, Key, Modifiers};
use egui_kittest::Harness;
use osp::{glam::Vec3, math::Aabb, view::View};
use osp_app::{Altering, Button, Command, Held, Placing, ToolChoice};
use osp_session::{
    recording::{self, Event, GroupId, StrokeId},
    scene::Scene,
};

use crate::{
    drawing::{Table, across, ribbons},
    panel::{Person, Window, drag, sketch},
};

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];

fn select(table: &mut Table, heights: &[f32]) {
    table.act([Command::Tool(ToolChoice::Select), Command::SelectNone]);
    for (number, &y) in heights.iter().enumerate() {
        table.click((0.0, y), Held { shift: number > 0, ..Held::default() });
    }
    assert_eq!(table.studio.selection().strokes().len(), heights.len());
}

fn bounds_of(scene: &Scene, strokes: &[StrokeId]) -> Aabb {
    let ids = strokes.iter().flat_map(|&id| scene.stroke(id).expect("a stroke").polygon_ids());
    ids.fold(Aabb::EMPTY, |bounds, id| bounds.union(&scene.bounds(id)))
}

fn selected_bounds(table: &Table) -> Aabb {
    bounds_of(table.studio.scene(), table.studio.selection().strokes())
}

fn close(a: &Aabb, b: &Aabb) {
    assert!(a.min.abs_diff_eq(b.min, 1.0e-4) && a.max.abs_diff_eq(b.max, 1.0e-4), "{a:?} {b:?}");
}

fn path(table: &Table) -> &Path {
    table.studio.session().path()
}

fn replayed(events: &[Event]) -> Scene {
    let scene = scene_of(events);
    assert_eq!(scene.counts().ignored_events, 0);
    scene
}

/// A stroke's colour, polygons and box.
type Look = ((f32, f32, f32, f32), u32, Aabb);

/// Returns the visible strokes.
fn looks(scene: &Scene) -> Vec<Look> {
    let strokes = scene.strokes().iter().filter(|stroke| stroke.is_visible());
    let of = |stroke: &osp_session::scene::Stroke| {
        let id = stroke.id().expect("a number");
        (stroke.color(), stroke.polygon_count(), bounds_of(scene, &[id]))
    };
    strokes.map(of).collect()
}

fn on_screen(view: &View, p: Vec3) -> (f32, f32) {
    let p = view.clip_from_world().project_point3(p);
    (p.x, p.y)
}

fn steps_back(table: &mut Table) {
    table.act([Command::Undo]);
}

/// Alters the selection. Returns its bounds.
fn altered(table: &mut Table, how: Altering) -> Aabb {
    table.act([Command::Alter(how)]);
    selected_bounds(table)
}

#[test]
fn a_colour_is_given_in_one_step_and_undo_keeps_the_selection() {
    let (mut table, ids) = ribbons(&[0.5, 0.0, -0.5]);
    select(&mut table, &[0.5, 0.0]);
    let before = looks(table.studio.scene());
    table.act([Command::Color(RED), Command::Alter(Altering::Color)]);
    let after = looks(table.studio.scene());
    assert_eq!(after.iter().filter(|look| look.0 == (1.0, 0.0, 0.0, 1.0)).count(), 2);
    // Only the colour has changed, to the bit. The third stroke is unchanged.
    let shapes = |looks: &[Look]| {
        let mut shapes: Vec<String> = looks.iter().map(|(_, count, at)| format!("{count} {at:?}")).collect();
        shapes.sort();
        shapes
    };
    assert_eq!(shapes(&after), shapes(&before));
    let red = table.studio.selection().strokes().to_vec();
    assert!(red.len() == 2 && !red.contains(&ids[0]));
    steps_back(&mut table);
    assert_eq!(looks(table.studio.scene()), before);
    assert_eq!(table.studio.selection().strokes(), &ids[..2], "the strokes of before are selected again");
    table.studio.command(Command::Redo);
    assert_eq!(table.studio.selection().strokes(), red);
    assert_eq!(looks(table.studio.scene()), after);
}

#[test]
fn a_replay_shows_the_same_and_a_crash_on_the_way_loses_nothing() {
    let (mut table, _) = ribbons(&[0.5, 0.0]);
    select(&mut table, &[0.5, 0.0]);
    let drawn = events_in(path(&table)).len();
    table.act([Command::Alter(Altering::Turn(30.0)), Command::Alter(Altering::Scale(1.5))]);
    table.studio.command(Command::Duplicate);
    let all = events_in(path(&table));
    assert_eq!(looks(&replayed(&all)), looks(table.studio.scene()));
    for end in drawn..=all.len() {
        let mut scene = replayed(&all[..end]);
        let visible = scene.strokes().iter().filter(|stroke| stroke.is_visible()).count();
        assert!(visible >= 2, "after {end} events");
        // An unfinished step is undone at once.
        if scene.is_step_open() && !matches!(all[end - 1], Event::Step { .. }) {
            scene.apply(&SOLE.undo(), &mut Vec::new());
            let visible = scene.strokes().iter().filter(|stroke| stroke.is_visible()).count();
            assert_eq!(visible, 2, "after {end} events and an undo");
        }
    }
}

#[test]
fn a_session_that_ended_within_a_step_goes_on_beside_it() {
    let (mut table, _) = ribbons(&[0.5, 0.0]);
    select(&mut table, &[0.5, 0.0]);
    table.studio.command(Command::Alter(Altering::Turn(30.0)));
    let text = std::fs::read_to_string(path(&table)).expect("a file");
    let cut = text.find("Step(").expect("a step");
    let cut = cut + text[cut..].match_indices("End(").next().expect("the end of a copy").0;
    let other = table.folder.path().join("cut.ron");
    std::fs::write(&other, &text[..cut]).expect("written");
    table.studio.command(Command::Open(other.clone()));
    assert!(table.studio.session().path() == other);
    table.frame();
    let before = looks(table.studio.scene()).len();
    table.studio.command(Command::Tool(ToolChoice::Draw(recording::Tool::Ribbon)));
    table.drag(Button::Primary, &across(-0.8));
    assert_eq!(looks(table.studio.scene()).len(), before + 1);
    steps_back(&mut table);
    assert_eq!(looks(table.studio.scene()).len(), before, "the new stroke alone is undone");
}

#[test]
fn the_selection_is_turned_scaled_widened_and_mirrored_about_its_middle() {
    let (mut table, _) = ribbons(&[0.4, 0.1]);
    select(&mut table, &[0.4, 0.1]);
    let first = selected_bounds(&table);
    let middle = first.center();
    let turned = altered(&mut table, Altering::Turn(90.0));
    assert!((turned.extent().z - first.extent().x).abs() < 1.0e-3, "{turned:?} {first:?}");
    assert!(turned.center().abs_diff_eq(middle, 1.0e-3));
    steps_back(&mut table);
    close(&selected_bounds(&table), &first);
    let scaled = altered(&mut table, Altering::Scale(2.0));
    assert!(scaled.center().abs_diff_eq(middle, 1.0e-3));
    assert!(scaled.extent().abs_diff_eq(first.extent() * 2.0, 1.0e-3), "{scaled:?} {first:?}");
    steps_back(&mut table);
    table.studio.command(Command::Width(0.2));
    let wide = altered(&mut table, Altering::Width);
    assert!((wide.extent().y - first.extent().y - 0.16).abs() < 0.02, "{wide:?} {first:?}");
    steps_back(&mut table);
    // One stroke that rises to the right.
    table.studio.command(Command::Tool(ToolChoice::Draw(recording::Tool::Ribbon)));
    let rising: Vec<(f32, f32)> = (0..20).map(|i| (-0.5 + i as f32 * 0.05, -0.9 + i as f32 * 0.02)).collect();
    table.drag(Button::Primary, &rising);
    table.studio.command(Command::Tool(ToolChoice::Select));
    table.click(rising[9], Held::default());
    let before = selected_bounds(&table);
    let left_end = |table: &Table| {
        let scene = table.studio.scene();
        let ids = scene.stroke(table.studio.selection().strokes()[0]).expect("a stroke").polygon_ids();
        let left = ids.min_by(|a, b| scene.bounds(*a).min.x.total_cmp(&scene.bounds(*b).min.x));
        scene.bounds(left.expect("a polygon")).center().y
    };
    assert!(left_end(&table) < before.center().y);
    close(&altered(&mut table, Altering::Mirror), &before);
    assert!(left_end(&table) > before.center().y, "it falls to the right now");
}

#[test]
fn strokes_of_a_placed_group_stay_in_it_and_where_they_are() {
    let (mut table, ids) = ribbons(&[0.5, 0.2, -0.2]);
    select(&mut table, &[0.5, 0.2]);
    table.studio.command(Command::GroupSelected);
    let by = Vec3::new(0.1, 0.02, 0.05);
    let placing = Placing { by, turn_degrees: 20.0, scale: 0.8, ..Placing::STAY };
    table.studio.command(Command::PlaceGroup(GroupId(0), placing));
    let before = bounds_of(table.studio.scene(), &ids[..1]);
    let other = bounds_of(table.studio.scene(), &ids[1..2]);
    table.act([Command::SelectNone, Command::SelectGroup(GroupId(0)), Command::Color(RED)]);
    table.studio.command(Command::Alter(Altering::Color));
    let copies = table.studio.selection().strokes().to_vec();
    let scene = table.studio.scene();
    close(&bounds_of(scene, &copies[..1]), &before);
    close(&bounds_of(scene, &copies[1..]), &other);
    assert_eq!(table.studio.selected_group(), Some(GroupId(0)), "the group is whole");
    // A whole group is scaled by placing it. It also scales about its middle.
    let whole = selected_bounds(&table);
    let lines = events_in(path(&table)).len();
    let scaled = altered(&mut table, Altering::Scale(2.0));
    assert_eq!(events_in(path(&table)).len(), lines + 1);
    assert!(scaled.center().abs_diff_eq(whole.center(), 1.0e-3));
    assert!(scaled.extent().abs_diff_eq(whole.extent() * 2.0, 1.0e-3), "{scaled:?} {whole:?}");
    // A part of the group is scaled by copies, which stay in the group.
    let before = bounds_of(table.studio.scene(), &copies[..1]);
    let group = table.studio.scene().groups_of(table.studio.scene().stroke(copies[0]).expect("a stroke"));
    table.studio.command(Command::SelectNone);
    let view = table.studio.views()[0].view;
    table.click(on_screen(&view, before.center()), Held::default());
    assert_eq!(table.studio.selection().strokes(), &copies[..1]);
    let half = altered(&mut table, Altering::Scale(0.5));
    assert!(half.extent().abs_diff_eq(before.extent() * 0.5, 1.0e-3), "{half:?} {before:?}");
    let scene = table.studio.scene();
    let copy = scene.stroke(table.studio.selection().strokes()[0]).expect("a stroke");
    assert_eq!(scene.groups_of(copy), group);
}

#[test]
fn a_group_is_duplicated_with_its_name_and_undone_in_one_step() {
    let (mut table, _) = ribbons(&[0.5, 0.2]);
    select(&mut table, &[0.5, 0.2]);
    table.act([Command::GroupSelected, Command::NameGroup(GroupId(0), "bird".to_owned())]);
    table.studio.command(Command::SelectGroup(GroupId(0)));
    let before = selected_bounds(&table);
    table.studio.command(Command::Duplicate);
    let names = table.studio.group_tree().into_iter().map(|node| (node.id, node.name, node.strokes));
    assert!(names.eq([0, 1].map(|id| (GroupId(id), Some("bird".to_owned()), 2))));
    assert_eq!(table.studio.selected_group(), Some(GroupId(1)), "the copy is selected");
    let after = selected_bounds(&table);
    assert!(after.extent().abs_diff_eq(before.extent(), 1.0e-4));
    assert!(after.min.distance(before.min) > 0.01, "beside it");
    steps_back(&mut table);
    assert_eq!(looks(table.studio.scene()).len(), 2);
}

#[test]
fn what_was_copied_is_pasted_after_it_was_erased() {
    let (mut table, _) = ribbons(&[0.5, 0.2]);
    select(&mut table, &[0.5, 0.2]);
    let before = looks(table.studio.scene());
    assert!(!table.studio.can(&Command::Paste));
    table.studio.command(Command::Cut);
    assert_eq!(table.visible(), 0);
    table.act([Command::Paste, Command::Paste]);
    assert_eq!(looks(table.studio.scene()).len(), 4);
    assert_eq!(table.studio.selection().strokes().len(), 2);
    (0..3).for_each(|_| steps_back(&mut table));
    assert_eq!(looks(table.studio.scene()), before, "three steps: two pastes and the cut");
    assert_eq!(looks(&replayed(&events_in(path(&table)))), before);
}

#[test]
fn the_ring_turns_and_its_knob_scales() {
    let (mut table, _) = ribbons(&[0.1, -0.1]);
    select(&mut table, &[0.1, -0.1]);
    table.frame();
    let before = selected_bounds(&table);
    let view = table.studio.views()[0].view;
    let at = |p: Vec3| on_screen(&view, p);
    let middle = at(before.center());
    let radius = before.extent().length() * 0.5;
    let [right, up] = [Vec3::X, Vec3::Y].map(|axis| osp::math::rotate(view.world_from_view, axis));
    let knob = before.center() + (right + up) * radius * std::f32::consts::FRAC_1_SQRT_2;
    let (x, y) = at(knob);
    let half = (middle.0 + (x - middle.0) * 0.5, middle.1 + (y - middle.1) * 0.5);
    table.drag(Button::Primary, &[(x, y), (x * 0.9, y * 0.9), half]);
    let small = selected_bounds(&table);
    assert!(small.extent().abs_diff_eq(before.extent() * 0.5, 0.02), "{small:?} {before:?}");
    steps_back(&mut table);
    close(&selected_bounds(&table), &before);
    // A quarter of a turn, from the right of the ring to its top.
    let [right, up] = [right, up].map(|way| at(before.center() + way * radius));
    table.drag(Button::Primary, &[right, (0.3, 0.3), up]);
    let turned = selected_bounds(&table);
    // The eye looks down a little, so the ring leans.
    let (high, wide) = (turned.extent().y, turned.extent().x);
    assert!((high - before.extent().x).abs() < 0.1 && wide < 0.5, "{turned:?} {before:?}");
    steps_back(&mut table);
    close(&selected_bounds(&table), &before);
}

#[test]
fn keys_and_the_clipboard_of_the_desktop_reach_all_of_it() {
    let mut harness = sketch();
    drag(&mut harness, &[(0.3, 0.4), (0.5, 0.45), (0.7, 0.4)]);
    let drawn = |harness: &Harness<'_, Window>| looks(harness.state().studio.scene());
    harness.press_with(Modifiers::COMMAND, Key::A);
    harness.press_with(Modifiers::COMMAND, Key::D);
    assert_eq!(drawn(&harness).len(), 2);
    for (events, count) in
        [(vec![UiEvent::Copy, UiEvent::Paste("strokes of osp".to_owned())], 3), (vec![UiEvent::Cut], 2)]
    {
        for event in events {
            harness.event(event);
            harness.run_steps(3);
        }
        assert_eq!(drawn(&harness).len(), count);
    }
    harness.press_with(Modifiers::COMMAND, Key::A);
    for key in [Key::PageUp, Key::PageDown, Key::L, Key::M, Key::OpenBracket, Key::CloseBracket] {
        let before = drawn(&harness);
        let is_alone = matches!(key, Key::PageUp | Key::PageDown | Key::L);
        harness.press_with(if is_alone { Modifiers::NONE } else { Modifiers::COMMAND }, key);
        assert_ne!(drawn(&harness), before, "{key:?}");
        harness.press_with(Modifiers::COMMAND, Key::Z);
        assert_eq!(drawn(&harness), before, "{key:?}");
        // The brush's width differs from theirs.
        harness.state_mut().studio.command(Command::Width(0.1));
    }
    // While strokes are selected with the select tool, a colour applies to them; else it applies only to the brush.
    let sky = |harness: &Harness<'_, Window>| {
        drawn(harness).iter().filter(|look| (look.0.2 * 255.0).round() == 214.0).count()
    };
    harness.click_on("colour 64 168 214");
    assert_eq!(sky(&harness), 0);
    harness.press(Key::K);
    assert_eq!(sky(&harness), 2, "asked for");
    harness.press_with(Modifiers::COMMAND, Key::Z);
    harness.press(Key::V);
    harness.click_on("colour 72 104 214");
    assert_eq!(sky(&harness), 2);
    harness.press_with(Modifiers::COMMAND, Key::Z);
    assert_eq!(sky(&harness), 0, "one step");
}

/// In a session of several authors the window draws with its own numbers, and replaces strokes of others that it
/// changes by copies. The session can be read again strictly, and is then the same as shown.
#[test]
fn what_others_have_drawn_is_altered_and_can_be_read_again() {
    let mut table = Table::new();
    let class = Path::new(osp_testkit::ROOT).join("recordings/class.ron");
    table.act([Command::Open(class)]);
    assert_eq!(table.studio.scene().authors().count(), 3);
    let before = looks(table.studio.scene()).len();
    assert!(before > 10);
    table.act([Command::SelectAll, Command::Color(RED), Command::Alter(Altering::Color)]);
    let shown = looks(table.studio.scene());
    assert!(shown.len() == before && shown.iter().all(|(color, ..)| *color == (1.0, 0.0, 0.0, 1.0)));
    table.act([Command::Duplicate, Command::GroupSelected]);
    let shown = looks(table.studio.scene());
    assert_eq!(shown.len(), 2 * before);
    let saved = table.folder.path().join("altered.ron");
    table.act([Command::SaveAs(saved.clone())]);
    assert_eq!(looks(&replayed(&events_in(&saved))).len(), 2 * before);
}
