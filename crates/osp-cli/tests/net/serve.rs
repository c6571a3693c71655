//! `osp serve`: what it answers, and what it does not.

mod answers;
mod attacks;

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Child, Stdio},
    time::Duration,
};

use crate::OSP;

/// How long an answer may take before a test fails; no more than a few seconds are needed.
const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) struct Server {
    child: Child,
    pub(crate) address: String,
}

impl Server {
    pub(crate) fn of(folder: &std::path::Path) -> Self {
        let mut serve = OSP.command(["serve", "--port", "0"]);
        let mut child = serve.arg(folder).stdout(Stdio::piped()).spawn().expect("the program starts");
        let mut line = String::new();
        let out = child.stdout.take().expect("its output");
        BufReader::new(out).read_line(&mut line).expect("a line");
        let address = line.split("http://").nth(1).and_then(|rest| rest.split('/').next());
        Self { address: address.expect("an address").to_owned(), child }
    }

    fn ask(&self, method: &str, path: &str, host: &str) -> String {
        self.ask_with(method, path, host, "")
    }

    /// `more`: further headers, each with its line end.
    fn ask_with(&self, method: &str, path: &str, host: &str, more: &str) -> String {
        let request = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\n{more}Connection: close\r\n\r\n");
        String::from_utf8_lossy(&self.send(request.as_bytes())).into_owned()
    }

    fn send(&self, request: &[u8]) -> Vec<u8> {
        let mut stream = self.connect();
        stream.write_all(request).expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("answered");
        answer
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("set");
        stream.set_write_timeout(Some(PATIENCE)).expect("set");
        stream
    }

    fn get(&self, path: &str) -> String {
        self.ask("GET", path, &self.address)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_folder_is_served_with_its_types_and_nothing_beside_it() {
    let outside = tempfile::tempdir().expect("a folder");
    let folder = outside.path().join("page");
    fs::create_dir_all(folder.join("a b")).expect("a folder");
    for (name, text) in
        [("index.html", "<p>page"), ("page.js", "1"), ("x.wasm", "w"), ("a b/room.ron", "Header(")]
    {
        fs::write(folder.join(name), text).expect("written");
    }
    fs::write(outside.path().join("secret.txt"), "secret").expect("written");
    #[cfg(unix)]
    std::os::unix::fs::symlink(outside.path().join("secret.txt"), folder.join("link.txt")).expect("a link");
    let server = Server::of(&folder);

    let page = server.get("/?file=a.ron");
    assert!(page.starts_with("HTTP/1.1 200") && page.ends_with("<p>page"), "{page}");
    for header in [
        "Content-Type: text/html",
        "Cross-Origin-Opener-Policy: same-origin",
        "Cross-Origin-Embedder-Policy: require-corp",
    ] {
        assert!(page.contains(header), "{page}");
    }
    assert!(server.get("/page.js").contains("Content-Type: text/javascript"));
    assert!(server.get("/x.wasm").contains("Content-Type: application/wasm"));
    assert!(server.get("/a%20b/room.ron").ends_with("Header("));
    let head = server.ask("HEAD", "/page.js", &server.address);
    assert!(head.starts_with("HTTP/1.1 200") && head.ends_with("\r\n\r\n"), "{head}");

    for path in [
        "/none",
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/a%20b/../../secret.txt",
        "//etc/passwd",
        "/link.txt",
        "/a%00",
    ] {
        let answer = server.get(path);
        assert!(answer.starts_with("HTTP/1.1 404") && !answer.contains("secret"), "{path}: {answer}");
    }
    assert!(server.get("/a%ff").starts_with("HTTP/1.1 400"));
    assert!(server.ask("POST", "/", &server.address).starts_with("HTTP/1.1 405"));
    // Another site's name that leads here.
    assert!(server.ask("GET", "/", "evil.example").starts_with("HTTP/1.1 403"));
}

#[test]
fn a_part_of_a_file_is_given_to_whoever_asks_for_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let digits: String = (0..50_000).map(|i| char::from(b'0' + (i % 10) as u8)).collect();
    fs::write(folder.path().join("digits.bin"), &digits).expect("written");
    fs::write(folder.path().join("empty.bin"), "").expect("written");
    let server = Server::of(folder.path());
    let part = |path: &str, range: &str| {
        server.ask_with("GET", path, &server.address, &format!("Range: {range}\r\n"))
    };
    let body = |answer: &str| answer.split("\r\n\r\n").nth(1).expect("a body").to_owned();
    for (range, bytes) in [
        ("bytes=0-0", 0..=0),
        ("bytes=13-40013", 13..=40_013),
        ("bytes=49995-", 49_995..=49_999),
        ("bytes=49995-99999999", 49_995..=49_999),
        ("bytes=-7", 49_993..=49_999),
        ("bytes=-99999999", 0..=49_999),
    ] {
        let answer = part("/digits.bin", range);
        let place = format!("Content-Range: bytes {}-{}/50000\r\n", bytes.start(), bytes.end());
        assert!(answer.starts_with("HTTP/1.1 206") && answer.contains(&place), "{range}: {answer:.300}");
        let length = format!("Content-Length: {}\r\n", bytes.end() - bytes.start() + 1);
        assert!(answer.contains(&length), "{range}: {answer:.300}");
        assert!(body(&answer) == digits[bytes], "{range}: {answer:.300}");
    }
    for range in ["bytes=50000-", "bytes=50000-50001"] {
        assert!(part("/digits.bin", range).starts_with("HTTP/1.1 416"), "{range}");
    }
    assert!(part("/empty.bin", "bytes=0-0").starts_with("HTTP/1.1 416"));
    for range in ["bytes=5-4", "bytes=x-4", "bytes=0-1,4-5", "lines=0-1", "bytes=-"] {
        let answer = part("/digits.bin", range);
        assert!(answer.starts_with("HTTP/1.1 200") && body(&answer) == digits, "{range}: {answer:.300}");
    }
    let whole = server.get("/digits.bin");
    assert!(whole.contains("Content-Length: 50000\r\n") && body(&whole) == digits, "{whole:.300}");
    let head = server.ask("HEAD", "/digits.bin", &server.address);
    assert!(head.contains("Content-Length: 50000\r\n") && head.ends_with("\r\n\r\n"), "{head}");
    let head = server.ask_with("HEAD", "/digits.bin", &server.address, "Range: bytes=0-9\r\n");
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("Content-Length: 50000\r\n"), "{head}");
    assert!(head.ends_with("\r\n\r\n"), "{head}");
}

#[test]
fn a_folder_that_is_not_there_is_told() {
    let said = OSP.refused(["serve", "no-such-folder"]);
    assert!(said.contains("no-such-folder"));
}
