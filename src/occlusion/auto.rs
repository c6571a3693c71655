use super::{Occlusion, TryBudget};

/// Settings of [`AutoSwitch`], which decides whether a method of occlusion culling is worth its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AutoConfig {
    /// Time to draw one polygon, nanoseconds. A renderer measures it: frame time divided by the number of drawn polygons.
    pub polygon_ns: f64,
    /// A method saves enough if drawing takes less time by at least this multiple of the method's time.
    pub least_ratio: f64,
    /// A method on trial replaces the method in use if its frames take less than this fraction of the time.
    pub faster: f64,
    /// After this number of consecutive frames in which the method in use does not save enough, it is switched off.
    pub patience: u32,
    /// Least number of frames between two tries of a method that is not in use.
    pub probe_every: u32,
    /// The fraction of the drawing time that all tries together may take on average.
    pub probe_share: f64,
    /// While [`Occlusion::Msvbsp`] is not in use, the fraction of the drawing time that updating its candidates for
    /// occluders may take on average.
    pub keep_share: f64,
    /// A method counts as recent for this number of frames after a frame in which it saved enough. A recent method is
    /// tried more often, and candidates get more time. The reason is that a method that saves enough in one part of a
    /// scene mostly does so in the next part.
    pub recent: u32,
}

impl Default for AutoConfig {
    /// Drawing takes 10 ns a polygon. A method saves enough if it saves 1.2 times its cost, and replaces another if
    /// frames take 0.9 of the time. It is switched off after 8 frames, and tried at most once in 32. Tries take 0.8 %
    /// of the drawing time, and updates of candidates another 0.8 %. Both shares are larger for 512 frames after a
    /// frame that saved enough.
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

/// The methods that the switch can select, besides frustum culling alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    /// [`Occlusion::Msvbsp`].
    Msvbsp,
    /// [`Occlusion::PreviousFrame`].
    PreviousFrame,
}

impl Method {
    const ALL: [Self; 2] = [Self::Msvbsp, Self::PreviousFrame];

    /// This method, or frustum culling alone.
    fn occlusion(method: Option<Self>) -> Occlusion {
        match method {
            None => Occlusion::None,
            Some(Self::Msvbsp) => Occlusion::Msvbsp,
            Some(Self::PreviousFrame) => Occlusion::PreviousFrame,
        }
    }

    /// Approximate least time of this method in a frame, nanoseconds. It is constant for `Msvbsp`, which selects
    /// occluders and builds a tree. `PreviousFrame` took 15 ns for each polygon in view where nearly all are hidden (Sponza
    /// from outside).
    fn least_ns(self, in_view: u64) -> f64 {
        match self {
            Self::Msvbsp => 30_000.0,
            Self::PreviousFrame => 30_000.0 + 15.0 * in_view as f64,
        }
    }

    /// Whether the first frame of a try is not measured, because it costs more than later frames. Without a previous
    /// frame, `PreviousFrame` fills the largest polygons in view.
    fn has_to_start(self) -> bool {
        self == Self::PreviousFrame
    }
}

/// Time and result of one frame's occlusion culling, compared with frustum culling alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Outcome {
    /// Time to update the candidates, select occluders, build the culler and test, nanoseconds.
    pub cost_ns: f64,
    /// Number of polygons culled.
    pub culled: u64,
}

/// Weight of the newest value in a moving average.
const WEIGHT: f64 = 0.2;

/// A frame that saves less than this fraction of its cost counts as [`HOPELESS_FRAMES`] frames that do not save enough.
const HOPELESS: f64 = 0.25;
/// See [`HOPELESS`].
const HOPELESS_FRAMES: u32 = 3;

/// The measured cost of a frame is limited to this multiple of [`MethodHistory::cost_ns`].
const MOST_COST_GROWTH: f64 = 2.0;

/// A recent method is tried this many times as often, with this many times the share of the drawing time.
const RECENT_TRIES: u32 = 4;

/// The candidates of a recent method get this many times the share of the drawing time.
const RECENT_UPDATES: f64 = 2.0;

/// Assumed time of the first try of `PreviousFrame`, nanoseconds for each polygon in view. Its first frame fills all
/// polygons in view, its second frame the visible ones.
const FIRST_PRICE_NS: f64 = 1_000.0;

/// Largest number of frames whose savings may be spent on one try; a more expensive try is not made. If two methods
/// take turns, the limit is twice as large.
const MOST_FRAMES_FOR_A_TRY: f64 = 2048.0;

/// Largest time that can be saved for updating candidates, nanoseconds. One frame may spend all of it.
const MOST_IDLE_NS: f64 = 300_000.0;

