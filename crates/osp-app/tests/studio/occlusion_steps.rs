//! Occlusion culling step by step, in the window.

use crate::panel::{Person, Window, window};
use egui::{Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use osp_app::{Command, Session, StepsEdit};
use osp_lab::shadows::ShadowForm;
use osp_session::{recording::Pace, replay::CameraChoice};

/// A square and a triangle before 66 tiles; the paper's rules lose a plane of the triangle.
fn vanish() -> Harness<'static, Window> {
    let path = std::path::Path::new(osp_testkit::ROOT).join("docs/figures/vanish.ron");
    let mut harness =
        window(|_| Session::to_play(&path, Pace::Recorded, CameraChoice::Auto).expect("a session"));
    harness.command(Command::ShowFinished);
    harness
}

fn says(harness: &Harness<'_, Window>, text: &str) -> bool {
    harness.query_all_by_label_contains(text).next().is_some()
}

/// The line on the step, and the number of polygons that it hides.
fn step(harness: &Harness<'_, Window>) -> (String, u64) {
    let steps = harness.state().studio.steps().expect("the steps are shown");
    (steps.line().expect("a step"), steps.counts().expect("counts").hidden)
}

#[test]
fn occlusion_is_shown_plane_by_plane() {
    let mut harness = vanish();
    let bare = harness.state().studio.lines().clone();
    harness.press(Key::F4);
    harness.command(Command::Steps(StepsEdit::Occluders(2)));
    assert!(says(&harness, "Occlusion, step by step"));
    assert!(
        says(&harness, "Plane 0 of 9: the window is one cell, and nothing is hidden"),
        "{:?}",
        step(&harness)
    );
    let is_enabled = |harness: &Harness<'_, Window>, name: &str| {
        !harness.get_by_role_and_label(Role::Button, name).accesskit_node().is_disabled()
    };
    assert!(!is_enabled(&harness, "Back") && is_enabled(&harness, "Next"));
    // Two outlines, of no shadow and no plane.
    let faces = |harness: &Harness<'_, Window>| {
        harness.state().studio.lines().triangle_count() - bare.triangle_count()
    };
    assert_eq!(faces(&harness), 0);
    harness.click_button("Next");
    assert!(says(&harness, "Plane 1 of 9: side "), "{:?}", step(&harness));
    assert!(says(&harness, " of the window, splits the window"), "{:?}", step(&harness));
    assert_eq!(faces(&harness), 1, "the plane");
    assert!(says(&harness, "tree of 1 planes, 1 levels"));
    let mut hidden = vec![0, step(&harness).1];
    for plane in 2..=9 {
        harness.press(Key::N);
        let (line, hides) = step(&harness);
        assert!(line.starts_with(&format!("Plane {plane} of 9: ")) && says(&harness, &line), "{line}");
        hidden.push(hides);
    }
    assert!(hidden.is_sorted() && hidden[9] == 15, "{hidden:?}");
    let counts = harness.state().studio.steps().and_then(|steps| steps.counts()).expect("counts");
    let in_view = counts.in_view;
    let first = hidden.iter().position(|&hides| hides > 0).expect("something is hidden");
    harness.press(Key::N);
    assert!(
        says(&harness, "Plane 9 of 9") && says(&harness, &format!("hides 15 of {in_view} polygons in view")),
        "{:?}",
        step(&harness)
    );
    assert!(!is_enabled(&harness, "Next"));
    assert!(faces(&harness) > 1, "the plane and the cells in shadow");
    harness.command(Command::Steps(StepsEdit::To(first)));
    assert!(says(&harness, &format!("{} of them by this plane", hidden[first])));
    harness.press(Key::P);
    assert_eq!(step(&harness).1, 0);
    assert!(says(&harness, &format!("hides 0 of {in_view} polygons in view, 0 of them by this plane")));

    // The printed form hides visible polygons, too.
    harness.get_by_role_and_label(Role::ComboBox, "form").click();
    harness.run_steps(3);
    harness.click_button("msvbsp-paper");
    harness.command(Command::Steps(StepsEdit::To(99)));
    assert!(says(&harness, "Plane 10 of 10: side "), "{:?}", step(&harness));
    assert_eq!(step(&harness).1, 30);
    assert!(
        says(&harness, &format!("hides 30 of {in_view} polygons in view"))
            && says(&harness, "15 visible polygons are wrongly culled")
    );
    assert_eq!(harness.state().studio.steps().map(|steps| steps.form()), Some(ShadowForm::Paper));
    harness.press(Key::F4);
    assert!(!says(&harness, "Occlusion, step by step") && harness.state().studio.steps().is_none());
    assert_eq!(faces(&harness), 0);
}
