//! Groups that move: a group index changes one entry for the group; `osp` changes the boxes of all polygons of the
//! group.
//!
//! `cargo bench --bench groups`. One group contains all polygons of a synthetic session. In every frame the group
//! moves, then a view is culled.
//! * `placing`: the time of the move. `osp_rivals::groups::GroupIndex` changes a matrix, a box and an entry. `osp`
//!   computes and updates the box of every polygon. `frame` measures a whole frame with the event `Place` and the
//!   query: each polygon gets an update, or the group moves as a whole.
//! * `culling`: the time of the query.
//! * `instances`: a thousand nodes that show one mesh in the group index, compared with a million polygons in `osp`.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Affine3A, Quat, Vec3};
use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp, SpatialIndex},
    math::Aabb,
    polygon::{Change, PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_rivals::groups::{CullScratch, GroupIndex, MeshId, NodeId, Polygons};
use osp_session::{
    recording::{Author, Event, GroupId, SynthKind, Transform, synthesize},
    scene::Scene,
};

const SIZES: [u32; 3] = [1_000, 10_000, 100_000];
/// Number of nodes that show the mesh.
const INSTANCES: usize = 1000;

/// Returns a session's scene with all strokes in one group.
fn scene(mut scene: Scene, polygons: u32) -> Scene {
    let events = synthesize(SynthKind::Scribble, polygons, 1);
    for event in events {
        scene.apply(&event.expect("a synthetic session is whole"), &mut Vec::new());
    }
    let strokes = scene.strokes().iter().filter_map(|stroke| stroke.id()).collect();
    let group =
        Event::Group { author: Author::SOLE, t: 0.0, group: GroupId(0), strokes, parent: None, name: None };
    scene.apply(&group, &mut Vec::new());
    scene
}

fn boxes(scene: &Scene) -> Vec<Aabb> {
    scene.visible_ids().map(|id| scene.bounds(id)).collect()
}

fn inserted(boxes: &[Aabb]) -> (GroupIndex, MeshId) {
    let mut index = GroupIndex::default();
    let mesh = index.add_mesh();
    for (bounds, number) in boxes.iter().zip(0..) {
        index.set_polygon(mesh, PolygonId(number), Some(bounds)).expect("a sound box");
    }
    (index, mesh)
}

/// Returns the rotation and the translation of the group in a frame. The group swings through the view.
fn place(frame: u32) -> (Quat, Vec3) {
    let angle = frame as f32 * 0.01;
    (Quat::from_rotation_y(angle), Vec3::new(2.0 * angle.sin(), 0.1 * angle.cos(), 0.0))
}

fn affine(frame: u32) -> Affine3A {
    let (q, p) = place(frame);
    Affine3A::from_rotation_translation(q, p)
}

fn view() -> View {
    let eye = Vec3::new(0.0, 1.5, 4.5);
    View::look_at(eye, Vec3::new(1.0, 1.5, 0.0), Projection::symmetric(45.0, 1.5, 0.05, 100.0))
}

/// Computes the boxes in the world after the group has moved.
fn moved(boxes: &[Aabb], to: &Affine3A, out: &mut Vec<Aabb>) {
    out.clear();
    out.extend(
        boxes.iter().map(|bounds| Aabb::from_points(&bounds.corners().map(|p| to.transform_point3(p)))),
    );
}

fn placing(c: &mut Criterion) {
    let mut benches = c.benchmark_group("placing");
    for polygons in SIZES {
        let boxes = boxes(&scene(Scene::new(), polygons));
        let (mut groups, mesh) = inserted(&boxes);
        let node = groups.add_node(None, affine(0), Some(mesh)).expect("a node");
        groups.commit();
        let mut frame = 0;
        benches.bench_function(BenchmarkId::new("group-index", boxes.len()), |b| {
            b.iter(|| {
                frame += 1;
                groups.place(node, affine(frame)).expect("a node");
                groups.commit();
            });
        });
        let mut osp = Osp::new(&IndexConfig { capacity: boxes.len(), ..IndexConfig::default() });
        for (bounds, number) in boxes.iter().zip(0..) {
            osp.insert(PolygonId(number), bounds).expect("a sound box");
        }
        osp.commit();
        let mut world = Vec::new();
        benches.bench_function(BenchmarkId::new("osp, every polygon", boxes.len()), |b| {
            b.iter(|| {
                frame += 1;
                moved(&boxes, &affine(frame), &mut world);
                for (bounds, number) in world.iter().zip(0..) {
                    osp.update(PolygonId(number), bounds).expect("a sound box");
                }
                osp.commit();
            });
        });
        // A whole frame: the event, the index, the query.
        let empty =
            [("frame, each polygon", Scene::new()), ("frame, whole groups", Scene::keeping_groups_whole())];
        for (name, empty) in empty {
            let mut scene = scene(empty, polygons);
            let mut changes: Vec<Change> = scene.visible_ids().map(Change::Insert).collect();
            let index = Osp::new(&IndexConfig { capacity: boxes.len(), ..IndexConfig::default() });
            let mut pipeline = Pipeline::new(Box::new(index), boxes.len());
            pipeline.frame(&scene, &changes, &view());
            benches.bench_function(BenchmarkId::new(name, boxes.len()), |b| {
                b.iter(|| {
                    frame += 1;
                    let (q, p) = place(frame);
                    let to = Transform { p, q, s: 1.0 };
                    changes.clear();
                    scene.apply(
                        &Event::Place { author: Author::SOLE, t: 0.0, group: GroupId(0), to },
                        &mut changes,
                    );
                    pipeline.frame(&scene, &changes, &view())
                });
            });
        }
    }
    benches.finish();
}

fn culling(c: &mut Criterion) {
    let mut benches = c.benchmark_group("culling");
    let frustum = view().frustum();
    for polygons in SIZES {
        let boxes = boxes(&scene(Scene::new(), polygons));
        let to = affine(40);
        let (mut groups, mesh) = inserted(&boxes);
        groups.add_node(None, to, Some(mesh)).expect("a node");
        groups.commit();
        let mut scratch = CullScratch::default();
        let work = groups.frustum_cull(&frustum, &mut scratch, |_| ());
        benches.bench_function(BenchmarkId::new("group-index", boxes.len()), |b| {
            b.iter(|| groups.frustum_cull(&frustum, &mut scratch, |found| _ = black_box(found.node)));
        });
        let mut world = Vec::new();
        moved(&boxes, &to, &mut world);
        let mut osp = Osp::new(&IndexConfig { capacity: boxes.len(), ..IndexConfig::default() });
        for (bounds, number) in world.iter().zip(0..) {
            osp.insert(PolygonId(number), bounds).expect("a sound box");
        }
        osp.commit();
        let mut visible = VisibleBlocks::new();
        let in_world = osp.frustum_cull_blocks(&frustum, &mut visible);
        report(&format!(
            "{} polygons: group-index reports {}, osp {}",
            boxes.len(),
            work.reported,
            in_world.reported
        ));
        benches.bench_function(BenchmarkId::new("osp", boxes.len()), |b| {
            b.iter(|| {
                visible.clear();
                osp.frustum_cull_blocks(&frustum, &mut visible)
            });
        });
    }
    benches.finish();
}

fn instances(c: &mut Criterion) {
    let mut benches = c.benchmark_group("instances");
    let boxes = boxes(&scene(Scene::new(), 1_000));
    let (mut groups, mesh) = inserted(&boxes);
    let mut nodes: Vec<NodeId> = Vec::new();
    for i in 0..INSTANCES {
        let at = Vec3::new((i % 32) as f32 * 5.0, 0.0, (i / 32) as f32 * 5.0);
        let to = Affine3A::from_rotation_translation(Quat::from_rotation_y(i as f32), at);
        nodes.push(groups.add_node(None, to, Some(mesh)).expect("a node"));
    }
    groups.commit();
    let view = View::look_at(
        Vec3::new(-5.0, 8.0, -5.0),
        Vec3::new(40.0, 0.0, 40.0),
        Projection::symmetric(45.0, 1.5, 0.05, 400.0),
    );
    let frustum = view.frustum();
    let mut osp = Osp::new(&IndexConfig {
        root: Aabb::cube(Vec3::new(80.0, 0.0, 80.0), 180.0),
        capacity: boxes.len() * INSTANCES,
    });
    let mut world = Vec::new();
    for (i, &node) in nodes.iter().enumerate() {
        moved(&boxes, &groups.world_from_node(node).expect("a node"), &mut world);
        for (bounds, number) in world.iter().zip(0..) {
            osp.insert(PolygonId((i * boxes.len()) as u32 + number), bounds).expect("a sound box");
        }
        osp.commit();
    }
    let mut scratch = CullScratch::default();
    let (mut whole, mut cut) = (0, 0);
    let work = groups.frustum_cull(&frustum, &mut scratch, |found| match found.polygons {
        Polygons::All => whole += 1,
        Polygons::Some(_) => cut += 1,
    });
    let mut visible = VisibleBlocks::new();
    let in_world = osp.frustum_cull_blocks(&frustum, &mut visible);
    report(&format!(
        "{INSTANCES} instances of {} polygons: group-index {} bytes, reports {} ({whole} whole, {cut} cut); osp {} bytes, {}",
        boxes.len(),
        groups.bytes(),
        work.reported,
        osp.bytes(),
        in_world.reported
    ));
    benches.bench_function("culling, group-index", |b| {
        b.iter(|| groups.frustum_cull(&frustum, &mut scratch, |found| _ = black_box(found.node)));
    });
    benches.bench_function("culling, osp", |b| {
        b.iter(|| {
            visible.clear();
            osp.frustum_cull_blocks(&frustum, &mut visible)
        });
    });
    let mut frame = 0;
    benches.bench_function("all placed anew, group-index", |b| {
        b.iter(|| {
            frame += 1;
            for (i, &node) in nodes.iter().enumerate() {
                let at = Vec3::new((i % 32) as f32 * 5.0, (frame % 10) as f32 * 0.1, (i / 32) as f32 * 5.0);
                groups.place(node, Affine3A::from_translation(at)).expect("a node");
            }
            groups.commit();
        });
    });
    benches.finish();
}

#[allow(clippy::print_stderr, reason = "counts in addition to the times")]
fn report(line: &str) {
    eprintln!("{line}");
}

criterion_group!(benches, placing, culling, instances);
criterion_main!(benches);
