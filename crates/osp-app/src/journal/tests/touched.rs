//! Files that other programs touch, and names that are too long for the files beside them.

use super::*;

#[test]
fn a_file_that_is_only_looked_at_or_written_over_by_itself_is_no_trouble() {
    let desk = Desk::new();
    let path = desk.drawn("a.ron");
    let mut document = desk.open("a.ron");
    draw(&mut document, 1);
    let text = fs::read(&path).expect("the file");
    for round in 1..4 {
        // Programs that synchronise a folder with another place do this; the contents do not differ.
        let mut file = fs::File::options().write(true).open(&path).expect("the file");
        std::io::Write::write_all(&mut file, &text).expect("written");
        file.set_modified(std::time::SystemTime::UNIX_EPOCH).expect("set");
        document.journal_mut().tend(Instant::now());
        draw(&mut document, 1);
        assert_eq!(document.journal().trouble(), None, "{round}");
    }
    document.close().expect("written");
    assert_eq!(events_in(&path), 7);
}

#[test]
fn a_session_with_the_longest_name_has_a_shelter() {
    let desk = Desk::new();
    // The longest name that Linux accepts; the name of the lock file beside it would be longer.
    let name = format!("{}\u{e4}.ron", "L".repeat(249));
    let mut document = desk.open(&name);
    draw(&mut document, 2);
    assert!(document.journal().trouble().is_some(), "no lock file can be made beside it");
    let shelter = document.journal().shelter().expect("a shelter").to_owned();
    assert_eq!(events_in(&shelter), 2);
    assert_eq!(document.close().expect_err("not at its place").kept_in, Some(shelter));
}

#[cfg(unix)]
#[test]
fn a_link_to_a_session_that_is_not_there_yet_makes_it() {
    let desk = Desk::new();
    fs::create_dir(desk.path("work")).expect("a folder");
    std::os::unix::fs::symlink("work/a.ron", desk.path("link.ron")).expect("a link");
    let mut document = desk.open("link.ron");
    draw(&mut document, 2);
    assert_eq!(document.journal().trouble(), None);
    // From here on it is one session under two names.
    let second = Session::open(&desk.path("work/a.ron"), &desk.autosaves());
    assert!(matches!(second, Err(OpenError::Held(_))), "{second:?}");
    document.close().expect("written");
    assert_eq!(events_in(&desk.path("work/a.ron")), 2);
    assert!(fs::symlink_metadata(desk.path("link.ron")).expect("the link").is_symlink());
    desk.open("work/a.ron").close().expect("no lock is left");
}
