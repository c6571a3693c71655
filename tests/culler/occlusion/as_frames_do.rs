//! `osp verify` culls as a frame of the pipeline does: the index is not walked for what can be seen.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering::Relaxed},
};

use osp::{
    frame::StageClock,
    index::{IndexConfig, IndexError, SpatialIndex, Thinner, Visitor, WorkCounts},
    math::{Aabb, Frustum},
    occlusion::{
        CullConfig, Occlusion, OcclusionConfig, OcclusionStage, PoolConfig, SelectConfig, ViewInput,
    },
    polygon::{PolygonId, VisibleBlocks},
};
use osp_lab::{
    oracle::OracleConfig,
    scenes::TestScene,
    verify::{Verifier, VerifyConfig},
};
use osp_rivals::IndexKind;
use osp_session::{
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

/// Counts the walks of an index, which may be without [`SpatialIndex::thin_out`].
struct Counted {
    index: Box<dyn SpatialIndex>,
    can_thin: bool,
    walks: Arc<AtomicU64>,
}

impl SpatialIndex for Counted {
    fn name(&self) -> &'static str {
        self.index.name()
    }

    fn len(&self) -> usize {
        self.index.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.index.insert(id, bounds)
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.index.remove(id)
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.index.update(id, bounds)
    }

    fn commit(&mut self) {
        self.index.commit();
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.index.frustum_cull(frustum, draw_list)
    }

    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        self.index.frustum_cull_blocks(frustum, visible)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.walks.fetch_add(1, Relaxed);
        self.index.traverse(frustum, visitor)
    }

    fn thin_out(&self, frustum: &Frustum, visible: &mut VisibleBlocks, thinner: &mut dyn Thinner) -> bool {
        self.can_thin && self.index.thin_out(frustum, visible, thinner)
    }

    fn validate(&self) -> Result<(), String> {
        self.index.validate()
    }

    fn bytes(&self) -> usize {
        self.index.bytes()
    }

    fn clear(&mut self) {
        self.index.clear();
    }
}

#[test]
fn verifying_culls_as_a_frame_does() {
    let (mut model, mut changes, mut moments) = (Scene::new(), Vec::new(), Vec::new());
    let mut moment = Moment::default();
    for event in TestScene::Rooms.events() {
        model.apply(&event, &mut changes);
        moment.note(&event);
        moments.extend(moment.head.is_some().then_some(moment));
    }
    let view = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY).view(&moments[2]);
    let totals = [true, false].map(|can_thin| {
        let walks = Arc::new(AtomicU64::new(0));
        let index = IndexKind::Osp.create(&IndexConfig::default());
        let index = Counted { index, can_thin, walks: Arc::clone(&walks) };
        let config = VerifyConfig {
            kinds: vec![Occlusion::Msvbsp.into()],
            occluders: vec![64],
            pool: PoolConfig::default(),
            select: SelectConfig::default(),
            cull: CullConfig::default(),
            oracle: OracleConfig { width: 320, height: 180 },
            repeats: 3,
        };
        let mut verifier = Verifier::new(Box::new(index), config, StageClock::default());
        verifier.follow(&model, &changes);
        verifier.verify_view(&model, &view);
        assert_eq!(walks.load(Relaxed), if can_thin { 0 } else { 3 });
        assert!(!verifier.trials()[0].failed());
        verifier.trials()[0].totals().clone()
    });
    assert!(totals[0].hidden_culled > 100, "{totals:?}");
    assert_eq!((totals[0].drawn, totals[0].hidden_culled), (totals[1].drawn, totals[1].hidden_culled));

    // The same work as the pipeline's stage.
    let mut index = IndexKind::Osp.create(&IndexConfig::default());
    model.visible_ids().for_each(|id| index.insert(id, &model.bounds(id)).expect("finite boxes"));
    index.commit();
    let mut stage = OcclusionStage::new(Occlusion::Msvbsp, OcclusionConfig::default());
    stage.load(&model, &changes);
    let (mut in_view, mut drawn) = (VisibleBlocks::new(), VisibleBlocks::new());
    index.frustum_cull_blocks(&view.frustum(), &mut in_view);
    let input = ViewInput { index: &*index, geometry: &model, view: &view, in_view: &in_view, spaces: None };
    let counts = stage.cull(&input, &mut drawn).cull;
    assert_eq!(counts.node_tests + counts.polygon_tests, totals[0].node_tests + totals[0].polygon_tests);
    assert_eq!(drawn.len() as u64, totals[0].drawn);
}
