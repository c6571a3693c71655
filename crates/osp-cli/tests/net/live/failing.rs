//! What goes wrong: servers and members that end in the middle, and servers that are none.

use osp_testkit::events::events_in;
use std::fs;

use super::{
    members::{Ended, Member, assert_same, drawn, places, recording},
    server::Server,
};

#[test]
fn a_server_that_is_killed_and_started_again_loses_nothing() {
    let Some(mut server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (address, class) = (server.session("class"), recording("class.ron"));
    let mut keeper = Member::keeper(folder.path(), &address);
    let mut members: Vec<_> = ["1", "2", "3"]
        .map(|author| {
            let args = ["--play", &class, "--play-author", author, "--name", author, "--until-empty"];
            Member::join(folder.path(), &format!("{author}.ron"), &address, &args)
        })
        .into();
    for lines in [150, 450] {
        members[0].wait_for_lines(lines);
        server.kill();
        // They draw on.
        members.iter_mut().for_each(Member::wait_for_silence);
        server.start_again();
    }
    keeper.wait_for(|text| text.matches("Leave(").count() == 3);
    keeper.interrupt();
    keeper.end();
    let ended: Vec<_> = members.into_iter().map(Member::end_well).collect();
    assert_same(&ended);
    let places = places(&folder.path().join("1.ron"));
    for (name, author) in [("1", 1), ("2", 2), ("3", 3)] {
        assert_eq!(places[name], drawn(&class, Some(author)), "{name}");
    }
    assert!(ended.iter().all(|member| member.count("connections") >= 3), "{}", ended[0].said);
    assert!(ended[0].said.contains("does not answer"), "{}", ended[0].said);
}

#[test]
fn without_a_server_one_draws_on_and_is_heard_when_it_comes() {
    let Some(mut server) = Server::start() else { return };
    server.kill();
    let folder = tempfile::tempdir().expect("a folder");
    let class = recording("class.ron");
    let args = ["--play", &class, "--play-author", "1", "--speed", "10", "--name", "Ann"];
    let mut ann = Member::join(folder.path(), "a.ron", &server.session("class"), &args);
    ann.wait_for_silence();
    server.start_again();
    ann.end_well();
    assert_eq!(places(&folder.path().join("a.ron"))["Ann"], drawn(&class, Some(1)));
    // One that never comes: what was drawn is said not to be delivered.
    server.kill();
    let args = ["--play", &class, "--play-author", "1", "--speed", "100"];
    let mut nobody = Member::join(folder.path(), "b.ron", &server.session("class"), &args);
    nobody.wait_for_silence();
    nobody.interrupt();
    let nobody = nobody.end();
    assert_eq!(nobody.code, Some(1), "{}", nobody.said);
    assert!(nobody.summary["undelivered"].as_u64().expect("a number") > 0, "{}", nobody.summary);
    assert!(nobody.said.contains("events of this member are not in the session"), "{}", nobody.said);
}

#[cfg(unix)]
#[test]
fn the_strokes_of_who_is_killed_end_for_all_and_ctrl_c_leaves() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (address, portrait) = (server.session("portrait"), recording("portrait.ron"));
    let keeper = Member::keeper(folder.path(), &address);
    let mut watcher = Member::join(folder.path(), "watched.ron", &address, &["--watch", "--until-empty"]);
    let ann = Member::join(folder.path(), "ann.ron", &address, &["--play", &portrait, "--name", "Ann"]);
    let is_drawing = |text: &str| text.lines().last().is_some_and(|line| line.starts_with("Point("));
    watcher.wait_for(|text| text.lines().count() > 100 && is_drawing(text));
    let ann_has = ann.kill();
    let killed = |text: &str| text.contains("Leave(t:") && text.contains("author:2)");
    watcher.wait_for(|text| text.lines().any(|line| line.starts_with("Leave(") && killed(line)));
    keeper.interrupt();
    let ended = [watcher.end_well(), keeper.end_well()];
    assert_same(&ended);
    assert!(ended[0].bytes.starts_with(&ann_has), "what she had is the beginning");
    let text = String::from_utf8(ended[0].bytes.clone()).expect("text");
    let leaves: Vec<_> = text.lines().filter(|line| line.starts_with("Leave(")).collect();
    assert!(
        leaves.len() == 2 && leaves[0].ends_with("author:2)") && leaves[1].ends_with("author:1)"),
        "{leaves:?}"
    );
    // No stroke stays open: the scene ends those of who has left.
    let mut scene = osp_session::scene::Scene::new();
    let events = events_in(folder.path().join("watched.ron"));
    scene.apply_all(&events, &mut Vec::new());
    assert!(scene.strokes().iter().all(|stroke| !stroke.is_open()));
}

fn fails(ended: &Ended, expected: &str) {
    assert_eq!(ended.code, Some(2), "{}", ended.said);
    assert!(
        ended.said.lines().last().is_some_and(|line| line.starts_with("error: ") && line.contains(expected)),
        "{}",
        ended.said
    );
}

#[test]
fn a_server_that_has_lost_the_session_is_not_believed() {
    let Some(mut server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (address, class) = (server.session("class"), recording("class.ron"));
    let keeper = Member::keeper(folder.path(), &address);
    let args = ["--play", &class, "--play-author", "1", "--name", "Ann", "--until-empty"];
    let mut ann = Member::join(folder.path(), "a.ron", &address, &args);
    ann.wait_for_lines(50);
    server.kill();
    let had = fs::read(&ann.file).expect("a recording");
    server.forget();
    server.start_again();
    let ended = ann.end();
    fails(&ended, "the server has lost the session");
    drop(keeper);
    assert!(ended.bytes.starts_with(&had), "the recording keeps what was there");
    // And a recording of that session is not replaced by another one of the same name.
    let bob = Member::join(
        folder.path(),
        "b.ron",
        &address,
        &["--play", &class, "--play-author", "2", "--name", "Bob", "--speed", "10"],
    );
    bob.end_well();
    let again = Member::join(folder.path(), "a.ron", &address, &["--watch"]).end();
    fails(&again, "a.ron: it is not the beginning of this session; --force replaces it");
    assert_eq!(again.bytes, ended.bytes);
}
