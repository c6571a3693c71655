//! The container of a glTF file, its JSON, and its buffers.

use std::{collections::HashMap, io::Read, path::Path, path::PathBuf};

use glam::{DMat4, DQuat, DVec3};
use gltf_json::{Buffer, Node, Root, deserialize};
use serde::Deserialize;

use super::{Damage, extensions, packed, uri};
use crate::recording::{
    Limits, Place, RecordingError,
    error::{Mismatch, Result, beyond},
    import::{
        FAR_M,
        lines::{BYTE_ORDER_MARK, shown},
        tilt_fields::{MOST_CHARS, shorten},
    },
    input::Input,
    opening::LFS_POINTER,
};

pub(crate) const MAGIC: &[u8] = b"glTF";
const HEAD_BYTES: usize = 12;
const CHUNK_HEAD_BYTES: usize = 8;
const VERSION: u32 = 2;
const JSON_CHUNK: &[u8] = b"JSON";
const BIN_CHUNK: &[u8] = b"BIN\0";
/// Largest number of buffer bytes of a polygon: three unshared corners of 64 bytes, and their indices.
const BYTES_A_POLYGON: u64 = 256;
/// Number of polygons that take as much memory as a parsed JSON object, a few hundred bytes. A number in a list takes
/// up to 32 bytes.
const POLYGONS_AN_OBJECT: u64 = 16;

/// The place of a node in full: the crate's types round it to `f32`.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(super) struct NodePlace {
    pub(super) translation: Option<DVec3>,
    pub(super) rotation: Option<DQuat>,
    pub(super) scale: Option<DVec3>,
    pub(super) matrix: Option<DMat4>,
}

/// The places of the nodes, read again if one of them lies far from the origin of its parent; else nothing.
fn far_places(root: &Root, json: &[u8]) -> Vec<NodePlace> {
    #[derive(Default, Deserialize)]
    struct Places {
        nodes: Vec<NodePlace>,
    }
    let is_far = |node: &Node| {
        let places =
            [node.translation.unwrap_or_default(), node.matrix.map_or([0.0; 3], |m| [m[12], m[13], m[14]])];
        places.as_flattened().iter().any(|at| f64::from(at.abs()) >= FAR_M)
    };
    match root.nodes.iter().any(is_far) {
        true => serde_json::from_slice::<Places>(json).unwrap_or_default().nodes,
        false => Vec::new(),
    }
}

pub(super) struct File {
    pub(super) path: PathBuf,
    pub(super) root: Root,
    /// The places of far nodes, and of all others then.
    pub(super) places: Vec<NodePlace>,
    pub(super) buffers: Vec<Vec<u8>>,
    /// The bytes of packed buffer views.
    pub(super) unpacked: HashMap<usize, Vec<u8>>,
    pub(super) is_binary: bool,
    /// Largest number of bytes of a further file.
    pub(super) most_bytes: u64,
}

impl File {
    pub(super) fn read(input: Input<'_>, limits: &Limits, damage: &mut Damage) -> Result<Self> {
        let path = input.path;
        let most = limits.polygons.saturating_mul(BYTES_A_POLYGON);
        let io = |error| RecordingError::io(path, error);
        let mut bytes = Vec::new();
        input.open().map_err(io)?.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 > most {
            return Err(beyond(path, Place::File, most, "bytes"));
        }
        let mut left = most - bytes.len() as u64;
        let is_binary = bytes.starts_with(MAGIC);
        if !is_binary {
            let (root, places) = parse(path, 0, &bytes, limits)?;
            drop(bytes);
            let buffers = read_buffers(input, &root, None, &mut left, damage)?;
            return Self::of(path, (root, places), buffers, is_binary, left, damage);
        }
        let json = binary_json(path, &bytes, damage)?;
        let (root, places) = parse(path, json.start, &bytes[json.clone()], limits)?;
        let binary = binary_chunk(path, &bytes, json.end, damage)?;
        let binary = binary.map(|range| {
            bytes.truncate(range.end);
            bytes.drain(..range.start);
            bytes
        });
        let buffers = read_buffers(input, &root, binary, &mut left, damage)?;
        Self::of(path, (root, places), buffers, is_binary, left, damage)
    }

