//! A view of a model, with its occluders, and the polygons that a tree of shadow volumes hides in this view.

use super::shadow_structure::ShadowStructure;
use crate::{
    oracle::{Oracle, OracleConfig, Sight},
    verify::subjects,
};
use osp::{
    math::Containment,
    occlusion::{
        OccluderPool, OcclusionCuller, PoolConfig, SelectConfig, Selector, ShadowVolume, Verdict,
        kernels::{ShadowTree, node_budget},
        msvbsp::{Msvbsp, MsvbspConfig},
    },
    polygon::{Change, PolygonId},
    view::{View, ViewWindow},
};
use osp_rivals::occlusion::{MsvbspPaper, PaperCaps};
use osp_session::scene::Scene;

/// The two forms of the modified shadow-volume BSP tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadowForm {
    /// The conservative form.
    Sound,
    /// The form that the paper prints, with caps.
    Paper,
}

impl ShadowForm {
    /// The form's name among the methods of occlusion culling.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sound => "msvbsp",
            Self::Paper => "msvbsp-paper",
        }
    }

    /// Builds the form's tree from these occluders, which are sorted, the best first.
    pub fn tree(self, window: &ViewWindow, occluders: &[ShadowVolume]) -> ShadowTree {
        let node_budget = node_budget(occluders.len());
        match self {
            Self::Sound => {
                let mut culler = Msvbsp::new(MsvbspConfig { node_budget, ..MsvbspConfig::default() });
                culler.build(window, occluders);
                culler.tree().clone()
            }
            Self::Paper => {
                let mut culler = MsvbspPaper::new(PaperCaps::Supporting, node_budget);
                culler.build(window, occluders);
                culler.tree().clone()
            }
        }
    }
}

/// A view of a model: its occluders, and the polygons in view with their true visibility.
#[derive(Debug)]
pub struct ShadowLook<'a> {
    /// The polygons.
    pub(super) scene: &'a Scene,
    pub(super) window: ViewWindow,
    pub(super) occluders: Vec<ShadowVolume>,
    pub(super) in_view: Vec<(PolygonId, Sight)>,
}

impl<'a> ShadowLook<'a> {
    /// Selects the occluders of a view, and determines the visible polygons by the oracle. `None` for a degenerate
    /// projection. O(polygons + pixels of the oracle).
    pub fn new(scene: &'a Scene, view: &View, select: SelectConfig, truth: OracleConfig) -> Option<Self> {
        let window = view.window()?;
        let mut pool = OccluderPool::new(PoolConfig::default());
        pool.follow(scene, &scene.visible_ids().map(Change::Insert).collect::<Vec<_>>());
        let mut selector = Selector::new(select);
        selector.select(&pool, scene, &window);
        let frustum = view.frustum();
        let is_in_view = |id: &PolygonId| frustum.classify(&scene.bounds(*id)) != Containment::Outside;
        let ids: Vec<PolygonId> = scene.visible_ids().filter(is_in_view).collect();
        let oracle = Oracle::new(&window, subjects(scene, &window, &ids), truth);
        Some(Self {
            scene,
            window,
            occluders: selector.chosen().to_vec(),
            in_view: oracle.answers().collect(),
        })
    }

    /// The occluders, best first, with the eye as the origin.
    pub fn occluders(&self) -> &[ShadowVolume] {
        &self.occluders
    }

    /// Fraction of the window that an occluder fills.
    pub fn share(&self, occluder: &ShadowVolume) -> f64 {
        occluder.solid_angle_in(&self.window) / self.window.solid_angle_sr()
    }

    /// The tree of these occluders.
    pub fn tree(&self, form: ShadowForm) -> ShadowTree {
        form.tree(&self.window, &self.occluders)
    }

    /// Number of polygons that are truly hidden.
    pub fn hidden(&self) -> usize {
        self.in_view.iter().filter(|(_, sight)| *sight == Sight::Hidden).count()
    }

    /// Reduces a form's tree to its first `planes` planes, and tests the polygons in view against it.
    pub fn panel(&self, form: ShadowForm, tree: &ShadowTree, planes: usize) -> ShadowPanel {
        let first = tree.first(planes);
        let is_culled = |id| first.test_box(&self.scene.bounds(id)).verdict == Verdict::Hidden;
        ShadowPanel {
            form,
            planes_in_all: tree.node_count(),
            structure: ShadowStructure::of(&first, &self.window, &self.occluders),
            culled: self.in_view.iter().map(|&(id, _)| is_culled(id)).collect(),
        }
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

/// The first planes of a form's tree, or all of them, and the polygons that they hide.
#[derive(Clone, Debug)]
pub struct ShadowPanel {
    /// The form.
    pub form: ShadowForm,
    /// The tree.
    pub structure: ShadowStructure,
    /// Number of planes of the whole tree.
    pub planes_in_all: usize,
    /// For each polygon in view, whether the tree hides its box.
    pub(super) culled: Vec<bool>,
}

/// Counts of the polygons that a tree culls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowCounts {
    /// Number of culled polygons that are truly hidden.
    pub hidden_culled: usize,
    /// Number of culled polygons that are visible, by mistake.
    pub visible_culled: usize,
}
