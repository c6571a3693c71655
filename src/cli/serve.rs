//! `osp serve`: a folder for a browser on this machine.

use std::{
    fs,
    io::{Read, Seek, SeekFrom},
    net::{Ipv4Addr, SocketAddr},
    ops::RangeInclusive,
    path::{Component, Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::Args;
use percent_encoding::percent_decode_str;
use tiny_http::{Header, Method, Request, Response, Server, StatusCode};

use super::{
    Outcome,
    output::{complain, say},
};
use crate::small_file::open_regular;

const ANSWERS_AT_ONCE: usize = 8;

/// Serve a folder to browsers on this machine: the page that `web/build` makes in `web/dist`, or another one.
///
/// Requests of other machines are not answered. Each answer has the headers that isolate a page from pages of other sites,
/// which browsers ask for before they give it a clock in steps of 5 µs. A request for a part of a file gets that part.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp serve
  osp serve web/dist --port 8000")]
pub(super) struct ServeArgs {
    /// The folder.
    #[arg(default_value = "web/dist", value_name = "DIR")]
    folder: PathBuf,
    /// The port; 0 takes a free one.
    #[arg(long, default_value_t = 9328)]
    port: u16,
}

pub(super) fn run(args: &ServeArgs) -> anyhow::Result<Outcome> {
    let folder =
        fs::canonicalize(&args.folder).with_context(|| match args.folder == Path::new("web/dist") {
            true => "web/dist: `web/build` makes it".to_owned(),
            false => args.folder.display().to_string(),
        })?;
    if !folder.is_dir() {
        bail!("{}: expected a folder; found a file", args.folder.display());
    }
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, args.port));
    let server = Server::http(address).map_err(|error| anyhow::anyhow!("{address}: {error}"))?;
    let open_at = server.server_addr().to_ip().unwrap_or(address);
    say(&format!("{} is at http://{open_at}/ until Ctrl+C", args.folder.display()))?;
    // A browser that takes its answer slowly keeps no other waiting.
    std::thread::scope(|scope| {
        let serve = || {
            let error = loop {
                match server.recv() {
                    // A browser that has gone away does not end the server.
                    Ok(request) => {
                        if let Err(error) = answer(request, &folder, open_at) {
                            complain(&format!("warning: {error}"));
                        }
                    }
                    Err(error) => break error,
                }
            };
            // The others end, too: no connection comes any more.
            server.unblock();
            error
        };
        let others: Vec<_> = (1..ANSWERS_AT_ONCE).map(|_| scope.spawn(serve)).collect();
        let mine = serve();
        let all = others.into_iter().filter_map(|other| other.join().ok()).chain([mine]);
        // All but the first were only told to end.
        let first = all.into_iter().min_by_key(|error| error.kind() == std::io::ErrorKind::Other);
        first.map_or(Ok(Outcome::Done), |error| Err(error).context("the connection"))
    })
}

