//! Lines that osp has not written.

use super::*;

#[test]
fn a_copy_has_the_lines_of_its_file_as_they_are() {
    let desk = Desk::new();
    let path = desk.path("a.ron");
    // More lines than are read at once, and not in the form that osp writes.
    let lines: Vec<String> =
        (0..5000).map(|n| format!("Head(t: {n}.50, p:(1e0 ,0,0),q:(0,0,0,1)) // head {n}")).collect();
    let header = "Header(format:1,name:\"a\",source:\"by hand\")";
    fs::write(&path, format!("{header}\r\n// a remark\r\n  {}", lines.join("\r\n"))).expect("written");
    let (mut copy, _) =
        Session::open_as(&path, &desk.autosaves(), Opening::with(Access::Copy)).expect("readable");
    draw(&mut copy, 1);
    let text = fs::read_to_string(copy.path()).expect("a file");
    let copied: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(copied.len(), 5001);
    assert!(copied[..5000] == lines, "{:?}", &copied[..3]);
    assert_eq!(events_in(copy.path()), 5001);
    let saved = desk.path("saved.ron");
    copy.save_as(&saved).expect("written");
    draw(&mut copy, 3);
    copy.close().expect("written");
    assert_eq!(events_in(&saved), 5004);
    let (again, _) = Session::open(&saved, &desk.autosaves()).expect("a session");
    assert_eq!(again.event_count(), 5004);
    again.close().expect("nothing to write");
}

#[test]
fn a_remark_behind_an_event_takes_no_memory() {
    let desk = Desk::new();
    let path = desk.path("a.ron");
    let header = "Header(format:1,name:\"a\",source:\"by hand\")";
    fs::write(&path, format!("{header}\nUndo(t:0.0) // {}\nUndo(t:0)\n", "x".repeat(1 << 20)))
        .expect("written");
    let (mut copy, _) =
        Session::open_as(&path, &desk.autosaves(), Opening::with(Access::Copy)).expect("readable");
    draw(&mut copy, 1);
    let text = fs::read_to_string(copy.path()).expect("a file");
    assert_eq!(text.lines().skip(1).take(2).collect::<Vec<_>>(), ["Undo(t:0.0)", "Undo(t:0)"]);
    copy.close().expect("written");
}

#[test]
fn a_sketch_that_is_only_viewed_has_no_lines_and_its_first_edit_needs_no_other_file() {
    let desk = Desk::new();
    let path = desk.path("a.ron.zst");
    let undo = |n: u32| Event::Undo { author: Author::SOLE, t: f64::from(n) };
    let mut writer = RonWriter::create(&path, &header(), Flush::AtEnd).expect("a file");
    (0..5000).for_each(|n| writer.write(&undo(n)).expect("an event"));
    writer.finish().expect("written");
    let (mut copy, _) = Session::open(&path, &desk.autosaves()).expect("readable");
    let (mut viewed, _) =
        Session::open_as(&path, &desk.autosaves(), Opening::with(Access::ReadOnly)).expect("readable");
    for session in [&copy, &viewed] {
        assert_eq!(session.event_count(), 5000);
        let header_only = History::new(session.header().clone()).expect("a header");
        assert_eq!(session.journal().history.bytes(), header_only.bytes());
        let log = session.journal().log();
        let mut events = log.read().expect("readable");
        (0..5000).for_each(|n| assert_eq!(events.next_event().expect("readable"), Some(undo(n))));
    }
    fs::write(&path, "another file").expect("written");
    draw(&mut copy, 1);
    assert_eq!(events_in(copy.path()), 5001, "all of it before the next event");
    copy.close().expect("written");
    let saved = desk.path("saved.ron");
    viewed.save_as(&saved).expect("written");
    assert_eq!(events_in(&saved), 5000);
    viewed.close().expect("written");
}
