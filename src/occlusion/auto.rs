use super::{Occlusion, TryBudget};

/// Settings of [`AutoSwitch`]: when a method of occlusion culling is worth its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AutoConfig {
    /// What drawing one polygon costs, nanoseconds. A renderer measures it: frame time over polygons drawn.
    pub polygon_ns: f64,
    /// A method pays if the drawing time that it saves is at least this many times its own time.
    pub least_ratio: f64,
    /// A method that is tried replaces the one in use if a frame takes less than this part of the time with it.
    pub faster: f64,
    /// After this many frames in a row that do not pay, the method in use is switched off.
    pub patience: u32,
    /// A method that is not in use is tried at most once in this many frames.
    pub probe_every: u32,
    /// All tries together may take this part of the drawing time, in the long run.
    pub probe_share: f64,
    /// While large occluders are not in use, following the candidates for them may take this part of the drawing time,
    /// in the long run.
    pub keep_share: f64,
}

impl Default for AutoConfig {
    /// 10 ns a polygon, 1.2 times the cost, 0.9 of the time, 8 frames, at most one in 32; 0.4 % of the drawing, and 0.8 %
    /// for candidates.
    fn default() -> Self {
        Self {
            polygon_ns: 10.0,
            least_ratio: 1.2,
            faster: 0.9,
            patience: 8,
            probe_every: 32,
            probe_share: 0.004,
            keep_share: 0.008,
        }
    }
}

/// The methods to choose from, besides frustum culling alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// [`Occlusion::Msvbsp`].
    Msvbsp,
    /// [`Occlusion::DepthLast`].
    DepthLast,
}

impl From<Option<Method>> for Occlusion {
    fn from(method: Option<Method>) -> Self {
        match method {
            None => Self::None,
            Some(Method::Msvbsp) => Self::Msvbsp,
            Some(Method::DepthLast) => Self::DepthLast,
        }
    }
}

impl Method {
    const ALL: [Self; 2] = [Self::Msvbsp, Self::DepthLast];

    /// About the least time that this method takes in a frame, nanoseconds. Large occluders: to select them and to build
    /// the tree. Previous-frame occluders: that, and a test for every four polygons in view.
    fn least_ns(self, in_view: u64) -> f64 {
        match self {
            Self::Msvbsp => 30_000.0,
            Self::DepthLast => 30_000.0 + 60.0 * in_view as f64,
        }
    }

    /// Whether the first frame of a try says little about the next ones: nothing is known yet of the previous frame, so
    /// everything in view is filled into the depth buffer.
    fn has_to_start(self) -> bool {
        self == Self::DepthLast
    }
}

/// Time and result of one frame's occlusion culling, compared with frustum culling alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Outcome {
    /// Time to follow the candidates, select occluders, build the culler and test, nanoseconds.
    pub cost_ns: f64,
    /// Polygons culled.
    pub culled: u64,
}

/// Weight of the newest value in a moving average.
const WEIGHT: f64 = 0.2;

/// A frame that gains less than this part of what it costs counts as [`HOPELESS_FRAMES`] that do not pay.
const HOPELESS: f64 = 0.25;
/// See [`HOPELESS`].
const HOPELESS_FRAMES: u32 = 3;

/// Assumed time of the first try of previous-frame occluders, nanoseconds for each polygon in view: its first frame fills
/// the outlines of all of them, its second frame of those that were left.
const FIRST_PRICE_NS: f64 = 6_000.0;

/// A try that takes more frames than this to save for is not made; twice as many where two methods take turns.
const MOST_FRAMES_FOR_A_TRY: f64 = 2048.0;

/// Most time that is saved for following candidates, nanoseconds: one frame may spend all of it.
const MOST_IDLE_NS: f64 = 300_000.0;

/// What is known of a method.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    /// A moving average while the method is in use, else what its last try measured.
    cost_ns: f64,
    gain_ns: f64,
    /// Time of its last try, nanoseconds for each polygon in view.
    price_ns: Option<f64>,
    /// For its next try, while it is not in use.
    budget: TryBudget,
}

