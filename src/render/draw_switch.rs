/// Frames before the first try, so that what is measured is not the start.
const FIRST_TRY: u32 = 16;
/// Frames of a try whose time has come back; the first of them has nothing to go by and does not count.
const TRY_FRAMES: u32 = 4;
/// Frames after which a try ends whatever has come back.
const LONGEST_TRY: u32 = 24;
/// Frames from one try to the next, at least and at most.
const PAUSE: [u32; 2] = [64, 8192];
/// What tries may cost, as a part of what drawing costs.
const TRY_SHARE: f64 = 0.01;
/// The other way has to be faster by this factor to be taken.
const FASTER: f64 = 0.9;
/// Fewer polygons in view are drawn in less time than any test takes.
const LEAST_POLYGONS: usize = 2000;
/// Part of the new value in a moving average.
const WEIGHT: f64 = 0.1;

/// Decides for every frame whether to look for hidden polygons while drawing, by what frames have taken: now and then some
/// frames are drawn the other way, and the faster way is kept. It changes no picture.
#[derive(Clone, Debug, Default)]
pub(super) struct DrawSwitch {
    /// Whether frames are culled, but for tries.
    culls: bool,
    /// What a frame takes the way that is kept, nanoseconds.
    usual_ns: Option<f64>,
    /// What the frames of the try took so far: their number, and the least time.
    tried: Option<(u32, f64)>,
    /// Frames since the last try, or since this one began.
    since: u32,
    pause: u32,
}

impl DrawSwitch {
    /// Whether to cull the next frame; asked once a frame, with the number of polygons in view.
    pub(super) fn decide(&mut self, in_view: usize) -> bool {
        if in_view < LEAST_POLYGONS {
            return false;
        }
        self.since = self.since.saturating_add(1);
        match self.tried {
            Some(_) if self.since > LONGEST_TRY => self.end_try(),
            None if self.usual_ns.is_some() && self.since > self.pause.max(FIRST_TRY) => {
                (self.tried, self.since) = (Some((0, f64::INFINITY)), 0);
            }
            _ => {}
        }
        self.culls != self.tried.is_some()
    }

    /// Takes what a frame took, perhaps some frames later, and whether it was culled.
    pub(super) fn note(&mut self, culled: bool, ns: u64) {
        let ns = ns as f64;
        if culled == self.culls {
            let usual = self.usual_ns.unwrap_or(ns);
            self.usual_ns = Some(usual + WEIGHT * (ns - usual));
        } else if let Some((frames, least)) = &mut self.tried {
            *frames += 1;
            if *frames > 1 {
                *least = least.min(ns);
            }
            if *frames >= TRY_FRAMES {
                self.end_try();
            }
        }
    }

    fn end_try(&mut self) {
        let Some((_, tried_ns)) = self.tried.take() else { return };
        let usual_ns = self.usual_ns.unwrap_or(tried_ns);
        self.since = 0;
        if tried_ns < FASTER * usual_ns {
            (self.culls, self.usual_ns, self.pause) = (!self.culls, Some(tried_ns), PAUSE[0]);
            return;
        }
        // So long that what the try has cost more than its frames otherwise would is a small part.
        let lost = f64::from(TRY_FRAMES) * (tried_ns / usual_ns - 1.0).max(0.0) / TRY_SHARE;
        self.pause = if lost.is_finite() { (lost as u32).clamp(PAUSE[0], PAUSE[1]) } else { PAUSE[1] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws frames whose times come back `late` frames later; nanoseconds of all, and how many were culled at the end.
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
    fn tries_cost_little() {
        for (other, frames) in [(1_050_000, 20_000), (2_000_000, 20_000), (20_000_000, 20_000)] {
            let mut switch = DrawSwitch::default();
            let (total, _) = play(&mut switch, frames, 2, |culls, _| if culls { other } else { 1_000_000 });
            let more = total as f64 / (frames as f64 * 1.0e6);
            assert!(more < 1.02, "{more} with {other}");
        }
    }

    #[test]
    fn a_little_faster_is_not_enough_to_change() {
        let mut switch = DrawSwitch::default();
        let (_, culled) = play(&mut switch, 2000, 1, |culls, _| if culls { 950_000 } else { 1_000_000 });
        assert!(culled < 80, "{culled}");
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
