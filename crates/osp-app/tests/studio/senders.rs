//! Several senders, each a separate author.

use std::net::UdpSocket;

use glam::{Quat, Vec3};
use osp_app::{
    Access, Autosaves, Button, Command, Opening, Session,
    tracker::{Listening, TrackerOptions},
};
use osp_session::{
    recording::{AUTHORS_FORMAT, Author, Event, OpenOptions, open},
    scene::Scene,
};

use crate::{
    drawing::{Table, across},
    tracker::{listen, sender, wait_until},
};

/// Returns a table that listens to several senders, and a function that sends as one of them.
fn table() -> (Table, impl Fn(&mut Table, &UdpSocket, &str)) {
    let mut table = Table::new();
    let options = TrackerOptions { listening: Listening::Authors, ..TrackerOptions::default() };
    table.studio.set_tracker(listen(&options));
    let say = |table: &mut Table, socket: &UdpSocket, text: &str| {
        let heard = table.studio.tracker().expect("a tracker").counts().messages;
        socket.send(text.as_bytes()).expect("sent");
        let lines = text.lines().count() as u64;
        let tracker = table.studio.tracker().expect("a tracker");
        wait_until("the datagram", || tracker.counts().messages == heard + lines);
        table.frame();
    };
    (table, say)
}

fn stroke(y: f32) -> String {
    let pose = |x: f32, pressure: u32| format!("hand {x} {y} 0 0 0 0 1 {pressure}\n");
    format!("{}{}{}", pose(0.0, 1), pose(0.1, 1), pose(0.2, 0))
}

/// Returns the numbers of visible strokes by author.
fn seen(scene: &Scene) -> Vec<(u32, usize)> {
    let authors = [0, 1, 2, 3].map(Author);
    let count = |author: Author| {
        let strokes = scene.strokes().iter().filter(|stroke| stroke.is_visible());
        strokes.filter(|stroke| stroke.id().is_some_and(|id| id.author() == author)).count()
    };
    authors.into_iter().map(|author| (author.0, count(author))).filter(|(_, count)| *count > 0).collect()
}

#[test]
fn every_sender_is_an_author_with_strokes_and_undo_of_its_own() {
    let (mut table, say) = table();
    table.studio.command(Command::New);
    let tracker = table.studio.tracker().expect("a tracker");
    let (ada, ben) = (sender(tracker), sender(tracker));
    say(&mut table, &ada, &stroke(0.0));
    say(&mut table, &ben, &stroke(0.1));
    // Both hands have the same number at the same time.
    say(&mut table, &ada, "hand 0 0.2 0 0 0 0 1 1\nhand 0.1 0.2 0 0 0 0 1 1");
    say(&mut table, &ben, &stroke(0.3));
    say(&mut table, &ada, "hand 0.2 0.2 0 0 0 0 1 1\nhand 0.2 0.2 0 0 0 0 1 0");
    table.drag(Button::Primary, &across(0.5));
    assert_eq!(seen(table.studio.scene()), [(0, 1), (1, 2), (2, 2)]);
    say(&mut table, &ben, "undo");
    assert_eq!(seen(table.studio.scene()), [(0, 1), (1, 2), (2, 1)]);
    table.studio.command(Command::Undo);
    table.frame();
    assert_eq!(seen(table.studio.scene()), [(1, 2), (2, 1)]);
    say(&mut table, &ada, "undo\nundo\nundo");
    assert_eq!(seen(table.studio.scene()), [(2, 1)]);
    say(&mut table, &ada, "redo");
    // Ben erases a stroke of Ada, and undoes that.
    say(&mut table, &ben, "erase 0.1 0 0");
    assert_eq!(seen(table.studio.scene()), [(2, 1)]);
    say(&mut table, &ben, "undo");
    assert_eq!(seen(table.studio.scene()), [(1, 1), (2, 1)]);

    let path = table.folder.path().join("class.ron");
    table.studio.command(Command::SaveAs(path.clone()));
    say(&mut table, &ada, "hand 0 0.6 0 0 0 0 1 1\nhand 0.1 0.6 0 0 0 0 1 1");
    // A sender that draws in the next session joins that one.
    table.studio.command(Command::New);
    table.frame();
    assert_eq!(table.studio.scene().authors().count(), 0);
    say(&mut table, &ben, &stroke(0.0));
    assert_eq!(seen(table.studio.scene()), [(1, 1)]);

    let session = open(&path, &OpenOptions::STRICT).expect("a session");
    assert_eq!(session.header.format, AUTHORS_FORMAT);
    let events: Vec<Event> = session.map(|event| event.expect("a whole line")).collect();
    let names = events.iter().filter_map(|event| match event {
        Event::Join { author, name, .. } => Some((author.0, name.clone())),
        _ => None,
    });
    let name = |socket: &UdpSocket| socket.local_addr().expect("a port").to_string();
    assert_eq!(names.collect::<Vec<_>>(), [(1, name(&ada)), (2, name(&ben))]);
    let [.., Event::End { .. }, Event::Leave { author: first, .. }, Event::Leave { author: second, .. }] =
        &events[..]
    else {
        panic!("{:?}", &events[events.len() - 3..])
    };
    assert_eq!([first.0, second.0], [1, 2]);

    // If somebody continues the session, the numbers continue.
    table.studio.command(Command::Open(path));
    table.frame();
    assert_eq!(seen(table.studio.scene()), [(1, 2), (2, 1)]);
    say(&mut table, &ben, &stroke(0.7));
    assert_eq!(seen(table.studio.scene()), [(1, 2), (2, 1), (3, 1)]);
}

#[test]
fn in_a_session_of_one_author_all_senders_draw_as_one() {
    let (mut table, say) = table();
    let tracker = table.studio.tracker().expect("a tracker");
    let (ada, ben) = (sender(tracker), sender(tracker));
    say(&mut table, &ada, &stroke(0.0));
    say(&mut table, &ben, &stroke(0.1));
    assert_eq!(seen(table.studio.scene()), [(0, 2)]);
    let said = "tracker: this session has one author, who draws with all trackers";
    let told = table.studio.messages().iter().filter(|message| **message == said).count();
    assert_eq!(told, 1, "{:?}", table.studio.messages());
}

#[test]
fn a_file_that_is_new_is_begun_as_one_of_several_authors_if_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let autosaves = Autosaves::new(Some(folder.path().to_owned()));
    for (name, of_several) in [("one.ron", false), ("several.ron", true)] {
        let how = Opening { of_several, ..Opening::with(Access::Write) };
        let (mut document, _) =
            Session::open_as(&folder.path().join(name), &autosaves, how).expect("a session");
        assert_eq!(document.has_authors(), of_several);
        let head = Event::Head { author: Author::SOLE, t: 0.0, p: Vec3::ZERO, q: Quat::IDENTITY };
        assert!(document.apply(head));
        document.close().expect("written");
        // The session keeps its number of authors.
        let how = Opening { of_several: !of_several, ..how };
        let (document, _) = Session::open_as(&folder.path().join(name), &autosaves, how).expect("a session");
        assert_eq!(document.has_authors(), of_several);
        document.close().expect("written");
    }
}