/// A try that has begun.
#[derive(Clone, Copy, Debug)]
struct Try {
    method: Method,
    /// Time of its frames so far, nanoseconds.
    spent_ns: f64,
    /// The first of its two frames has not been measured yet.
    is_first: bool,
}

/// Decides for every frame which method of occlusion culling to use, if any. Methods that are not in use are tried at
/// intervals; the one with the shortest frames is kept.
///
/// Time for tries is saved in advance: every frame saves [`AutoConfig::probe_share`] of its drawing time. Where even
/// culling everything would not pay, nothing is tried.
///
/// It has no clock. Given measured costs it adapts to the machine; given costs computed from work counts
/// ([`super::work_ns`], [`super::PreviousFrameCounts::work_ns`]) it decides the same on every machine, which a replay that is
/// compared by fingerprint needs.
#[derive(Clone, Debug)]
pub(crate) struct AutoSwitch {
    config: AutoConfig,
    kept: Option<Method>,
    known: [Known; Method::ALL.len()],
    /// The kept method has been measured.
    is_measured: bool,
    /// Frames in a row in which it did not pay.
    losing: u32,
    trying: Option<Try>,
    /// Polygons in view in the last frame that was decided.
    in_view: u64,
    /// Time saved for following candidates, nanoseconds.
    idle_ns: f64,
}

impl AutoSwitch {
    /// A switch without measurements; it begins with large occluders.
    pub(crate) fn new(config: AutoConfig) -> Self {
        Self {
            config,
            kept: Some(Method::Msvbsp),
            known: Default::default(),
            is_measured: false,
            losing: 0,
            trying: None,
            in_view: 0,
            idle_ns: 0.0,
        }
    }

    /// The method in use. Frames that try another one, and frames in which it cannot pay, are culled differently.
    pub(crate) fn kept(&self) -> Occlusion {
        self.kept.into()
    }

    /// Changes what drawing a polygon costs, nanoseconds.
    pub(crate) fn set_polygon_ns(&mut self, polygon_ns: f64) {
        self.config.polygon_ns = polygon_ns;
    }

    /// Whether there can be a frame in which culling with the previous frame's polygons pays.
    pub(crate) fn can_depth_last_pay(&self) -> bool {
        // The more is in view, the less what does not depend on it weighs.
        let many = 1 << 32;
        many as f64 * self.config.polygon_ns >= self.config.least_ratio * Method::DepthLast.least_ns(many)
    }

    /// The method for the next frame. To be called once before each frame, with the number of polygons in the frustum.
    pub(crate) fn decide(&mut self, in_view: u64) -> Occlusion {
        self.choose(in_view).into()
    }

    fn choose(&mut self, in_view: u64) -> Option<Method> {
        self.in_view = in_view;
        let all_ns = self.all_ns();
        let kept = self.kept.filter(|method| self.may_pay(*method, all_ns));
        // Drawing all of them, or what a frame takes with the kept method: no other one saves more.
        let now_ns = kept.map_or(all_ns, |method| self.frame_ns(method));
        if self.kept != Some(Method::Msvbsp) && self.may_pay(Method::Msvbsp, all_ns) {
            self.idle_ns = (self.idle_ns + self.config.keep_share * now_ns).min(MOST_IDLE_NS);
        }
        let others = Method::ALL.map(|method| Some(method) != self.kept && self.may_try(method, now_ns));
        let share = self.config.probe_share / others.iter().filter(|other| **other).count().max(1) as f64;
        let mut next: Option<(u32, Method)> = None;
        for method in Method::ALL.into_iter().filter(|method| others[*method as usize]) {
            let price_ns = self.price_ns(method);
            let budget = &mut self.known[method as usize].budget;
            budget.save(share * now_ns, price_ns);
            let is_due = budget.is_due(price_ns, self.config.probe_every);
            // In turns: the one that has waited longest.
            if is_due && next.is_none_or(|(waited, _)| budget.frames() > waited) {
                next = Some((budget.frames(), method));
            }
        }
        if let Some(Try { method, .. }) = self.trying {
            if others[method as usize] {
                return Some(method);
            }
            self.trying = None;
        }
        let Some((_, method)) = next else { return kept };
        self.known[method as usize].budget.restart();
        self.trying = Some(Try { method, spent_ns: 0.0, is_first: method.has_to_start() });
        Some(method)
    }

