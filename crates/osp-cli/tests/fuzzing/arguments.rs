//! Words and numbers of the command line, and the pace that they set: every event comes once, in its order, in a number
//! of frames that the events bound.

use super::input::{self, Input, below};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, Pace, Pacer},
    rig::Rig,
};

/// No frame of a replay is empty for longer than a pause may be.
const MOST_FRAMES_AN_EVENT: usize = 200;

pub fn run(data: &[u8]) {
    let (words, rest) = data.split_at(data.len().min(24));
    let words = String::from_utf8_lossy(words);
    for word in words.split(',') {
        let pace = word.parse::<Pace>();
        if let Ok(pace) = pace {
            assert_eq!(pace.to_string().parse(), Ok(pace));
            play(rest, pace);
        }
        let _ = (IndexKind::from_name(word), Method::from_name(word));
        if !word.contains('/') {
            let _ = Rig::open(word);
        }
        #[cfg(feature = "window")]
        let _ = word.parse::<osp_app::tracker::TrackerAddress>();
    }
    play(rest, Pace::Recorded);
}

fn play(data: &[u8], pace: Pace) {
    let mut u = Input::new(data);
    let events: Vec<Event> = (0..1 + below(&mut u, 60)).map(|_| input::event(&mut u)).collect();
    let mut pacer = Pacer::new(events.iter().cloned().map(Ok), pace);
    let (mut frame, mut played, mut frames) = (Vec::new(), Vec::new(), 0);
    while pacer.next_frame(&mut frame).expect("nothing is damaged") {
        played.append(&mut frame);
        frames += 1;
        assert!(
            frames <= MOST_FRAMES_AN_EVENT * events.len(),
            "{frames} frames at the pace {pace}: {events:?}"
        );
    }
    assert_eq!(played, events, "at the pace {pace}");
}
