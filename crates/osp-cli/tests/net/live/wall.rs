//! A wall of several machines, as processes on this one.

use std::{
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;

use super::{
    members::{LONGEST, Member, recording},
    server::Server,
};
use crate::OSP;
use osp_testkit::{stderr, stdout};

const SCREENS: [&str; 4] = ["left", "front", "right", "floor"];

/// `osp wall` on its way.
struct Part(Option<Child>);

impl Part {
    fn start(folder: &Path, name: &str, args: &[&str]) -> Self {
        let said = fs::File::options().append(true).create(true).open(folder.join(name)).expect("a file");
        let mut command = Command::new(OSP.0);
        command.arg("wall").args(args).current_dir(folder);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(said);
        Self(Some(command.spawn().expect("the program starts")))
    }

    fn hub(folder: &Path, address: &str) -> Self {
        Self::start(folder, "hub.txt", &["--hub", address, "--rig", "cave4", "--json"])
    }

    fn node(folder: &Path, address: &str, screen: &str) -> Self {
        let args = ["--node", screen, address, "--rig", "cave4", "--headless", "--json"];
        Self::start(folder, &format!("{screen}.txt"), &args)
    }

    /// At once, without a word.
    fn kill(mut self) {
        let mut child = self.0.take().expect("it runs");
        child.kill().expect("killed");
        child.wait().expect("ended");
    }

    /// As Ctrl-C does; what it prints in the end.
    #[cfg(unix)]
    fn interrupt(mut self) -> Value {
        let child = self.0.take().expect("it runs");
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
        let output = child.wait_with_output().expect("its output");
        assert_eq!(output.status.code(), Some(0));
        serde_json::from_slice(&output.stdout).expect("a summary")
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if let Some(mut child) = self.0.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// The wall's state, once it is so.
fn until(address: &str, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let (started, mut last) = (Instant::now(), Value::Null);
    while started.elapsed() < LONGEST {
        let output = OSP.run(["wall", "status", address, "--json"]);
        if output.status.code() != Some(2) {
            last = serde_json::from_slice(&output.stdout).expect("a report");
            if is_so(&last) {
                return last;
            }
        }
        thread::sleep(Duration::from_millis(50));
    }
    panic!("waited for {what}: {last:#}");
}

fn node<'r>(report: &'r Value, screen: &str) -> &'r Value {
    let nodes = report["nodes"].as_array().expect("a list");
    nodes.iter().find(|node| node["screen"] == screen).expect("the screen")
}

fn are_in(report: &Value, screens: &[&str]) -> bool {
    screens.iter().all(|screen| node(report, screen)["place"] == "in")
}

fn number(value: &Value) -> u64 {
    value.as_u64().expect("a number")
}

/// Puts a session of several hundred events on the server.
fn session(server: &Server, folder: &Path) -> String {
    let address = server.session("house");
    let played = recording("class.ron");
    Member::join(folder, "played.ron", &address, &["--play", &played, "--play-author", "1", "--speed", "20"])
        .end_well();
    address
}

#[cfg(unix)]
#[test]
fn four_nodes_show_one_moment_and_one_of_them_dies_and_comes_back() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, address) = (folder.path(), session(&server, folder.path()));
    let hub = Part::hub(folder, &address);
    let mut nodes: Vec<_> = SCREENS.iter().map(|screen| Part::node(folder, &address, screen)).collect();
    until(&address, "four nodes", |report| are_in(report, &SCREENS));
    // While somebody draws.
    let played = recording("portrait.ron");
    let drawing = Member::join(folder, "drawn.ron", &address, &["--play", &played, "--speed", "20"]);

    nodes.remove(1).kill();
    let report =
        until(&address, "the dead node to be left out", |report| node(report, "front")["place"] != "in");
    let frames = number(&report["frames"]);
    let report = until(&address, "the others to go on", |report| number(&report["frames"]) > frames + 30);
    assert!(are_in(&report, &["left", "right", "floor"]), "{report:#}");
    nodes.push(Part::node(folder, &address, "front"));
    until(&address, "the node to come back", |report| are_in(report, &SCREENS));

    drawing.end_well();
    let report = until(&address, "the end of the session", |report| {
        let drawn = fs::read_to_string(folder.join("drawn.ron")).expect("a recording");
        // A header, then an event a line.
        number(&report["events"]) + 1 >= drawn.lines().count() as u64 && are_in(report, &SCREENS)
    });
    assert_eq!(report["garbage"], 0);
    let end = hub.interrupt();
    assert!(number(&end["polygons"]) > 100 && number(&end["skew"]["count"]) > 30, "{end:#}");
    for screen in SCREENS {
        assert_eq!(node(&end, screen)["differed"], 0, "{end:#}");
        assert!(number(&node(&end, screen)["ready"]["count"]) > 20, "{end:#}");
    }
    let said = fs::read_to_string(folder.join("hub.txt")).expect("what it said");
    let (dead, back) = (said.find("front: ").expect("named"), said.rfind("front: ").expect("named"));
    assert!(said[dead..].contains("is out: three frames without an answer in time"), "{said}");
    assert!(said[back..].contains("is in"), "{said}");
    // Without a hub the nodes wait.
    for part in nodes {
        let summary = part.interrupt();
        assert!(number(&summary["frames"]) > 20 && summary["garbage"] == 0, "{summary}");
    }
}

