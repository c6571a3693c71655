use std::{fs::OpenOptions, io::Write, net::UdpSocket};

use super::desk::Desk;
use osp_testkit::{shipped_session, stderr};

/// An address that nobody listens to.
pub(crate) fn free_address() -> String {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    socket.local_addr().expect("an address").to_string()
}

#[test]
fn a_session_that_is_sent_is_drawn() {
    let Some(desk) = Desk::new() else { return };
    let recording = shipped_session("scribble");
    for osc in [false, true] {
        let address = free_address();
        let from = format!("udp://{address}");
        let file = desk.folder().join(format!("drawn-{osc}.ron"));
        let mut window =
            desk.open(&["sketch", file.to_str().expect("a path"), "--tracker", &from, "--window", "900x600"]);
        // What does not parse is counted and dropped, and its sender does not keep others out.
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        for nonsense in
            [&b"hand 1 2"[..], b"\xff\xfe", b"/osp/hand\0\0\0", b"#bundle\0", b"hand nan 0 0 0 0 0 1 1"]
        {
            socket.send_to(nonsense, &address).expect("sent");
        }
        let mut arguments = vec!["send", &recording, "--to", &address, "--pace", "samples:8", "--speed", "4"];
        if osc {
            arguments.push("--osc");
        }
        let output = desk.osp(&arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        window.until_last("polygons of the sent session", |frame| frame["polygons"].as_u64() > Some(1000));
        assert!(window.close().success());
    }
}

#[test]
fn a_file_that_grows_is_followed() {
    let Some(desk) = Desk::new() else { return };
    let poses = desk.folder().join("poses.txt");
    std::fs::write(&poses, "# a tracker's log\nbrush tube 0.05 1 0 0 1\n").expect("a file");
    let mut window =
        desk.open(&["sketch", "--tracker", poses.to_str().expect("a path"), "--window", "900x600"]);
    let mut log = OpenOptions::new().append(true).open(&poses).expect("the file");
    for i in 0..20 {
        let x = 0.02 * f64::from(i);
        writeln!(log, "hand {x} 1.2 {} 0 0 0 1 0.8", -0.5 + x * x).expect("written");
    }
    window.until_last("a tube", |frame| frame["polygons"].as_u64() > Some(50));
    writeln!(log, "hand 0.4 1.2 -0.34 0 0 0 1 0\nerase 0.2 1.2 -0.46").expect("written");
    window.until_last("the tube erased", |frame| frame["polygons"] == 0);
    assert!(window.close().success());
}
