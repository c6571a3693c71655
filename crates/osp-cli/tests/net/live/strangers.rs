//! Who may write, who may not, and what is not understood.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use super::{
    members::{Member, assert_same, drawn, places, recording},
    server::Server,
};
use crate::OSP;

#[test]
fn garbage_strangers_and_duplicates_are_counted_and_change_nothing() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (address, class) = (server.session("class"), recording("class.ron"));
    let mut heard = server.wire();
    heard.subscribe("osp.class");
    let join = |name: &str, author: &str| {
        let args = ["--play", &class, "--play-author", author, "--name", name, "--until-empty"];
        Member::join(folder.path(), &format!("{name}.ron"), &address, &args)
    };
    let keeper = Member::keeper(folder.path(), &address);
    let mut members = vec![join("Ann", "1"), join("Bob", "2")];
    members[0].wait_for_lines(60);
    let mut stranger = server.wire();
    let messages: Vec<_> = (0..20).map(|_| heard.message()).collect();
    let long = vec![b'x'; 520 << 10];
    let garbage: [&[u8]; 7] = [
        b"",
        b"hello",
        &[0xff, 0x00, 0x80],
        b"osp-live-1 0123456789abcdef 0\nnonsense\n",
        b"osp-live-1 0123456789abcdef 0\nJoin(t:0,author:0)\n",
        b"osp-live-9 0123456789abcdef 0\n",
        &long,
    ];
    for bytes in garbage {
        stranger.publish("osp.class", bytes);
    }
    // Somebody who has not joined draws, and takes back what others have done.
    stranger.publish("osp.class", b"osp-live-1 0123456789abcdef 0\nUndo(t:1,author:1)\n");
    // Somebody joins and then does what only others may.
    stranger.publish("osp.class", b"osp-live-1 fedcba9876543210 0\nJoin(t:1,author:1,name:\"Mallory\")\n");
    stranger.publish("osp.class", b"osp-live-1 fedcba9876543210 1\nUndo(t:1,author:1)\n");
    stranger.publish("osp.class", b"osp-live-1 fedcba9876543210 9\nUndo(t:1,author:4)\n");
    stranger.publish("osp.class", b"osp-live-1 fedcba9876543210 2\nLeave(t:1,author:4)\n");
    // All that was said is said again.
    for message in &messages {
        stranger.publish("osp.class", message);
    }
    stranger.publish("osp-here.class", b"\xff\xffgarbage");
    stranger.settle();
    members.push(Member::join(folder.path(), "watched.ron", &address, &["--watch", "--until-empty"]));
    keeper.interrupt();
    keeper.end();
    let ended: Vec<_> = members.into_iter().map(Member::end_well).collect();
    assert_same(&ended);
    let places = places(&folder.path().join("Ann.ron"));
    assert_eq!(places["Ann"], drawn(&class, Some(1)));
    assert_eq!(places["Bob"], drawn(&class, Some(2)));
    let text = String::from_utf8(ended[0].bytes.clone()).expect("text");
    assert_eq!(
        text.lines().filter(|line| line.starts_with("Undo(t:1,") || line.starts_with("Undo(t:1.0,")).count(),
        0
    );
    for member in &ended {
        // The longest one the server itself has refused; the one on the other subject only those have heard who were there.
        assert!(member.count("garbage") >= 6, "{}", member.summary);
        assert_eq!(member.count("strangers"), 1);
        assert_eq!((member.count("refused"), member.count("gaps")), (1, 1));
        assert!(member.count("duplicates") >= 20);
        assert!(member.said.contains("messages are ignored"), "{}", member.said);
    }
}

