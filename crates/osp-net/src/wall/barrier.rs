//! The computers of a wall. This module determines for which computers the hub waits, and whose pictures differ. It
//! uses no clock and no network.
//!
//! Times are durations since the hub has started.

use std::collections::VecDeque;
use std::time::Duration;

use hdrhistogram::Histogram;

use super::{
    HubEvent,
    report::{NodeReport, Place, Times},
};

/// Number of consecutive missed frames after which the hub does not wait for a computer any more.
pub const MISSES: u32 = 3;
/// Number of consecutive answers in time after which the hub waits for a computer.
const ANSWERS: u32 = 20;
/// Shortest time for which the hub waits for a computer.
const LEAST_PATIENCE: Duration = Duration::from_millis(15);
/// A computer whose result differed counts as correct again after this time without a difference.
const AGREEMENT_TIME: Duration = Duration::from_secs(1);
/// Silence after which a computer counts as gone.
const SILENCE: Duration = Duration::from_millis(1500);
/// Time for which answers to a frame are accepted.
const REMEMBERED: Duration = Duration::from_secs(2);
/// Largest number of frames whose answers are accepted.
const MOST_REMEMBERED: usize = 4096;

/// The answer of a computer to a frame: hashes of its applied events, and of its visible polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Answer {
    pub(super) log: u64,
    pub(super) seen: u64,
}

#[derive(Debug)]
struct Member {
    node: u64,
    host: String,
    /// Whether the hub waits for the computer.
    is_in: bool,
    received: Duration,
    events: u64,
    /// Number of consecutive frames without an answer in time.
    misses: u32,
    /// Number of consecutive answers in time while the hub does not wait for the computer.
    good: u32,
    /// Time from a frame to the computer's answer, a moving mean.
    usual: Option<Duration>,
    answered: Option<u64>,
    /// The part that differed from the hub's answer, and the time of the last difference.
    difference: Option<(&'static str, Duration)>,
    ready_us: Histogram<u64>,
}

impl Member {
    /// Time for which the hub waits for the computer.
    fn patience(&self, most: Duration) -> Duration {
        (self.usual.unwrap_or_default() * 3).clamp(LEAST_PATIENCE.min(most), most)
    }
}

/// Counts of a screen since the start of the hub, over all its computers.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    differed: u64,
    missed: u64,
    dropped: u64,
}

/// A frame whose answers are still accepted.
#[derive(Debug)]
struct Turn {
    number: u64,
    began: Duration,
    /// The expected answer of each screen's computer.
    expected: Vec<Answer>,
    swapped: bool,
    /// At the swap: the screens whose computers the hub waits for. A screen is removed when it shows the frame.
    to_show: Vec<usize>,
    /// Time at which the first computer showed the frame.
    first_shown: Option<Duration>,
}

/// The state of all computers; see the [module](self).
#[derive(Debug)]
pub(super) struct Barrier {
    screens: Vec<String>,
    members: Vec<Option<Member>>,
    counts: Vec<Counts>,
    /// Longest time that the hub waits for a computer.
    most_patience: Duration,
    turns: VecDeque<Turn>,
    events: Vec<HubEvent>,
    /// Number of frames that were shown.
    pub(super) frames: u64,
    last_swap: Option<Duration>,
    /// Times of the swaps of the last second.
    swaps: VecDeque<Duration>,
    frame_us: Histogram<u64>,
    period_us: Histogram<u64>,
    skew_us: Histogram<u64>,
}

fn histogram() -> Histogram<u64> {
    Histogram::new_with_bounds(1, 3_600_000_000, 3).expect("bounds and digits that fit")
}

fn record(histogram: &mut Histogram<u64>, time: Duration) {
    histogram.saturating_record(u64::try_from(time.as_micros()).unwrap_or(u64::MAX));
}