    /// Unpacks packed buffers and meshes.
    fn of(
        path: &Path,
        (root, places): (Root, Vec<NodePlace>),
        buffers: Vec<Vec<u8>>,
        is_binary: bool,
        left: u64,
        damage: &mut Damage,
    ) -> Result<Self> {
        let path = path.to_owned();
        let mut file =
            Self { path, root, places, buffers, unpacked: HashMap::new(), is_binary, most_bytes: left };
        for fault in packed::unpack(&mut file) {
            damage.note(&file.path, fault)?;
        }
        Ok(file)
    }

    /// Whether osp has written the file.
    pub(super) fn is_ours(&self) -> bool {
        self.root.asset.generator.as_ref().is_some_and(|by| by.starts_with("osp "))
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: usize) -> Result<&[u8], Mismatch> {
        if let Some(unpacked) = self.unpacked.get(&view) {
            return Ok(unpacked);
        }
        let Root { buffer_views, .. } = &self.root;
        let missing =
            || Mismatch::new(format!("buffer view {view}"), format!("{} of them", buffer_views.len()));
        let described = buffer_views.get(view).ok_or_else(missing)?;
        let (start, length) = (described.byte_offset.unwrap_or_default().0, described.byte_length.0);
        self.bytes(described.buffer.value(), start, length)
            .ok_or_else(|| Mismatch::new(format!("the bytes of buffer view {view} in its buffer"), "too few"))
    }

    /// Bytes of a buffer.
    pub(super) fn bytes(&self, buffer: usize, start: u64, length: u64) -> Option<&[u8]> {
        let place = |at: u64| usize::try_from(at).ok();
        self.buffers.get(buffer)?.get(place(start)?..place(start.checked_add(length)?)?)
    }
}

/// Whether text begins with an object whose first property is one of glTF 2.0.
pub(crate) fn is_json(start: &[u8]) -> bool {
    const PROPERTIES: [&str; 19] = [
        "accessors",
        "animations",
        "asset",
        "bufferViews",
        "buffers",
        "cameras",
        "extensions",
        "extensionsRequired",
        "extensionsUsed",
        "extras",
        "images",
        "materials",
        "meshes",
        "nodes",
        "samplers",
        "scene",
        "scenes",
        "skins",
        "textures",
    ];
    let start = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start);
    let object = start.trim_ascii_start().strip_prefix(b"{").map(<[u8]>::trim_ascii_start);
    let name = object.and_then(|object| object.strip_prefix(b"\"")?.split(|&byte| byte == b'"').next());
    name.is_some_and(|name| PROPERTIES.iter().any(|property| property.as_bytes() == name))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

fn at_byte(path: &Path, offset: usize, expected: &str, found: impl Into<String>) -> RecordingError {
    Mismatch::new(expected, found).at_byte(path, offset as u64)
}

fn binary_json(path: &Path, bytes: &[u8], damage: &mut Damage) -> Result<std::ops::Range<usize>> {
    let cut = |at| at_byte(path, at, "the head of a .glb and its JSON", "the end of the data");
    let version = word(bytes, 4).ok_or_else(|| cut(bytes.len()))?;
    if version == 1 {
        return Err(first_version(path));
    }
    if version != VERSION {
        return Err(at_byte(path, 4, "glTF version 2", format!("version {version}")));
    }
    let length = word(bytes, 8).ok_or_else(|| cut(bytes.len()))?;
    if length as usize > bytes.len() {
        let found = format!("{} bytes", bytes.len());
        damage.note(path, Mismatch::new(format!("a .glb of {length} bytes, from its header"), found))?;
    }
    let json_bytes = word(bytes, HEAD_BYTES).ok_or_else(|| cut(bytes.len()))? as usize;
    let start = HEAD_BYTES + CHUNK_HEAD_BYTES;
    let kind = bytes.get(HEAD_BYTES + 4..start).ok_or_else(|| cut(bytes.len()))?;
    if kind != JSON_CHUNK {
        return Err(at_byte(path, HEAD_BYTES + 4, "the word `JSON`", kind.escape_ascii().to_string()));
    }
    let end = start.checked_add(json_bytes).filter(|&end| end <= bytes.len());
    Ok(start..end.ok_or_else(|| cut(bytes.len()))?)
}

fn binary_chunk(
    path: &Path,
    bytes: &[u8],
    mut at: usize,
    damage: &mut Damage,
) -> Result<Option<std::ops::Range<usize>>> {
    while let (Some(length), Some(kind)) = (word(bytes, at), bytes.get(at + 4..at + CHUNK_HEAD_BYTES)) {
        let start = at + CHUNK_HEAD_BYTES;
        let end = start.saturating_add(length as usize);
        if end > bytes.len() {
            let found = format!("{} bytes at byte {start}", bytes.len() - start);
            damage.note(path, Mismatch::new(format!("a chunk of {length} bytes"), found))?;
        }
        if kind == BIN_CHUNK {
            return Ok(Some(start..end.min(bytes.len())));
        }
        // Other chunks may belong to extensions.
        at = end.min(bytes.len());
    }
    Ok(None)
}

