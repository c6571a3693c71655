use crate::{
    frame::{OcclusionRecord, Pass, PassInput},
    occlusion::{DepthConfig, PreviousFrameOccluders},
    polygon::{Change, Geometry, VisibleBlocks},
};

/// Culling by what was visible in the last frame ([`PreviousFrameOccluders`]) as a stage of a [`super::Pipeline`].
#[derive(Debug)]
pub struct PreviousFramePass {
    culling: PreviousFrameOccluders,
    drawn: Vec<VisibleBlocks>,
    /// Polygons that each of these has room for.
    capacity: usize,
}

impl PreviousFramePass {
    /// A stage that has seen nothing yet, with room for this many polygons.
    pub fn new(capacity: usize) -> Self {
        let drawn = vec![VisibleBlocks::with_capacity(capacity)];
        Self { culling: PreviousFrameOccluders::new(DepthConfig::default(), capacity), drawn, capacity }
    }

    /// Before a frame: takes all that is in view for what was visible in the last one.
    pub(super) fn begin(&mut self, in_view: &[VisibleBlocks]) {
        for (i, seen) in in_view.iter().enumerate() {
            self.culling.begin(i, seen);
        }
    }

    /// What a frame was like, and about what it cost by its work counts, nanoseconds.
    pub(super) fn cull(&mut self, frame: &PassInput<'_>) -> (OcclusionRecord, f64) {
        let PassInput { geometry, views, in_view, clock, .. } = *frame;
        let mut work_ns = 0.0;
        let mut record = OcclusionRecord { used: true, by_last: true, ..OcclusionRecord::default() };
        self.drawn.resize_with(views.len(), || VisibleBlocks::with_capacity(self.capacity));
        for (i, ((view, seen), drawn)) in views.iter().zip(in_view).zip(&mut self.drawn).enumerate() {
            drawn.clear();
            let Some(window) = view.window() else {
                drawn.copy_from(seen);
                continue;
            };
            let start = clock.start();
            let mut counts = self.culling.build(i, geometry, &window, seen);
            record.build += clock.since(start);

            let start = clock.start();
            self.culling.cull(i, geometry, seen, drawn, &mut counts);
            record.query += clock.since(start);
            record.occluders += counts.occluders;
            record.nodes += counts.tiles;
            record.tests += counts.tests;
            work_ns += counts.work_ns();
            record.occluded += (seen.len() - drawn.len()) as u64;
        }
        (record, work_ns)
    }
}

impl Pass for PreviousFramePass {
    fn load(&mut self, _: &dyn Geometry, _: &[Change]) {}

    fn skip(&mut self, _: &dyn Geometry, _: &[Change]) {}

    fn frame(&mut self, frame: &PassInput<'_>) -> OcclusionRecord {
        self.cull(frame).0
    }

    fn drawn(&self) -> &[VisibleBlocks] {
        &self.drawn
    }
}

#[cfg(all(test, feature = "lab"))]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        frame::{Pipeline, StageClock},
        index::IndexConfig,
        polygon::{Change, PolygonId},
        recording::{Author, Event},
        rivals::IndexKind,
        scene::Scene,
        view::{Projection, View},
    };

    fn square(center: Vec3, half_m: f32) -> Event {
        let corner = |x: f32, y: f32| center + Vec3::new(x, y, 0.0) * half_m;
        let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, color: (1.0, 1.0, 1.0, 1.0) }
    }

    /// What is drawn of each view in the fourth frame at rest.
    fn at_rest(scene: &Scene, changes: &[Change], views: &[View]) -> Vec<Vec<PolygonId>> {
        let index = IndexKind::Osp.create(&IndexConfig::default());
        let mut pipeline =
            Pipeline::new(index, 256, StageClock::default()).with_pass(PreviousFramePass::new(256));
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
}