impl Barrier {
    /// A wall without computers. For each frame the hub waits at most `most_patience` for a computer's answer.
    pub(super) fn new(screens: Vec<String>, most_patience: Duration) -> Self {
        let members = screens.iter().map(|_| None).collect();
        let counts = vec![Counts::default(); screens.len()];
        Self {
            screens,
            members,
            counts,
            most_patience,
            turns: VecDeque::new(),
            events: Vec::new(),
            frames: 0,
            last_swap: None,
            swaps: VecDeque::new(),
            frame_us: histogram(),
            period_us: histogram(),
            skew_us: histogram(),
        }
    }

    pub(super) fn take_events(&mut self) -> Vec<HubEvent> {
        std::mem::take(&mut self.events)
    }

    fn find(&mut self, node: u64) -> Option<usize> {
        self.members.iter().position(|member| member.as_ref().is_some_and(|member| member.node == node))
    }

    /// Registers a computer that offers to show a screen.
    ///
    /// # Errors
    /// The reason why the computer cannot show this screen.
    pub(super) fn here(
        &mut self,
        node: u64,
        screen: &str,
        host: &str,
        events: u64,
        now: Duration,
    ) -> Result<(), String> {
        let Some(slot) = self.screens.iter().position(|own| own == screen) else {
            return Err(format!("its rig has no screen `{screen}`"));
        };
        match &mut self.members[slot] {
            Some(member) if member.node == node => {
                (member.received, member.events) = (now, events);
                return Ok(());
            }
            Some(member) if member.is_in || now.saturating_sub(member.received) < SILENCE => {
                return Err(format!("{} shows `{screen}` already", member.host));
            }
            _ => {}
        }
        self.members[slot] = Some(Member {
            node,
            host: host.to_owned(),
            is_in: false,
            received: now,
            events,
            misses: 0,
            good: 0,
            usual: None,
            answered: None,
            difference: None,
            ready_us: histogram(),
        });
        Ok(())
    }

    /// Removes a computer that ends.
    pub(super) fn leaves(&mut self, node: u64) {
        if let Some(slot) = self.find(node) {
            self.put_out(slot, "it has left");
            self.members[slot] = None;
        }
    }

    fn put_out(&mut self, slot: usize, why: &'static str) {
        if let Some(member) = self.members[slot].as_mut().filter(|member| member.is_in) {
            (member.is_in, member.good, member.misses) = (false, 0, 0);
            self.counts[slot].dropped += 1;
            let (screen, host) = (self.screens[slot].clone(), member.host.clone());
            self.events.push(HubEvent::Out { screen, host, why });
        }
    }

    /// Records that a frame was sent. `expected` has the hub's own answer for each screen.
    pub(super) fn begin(&mut self, number: u64, expected: Vec<Answer>, now: Duration) {
        let is_over = |turn: &Turn| now.saturating_sub(turn.began) > REMEMBERED;
        while self.turns.len() >= MOST_REMEMBERED || self.turns.front().is_some_and(is_over) {
            self.turns.pop_front();
        }
        let turn =
            Turn { number, began: now, expected, swapped: false, to_show: Vec::new(), first_shown: None };
        self.turns.push_back(turn);
    }

