//! Occlusion culling step by step, of the culling camera's first view.

use glam::Vec2;

use super::{Studio, on_screen::on_screen};
use crate::occlusion_steps::{OcclusionSteps, StepsEdit};

/// The name of an occluder in the model's part of the window. Positions are 0 to 1 from the left and the lower border.
#[derive(Clone, Debug, PartialEq)]
pub struct OccluderLabel {
    /// The occluder's name and score.
    pub text: String,
    /// Whether the step's tree contains a plane or the shadow of the occluder.
    pub is_taken: bool,
    /// Position of the occluder's middle.
    pub at: Vec2,
}

impl Studio {
    /// The steps, while they are shown.
    pub fn steps(&self) -> Option<&OcclusionSteps> {
        self.steps.as_ref()
    }

    /// The names of the steps' occluders on a window of this aspect ratio (width divided by height). Occluders outside
    /// the views have no label.
    pub fn occluder_labels(&self, aspect: f32) -> Vec<OccluderLabel> {
        let Some(steps) = &self.steps else { return Vec::new() };
        let mut views = self.views_of(aspect);
        // If two eyes share a part of the window, the names are shown only once.
        views.dedup_by_key(|view| (view.from, view.to));
        let mut labels = Vec::new();
        for occluder in steps.occluders() {
            for seen in &views {
                let Some((at, _)) = on_screen(&seen.view, occluder.middle) else { continue };
                labels.push(OccluderLabel {
                    text: occluder.text.clone(),
                    is_taken: occluder.is_taken,
                    at: seen.from + (seen.to - seen.from) * (at * 0.5 + 0.5),
                });
            }
        }
        labels
    }

    pub(crate) fn edit_steps(&mut self, edit: StepsEdit) {
        match edit {
            StepsEdit::Show(false) => self.steps = None,
            StepsEdit::Show(true) => _ = self.steps.get_or_insert_default(),
            edit => {
                if let Some(steps) = &mut self.steps {
                    steps.edit(edit, self.session.scene());
                }
            }
        }
    }

    /// Marks the steps as outdated, after a change of the model outside of [`Studio::frame`].
    pub(crate) fn forget_steps(&mut self) {
        if let Some(steps) = &mut self.steps {
            steps.forget();
        }
    }

    /// Computes the steps of the frame's view, if the view and the model have not changed.
    pub(super) fn follow_steps(&mut self) {
        let first = self.shown.views.first().map(|view| view.view);
        let frozen = self.frozen.as_ref().and_then(|frozen| frozen.first()).copied();
        if let (Some(steps), Some(view)) = (&mut self.steps, frozen.or(first)) {
            let score = self.culling.plan.score;
            steps.follow(self.session.scene(), &view, score, self.changes.is_empty());
        }
    }

    /// Whether a further frame is needed to compute or show the steps.
    pub(super) fn steps_wait(&self) -> bool {
        self.steps.as_ref().is_some_and(OcclusionSteps::waits)
    }
}
