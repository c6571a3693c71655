//! Rules for replacing files: an output replaces only a file of its own kind. A session, or a file of another kind, is
//! a person's work and is not replaced.

use std::{
    io::{self, Read},
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::{
    atomic_file::Destination, platform::fs, recording::looks_like_session, small_file::open_regular,
};

/// Number of bytes at the beginning of a file that decide its kind.
const SNIFF_BYTES: u64 = 4096;

/// The kinds of output files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputKind {
    /// Comma-separated values.
    Csv,
    /// A web page.
    Html,
    /// A picture in pixels.
    Png,
    /// An animated film.
    Gif,
    /// A film that a video player plays.
    Mp4,
    /// A picture in vector form.
    Svg,
    /// A graph for Graphviz.
    Dot,
    /// A trace: one line of JSON for each frame.
    Trace,
    /// Fingerprints of the frames of a replay, for comparison.
    Pins,
    /// Potentially visible sets: the polygons that are visible from a region.
    Pvs,
    /// A model, binary glTF.
    Glb,
    /// The results of a study: one line of JSON for each session.
    Study,
    /// A session.
    Recording,
    /// A session in the format of a Tilt Brush sketch.
    Tilt,
}

/// First bytes of a study's results.
pub const STUDY_START: &[u8] = b"{\"osp_study\":";
/// Beginning of the JSON in a model that osp wrote. It follows the headers of the file and of its first chunk.
const OWN_MODEL_START: &[u8] = b"{\"asset\":{\"generator\":\"osp ";
/// Name of the video track in an MP4 that osp wrote. Videos of other programs must not be replaced.
pub const FILM_MARK: &str = "osp film";
/// Size of the headers of the file and of its first chunk, bytes.
const MODEL_HEADS: usize = 20;

use OutputKind::{Csv, Dot, Gif, Glb, Html, Mp4, Pins, Png, Pvs, Recording, Study, Svg, Tilt, Trace};

impl OutputKind {
    /// The kinds that a file's contents reveal. The contents of a `.tilt` count as [`Recording`], because both are
    /// sessions.
    const ALL: [Self; 13] = [Png, Gif, Mp4, Glb, Pvs, Html, Svg, Dot, Pins, Trace, Study, Csv, Recording];

    /// The kind of a film with this name; `None` if the name is that of another kind.
    pub fn of_film(path: &Path) -> Option<Self> {
        [Mp4, Gif].into_iter().find(|kind| kind.is_named(path))
    }

