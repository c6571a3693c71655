use osp::occlusion::TryBudget;

/// Number of frames before the first try. The first frames of a program are slow, with or without culling.
const FIRST_TRY: u32 = 16;
/// The time of each state, with culling and without, is the fastest of this number of frames. Disturbances only make
/// frames longer.
const MEASURED: usize = 4;
/// Number of frames of a try. The first frame has no previous frame and does not count.
const TRY_FRAMES: u32 = MEASURED as u32 + 1;
/// A try ends after this number of frames, even if the GPU has not returned the times of some frames.
const LONGEST_TRY: u32 = 24;
const PAUSE: [u32; 2] = [64, 8192];
/// Largest fraction of the drawing time that tries may add.
const TRY_SHARE: f64 = 0.01;
/// The switch turns culling on or off if frames in the other state take less than this fraction of the current time.
const FASTER: f64 = 0.98;
/// With fewer polygons in view, drawing takes less time than any test.
const LEAST_POLYGONS: usize = 2000;

/// Decides for every frame whether the GPU culls hidden polygons. At intervals it turns culling on or off for a few
/// frames, and keeps the faster state. Both states draw the same picture.
#[derive(Clone, Debug)]
pub(super) struct DrawSwitch {
    /// Whether frames are culled, except during a try.
    culls: bool,
    /// Times of the last frames drawn in the state `culls`, nanoseconds; infinite where no frame was measured yet.
    usual_ns: [f64; MEASURED],
    tried: Option<Tried>,
    budget: TryBudget,
    /// Time that the frames of the last try took beyond usual frames, nanoseconds.
    price_ns: Option<f64>,
}

/// The frames of a try so far.
#[derive(Clone, Copy, Debug)]
struct Tried {
    /// Number of frames since the try began, with or without a returned time.
    begun: u32,
    /// Number of frames of the try whose times the GPU has returned.
    frames: u32,
    all_ns: f64,
    /// Time of the fastest frame except the first, nanoseconds.
    least_ns: f64,
}

impl Default for DrawSwitch {
    fn default() -> Self {
        Self {
            culls: false,
            usual_ns: [f64::INFINITY; MEASURED],
            tried: None,
            budget: TryBudget::default(),
            price_ns: None,
        }
    }
}

impl DrawSwitch {
    /// Whether to cull the next frame. Called once a frame, with the number of polygons in view.
    pub(super) fn decide(&mut self, in_view: usize) -> bool {
        if in_view < LEAST_POLYGONS {
            return false;
        }
        if let Some(tried) = &mut self.tried {
            tried.begun += 1;
            if tried.begun > LONGEST_TRY {
                self.end_try();
            }
        } else if self.is_try_due() {
            self.tried = Some(Tried { begun: 0, frames: 0, all_ns: 0.0, least_ns: f64::INFINITY });
        }
        self.culls != self.tried.is_some()
    }

    /// Records the time of a frame, and whether it was culled. The time may arrive some frames late.
    pub(super) fn note(&mut self, culled: bool, ns: u64) {
        let ns = ns as f64;
        if culled == self.culls {
            self.usual_ns.rotate_left(1);
            self.usual_ns[MEASURED - 1] = ns;
        } else if let Some(tried) = &mut self.tried {
            tried.frames += 1;
            tried.all_ns += ns;
            if tried.frames > 1 {
                tried.least_ns = tried.least_ns.min(ns);
            }
            if tried.frames >= TRY_FRAMES {
                self.end_try();
            }
        }
    }

    /// Returns whether a try begins in this frame. If not, the frame adds to the time budget of the next try.
    fn is_try_due(&mut self) -> bool {
        let usual_ns = self.usual();
        if usual_ns.is_infinite() {
            return false;
        }
        let (price_ns, least) = self.price_ns.map_or((0.0, FIRST_TRY), |price_ns| (price_ns, PAUSE[0]));
        self.budget.save(TRY_SHARE * usual_ns, price_ns);
        self.budget.is_due(price_ns, least) || self.budget.frames() >= PAUSE[1]
    }

    fn usual(&self) -> f64 {
        self.usual_ns.iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn end_try(&mut self) {
        let Some(Tried { frames, all_ns, least_ns, .. }) = self.tried.take() else { return };
        let usual_ns = self.usual();
        self.budget.restart();
        self.price_ns = Some((all_ns - f64::from(frames) * usual_ns).max(0.0));
        if least_ns < FASTER * usual_ns {
            (self.culls, self.usual_ns) = (!self.culls, [least_ns; MEASURED]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws frames whose times come back `late` frames later. Returns the total time, nanoseconds, and the number of
    /// culled frames at the end.
    fn play(
        switch: &mut DrawSwitch,
        frames: usize,
        late: usize,
        ns: impl Fn(bool, usize) -> u64,
    ) -> (u64, u32) {
        let (mut waiting, mut total, mut culled) = (std::collections::VecDeque::new(), 0, 0);
        for frame in 0..frames {
            let culls = switch.decide(10_000);
            let took = ns(culls, frame);
            total += took;
            culled += u32::from(culls && frame >= frames / 2);
            waiting.push_back((culls, took));
            if waiting.len() > late
                && let Some((culls, took)) = waiting.pop_front()
            {
                switch.note(culls, took);
            }
        }
        (total, culled)
    }

    #[test]
    fn it_finds_and_keeps_the_faster_way() {
        for late in [0, 3] {
            let mut switch = DrawSwitch::default();
            let (_, culled) =
                play(&mut switch, 1000, late, |culls, _| if culls { 400_000 } else { 1_000_000 });
            assert!(culled > 480, "{culled} of 500, {late} late");
            let (_, culled) =
                play(&mut switch, 4000, late, |culls, _| if culls { 1_000_000 } else { 500_000 });
            assert!(culled < 60, "{culled} of 2000, {late} late");
        }
    }

    #[test]
    fn it_is_within_two_per_cent_of_the_better_way() {
        // Other programs make frames up to a tenth longer.
        let noise = |frame: usize| (frame * 7919 % 101) as f64 / 1000.0;
        for culled in [0.5, 0.9, 0.97, 1.0, 1.03, 1.1, 2.0, 20.0] {
            let (mut switch, frames) = (DrawSwitch::default(), 20_000);
            let (total, _) = play(&mut switch, frames, 1, |culls, frame| {
                let ms = if culls { culled } else { 1.0 };
                (ms * (1.0 + noise(frame)) * 1.0e6) as u64
            });
            let best = (0..frames).map(|frame| culled.min(1.0) * (1.0 + noise(frame)) * 1.0e6).sum::<f64>();
            assert!(total as f64 <= 1.02 * best, "{culled}: {}", total as f64 / best);
        }
    }

    #[test]
    fn small_frames_are_never_culled() {
        let mut switch = DrawSwitch::default();
        assert!((0..1000).all(|_| {
            switch.note(false, 1_000_000);
            !switch.decide(LEAST_POLYGONS - 1)
        }));
    }
}
