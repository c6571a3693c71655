use super::*;
use Method::{Msvbsp, PreviousFrame};

const IN_VIEW: u64 = 50_000;

/// Number of frames that were culled by each method.
#[derive(Debug, Default, PartialEq)]
struct Used {
    msvbsp: u32,
    last: u32,
    /// Total cost of these frames, nanoseconds.
    cost_ns: f64,
    changes: u32,
}

fn play_all(switch: &mut AutoSwitch, frames: u32, mut outcome: impl FnMut(Method, u32) -> Outcome) -> Used {
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

/// If drawing takes 10 ns a polygon, only `Msvbsp` can save enough.
fn play(switch: &mut AutoSwitch, frames: u32, outcome: impl Fn(u32) -> Outcome) -> u32 {
    let used = play_all(switch, frames, |_, frame| outcome(frame));
    assert_eq!(used.last, 0);
    used.msvbsp
}

fn is_on(switch: &AutoSwitch) -> bool {
    switch.kept.is_some()
}

fn with_polygon_cost(polygon_ns: f64) -> AutoSwitch {
    AutoSwitch::new(AutoConfig { polygon_ns, ..AutoConfig::default() })
}

const MS: f64 = 1.0e6;

/// Constant outcomes: for each method its cost, milliseconds, and the number of polygons that it culls.
fn always(msvbsp: (f64, u64), last: (f64, u64)) -> impl Fn(Method, u32) -> Outcome + Copy {
    move |method, _| {
        let (cost_ms, culled) = if method == Msvbsp { msvbsp } else { last };
        Outcome { cost_ns: cost_ms * MS, culled }
    }
}

#[test]
fn what_was_visible_last_is_taken_where_it_alone_pays() {
    // Drawing takes 500 ms.
    let mut switch = with_polygon_cost(10_000.0);
    let used = play_all(&mut switch, 2000, always((4.0, 10), (80.0, 25_000)));
    assert_eq!(switch.kept, Some(PreviousFrame));
    assert!(used.last > 1500 && used.msvbsp < 100 && used.changes == 2, "{used:?}");
}

#[test]
fn large_occluders_are_taken_where_they_pay_more() {
    let mut switch = with_polygon_cost(10_000.0);
    let used = play_all(&mut switch, 5000, always((4.0, 25_000), (80.0, 26_000)));
    assert_eq!((switch.kept, used.changes), (Some(Msvbsp), 0), "{used:?}");
    assert!(used.last > 0 && used.last < 150, "it is tried all the same: {used:?}");
}

#[test]
fn what_pays_more_takes_the_place_of_what_pays() {
    let last = |found| always((4.0, 5_000), (80.0, found));
    // Drawing and culling take 454 ms with `Msvbsp`. `PreviousFrame` takes 280 ms, and later 530 ms.
    let mut switch = with_polygon_cost(10_000.0);
    assert!(play_all(&mut switch, 2000, last(30_000)).last > 1000);
    assert_eq!(switch.kept, Some(PreviousFrame));
    let used = play_all(&mut switch, 2000, last(4_000));
    // A method that has paid is tried sooner for a while.
    assert!(used.last < 200 && used.msvbsp > 1500, "{used:?}");
    assert_eq!(switch.kept, Some(Msvbsp));
    // `Msvbsp` takes 454 ms and `PreviousFrame` 440 ms: not worth a change.
    let mut switch = with_polygon_cost(10_000.0);
    assert_eq!(play_all(&mut switch, 4000, last(14_000)).changes, 0);
}

#[test]
fn methods_that_are_alike_do_not_take_turns() {
    let mut switch = with_polygon_cost(10_000.0);
    let used = play_all(&mut switch, 20_000, |method, frame| {
        let noise = (frame * 7919 % 21) as f64 / 20.0 - 0.5;
        match method {
            Msvbsp => Outcome { cost_ns: (60.0 + 20.0 * noise) * MS, culled: 20_000 },
            PreviousFrame => Outcome { cost_ns: (70.0 - 20.0 * noise) * MS, culled: 21_000 },
        }
    });
    assert!(used.changes <= 1, "{used:?}");
}

#[test]
fn none_is_kept_where_nothing_pays() {
    // Drawing takes 50 ms, tries take 120 and 10 ms. After the first tries, whose costs are not known, tries take 0.8 % of
    // the drawing time.
    let mut switch = with_polygon_cost(1_000.0);
    let outcome = always((10.0, 2_000), (120.0, 3_000));
    play_all(&mut switch, 100, outcome);
    let used = play_all(&mut switch, 20_000, outcome);
    let share = used.cost_ns / (20_000.0 * 50.0 * MS);
    assert_eq!((switch.kept, used.changes), (None, 0));
    assert!(share > 0.0060 && share < 0.0084, "{share} of the drawing: {used:?}");
    assert!(used.last >= 10 && used.msvbsp >= 150, "in turns: {used:?}");
}

#[test]
fn a_hopeless_first_frame_ends_a_try_and_a_good_one_does_not_count() {
    let mut switch = with_polygon_cost(10_000.0);
    // The first frame of each try costs more than it saves, because it fills all polygons in view.
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
    assert!(used.last > 400 && switch.kept == Some(PreviousFrame), "{used:?}, {first_frames}");
    let mut switch = with_polygon_cost(10_000.0);
    let (mut in_a_row, mut longest, mut last_frame) = (0, 0, u32::MAX);
    play_all(&mut switch, 3000, |method, frame| {
        if method == PreviousFrame {
            in_a_row = if last_frame.wrapping_add(1) == frame { in_a_row + 1 } else { 1 };
            (longest, last_frame) = (longest.max(in_a_row), frame);
        }
        Outcome { cost_ns: 200.0 * MS, culled: 100 }
    });
    assert_eq!(longest, 1);
}

#[test]
fn what_was_visible_last_is_not_tried_where_it_cannot_pay() {
    for polygon_ns in [10.0, 50.0] {
        let mut switch = with_polygon_cost(polygon_ns);
        let used = play_all(&mut switch, 20_000, |_, _| Outcome { cost_ns: 50_000.0, culled: 100 });
        assert_eq!(used.last, 0, "{polygon_ns}");
    }
    assert!(
        !with_polygon_cost(10.0).can_previous_frame_pay()
            && with_polygon_cost(1_000.0).can_previous_frame_pay()
    );
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
    assert_eq!(used, 8 + 100, "0.8 % of 500 µs pays for 50 µs in 13 frames; one in 32 is the most");
    assert!(!is_on(&switch));
    let mut switch = AutoSwitch::new(AutoConfig::default());
    assert_eq!(play(&mut switch, 20, |_| Outcome { cost_ns: 50_000.0, culled: 100 }), 3, "hopeless");
}

#[test]
fn tries_cost_little_of_the_drawing() {
    let mut switch = AutoSwitch::new(AutoConfig::default());
    play(&mut switch, 100, |_| Outcome { cost_ns: 400_000.0, culled: 100 });
    let used = play(&mut switch, 8000, |_| Outcome { cost_ns: 400_000.0, culled: 100 });
    assert!((76..=80).contains(&used), "{used} tries of 0.4 ms in 8000 frames of 0.5 ms");
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
fn a_frame_in_which_the_thread_had_to_wait_changes_nothing() {
    let mut switch = AutoSwitch::new(AutoConfig::default());
    // The culled polygons save 100 µs of drawing.
    let outcome = |frame| {
        let waited_ns = if frame % 40 == 39 { 10.0 * MS } else { 0.0 };
        Outcome { cost_ns: 50_000.0 + waited_ns, culled: 10_000 }
    };
    assert_eq!(play(&mut switch, 1000, outcome), 1000);
    // A method whose cost stays high is switched off soon.
    let used = play(&mut switch, 100, |_| Outcome { cost_ns: 10.0 * MS, culled: 10_000 });
    assert!(used < 20 && !is_on(&switch), "{used}");
}

#[test]
fn what_paid_recently_is_tried_sooner_and_kept_longer() {
    let good = |_| Outcome { cost_ns: 50_000.0, culled: 20_000 };
    let bad = |_| Outcome { cost_ns: 50_000.0, culled: 0 };
    let tries = |switch: &mut AutoSwitch| {
        while is_on(switch) {
            play(switch, 1, bad);
        }
        play(switch, 320, bad)
    };
    let (mut never, mut recently) =
        (AutoSwitch::new(AutoConfig::default()), AutoSwitch::new(AutoConfig::default()));
    play(&mut recently, 100, good);
    let (never, recently) = (tries(&mut never), tries(&mut recently));
    assert!(recently >= 3 * never && never > 5, "{recently} and {never}");
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