    /// The kind's name in messages.
    fn name(self) -> &'static str {
        match self {
            Csv => "a table (CSV)",
            Html => "a page (HTML)",
            Png => "a picture (PNG)",
            Gif => "a film (GIF)",
            Mp4 => "a film of osp (MP4)",
            Svg => "a picture (SVG)",
            Dot => "a graph (DOT)",
            Trace => "a trace",
            Pins => "pinned fingerprints",
            Pvs => "sets of what can be seen (.pvs)",
            Glb => "a model (.glb)",
            Study => "lines of `osp study`",
            Recording | Tilt => "a session",
        }
    }

    /// File name endings of this kind.
    fn endings(self) -> &'static [&'static str] {
        match self {
            Csv => &[".csv"],
            Html => &[".html", ".htm"],
            Png => &[".png"],
            Gif => &[".gif"],
            Mp4 => &[".mp4"],
            Svg => &[".svg"],
            Dot => &[".dot"],
            Trace => &[".jsonl"],
            Pins => &[".pins"],
            Pvs => &[".pvs"],
            Glb => &[".glb"],
            Study => &[".ndjson"],
            Recording => &[".ron", ".ron.zst"],
            Tilt => &[".tilt"],
        }
    }

    /// Whether the name must have one of the endings. Files of other kinds are text, and may have any ending that does
    /// not belong to another kind.
    fn needs_ending(self) -> bool {
        matches!(self, Png | Gif | Mp4 | Svg | Dot | Pvs | Glb | Study | Recording | Tilt)
    }

    /// Whether the kind is a session. A session is a person's work, so an output never replaces it without `--force`.
    pub fn is_session(self) -> bool {
        matches!(self, Recording | Tilt)
    }

    fn is_named(self, path: &Path) -> bool {
        let name =
            path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        self.endings().iter().any(|ending| name.ends_with(ending))
    }

    /// Whether a file of this kind may have this name.
    fn fits_name(self, path: &Path) -> bool {
        let is_session = || {
            let endings = [".ron", ".zst", ".tilt", ".apa", ".json", ".poses", ".obj", ".gz", ".gltf"];
            let name = path.file_name().map(|name| name.to_string_lossy().to_ascii_lowercase());
            name.is_some_and(|name| endings.iter().any(|ending| name.ends_with(ending)))
        };
        match self {
            _ if self.is_named(path) => true,
            _ if self.needs_ending() => false,
            // Earlier versions wrote these kinds under the endings `.ron` and `.json`.
            Pins if Recording.is_named(path) => true,
            Trace if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) => true,
            _ => !is_session() && !Self::ALL.iter().any(|other| other.is_named(path)),
        }
    }

    /// Whether a file with this beginning is of this kind.
    fn begins(self, start: &[u8], path: &Path) -> bool {
        let text = start.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(start).trim_ascii_start();
        let starts = |mark: &str| {
            text.get(..mark.len()).is_some_and(|start| start.eq_ignore_ascii_case(mark.as_bytes()))
        };
        let first_line = || text.split(|&byte| byte == b'\n').next().unwrap_or_default();
        let holds = |line: &[u8], words: &str| line.windows(words.len()).any(|part| part == words.as_bytes());
        match self {
            Png => start.starts_with(b"\x89PNG\r\n\x1a\n"),
            Gif => start.starts_with(b"GIF8"),
            Mp4 => start.get(4..8) == Some(b"ftyp") && holds(start, FILM_MARK),
            Glb => start.starts_with(b"glTF"),
            // A killed program may have left only a part of the first line.
            Study => text.starts_with(STUDY_START) || (!text.is_empty() && STUDY_START.starts_with(text)),
            Pvs => start.starts_with(b"osp pvs "),
            Html => starts("<!doctype html") || starts("<html"),
            Svg => starts("<svg") || (starts("<?xml") && holds(text, "<svg")),
            Dot => starts("digraph ") || starts("graph ") || starts("strict "),
            Pins => {
                let code = text.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
                let mut code = code.filter(|line| !line.is_empty() && !line.starts_with(b"//"));
                let first = code.next().unwrap_or_default();
                let inside = first.strip_prefix(b"(").map(<[u8]>::trim_ascii);
                inside.is_some_and(|rest| {
                    let rest = if rest.is_empty() { code.next().unwrap_or_default() } else { rest };
                    rest.starts_with(b"pins")
                })
            }
            Trace => {
                let line = first_line();
                line.starts_with(b"{") && holds(line, "\"frame\":") && holds(line, "\"shown\":")
            }
            Csv => {
                let line = first_line();
                let is_ours = ["recording,index,frame,", "part,recording,index,"].into_iter().any(starts);
                let is_text = !line.is_empty()
                    && line.contains(&b',')
                    && !b"{[(<".contains(&line[0])
                    && str::from_utf8(line).is_ok_and(|line| !line.trim_end().chars().any(char::is_control));
                is_ours || (is_text && self.is_named(path) && !looks_like_session(path, start))
            }
            Recording | Tilt => looks_like_session(path, start),
        }
    }
}

/// Whether a file of this kind exists at `path`.
pub fn is_there(path: &Path, kind: OutputKind) -> bool {
    start_of(path).is_ok_and(|start| kind_of(&start, path) == Some(Ok(kind)))
}

/// Whether a file of this kind exists that osp may have written. A model of another program does not count.
pub fn is_made(path: &Path, kind: OutputKind) -> bool {
    start_of(path).is_ok_and(|start| match kind {
        Glb => is_own_model(&start),
        _ => !start.is_empty() && kind.begins(&start, path),
    })
}

/// The reason why an output cannot be written.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "their messages describe them")]
pub enum OutputError {
    /// The file name has the ending of another kind of file.
    #[error("{}: expected a name that ends in {expected}", path.display())]
    Ending { path: PathBuf, expected: String },
    /// A file of another kind exists at the path.
    #[error("{}: holds {found}, not {wanted}", path.display())]
    OtherKind { path: PathBuf, found: &'static str, wanted: &'static str },
    /// A model of another program exists at the path. Such a model is a person's work.
    #[error("{}: holds a model of another program", path.display())]
    ForeignModel { path: PathBuf },
    /// A file exists whose kind an output replaces only with `--force`.
    #[error("{}: exists already", path.display())]
    Exists { path: PathBuf },
    /// The path cannot be used.
    #[error("{}: {cause}", path.display())]
    Io { path: PathBuf, cause: io::Error },
}

