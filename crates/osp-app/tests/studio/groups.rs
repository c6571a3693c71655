//! Groups made of a selection, named, selected, moved and placed, by commands and in the list.

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::kittest::Queryable;
use osp::{
    glam::{Quat, Vec3},
    math::Aabb,
};
use osp_app::{Button, Command, Placing, ToolChoice};
use osp_session::recording::{GroupId, StrokeId};

use crate::{
    drawing::{Table, ribbons},
    panel::{Person, drag, sketch},
};

fn bounds(table: &Table, stroke: StrokeId) -> Aabb {
    let scene = table.studio.scene();
    let ids = scene.stroke(stroke).expect("a stroke").polygon_ids();
    ids.map(|id| scene.bounds(id)).reduce(|a, b| a.union(&b)).expect("polygons")
}

fn tree(table: &mut Table) -> Vec<(Option<String>, usize, u64)> {
    table.studio.group_tree().into_iter().map(|node| (node.name, node.depth, node.strokes)).collect()
}

fn group(table: &mut Table, heights: &[f32]) {
    table.studio.command(Command::Tool(ToolChoice::Select));
    for (number, &y) in heights.iter().enumerate() {
        table.click((0.0, y), osp_app::Held { shift: number > 0, ..Default::default() });
    }
    table.studio.command(Command::GroupSelected);
}

#[test]
fn a_group_is_moved_by_one_event_and_undone_by_one_step() {
    let (mut table, ids) = ribbons(&[0.5, 0.0, -0.5]);
    group(&mut table, &[0.5, 0.0]);
    assert_eq!(tree(&mut table), [(Some("group 0".to_owned()), 0, 2)]);
    table.studio.command(Command::SelectGroup(GroupId(0)));
    assert_eq!(table.studio.selection().strokes(), &ids[..2]);
    assert_eq!(table.studio.selected_group(), Some(GroupId(0)));
    let before: Vec<Aabb> = ids.iter().map(|&id| bounds(&table, id)).collect();
    let at = table.studio.scene().group_transform(GroupId(0)).expect("a group").p;
    table.drag(Button::Primary, &[(0.0, 0.5), (0.1, 0.6), (0.2, 0.7)]);
    let way = table.studio.scene().group_transform(GroupId(0)).expect("a group").p - at;
    assert!(way.x > 0.0 && way.y > 0.0, "{way}: the group was placed");
    for (id, before) in ids.iter().zip(&before) {
        let moved = if *id == ids[2] { Vec3::ZERO } else { way };
        assert!((bounds(&table, *id).min - before.min).abs_diff_eq(moved, 1.0e-5), "{id:?}");
    }
    table.studio.command(Command::Undo);
    assert_eq!(bounds(&table, ids[0]), before[0]);
    assert_eq!(table.studio.scene().group_transform(GroupId(0)).expect("a group").p, at);
}

#[test]
fn whole_groups_go_into_a_new_one_and_parts_of_several_do_not() {
    let (mut table, ids) = ribbons(&[0.6, 0.3, 0.0, -0.3, -0.6]);
    group(&mut table, &[0.6, 0.3]);
    group(&mut table, &[0.0, -0.3]);
    // The selection takes a half of each group.
    group(&mut table, &[0.6, 0.0]);
    assert_eq!(table.studio.group_tree().len(), 2);
    assert!(table.studio.messages().last().expect("a message").contains("parts of several groups"));
    // The selection is the first group, moved, and the loose stroke.
    let by = Vec3::new(0.0, 0.01, 0.0);
    table.studio.command(Command::PlaceGroup(GroupId(0), Placing { by, ..Placing::STAY }));
    let before: Vec<Aabb> = ids.iter().map(|&id| bounds(&table, id)).collect();
    group(&mut table, &[0.6, 0.3, -0.6]);
    assert_eq!(
        tree(&mut table),
        [
            (Some("group 1".to_owned()), 0, 2),
            (Some("group 2".to_owned()), 0, 3),
            (Some("group 0".to_owned()), 1, 2),
        ]
    );
    assert_eq!(table.studio.selected_group(), Some(GroupId(2)), "the outermost");
    let after: Vec<Aabb> = ids.iter().map(|&id| bounds(&table, id)).collect();
    assert_eq!(after, before, "nothing has moved");
}