/// What a request gets.
enum Found {
    File(fs::File, &'static str),
    Part { file: fs::File, kind: &'static str, bytes: RangeInclusive<u64>, of: u64 },
    Refused(u16, &'static str),
}

fn answer(request: Request, folder: &Path, at: SocketAddr) -> std::io::Result<()> {
    let is_head = *request.method() == Method::Head;
    let found = match request.method() {
        // Another site could have its name lead here, and read what lies here.
        _ if !is_ours(&request, at) => Found::Refused(403, "expected the host localhost or 127.0.0.1\n"),
        Method::Get => part(find(folder, request.url()), &request),
        // Only GET has parts (RFC 9110, section 14.2).
        Method::Head => find(folder, request.url()),
        _ => Found::Refused(405, "expected GET\n"),
    };
    match found {
        Found::Refused(code, why) => request.respond(with_headers(
            Response::from_string(why).with_status_code(code),
            "text/plain; charset=utf-8",
        )),
        Found::File(file, kind) if is_head => {
            let length = file.metadata()?.len() as usize;
            let empty = Response::new(StatusCode(200), Vec::new(), std::io::empty(), Some(length), None);
            request.respond(with_headers(empty.with_chunked_threshold(usize::MAX), kind))
        }
        // Whoever asks for parts of a file wants to know how long it is.
        Found::File(file, kind) => {
            request.respond(with_headers(Response::from_file(file).with_chunked_threshold(usize::MAX), kind))
        }
        Found::Part { mut file, kind, bytes, of } => {
            file.seek(SeekFrom::Start(*bytes.start()))?;
            let length = bytes.end() - bytes.start() + 1;
            let place = format!("bytes {}-{}/{of}", bytes.start(), bytes.end());
            let place = Header::from_bytes("Content-Range", place).expect("digits");
            let read = file.take(length);
            let part = Response::new(StatusCode(206), vec![place], read, Some(length as usize), None);
            request.respond(with_headers(part.with_chunked_threshold(usize::MAX), kind))
        }
    }
}

/// The part of a file that a request asks for (RFC 9110, section 14), if it asks for one part.
fn part(found: Found, request: &Request) -> Found {
    let Found::File(file, kind) = found else { return found };
    let asked = request.headers().iter().find(|header| header.field.equiv("Range"));
    let range = asked.and_then(|header| header.value.as_str().strip_prefix("bytes="));
    let (Some(range), Ok(data)) = (range, file.metadata()) else { return Found::File(file, kind) };
    let of = data.len();
    let bytes = match range.split_once('-').map(|(first, last)| (first.parse(), last.parse())) {
        Some((Ok(first), Ok(last))) if first <= last => first..=u64::min(last, of.saturating_sub(1)),
        Some((Ok(first), Err(_))) if range.ends_with('-') => first..=of.saturating_sub(1),
        // The last so many bytes.
        Some((Err(_), Ok(count))) if range.starts_with('-') => {
            of.saturating_sub(count)..=of.saturating_sub(1)
        }
        // What is not understood is passed over: the whole file is an answer to it.
        _ => return Found::File(file, kind),
    };
    match *bytes.start() < of {
        true => Found::Part { file, kind, bytes, of },
        false => Found::Refused(416, "expected a part of the file\n"),
    }
}

fn is_ours(request: &Request, at: SocketAddr) -> bool {
    let host = request
        .headers()
        .iter()
        .find(|header| header.field.equiv("Host"))
        .map(|header| header.value.as_str());
    let port = at.port();
    // Browsers leave the usual port out.
    let is_port = |rest: &str| rest == format!(":{port}") || (port == 80 && rest.is_empty());
    host.is_some_and(|host| {
        ["127.0.0.1", "localhost"].iter().any(|name| host.strip_prefix(name).is_some_and(is_port))
    })
}

/// The file of an address: one in the folder or below.
fn find(folder: &Path, url: &str) -> Found {
    const NONE: Found = Found::Refused(404, "there is no such file here\n");
    let path = url.split(['?', '#']).next().unwrap_or_default();
    let Ok(path) = percent_decode_str(path).decode_utf8() else {
        return Found::Refused(400, "expected an address in UTF-8\n");
    };
    let relative = Path::new(path.trim_start_matches('/'));
    let is_plain = relative.components().all(|part| matches!(part, Component::Normal(_)));
    if !is_plain || path.contains(['\0', '\\', ':']) {
        return NONE;
    }
    let mut file = folder.join(relative);
    if file.is_dir() {
        file.push("index.html");
    }
    // A link may not lead out of the folder either.
    match fs::canonicalize(&file) {
        Ok(file) if file.starts_with(folder) => {
            open_regular(&file).map_or(NONE, |opened| Found::File(opened, kind_of(&file)))
        }
        _ => NONE,
    }
}

/// What a browser takes a file for. A module of JavaScript and WebAssembly are not run under another type.
fn kind_of(file: &Path) -> &'static str {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "wasm" => "application/wasm",
        "json" => "application/json",
        "png" => "image/png",
        "svg" => "image/svg+xml",
        "ron" | "obj" | "poses" | "txt" => "text/plain; charset=utf-8",
        "glb" => "model/gltf-binary",
        _ => "application/octet-stream",
    }
}

fn with_headers<R: Read>(response: Response<R>, kind: &str) -> Response<R> {
    let headers = [
        ("Content-Type", kind),
        ("Cross-Origin-Opener-Policy", "same-origin"),
        ("Cross-Origin-Embedder-Policy", "require-corp"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("X-Content-Type-Options", "nosniff"),
        ("Cache-Control", "no-cache"),
        ("Accept-Ranges", "bytes"),
    ];
    headers.into_iter().fold(response, |response, (name, value)| {
        response.with_header(Header::from_bytes(name, value).expect("names and values of plain letters"))
    })
}
