//! Layers are named, hidden, locked, drawn on, and stored in the session's file.

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::kittest::Queryable;
use osp::glam::Vec3;
use osp_app::{Altering, Button, Command, Held, LayerEdit, LayerRow, Placing, ToolChoice};
use osp_session::recording::{GroupId, StrokeId, Tool};

use crate::{
    drawing::{Table, across},
    panel::{Person, across as line, drag, sketch},
    tracker::hear,
};

fn layer(table: &mut Table, edit: LayerEdit) {
    table.act([Command::Layer(edit)]);
}

fn draw(table: &mut Table, y: f32) -> StrokeId {
    table.studio.command(Command::Tool(ToolChoice::Draw(Tool::Ribbon)));
    table.drag(Button::Primary, &across(y));
    let last = table.studio.scene().strokes().iter().filter_map(|stroke| stroke.id()).max();
    last.expect("a stroke")
}

fn layer_of(table: &Table, stroke: StrokeId) -> u32 {
    table.studio.scene().stroke(stroke).expect("a stroke").layer()
}

fn row(layer: u32, name: &str, is_hidden: bool, is_locked: bool) -> LayerRow {
    LayerRow { layer, name: name.to_owned(), is_hidden, is_locked, owner: None, is_closed: false }
}

#[test]
fn strokes_are_drawn_on_the_chosen_layer_and_brought_to_others() {
    let mut table = Table::new();
    assert_eq!(table.studio.session_layers(), [row(0, "layer 1", false, false)]);
    let first = draw(&mut table, 0.5);
    layer(&mut table, LayerEdit::New);
    let second = draw(&mut table, 0.0);
    assert_eq!((layer_of(&table, first), layer_of(&table, second)), (0, 1));
    // A copy stays on the layer of its original.
    table.studio.command(Command::Tool(ToolChoice::Select));
    table.click((0.0, 0.0), Held::default());
    layer(&mut table, LayerEdit::Choose(0));
    table.studio.command(Command::Alter(Altering::Scale(0.9)));
    let copy = table.studio.selection().strokes()[0];
    assert_ne!(copy, second);
    assert_eq!(layer_of(&table, copy), 1);
    layer(&mut table, LayerEdit::TakeSelection);
    assert_eq!(layer_of(&table, copy), 0);
    // So does the copy of a stroke that was moved to another layer.
    layer(&mut table, LayerEdit::Choose(1));
    layer(&mut table, LayerEdit::TakeSelection);
    layer(&mut table, LayerEdit::Choose(0));
    table.studio.command(Command::Duplicate);
    let duplicate = table.studio.selection().strokes()[0];
    assert_eq!(layer_of(&table, duplicate), 1);
    for undone in [duplicate, copy, copy] {
        assert_eq!(layer_of(&table, undone), 1);
        table.studio.command(Command::Undo);
        if undone == duplicate {
            continue;
        }
        break;
    }
    assert_eq!(layer_of(&table, copy), 0, "the last way to a layer is undone");
}

#[test]
fn a_hidden_layer_is_not_drawn_and_a_locked_one_is_left_alone() {
    let mut table = Table::new();
    let open = draw(&mut table, 0.5);
    layer(&mut table, LayerEdit::New);
    let kept = draw(&mut table, 0.0);
    let all = table.visible();
    layer(&mut table, LayerEdit::ToggleHidden);
    assert!(table.visible() < all && table.visible() > 0);
    // Nothing is drawn unseen on a hidden layer.
    let strokes = table.studio.scene().strokes().len();
    draw(&mut table, -0.5);
    assert_eq!(table.studio.scene().strokes().len(), strokes);
    assert!(table.studio.messages().last().expect("a message").contains("layer 2 is hidden"));
    layer(&mut table, LayerEdit::ToggleHidden);
    assert_eq!(table.visible(), all);
    table.studio.command(Command::SelectAll);
    assert_eq!(table.studio.selection().strokes(), [open, kept]);
    layer(&mut table, LayerEdit::ToggleLocked);
    assert_eq!(table.studio.selection().strokes(), [open], "what is locked is not selected any more");
    table.studio.command(Command::SelectAll);
    assert_eq!(table.studio.selection().strokes(), [open]);
    table.studio.command(Command::Tool(ToolChoice::Select));
    table.click((0.0, 0.0), Held::default());
    assert!(table.studio.selection().is_empty());
    table.studio.command(Command::Tool(ToolChoice::Erase));
    table.drag(Button::Primary, &[(0.0, 0.7), (0.0, -0.2)]);
    assert!(table.studio.scene().stroke(kept).expect("a stroke").is_visible());
    assert!(!table.studio.scene().stroke(open).expect("a stroke").is_visible());
    layer(&mut table, LayerEdit::Lock(1, false));
    table.drag(Button::Primary, &[(0.0, 0.2), (0.0, -0.2)]);
    assert_eq!(table.visible(), 0);
}