#[test]
fn a_node_that_shows_something_else_is_named_and_strangers_change_nothing() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, address) = (folder.path(), session(&server, folder.path()));
    let _hub = Part::hub(folder, &address);
    let mut wire = server.wire();
    wire.subscribe("osp-wall.house.*");
    let real = Part::node(folder, &address, "front");
    let here = loop {
        let message = String::from_utf8(wire.message()).expect("text");
        if message.starts_with("Here(") {
            break message;
        }
    };
    until(&address, "the node", |report| are_in(report, &["front"]));
    real.kill();
    until(&address, "its place to be free", |report| node(report, "front")["place"] == "absent");
    for garbage in [&b"\xff\xff"[..], b"", b"Here(node:1)", b"Frame(", &[b'('; 70_000]] {
        wire.publish("osp-wall.house.node", garbage);
    }
    // Another one takes its place, hears every frame, and has another model.
    let (_, rest) = here.split_once(",screen").expect("a screen");
    wire.publish("osp-wall.house.node", format!("Here(node:7,screen{rest}").as_bytes());
    let started = Instant::now();
    let mut answered = 0;
    let table = loop {
        assert!(started.elapsed() < LONGEST);
        let message = String::from_utf8_lossy(&wire.message()).into_owned();
        let Some(frame) = message.strip_prefix("Frame((hub:") else { continue };
        let (hub, rest) = frame.split_once(",number:").expect("a number");
        let (number, _) = rest.split_once(',').expect("more");
        let answer = format!("Ready(node:7,hub:{hub},frame:{number},log:1,seen:2)");
        wire.publish("osp-wall.house.node", answer.as_bytes());
        answered += 1;
        if answered % 50 == 0 {
            let output = OSP.run(["wall", "status", &address]);
            let table = stdout(&output);
            assert_eq!(output.status.code(), Some(1), "{table}");
            if table.contains("shows something else than the hub: its events differ") {
                break table;
            }
        }
    };
    assert!(table.contains("front: "), "{table}");
    assert!(table.contains("5 messages did not belong to a wall"), "{table}");
    let said = fs::read_to_string(folder.join("hub.txt")).expect("what it said");
    assert!(said.contains("shows something else than the hub since frame"), "{said}");
}

#[test]
fn a_node_that_does_not_belong_to_the_wall_is_told_why() {
    let Some(server) = Server::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, address) = (folder.path(), session(&server, folder.path()));
    let fails = |args: &[&str], expected: &str| {
        let output = OSP.run(args);
        let said = stderr(&output);
        assert!(output.status.code() == Some(2) && said.contains(expected), "{args:?}: {said}");
    };
    fails(&["wall", "status", &address], "house: no hub answers (osp wall --hub)");
    let _hub = Part::hub(folder, &address);
    let _front = Part::node(folder, &address, "front");
    until(&address, "the node", |report| are_in(report, &["front"]));
    let node = |screen, rig| ["wall", "--node", screen, &address, "--rig", rig, "--headless"];
    fails(
        &node("left", "dual-wall"),
        "the hub does not let this computer in: its rig has other screens or eyes than the hub's",
    );
    fails(&node("front", "cave4"), "shows `front` already");
    fails(
        &node("ceiling", "cave4"),
        "expected a screen of the rig `cave4` (`left`, `front`, `right`, `floor`); found `ceiling`",
    );
    // The one that was there first stays.
    fails(
        &["wall", "--hub", &address, "--rig", "cave4", "--for", "60"],
        "house: another hub shows this session",
    );
    until(&address, "the first hub", |report| are_in(report, &["front"]));
    fails(
        &["wall", "--hub", &address, "--rig", "cave4", "--patience", "0"],
        "expected 1 to 10000 milliseconds",
    );
    fails(&["wall", "status", "nats://127.0.0.1:1/house"], "nats://127.0.0.1:1: ");
    fails(
        &["wall", "--hub", "nats://10.1.2.3/house", "--rig", "cave4"],
        "is not this machine: expected tls://",
    );
    fails(&["wall", "--hub", &address], "expected --rig");
    fails(&["wall", &address, "--rig", "cave4"], "--hub");
}