/// Ends a thread, also where the test fails.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A sender is whoever chooses a number: one connection can be thousands of them.
#[test]
fn one_that_joins_thousands_of_times_does_not_fill_the_room() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (address, class) = (server.session("class"), recording("class.ron"));
    let play = |name: &str, author: &str, more: &[&str]| {
        let args = ["--play", &class, "--play-author", author, "--name", name, "--speed", "100"];
        Member::join(folder.path(), &format!("{name}.ron"), &address, &[&args[..], more].concat())
    };
    play("Ann", "1", &[]).end_well();
    let is_over = AtomicBool::new(false);
    let mut wire = server.wire();
    let (flooded, all_joined) = std::sync::mpsc::channel();
    std::thread::scope(|scope| {
        let (is_over, over) = (&is_over, Over(&is_over));
        scope.spawn(move || {
            for sender in 1u64.. {
                let join = format!("osp-live-1 {sender:016x} 0\nJoin(t:1,author:1,name:\"\")\n");
                wire.publish("osp.class", join.as_bytes());
                if sender == 4094 {
                    wire.settle();
                    let _ = flooded.send(());
                }
                // Then so many that mostly they are the first when one more may join, but not more than members can read.
                if sender > 4094 && sender % 8 == 0 {
                    wire.settle();
                    std::thread::sleep(Duration::from_millis(4));
                }
                if is_over.load(Ordering::Relaxed) {
                    return;
                }
            }
        });
        all_joined.recv().expect("the server takes them");
        // Who comes meanwhile is told that it is not in the session, and why; nothing that it has drawn is lost sight of.
        // Every ten seconds one more may join: whoever has that luck, another one comes after it.
        let refused = |name: &str, args: &[&str]| {
            let mut tries = (0..).map(|number| {
                let file = format!("{name}-{number}.ron");
                let mut member = Member::join(folder.path(), &file, &address, args);
                member
                    .wait_until_it_says(|said| said.contains("too many") || said.contains("this is author"));
                member.interrupt();
                member.end()
            });
            tries.find(|member| member.summary["author"].is_null()).expect("one is refused")
        };
        let drawing = ["--play", &class, "--play-author", "2", "--name", "Eve", "--speed", "100"];
        let members = [refused("Eve", &drawing), refused("idle", &[])];
        drop(over);
        for member in members {
            assert_eq!(member.code, Some(1), "{}", member.said);
            assert!(member.said.contains("too many have joined"), "{}", member.said);
            assert_eq!(member.summary["connection"], "crowded", "{}", member.said);
        }
    });
    // And afterwards there is room.
    let bob = play("Bob", "2", &[]).end_well();
    assert_eq!(places(&folder.path().join("Bob.ron"))["Bob"], drawn(&class, Some(2)));
    let joined = bob.summary["author"].as_u64().expect("a number");
    assert!((128..1000).contains(&joined), "{joined} have joined");
}

/// Users of a server: one may do all, one may only look.
const USERS: &str = r#"
authorization {
  users = [
    { user: ann, password: "a:word" }
    { user: eve, password: other, permissions: {
        publish: ["$JS.API.STREAM.INFO.osp-class", "$JS.API.CONSUMER.CREATE.osp-class.>",
                  "$JS.API.CONSUMER.CREATE.osp-class", "$JS.API.CONSUMER.MSG.NEXT.osp-class.>"]
        subscribe: ["_INBOX.>", "osp-here.class"] } }
  ]
}"#;

#[test]
fn who_may_only_look_looks_and_writes_nothing() {
    let Some(server) = Server::with(USERS) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let class = recording("class.ron");
    let address = |user: &str| format!("nats://{user}@127.0.0.1:{}/class", server.port);
    // Before there is a session, who only watches does not make one.
    let early =
        Member::join(folder.path(), "early.ron", &address("eve:other"), &["--watch", "--until-empty"]);
    std::fs::write(folder.path().join("who"), "ann:a:word\n").expect("written");
    let ann =
        ["--play", &class, "--play-author", "1", "--name", "Ann", "--speed", "4", "--credentials", "who"];
    let ann = Member::join(folder.path(), "ann.ron", &server.session("class"), &ann).end_well();
    let early = early.end_well();
    let late = Member::join(folder.path(), "late.ron", &address("eve:other"), &["--watch", "--until-empty"])
        .end_well();
    assert_eq!((early.count("own_messages"), early.summary["author"].is_null()), (0, true));
    let had = ann.bytes.clone();
    assert_same(&[ann, early, late]);
    // She cannot draw, and is told so.
    let args = ["--play", &class, "--play-author", "2", "--name", "Eve", "--speed", "10"];
    let eve = Member::join(folder.path(), "eve.ron", &address("eve:other"), &args).end();
    assert_eq!(eve.code, Some(2), "{}", eve.said);
    let said = eve.said.to_lowercase();
    assert!(said.contains("events of this member are not in the session"), "{}", eve.said);
    assert!(said.contains("does not let us in: permissions violation"), "{}", eve.said);
    assert_eq!(eve.bytes, had, "there is nothing new");
    // And who is nobody does not come in.
    for who in ["eve:wrong", "token"] {
        let nobody = Member::join(folder.path(), "nobody.ron", &address(who), &["--watch"]).end();
        assert_eq!(nobody.code, Some(2), "{}", nobody.said);
        assert!(nobody.said.contains("the server does not let us in"), "{}", nobody.said);
        assert!(!nobody.said.contains("wrong"), "{}", nobody.said);
    }
}