impl OutputError {
    fn io(path: &Path, cause: io::Error) -> Self {
        Self::Io { path: path.to_owned(), cause }
    }

    /// Whether `--force` would replace the file.
    pub fn yields_to_force(&self) -> bool {
        match self {
            Self::OtherKind { .. } | Self::ForeignModel { .. } | Self::Exists { .. } => true,
            Self::Ending { .. } | Self::Io { .. } => false,
        }
    }
}

/// Checks that a file of this kind may be written at `path`. With `force` the output may replace a file of any kind.
pub fn check_output(path: &Path, kind: OutputKind, force: bool) -> Result<(), OutputError> {
    let io = |cause| OutputError::io(path, cause);
    let target = match Destination::of(path).map_err(io)? {
        Destination::StandardOutput | Destination::StandardError => return Ok(()),
        Destination::Special(special) => return check_special(&special, force).map_err(io),
        Destination::File(target) => target,
    };
    let is_misnamed = !kind.fits_name(path) && !kind.fits_name(&target);
    // With `force`, a text file may have any name.
    if is_misnamed && (kind.needs_ending() || !force) {
        let expected = kind.endings().join(" or ");
        return Err(OutputError::Ending { path: path.to_owned(), expected });
    }
    let data = match fs::metadata(&target) {
        Ok(data) => data,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
            return match folder.is_none_or(fs::is_folder) {
                true => Ok(()),
                false => Err(io(io::Error::new(error.kind(), "there is no such folder"))),
            };
        }
        Err(error) => return Err(io(error)),
    };
    if data.is_dir() {
        return Err(io(io::Error::new(io::ErrorKind::IsADirectory, "expected a file; found a folder")));
    }
    if force {
        return Ok(());
    }
    if kind.is_session() {
        return Err(OutputError::Exists { path: path.to_owned() });
    }
    let start = start_of(&target).map_err(io)?;
    match kind_of(&start, &target) {
        None => Ok(()),
        Some(Ok(Glb)) if kind == Glb && !is_own_model(&start) => {
            Err(OutputError::ForeignModel { path: path.to_owned() })
        }
        Some(Ok(found)) if found == kind => Ok(()),
        Some(found) => Err(OutputError::OtherKind {
            path: path.to_owned(),
            found: found.map_or_else(|other| other, OutputKind::name),
            wanted: kind.name(),
        }),
    }
}

fn check_special(path: &Path, force: bool) -> io::Result<()> {
    // A block device has the data of a whole disk, so it is never replaced without `force`.
    #[cfg(unix)]
    if !force
        && fs::metadata(path)
            .is_ok_and(|data| std::os::unix::fs::FileTypeExt::is_block_device(&data.file_type()))
    {
        return Err(io::Error::other("expected a file; found a disk"));
    }
    let _ = (path, force);
    Ok(())
}

fn start_of(path: &Path) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    open_regular(path)?.take(SNIFF_BYTES).read_to_end(&mut start)?;
    Ok(start)
}

/// Kind of a file with this beginning, or the name of an unknown kind; `None` if the file is empty.
fn kind_of(start: &[u8], path: &Path) -> Option<Result<OutputKind, &'static str>> {
    if start.is_empty() {
        return None;
    }
    let kind = OutputKind::ALL.into_iter().find(|kind| kind.begins(start, path));
    Some(kind.ok_or("a file of another kind"))
}

fn is_own_model(start: &[u8]) -> bool {
    start.get(MODEL_HEADS..).is_some_and(|json| json.starts_with(OWN_MODEL_START))
}

/// Whether two paths lead to the same file. Symbolic and hard links are followed, and neither file is opened.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(a), Ok(b)) = (fs::metadata(a), fs::metadata(b)) {
        return fs::Identity::of(&a) == fs::Identity::of(&b);
    }
    match (whole_path(a), whole_path(b)) {
        (Some(a), Some(b)) => a == b,
        _ => false,
    }
}

