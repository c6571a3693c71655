/// What an occluded polygon saves and what the stages cost: the basis on which occlusion is switched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoConfig {
    /// What drawing one polygon costs, nanoseconds. A renderer measures it: frame time over polygons drawn.
    pub polygon_ns: f64,
    /// It pays if it saves at least this many times what it costs.
    pub least_ratio: f64,
    /// Frames in a row in which it does not pay before it is switched off.
    pub patience: u32,
    /// While it is off, one frame in this many tries it.
    pub probe_every: u32,
}

impl Default for AutoConfig {
    /// 10 ns a polygon, 1.2 times the cost, 8 frames, one in 32.
    fn default() -> Self {
        Self { polygon_ns: 10.0, least_ratio: 1.2, patience: 8, probe_every: 32 }
    }
}

/// What one frame's occlusion culling cost, over culling by the frustum alone, and what it brought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Choosing occluders, building, and testing nodes, nanoseconds.
    pub cost_ns: f64,
    /// Polygons not drawn because of it.
    pub culled: u64,
}

/// Part of the new value in a moving average.
const WEIGHT: f64 = 0.2;

/// Decides for every frame whether to cull by occlusion: off while it does not pay, with a try at intervals.
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
    /// Frames until the next try; 0 while it is on.
    until_probe: u32,
}

impl AutoSwitch {
    /// A switch that is on, knowing nothing.
    pub fn new(config: AutoConfig) -> Self {
        Self { config, cost_ns: 0.0, gain_ns: 0.0, known: false, losing: 0, until_probe: 0 }
    }

    /// Whether it is on.
    pub fn is_on(&self) -> bool {
        self.losing < self.config.patience
    }

    /// Whether to cull by occlusion in the next frame; asked once a frame, before it.
    pub fn decide(&mut self) -> bool {
        if self.is_on() {
            return true;
        }
        self.until_probe = self.until_probe.saturating_sub(1);
        self.until_probe == 0
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
            self.losing += 1;
        }
        if !self.is_on() {
            self.until_probe = self.config.probe_every.max(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn play(switch: &mut AutoSwitch, frames: u32, outcome: impl Fn(u32) -> Outcome) -> u32 {
        let mut used = 0;
        for frame in 0..frames {
            if switch.decide() {
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
        let used = play(&mut switch, 8 + 3200, |_| Outcome { cost_ns: 50_000.0, culled: 100 });
        assert_eq!(used, 8 + 100);
        assert!(!switch.is_on());
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
}
