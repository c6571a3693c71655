//! The answer of `osp serve` to a request: a file of the folder, a part of it, or an error.

use std::{
    convert::Infallible,
    fs,
    ops::RangeInclusive,
    path::{Component, Path, PathBuf},
    sync::Arc,
};

use http_body_util::{Either, Full};
use hyper::{
    HeaderMap, Method, Request, Response, StatusCode, Version,
    body::{Bytes, Incoming},
    header::{self, HeaderName, HeaderValue},
    http::Extensions,
};
use percent_encoding::percent_decode_str;
use tower_http::services::{ServeFile, fs::ServeFileSystemResponseBody};

use osp_session::small_file::check_regular;

/// The folder to serve, and the port.
pub(super) struct Site {
    folder: PathBuf,
    port: u16,
}

/// A file to send.
struct Found {
    path: PathBuf,
    kind: &'static str,
    bytes: u64,
}

/// The answer to a request without a file: the status code, and the text.
struct Refusal(StatusCode, &'static str);

const NONE: Refusal = Refusal(StatusCode::NOT_FOUND, "there is no such file here\n");

type Body = Either<ServeFileSystemResponseBody, Full<Bytes>>;

impl Site {
    /// Creates a site. `folder` must be free of links.
    pub(super) fn new(folder: PathBuf, port: u16) -> Self {
        Self { folder, port }
    }

    /// Whether the `Host` header names this machine. This prevents DNS rebinding, in which the name of another site
    /// resolves to this machine.
    fn is_ours(&self, headers: &HeaderMap) -> bool {
        let mut hosts = headers.get_all(header::HOST).iter().map(HeaderValue::as_bytes);
        let (Some(host), None) = (hosts.next(), hosts.next()) else { return false };
        // Browsers leave out the default port.
        let is_port = |rest: &[u8]| {
            rest == format!(":{}", self.port).as_bytes() || (self.port == 80 && rest.is_empty())
        };
        [&b"127.0.0.1"[..], b"localhost"].iter().any(|name| host.strip_prefix(*name).is_some_and(is_port))
    }

    /// Finds the file of an address, in the folder or below it.
    fn find(&self, path: &str) -> Result<Found, Refusal> {
        let path = percent_decode_str(path)
            .decode_utf8()
            .map_err(|_| Refusal(StatusCode::BAD_REQUEST, "expected an address in UTF-8\n"))?;
        let relative = Path::new(path.trim_start_matches('/'));
        if !is_shown(relative) || path.contains(['\0', '\\', ':']) {
            return Err(NONE);
        }
        let mut file = self.folder.join(relative);
        if file.is_dir() {
            file.push("index.html");
        }
        let file = fs::canonicalize(&file).map_err(|_| NONE)?;
        // Refuses a link that leads out of the folder or to a hidden file.
        if !file.strip_prefix(&self.folder).is_ok_and(is_shown) {
            return Err(NONE);
        }
        // Refuses a pipe, because reading it would wait for a writer.
        check_regular(&file).map_err(|_| NONE)?;
        let bytes = fs::metadata(&file).map_err(|_| NONE)?.len();
        Ok(Found { kind: kind_of(&file), path: file, bytes })
    }
}

/// Whether a path stays below the folder and has no hidden part. Hidden files may contain keys.
fn is_shown(relative: &Path) -> bool {
    relative
        .components()
        .all(|part| matches!(part, Component::Normal(name) if !name.as_encoded_bytes().starts_with(b".")))
}

/// Returns the answer to a request.
pub(super) async fn answer(
    site: Arc<Site>,
    request: Request<Incoming>,
) -> Result<Response<Body>, Infallible> {
    Ok(found(site, request).await.unwrap_or_else(Refusal::answer))
}

impl Refusal {
    fn answer(self) -> Response<Body> {
        let Self(code, why) = self;
        let mut answer = Response::new(Either::Right(Full::from(why)));
        *answer.status_mut() = code;
        let kind = HeaderValue::from_static("text/plain; charset=utf-8");
        answer.headers_mut().insert(header::CONTENT_TYPE, kind);
        if code == StatusCode::METHOD_NOT_ALLOWED {
            answer.headers_mut().insert(header::ALLOW, HeaderValue::from_static("GET, HEAD"));
        }
        answer
    }
}

async fn found(site: Arc<Site>, request: Request<Incoming>) -> Result<Response<Body>, Refusal> {
    // Bodies are not read.
    let mut request = request.map(|_| ());
    if !site.is_ours(request.headers()) {
        return Err(Refusal(StatusCode::FORBIDDEN, "expected the host localhost or 127.0.0.1\n"));
    }
    if ![Method::GET, Method::HEAD].contains(request.method()) {
        return Err(Refusal(StatusCode::METHOD_NOT_ALLOWED, "expected GET\n"));
    }
    let path = request.uri().path().to_owned();
    const FAILED: Refusal = Refusal(StatusCode::INTERNAL_SERVER_ERROR, "the file cannot be read\n");
    let file = tokio::task::spawn_blocking(move || site.find(&path)).await.map_err(|_| FAILED)??;
    // Only GET has ranges (RFC 9110, section 14.2).
    let part = if request.method() == Method::GET { part(request.headers(), file.bytes) } else { None };
    request.headers_mut().remove(header::RANGE);
    if let Some(part) = part {
        if *part.start() >= file.bytes {
            let mut answer =
                Refusal(StatusCode::RANGE_NOT_SATISFIABLE, "expected a part of the file\n").answer();
            let whole = HeaderValue::try_from(format!("bytes */{}", file.bytes)).map_err(|_| FAILED)?;
            answer.headers_mut().insert(header::CONTENT_RANGE, whole);
            return Ok(answer);
        }
        let range = format!("bytes={}-{}", part.start(), part.end());
        request.headers_mut().insert(header::RANGE, HeaderValue::try_from(range).map_err(|_| FAILED)?);
    }
    let kind = file.kind.parse().map_err(|_| FAILED)?;
    let answer = ServeFile::new_with_mime(&file.path, &kind).try_call(request).await;
    // An error is rare, because the file existed before.
    answer.map(|answer| answer.map(Either::Left)).map_err(|_| NONE)
}

/// Returns the range of a request (RFC 9110, section 14) in a file of `bytes` bytes. The range may begin behind the end
/// of the file. `None` stands for the whole file. It is returned for no range, several ranges, a malformed range, or a
/// range with `If-Range`.
fn part(headers: &HeaderMap, bytes: u64) -> Option<RangeInclusive<u64>> {
    let mut ranges = headers.get_all(header::RANGE).iter();
    let (Some(range), None) = (ranges.next(), ranges.next()) else { return None };
    // The file may have changed; the whole file is always a valid answer.
    if headers.contains_key(header::IF_RANGE) {
        return None;
    }
    let (unit, range) = range.to_str().ok()?.split_once('=')?;
    let (first, last) = range.split_once('-')?;
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if !unit.eq_ignore_ascii_case("bytes") || !is_number(first) || !is_number(last) {
        return None;
    }
    let end = bytes.saturating_sub(1);
    match (first.parse::<u64>().ok(), last.parse::<u64>().ok()) {
        (Some(first), Some(last)) if first <= last => Some(first..=last.min(end)),
        (Some(first), None) if last.is_empty() => Some(first..=end),
        // The last `count` bytes.
        (None, Some(count)) if first.is_empty() => Some(bytes.saturating_sub(count)..=end),
        _ => None,
    }
}

/// Returns the media type of a file. Browsers run JavaScript modules and WebAssembly only under the right types.
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

/// Whether compression is useful: true for text, WebAssembly and models, false for raster images and compressed files.
pub(super) fn is_worth_compressing(_: StatusCode, _: Version, headers: &HeaderMap, _: &Extensions) -> bool {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    kind.starts_with("text/")
        || ["application/wasm", "application/json", "image/svg+xml", "model/gltf-binary"].contains(&kind)
}

/// Adds the headers of every answer.
pub(super) fn with_headers<B>(mut answer: Response<B>) -> Response<B> {
    let headers = answer.headers_mut();
    for (name, value) in [
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-embedder-policy", "require-corp"),
        ("cross-origin-resource-policy", "same-origin"),
        ("x-content-type-options", "nosniff"),
        ("cache-control", "no-cache"),
    ] {
        headers.insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
    // Compressed bytes differ from the bytes of the file, so the tag becomes weak.
    let tag = headers.get(header::ETAG).filter(|_| headers.contains_key(header::CONTENT_ENCODING));
    let weak = tag.and_then(|tag| HeaderValue::try_from([b"W/", tag.as_bytes()].concat()).ok());
    if let Some(weak) = weak {
        headers.insert(header::ETAG, weak);
    }
    answer
}