fn parse(path: &Path, start: usize, json: &[u8], limits: &Limits) -> Result<(Root, Vec<NodePlace>)> {
    // These counts estimate the memory of the JSON before it is parsed.
    let count = |of: &[u8]| json.iter().filter(|byte| of.contains(byte)).count() as u64;
    let bounds = [
        (count(b"{"), limits.polygons / POLYGONS_AN_OBJECT, "objects in its JSON"),
        (count(b",["), limits.polygons, "values in lists of its JSON"),
    ];
    if let Some((_, most, what)) = bounds.into_iter().find(|(count, most, _)| count > most) {
        return Err(beyond(path, Place::File, most, what));
    }
    // Some programs end the JSON with zeros.
    let end = json.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
    let json = &json[..end];
    let (start, json) = match json.strip_prefix(BYTE_ORDER_MARK) {
        Some(json) => (start + BYTE_ORDER_MARK.len(), json),
        None => (start, json),
    };
    let read = deserialize::from_slice(json).or_else(|error| mended(json).ok_or(error));
    let mut root: Root = read.map_err(|error| {
        if is_first_version(json) {
            return first_version(path);
        }
        let found = format!("text that does not fit ({})", shorten(&error.to_string(), MOST_CHARS));
        let mismatch = Mismatch::new("the JSON of glTF 2.0", found);
        match start {
            0 | 3 => mismatch.in_line(path, error.line() as u64),
            _ => mismatch.at_byte(path, (start + error.column().saturating_sub(1)) as u64),
        }
    })?;
    if root.asset.version.starts_with("1.") {
        return Err(first_version(path));
    }
    if !root.asset.version.starts_with("2.") {
        let found = format!("version {}", shown(&root.asset.version));
        return Err(Mismatch::new("a glTF file of version 2", found).in_file(path));
    }
    let unknown = root.extensions_required.iter().find(|name| extensions::changes_meshes(&root, name));
    if let Some(name) = unknown {
        let found = format!("one that requires {}", shown(name));
        return Err(Mismatch::new("a glTF file with meshes of a kind that osp reads", found).in_file(path));
    }
    root.extensions_required.clear();
    let places = far_places(&root, json);
    Ok((root, places))
}

/// The JSON with what some programs leave out: the list of nodes of an empty scene.
fn mended(json: &[u8]) -> Option<Root> {
    let mut json: serde_json::Value = serde_json::from_slice(json).ok()?;
    for scene in json.get_mut("scenes")?.as_array_mut()? {
        scene.as_object_mut()?.entry("nodes").or_insert_with(|| serde_json::json!([]));
    }
    serde_json::from_value(json).ok()
}

/// Whether the JSON is of glTF 1.0, in which the meshes are an object instead of a list.
fn is_first_version(json: &[u8]) -> bool {
    let json: serde_json::Value = serde_json::from_slice(json).unwrap_or_default();
    let version = json.pointer("/asset/version").map(|version| version.to_string());
    version.is_some_and(|version| version.trim_matches('"').starts_with('1')) || json["meshes"].is_object()
}

fn first_version(path: &Path) -> RecordingError {
    let found = "glTF 1.0 (`npx gltf-pipeline -i OLD -o NEW.glb` converts it)";
    Mismatch::new("glTF 2.0", found).in_file(path)
}

