//! Occlusion culling: following the scene, choosing occluders, building each culler, asking it.
//!
//! The scenes are those of `osp verify scene:NAME`; each figure is one view of the finished model.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use osp::{
    index::{DrawList, IndexConfig, SpatialIndex},
    lab::scenes::TestScene,
    math::Aabb,
    occlusion::{CullConfig, OccluderPool, Occlusion, OcclusionVisitor, PoolConfig, SelectConfig, Selector},
    polygon::Change,
    replay::{CameraChoice, CameraPath, Moment},
    rivals::IndexKind,
    scene::Scene,
    view::{View, ViewWindow},
};

const OCCLUDERS: usize = 64;

struct Looked {
    scene: Scene,
    changes: Vec<Change>,
    pool: OccluderPool,
    index: Box<dyn SpatialIndex>,
    view: View,
    window: ViewWindow,
}

fn look(scene: TestScene) -> Looked {
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
            index.insert(id, model.bounds(id)).expect("finite boxes");
        }
    }
    index.commit();
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let view = camera.view(&heads[2]);
    let window = view.window().expect("a pointed cone");
    Looked { scene: model, changes, pool, index, view, window }
}

fn occlusion(c: &mut Criterion) {
    for scene in [TestScene::Rooms, TestScene::WideRibbons] {
        let looked = look(scene);
        let mut group = c.benchmark_group(format!("occlusion/{}", scene.name()));

        group.throughput(Throughput::Elements(looked.changes.len() as u64));
        group.sample_size(20);
        group.bench_function("follow", |b| {
            b.iter_batched_ref(
                || OccluderPool::new(PoolConfig::default()),
                |pool| pool.follow(&looked.scene, &looked.changes),
                BatchSize::LargeInput,
            );
        });
        group.throughput(Throughput::Elements(1));
        group.sample_size(100);

        let mut selector = Selector::new(SelectConfig { occluders: OCCLUDERS, ..SelectConfig::default() });
        group.bench_function("select", |b| {
            b.iter(|| selector.select(&looked.pool, &looked.scene, &looked.window))
        });
        selector.select(&looked.pool, &looked.scene, &looked.window);

        for kind in Occlusion::CULLERS {
            let mut culler = kind.create(OCCLUDERS);
            group.bench_function(format!("build/{}", kind.name()), |b| {
                b.iter(|| culler.build(&looked.window, selector.chosen()));
            });
            culler.build(&looked.window, selector.chosen());
            let mut drawn = DrawList::new();
            group.bench_function(format!("query/{}", kind.name()), |b| {
                b.iter(|| {
                    drawn.clear();
                    let mut visitor =
                        OcclusionVisitor::new(&*culler, &looked.scene, CullConfig::default(), &mut drawn);
                    black_box(looked.index.traverse(&looked.view.frustum(), &mut visitor));
                    black_box(visitor.counts())
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, occlusion);
criterion_main!(benches);