    /// Time that a frame without large occluders may spend on following candidates, nanoseconds.
    pub(crate) fn idle_budget_ns(&self) -> f64 {
        self.idle_ns
    }

    /// Subtracts what was spent of [`AutoSwitch::idle_budget_ns`].
    pub(crate) fn spend_idle(&mut self, ns: f64) {
        self.idle_ns -= ns;
    }

    /// Takes the measurements of a frame that was culled as decided.
    pub(crate) fn note(&mut self, outcome: Outcome) {
        let gain_ns = outcome.culled as f64 * self.config.polygon_ns;
        match self.trying.take() {
            Some(attempt) => self.note_try(attempt, outcome.cost_ns, gain_ns),
            None => self.note_kept(outcome.cost_ns, gain_ns),
        }
    }

    fn note_kept(&mut self, cost_ns: f64, gain_ns: f64) {
        let Some(method) = self.kept else { return };
        let weight = if self.is_measured { WEIGHT } else { 1.0 };
        self.is_measured = true;
        let known = &mut self.known[method as usize];
        known.cost_ns += weight * (cost_ns - known.cost_ns);
        known.gain_ns += weight * (gain_ns - known.gain_ns);
        if known.gain_ns >= self.config.least_ratio * known.cost_ns {
            self.losing = 0;
            return;
        }
        let is_hopeless = known.gain_ns < HOPELESS * known.cost_ns;
        self.losing += if is_hopeless { HOPELESS_FRAMES } else { 1 };
        if self.losing >= self.config.patience {
            known.budget.restart();
            self.kept = None;
        }
    }

    fn note_try(&mut self, attempt: Try, cost_ns: f64, gain_ns: f64) {
        let Try { method, is_first, .. } = attempt;
        let spent_ns = attempt.spent_ns + cost_ns;
        let all_ns = self.all_ns();
        // What the first frame finds to be hidden need not hide anything in the second.
        let to_come_ns = cost_ns * (1.0 - gain_ns / all_ns.max(gain_ns).max(1.0));
        if is_first && gain_ns >= HOPELESS * to_come_ns {
            self.trying = Some(Try { method, spent_ns, is_first: false });
            return;
        }
        let known = &mut self.known[method as usize];
        (known.cost_ns, known.gain_ns) = (cost_ns, gain_ns);
        known.price_ns = Some(spent_ns / self.in_view.max(1) as f64);
        let pays = gain_ns >= self.config.least_ratio * cost_ns;
        let is_fastest = self.kept.is_none_or(|kept| {
            self.may_pay(kept, all_ns) && self.frame_ns(method) < self.config.faster * self.frame_ns(kept)
        });
        if pays && is_fastest {
            (self.kept, self.is_measured, self.losing) = (Some(method), true, 0);
        }
    }

    /// Time to draw everything in view, nanoseconds.
    fn all_ns(&self) -> f64 {
        self.in_view as f64 * self.config.polygon_ns
    }

    /// Time of a frame with this method, drawing included, nanoseconds.
    fn frame_ns(&self, method: Method) -> f64 {
        let Known { cost_ns, gain_ns, .. } = self.known[method as usize];
        (self.all_ns() - gain_ns).max(0.0) + cost_ns
    }

    fn price_ns(&self, method: Method) -> f64 {
        let Known { cost_ns, price_ns, .. } = self.known[method as usize];
        match method {
            Method::Msvbsp => cost_ns,
            Method::DepthLast => price_ns.unwrap_or(FIRST_PRICE_NS) * self.in_view as f64,
        }
    }

    /// Whether the method would pay if it saved this much time.
    fn may_pay(&self, method: Method, most_ns: f64) -> bool {
        most_ns >= self.config.least_ratio * method.least_ns(self.in_view)
    }

