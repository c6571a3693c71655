use std::time::Duration;

use osp::{
    frame::{AutoBasis, PassConfig, Pipeline, StageClock},
    index::IndexConfig,
    math::Aabb,
    occlusion::{NodeTest, Occlusion, Score},
};
use osp_lab::Method;
use osp_rivals::{IndexKind, IndexSettings};
use osp_session::scene::Scene;

/// Settings for indexing and culling a model.
#[derive(Clone, Debug, PartialEq)]
pub struct CullingPlan {
    pub kind: IndexKind,
    pub settings: IndexSettings,
    pub occlusion: Method,
    pub(super) occluders: Option<usize>,
    /// The test that decides whether a node is hidden.
    pub node_test: NodeTest,
    /// The score by which occluders are chosen.
    pub score: Score,
}

/// An indexed model, which another thread may have built.
#[derive(Debug)]
pub struct Indexed {
    pub(super) plan: CullingPlan,
    pub(super) pipeline: Pipeline,
    pub(super) took: Duration,
}

impl CullingPlan {
    pub fn new(kind: IndexKind, occlusion: Method) -> Self {
        Self {
            kind,
            settings: IndexSettings::default(),
            occlusion,
            occluders: None,
            node_test: NodeTest::Box,
            score: Score::default(),
        }
    }

    /// Inserts a whole model into a new index; `bounds` is the model's box.
    pub fn index(self, scene: &Scene, bounds: &Aabb) -> Indexed {
        let clock = StageClock::default();
        let start = clock.start();
        let mut pipeline = self.pipeline(bounds, scene.polygon_count());
        pipeline.load(scene);
        let took = Duration::from_nanos(clock.since(start).ns);
        Indexed { plan: self, pipeline, took }
    }

    /// Does the same as [`CullingPlan::index`], in steps.
    pub(crate) fn begin_index(self, scene: &Scene, bounds: &Aabb) -> Indexing {
        let pipeline = self.pipeline(bounds, scene.polygon_count());
        Indexing { indexed: Indexed { plan: self, pipeline, took: Duration::ZERO } }
    }

    /// An empty index for a model with this box and this number of polygons.
    pub(super) fn pipeline(&self, bounds: &Aabb, polygons: usize) -> Pipeline {
        // The capacity is twice the number of polygons, so that the index of a growing model is not enlarged during a
        // frame.
        let capacity = IndexConfig::default().capacity.max(polygons * 2);
        let index = self.kind.create_with(&IndexConfig { root: root_for(bounds), capacity }, &self.settings);
        let pass = PassConfig {
            node_test: self.node_test,
            score: self.score,
            basis: AutoBasis::Time,
            ..PassConfig::for_strokes(Occlusion::Auto)
        };
        let pipeline = Pipeline::new(index, capacity);
        let mut pipeline = self.occlusion.add_to(pipeline, pass);
        pipeline.set_occluders(self.occluders);
        pipeline
    }
}

/// A model during its insertion into an index.
#[derive(Debug)]
pub(crate) struct Indexing {
    indexed: Indexed,
}

impl Indexing {
    /// Inserts a part of the model. Returns whether polygons are left.
    pub(crate) fn step(&mut self, scene: &Scene) -> bool {
        let clock = StageClock::default();
        let start = clock.start();
        let goes_on = self.indexed.pipeline.load_some(scene);
        self.indexed.took += Duration::from_nanos(clock.since(start).ns);
        goes_on
    }

    pub(crate) fn finish(self) -> Indexed {
        self.indexed
    }
}

/// The default root cube if it contains the model's box, else a cube around the box.
fn root_for(bounds: &Aabb) -> Aabb {
    let usual = IndexConfig::default().root;
    if bounds.is_empty() || usual.contains(bounds) {
        return usual;
    }
    Aabb::cube(bounds.center(), bounds.extent().max_element().max(1.0e-3) * 1.25)
}
