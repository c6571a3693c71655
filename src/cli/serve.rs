//! `osp serve`: a folder for a browser on this machine.

use std::{
    fs,
    net::{Ipv4Addr, SocketAddr},
    path::{Component, Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::Args;
use percent_encoding::percent_decode_str;
use tiny_http::{Header, Method, Request, Response, Server};

use super::{
    Outcome,
    output::{complain, say},
};
use crate::small_file::open_regular;

const ANSWERS_AT_ONCE: usize = 8;

/// Serve a folder to browsers on this machine: the page that `web/build` makes in `web/dist`, or another one.
///
/// Requests of other machines are not answered. Each answer has the headers that isolate a page from pages of other sites,
/// which browsers ask for before they give it a clock in steps of 5 µs.
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
    Refused(u16, &'static str),
}

fn answer(request: Request, folder: &Path, at: SocketAddr) -> std::io::Result<()> {
    let is_head = *request.method() == Method::Head;
    let found = match request.method() {
        // Another site could have its name lead here, and read what lies here.
        _ if !is_ours(&request, at) => Found::Refused(403, "expected the host localhost or 127.0.0.1\n"),
        Method::Get | Method::Head => find(folder, request.url()),
        _ => Found::Refused(405, "expected GET\n"),
    };
    match found {
        Found::Refused(code, why) => request.respond(with_headers(
            Response::from_string(why).with_status_code(code),
            "text/plain; charset=utf-8",
        )),
        Found::File(_, kind) if is_head => request.respond(with_headers(Response::empty(200), kind)),
        Found::File(file, kind) => request.respond(with_headers(Response::from_file(file), kind)),
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

fn with_headers<R: std::io::Read>(response: Response<R>, kind: &str) -> Response<R> {
    let headers = [
        ("Content-Type", kind),
        ("Cross-Origin-Opener-Policy", "same-origin"),
        ("Cross-Origin-Embedder-Policy", "require-corp"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("X-Content-Type-Options", "nosniff"),
        ("Cache-Control", "no-cache"),
    ];
    headers.into_iter().fold(response, |response, (name, value)| {
        response.with_header(Header::from_bytes(name, value).expect("names and values of plain letters"))
    })
}
