//! Windows that go on in the file in which a session was left.

use std::{fs, path::Path};

use osp_app::{Autosaves, Live, Studio, Unjoined};
use osp_net::live::{Address, Role, Who};
use osp_rivals::IndexKind;
use osp_session::recording::{Event, Limits, OpenOptions};

use super::{
    server::Server,
    sketch::{Window, have_all, saved, until},
};

/// Joins with this file, and the remarks about it; why not.
fn join(server: &Server, session: &str, name: &str, path: &Path) -> Result<(Window, Vec<String>), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let autosaves = Autosaves::new(Some(folder.path().to_owned()));
    let unjoined = Unjoined::open(path, session, &autosaves, Limits::DEFAULT);
    let (unjoined, opened) = unjoined.map_err(|error| error.to_string())?;
    let address: Address = server.session(session).parse().expect("an address");
    let role = Role::Author(Who { name: name.to_owned(), color: None });
    let joined = unjoined.join(Live::join(&address, &role, &autosaves).expect("a thread"));
    let studio = Studio::new(joined, autosaves, IndexKind::Osp);
    Ok((Window { studio, folder }, opened.remarks))
}

/// The same, where there is nothing to remark.
fn join_in(server: &Server, session: &str, name: &str, path: &Path) -> Result<Window, String> {
    let (window, remarks) = join(server, session, name, path)?;
    assert!(remarks.is_empty(), "{remarks:?}");
    Ok(window)
}

fn strokes(count: u64) -> impl Fn(&[&mut Window]) -> bool {
    move |all| all.iter().all(|one| one.studio.scene().counts().strokes == count) && have_all(all)
}

#[test]
fn who_comes_back_with_the_same_file_has_what_those_have_who_stayed() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("house.ron");
    let mut eve = Window::join(&server, Role::Watcher);
    let mut ann = join_in(&server, "house", "Ann", &path).expect("a new file");
    until(&mut [&mut ann], "an author", |all| all[0].is_author());
    ann.draw(0.2);
    until(&mut [&mut ann, &mut eve], "her stroke", strokes(1));
    // Its file is held.
    assert!(join_in(&server, "house", "Ann", &path).err().expect("held").contains("house.ron"));
    ann.studio.close().expect("written");
    let left = fs::read(&path).expect("the file");
    // A crash cuts the last line off.
    fs::write(&path, &left[..left.len() - 9]).expect("written");
    let mut bob = Window::author(&server, "Bob");
    bob.draw(-0.2);
    until(&mut [&mut bob, &mut eve], "his stroke", strokes(2));

    let (mut ann, remarks) = join(&server, "house", "Ann", &path).expect("the file");
    assert!(remarks[0].contains("the file ends inside this line"), "{remarks:?}");
    assert_eq!(ann.studio.scene().counts().strokes, 1, "what the file has is shown at once");
    until(&mut [&mut ann, &mut bob, &mut eve], "she has his stroke", strokes(2));
    ann.draw(0.4);
    until(&mut [&mut ann, &mut bob, &mut eve], "her next stroke", strokes(3));
    assert_eq!(ann.studio.scene().counts().ignored_events, 0);
    ann.studio.close().expect("written");
    assert!(saved(ann.folder.path(), "house").is_empty(), "she has no other file");
    until(&mut [&mut bob, &mut eve], "she has left", |all| {
        all.iter()
            .all(|one| one.studio.scene().authors().filter(|(_, info)| info.left_secs.is_some()).count() == 2)
    });
    eve.studio.close().expect("written");
    let stayed = fs::read(&saved(eve.folder.path(), "house")[0]).expect("a recording");
    let came_back = fs::read(&path).expect("the file");
    assert!(stayed == came_back, "{} and {} bytes", stayed.len(), came_back.len());
    assert!(came_back.starts_with(&left));
}

#[test]
fn a_file_of_something_else_is_left_as_it_is() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("house.ron");
    let mut ann = join_in(&server, "house", "Ann", &path).expect("a new file");
    until(&mut [&mut ann], "an author", |all| all[0].is_author());
    ann.draw(0.2);
    until(&mut [&mut ann], "her stroke", strokes(1));
    ann.studio.close().expect("written");
    let left = fs::read(&path).expect("the file");
    let why = join_in(&server, "garden", "Ann", &path).err().expect("another session");
    assert!(
        why.contains("house.ron: ") && why.contains("the recording of the shared session garden"),
        "{why}"
    );

    // Of the same name, on a server that has another one, or none.
    let other = Server::start().expect("a second server");
    for _ in 0..2 {
        let mut ann = join_in(&other, "house", "Ann", &path).expect("the file");
        until(&mut [&mut ann], "it is said", |all| {
            let said = all[0].live().shown();
            said.contains("house.ron: expected the beginning of this session") && all[0].live().is_watcher()
        });
        ann.draw(-0.2);
        assert_eq!(ann.on_their_way(), 0);
        ann.studio.close().expect("closed");
        assert_eq!(fs::read(&path).expect("the file"), left);
        let mut bob = Window::author(&other, "Bob");
        until(&mut [&mut bob], "an author", |all| all[0].is_author());
        bob.draw(0.1);
        until(&mut [&mut bob], "his stroke", have_all);
        bob.studio.close().expect("written");
    }
    let session = osp_session::recording::open(&path, &OpenOptions::default()).expect("a recording");
    assert!(session.filter(|event| matches!(event, Ok(Event::End { .. }))).count() == 1);
}
