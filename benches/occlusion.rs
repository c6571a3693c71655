//! Occlusion culling: updating the candidates, selecting occluders, building each culler, and testing.
//!
//! `osp verify scene:NAME` uses the same scenes. All benches use one view of the finished model, except
//! `select/moving`: its camera turns by up to a third of a degree and moves up to 3 mm a frame. `select` uses the data
//! of the previous selection; `select/forgetful` has none. `query/NAME/one-by-one` tests the same boxes one by one,
//! each from the root of the culler's tree.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, CullConfig, OccluderPool, Occlusion, OcclusionConfig, OcclusionCuller, OcclusionStage,
        OcclusionVisitor, PolygonTest, PoolConfig, PreviousFrameCounts, PreviousFrameOccluders, SelectConfig,
        Selector, ShadowVolume, Tested, ViewInput,
    },
    polygon::{Change, VisibleBlocks},
    view::{View, ViewWindow},
};
use osp_lab::{Method, scenes::TestScene};
use osp_rivals::{IndexKind, RivalOcclusion};
use osp_session::{
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

const OCCLUDERS: usize = 64;

/// A culler that tests one box at a time.
struct OneByOne<'a>(&'a dyn OcclusionCuller);

impl OcclusionCuller for OneByOne<'_> {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn build(&mut self, _: &ViewWindow, _: &[ShadowVolume]) -> BuildCounts {
        BuildCounts::default()
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        self.0.test_box(bounds)
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.0.test_sphere(sphere)
    }
}

struct ViewedScene {
    scene: Scene,
    changes: Vec<Change>,
    pool: OccluderPool,
    index: Box<dyn SpatialIndex>,
    view: View,
    window: ViewWindow,
}

fn viewed_scene(scene: TestScene) -> ViewedScene {
    let (mut model, mut changes, mut heads) = (Scene::new(), Vec::new(), Vec::new());
    for event in scene.events() {
        model.apply(&event, &mut changes);
        let mut moment = Moment::default();
        moment.note(&event);
        heads.extend(moment.head.is_some().then_some(moment));
    }
    let mut pool = OccluderPool::new(PoolConfig::default());
    pool.follow(&model, &changes);
    let mut index = IndexKind::Osp.create(&IndexConfig::default());
    for change in &changes {
        if let Change::Insert(id) = *change {
            index.insert(id, &model.bounds(id)).expect("finite boxes");
        }
    }
    index.commit();
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let view = camera.view(&heads[2]);
    let window = view.window().expect("a pointed cone");
    ViewedScene { scene: model, changes, pool, index, view, window }
}

/// Returns the views of one second, in which the camera turns to both sides and moves.
fn walk(view: &View) -> Vec<ViewWindow> {
    let frame = |i: usize| {
        let turned = (i as f32 / 90.0 * std::f32::consts::TAU).sin() * 0.08;
        let mut view = *view;
        view.world_from_view = glam::Quat::from_rotation_y(turned) * view.world_from_view;
        view.eye_in_world.x += turned * 0.5;
        view.window().expect("a pointed cone")
    };
    (0..90).map(frame).collect()
}

