//! An author behind a line of 128 kbit/s that loses one packet of twenty. Needs the rights of root, `ip` (iproute2) and `nft`
//! (nftables); left out where they are missing.

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    thread,
    time::Duration,
};

use super::{
    cable::Cable,
    members::{Ended, Member, assert_same, drawn, places, recording},
    server::Server,
};

/// 128 kbit/s.
const BYTES_A_SECOND: usize = 16_000;
const LOSS: &str = "add table inet line; add chain inet line in { type filter hook input priority 0; }; \
                    add rule inet line in numgen random mod 100 < 5 counter drop";

/// Carries what one side says to the other, no faster than the line.
fn carry(mut from: TcpStream, mut to: TcpStream) {
    // Twenty times a second.
    let mut bytes = [0; BYTES_A_SECOND / 20];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
        thread::sleep(Duration::from_secs_f64(count as f64 / BYTES_A_SECOND as f64));
    }
    // The other side may have gone first.
    let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
}

/// A slow way to a server; its port.
fn relay(host: &str, server: u16) -> u16 {
    let listener = TcpListener::bind((host, 0)).expect("a port");
    let port = listener.local_addr().expect("its address").port();
    thread::spawn(move || {
        for near in listener.incoming().map_while(Result::ok) {
            let Ok(far) = TcpStream::connect(("127.0.0.1", server)) else { break };
            let (Ok(near_too), Ok(far_too)) = (near.try_clone(), far.try_clone()) else { break };
            thread::spawn(move || carry(near, far));
            thread::spawn(move || carry(far_too, near_too));
        }
    });
    port
}

fn p99_ms(member: &Ended) -> f64 {
    member.summary["latency"]["p99_us"].as_f64().expect("a number") * 1.0e-3
}

#[test]
fn on_a_slow_line_that_loses_packets_nothing_of_the_session_is_lost() {
    let Some(cable) = Cable::lay(1) else { return };
    let Some(server) = Server::start() else { return };
    if cable.at_far_end(&["nft", LOSS]).is_none() {
        let why = "nft (nftables) makes no line that loses packets";
        assert!(std::env::var_os("CI").is_none_or(|ci| ci.is_empty()), "{why}");
        eprintln!("skipped: {why}");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, class) = (folder.path(), recording("class.ron"));
    let near = server.session("class");
    let far = format!("nats://{}:{}/class", cable.here, relay(&cable.here, server.port));
    let args = |author: &'static str, name: &'static str| {
        ["--play", &class, "--play-author", author, "--name", name, "--until-empty"]
    };
    let mut slow: Vec<&str> = vec!["--unencrypted"];
    let of_slow = args("1", "Ann");
    slow.extend(of_slow);
    let ann = cable.join(folder, "ann.ron", &far, &slow);
    let bob = Member::join(folder, "bob.ron", &near, &args("2", "Bob"));
    let cem = Member::join(folder, "cem.ron", &near, &args("3", "Cem"));
    let ended = [ann, bob, cem].map(Member::end_well);
    assert_same(&ended);
    let places = places(&folder.join("ann.ron"));
    for (name, author) in [("Ann", 1), ("Bob", 2), ("Cem", 3)] {
        let mut expected = drawn(&class, Some(author));
        let mut points = places[name].clone();
        // Who was taken for gone goes on from the last point.
        expected.dedup();
        points.dedup();
        assert_eq!(points, expected, "{name}");
    }
    let rules = cable.at_far_end(&["nft", "list", "ruleset"]).expect("the rules");
    assert!(!rules.contains("packets 0 bytes 0"), "no packet was lost: {rules}");
    let [ann, bob, cem] = ended.each_ref().map(p99_ms);
    eprintln!(
        "own messages came back within (p99): {ann:.0} ms on the slow line, {bob:.1} and {cem:.1} ms beside it"
    );
    assert!(ann > 1.0, "{ann} ms: no slow line");
}
