//! Several authors draw at the same time.

use super::{
    members::{Member, assert_same, drawn, places, recording},
    server::Server,
};

/// Four authors at about their own pace, and one who comes in the middle.
#[test]
fn four_authors_and_a_late_one_have_the_same_session_with_everything_in_it() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (address, class) = (server.session("class"), recording("class.ron"));
    let join = |name: &str, author: &str| {
        let args =
            ["--play", &class, "--play-author", author, "--name", name, "--speed", "2", "--until-empty"];
        Member::join(folder.path(), &format!("{name}.ron"), &address, &args)
    };
    let mut keeper = Member::keeper(folder.path(), &address);
    let mut members: Vec<_> =
        [("Ann", "1"), ("Bob", "2"), ("Cem", "3"), ("Dot", "2")].map(|(n, a)| join(n, a)).into();
    keeper.wait_for_lines(300);
    members.push(join("Eve", "1"));
    members.push(Member::join(folder.path(), "watched.ron", &address, &["--watch", "--until-empty"]));
    keeper.wait_for(|text| text.contains("\"Eve\""));
    keeper.interrupt();
    keeper.end();
    let ended: Vec<_> = members.into_iter().map(Member::end_well).collect();
    assert_same(&ended);
    let places = places(&folder.path().join("Ann.ron"));
    for (name, author) in [("Ann", 1), ("Bob", 2), ("Cem", 3), ("Dot", 2), ("Eve", 1)] {
        assert_eq!(places[name], drawn(&class, Some(author)), "{name}");
    }
    for member in &ended[..5] {
        assert_eq!(
            member.summary["latency"]["messages"].as_u64().expect("a number") + 1,
            member.count("own_messages")
        );
        assert_eq!(member.summary["authors"].as_array().expect("a list").len(), 6);
    }
    // Who comes later than all gets the same from the server's file, and a recording that was cut off is continued.
    let part = &ended[0].bytes[..ended[0].bytes.len() / 3];
    std::fs::write(folder.path().join("later.ron"), part).expect("written");
    let later = Member::join(folder.path(), "later.ron", &address, &["--watch", "--until-empty"]).end_well();
    assert_same(&[later, ended.into_iter().next().expect("five")]);
}
