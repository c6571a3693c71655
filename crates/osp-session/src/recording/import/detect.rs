use std::path::Path;

use super::{
    apa, gltf, open_apa, open_cassie, open_gltf, open_obj, open_poses, open_tilt, tilt, tilt_layout,
};
use crate::recording::{OpenOptions, Session, error::Result, input::Input};

pub(crate) const FORMATS: &[&str] =
    &[".tilt", ".apa", "CASSIE's .json", ".poses", ".obj", ".poses.gz", ".obj.gz", ".glb", ".gltf"];

type Opener = fn(Input<'_>, &OpenOptions) -> Result<Session>;

/// The reader for a folder, or for a file that starts with the magic bytes of a binary format.
pub(crate) fn by_mark(input: Input<'_>, start: &[u8]) -> Option<Opener> {
    if input.is_folder() {
        tilt::is_tilt_folder(input).then_some(open_tilt)
    } else if start.starts_with(tilt_layout::MAGIC) {
        Some(open_tilt)
    } else if start.starts_with(apa::MAGIC) {
        Some(open_apa)
    } else if start.starts_with(gltf::MAGIC) {
        Some(open_gltf)
    } else {
        None
    }
}

/// The reader for a text file, by the file's name, or by its contents if these look like JSON: a glTF has an `asset`.
pub(crate) fn by_name(path: &Path, start: &[u8]) -> Option<Opener> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    // Text may be compressed with gzip. A file that has the name of a binary format, but gets here, has damaged magic
    // bytes. The format's reader reports the damage.
    let endings: [(&str, Opener); 9] = [
        (".poses", open_poses),
        (".poses.gz", open_poses),
        (".obj", open_obj),
        (".obj.gz", open_obj),
        (".tilt", open_tilt),
        (".apa", open_apa),
        (".json", open_cassie),
        (".glb", open_gltf),
        (".gltf", open_gltf),
    ];
    let named = endings.into_iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, opener)| opener);
    let json = || match start.trim_ascii_start().first()? {
        b'{' if start.windows(7).any(|word| word == b"\"asset\"") => Some(open_gltf as Opener),
        b'[' | b'{' => Some(open_cassie as Opener),
        _ => None,
    };
    named.or_else(json)
}
