/// What an occluded polygon saves and what the stages cost: the basis on which occlusion is switched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoConfig {
    /// What drawing one polygon costs, nanoseconds. A renderer measures it: frame time over polygons drawn.
    pub polygon_ns: f64,
    /// It pays if it saves at least this many times what it costs.
    pub least_ratio: f64,
    /// Frames in a row in which it does not pay before it is switched off.
    pub patience: u32,
    /// While it is off, at most one frame in this many tries it.
    pub probe_every: u32,
    /// While it is off, tries may cost this part of what drawing costs, in the long run.
    pub probe_share: f64,
    /// While it is off, keeping candidates for occluders may cost this part of what drawing costs, in the long run.
    pub keep_share: f64,
}

impl Default for AutoConfig {
    /// 10 ns a polygon, 1.2 times the cost, 8 frames, at most one in 32; 0.4 % of the drawing, and 0.8 % for candidates.
    fn default() -> Self {
        Self {
            polygon_ns: 10.0,
            least_ratio: 1.2,
            patience: 8,
            probe_every: 32,
            probe_share: 0.004,
            keep_share: 0.008,
        }
    }
}

/// What one frame's occlusion culling cost, over culling by the frustum alone, and what it brought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Following the candidates, choosing among them, building, and testing nodes, nanoseconds.
    pub cost_ns: f64,
    /// Polygons not drawn because of it.
    pub culled: u64,
}

/// Part of the new value in a moving average.
const WEIGHT: f64 = 0.2;

/// A frame that gains less than this part of what it costs counts as [`HOPELESS_FRAMES`] that do not pay.
const HOPELESS: f64 = 0.25;
/// See [`HOPELESS`].
const HOPELESS_FRAMES: u32 = 3;

/// About the least that a frame costs, nanoseconds: choosing among the candidates and building from few occluders.
const LEAST_COST_NS: f64 = 30_000.0;

/// Most that is put aside for keeping candidates, nanoseconds: the longest frame that it makes.
const MOST_IDLE_NS: f64 = 300_000.0;

/// Decides for every frame whether to cull by occlusion: off while it does not pay, with a try at intervals.
///
/// A try has to be earned: every frame without occlusion puts [`AutoConfig::probe_share`] of its drawing aside, and a
/// frame in which even culling everything would not pay is never tried.
///
/// It has no clock. Given measured costs it adapts to the machine; given costs computed from work counts
/// ([`super::work_ns`]) it decides the same on every machine, which a replay that is compared by fingerprint needs.
#[derive(Clone, Debug)]
pub struct AutoSwitch {
    config: AutoConfig,
    cost_ns: f64,
    gain_ns: f64,
    known: bool,
    losing: u32,
    /// Frames since the last try, while it is off.
    waited: u32,
    /// What may be spent on the next try, nanoseconds.
    saved_ns: f64,
    /// What may be spent on keeping candidates, nanoseconds.
    idle_ns: f64,
}

impl AutoSwitch {
    /// A switch that is on, knowing nothing.
    pub fn new(config: AutoConfig) -> Self {
        Self {
            config,
            cost_ns: 0.0,
            gain_ns: 0.0,
            known: false,
            losing: 0,
            waited: 0,
            saved_ns: 0.0,
            idle_ns: 0.0,
        }
    }

    /// Whether it is on.
    pub fn is_on(&self) -> bool {
        self.losing < self.config.patience
    }

    /// Whether to cull the next frame by occlusion; asked once a frame, before it, with the number of polygons that the
    /// frustum may see.
    pub fn decide(&mut self, in_view: u64) -> bool {
        // Drawing all of them: no method saves more.
        let all_ns = in_view as f64 * self.config.polygon_ns;
        let may_pay = all_ns >= self.config.least_ratio * LEAST_COST_NS;
        if self.is_on() && may_pay {
            return true;
        }
        if self.is_on() || !may_pay {
            return false;
        }
        self.idle_ns = (self.idle_ns + self.config.keep_share * all_ns).min(MOST_IDLE_NS);
        self.waited = self.waited.saturating_add(1);
        self.saved_ns = (self.saved_ns + self.config.probe_share * all_ns).min(self.cost_ns);
        let probes = self.waited >= self.config.probe_every && self.saved_ns >= self.cost_ns;
        if probes {
            (self.waited, self.saved_ns) = (0, 0.0);
        }
        probes
    }

