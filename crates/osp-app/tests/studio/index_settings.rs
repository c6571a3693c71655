//! The settings of the index in the culling panel.

use crate::panel::{Person, Window, replay};
use egui::{Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use osp_app::Command;
use osp_rivals::{CutNodes, IndexKind, IndexSetting, IndexSettings};

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
fn the_panel_has_the_settings_of_the_index_and_no_others() {
    let mut harness = with_index(IndexKind::Osp);
    for &kind in IndexKind::ALL {
        harness.command(Command::Index(kind));
        for setting in IndexSetting::ALL {
            let role = if setting == IndexSetting::CutNodes { Role::ComboBox } else { Role::Slider };
            let is_there = harness.query_by_role_and_label(role, setting.name()).is_some();
            assert_eq!(is_there, kind.has(setting), "{} of {}", setting.name(), kind.name());
        }
        let has_any = IndexSetting::ALL.into_iter().any(|setting| kind.has(setting));
        assert_eq!(
            harness.query_by_role_and_label(Role::Button, "Apply").is_some(),
            has_any,
            "{}",
            kind.name()
        );
    }
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

#[test]
fn each_slider_sets_its_own_setting() {
    let usual = IndexSettings::default();
    for (kind, name, value, wanted) in [
        (IndexKind::OspPaper, "cube", 2.0, IndexSettings { cube: 2.0, ..usual }),
        (IndexKind::OspPaper, "depth", 9.0, IndexSettings { max_depth: Some(9), ..usual }),
        (IndexKind::BvhSah, "buckets", 5.0, IndexSettings { buckets: 5, ..usual }),
        (IndexKind::Lbvh, "morton-bits", 7.0, IndexSettings { morton_bits: 7, ..usual }),
    ] {
        let mut harness = with_index(kind);
        let drawn = harness.state().studio.report().drawn;
        slide(&mut harness, name, value);
        harness.click_button("Apply");
        assert_eq!(settings(&harness), wanted, "{name}");
        assert_eq!(harness.state().studio.report().drawn, drawn, "{name}");
    }
}
