//! A hostile or broken browser does not affect the other clients of `osp serve`.

use std::{
    fs,
    io::{ErrorKind, Read, Write},
    net::TcpStream,
};

use super::{PATIENCE, Server};

/// A folder with a small file, and one that is larger than any socket buffer.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::File::create(folder.path().join("large.bin"))
        .expect("made")
        .set_len(256 << 20)
        .expect("a sparse file");
    fs::write(folder.path().join("small.txt"), "small").expect("written");
    folder
}

/// Whether the server ended the connection, before the time limit of the test.
fn is_ended(stream: &mut TcpStream) -> bool {
    let mut answer = Vec::new();
    match stream.read_to_end(&mut answer) {
        Ok(_) => true,
        Err(error) => !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
    }
}

fn is_well(server: &mut Server) {
    let answer = server.get("/small.txt");
    assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("small"), "{answer}");
    assert!(server.child.try_wait().expect("it is there").is_none(), "the server has ended");
}

#[test]
fn lengths_that_cannot_be_end_nothing() {
    let folder = folder();
    let mut server = Server::of(folder.path());
    for length in [
        "18446744073709551615",
        "18446744073709551614",
        "9223372036854775808",
        "99999999999999999999",
        "-1",
        "x",
    ] {
        for method in ["POST", "GET", "PUT"] {
            for _ in 0..4 {
                let mut stream = server.connect();
                let address = &server.address;
                write!(
                    stream,
                    "{method} /small.txt HTTP/1.1\r\nHost: {address}\r\nContent-Length: {length}\r\n\r\n"
                )
                .expect("sent");
                stream.shutdown(std::net::Shutdown::Write).expect("nothing more");
                assert!(is_ended(&mut stream), "{method} {length}");
            }
        }
    }
    is_well(&mut server);
}

/// Connections that send this and no more, and read nothing.
fn open(server: &Server, count: usize, sent: impl Fn(usize) -> String) -> Vec<TcpStream> {
    let connection = |i| {
        let mut stream = server.connect();
        stream.write_all(sent(i).as_bytes()).expect("sent");
        stream
    };
    (0..count).map(connection).collect()
}

#[test]
fn bodies_that_never_come_and_browsers_that_read_nothing_keep_no_other_waiting() {
    let folder = folder();
    let mut server = Server::of(folder.path());
    let head = format!("HTTP/1.1\r\nHost: {}\r\n", server.address);
    let bodies = ["Content-Length: 1000", "Transfer-Encoding: chunked"];
    let waiting = open(&server, 24, |i| format!("POST /small.txt {head}{}\r\n\r\n", bodies[i % 2]));
    is_well(&mut server);
    drop(waiting);
    let unread = open(&server, 24, |_| format!("GET /large.bin {head}\r\n"));
    is_well(&mut server);
    drop(unread);
}

#[test]
fn connections_that_do_nothing_give_their_places_back() {
    let folder = folder();
    let mut server = Server::of(folder.path());
    let head = format!("HTTP/1.1\r\nHost: {}\r\n", server.address);
    // More than there are places. Some send nothing, some half a head, some read nothing.
    let mut open = open(&server, 96, |i| match i % 3 {
        0 => String::new(),
        1 => format!("GET /small.txt {head}X-A: "),
        _ => format!("GET /large.bin {head}\r\n"),
    });
    is_well(&mut server);
    // The first have been ended.
    assert!(is_ended(&mut open[0]) && is_ended(&mut open[1]));
}

/// The most memory that the program has held, bytes.
#[cfg(target_os = "linux")]
fn peak_bytes(server: &Server) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", server.child.id())).expect("it is there");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("the peak");
    let kib: u64 = peak.trim().trim_end_matches(" kB").parse().expect("a number");
    kib << 10
}

#[cfg(target_os = "linux")]
#[test]
fn heads_without_end_take_little_memory() {
    const SENT: usize = 96 << 20;
    let folder = folder();
    let mut server = Server::of(folder.path());
    is_well(&mut server);
    let before = peak_bytes(&server);
    let letters = vec![b'a'; 1 << 16];
    let lines = b"X-A: b\r\n".repeat(1 << 13);
    let address = vec![b'/'; 1 << 16];
    for (start, part) in [
        (format!("GET / HTTP/1.1\r\nHost: {}\r\nX-A: ", server.address), &letters),
        (format!("GET / HTTP/1.1\r\nHost: {}\r\n", server.address), &lines),
        ("GET /".to_owned(), &address),
        (String::new(), &letters),
    ] {
        let mut stream = server.connect();
        stream.write_all(start.as_bytes()).expect("sent");
        // Until the server has had enough.
        for _ in 0..SENT / part.len() {
            if stream.write_all(part).is_err() {
                break;
            }
        }
        let _ = stream.shutdown(std::net::Shutdown::Write);
        assert!(is_ended(&mut stream));
    }
    let more = peak_bytes(&server).saturating_sub(before);
    assert!(more < 32 << 20, "{more} bytes");
    is_well(&mut server);
}

#[cfg(unix)]
#[test]
fn a_signal_lets_the_answers_under_way_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes: Vec<u8> = (0..16_u32 << 20).map(|i| (i >> 8) as u8).collect();
    fs::write(folder.path().join("large.bin"), &bytes).expect("written");
    let mut server = Server::of(folder.path());
    let mut stream = server.connect();
    write!(stream, "GET /large.bin HTTP/1.1\r\nHost: {}\r\n\r\n", server.address).expect("sent");
    let mut answer = vec![0; 1 << 10];
    stream.read_exact(&mut answer).expect("the beginning");
    // Whoever runs the tests in the background of a shell has the signal of Ctrl-C ignored; this one is handled alike.
    let sent = std::process::Command::new("kill").args(["-TERM", &server.child.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    stream.read_to_end(&mut answer).expect("the rest");
    let body = answer.windows(4).position(|end| end == b"\r\n\r\n").expect("a head") + 4;
    assert!(answer[body..] == bytes, "{} bytes", answer.len() - body);
    let start = std::time::Instant::now();
    let status = loop {
        if let Some(status) = server.child.try_wait().expect("it is there") {
            break status;
        }
        assert!(start.elapsed() < PATIENCE, "it does not end");
        std::thread::sleep(std::time::Duration::from_millis(20));
    };
    assert_eq!(status.code(), Some(0), "{status:?}");
}