/// The measurements of a method.
#[derive(Clone, Copy, Debug, Default)]
struct MethodHistory {
    /// Cost of a frame, nanoseconds: a moving average while the method is in use, otherwise the result of its last try.
    cost_ns: f64,
    gain_ns: f64,
    /// Time of the method's last try, nanoseconds for each polygon in view.
    price_ns: Option<f64>,
    /// Time saved for the method's next try, while the method is not in use.
    budget: TryBudget,
    /// Number of frames since the method last saved enough; `None` if it never has.
    since_paid: Option<u32>,
}

impl MethodHistory {
    /// The cost of a frame, limited to a multiple of the cost so far. A cost many times as high means that the thread was
    /// suspended. If the method has really become so expensive, the average reaches its cost a few frames later.
    fn plausible_ns(&self, cost_ns: f64) -> f64 {
        if self.cost_ns > 0.0 { cost_ns.min(MOST_COST_GROWTH * self.cost_ns) } else { cost_ns }
    }
}

/// A try in progress.
#[derive(Clone, Copy, Debug)]
struct Try {
    method: Method,
    /// Time of the frames of this try so far, nanoseconds.
    spent_ns: f64,
    /// True until the try's first frame is measured.
    is_first: bool,
}

/// Selects a method of occlusion culling, or none, for every frame. It tries the methods that are not in use at intervals,
/// and keeps the method with the shortest frames.
///
/// Time for tries is saved in advance: every frame saves [`AutoConfig::probe_share`] of its drawing time. If a method
/// could not save enough even by culling all polygons, it is not tried.
///
/// The switch reads no clock. With measured costs it adapts to the machine. With costs computed from work counts
/// ([`super::work_ns`], [`super::PreviousFrameCounts::work_ns`]) it selects the same methods on every machine. A replay
/// with pinned fingerprints requires this.
#[derive(Clone, Debug)]
pub(crate) struct AutoSwitch {
    config: AutoConfig,
    kept: Option<Method>,
    histories: [MethodHistory; Method::ALL.len()],
    /// Whether the kept method has been measured.
    is_measured: bool,
    /// Number of consecutive frames in which the kept method did not save enough.
    losing: u32,
    trying: Option<Try>,
    /// Number of polygons in the frustum at the last call of `decide`.
    in_view: u64,
    /// Time saved for updating candidates, nanoseconds.
    idle_ns: f64,
}

impl AutoSwitch {
    /// A switch without measurements; it begins with [`Occlusion::Msvbsp`].
    pub(crate) fn new(config: AutoConfig) -> Self {
        Self {
            config,
            kept: Some(Method::Msvbsp),
            histories: Default::default(),
            is_measured: false,
            losing: 0,
            trying: None,
            in_view: 0,
            idle_ns: 0.0,
        }
    }

    /// The method in use. Frames that try another method, and frames in which the kept method cannot save enough, are
    /// culled differently.
    pub(crate) fn kept(&self) -> Occlusion {
        Method::occlusion(self.kept)
    }

    /// Changes the cost of drawing a polygon, nanoseconds.
    pub(crate) fn set_polygon_ns(&mut self, polygon_ns: f64) {
        self.config.polygon_ns = polygon_ns;
    }

    /// Whether [`Occlusion::PreviousFrame`] could save enough in any frame.
    pub(crate) fn can_previous_frame_pay(&self) -> bool {
        // If many polygons are in view, fixed costs are negligible.
        let many = 1 << 32;
        many as f64 * self.config.polygon_ns >= self.config.least_ratio * Method::PreviousFrame.least_ns(many)
    }

    /// Whether any method would save enough in a frame with `in_view` polygons in the frustum if it culled all of them.
    /// If not, [`AutoSwitch::decide`] returns [`Occlusion::None`].
    pub(crate) fn can_pay(&self, in_view: u64) -> bool {
        let all_ns = in_view as f64 * self.config.polygon_ns;
        Method::ALL.iter().any(|method| all_ns >= self.config.least_ratio * method.least_ns(in_view))
    }

    /// The method for the next frame. Call it once before each frame, with the number of polygons in the frustum.
    pub(crate) fn decide(&mut self, in_view: u64) -> Occlusion {
        Method::occlusion(self.choose(in_view))
    }

