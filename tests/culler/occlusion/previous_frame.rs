//! Occluders of the frame before.

use crate::engine::{self, Thing, World};
use glam::Vec3;
use osp::{
    frame::{OcclusionPass, PassConfig, Pipeline, PreviousFramePass},
    index::IndexConfig,
    math::Aabb,
    occlusion::Occlusion,
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_rivals::IndexKind;
use osp_session::{recording::Event, scene::Scene};
use osp_testkit::events::polygon;

const WHITE: (f32, f32, f32, f32) = (1.0, 1.0, 1.0, 1.0);

fn square(center: Vec3, half_m: f32) -> Event {
    let corner = |x: f32, y: f32| center + Vec3::new(x, y, 0.0) * half_m;
    let vertices = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    polygon(None, vertices, WHITE)
}

/// What is drawn of each view in the fourth frame at rest.
fn at_rest(scene: &dyn Geometry, changes: &[Change], views: &[View]) -> Vec<Vec<PolygonId>> {
    let index = IndexKind::Osp.create(&IndexConfig::default());
    let mut pipeline = Pipeline::new(index, 256).with_pass(PreviousFramePass::new(256));
    for frame in 0..4 {
        pipeline.frame_of_views(scene, if frame == 0 { changes } else { &[] }, views);
    }
    pipeline.draw_lists().iter().map(VisibleBlocks::to_vec).collect()
}

#[test]
fn each_view_is_culled_by_its_own_window() {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    // Before and behind the eye, and to a side: a wall with small things behind it.
    for (i, way) in [Vec3::NEG_Z, Vec3::Z].into_iter().enumerate() {
        scene.apply(&square(way * 2.0, 1.5), &mut changes);
        for k in 0..20 + 10 * i {
            let beside = Vec3::new((k % 5) as f32 * 0.2 - 0.4, (k / 5) as f32 * 0.2 - 0.5, 0.0);
            scene.apply(&square(way * 3.0 + beside, 0.05), &mut changes);
        }
    }
    let projection = Projection::symmetric(60.0, 1.5, 0.01, 100.0);
    let views = [Vec3::NEG_Z, Vec3::Z].map(|way| View::look_at(Vec3::ZERO, way, projection));
    let together = at_rest(&scene, &changes, &views);
    for (view, drawn) in views.iter().zip(&together) {
        assert_eq!(at_rest(&scene, &changes, &[*view]), std::slice::from_ref(drawn));
        assert_eq!(drawn.len(), 1, "only the wall is left");
    }
}

fn at_origin() -> View {
    let projection = Projection::symmetric(60.0, 1.5, 0.01, 100.0);
    View::look_at(Vec3::ZERO, Vec3::NEG_Z, projection)
}

#[test]
fn meshes_are_culled_by_their_boxes_one_by_one() {
    // Those with even numbers stand beside the wall, so no box around several meshes is hidden.
    let mesh = |i: u32| {
        let x = if i.is_multiple_of(2) { 2.2 } else { -0.5 };
        Some(Thing::Mesh(Aabb::cube(Vec3::new(x, i as f32 * 0.1 - 0.6, -3.0), 0.05)))
    };
    let mut world = World::of([ConvexPolygon::quad(engine::square(2.0, 1.0))]);
    world.0.extend((1..13).map(mesh));
    let changes: Vec<Change> = (0..13).map(|i| Change::Insert(PolygonId(i))).collect();
    let drawn = at_rest(&world, &changes, &[at_origin()]);
    let expected: Vec<PolygonId> = (0..13).step_by(2).map(PolygonId).collect();
    assert_eq!(drawn, [expected]);
}

/// A rough wall of triangles, which no large occluder can stand for.
fn rough_wall(scene: &mut Scene, changes: &mut Vec<Change>) {
    let corner = |x: i32, y: i32| {
        let away_m = 2.0 + ((x * 7 + y * 13) % 5) as f32 * 0.1;
        Vec3::new(x as f32 * 0.1, y as f32 * 0.1, -away_m)
    };
    for (x, y) in (-20..20).flat_map(|x| (-20..20).map(move |y| (x, y))) {
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
        for vertices in [vec![a, b, c], vec![a, c, d]] {
            scene.apply(&polygon(None, vertices, WHITE), changes);
        }
    }
}

#[test]
fn auto_takes_what_was_visible_last_where_it_pays_and_leaves_it_out_in_the_open() {
    for has_wall in [true, false] {
        let (mut scene, mut changes) = (Scene::new(), Vec::new());
        if has_wall {
            rough_wall(&mut scene, &mut changes);
        }
        for k in 0..3000 {
            let place = Vec3::new((k % 60) as f32 * 0.04 - 1.2, (k / 60) as f32 * 0.04 - 1.0, -4.0);
            scene.apply(&square(place, 0.01), &mut changes);
        }
        let index = IndexKind::Osp.create(&IndexConfig::default());
        let config = PassConfig { polygon_ns: 800.0, ..PassConfig::new(Occlusion::Auto) };
        let mut pipeline = Pipeline::new(index, 8192).with_occlusion(config);
        let mut by_last = Vec::new();
        for frame in 0..600 {
            pipeline.frame(&scene, if frame == 0 { &changes } else { &[] }, &at_origin());
            by_last.push(pipeline.occlusion().is_some_and(OcclusionPass::is_by_last));
        }
        let late = by_last[500..].iter().filter(|&&by_last| by_last).count();
        let share = pipeline.draw_list().len() as f64 / pipeline.in_view().len() as f64;
        match has_wall {
            true => assert!(late > 80 && share < 0.6, "{late} of 100 frames, {share} drawn"),
            false => assert!(late < 3 && share == 1.0, "{late} of 100 frames, {share} drawn"),
        }
    }
}