    /// What a frame without occlusion may spend on keeping candidates, nanoseconds.
    pub fn idle_budget_ns(&self) -> f64 {
        self.idle_ns
    }

    /// Takes off what it has spent.
    pub fn spend_idle(&mut self, ns: f64) {
        self.idle_ns -= ns;
    }

    /// Takes the outcome of a frame in which it was used.
    pub fn note(&mut self, outcome: Outcome) {
        let gain_ns = outcome.culled as f64 * self.config.polygon_ns;
        // A try after a pause counts for itself: what was before is out of date.
        let weight = if self.known && self.is_on() { WEIGHT } else { 1.0 };
        self.known = true;
        self.cost_ns += weight * (outcome.cost_ns - self.cost_ns);
        self.gain_ns += weight * (gain_ns - self.gain_ns);
        if self.gain_ns >= self.config.least_ratio * self.cost_ns {
            self.losing = 0;
        } else if self.is_on() {
            let is_hopeless = self.gain_ns < HOPELESS * self.cost_ns;
            self.losing += if is_hopeless { HOPELESS_FRAMES } else { 1 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IN_VIEW: u64 = 50_000;

    fn play(switch: &mut AutoSwitch, frames: u32, outcome: impl Fn(u32) -> Outcome) -> u32 {
        let mut used = 0;
        for frame in 0..frames {
            if switch.decide(IN_VIEW) {
                used += 1;
                switch.note(outcome(frame));
            }
        }
        used
    }

    #[test]
    fn it_stays_on_while_it_pays() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        assert_eq!(play(&mut switch, 1000, |_| Outcome { cost_ns: 50_000.0, culled: 10_000 }), 1000);
    }

    #[test]
    fn it_goes_off_when_it_does_not_pay_and_tries_at_intervals() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        let used = play(&mut switch, 8 + 3200, |_| Outcome { cost_ns: 50_000.0, culled: 4_000 });
        assert_eq!(used, 8 + 100, "0.4 % of 500 µs pays for 50 µs in 25 frames; one in 32 is the most");
        assert!(!switch.is_on());
        let mut switch = AutoSwitch::new(AutoConfig::default());
        assert_eq!(play(&mut switch, 20, |_| Outcome { cost_ns: 50_000.0, culled: 100 }), 3, "hopeless");
    }

    #[test]
    fn tries_cost_little_of_the_drawing() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        play(&mut switch, 100, |_| Outcome { cost_ns: 400_000.0, culled: 100 });
        let used = play(&mut switch, 8000, |_| Outcome { cost_ns: 400_000.0, culled: 100 });
        assert!((36..=40).contains(&used), "{used} tries of 0.4 ms in 8000 frames of 0.5 ms");
    }

    #[test]
    fn it_comes_back_at_the_first_try_that_pays() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        play(&mut switch, 100, |_| Outcome { cost_ns: 50_000.0, culled: 0 });
        assert!(!switch.is_on());
        let used = play(&mut switch, 100, |_| Outcome { cost_ns: 50_000.0, culled: 50_000 });
        assert!(switch.is_on() && used >= 100 - 32, "{used}");
    }

    #[test]
    fn one_bad_frame_does_not_switch_it_off() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        let outcome = |frame| Outcome { cost_ns: 50_000.0, culled: if frame % 16 == 0 { 0 } else { 10_000 } };
        assert_eq!(play(&mut switch, 1000, outcome), 1000);
    }

    #[test]
    fn where_nothing_could_be_gained_nothing_is_tried() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        assert!((0..500).all(|_| !switch.decide(1000)), "10 µs of drawing");
        assert!(switch.decide(IN_VIEW));
    }

    #[test]
    fn keeping_candidates_is_paid_for_by_drawing() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        assert_eq!(switch.idle_budget_ns(), 0.0);
        play(&mut switch, 8, |_| Outcome { cost_ns: 50_000.0, culled: 0 });
        assert!(!switch.is_on());
        let mut spent = 0.0;
        for _ in 0..1000 {
            if switch.decide(IN_VIEW) {
                switch.note(Outcome { cost_ns: 50_000.0, culled: 0 });
            }
            let ns = switch.idle_budget_ns();
            switch.spend_idle(ns);
            spent += ns;
        }
        let drawing = 1000.0 * IN_VIEW as f64 * 10.0;
        assert!(spent > 0.0075 * drawing && spent < 0.0081 * drawing, "{spent} of {drawing}");
    }
}
