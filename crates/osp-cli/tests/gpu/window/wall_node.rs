//! A node of a wall in a window: what the hub says is what its screen shows.

use std::{
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use super::{desk::Desk, server::Server};
use crate::OSP;
use osp_testkit::{shipped_session, stdout};

struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(mut command: Command, args: &[&str]) -> Running {
    Running(
        command.args(args).stdin(Stdio::null()).stdout(Stdio::null()).spawn().expect("the program starts"),
    )
}

#[test]
fn a_node_shows_its_screen_of_the_session() {
    let Some(desk) = Desk::new() else { return };
    let Some(server) = Server::start() else { return };
    let osp = OSP.0;
    let address = server.session("house");
    let played = shipped_session("portrait");
    let mut join = desk.command(osp);
    join.arg("join").arg(&address).arg(desk.folder().join("played.ron"));
    let joined = join.args(["--play", &played, "--speed", "50"]).output();
    assert!(joined.expect("the program runs").status.success());
    let _hub = start(desk.command(osp), &["wall", "--hub", &address, "--rig", "desktop", "--rate", "30"]);
    let mut node = start(desk.command(osp), &["wall", "--node", "screen", &address, "--rig", "desktop"]);
    let started = Instant::now();
    loop {
        let status = desk.osp(&["wall", "status", &address]);
        let windows = desk.windows("osp wall: screen");
        if let ([(place, _)], Some(0)) = (&windows[..], status.status.code()) {
            let mut colours = desk.picture(*place);
            colours.sort_unstable();
            colours.dedup();
            // The portrait is shaded.
            if colours.len() > 50 {
                break;
            }
        }
        let said = stdout(&status);
        assert!(started.elapsed() < Duration::from_secs(120), "{said} {windows:?}");
        thread::sleep(Duration::from_millis(200));
    }
    desk.keep_picture("wall-node.png");
    // It ends in the middle of a frame, as Ctrl-C has it.
    let id = node.0.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
    assert_eq!(node.0.wait().expect("it ends").code(), Some(0));
}