fn occlusion(c: &mut Criterion) {
    for scene in [TestScene::Rooms, TestScene::Panels, TestScene::WideRibbons] {
        let viewed = viewed_scene(scene);
        let mut group = c.benchmark_group(format!("occlusion/{}", scene.name()));

        group.throughput(Throughput::Elements(viewed.changes.len() as u64));
        group.sample_size(20);
        group.bench_function("follow", |b| {
            b.iter_batched_ref(
                || OccluderPool::new(PoolConfig::default()),
                |pool| pool.follow(&viewed.scene, &viewed.changes),
                BatchSize::LargeInput,
            );
        });
        group.throughput(Throughput::Elements(1));
        group.sample_size(100);

        let mut selector = Selector::new(SelectConfig { occluders: OCCLUDERS, ..SelectConfig::default() });
        group.bench_function("select", |b| {
            b.iter(|| selector.select(&viewed.pool, &viewed.scene, &viewed.window))
        });
        group.bench_function("select/forgetful", |b| {
            b.iter(|| {
                selector.forget();
                selector.select(&viewed.pool, &viewed.scene, &viewed.window)
            })
        });
        let windows = walk(&viewed.view);
        let mut frame = 0;
        group.bench_function("select/moving", |b| {
            b.iter(|| {
                frame += 1;
                selector.select(&viewed.pool, &viewed.scene, &windows[frame % windows.len()])
            })
        });
        selector.forget();
        selector.select(&viewed.pool, &viewed.scene, &viewed.window);

        let mut last = PreviousFrameOccluders::new(PreviousFrameOccluders::PICTURE, viewed.changes.len());
        let (mut in_view, mut left) = (VisibleBlocks::new(), VisibleBlocks::new());
        viewed.index.frustum_cull_blocks(&viewed.view.frustum(), &mut in_view);
        group.bench_function("depth-last/build", |b| {
            b.iter(|| last.build(0, &viewed.scene, &viewed.window, &in_view));
        });
        let input = ViewInput {
            index: &*viewed.index,
            geometry: &viewed.scene,
            view: &viewed.view,
            in_view: &in_view,
            spaces: None,
        };
        group.bench_function("depth-last/query", |b| {
            b.iter(|| {
                let mut counts = PreviousFrameCounts::default();
                last.cull(0, &input, &mut left, &mut counts);
                counts
            });
        });

        // Measures the tests of a frame; criterion's elements are tests.
        for (name, polygon_test, least_polygons) in [
            ("nodes-of-24", PolygonTest::Never, 24),
            ("nodes", PolygonTest::Never, 1),
            ("polygons", PolygonTest::InPartlyHiddenLeaves, 1),
        ] {
            let cull = CullConfig { polygon_test, least_polygons, ..CullConfig::default() };
            let select = SelectConfig { occluders: OCCLUDERS, ..SelectConfig::default() };
            let config = OcclusionConfig { select, cull, ..OcclusionConfig::default() };
            let mut stage = OcclusionStage::new(Occlusion::Msvbsp, config);
            stage.follow(&viewed.scene, &viewed.changes);
            let mut left = VisibleBlocks::new();
            stage.cull(&input, &mut left);
            let mut thin_out = || stage.view().remove_hidden(&input, &mut left);
            let counts = thin_out();
            group.throughput(Throughput::Elements(counts.node_tests + counts.polygon_tests));
            group.bench_function(format!("thin-out/{name}"), |b| b.iter(&mut thin_out));
        }
        group.throughput(Throughput::Elements(1));

        for kind in Method::CULLERS {
            let mut culler = kind.create(OCCLUDERS);
            group.bench_function(format!("build/{}", kind.name()), |b| {
                b.iter(|| culler.build(&viewed.window, selector.chosen()));
            });
            culler.build(&viewed.window, selector.chosen());
            let mut query = |name: String, culler: &dyn OcclusionCuller| {
                let mut drawn = Vec::new();
                group.bench_function(name, |b| {
                    b.iter(|| {
                        drawn.clear();
                        let mut visitor =
                            OcclusionVisitor::new(culler, &viewed.scene, CullConfig::default(), &mut drawn);
                        black_box(viewed.index.traverse(&viewed.view.frustum(), &mut visitor));
                        black_box(visitor.counts())
                    });
                });
            };
            query(format!("query/{}", kind.name()), &*culler);
            if [Occlusion::Msvbsp.into(), RivalOcclusion::Svbsp.into()].contains(kind) {
                query(format!("query/{}/one-by-one", kind.name()), &OneByOne(&*culler));
            }
        }
        group.finish();
    }
}

criterion_group!(benches, occlusion);
criterion_main!(benches);
