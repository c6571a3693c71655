//! `osp verify` culls as a frame of the pipeline does: the index is not walked for what can be seen.

use osp::{
    frame::StageClock,
    index::IndexConfig,
    math::Aabb,
    occlusion::{
        CullConfig, Occlusion, OcclusionConfig, OcclusionStage, PoolConfig, SelectConfig, ViewInput,
    },
    polygon::VisibleBlocks,
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
    let config = VerifyConfig {
        kinds: vec![Occlusion::Msvbsp.into()],
        occluders: vec![64],
        pool: PoolConfig::default(),
        select: SelectConfig::default(),
        cull: CullConfig::default(),
        oracle: OracleConfig { width: 320, height: 180 },
        repeats: 3,
    };
    let mut verifier =
        Verifier::new(IndexKind::Osp.create(&IndexConfig::default()), config, StageClock::default());
    verifier.follow(&model, &changes);
    verifier.verify_view(&model, &view);
    let trial = &verifier.trials()[0];
    assert!(!trial.failed());
    let totals = trial.totals();
    assert!(totals.hidden_culled > 100, "{totals:?}");

    // The same work as the pipeline's stage.
    let mut index = IndexKind::Osp.create(&IndexConfig::default());
    model.visible_ids().for_each(|id| index.insert(id, &model.bounds(id)).expect("finite boxes"));
    index.commit();
    let mut stage = OcclusionStage::new(Occlusion::Msvbsp, OcclusionConfig::default());
    stage.follow(&model, &changes);
    let (mut in_view, mut drawn) = (VisibleBlocks::new(), VisibleBlocks::new());
    index.frustum_cull_blocks(&view.frustum(), &mut in_view);
    let input = ViewInput { index: &*index, geometry: &model, view: &view, in_view: &in_view, spaces: None };
    let counts = stage.cull(&input, &mut drawn).cull;
    assert_eq!(counts.node_tests + counts.polygon_tests, totals.node_tests + totals.polygon_tests);
    assert_eq!(drawn.len() as u64, totals.drawn);
}