#[test]
fn layers_are_there_when_the_session_is_opened_again() {
    let mut table = Table::new();
    draw(&mut table, 0.5);
    layer(&mut table, LayerEdit::New);
    draw(&mut table, 0.0);
    layer(&mut table, LayerEdit::Name(1, "sky".to_owned()));
    layer(&mut table, LayerEdit::ToggleHidden);
    layer(&mut table, LayerEdit::Lock(0, true));
    let rows = table.studio.session_layers();
    assert_eq!(rows, [row(0, "layer 1", false, true), row(1, "sky", true, false)]);
    let visible = table.visible();
    let path = table.folder.path().join("mine.ron");
    table.act([Command::SaveAs(path.clone()), Command::New]);
    assert_eq!(table.studio.session_layers().len(), 1);
    table.studio.command(Command::Open(path));
    let document = table.studio.session();
    assert!(!document.is_read_only());
    assert_eq!((table.studio.session_layers(), table.visible()), (rows, visible));
}

#[test]
fn the_list_and_the_keys_do_it_too() {
    let mut harness = sketch();
    drag(&mut harness, &line());
    let both = Modifiers::COMMAND | Modifiers::SHIFT;
    harness.press_with(both, Key::N);
    let rows =
        |harness: &egui_kittest::Harness<'_, crate::panel::Window>| harness.state().studio.session_layers();
    assert_eq!(rows(&harness).len(), 2);
    assert_eq!(harness.state().studio.chosen_layer(), 1);
    harness.get_by_label("Layers (2)").click();
    harness.run_steps(10);
    harness.click_button("hide layer 1");
    assert!(rows(&harness)[0].is_hidden && !rows(&harness)[1].is_hidden);
    harness.click_button("show layer 1");
    harness.click_button("lock layer 2");
    assert!(rows(&harness)[1].is_locked && !rows(&harness)[0].is_hidden);
    harness.press_with(both, Key::L);
    harness.press_with(both, Key::H);
    assert!(!rows(&harness)[1].is_locked && rows(&harness)[1].is_hidden);
    harness.click_on("layer 1");
    assert_eq!(harness.state().studio.chosen_layer(), 0);
    harness.get_by_role_and_label(Role::TextInput, "name of the layer").focus();
    harness.run_steps(2);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.get_by_role_and_label(Role::TextInput, "name of the layer").type_text("ground");
    harness.run_steps(2);
    harness.press(Key::Enter);
    assert_eq!(rows(&harness)[0].name, "ground");
    harness.press_with(Modifiers::COMMAND, Key::A);
    harness.state_mut().studio.command(Command::Layer(LayerEdit::Choose(1)));
    harness.press_with(Modifiers::COMMAND, Key::L);
    assert_eq!(harness.state().studio.scene().counts().visible, 0, "on the hidden layer");
}

#[test]
fn what_comes_from_a_closed_layer_is_pasted_on_the_one_that_is_drawn_on() {
    let mut table = Table::new();
    let stroke = draw(&mut table, 0.5);
    table.act([Command::SelectAll, Command::Copy]);
    layer(&mut table, LayerEdit::New);
    layer(&mut table, LayerEdit::Lock(0, true));
    table.studio.command(Command::Paste);
    let copy = *table.studio.selection().strokes().first().expect("what was pasted is selected");
    assert_ne!(copy, stroke);
    assert_eq!(layer_of(&table, copy), 1);
    // If no layer is open, nothing is pasted, and a message gives the reason.
    layer(&mut table, LayerEdit::Lock(1, true));
    let visible = table.visible();
    table.studio.command(Command::Paste);
    assert_eq!(table.visible(), visible);
    assert!(table.studio.messages().last().expect("a message").contains("layer 2 is locked"));
}

#[test]
fn a_group_with_strokes_of_a_locked_layer_stays_where_it_is() {
    let mut table = Table::new();
    let loose = draw(&mut table, 0.5);
    layer(&mut table, LayerEdit::New);
    draw(&mut table, 0.0);
    table.act([Command::SelectAll, Command::GroupSelected]);
    let group = table.studio.scene().free_groups().next().map_or(0, |group| group.0 - 1);
    let bounds = |table: &Table| {
        let scene = table.studio.scene();
        scene.bounds(scene.stroke(loose).expect("a stroke").polygon_ids().next().expect("polygons"))
    };
    let before = bounds(&table);
    layer(&mut table, LayerEdit::Lock(1, true));
    let up = Placing { by: Vec3::Y, ..Placing::STAY };
    table.act([Command::PlaceGroup(GroupId(group), up)]);
    assert_eq!(bounds(&table), before);
    assert!(table.studio.messages().last().expect("a message").contains("locked layer"));
    layer(&mut table, LayerEdit::Lock(1, false));
    table.act([Command::PlaceGroup(GroupId(group), up)]);
    assert_ne!(bounds(&table), before);
}

#[test]
fn what_a_tracker_draws_is_kept_on_a_hidden_layer() {
    let mut table = Table::new();
    layer(&mut table, LayerEdit::ToggleHidden);
    let stroke = "hand 0 0 0 0 0 0 1 1\nhand 0.1 0 0 0 0 0 1 1\nhand 0.1 0 0 0 0 0 1 0\n";
    hear(&mut table.studio, stroke, 3);
    table.frame();
    assert_eq!(table.studio.scene().strokes().len(), 1);
    let messages = table.studio.messages();
    assert!(
        messages.iter().any(|said| said.contains("layer 1 is hidden; the tracker can still draw")),
        "{messages:?}"
    );
}
