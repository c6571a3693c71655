//! The settings of the index in the culling panel.

use crate::panel::{Person, Window, replay};
use egui::{Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use osp_app::Command;
use osp_rivals::{CutNodes, IndexKind, IndexSettings};

/// The finished model in an index, with the culling panel.
fn with_index(kind: IndexKind) -> Harness<'static, Window> {
    let mut harness = replay();
    harness.command(Command::Seek(u64::MAX));
    harness.command(Command::Index(kind));
    harness.press(Key::F2);
    harness
}

fn slide(harness: &mut Harness<'_, Window>, name: &str, value: f64) {
    harness.get_by_role_and_label(Role::Slider, name).set_value_accesskit(value);
    harness.run_steps(3);
}

fn settings(harness: &Harness<'_, Window>) -> IndexSettings {
    *harness.state().studio.culling().index_settings()
}

fn is_enabled(harness: &Harness<'_, Window>, name: &str) -> bool {
    !harness.get_by_role_and_label(Role::Button, name).accesskit_node().is_disabled()
}

#[test]
fn settings_take_effect_when_they_are_applied() {
    let mut harness = with_index(IndexKind::OctreePaper);
    let usual = settings(&harness);
    let drawn = |harness: &Harness<'_, Window>| harness.state().studio.report().drawn;
    let nodes = |harness: &Harness<'_, Window>| harness.state().studio.report().record.work.nodes;
    let (all, before) = (drawn(&harness), nodes(&harness));
    assert!(all > 0 && !is_enabled(&harness, "Apply") && !is_enabled(&harness, "Defaults"));
    slide(&mut harness, "leaf", 2.0);
    slide(&mut harness, "depth", 14.0);
    assert_eq!(settings(&harness), usual, "nothing is applied yet");
    assert_eq!(nodes(&harness), before);
    harness.click_button("Apply");
    let smaller = IndexSettings { leaf_capacity: Some(2), max_depth: Some(14), ..usual };
    assert_eq!(settings(&harness), smaller);
    assert!(!is_enabled(&harness, "Apply"));
    let said = harness.state().studio.messages().last().expect("a message");
    assert!(said.starts_with("octree-paper: ") && said.contains(" polygons inserted in "), "{said}");
    assert!(nodes(&harness) > before, "smaller leaves are more nodes: {} {before}", nodes(&harness));
    assert_eq!(drawn(&harness), all);

    // Nodes that the view cuts are drawn as a whole.
    harness.get_by_role_and_label(Role::ComboBox, "cut-nodes").click();
    harness.run_steps(3);
    harness.click_button("drawn");
    harness.click_button("Apply");
    assert_eq!(settings(&harness), IndexSettings { cut_nodes: CutNodes::Drawn, ..smaller });
    assert!(drawn(&harness) >= all);

    // The settings are kept if the index changes. An index ignores the settings of other indexes.
    harness.command(Command::Index(IndexKind::KdTree));
    assert_eq!(
        harness.get_by_role_and_label(Role::Slider, "leaf").accesskit_node().numeric_value(),
        Some(2.0)
    );
    harness.click_button("Defaults");
    harness.click_button("Apply");
    assert_eq!(settings(&harness), usual);
    assert_eq!(
        harness.get_by_role_and_label(Role::Slider, "leaf").accesskit_node().numeric_value(),
        Some(64.0)
    );
    assert_eq!(drawn(&harness), all);
}
