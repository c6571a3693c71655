//! Which files are answered with, and in which form.

use std::{fs, io::Read};

use super::Server;

#[test]
fn what_is_hidden_is_not_there() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir_all(folder.path().join(".git")).expect("a folder");
    fs::create_dir_all(folder.path().join("page/.keys")).expect("a folder");
    for name in [".env", ".git/config", "page/.keys/key.txt", "page/.htaccess", ".git/index.html"] {
        fs::write(folder.path().join(name), "secret").expect("written");
    }
    fs::write(folder.path().join("page/a.b.txt"), "shown").expect("written");
    #[cfg(unix)]
    std::os::unix::fs::symlink(folder.path().join(".env"), folder.path().join("link.txt")).expect("a link");
    #[cfg(unix)]
    assert!(osp_testkit::make_pipe(&folder.path().join("pipe.txt")));
    let server = Server::of(folder.path());
    for path in [
        "/.env",
        "/%2eenv",
        "/.git/config",
        "/.git",
        "/.git/",
        "/page/.keys/key.txt",
        "/page/.htaccess",
        "/page//.htaccess",
        "/link.txt",
        "/pipe.txt",
    ] {
        let answer = server.get(path);
        assert!(answer.starts_with("HTTP/1.1 404") && !answer.contains("secret"), "{path}: {answer}");
    }
    assert!(server.get("/page/a.b.txt").ends_with("shown"));
}

#[test]
fn those_who_take_gzip_get_text_and_programs_compressed() {
    let folder = tempfile::tempdir().expect("a folder");
    let text: String = (0..20_000).map(|i| format!("Sample(t: {i})\n")).collect();
    for name in ["page.js", "x.wasm", "room.ron", "packed.bin", "picture.png"] {
        fs::write(folder.path().join(name), &text).expect("written");
    }
    fs::write(folder.path().join("small.js"), "1").expect("written");
    let server = Server::of(folder.path());
    let get = |path: &str, more: &str| {
        // An answer of HTTP/1.0 comes in one piece.
        let request = format!(
            "GET {path} HTTP/1.0\r\nHost: {}\r\nAccept-Encoding: br, gzip\r\n{more}\r\n",
            server.address
        );
        let answer = server.send(request.as_bytes());
        let body = answer.windows(4).position(|end| end == b"\r\n\r\n").expect("a head") + 4;
        (String::from_utf8_lossy(&answer[..body]).into_owned(), answer[body..].to_vec())
    };
    for name in ["/page.js", "/x.wasm", "/room.ron"] {
        let (head, body) = get(name, "");
        assert!(head.contains(" 200 ") && head.contains("Content-Encoding: gzip\r\n"), "{head}");
        assert!(head.to_ascii_lowercase().contains("vary: accept-encoding"), "{head}");
        assert!(body.len() < text.len() / 4, "{name}: {} bytes", body.len());
        let mut unpacked = String::new();
        flate2::read::GzDecoder::new(&*body).read_to_string(&mut unpacked).expect("gzip");
        assert!(unpacked == text, "{name}");
    }
    for (name, bytes) in [("/packed.bin", &*text), ("/picture.png", &text), ("/small.js", "1")] {
        let (head, body) = get(name, "");
        assert!(!head.contains("Content-Encoding") && body == bytes.as_bytes(), "{name}: {head}");
    }
    // A part is one of the file as it is; whole it is sent where somebody else asks.
    let (head, body) = get("/page.js", "Range: bytes=10-19\r\n");
    assert!(head.contains(" 206 ") && !head.contains("Content-Encoding"), "{head}");
    assert_eq!(body, &text.as_bytes()[10..20]);
    let whole = server.get("/page.js");
    assert!(whole.ends_with(&text) && whole.contains(&format!("Content-Length: {}\r\n", text.len())));
}

#[test]
fn parts_are_of_one_state_of_the_file_and_one_at_a_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let digits: String = (0..5000).map(|i| char::from(b'0' + (i % 10) as u8)).collect();
    fs::write(folder.path().join("digits.bin"), &digits).expect("written");
    let server = Server::of(folder.path());
    for more in [
        "Range: bytes=0-1,4-5\r\n",
        "Range: bytes=0-1, 1-, -3\r\n",
        "Range: bytes=0-1\r\nRange: bytes=4-5\r\n",
        "Range: bytes=+0-1\r\n",
        "Range: bytes=0-1-2\r\n",
        "Range: bytes=99999999999999999999-\r\n",
        "Range: bytes=0-1\r\nIf-Range: \"another\"\r\n",
        "Range: bytes=0-1\r\nIf-Range: Sat, 01 Jan 2000 00:00:00 GMT\r\n",
    ] {
        let answer = server.ask_with("GET", "/digits.bin", &server.address, more);
        assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with(&digits), "{more}: {answer:.300}");
        assert!(!answer.contains("Content-Range"), "{more}: {answer:.300}");
    }
    let answer = server.ask_with("GET", "/digits.bin", &server.address, "Range: BYTES=7-8\r\n");
    assert!(answer.starts_with("HTTP/1.1 206") && answer.ends_with("\r\n\r\n78"), "{answer:.300}");
    for range in ["18446744073709551615-", "5000-5000", "-0"] {
        let answer =
            server.ask_with("GET", "/digits.bin", &server.address, &format!("Range: bytes={range}\r\n"));
        assert!(answer.starts_with("HTTP/1.1 416"), "{range}: {answer:.300}");
        assert!(answer.contains("Content-Range: bytes */5000\r\n"), "{range}: {answer:.300}");
    }
}
