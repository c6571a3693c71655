use crate::{
    frame::{OcclusionRecord, Pass, PassInput},
    occlusion::{PreviousFrameOccluders, ViewInput},
    polygon::{Change, Geometry, VisibleBlocks},
};

/// Culling by the polygons visible in the last frame ([`PreviousFrameOccluders`]), as the pass of a [`super::Pipeline`].
#[derive(Debug)]
pub struct PreviousFramePass {
    culling: PreviousFrameOccluders,
    drawn: Vec<VisibleBlocks>,
    /// Number of polygons that each set of `drawn` has room for.
    capacity: usize,
}

impl PreviousFramePass {
    /// A pass before its first frame, with room for `capacity` polygons.
    pub fn new(capacity: usize) -> Self {
        let drawn = vec![VisibleBlocks::with_capacity(capacity)];
        Self {
            culling: PreviousFrameOccluders::new(PreviousFrameOccluders::PICTURE, capacity),
            drawn,
            capacity,
        }
    }

    /// Applies the changes of a frame.
    pub(super) fn follow(&mut self, changes: &[Change]) {
        self.culling.follow(changes);
    }

    /// Drops the hidden polygons of the last frame. Called before a frame.
    pub(super) fn forget(&mut self, views: usize) {
        (0..views).for_each(|view| self.culling.forget(view));
    }

    /// Culls all views. Returns the record of the frame, and its cost, nanoseconds, estimated from work counts.
    pub(super) fn cull(&mut self, frame: &PassInput<'_>) -> (OcclusionRecord, f64) {
        let PassInput { index, geometry, views, in_view, spaces, clock, .. } = *frame;
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
            let input = ViewInput { index, geometry, view, in_view: seen, spaces: spaces.get(i) };
            self.culling.cull(i, &input, drawn, &mut counts);
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
    fn load(&mut self, _: &dyn Geometry, changes: &[Change]) {
        self.follow(changes);
    }

    fn skip(&mut self, _: &dyn Geometry, changes: &[Change]) {
        self.follow(changes);
    }

    fn frame(&mut self, frame: &PassInput<'_>) -> OcclusionRecord {
        let start = frame.clock.start();
        self.follow(frame.changes);
        let select = frame.clock.since(start);
        OcclusionRecord { select, ..self.cull(frame).0 }
    }

    fn drawn(&self) -> &[VisibleBlocks] {
        &self.drawn
    }
}
