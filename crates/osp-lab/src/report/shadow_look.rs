//! One view of a model, and what a tree of shadow volumes finds hidden in it.

use crate::{
    oracle::{OracleConfig, Sight},
    shadows::{ShadowForm, ShadowStep, ShadowSteps, ShadowView},
};
use osp::{
    occlusion::{SelectConfig, ShadowVolume},
    polygon::PolygonId,
    view::View,
};
use osp_session::scene::Scene;

/// A view of a model: its occluders, and the polygons in it with the truth about them.
#[derive(Debug)]
pub struct ShadowLook<'a> {
    /// The polygons.
    pub(super) scene: &'a Scene,
    pub(super) view: ShadowView,
    pub(super) in_view: Vec<(PolygonId, Sight)>,
}

impl<'a> ShadowLook<'a> {
    /// Selects the occluders of a view and finds what is visible in it. `None` for a degenerate projection. O(polygons +
    /// pixels of the oracle).
    pub fn new(scene: &'a Scene, view: &View, select: SelectConfig, truth: OracleConfig) -> Option<Self> {
        let view = ShadowView::new(scene, view, select)?;
        Some(Self { scene, in_view: view.sights(scene, truth), view })
    }

    /// The occluders, best first, with the eye as the origin.
    pub fn occluders(&self) -> &[ShadowVolume] {
        self.view.occluders()
    }

    /// Share of the window that an occluder fills: its score.
    pub fn share(&self, occluder: &ShadowVolume) -> f64 {
        self.view.share(occluder)
    }

    /// The tree of these occluders.
    pub fn steps(&self, form: ShadowForm) -> ShadowSteps {
        self.view.steps(form)
    }

    /// The polygons that are truly hidden.
    pub fn hidden(&self) -> usize {
        self.in_view.iter().filter(|(_, sight)| *sight == Sight::Hidden).count()
    }

    /// A tree, cut to its first `planes` planes, and the polygons that it hides.
    pub fn panel(&self, steps: &ShadowSteps, planes: usize) -> ShadowPanel {
        let step = self.view.step(steps, planes);
        let culled = self.in_view.iter().map(|&(id, _)| step.hides(&self.scene.bounds(id))).collect();
        ShadowPanel { step, culled }
    }

    /// Counts of a panel.
    pub fn counts(&self, panel: &ShadowPanel) -> ShadowCounts {
        let mut counts = ShadowCounts::default();
        for (&(_, sight), _) in self.in_view.iter().zip(&panel.culled).filter(|(_, culled)| **culled) {
            counts.hidden_culled += usize::from(sight == Sight::Hidden);
            counts.visible_culled += usize::from(sight == Sight::Visible);
        }
        counts
    }
}

/// A step of a tree, and what it finds hidden.
#[derive(Clone, Debug)]
pub struct ShadowPanel {
    /// The step.
    pub step: ShadowStep,
    /// For each polygon in view: whether its box is hidden in the tree.
    pub(super) culled: Vec<bool>,
}

/// Counts of the polygons that a tree culls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowCounts {
    /// Truly hidden ones.
    pub hidden_culled: usize,
    /// Visible ones, by mistake.
    pub visible_culled: usize,
}
