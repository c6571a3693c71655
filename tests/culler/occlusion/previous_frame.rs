//! Occluders of the frame before.

use glam::Vec3;

use osp::{
    frame::{Pipeline, PreviousFramePass},
    index::IndexConfig,
    polygon::{Change, PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Author, Event},
    scene::Scene,
};

fn square(center: Vec3, half_m: f32) -> Event {
    let corner = |x: f32, y: f32| center + Vec3::new(x, y, 0.0) * half_m;
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, color: (1.0, 1.0, 1.0, 1.0) }
}

/// What is drawn of each view in the fourth frame at rest.
fn at_rest(scene: &Scene, changes: &[Change], views: &[View]) -> Vec<Vec<PolygonId>> {
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