    /// Records that a computer has drawn a frame.
    pub(super) fn ready(&mut self, node: u64, frame: u64, answer: Answer, now: Duration) {
        let Some(slot) = self.find(node) else { return };
        let Some(turn) = self.turns.iter().find(|turn| turn.number == frame) else { return };
        let (took, is_swapped) = (now.saturating_sub(turn.began), turn.swapped);
        let expected = turn.expected[slot];
        let Some(member) = self.members[slot].as_mut() else { return };
        if member.answered.is_some_and(|last| last >= frame) {
            return;
        }
        member.received = now;
        member.answered = Some(frame);
        record(&mut member.ready_us, took);
        let is_in_time = if member.is_in { !is_swapped } else { took <= member.patience(self.most_patience) };
        let most = self.most_patience;
        member.usual = Some(member.usual.map_or(took, |usual| (usual * 7 + took) / 8).min(most));
        if member.is_in {
            if is_in_time {
                member.misses = 0;
            }
        } else {
            member.good = if is_in_time { member.good + 1 } else { 0 };
            if member.good >= ANSWERS {
                (member.is_in, member.misses) = (true, 0);
                let (screen, host) = (self.screens[slot].clone(), member.host.clone());
                self.events.push(HubEvent::In { screen, host });
            }
        }
        let what = match answer {
            answer if answer == expected => None,
            Answer { log, .. } if log != expected.log => Some("its events differ"),
            _ => Some("its visible polygons differ"),
        };
        self.counts[slot].differed += u64::from(what.is_some());
        let (screen, host) = (self.screens[slot].clone(), member.host.clone());
        match (member.difference, what) {
            (known, Some(what)) => {
                member.difference = Some((what, now));
                if known.is_none() {
                    self.events.push(HubEvent::Differs { screen, host, frame, what });
                }
            }
            // A computer that agrees only in every other frame does not count as agreeing.
            (Some((_, last)), None) if now.saturating_sub(last) >= AGREEMENT_TIME => {
                member.difference = None;
                self.events.push(HubEvent::Agrees { screen, host });
            }
            (_, None) => {}
        }
    }

    /// Whether all computers that the hub waits for have answered the last frame.
    pub(super) fn is_complete(&self) -> bool {
        let Some(turn) = self.turns.back() else { return true };
        let mut members = self.members.iter().flatten().filter(|member| member.is_in);
        members.all(|member| member.answered == Some(turn.number))
    }

    /// Time at which the hub stops waiting for answers to the last frame.
    pub(super) fn deadline(&self) -> Duration {
        let Some(turn) = self.turns.back() else { return Duration::ZERO };
        let members = self.members.iter().flatten().filter(|member| member.is_in);
        turn.began + members.map(|member| member.patience(self.most_patience)).max().unwrap_or_default()
    }

    /// Records that the last frame is shown. Computers that have not answered the frame have missed it.
    pub(super) fn swap(&mut self, now: Duration) {
        let Some(turn) = self.turns.back_mut() else { return };
        (turn.swapped, self.frames) = (true, self.frames + 1);
        let number = turn.number;
        record(&mut self.frame_us, now.saturating_sub(turn.began));
        if let Some(last) = self.last_swap.replace(now) {
            record(&mut self.period_us, now.saturating_sub(last));
        }
        self.swaps.push_back(now);
        while self.swaps.front().is_some_and(|at| now.saturating_sub(*at) > Duration::from_secs(1)) {
            self.swaps.pop_front();
        }
        let mut late = Vec::new();
        for (slot, member) in self.members.iter_mut().enumerate() {
            let Some(member) = member.as_mut().filter(|member| member.is_in) else { continue };
            turn.to_show.push(slot);
            if member.answered == Some(number) {
                continue;
            }
            member.misses += 1;
            self.counts[slot].missed += 1;
            if member.misses >= MISSES {
                late.push(slot);
            }
        }
        turn.to_show.retain(|slot| !late.contains(slot));
        for slot in late {
            self.put_out(slot, "three frames without an answer in time");
        }
        for member in &mut self.members {
            if member.as_ref().is_some_and(|own| !own.is_in && now.saturating_sub(own.received) > SILENCE) {
                *member = None;
            }
        }
    }

    /// Records that a computer has shown a frame.
    pub(super) fn shown(&mut self, node: u64, frame: u64, now: Duration) {
        let Some(slot) = self.find(node) else { return };
        let Some(turn) = self.turns.iter_mut().find(|turn| turn.number == frame) else { return };
        let Some(at) = turn.to_show.iter().position(|other| *other == slot) else { return };
        turn.to_show.swap_remove(at);
        match turn.first_shown {
            None => turn.first_shown = Some(now),
            Some(first) if turn.to_show.is_empty() => record(&mut self.skew_us, now.saturating_sub(first)),
            Some(_) => {}
        }
    }