#[test]
fn a_group_is_turned_and_scaled_about_its_middle() {
    let (mut table, ids) = ribbons(&[0.3, -0.3]);
    group(&mut table, &[0.3, -0.3]);
    let whole = |table: &Table| bounds(table, ids[0]).union(&bounds(table, ids[1]));
    let before = whole(&table);
    // The group is within another one that is also turned and moved.
    table.act([Command::SelectGroup(GroupId(0)), Command::GroupSelected]);
    let aside = Vec3::new(0.5, 0.0, 0.25);
    let placing = Placing { by: aside, turn_degrees: 90.0, ..Placing::STAY };
    table.studio.command(Command::PlaceGroup(GroupId(1), placing));
    let turned = whole(&table);
    assert!(turned.center().abs_diff_eq(before.center() + aside, 1.0e-3), "{turned:?} {before:?}");
    assert!((turned.extent().z - before.extent().x).abs() < 1.0e-3, "{turned:?} {before:?}");
    let by = Vec3::new(1.0, 0.0, 0.0);
    let placing = Placing { by, turn_degrees: 180.0, scale: 2.0, ..Placing::STAY };
    table.studio.command(Command::PlaceGroup(GroupId(0), placing));
    let large = whole(&table);
    // One metre along the turned parent's x.
    let way = osp::math::rotate(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2), by);
    assert!(large.center().abs_diff_eq(turned.center() + way, 1.0e-3), "{large:?} {turned:?}");
    assert!((large.extent() - turned.extent() * 2.0).abs().max_element() < 1.0e-2);
}

#[test]
fn the_panel_turns_a_group_about_the_axis_that_it_shows() {
    let mut harness = sketch();
    drag(&mut harness, &[(0.3, 0.4), (0.5, 0.45), (0.7, 0.4)]);
    harness.press_with(Modifiers::COMMAND, Key::A);
    harness.press_with(Modifiers::COMMAND, Key::G);
    harness.press(Key::Escape);
    harness.click_on("group 0");
    let mut enter = |field: &str, text: &str| {
        harness.get_by_role_and_label(Role::SpinButton, field).focus();
        harness.run_steps(2);
        harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        harness.get_by_role_and_label(Role::SpinButton, field).type_text(text);
        harness.run_steps(2);
        harness.press(Key::Enter);
    };
    for (field, text) in [("axis y", "0"), ("axis z", "1"), ("turn", "90")] {
        enter(field, text);
    }
    let scene = harness.state().studio.scene();
    let transform = scene.group_transform(GroupId(0)).expect("a group");
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!(transform.q.abs_diff_eq(Quat::from_xyzw(0.0, 0.0, half, half), 1.0e-3), "{transform:?}");
}

#[test]
fn the_list_makes_names_and_selects_groups() {
    let mut harness = sketch();
    drag(&mut harness, &[(0.3, 0.4), (0.5, 0.45), (0.7, 0.4)]);
    drag(&mut harness, &[(0.3, 0.6), (0.5, 0.65), (0.7, 0.6)]);
    harness.press_with(Modifiers::COMMAND, Key::A);
    harness.press_with(Modifiers::COMMAND, Key::G);
    harness.get_by_label("group 0");
    harness.press(Key::Escape);
    assert!(harness.query_by_role(Role::TextInput).is_none(), "no group is selected");
    harness.click_on("group 0");
    assert_eq!(harness.state().studio.selection().strokes().len(), 2);
    let name = harness.get_by_role_and_label(Role::TextInput, "name of the group");
    name.focus();
    harness.run_steps(2);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.get_by_role_and_label(Role::TextInput, "name of the group").type_text("bird");
    harness.run_steps(2);
    harness.press(Key::Enter);
    let names: Vec<_> = harness.state_mut().studio.group_tree().into_iter().map(|node| node.name).collect();
    assert_eq!(names, [Some("bird".to_owned())]);
    harness.get_by_label("bird");
    harness.press_with(Modifiers::COMMAND, Key::Z);
    harness.get_by_label("group 0");
}
