use super::steps::{ShadowForm, ShadowStep, ShadowSteps};
use crate::{
    oracle::{Oracle, OracleConfig, Sight},
    verify::subjects,
};
use osp::{
    math::Containment,
    occlusion::{OccluderPool, PoolConfig, SelectConfig, Selector, ShadowVolume},
    polygon::{Change, PolygonId},
    view::{View, ViewWindow},
};
use osp_session::scene::Scene;

#[derive(Clone, Debug)]
pub struct ShadowView {
    /// The cone of directions that the eye sees.
    pub window: ViewWindow,
    /// The occluders, best first, with the eye as the origin.
    pub occluders: Vec<ShadowVolume>,
    /// The polygons whose boxes are not outside of the view.
    pub in_view: Vec<PolygonId>,
}

impl ShadowView {
    /// Selects the occluders of a view. `None` for a degenerate projection. O(polygons).
    pub fn new(scene: &Scene, view: &View, select: SelectConfig) -> Option<Self> {
        let window = view.window()?;
        let mut pool = OccluderPool::new(PoolConfig::default());
        pool.follow(scene, &scene.visible_ids().map(Change::Insert).collect::<Vec<_>>());
        let mut selector = Selector::new(select);
        selector.select(&pool, scene, &window);
        let frustum = view.frustum();
        let is_in_view = |id: &PolygonId| frustum.classify(&scene.bounds(*id)) != Containment::Outside;
        Some(Self {
            window,
            occluders: selector.chosen().to_vec(),
            in_view: scene.visible_ids().filter(is_in_view).collect(),
        })
    }

    /// The true visibility of each polygon in view, in the order of [`Self::in_view`]. O(polygons in view + pixels).
    pub fn sights(&self, scene: &Scene, truth: OracleConfig) -> Vec<(PolygonId, Sight)> {
        let oracle = Oracle::new(&self.window, subjects(scene, &self.window, &self.in_view), truth);
        oracle.answers().collect()
    }

    /// Share of the window that an occluder fills: its score.
    pub fn share(&self, occluder: &ShadowVolume) -> f64 {
        occluder.solid_angle_in(&self.window) / self.window.solid_angle_sr()
    }

    /// The whole tree of the occluders.
    pub fn steps(&self, form: ShadowForm) -> ShadowSteps {
        ShadowSteps::new(form, &self.window, &self.occluders)
    }

    /// A tree of the occluders, cut to its first `planes` planes. O(planes * occluders).
    pub fn step(&self, steps: &ShadowSteps, planes: usize) -> ShadowStep {
        steps.step(planes, &self.window, &self.occluders)
    }
}
