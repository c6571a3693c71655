//! A window applies a burst of another member's events in slices of a frame, complete and in order.

use std::{fs, path::Path, time::Duration};

use osp::glam::{Quat, Vec3};
use osp_app::{Command, Studio};
use osp_net::live::{Link, ME, Role, Who};
use osp_session::recording::{Author, Event, NormalRule, StrokeId, Tool};
use osp_testkit::wait_until;

use super::{
    server::Server,
    sketch::{Window, have_all, saved, until},
};

/// Largest number of events of a slice.
const SLICE: u64 = 8192;
/// Samples that are sent at once.
const POINTS: u32 = 20_000;
/// Pairs of undo and redo that are sent after them.
const TURNS: usize = 400;

/// A long stroke, and then undo and redo in turn.
fn flood() -> Vec<Event> {
    let (author, t, stroke) = (Author::SOLE, 0.0, StrokeId(ME.number(0).expect("a number")));
    let (tool, color) = (Tool::Ribbon, (1.0, 1.0, 1.0, 1.0));
    let (paint, thinnest, normal) = (None, 1.0, NormalRule::default());
    let begin = Event::Begin { author, t, stroke, tool, width: 0.01, color, paint, thinnest, normal };
    let point = |n: u32| {
        let p = Vec3::new((n % 100) as f32 * 0.1, (n / 100) as f32 * 0.1, 0.0);
        Event::Point { t, stroke, p, q: Quat::IDENTITY, pressure: 1.0 }
    };
    let mut events = vec![begin];
    events.extend((0..POINTS).map(point));
    events.push(Event::End { t, stroke });
    for _ in 0..TURNS {
        events.extend([Event::Undo { author, t }, Event::Redo { author, t }]);
    }
    events
}

/// Sends the flood as a member without a window. Waits until these windows have received it but not applied it.
fn send(server: &Server, windows: &[&Window]) -> u64 {
    let known = windows[0].live().status().counts.events;
    let who = Who { name: "Bob".to_owned(), color: None };
    let address = server.session("house").parse().expect("an address");
    let bob = Link::open(&address, &Role::Author(who), || {});
    let bob = bob.expect("a thread");
    wait_until("an author", || bob.news().is_ok() && bob.status().author.is_some());
    let events = flood();
    // And that he has come.
    let count = events.len() as u64 + 1;
    bob.hand().send(events);
    wait_until("the flood", || windows.iter().all(|one| one.live().status().counts.events >= known + count));
    count
}

fn events_of(studio: &Studio) -> u64 {
    studio.session().event_count()
}

fn recording_of(folder: &Path) -> Vec<u8> {
    let files = saved(folder, "house");
    assert_eq!(files.len(), 1, "{files:?}");
    fs::read(&files[0]).expect("a recording")
}

#[test]
fn what_comes_at_once_is_taken_in_slices_of_a_frame() {
    let Some(server) = Server::start() else { return };
    let mut ann = Window::author(&server, "Ann");
    let mut eve = Window::join(&server, Role::Watcher);
    until(&mut [&mut ann, &mut eve], "an author", |all| all[0].is_author());
    let sent = send(&server, &[&ann, &eve]);

    let (start, mut before) = (events_of(&ann.studio), events_of(&ann.studio));
    let mut slices = Vec::new();
    while events_of(&ann.studio) < start + sent {
        if slices.len() == 2 {
            // Who draws meanwhile sees it at once, whether it has come back or not.
            ann.draw(0.2);
            let came_back = events_of(&ann.studio).saturating_sub(start + sent) as usize;
            assert!(ann.on_their_way() + came_back >= 15, "{} and {came_back}", ann.on_their_way());
            before = events_of(&ann.studio);
            slices.push(0);
            continue;
        }
        let work = ann.studio.scene().work().total();
        assert!(ann.studio.tend() || slices.is_empty(), "a frame is due as long as there is more");
        let now = events_of(&ann.studio);
        assert!(now > before, "each slice takes something: {now} of {}", start + sent);
        assert!(now - before <= SLICE, "{}", now - before);
        // Each undo and redo changes all polygons of the stroke; a slice changes them once.
        let work = ann.studio.scene().work().total() - work;
        assert!(work <= 2 * SLICE + u64::from(POINTS), "{work}");
        if now < start + sent {
            assert_eq!(ann.studio.tend_within(), Duration::ZERO, "slices follow each other");
        }
        slices.push(now - before);
        before = now;
    }
    assert!(slices.len() > 2, "{slices:?}");

    until(&mut [&mut ann, &mut eve], "all of it", have_all);
    assert!(ann.studio.tend_within() > Duration::ZERO && ann.studio.can(&Command::Undo));
    assert_eq!(ann.studio.scene().counts(), eve.studio.scene().counts());
    let bytes = [ann, eve].map(|window| {
        let Window { studio, folder } = window;
        studio.close().expect("written");
        assert!(saved(folder.path(), "house-own").is_empty(), "all that Ann has drawn is in the session");
        recording_of(folder.path())
    });
    assert!(bytes[1].starts_with(&bytes[0]), "in the same order, and nothing is left out");
}

#[test]
fn a_window_that_closes_in_the_middle_has_written_all_that_has_come() {
    let Some(server) = Server::start() else { return };
    let mut ann = Window::join(&server, Role::Watcher);
    let mut eve = Window::author(&server, "Eve");
    until(&mut [&mut ann, &mut eve], "an author", |all| all[1].is_author());
    send(&server, &[&ann, &eve]);
    ann.frame();
    until(&mut [&mut eve], "all of it", |all| {
        events_of(&all[0].studio) > u64::from(POINTS) + 2 * TURNS as u64
    });
    let recordings = [ann, eve].map(|Window { studio, folder }| {
        studio.close().expect("written");
        recording_of(folder.path())
    });
    let lines = recordings.each_ref().map(|text| text.iter().filter(|&&byte| byte == b'\n').count());
    assert!(recordings[1].starts_with(&recordings[0]), "{lines:?}");
    assert!(lines[0] > POINTS as usize + 2 * TURNS, "{lines:?}");
}
