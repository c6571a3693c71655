use crate::{
    index::DrawList,
    metrics::{OcclusionRecord, StageClock, fingerprint_of_views},
    occlusion::{DepthConfig, LastVisible},
    scene::Scene,
    visibility::View,
};

/// Culling by what was visible in the last frame ([`LastVisible`]) as a stage of a [`super::Pipeline`].
#[derive(Debug)]
pub struct LastPass {
    culling: LastVisible,
    drawn: Vec<DrawList>,
    /// Polygons that each of these has room for.
    capacity: usize,
}

impl LastPass {
    /// A stage that has seen nothing yet, with room for this many polygons.
    pub fn new(capacity: usize) -> Self {
        let drawn = vec![DrawList::with_capacity(capacity)];
        Self { culling: LastVisible::new(DepthConfig::default(), capacity), drawn, capacity }
    }

    /// Before a frame: takes all that is in view for what was visible in the last one.
    pub(super) fn begin(&mut self, in_view: &[DrawList]) {
        for (i, seen) in in_view.iter().enumerate() {
            self.culling.begin(i, seen.ids());
        }
    }

    /// A frame: `in_view[i]` is what the frustum of `views[i]` may see. Also about what it cost by its
    /// work counts, nanoseconds.
    pub(super) fn frame(
        &mut self,
        scene: &Scene,
        views: &[View],
        in_view: &[DrawList],
        clock: &StageClock,
    ) -> (OcclusionRecord, f64) {
        let mut work_ns = 0.0;
        let mut record = OcclusionRecord { used: true, by_last: true, ..OcclusionRecord::default() };
        self.drawn.resize_with(views.len(), || DrawList::with_capacity(self.capacity));
        for (i, ((view, seen), drawn)) in views.iter().zip(in_view).zip(&mut self.drawn).enumerate() {
            drawn.clear();
            let Some(window) = view.window() else {
                drawn.extend_from_slice(seen.ids());
                continue;
            };
            let start = clock.start();
            let mut counts = self.culling.build(i, scene, &window, seen.ids());
            record.build += clock.since(start);

            let start = clock.start();
            self.culling.cull(i, scene, seen.ids(), drawn, &mut counts);
            record.query += clock.since(start);
            record.occluders += counts.occluders;
            record.nodes += counts.tiles;
            record.tests += counts.tests;
            work_ns += counts.work_ns();
            record.occluded += (seen.len() - drawn.len()) as u64;
        }
        record.fingerprint = fingerprint_of_views(&self.drawn);
        (record, work_ns)
    }

    /// What is left of each view.
    pub(super) fn drawn(&self) -> &[DrawList] {
        &self.drawn
    }
}
