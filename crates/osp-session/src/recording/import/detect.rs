use std::{io::Read, path::Path};

use super::{
    apa, gltf,
    lines::{BYTE_ORDER_MARK, GZIP_MAGIC, gzip},
    obj, open_apa, open_gltf, open_json, open_obj, open_poses, open_tilt, poses, tilt, tilt_layout,
};
use crate::recording::{OpenOptions, Session, error::Result, input::Input, opening::SNIFF_BYTES};

pub(crate) const FORMATS: &[&str] = &[
    ".tilt",
    ".apa",
    "the .json of CASSIE and A-Painter",
    ".poses",
    ".obj",
    ".poses.gz",
    ".obj.gz",
    ".glb",
    ".gltf",
];

type Opener = fn(Input<'_>, &OpenOptions) -> Result<Session>;

/// The reader for a folder, or for a file that has this beginning.
pub(crate) fn by_contents(input: Input<'_>, start: &[u8]) -> Option<Opener> {
    if input.is_folder() {
        return tilt::is_tilt_folder(input).then_some(open_tilt);
    }
    let binary: [(&[u8], Opener); 3] =
        [(tilt_layout::MAGIC, open_tilt), (apa::MAGIC, open_apa), (gltf::MAGIC, open_gltf)];
    let opener = binary.into_iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, opener)| opener);
    opener.or_else(|| gltf::is_json(start).then_some(open_gltf as Opener)).or_else(|| by_lines(start))
}

/// The reader for lines of text, perhaps compressed with gzip.
fn by_lines(start: &[u8]) -> Option<Opener> {
    let mut text = Vec::new();
    let text = match start.starts_with(GZIP_MAGIC) {
        // The beginning of a stream ends too early, which does not matter to the lines before.
        true => {
            let _ = gzip(start).take(SNIFF_BYTES).read_to_end(&mut text);
            &text
        }
        false => start,
    };
    let text = String::from_utf8_lossy(text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text));
    let line = text.lines().map(str::trim_ascii).find(|line| !line.is_empty() && !line.starts_with('#'))?;
    let kinds: [(bool, Opener); 2] =
        [(obj::is_statement(line), open_obj), (poses::is_pose(line), open_poses)];
    kinds.into_iter().find(|(is_it, _)| *is_it).map(|(_, opener)| opener)
}

/// The reader for a file whose beginning fits no format, by the file's name, or by its contents if these look like
/// JSON. The reader reports the damage.
pub(crate) fn by_name(path: &Path, start: &[u8]) -> Option<Opener> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let endings: [(&str, Opener); 9] = [
        (".poses", open_poses),
        (".poses.gz", open_poses),
        (".obj", open_obj),
        (".obj.gz", open_obj),
        (".tilt", open_tilt),
        (".apa", open_apa),
        (".json", open_json),
        (".glb", open_gltf),
        (".gltf", open_gltf),
    ];
    let named = endings.into_iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, opener)| opener);
    let json =
        || matches!(start.trim_ascii_start().first(), Some(b'[' | b'{')).then_some(open_json as Opener);
    named.or_else(json)
}