    fn choose(&mut self, in_view: u64) -> Option<Method> {
        self.in_view = in_view;
        let all_ns = self.all_ns();
        let kept = self.kept.filter(|method| self.may_pay(*method, all_ns));
        // The time to draw all polygons, or the time of a frame with the kept method. No other method can save more than
        // that.
        let now_ns = kept.map_or(all_ns, |method| self.frame_ns(method));
        for history in &mut self.histories {
            history.since_paid = history.since_paid.map(|frames| frames.saturating_add(1));
        }
        if self.kept != Some(Method::Msvbsp) && self.may_pay(Method::Msvbsp, all_ns) {
            let more = if self.paid_recently(Method::Msvbsp) { RECENT_UPDATES } else { 1.0 };
            self.idle_ns = (self.idle_ns + more * self.config.keep_share * now_ns).min(MOST_IDLE_NS);
        }
        let others = Method::ALL.map(|method| Some(method) != self.kept && self.may_try(method, now_ns));
        let share = self.config.probe_share / others.iter().filter(|other| **other).count().max(1) as f64;
        let mut next: Option<(u32, Method)> = None;
        for method in Method::ALL.into_iter().filter(|method| others[*method as usize]) {
            let price_ns = self.price_ns(method);
            let more = if self.paid_recently(method) { RECENT_TRIES } else { 1 };
            let budget = &mut self.histories[method as usize].budget;
            budget.save(f64::from(more) * share * now_ns, price_ns);
            let is_due = budget.is_due(price_ns, self.config.probe_every / more);
            // Methods take turns: the method that has waited longest is next.
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
        self.histories[method as usize].budget.restart();
        self.trying = Some(Try { method, spent_ns: 0.0, is_first: method.has_to_start() });
        Some(method)
    }

    fn paid_recently(&self, method: Method) -> bool {
        self.histories[method as usize].since_paid.is_some_and(|frames| frames < self.config.recent)
    }

    /// Time that a frame without [`Occlusion::Msvbsp`] may spend on updating candidates, nanoseconds.
    pub(crate) fn idle_budget_ns(&self) -> f64 {
        self.idle_ns
    }

    /// Subtracts time from [`AutoSwitch::idle_budget_ns`].
    pub(crate) fn spend_idle(&mut self, ns: f64) {
        self.idle_ns -= ns;
    }

    /// Records the measurements of a frame that was culled as decided.
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
        let history = &mut self.histories[method as usize];
        let cost_ns = if self.is_measured { history.plausible_ns(cost_ns) } else { cost_ns };
        self.is_measured = true;
        history.cost_ns += weight * (cost_ns - history.cost_ns);
        history.gain_ns += weight * (gain_ns - history.gain_ns);
        if history.gain_ns >= self.config.least_ratio * history.cost_ns {
            self.losing = 0;
            history.since_paid = Some(0);
            return;
        }
        // A method that has paid recently is not switched off because of a short view of a wall with nothing behind it.
        let has_paid = history.since_paid.is_some_and(|frames| frames < self.config.recent);
        let is_hopeless = history.gain_ns < HOPELESS * history.cost_ns && !has_paid;
        self.losing += if is_hopeless { HOPELESS_FRAMES } else { 1 };
        if self.losing >= self.config.patience {
            history.budget.restart();
            self.kept = None;
        }
    }

    fn note_try(&mut self, attempt: Try, cost_ns: f64, gain_ns: f64) {
        let Try { method, is_first, .. } = attempt;
        let cost_ns = if method.has_to_start() {
            cost_ns
        } else {
            self.histories[method as usize].plausible_ns(cost_ns)
        };
        let spent_ns = attempt.spent_ns + cost_ns;
        let all_ns = self.all_ns();
        // The second frame costs less, because it does not fill polygons that the first frame finds hidden.
        let to_come_ns = cost_ns * (1.0 - gain_ns / all_ns.max(gain_ns).max(1.0));
        if is_first && gain_ns >= HOPELESS * to_come_ns {
            self.trying = Some(Try { method, spent_ns, is_first: false });
            return;
        }
        let history = &mut self.histories[method as usize];
        (history.cost_ns, history.gain_ns) = (cost_ns, gain_ns);
        history.price_ns = Some(spent_ns / self.in_view.max(1) as f64);
        let pays = gain_ns >= self.config.least_ratio * cost_ns;
        let is_fastest = self.kept.is_none_or(|kept| {
            self.may_pay(kept, all_ns) && self.frame_ns(method) < self.config.faster * self.frame_ns(kept)
        });
        if pays && is_fastest {
            (self.kept, self.is_measured, self.losing) = (Some(method), true, 0);
        }
    }

    /// Time to draw all polygons in view, nanoseconds.
    fn all_ns(&self) -> f64 {
        self.in_view as f64 * self.config.polygon_ns
    }

    /// Time of a frame with this method, including drawing, nanoseconds.
    fn frame_ns(&self, method: Method) -> f64 {
        let MethodHistory { cost_ns, gain_ns, .. } = self.histories[method as usize];
        (self.all_ns() - gain_ns).max(0.0) + cost_ns
    }

    fn price_ns(&self, method: Method) -> f64 {
        let MethodHistory { cost_ns, price_ns, .. } = self.histories[method as usize];
        match method {
            Method::Msvbsp => cost_ns,
            Method::PreviousFrame => price_ns.unwrap_or(FIRST_PRICE_NS) * self.in_view as f64,
        }
    }

    /// Whether a saving of `most_ns` nanoseconds would be enough at the least cost of the method.
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