    /// Number of frames that were shown in the last second.
    pub(super) fn frames_a_second(&self, now: Duration) -> f64 {
        let recent = self.swaps.iter().filter(|at| now.saturating_sub(**at) <= Duration::from_secs(1));
        let (Some(first), count) = (recent.clone().next(), recent.count()) else { return 0.0 };
        let secs = now.saturating_sub(*first).as_secs_f64();
        if secs > 0.0 { (count - 1) as f64 / secs } else { 0.0 }
    }

    /// Three times: from a frame's beginning to its swap, between two swaps, and from the first computer that shows a
    /// frame to the last computer.
    pub(super) fn times(&self) -> [Times; 3] {
        [&self.frame_us, &self.period_us, &self.skew_us].map(Times::of)
    }

    /// The state of each screen's computer. `events` is the number of the session's events that the hub has applied.
    pub(super) fn nodes(&self, events: u64) -> Vec<NodeReport> {
        let of = |((screen, member), counts): ((&String, &Option<Member>), &Counts)| {
            let Counts { differed, missed, dropped } = *counts;
            let of_screen =
                NodeReport { screen: screen.clone(), differed, missed, dropped, ..NodeReport::default() };
            let Some(member) = member else { return of_screen };
            NodeReport {
                place: if member.is_in { Place::In } else { Place::Out },
                host: member.host.clone(),
                ready: Times::of(&member.ready_us),
                behind: events.saturating_sub(member.events),
                difference: member.difference.map(|(what, _)| what.to_owned()),
                ..of_screen
            }
        };
        self.screens.iter().zip(&self.members).zip(&self.counts).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAME: Answer = Answer { log: 1, seen: 2 };

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn wall(screens: &[&str]) -> Barrier {
        let mut barrier =
            Barrier::new(screens.iter().map(|&name| name.to_owned()).collect(), Duration::from_secs(1));
        for (screen, node) in screens.iter().zip(1..) {
            barrier.here(node, screen, &format!("pc{node}"), 0, ms(0)).expect("its screen is free");
        }
        barrier
    }

    /// A frame that each of these computers answers some milliseconds after its beginning.
    fn frame(barrier: &mut Barrier, number: u64, answers: &[(u64, u64, Answer)]) -> Vec<HubEvent> {
        let began = ms(number * 100);
        barrier.begin(number, vec![SAME; barrier.screens.len()], began);
        let mut answers = answers.to_vec();
        answers.sort_by_key(|(_, after, _)| *after);
        let mut swapped = false;
        for (node, after, answer) in answers {
            let now = began + ms(after);
            if !swapped && (barrier.is_complete() || now > barrier.deadline()) {
                barrier.swap(now.min(barrier.deadline()).max(began));
                swapped = true;
            }
            barrier.ready(node, number, answer, now);
        }
        if !swapped {
            let now = if barrier.is_complete() { began + ms(1) } else { barrier.deadline() };
            barrier.swap(now);
        }
        barrier.take_events()
    }

    fn places(barrier: &Barrier) -> Vec<Place> {
        barrier.nodes(0).into_iter().map(|node| node.place).collect()
    }

    #[test]
    fn a_node_is_let_in_after_twenty_answers_in_time_and_out_after_three_misses() {
        let mut barrier = wall(&["left", "right"]);
        for n in 0..19 {
            assert_eq!(frame(&mut barrier, n, &[(1, 5, SAME), (2, 30, SAME)]), [], "{n}");
        }
        let events = frame(&mut barrier, 19, &[(1, 5, SAME), (2, 40, SAME)]);
        // The hub waits for the slow computer, too: its usual time counts as in time.
        let is_in = |screen: &str, host: &str| HubEvent::In { screen: screen.into(), host: host.into() };
        assert_eq!(events, [is_in("left", "pc1")]);
        assert_eq!(frame(&mut barrier, 20, &[(1, 5, SAME), (2, 30, SAME)]), [is_in("right", "pc2")]);
        assert_eq!(places(&barrier), [Place::In, Place::In]);
        // The hub waits for the slow computer for about three times its usual time.
        barrier.begin(21, vec![SAME; 2], ms(2100));
        let deadline = barrier.deadline() - ms(2100);
        assert!((ms(80)..ms(110)).contains(&deadline), "{deadline:?}");
        // Neither computer answers this frame.
        barrier.swap(ms(2200));
        assert_eq!(frame(&mut barrier, 22, &[(1, 5, SAME)]), []);
        assert!(!barrier.is_complete());
        let events = frame(&mut barrier, 23, &[(1, 5, SAME)]);
        let why = "three frames without an answer in time";
        assert_eq!(events, [HubEvent::Out { screen: "right".into(), host: "pc2".into(), why }]);
        assert_eq!(places(&barrier), [Place::In, Place::Out]);
        // From here on the hub waits only for the other computer.
        barrier.begin(25, vec![SAME; 2], ms(2500));
        barrier.ready(1, 25, SAME, ms(2501));
        assert!(barrier.is_complete());
        // The computer comes back.
        for n in 26..45 {
            assert_eq!(frame(&mut barrier, n, &[(1, 5, SAME), (2, 30, SAME)]), [], "{n}");
        }
        assert_eq!(frame(&mut barrier, 45, &[(1, 5, SAME), (2, 30, SAME)]), [is_in("right", "pc2")]);
        let nodes = barrier.nodes(0);
        assert_eq!((nodes[0].dropped, nodes[1].dropped), (0, 1));
        assert!(nodes[1].missed >= 3);
    }

    #[test]
    fn one_late_answer_is_no_reason_to_leave_a_node_out() {
        let mut barrier = wall(&["left"]);
        for n in 0..20 {
            frame(&mut barrier, n, &[(1, 5, SAME)]);
        }
        for n in 20..120 {
            let answer: &[_] = if n % 3 == 0 { &[(1, 5, SAME)] } else { &[] };
            assert_eq!(frame(&mut barrier, n, answer), [], "{n}");
        }
        assert_eq!(places(&barrier), [Place::In]);
    }

    #[test]
    fn a_node_with_another_model_or_picture_is_named_once_and_again_when_it_is_well() {
        let mut barrier = wall(&["left", "right"]);
        for n in 0..20 {
            frame(&mut barrier, n, &[(1, 5, SAME), (2, 5, SAME)]);
        }
        let other = Answer { seen: 3, ..SAME };
        let differs =
            |frame, what| HubEvent::Differs { screen: "right".into(), host: "pc2".into(), frame, what };
        let events = frame(&mut barrier, 20, &[(1, 5, SAME), (2, 5, other)]);
        assert_eq!(events, [differs(20, "its visible polygons differ")]);
        assert_eq!(frame(&mut barrier, 21, &[(1, 5, SAME), (2, 5, other)]), []);
        assert_eq!(barrier.nodes(0)[1].difference.as_deref(), Some("its visible polygons differ"));
        // The report comes after a second. A computer that agrees only in every other frame is not reported each time.
        for n in 22..31 {
            assert_eq!(frame(&mut barrier, n, &[(1, 5, SAME), (2, 5, SAME)]), [], "{n}");
        }
        let events = frame(&mut barrier, 31, &[(1, 5, SAME), (2, 5, SAME)]);
        assert_eq!(events, [HubEvent::Agrees { screen: "right".into(), host: "pc2".into() }]);
        let other = Answer { log: 9, seen: 9 };
        let events = frame(&mut barrier, 32, &[(1, 5, SAME), (2, 5, other)]);
        assert_eq!(events, [differs(32, "its events differ")]);
        let differed =
            |barrier: &Barrier| barrier.nodes(0).iter().map(|node| node.differed).collect::<Vec<_>>();
        assert_eq!(differed(&barrier), [0, 3]);
        // The counts of a screen stay when another computer shows it.
        barrier.leaves(2);
        assert_eq!((differed(&barrier), barrier.nodes(0)[1].dropped), (vec![0, 3], 1));
        barrier.here(7, "right", "pc7", 0, ms(3300)).expect("it is free");
        assert_eq!((differed(&barrier), barrier.nodes(0)[1].difference.clone()), (vec![0, 3], None));
    }

    #[test]
    fn a_frame_waits_no_longer_than_it_may_and_a_node_that_is_slower_stays_out() {
        let mut barrier = Barrier::new(vec!["left".into(), "right".into()], ms(12));
        for (screen, node) in [("left", 1), ("right", 2)] {
            barrier.here(node, screen, "pc", 0, ms(0)).expect("its screen is free");
        }
        for n in 0..60 {
            frame(&mut barrier, n, &[(1, 5, SAME), (2, 30, SAME)]);
            let began = ms(n * 100);
            assert!(barrier.deadline() <= began + ms(12), "{n}");
        }
        assert_eq!(places(&barrier), [Place::In, Place::Out]);
    }

    #[test]
    fn the_same_answer_twice_counts_once_and_strangers_do_not_count() {
        let mut barrier = wall(&["left"]);
        barrier.begin(0, vec![SAME], ms(0));
        let other = Answer { log: 1, seen: 7 };
        for (node, frame) in [(1, 0), (1, 0), (77, 0), (1, 5)] {
            barrier.ready(node, frame, other, ms(1));
        }
        assert!(matches!(&barrier.take_events()[..], [HubEvent::Differs { frame: 0, .. }]));
        assert_eq!(barrier.nodes(0)[0].differed, 1);
    }

    #[test]
    fn a_screen_has_one_node_and_another_one_once_that_is_gone() {
        let mut barrier = wall(&["left"]);
        let refused = barrier.here(2, "left", "pc2", 0, ms(100)).expect_err("it is taken");
        assert_eq!(refused, "pc1 shows `left` already");
        let refused = barrier.here(2, "ceiling", "pc2", 0, ms(100)).expect_err("there is none");
        assert_eq!(refused, "its rig has no screen `ceiling`");
        // The computer is silent, and the hub has never waited for it.
        assert_eq!(barrier.here(2, "left", "pc2", 0, ms(1600)), Ok(()));
        for n in 17..37 {
            frame(&mut barrier, n, &[(2, 5, SAME)]);
        }
        assert_eq!(places(&barrier), [Place::In]);
        barrier.leaves(2);
        assert!(matches!(&barrier.take_events()[..], [HubEvent::Out { why: "it has left", .. }]));
        assert_eq!(places(&barrier), [Place::Absent]);
        assert_eq!(barrier.here(3, "left", "pc3", 0, ms(6001)), Ok(()));
    }

    #[test]
    fn skew_is_from_the_first_to_the_last_that_shows_a_frame() {
        let mut barrier = wall(&["left", "right"]);
        for n in 0..21 {
            frame(&mut barrier, n, &[(1, 5, SAME), (2, 5, SAME)]);
            barrier.shown(1, n, ms(n * 100 + 20));
            barrier.shown(2, n, ms(n * 100 + 23));
        }
        let [_, period, skew] = barrier.times();
        assert_eq!((skew.count, skew.max_us / 10), (1, 300), "only the last frame had both nodes in");
        assert_eq!(period.count, 20);
        let fps = barrier.frames_a_second(ms(2006));
        assert!((9.0..=11.0).contains(&fps), "{fps}");
        assert_eq!(barrier.frames, 21);
    }
}
