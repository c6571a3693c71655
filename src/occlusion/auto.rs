use super::{Occlusion, TryBudget};

/// Settings of [`AutoSwitch`], which decides whether a method of occlusion culling is worth its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AutoConfig {
    /// Cost of drawing one polygon, nanoseconds. A renderer measures it: frame time over polygons drawn.
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
    /// For this number of frames after one in which a method paid, it is tried more often, and more time goes into
    /// candidates. A method that pays in one part of a scene most often pays in the next.
    pub recent: u32,
}

impl Default for AutoConfig {
    /// 10 ns a polygon, 1.2 times the cost, 0.9 of the time, 8 frames, at most one in 32. Tries take 0.8 % of the
    /// drawing, and candidates as much; more in the 512 frames after one that paid.
    fn default() -> Self {
        Self {
            polygon_ns: 10.0,
            least_ratio: 1.2,
            faster: 0.9,
            patience: 8,
            probe_every: 32,
            probe_share: 0.008,
            keep_share: 0.008,
            recent: 512,
        }
    }
}

/// The methods to choose from, besides frustum culling alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// [`Occlusion::Msvbsp`].
    Msvbsp,
    /// [`Occlusion::PreviousFrame`].
    PreviousFrame,
}

impl From<Option<Method>> for Occlusion {
    fn from(method: Option<Method>) -> Self {
        match method {
            None => Self::None,
            Some(Method::Msvbsp) => Self::Msvbsp,
            Some(Method::PreviousFrame) => Self::PreviousFrame,
        }
    }
}

impl Method {
    const ALL: [Self; 2] = [Self::Msvbsp, Self::PreviousFrame];

    /// Approximate least time of this method in a frame, nanoseconds. Large occluders: to select them and to build the
    /// tree. Previous-frame occluders: that, and a test for every four polygons in view.
    fn least_ns(self, in_view: u64) -> f64 {
        match self {
            Self::Msvbsp => 30_000.0,
            Self::PreviousFrame => 30_000.0 + 60.0 * in_view as f64,
        }
    }

    /// Whether the first frame of a try predicts little about the next ones: without a previous frame the largest
    /// polygons in view are filled.
    fn has_to_start(self) -> bool {
        self == Self::PreviousFrame
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

/// The cost of a frame counts as at most this multiple of the previous ones.
const MOST_DEARER: f64 = 2.0;

/// Factor on the tries, and their share of the drawing time, of a method that paid recently.
const RECENT_TRIES: u32 = 4;

/// Factor on the share of the drawing time that goes into candidates then.
const RECENT_KEEPING: f64 = 2.0;

/// Assumed time of the first try of previous-frame occluders, nanoseconds for each polygon in view: its first frame
/// fills all polygons in view, its second frame the visible ones.
const FIRST_PRICE_NS: f64 = 2_600.0;

/// Most frames of saving for a try; a more expensive try is not made. Twice as many if two methods take turns.
const MOST_FRAMES_FOR_A_TRY: f64 = 2048.0;

/// Most time that is saved for following candidates, nanoseconds: one frame may spend all of it.
const MOST_IDLE_NS: f64 = 300_000.0;

/// Measured costs of a method.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    /// A moving average while the method is in use, else the measurement of its last try.
    cost_ns: f64,
    gain_ns: f64,
    /// Time of its last try, nanoseconds for each polygon in view.
    price_ns: Option<f64>,
    /// Time saved for its next try, while it is not in use.
    budget: TryBudget,
    /// Frames since it last paid, if it ever did.
    since_paid: Option<u32>,
}

impl Known {
    /// Cost of a frame, limited to a plausible cost of the method: a cost many times as high as before means
    /// that the thread was suspended. If a method has really become so much more expensive, its cost counts a few frames later.
    fn plausible_ns(&self, cost_ns: f64) -> f64 {
        if self.cost_ns > 0.0 { cost_ns.min(MOST_DEARER * self.cost_ns) } else { cost_ns }
    }
}

/// A try in progress.
#[derive(Clone, Copy, Debug)]
struct Try {
    method: Method,
    /// Time of its frames so far, nanoseconds.
    spent_ns: f64,
    /// Whether the first of its two frames has not been measured yet.
    is_first: bool,
}

/// Decides for every frame which method of occlusion culling to use, if any. Methods that are not in use are tried at
/// intervals; the one with the shortest frames is kept.
///
/// Time for tries is saved in advance: every frame saves [`AutoConfig::probe_share`] of its drawing time. If even
/// culling everything would not pay, nothing is tried.
///
/// It has no clock. Given measured costs it adapts to the machine. Given costs computed from work counts ([`super::work_ns`],
/// [`super::PreviousFrameCounts::work_ns`]) it decides the same on every machine. A replay with pinned fingerprints needs
/// that.
#[derive(Clone, Debug)]
pub(crate) struct AutoSwitch {
    config: AutoConfig,
    kept: Option<Method>,
    known: [Known; Method::ALL.len()],
    /// Whether the kept method has been measured.
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

