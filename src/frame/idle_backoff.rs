use crate::view::View;

/// Longest pause, frames: about a third of a second at 90 Hz.
const LONGEST: u32 = 32;

/// Cosine of 10 degrees. A larger rotation of the view ends the pause.
const TURN_COSINE: f32 = 0.985;

/// The pause ends if the number of polygons in view changes by 1 / `CHANGED_PART`.
const CHANGED_PART: u64 = 8;

/// Pauses occlusion culling while it finds no hidden polygon: it skips one frame, after the next vain test two frames,
/// then four, up to [`LONGEST`]. Skipped frames draw all polygons in view, which is conservative.
///
/// The pauses depend on counts and views alone, so they are the same on every machine.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct IdleBackoff {
    /// Number of frames still to skip.
    left: u32,
    /// Number of frames skipped after the last test.
    length: u32,
    /// Number of polygons in view at the last test.
    seen: u64,
    /// Number of views at the last test.
    views: usize,
    /// The first view at the last test.
    view: Option<View>,
}

impl IdleBackoff {
    /// Whether the frame skips occlusion culling. `comes_large` returns whether a polygon was inserted that
    /// may be a large occluder.
    pub(super) fn skips_frame(
        &mut self,
        seen: u64,
        views: &[View],
        comes_large: impl FnOnce() -> bool,
    ) -> bool {
        let Some(left) = self.left.checked_sub(1) else { return false };
        let is_turned = match (self.view, views.first()) {
            (Some(last), Some(view)) => {
                last.projection != view.projection
                    || last.forward_in_world().dot(view.forward_in_world()) < TURN_COSINE
            }
            _ => true,
        };
        if is_turned || views.len() != self.views || seen.abs_diff(self.seen) * CHANGED_PART > self.seen {
            *self = Self::default();
            return false;
        }
        if comes_large() {
            // The frame is tested. If the test finds no hidden polygon again, the next pause grows as usual.
            self.left = 0;
            return false;
        }
        self.left = left;
        true
    }

    /// Records the number of polygons that a test found hidden.
    pub(super) fn note(&mut self, found: u64, seen: u64, views: &[View]) {
        if found > 0 {
            *self = Self::default();
            return;
        }
        let length = (self.length * 2).clamp(1, LONGEST);
        *self = Self { left: length, length, seen, views: views.len(), view: views.first().copied() };
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::view::Projection;

    fn view(target: Vec3) -> View {
        View::look_at(Vec3::ZERO, target, Projection::symmetric(60.0, 1.0, 0.01, 100.0))
    }

    /// Runs `frames` frames, each with `found` hidden polygons, and counts the tests.
    fn count_tests(idle: &mut IdleBackoff, frames: u32, found: u64) -> u32 {
        let views = [view(Vec3::NEG_Z)];
        let mut tests = 0;
        for _ in 0..frames {
            if !idle.skips_frame(1000, &views, || false) {
                idle.note(found, 1000, &views);
                tests += 1;
            }
        }
        tests
    }

    #[test]
    fn it_tests_seldom_if_nothing_is_found_and_always_if_something_is() {
        let mut idle = IdleBackoff::default();
        assert_eq!(count_tests(&mut idle, 1000, 0), 6 + (1000 - 6 - 63) / 33 + 1);
        assert!(count_tests(&mut idle, 1000, 1) >= 1000 - LONGEST);
        assert_eq!(count_tests(&mut idle, 100, 1), 100);
    }

    #[test]
    fn a_large_change_ends_the_pause() {
        let ahead = [view(Vec3::NEG_Z)];
        let paused = || {
            let mut idle = IdleBackoff::default();
            count_tests(&mut idle, 100, 0);
            assert!(idle.skips_frame(1000, &ahead, || false));
            idle
        };
        assert!(paused().skips_frame(1100, &[view(Vec3::new(0.1, 0.0, -1.0))], || false));
        assert!(!paused().skips_frame(1200, &ahead, || false));
        assert!(!paused().skips_frame(800, &ahead, || false));
        assert!(!paused().skips_frame(1000, &[view(Vec3::new(0.3, 0.0, -1.0))], || false));
        assert!(!paused().skips_frame(1000, &[ahead[0], ahead[0]], || false));
        assert!(!paused().skips_frame(1000, &[], || false));
        let mut idle = paused();
        assert!(!idle.skips_frame(1000, &ahead, || true));
        idle.note(0, 1000, &ahead);
        assert_eq!(idle.left, LONGEST);
    }
}