fn read_buffers(
    input: Input<'_>,
    root: &Root,
    mut binary: Option<Vec<u8>>,
    left: &mut u64,
    damage: &mut Damage,
) -> Result<Vec<Vec<u8>>> {
    let path = input.path;
    let is_packed_elsewhere = packed_elsewhere(root);
    let mut buffers = Vec::new();
    for (buffer, number) in root.buffers.iter().zip(0..) {
        let is_fallback = is_packed_elsewhere[number];
        let content = match (&buffer.uri, number) {
            // Another buffer holds its contents, packed.
            (None, _) if is_fallback && (number > 0 || binary.is_none()) => {
                buffers.push(Vec::new());
                continue;
            }
            (None, 0) => binary.take().ok_or_else(|| Mismatch::new("the binary chunk of buffer 0", "none")),
            (None, _) => Err(Mismatch::new(format!("the URI of buffer {number}"), "none")),
            (Some(uri), _) => match uri::data(uri) {
                Some(data) => data,
                None => match uri::file(uri, path) {
                    Ok(file) => read_beside(input.beside(&file), uri, left, path)?,
                    Err(fault) => Err(fault),
                },
            },
        };
        let mut content = match content {
            Ok(content) => content,
            Err(fault) => {
                damage.note(path, fault)?;
                Vec::new()
            }
        };
        let expected = buffer.byte_length.0;
        if content.starts_with(LFS_POINTER) {
            let found = "a pointer of Git LFS in its place (`git lfs pull` gets the file)";
            damage.note(path, Mismatch::new(format!("the contents of buffer {number}"), found))?;
            content.clear();
        }
        if (content.len() as u64) < expected && !(content.is_empty() && damage.is_lenient) {
            let found = format!("{} bytes", content.len());
            damage.note(path, Mismatch::new(format!("{expected} bytes of buffer {number}"), found))?;
        }
        content.truncate(usize::try_from(expected).unwrap_or(usize::MAX));
        buffers.push(content);
    }
    Ok(buffers)
}

/// For each buffer, whether an extension of it or of all its views says where the packed bytes lie.
fn packed_elsewhere(root: &Root) -> Vec<bool> {
    let mut plain_views = vec![None; root.buffers.len()];
    for view in &root.buffer_views {
        if let Some(count) = plain_views.get_mut(view.buffer.value()) {
            let is_packed = view.extensions.as_ref().is_some_and(|of| !of.others.is_empty());
            *count = Some(count.unwrap_or(0) + u32::from(!is_packed));
        }
    }
    let has = |buffer: &Buffer| buffer.extensions.as_ref().is_some_and(|of| !of.others.is_empty());
    root.buffers.iter().zip(plain_views).map(|(buffer, plain)| has(buffer) || plain == Some(0)).collect()
}

/// Reads a buffer from a separate file. The outer error is a limit or a system error; the inner error is a fault of the
/// model.
pub(super) fn read_beside(
    file: Input<'_>,
    uri: &str,
    left: &mut u64,
    model: &Path,
) -> Result<Result<Vec<u8>, Mismatch>> {
    let mut bytes = Vec::new();
    let read = file.lies_within(uri::folder(model)).and_then(|lies_within| {
        if lies_within {
            file.open()?.take(left.saturating_add(1)).read_to_end(&mut bytes)?;
        }
        Ok(lies_within)
    });
    match read {
        Ok(true) => {}
        Ok(false) => return Ok(Err(uri::leads_out(uri))),
        Err(error) => {
            let name = shown(&file.path.to_string_lossy());
            return Ok(Err(Mismatch::new(
                format!("the buffer {name}"),
                shorten(&error.to_string(), MOST_CHARS),
            )));
        }
    }
    match left.checked_sub(bytes.len() as u64) {
        Some(rest) => *left = rest,
        None => return Err(beyond(model, Place::File, *left, "bytes in its buffers")),
    }
    Ok(Ok(bytes))
}

/// The files of the buffers and pictures that a model refers to, as far as the model can be read.
pub(crate) fn files_beside(path: &Path) -> Vec<PathBuf> {
    let mut damage = Damage { is_lenient: true, notes: Default::default() };
    let mut bytes = Vec::new();
    let most = Limits::DEFAULT.polygons * BYTES_A_POLYGON;
    let read = Input::on_disk(path).open().and_then(|file| file.take(most).read_to_end(&mut bytes));
    if read.is_err() {
        return Vec::new();
    }
    let json = match bytes.starts_with(MAGIC) {
        true => binary_json(path, &bytes, &mut damage),
        false => Ok(0..bytes.len()),
    };
    let root = json.and_then(|json| parse(path, json.start, &bytes[json], &Limits::DEFAULT));
    let uris = root.into_iter().flat_map(|(root, _)| {
        let buffers = root.buffers.into_iter().filter_map(|buffer| buffer.uri);
        buffers.chain(root.images.into_iter().filter_map(|image| image.uri)).collect::<Vec<_>>()
    });
    let files = uris.filter(|uri| uri::data(uri).is_none()).filter_map(|uri| uri::file(&uri, path).ok());
    let folder = uri::folder(path);
    // A missing file is included, because another program may create it later.
    files.filter(|file| Input::on_disk(file).lies_within(folder).unwrap_or(true)).collect()
}
