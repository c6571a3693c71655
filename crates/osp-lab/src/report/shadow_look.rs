//! A view of a model, with its occluders, and the polygons that a tree of shadow volumes hides in this view.

use crate::{
    oracle::{OracleConfig, Sight},
    shadows::{ShadowStep, ShadowSteps, ShadowView},
};
use osp::{occlusion::SelectConfig, polygon::PolygonId, view::View};
use osp_session::scene::Scene;

/// A view of a model: its occluders, and the polygons in view with their true visibility.
#[derive(Debug)]
pub struct ShadowLook<'a> {
    pub(super) scene: &'a Scene,
    pub view: ShadowView,
    pub(super) in_view: Vec<(PolygonId, Sight)>,
}

impl<'a> ShadowLook<'a> {
    /// Selects the occluders of a view, and determines the visible polygons by the oracle. `None` for a degenerate
    /// projection. O(polygons + pixels of the oracle).
    pub fn new(scene: &'a Scene, view: &View, select: SelectConfig, truth: OracleConfig) -> Option<Self> {
        let view = ShadowView::new(scene, view, select)?;
        Some(Self { scene, in_view: view.sights(scene, truth), view })
    }

    pub fn hidden(&self) -> usize {
        self.in_view.iter().filter(|(_, sight)| *sight == Sight::Hidden).count()
    }

    /// Reduces a tree to its first `planes` planes, and tests the polygons in view against it.
    pub fn panel(&self, steps: &ShadowSteps, planes: usize) -> ShadowPanel {
        let step = self.view.step(steps, planes);
        let culled = self.in_view.iter().map(|&(id, _)| step.hides(&self.scene.bounds(id))).collect();
        ShadowPanel { step, culled }
    }

    /// Counts the hidden and the visible polygons that a panel culls.
    pub fn counts(&self, panel: &ShadowPanel) -> ShadowCounts {
        let mut counts = ShadowCounts::default();
        for (&(_, sight), _) in self.in_view.iter().zip(&panel.culled).filter(|(_, culled)| **culled) {
            counts.hidden_culled += usize::from(sight == Sight::Hidden);
            counts.visible_culled += usize::from(sight == Sight::Visible);
        }
        counts
    }
}

/// A step of a tree, and the polygons that it hides.
#[derive(Clone, Debug)]
pub struct ShadowPanel {
    pub step: ShadowStep,
    /// For each polygon in view, whether the tree hides its box.
    pub(super) culled: Vec<bool>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowCounts {
    /// Number of culled polygons that are truly hidden.
    pub hidden_culled: usize,
    /// Number of culled polygons that are visible, by mistake.
    pub visible_culled: usize,
}