    fn may_try(&self, method: Method, now_ns: f64) -> bool {
        let earned_ns = MOST_FRAMES_FOR_A_TRY * self.config.probe_share * now_ns;
        self.may_pay(method, now_ns) && (!method.has_to_start() || self.price_ns(method) <= earned_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Method::{DepthLast, Msvbsp};

    const IN_VIEW: u64 = 50_000;

    /// Frames that were culled by each method.
    #[derive(Debug, Default, PartialEq)]
    struct Used {
        msvbsp: u32,
        last: u32,
        /// What they cost in all, nanoseconds.
        cost_ns: f64,
        changes: u32,
    }

    fn play_all(
        switch: &mut AutoSwitch,
        frames: u32,
        mut outcome: impl FnMut(Method, u32) -> Outcome,
    ) -> Used {
        let (mut used, mut kept) = (Used::default(), switch.kept);
        for frame in 0..frames {
            let Some(method) = switch.choose(IN_VIEW) else { continue };
            let outcome = outcome(method, frame);
            switch.note(outcome);
            *(if method == Msvbsp { &mut used.msvbsp } else { &mut used.last }) += 1;
            used.cost_ns += outcome.cost_ns;
            used.changes += u32::from(switch.kept != kept);
            kept = switch.kept;
        }
        used
    }

    /// Where drawing costs 10 ns a polygon, large occluders alone can pay.
    fn play(switch: &mut AutoSwitch, frames: u32, outcome: impl Fn(u32) -> Outcome) -> u32 {
        let used = play_all(switch, frames, |_, frame| outcome(frame));
        assert_eq!(used.last, 0);
        used.msvbsp
    }

    fn is_on(switch: &AutoSwitch) -> bool {
        switch.kept.is_some()
    }

    fn dear(polygon_ns: f64) -> AutoSwitch {
        AutoSwitch::new(AutoConfig { polygon_ns, ..AutoConfig::default() })
    }

    const MS: f64 = 1.0e6;

    /// The same in every frame: what each method costs, milliseconds, and how many polygons it culls.
    fn always(msvbsp: (f64, u64), last: (f64, u64)) -> impl Fn(Method, u32) -> Outcome + Copy {
        move |method, _| {
            let (cost_ms, culled) = if method == Msvbsp { msvbsp } else { last };
            Outcome { cost_ns: cost_ms * MS, culled }
        }
    }

    #[test]
    fn what_was_visible_last_is_taken_where_it_alone_pays() {
        // Drawing takes 500 ms.
        let mut switch = dear(10_000.0);
        let used = play_all(&mut switch, 2000, always((4.0, 10), (80.0, 25_000)));
        assert_eq!(switch.kept, Some(DepthLast));
        assert!(used.last > 1500 && used.msvbsp < 100 && used.changes == 2, "{used:?}");
    }

    #[test]
    fn large_occluders_are_taken_where_they_pay_more() {
        let mut switch = dear(10_000.0);
        let used = play_all(&mut switch, 5000, always((4.0, 25_000), (80.0, 26_000)));
        assert_eq!((switch.kept, used.changes), (Some(Msvbsp), 0), "{used:?}");
        assert!(used.last > 0 && used.last < 100, "it is tried all the same: {used:?}");
    }

    #[test]
    fn what_pays_more_takes_the_place_of_what_pays() {
        let last = |found| always((4.0, 5_000), (80.0, found));
        // 454 ms of drawing and culling against 280, and then against 530.
        let mut switch = dear(10_000.0);
        assert!(play_all(&mut switch, 2000, last(30_000)).last > 1000);
        assert_eq!(switch.kept, Some(DepthLast));
        let used = play_all(&mut switch, 2000, last(4_000));
        assert!(used.last < 100 && used.msvbsp > 1500, "{used:?}");
        assert_eq!(switch.kept, Some(Msvbsp));
        // 454 against 440: not worth a change.
        let mut switch = dear(10_000.0);
        assert_eq!(play_all(&mut switch, 4000, last(14_000)).changes, 0);
    }

    #[test]
    fn methods_that_are_alike_do_not_take_turns() {
        let mut switch = dear(10_000.0);
        let used = play_all(&mut switch, 20_000, |method, frame| {
            let noise = (frame * 7919 % 21) as f64 / 20.0 - 0.5;
            match method {
                Msvbsp => Outcome { cost_ns: (60.0 + 20.0 * noise) * MS, culled: 20_000 },
                DepthLast => Outcome { cost_ns: (70.0 - 20.0 * noise) * MS, culled: 21_000 },
            }
        });
        assert!(used.changes <= 1, "{used:?}");
    }

    #[test]
    fn none_is_kept_where_nothing_pays() {
        // 50 ms of drawing, and tries of 120 and 10 ms: 0.4 % of it, once what was not known at first is.
        let mut switch = dear(1_000.0);
        let outcome = always((10.0, 2_000), (120.0, 3_000));
        play_all(&mut switch, 100, outcome);
        let used = play_all(&mut switch, 20_000, outcome);
        let share = used.cost_ns / (20_000.0 * 50.0 * MS);
        assert_eq!((switch.kept, used.changes), (None, 0));
        assert!(share > 0.0030 && share < 0.0042, "{share} of the drawing: {used:?}");
        assert!(used.last >= 10 && used.msvbsp >= 150, "in turns: {used:?}");
    }

    #[test]
    fn a_hopeless_first_frame_ends_a_try_and_a_good_one_does_not_count() {
        let mut switch = dear(10_000.0);
        // The first frame of each try costs more than it gains: everything in view hides.
        let (mut last_frame, mut first_frames, mut frames) = (u32::MAX, 0, 0);
        let used = play_all(&mut switch, 1000, |method, frame| {
            if method == Msvbsp {
                return Outcome { cost_ns: 4.0 * MS, culled: 0 };
            }
            let is_first = last_frame.wrapping_add(1) != frame;
            (last_frame, frames) = (frame, frames + 1);
            first_frames += u32::from(is_first);
            Outcome { cost_ns: if is_first { 400.0 } else { 80.0 } * MS, culled: 25_000 }
        });
        assert!(used.last > 400 && switch.kept == Some(DepthLast), "{used:?}, {first_frames}");
        let mut switch = dear(10_000.0);
        let (mut in_a_row, mut longest, mut last_frame) = (0, 0, u32::MAX);
        play_all(&mut switch, 3000, |method, frame| {
            if method == DepthLast {
                in_a_row = if last_frame.wrapping_add(1) == frame { in_a_row + 1 } else { 1 };
                (longest, last_frame) = (longest.max(in_a_row), frame);
            }
            Outcome { cost_ns: 200.0 * MS, culled: 100 }
        });
        assert_eq!(longest, 1);
    }

    #[test]
    fn what_was_visible_last_is_not_tried_where_it_cannot_pay() {
        for polygon_ns in [10.0, 100.0] {
            let mut switch = dear(polygon_ns);
            let used = play_all(&mut switch, 20_000, |_, _| Outcome { cost_ns: 50_000.0, culled: 100 });
            assert_eq!(used.last, 0, "{polygon_ns}");
        }
        assert!(!dear(10.0).can_depth_last_pay() && dear(1_000.0).can_depth_last_pay());
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
        assert!(!is_on(&switch));
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
        assert!(!is_on(&switch));
        let used = play(&mut switch, 100, |_| Outcome { cost_ns: 50_000.0, culled: 50_000 });
        assert!(is_on(&switch) && used >= 100 - 32, "{used}");
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
        assert!((0..500).all(|_| switch.choose(1000).is_none()), "10 µs of drawing");
        assert_eq!(switch.choose(IN_VIEW), Some(Msvbsp));
    }

    #[test]
    fn keeping_candidates_is_paid_for_by_drawing() {
        let mut switch = AutoSwitch::new(AutoConfig::default());
        assert_eq!(switch.idle_budget_ns(), 0.0);
        play(&mut switch, 8, |_| Outcome { cost_ns: 50_000.0, culled: 0 });
        assert!(!is_on(&switch));
        let mut spent = 0.0;
        for _ in 0..1000 {
            if switch.choose(IN_VIEW).is_some() {
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