/// The canonical path. For a file that does not exist yet, the canonical path of its folder is extended by its name.
fn whole_path(path: &Path) -> Option<PathBuf> {
    let Ok(Destination::File(target)) = Destination::of(path) else { return None };
    fs::whole_path(&target)
}

/// Whether a file lies, or would lie, in a folder or below it.
pub fn lies_in(file: &Path, folder: &Path) -> bool {
    match (whole_path(file), folder.canonicalize()) {
        (Some(file), Ok(folder)) => file.starts_with(folder),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(start: &str, name: &str) -> Option<OutputKind> {
        OutputKind::ALL.into_iter().find(|kind| kind.begins(start.as_bytes(), Path::new(name)))
    }

    #[test]
    fn a_file_is_known_by_how_it_begins() {
        for (start, name, kind) in [
            ("Header(format: 1, name: \"a\")\n", "a.csv", Some(Recording)),
            ("// drawn, yesterday\nHeader(format: 1)\n", "a.csv", Some(Recording)),
            ("recording,index,frame,measured\n", "a.txt", Some(Csv)),
            ("part,recording,index,polygons\n", "a", Some(Csv)),
            ("name,age\nA,1\n", "people.csv", Some(Csv)),
            ("Dear A,\nhow are you?", "letter.txt", None),
            ("just text", "a.csv", None),
            ("[{\"a\": 1, \"b\": 2}]", "a.csv", Some(Recording)),
            ("tilT, and so on", "a.csv", Some(Recording)),
            ("\n <!DOCTYPE html><html>", "a", Some(Html)),
            ("<?xml version=\"1.0\"?>\n<svg xmlns", "a", Some(Svg)),
            ("<?xml version=\"1.0\"?>\n<office>", "a.svg", None),
            ("digraph index {", "a", Some(Dot)),
            ("{\"drawn\":1,\"frame\":0,\"shown\":true}\n", "a.json", Some(Trace)),
            ("{\"strokes\": []}", "a.json", Some(Recording)),
            ("(\n    pins: [\n", "a.ron", Some(Pins)),
            ("// ours\n(pins: [])", "a.pins", Some(Pins)),
            ("osp pvs 1\n", "a", Some(Pvs)),
            ("v 0 0 0\n", "a.obj", Some(Recording)),
            ("{\"osp_study\":1,\"file\":\"a.ron\"", "a.json", Some(Study)),
            ("GIF89a\u{1}", "a", Some(Gif)),
            ("\0\0\0\u{20}ftypisom\0vide\0osp film\0", "a", Some(Mp4)),
            ("\0\0\0\u{20}ftypisom\0vide\0VideoHandler\0", "holiday.mp4", None),
            ("PK\u{3}\u{4}", "a.zip", None),
        ] {
            assert_eq!(found(start, name), kind, "{name}: {start}");
        }
    }

    #[test]
    fn names_of_other_kinds_do_not_fit() {
        let fits = |kind: OutputKind, name: &str| kind.fits_name(Path::new(name));
        for (kind, good, bad) in [
            (
                Csv,
                &["a.csv", "a.txt", "a", "A.CSV"][..],
                &["a.ron", "a.png", "a.tilt", "a.ron.zst", "a.html"][..],
            ),
            (Gif, &["a.gif"], &["a.png", "a.mp4", "a"]),
            (Mp4, &["a.mp4", "a.MP4"], &["a.gif", "a.mov", "a"]),
            (Png, &["a.png", "a.PNG"], &["a.jpg", "a", "a.ron", "a.svg"]),
            (Pins, &["a.pins", "a.ron", "a"], &["a.png", "a.tilt", "a.csv"]),
            (Trace, &["a.jsonl", "a.json", "a.log"], &["a.ron", "a.csv"]),
            (Glb, &["a.glb"], &["p.obj", "a", "a.gltf"]),
            (Study, &["a.ndjson", "a.NDJSON"], &["a", "a.csv", "a.json", "a.parquet"]),
            (Recording, &["a.ron", "a.ron.zst"], &["a.zst", "a.txt", "a.tilt"]),
            (Tilt, &["a.tilt", "a.TILT"], &["a", "a.ron", "a.zip"]),
        ] {
            assert!(good.iter().all(|name| fits(kind, name)), "{kind:?} {good:?}");
            assert!(!bad.iter().any(|name| fits(kind, name)), "{kind:?} {bad:?}");
        }
    }
}