    /// Changes the cost of drawing a polygon, nanoseconds.
    pub(crate) fn set_polygon_ns(&mut self, polygon_ns: f64) {
        self.config.polygon_ns = polygon_ns;
    }

    /// Whether there can be a frame in which culling with the previous frame's polygons pays.
    pub(crate) fn can_previous_frame_pay(&self) -> bool {
        // With many polygons in view, fixed costs hardly count.
        let many = 1 << 32;
        many as f64 * self.config.polygon_ns >= self.config.least_ratio * Method::PreviousFrame.least_ns(many)
    }

    /// Whether any method would pay in a frame with so many polygons in the frustum if it culled all of them. If not,
    /// [`AutoSwitch::decide`] returns none.
    pub(crate) fn can_pay(&self, in_view: u64) -> bool {
        let all_ns = in_view as f64 * self.config.polygon_ns;
        Method::ALL.iter().any(|method| all_ns >= self.config.least_ratio * method.least_ns(in_view))
    }

    /// The method for the next frame. Call it once before each frame, with the number of polygons in the frustum.
    pub(crate) fn decide(&mut self, in_view: u64) -> Occlusion {
        self.choose(in_view).into()
    }

    fn choose(&mut self, in_view: u64) -> Option<Method> {
        self.in_view = in_view;
        let all_ns = self.all_ns();
        let kept = self.kept.filter(|method| self.may_pay(*method, all_ns));
        // The time to draw all of them, or of a frame with the kept method: no other method saves more.
        let now_ns = kept.map_or(all_ns, |method| self.frame_ns(method));
        for known in &mut self.known {
            known.since_paid = known.since_paid.map(|frames| frames.saturating_add(1));
        }
        if self.kept != Some(Method::Msvbsp) && self.may_pay(Method::Msvbsp, all_ns) {
            let more = if self.paid_recently(Method::Msvbsp) { RECENT_KEEPING } else { 1.0 };
            self.idle_ns = (self.idle_ns + more * self.config.keep_share * now_ns).min(MOST_IDLE_NS);
        }
        let others = Method::ALL.map(|method| Some(method) != self.kept && self.may_try(method, now_ns));
        let share = self.config.probe_share / others.iter().filter(|other| **other).count().max(1) as f64;
        let mut next: Option<(u32, Method)> = None;
        for method in Method::ALL.into_iter().filter(|method| others[*method as usize]) {
            let price_ns = self.price_ns(method);
            let more = if self.paid_recently(method) { RECENT_TRIES } else { 1 };
            let budget = &mut self.known[method as usize].budget;
            budget.save(f64::from(more) * share * now_ns, price_ns);
            let is_due = budget.is_due(price_ns, self.config.probe_every / more);
            // In turns: the method that has waited longest.
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

    fn paid_recently(&self, method: Method) -> bool {
        self.known[method as usize].since_paid.is_some_and(|frames| frames < self.config.recent)
    }

    /// Time that a frame without large occluders may spend on following candidates, nanoseconds.
    pub(crate) fn idle_budget_ns(&self) -> f64 {
        self.idle_ns
    }

    /// Subtracts time that was spent from [`AutoSwitch::idle_budget_ns`].
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
        let known = &mut self.known[method as usize];
        let cost_ns = if self.is_measured { known.plausible_ns(cost_ns) } else { cost_ns };
        self.is_measured = true;
        known.cost_ns += weight * (cost_ns - known.cost_ns);
        known.gain_ns += weight * (gain_ns - known.gain_ns);
        if known.gain_ns >= self.config.least_ratio * known.cost_ns {
            self.losing = 0;
            known.since_paid = Some(0);
            return;
        }
        // A method that has paid recently is not dropped for a short view of a wall with nothing behind it.
        let has_paid = known.since_paid.is_some_and(|frames| frames < self.config.recent);
        let is_hopeless = known.gain_ns < HOPELESS * known.cost_ns && !has_paid;
        self.losing += if is_hopeless { HOPELESS_FRAMES } else { 1 };
        if self.losing >= self.config.patience {
            known.budget.restart();
            self.kept = None;
        }
    }

    fn note_try(&mut self, attempt: Try, cost_ns: f64, gain_ns: f64) {
        let Try { method, is_first, .. } = attempt;
        let cost_ns =
            if method.has_to_start() { cost_ns } else { self.known[method as usize].plausible_ns(cost_ns) };
        let spent_ns = attempt.spent_ns + cost_ns;
        let all_ns = self.all_ns();
        // Polygons that the first frame finds hidden need not hide anything in the second.
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
            Method::PreviousFrame => price_ns.unwrap_or(FIRST_PRICE_NS) * self.in_view as f64,
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
#[path = "auto_tests.rs"]
mod tests;
