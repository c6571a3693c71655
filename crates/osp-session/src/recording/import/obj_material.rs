//! `.mtl`, the materials of an `.obj`: diffuse colour (`Kd`), opacity (`d`, `Tr`), emitted light (`Ke`) and the texture
//! of the colour (`map_Kd`). Colours are sRGB.
//!
//! The parsing is our own: the crate `tobj` refuses a whole file for an empty `map_Kd`, which many programs write.

use std::{
    collections::HashMap,
    io::Read,
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::{Vec3, Vec4};

use super::{
    gltf::uri,
    lines::{LineReader, shown},
    paint::{Alpha, Look},
    texture::{Room, Texture, Wrap, linear_from_srgb},
};
use crate::recording::{
    OpenOptions,
    error::Mismatch,
    input::{Input, KeptInput},
};

/// Colour of faces without a material, linear.
pub(super) const PLAIN: Vec4 = Vec4::new(0.477, 0.477, 0.448, 1.0);
/// Number of lines of a model or a file of materials in which files are named.
const MOST_LINES: usize = 1 << 14;
/// Most warnings about materials and their pictures.
const MOST_WARNINGS: usize = 16;

#[derive(Debug, Default)]
struct Material {
    diffuse: Option<Vec3>,
    opacity: Option<f32>,
    emission: Vec3,
    texture: Option<Arc<Texture>>,
    /// Whether a file describes the material.
    is_known: bool,
    /// The line of the texture.
    map: String,
    /// Whether the texture's opacity says where the surface is.
    is_masked: bool,
    wrap: [Wrap; 2],
}

/// The materials that a model has read, and those that it has named.
pub(super) struct Materials {
    model: KeptInput,
    options: OpenOptions,
    room: Room,
    all: Vec<Material>,
    numbers: HashMap<String, usize>,
    /// The pictures by path, as masks and as others.
    textures: HashMap<(PathBuf, bool), Option<Arc<Texture>>>,
    /// Number of maps that are not shown, such as bump maps.
    other_maps: u64,
    warnings: Vec<String>,
}

impl Materials {
    pub(super) fn new(model: Input<'_>, options: &OpenOptions) -> Self {
        Self {
            model: KeptInput::of(model),
            options: *options,
            room: Room::new(&options.limits),
            all: Vec::new(),
            numbers: HashMap::new(),
            textures: HashMap::new(),
            other_maps: 0,
            warnings: Vec::new(),
        }
    }

    /// The number of the material of this name; `None` without a name.
    pub(super) fn number_of(&mut self, name: &str) -> Option<usize> {
        if name.is_empty() {
            return None;
        }
        if let Some(&number) = self.numbers.get(name) {
            return Some(number);
        }
        self.all.push(Material::default());
        self.numbers.insert(name.to_owned(), self.all.len() - 1);
        Some(self.all.len() - 1)
    }

    pub(super) fn look(&self, number: Option<usize>) -> Look<'_> {
        let plain = Look {
            base: PLAIN,
            texture: None,
            wrap: [Wrap::Repeat; 2],
            alpha: Alpha::Opaque,
            emission: Vec3::ZERO,
            glow: None,
        };
        let Some(material) = number.and_then(|number| self.all.get(number)) else { return plain };
        let texture = material.texture.as_deref();
        let diffuse = match material.diffuse {
            // A black factor hides the texture, and is written where the texture is all that counts.
            Some(diffuse) if texture.is_none() || diffuse != Vec3::ZERO => diffuse,
            _ if texture.is_some() => Vec3::ONE,
            _ => PLAIN.truncate(),
        };
        let opacity = material.opacity.unwrap_or(1.0);
        let alpha = match (material.is_masked, opacity < 1.0) {
            (true, _) => Alpha::Mask(0.5),
            (false, true) => Alpha::Blend,
            (false, false) => Alpha::Opaque,
        };
        Look {
            base: diffuse.extend(opacity),
            texture,
            wrap: material.wrap,
            alpha,
            emission: material.emission,
            glow: None,
        }
    }

    /// Reads the files that a line names. A name may have spaces.
    pub(super) fn read(&mut self, names: &str) {
        let names = names.replace('\\', "/");
        let is_file = |name: &str| find(self.model.input(), None, name).is_some();
        let files: Vec<&str> = match is_file(&names) {
            true => vec![&*names],
            false => names.split_ascii_whitespace().collect(),
        };
        for name in files {
            let found = find(self.model.input(), None, name);
            let options = OpenOptions { lenient: true, ..self.options };
            let lines =
                found.and_then(|path| LineReader::open(self.model.input().beside(&path), &options).ok());
            match lines {
                Some(lines) => self.read_lines(lines),
                None => self.warn(format!("no materials {} beside it: their faces are grey", shown(name))),
            }
        }
    }

    fn read_lines(&mut self, mut lines: LineReader) {
        let mut at = None;
        while let Ok(Some(line)) = lines.next_line() {
            let text = line.split_once('#').map_or(&*line, |(text, _)| text).trim_ascii();
            let (word, rest) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
            let rest = rest.trim_ascii();
            let numbers: Vec<f32> =
                rest.split_ascii_whitespace().filter_map(|field| field.parse().ok()).collect();
            let color = match numbers[..] {
                [r, g, b, ..] => Some(Vec3::new(r, g, b).map(linear_from_srgb)),
                // One number stands for all three.
                [grey] => Some(Vec3::splat(linear_from_srgb(grey))),
                _ => None,
            };
            if word == "newmtl" {
                at = self.number_of(rest);
                if let Some(material) = at.and_then(|at| self.all.get_mut(at)) {
                    *material = Material { is_known: true, ..Material::default() };
                }
                continue;
            }
            let Some(at) = at else { continue };
            let texture = match word {
                "map_Kd" | "map_d" => self.texture(&lines.path, rest, word == "map_d"),
                _ => None,
            };
            let material = &mut self.all[at];
            match word {
                "Kd" => material.diffuse = color.or(material.diffuse),
                "Ke" => material.emission = color.unwrap_or_default(),
                "d" => material.opacity = numbers.first().copied().or(material.opacity),
                // `Tr 1` is transparent by the format, but MeshLab and others write it for what is opaque.
                "Tr" => {
                    let hidden = numbers.first().filter(|hidden| **hidden < 1.0);
                    material.opacity = material.opacity.or(hidden.map(|hidden| 1.0 - hidden));
                }
                "map_Kd" => {
                    if let Some((texture, wrap)) = texture {
                        (material.texture, material.wrap) = (Some(texture), wrap);
                    }
                }
                // The opacity mostly lies in the picture of the colour.
                "map_d" if rest == material.map => {
                    if let Some((texture, _)) = texture {
                        (material.texture, material.is_masked) = (Some(texture), true);
                    }
                }
                _ if word.starts_with("map_")
                    || matches!(word, "bump" | "norm" | "disp" | "decal" | "refl") =>
                {
                    self.other_maps += 1;
                }
                _ => {}
            }
            if word == "map_Kd" {
                rest.clone_into(&mut self.all[at].map);
            }
        }
    }

    /// The picture that a line names after its options.
    fn texture(&mut self, beside: &Path, line: &str, is_mask: bool) -> Option<(Arc<Texture>, [Wrap; 2])> {
        let (name, wrap) = picture(line);
        if name.is_empty() {
            return None;
        }
        let warning = |fault: Mismatch| format!("the texture {} is not shown: {}", shown(&name), fault.found);
        let Some(path) = find(self.model.input(), Some(beside), &name) else {
            self.warn(warning(Mismatch::new("", "there is none beside the model or its materials")));
            return None;
        };
        let key = (path, is_mask);
        if !self.textures.contains_key(&key) {
            let mut bytes = Vec::new();
            let file = self.model.input().beside(&key.0).open();
            let most = self.options.limits.piped_bytes();
            let decoded = file
                .and_then(|file| file.take(most).read_to_end(&mut bytes))
                .map_err(|error| Mismatch::new("", error.to_string()))
                .and_then(|_| Texture::decode(&bytes, is_mask.then_some(0.5), &mut self.room));
            let found = decoded.map(Arc::new).map_err(|fault| self.warn(warning(fault))).ok();
            self.textures.insert(key.clone(), found);
        }
        self.textures[&key].clone().map(|texture| (texture, wrap))
    }

    fn warn(&mut self, warning: String) {
        if self.warnings.len() < MOST_WARNINGS && !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    pub(super) fn warnings(&self) -> impl Iterator<Item = String> {
        let path = self.model.input().path.display();
        self.warnings.iter().map(move |warning| format!("{path}: {warning}"))
    }

    /// What the materials have beyond their colours, or lack.
    pub(super) fn lost(&self) -> Vec<String> {
        let count =
            |of: fn(&Material) -> bool| self.all.iter().filter(|material| of(material)).count() as u64;
        [
            (count(|material| !material.is_known), "materials that no file describes"),
            (
                count(|material| material.opacity.is_some_and(|opacity| opacity <= 0.0)),
                "transparent materials (`d 0`)",
            ),
            (self.other_maps, "maps other than of colours (`map_Kd`)"),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{what}: {count}"))
        .collect()
    }
}

/// The file of this name in the folder of its materials or of the model, or below. A path of another machine stands for
/// its last part.
fn find(model: Input<'_>, materials: Option<&Path>, name: &str) -> Option<PathBuf> {
    let last = name.rsplit('/').next().unwrap_or(name);
    let at = |beside: &Path, name: &str| {
        // Materials in a folder of their own may name a neighbour of it.
        let (mut beside, mut name) = (beside, name);
        while let Some(above) = name.strip_prefix("../") {
            (beside, name) = (beside.parent()?, above);
        }
        let path = uri::file(name, beside).ok()?;
        let is_here = model.beside(&path).is_file()
            && model.beside(&path).lies_within(uri::folder(model.path)).unwrap_or(false);
        is_here.then_some(path)
    };
    let folders = || materials.into_iter().chain([model.path]);
    [name, last].into_iter().find_map(|name| folders().find_map(|beside| at(beside, name)))
}

/// The picture that a line names after its options.
fn picture(line: &str) -> (String, [Wrap; 2]) {
    let (mut name, mut wrap) = (line, [Wrap::Repeat; 2]);
    while let Some((option, rest)) = name.strip_prefix('-').and_then(|rest| rest.split_once(' ')) {
        let most = match option {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        name = rest.trim_ascii();
        for at in 0..most {
            let Some((value, rest)) = name.split_once(' ') else { break };
            if at > 0 && value.parse::<f32>().is_err() {
                break;
            }
            if (option, value) == ("clamp", "on") {
                wrap = [Wrap::Clamp; 2];
            }
            name = rest.trim_ascii();
        }
    }
    (name.replace('\\', "/"), wrap)
}

/// The files of the materials that a model names in its first lines, and their pictures.
pub(super) fn files_beside(path: &Path) -> Vec<PathBuf> {
    let named = |file: &Path, materials: Option<&Path>| -> Vec<PathBuf> {
        let mut lines = LineReader::open(Input::on_disk(file), &OpenOptions::LENIENT).ok();
        let lines = std::iter::from_fn(move || lines.as_mut()?.next_line().ok().flatten()).take(MOST_LINES);
        let name = |line: String| {
            let (word, rest) = line.trim_ascii().split_once(|c: char| c.is_ascii_whitespace())?;
            let name = if word == "mtllib" { rest.replace('\\', "/") } else { picture(rest).0 };
            let is_file = word == "mtllib" || word.starts_with("map_");
            is_file.then(|| find(Input::on_disk(path), materials, name.trim_ascii())).flatten()
        };
        lines.filter_map(name).collect()
    };
    let mut files = named(path, None);
    let pictures: Vec<PathBuf> = files.iter().flat_map(|file| named(file, Some(file))).collect();
    files.extend(pictures);
    files
}
