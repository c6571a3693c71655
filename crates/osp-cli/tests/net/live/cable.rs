//! A cable that is pulled out and put in again, between two network namespaces of Linux. Needs the rights of root and `ip`
//! (iproute2); left out where they are missing.

use std::{path::Path, process::Command};

use super::{
    members::{Member, drawn, places, recording},
    server::Server,
};
use crate::OSP;

/// A namespace with a cable to it: addresses of this side and of the other.
pub(crate) struct Cable {
    space: String,
    near: String,
    /// The address of this side.
    pub(crate) here: String,
}

fn ip(args: &str) -> bool {
    let output = Command::new("ip").args(args.split_whitespace()).output();
    output.is_ok_and(|output| output.status.success())
}

impl Cable {
    /// The cable of this number. None, said in a line: this system does not let us.
    pub(crate) fn lay(number: u8) -> Option<Self> {
        if !cfg!(target_os = "linux") {
            eprintln!("skipped: there are no network namespaces");
            return None;
        }
        let id = format!("{}{}", std::process::id() % 100_000, char::from(b'a' + number));
        let network = format!("10.213.{}", 77 + number);
        let cable =
            Self { space: format!("osp{id}"), near: format!("ospn{id}"), here: format!("{network}.1") };
        let (space, near, far) = (&cable.space, &cable.near, format!("ospf{id}"));
        let is_laid = ip(&format!("netns add {space}"))
            && ip(&format!("link add {near} type veth peer name {far}"))
            && ip(&format!("link set {far} netns {space}"))
            && ip(&format!("addr add {}/24 dev {near}", cable.here))
            && ip(&format!("link set {near} up"))
            && ip(&format!("-n {space} addr add {network}.2/24 dev {far}"))
            && ip(&format!("-n {space} link set {far} up"));
        if !is_laid {
            eprintln!("skipped: this system makes no network namespaces (root and iproute2 are needed)");
            return None;
        }
        Some(cable)
    }

    fn pull_out(&self) {
        assert!(ip(&format!("link set {} down", self.near)));
    }

    fn put_in(&self) {
        assert!(ip(&format!("link set {} up", self.near)));
    }

    /// A member at the far end.
    pub(crate) fn join(&self, folder: &Path, file: &str, address: &str, args: &[&str]) -> Member {
        let before = ["ip", "netns", "exec", &self.space, OSP.0];
        Member::run(&before, folder, file, address, args)
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        ip(&format!("link del {}", self.near));
        ip(&format!("netns del {}", self.space));
    }
}

/// Out until she is taken for gone, or for a moment, while both draw; how often the far author has joined in the end.
fn draw_with_the_cable_out(cable: &Cable, server: &Server, is_gone: bool) -> usize {
    let folder = tempfile::tempdir().expect("a folder");
    let (here, class, name) = (server.session("class"), recording("class.ron"), "Ann");
    let there = here.replace("127.0.0.1", &cable.here);
    // Somebody who stays says who is not heard of.
    let mut keeper = Member::keeper(folder.path(), &here);
    let args = ["--unencrypted", "--play", &class, "--play-author", "1", "--name", name, "--speed", "0.5"];
    let far = cable.join(folder.path(), "far.ron", &there, &args);
    keeper.wait_for_lines(60);
    cable.pull_out();
    if is_gone {
        keeper.wait_for(|text| text.contains("Leave("));
    }
    cable.put_in();
    let far = far.end_well();
    keeper.wait_for(|text| text.lines().last().is_some_and(|line| line.starts_with("Leave(")));
    keeper.interrupt();
    let kept = keeper.end_well();
    assert!(kept.bytes.starts_with(&far.bytes), "who leaves earlier has the beginning");
    // Where a stroke goes on under another number, its last point is there twice.
    let mut points = places(&folder.path().join("keeper.ron"))[name].clone();
    points.dedup();
    let mut expected = drawn(&class, Some(1));
    expected.dedup();
    assert_eq!(points, expected);
    let text = String::from_utf8(kept.bytes).expect("text");
    text.lines().filter(|line| line.starts_with("Join(") && line.contains(name)).count()
}

#[test]
fn a_cable_that_is_out_loses_nothing_however_long() {
    let Some(cable) = Cable::lay(0) else { return };
    let Some(server) = Server::everywhere() else { return };
    assert!(draw_with_the_cable_out(&cable, &server, false) >= 1);
    drop(server);
    // The others take her for gone: she comes again, as another author.
    let Some(server) = Server::everywhere() else { return };
    assert!(draw_with_the_cable_out(&cable, &server, true) >= 2);
}
