//! Insertion and frustum culling for every index, and ray queries for some indexes. All use the same synthetic session
//! of ribbons.
//!
//! `cargo bench --bench index`. Each iteration does the same work: it inserts the whole session in drawing order into
//! an empty index, or queries an index that does not change. `osp replay` measures indexes while they grow.

use std::hint::black_box;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use osp::{
    glam::Vec2,
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Ray},
    polygon::{Change, PolygonId},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

/// Number of polygons of the session.
const POLYGONS: u32 = 50_000;

/// Returns the boxes of a session's polygons in drawing order.
fn boxes() -> Vec<(PolygonId, Aabb)> {
    let mut scene = Scene::new();
    let mut changes = Vec::new();
    for event in synthesize(SynthKind::Scribble, POLYGONS, 1) {
        scene.apply(&event.expect("a synthetic session is whole"), &mut changes);
    }
    let inserted = changes.iter().filter_map(|c| if let Change::Insert(id) = *c { Some(id) } else { None });
    let mut seen = std::collections::BTreeSet::new();
    inserted.filter(|&id| seen.insert(id)).map(|id| (id, scene.bounds(id))).collect()
}

fn filled(kind: IndexKind, config: &IndexConfig, boxes: &[(PolygonId, Aabb)]) -> Box<dyn SpatialIndex> {
    let mut index = kind.create(config);
    fill(&mut *index, boxes);
    index
}

fn fill(index: &mut dyn SpatialIndex, boxes: &[(PolygonId, Aabb)]) {
    for (id, bounds) in boxes {
        index.insert(*id, bounds).expect("finite boxes, each id once");
    }
    index.commit();
}

fn insert(c: &mut Criterion) {
    let boxes = boxes();
    let config = IndexConfig { capacity: boxes.len(), ..IndexConfig::default() };
    let mut group = c.benchmark_group("insert");
    group.sample_size(10).throughput(Throughput::Elements(boxes.len() as u64));
    for &kind in IndexKind::ALL {
        group.bench_function(BenchmarkId::from_parameter(kind.name()), |b| {
            b.iter_batched_ref(
                || kind.create(&config),
                |index| fill(&mut **index, &boxes),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

fn frustum_cull(c: &mut Criterion) {
    let boxes = boxes();
    let bounds = boxes.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(b));
    let config = IndexConfig { capacity: boxes.len(), ..IndexConfig::default() };
    for camera in [CameraChoice::Orbit, CameraChoice::Inside] {
        let mut group = c.benchmark_group(format!("frustum_cull/{}", camera.name()));
        group.sample_size(20);
        let frustum = CameraPath::new(camera, None, &bounds).view(&Moment::default()).frustum();
        let mut draw_list = Vec::new();
        for &kind in IndexKind::ALL {
            let index = filled(kind, &config, &boxes);
            group.bench_function(BenchmarkId::from_parameter(kind.name()), |b| {
                b.iter(|| {
                    draw_list.clear();
                    black_box(index.frustum_cull(&frustum, &mut draw_list));
                });
            });
        }
        group.finish();
    }
}

/// Finds the nearest hit of rays from outside and from inside the model.
fn ray_nearest(c: &mut Criterion) {
    let mut scene = Scene::new();
    for event in synthesize(SynthKind::Scribble, POLYGONS, 1) {
        scene.apply(&event.expect("a synthetic session is whole"), &mut Vec::new());
    }
    let boxes = boxes();
    let bounds = boxes.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(b));
    let config = IndexConfig { capacity: boxes.len(), ..IndexConfig::default() };
    let polygons: Vec<_> = boxes.iter().map(|(id, _)| scene.polygon(*id)).collect();
    for camera in [CameraChoice::Orbit, CameraChoice::Inside] {
        let path = CameraPath::new(camera, None, &bounds);
        let rays: Vec<Ray> = (0..500u16)
            .map(|i| {
                let at = Vec2::new(f32::from(i % 25) / 12.0 - 1.0, f32::from(i / 25 % 20) / 9.5 - 1.0);
                path.view(&Moment { frame: u64::from(i) * 7, ..Moment::default() }).ray_through(at)
            })
            .collect();
        let mut group = c.benchmark_group(format!("ray_nearest/{}", camera.name()));
        group.sample_size(20).throughput(Throughput::Elements(rays.len() as u64));
        for kind in [IndexKind::Osp, IndexKind::BvhSah, IndexKind::Lbvh, IndexKind::OctreeRebuild] {
            let index = filled(kind, &config, &boxes);
            let hit = |ray: &Ray, id: PolygonId| polygons[id.index()].meet(ray);
            group.bench_function(BenchmarkId::from_parameter(kind.name()), |b| {
                b.iter(|| {
                    for ray in &rays {
                        black_box(index.ray_nearest(ray, f32::INFINITY, &mut |id| hit(ray, id)));
                    }
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, insert, frustum_cull, ray_nearest);
criterion_main!(benches);