/// A certificate of its own, made by `openssl`; none, said in a line: the test is left out.
fn certificate(folder: &std::path::Path) -> Option<[String; 2]> {
    let [key, certificate] =
        ["key.pem", "cert.pem"].map(|name| folder.join(name).to_string_lossy().into_owned());
    let args =
        ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2"];
    let made = std::process::Command::new("openssl")
        .args(args)
        .args(["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"])
        .args(["-addext", "basicConstraints=critical,CA:FALSE", "-keyout", &key, "-out", &certificate])
        .output();
    match made {
        Ok(output) if output.status.success() => Some([key, certificate]),
        _ => {
            assert!(std::env::var_os("CI").is_none_or(|ci| ci.is_empty()), "openssl makes no certificate");
            eprintln!("skipped: openssl makes no certificate");
            None
        }
    }
}

#[test]
fn an_encrypted_session_is_for_those_who_trust_the_server_and_have_the_word() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some([key, certificate]) = certificate(folder.path()) else { return };
    let settings = format!(
        "authorization {{ token: \"a word\" }}\ntls {{ cert_file: {certificate:?}, key_file: {key:?} }}"
    );
    let Some(server) = Server::with(&settings) else { return };
    let Some(plain) = Server::start() else { return };
    let class = recording("class.ron");
    let at = |scheme: &str, who: &str, port: u16| format!("{scheme}://{who}127.0.0.1:{port}/class");
    let trusted = format!("SSL_CERT_FILE={certificate}");
    let trusting = |file: &str, address: &str, args: &[&str]| {
        Member::run(&["env", &trusted, OSP.0], folder.path(), file, address, args)
    };
    let (own, watch) = (at("tls", "a%20word@", server.port), ["--watch"]);
    let args = ["--play", &class, "--play-author", "1", "--speed", "10", "--name", "Ann"];
    let ann = trusting("ann.ron", &own, &args).end_well();
    let bob = trusting("bob.ron", &own, &["--watch", "--until-empty"]).end_well();
    assert_same(&[ann, bob]);
    let refused = [
        (trusting("a.ron", &at("tls", "another@", server.port), &watch), "the server does not let us in"),
        (Member::join(folder.path(), "b.ron", &own, &watch), "no encrypted connection"),
        (trusting("c.ron", &at("tls", "a%20word@", plain.port), &watch), "no encrypted connection"),
        // A server that wants it encrypted gets it so, also from who has not asked.
        (
            Member::join(folder.path(), "d.ron", &at("nats", "a%20word@", server.port), &watch),
            "no encrypted connection",
        ),
    ];
    for (member, expected) in refused {
        let ended = member.end();
        assert_eq!(ended.code, Some(2), "{expected}: {}", ended.said);
        assert!(ended.said.contains(expected), "{expected}: {}", ended.said);
    }
}

#[test]
fn a_password_in_an_address_is_never_said() {
    for address in
        ["nats://ann:secret@127.0.0.1/my.house", "nats://secret@127.0.0.1:99999/house", "http://a:secret@b/c"]
    {
        let said = OSP.refused(["join", address]);
        assert!(!said.contains("secret") && said.lines().count() == 1, "{said}");
    }
}
