//! Measured times, by which the plugin chooses the faster method: the index, or a plain pass over all entities. The
//! times depend more on the load of the processor's caches than on the number of entities.

use std::time::Instant;

/// Number of candidates whose tests take about as long as the fixed work for a view.
const FIXED: usize = 64;

/// The plugin drops the index once the frames with a loss outnumber the frames without a loss by more than this.
const MOST_LOSSES: u32 = 16;

/// A frame is a loss if updating the index takes longer than the time saved plus this fraction of the time of all
/// views.
const TOLERANCE: f32 = 1.0 / 16.0;

/// The kinds of views, which test an entity differently.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "light"), expect(dead_code, reason = "only lights use the other kinds"))]
pub(crate) enum Kind {
    Camera,
    Cascade,
    Lamp,
}

/// An estimate of a median, in nanoseconds; 0 if there is none yet. Single frames, however long, change it little.
#[derive(Debug, Default)]
struct Median(f32);

impl Median {
    fn note(&mut self, nanos: f32) {
        self.0 = if self.0 == 0.0 { nanos } else { self.0 * if nanos > self.0 { 1.03 } else { 0.97 } };
    }
}

/// The times of one kind of view.
#[derive(Debug, Default)]
struct Costs {
    /// Time per entity in a plain pass.
    pass: Median,
    /// Time per candidate of the index.
    found: Median,
}

#[derive(Debug, Default)]
pub(crate) struct Meter {
    kinds: [Costs; 3],
    started: Option<Instant>,
    /// Time of all views of this frame.
    views_ns: f32,
    /// Time that the index has saved in this frame.
    saved_ns: f32,
    losses: u32,
}

impl Meter {
    /// Starts a measurement, if `is_measured`.
    pub(crate) fn start(&mut self, is_measured: bool) {
        self.started = is_measured.then(Instant::now);
    }

    fn stop(&mut self) -> Option<f32> {
        Some(self.started.take()?.elapsed().as_nanos() as f32)
    }

    /// Whether a plain pass over all entities is faster than tests of the candidates.
    pub(crate) fn is_pass_faster(&mut self, kind: Kind, found: usize, entities: usize) -> bool {
        let Costs { pass, found: each } = &mut self.kinds[kind as usize];
        let is_faster = pass.0 > 0.0 && (found + FIXED) as f32 * each.0 > entities as f32 * pass.0;
        if is_faster {
            // The estimate decays, so that the index is tried again later.
            each.0 *= 0.995;
        }
        is_faster
    }

    /// Ends the measurement of a view with `found` candidates, or of `parts` plain passes over `entities`.
    pub(crate) fn end_views(&mut self, kind: Kind, parts: usize, found: Option<usize>, entities: usize) {
        if let Some(nanos) = self.stop() {
            self.note_views(kind, parts, found, entities, nanos);
        }
    }

    fn note_views(&mut self, kind: Kind, parts: usize, found: Option<usize>, entities: usize, nanos: f32) {
        self.views_ns += nanos;
        let tests = (parts * entities.max(1)) as f32;
        let costs = &mut self.kinds[kind as usize];
        if let Some(found) = found {
            costs.found.note(nanos / (found + FIXED) as f32);
            if costs.pass.0 > 0.0 {
                self.saved_ns += tests * costs.pass.0 - nanos;
            }
            // The estimate decays, so that a pass is tried again later.
            costs.pass.0 *= 0.999;
        } else {
            costs.pass.note(nanos / tests);
        }
    }

    /// Resets the losses for a new index.
    pub(crate) fn begin_index(&mut self) {
        self.losses = 0;
    }

    /// Ends the measurement of a frame's changes; returns whether the index costs more than it saves.
    pub(crate) fn end_changes(&mut self, is_filled: bool) -> bool {
        let nanos = self.stop();
        self.note_changes(is_filled, nanos)
    }

    fn note_changes(&mut self, is_filled: bool, nanos: Option<f32>) -> bool {
        let (views_ns, saved_ns) = (std::mem::take(&mut self.views_ns), std::mem::take(&mut self.saved_ns));
        let Some(nanos) = nanos.filter(|_| is_filled && views_ns > 0.0) else { return false };
        let is_loss = nanos > saved_ns + views_ns * TOLERANCE;
        self.losses = if is_loss { self.losses + 1 } else { self.losses.saturating_sub(1) };
        self.losses > MOST_LOSSES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faster_method_is_chosen_after_both_were_measured() {
        let mut meter = Meter::default();
        assert!(!meter.is_pass_faster(Kind::Camera, 1000, 1000), "nothing is measured yet");
        meter.note_views(Kind::Camera, 1, None, 1000, 100.0);
        meter.note_views(Kind::Camera, 1, Some(0), 1000, 10.0);
        assert!(!meter.is_pass_faster(Kind::Camera, 100, 1000));
        assert!(meter.is_pass_faster(Kind::Camera, 900, 1000));
        assert!(!meter.is_pass_faster(Kind::Lamp, 900, 1000), "other views have other times");
        // After some frames, the meter tries the other method again.
        let tries = (0..500).filter(|_| !meter.is_pass_faster(Kind::Camera, 900, 1000)).count();
        assert!(tries > 0 && tries < 500, "{tries}");
    }

    #[test]
    fn an_index_that_costs_more_than_it_saves_is_given_up() {
        for (changes_ns, is_loss) in [(20.0, false), (400.0, true)] {
            let mut meter = Meter::default();
            meter.note_views(Kind::Camera, 1, None, 1000, 100.0);
            let is_given_up = (0..40).any(|_| {
                meter.note_views(Kind::Camera, 1, Some(10), 1000, 10.0);
                meter.note_changes(true, Some(changes_ns))
            });
            assert_eq!(is_given_up, is_loss, "{changes_ns} ns");
        }
    }
}
