use crate::view::View;

/// Frames that are not looked at in a row, at most: a third of a second.
const LONGEST: u32 = 32;

/// A turn with a smaller cosine than this, 10 degrees, ends the rest.
const TURN_COSINE: f32 = 0.985;

/// So does a change of what is in view by this part, 1 / this.
const CHANGED_PART: u64 = 8;

/// Where large occluders hide nothing, they need not be looked for in every frame: after a frame in which nothing was found
/// the next is left out, then two, four, and so on. What could be found in them is drawn, which is never wrong.
///
/// It goes by counts and views alone, so it decides the same on every machine.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rest {
    /// Frames that are still to be left out.
    left: u32,
    /// Frames that were left out after the last look.
    length: u32,
    /// Polygons in view, views, and the first of them, when it was looked last.
    seen: u64,
    views: usize,
    view: Option<View>,
}

impl Rest {
    /// Whether a frame is left out. `comes_large` says whether something came that may hide much.
    pub(super) fn leaves_out(
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
            // Looked at once; if that finds nothing, either, the rest goes on as long as before.
            self.left = 0;
            return false;
        }
        self.left = left;
        true
    }

    /// Takes what a look has found.
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

    /// Looks among so many frames in each of which this much is found.
    fn looks(rest: &mut Rest, frames: u32, found: u64) -> u32 {
        let views = [view(Vec3::NEG_Z)];
        let mut looks = 0;
        for _ in 0..frames {
            if !rest.leaves_out(1000, &views, || false) {
                rest.note(found, 1000, &views);
                looks += 1;
            }
        }
        looks
    }

    #[test]
    fn it_looks_seldom_where_nothing_is_found_and_always_where_something_is() {
        let mut rest = Rest::default();
        assert_eq!(looks(&mut rest, 1000, 0), 6 + (1000 - 6 - 63) / 33 + 1);
        assert!(looks(&mut rest, 1000, 1) >= 1000 - LONGEST);
        assert_eq!(looks(&mut rest, 100, 1), 100);
    }

    #[test]
    fn what_changes_much_ends_the_rest() {
        let ahead = [view(Vec3::NEG_Z)];
        let resting = || {
            let mut rest = Rest::default();
            looks(&mut rest, 100, 0);
            assert!(rest.leaves_out(1000, &ahead, || false));
            rest
        };
        assert!(resting().leaves_out(1100, &[view(Vec3::new(0.1, 0.0, -1.0))], || false));
        assert!(!resting().leaves_out(1200, &ahead, || false));
        assert!(!resting().leaves_out(800, &ahead, || false));
        assert!(!resting().leaves_out(1000, &[view(Vec3::new(0.3, 0.0, -1.0))], || false));
        assert!(!resting().leaves_out(1000, &[ahead[0], ahead[0]], || false));
        assert!(!resting().leaves_out(1000, &[], || false));
        let mut rest = resting();
        assert!(!rest.leaves_out(1000, &ahead, || true));
        rest.note(0, 1000, &ahead);
        assert_eq!(rest.left, LONGEST);
    }
}
