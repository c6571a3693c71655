//! The looks of a file's materials, with their decoded textures.

use std::collections::HashMap;

use glam::{Affine2, Vec2, Vec3, Vec4};
use gltf_json::{
    image::Image,
    material::{AlphaMode, Material},
    mesh::{Primitive, Semantic},
    texture::{Info, Sampler, WrappingMode},
    validation::Checked,
};

use super::{
    container::{File, read_beside},
    extensions::BRUSH,
    uri,
};
use crate::brush::{self, Brush};
use crate::recording::{
    Limits,
    error::Mismatch,
    import::{
        lines::shown,
        paint::{Alpha, Look},
        texture::{Room, Texture, Wrap},
    },
    input::Input,
};

/// Most textures whose fault is named.
const MOST_NAMED: usize = 8;

/// A material: its factors, and the numbers of its textures.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    base: Vec4,
    emission: Vec3,
    alpha: Alpha,
    color: Option<usize>,
    glow: Option<usize>,
    wrap: [Wrap; 2],
    /// The set of texture coordinates, and their transform.
    pub(super) coordinates: u32,
    pub(super) transform: Affine2,
    /// The brush of Tilt Brush or Open Brush that has painted the surface.
    pub(super) brush: Option<&'static Brush>,
    /// The same in a file of our own, in which the texture and the first colours show the brush to other programs.
    own_brush: Option<&'static Brush>,
}

impl Surface {
    /// The brush that has painted a primitive of this material.
    pub(super) fn brush_of(&self, primitive: &Primitive) -> Option<&'static Brush> {
        let has_colors = primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(1)));
        self.brush.or(self.own_brush.filter(|_| has_colors))
    }
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            base: Vec4::ONE,
            emission: Vec3::ZERO,
            alpha: Alpha::Opaque,
            color: None,
            glow: None,
            wrap: [Wrap::Repeat; 2],
            coordinates: 0,
            transform: Affine2::IDENTITY,
            brush: None,
            own_brush: None,
        }
    }
}

#[derive(Debug, Default)]
pub(super) struct Surfaces {
    all: Vec<Surface>,
    textures: Vec<Texture>,
    plain: Surface,
    /// Textures that are not shown, in words.
    pub(super) lost: Vec<String>,
}

impl Surfaces {
    /// Reads the materials, and decodes their textures.
    pub(super) fn read(input: Input<'_>, file: &File, limits: &Limits) -> Self {
        let mut of = Self::default();
        let mut reader =
            Reader { input, file, known: HashMap::new(), room: Room::new(limits), faults: Vec::new() };
        for material in &file.root.materials {
            of.all.push(reader.surface(material, &mut of.textures));
        }
        let faults = reader.faults;
        if let [first, ..] = &faults[..] {
            let count = faults.len();
            let what = if count == 1 { "1 texture".to_owned() } else { format!("{count} textures") };
            of.lost.push(format!("{what} ({first})"));
        }
        let plain = file.root.materials.iter().zip(&of.all).filter(|(_, surface)| surface.brush.is_none());
        let others = plain.map(|(material, _)| other_textures(material)).sum::<usize>();
        if others > 0 {
            of.lost.push(format!("{others} textures of roughness, metal, relief or occlusion"));
        }
        of
    }

    pub(super) fn of(&self, material: Option<usize>) -> &Surface {
        material.and_then(|material| self.all.get(material)).unwrap_or(&self.plain)
    }

    pub(super) fn look<'a>(&'a self, surface: &Surface) -> Look<'a> {
        let texture = |number: Option<usize>| number.and_then(|number| self.textures.get(number));
        Look {
            base: surface.base,
            texture: texture(surface.color),
            glow: texture(surface.glow),
            wrap: surface.wrap,
            alpha: surface.alpha,
            emission: surface.emission,
        }
    }
}

fn other_textures(material: &Material) -> usize {
    let pbr = &material.pbr_metallic_roughness;
    usize::from(pbr.metallic_roughness_texture.is_some())
        + usize::from(material.normal_texture.is_some())
        + usize::from(material.occlusion_texture.is_some())
}

struct Reader<'a> {
    input: Input<'a>,
    file: &'a File,
    /// Numbers of the decoded textures, by image and cutoff.
    known: HashMap<(usize, Option<u32>), Option<usize>>,
    room: Room,
    faults: Vec<String>,
}

impl Reader<'_> {
    fn surface(&mut self, material: &Material, textures: &mut Vec<Texture>) -> Surface {
        let painted = material.extensions.as_ref().and_then(|of| of.others.get(BRUSH)?.get("guid")?.as_str());
        if let Some(brush) = painted.and_then(brush::find) {
            return Surface { brush: Some(brush), ..Surface::default() };
        }
        let pbr = &material.pbr_metallic_roughness;
        let extensions = material.extensions.as_ref();
        let old = extensions.and_then(|of| of.pbr_specular_glossiness.as_ref());
        let (base, info) = match old {
            Some(old) => (old.diffuse_factor.0, old.diffuse_texture.as_ref()),
            None => (pbr.base_color_factor.0, pbr.base_color_texture.as_ref()),
        };
        let strength =
            extensions.and_then(|of| of.emissive_strength.as_ref()).map_or(1.0, |of| of.emissive_strength.0);
        let cutoff = material.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
        let alpha = match material.alpha_mode {
            Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
            Checked::Valid(AlphaMode::Mask) => Alpha::Mask(cutoff),
            _ => Alpha::Opaque,
        };
        let mut of = Surface {
            base: Vec4::from(base),
            emission: Vec3::from(material.emissive_factor.0) * strength,
            alpha,
            own_brush: material.name.as_deref().filter(|_| self.file.is_ours()).and_then(brush::find),
            ..Surface::default()
        };
        let of_texels = matches!(alpha, Alpha::Mask(_)).then(|| cutoff / base[3].max(f32::MIN_POSITIVE));
        of.color = info.and_then(|info| self.texture(info, of_texels, textures));
        let lit = material.emissive_texture.as_ref().filter(|_| of.emission != Vec3::ZERO);
        of.glow = lit.and_then(|info| self.texture(info, None, textures));
        if lit.is_some() && of.glow.is_none() {
            of.emission = Vec3::ZERO;
        }
        if let Some(info) = info.or(lit) {
            self.place(info, &mut of);
        }
        of
    }

    /// Sets where a texture lies on the surface.
    fn place(&self, info: &Info, of: &mut Surface) {
        let transform = info.extensions.as_ref().and_then(|of| of.texture_transform.as_ref());
        of.coordinates = transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        if let Some(transform) = transform {
            let [offset, scale] = [transform.offset.0, transform.scale.0].map(Vec2::from);
            let (sin, cos) = (libm::sinf(transform.rotation.0), libm::cosf(transform.rotation.0));
            let turn = glam::Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            of.transform =
                Affine2::from_translation(offset) * Affine2::from_mat2(turn) * Affine2::from_scale(scale);
        }
        let sampler = self.file.root.textures.get(info.index.value()).and_then(|texture| texture.sampler);
        let sampler: Option<&Sampler> = sampler.and_then(|at| self.file.root.samplers.get(at.value()));
        let wrap = |mode: Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        of.wrap = sampler.map_or([Wrap::Repeat; 2], |sampler| [wrap(sampler.wrap_s), wrap(sampler.wrap_t)]);
    }

    fn texture(&mut self, info: &Info, cutoff: Option<f32>, textures: &mut Vec<Texture>) -> Option<usize> {
        let root = &self.file.root;
        let texture = root.textures.get(info.index.value())?;
        let own = texture.source.value();
        // An extension may name a picture that only it can decode, beside a usual one or without one.
        let others = texture.extensions.iter().flat_map(|of| of.others.values());
        let mut further = others.filter_map(|of| usize::try_from(of.get("source")?.as_u64()?).ok());
        let number = if own < root.images.len() { own } else { further.next()? };
        let key = (number, cutoff.map(f32::to_bits));
        if let Some(known) = self.known.get(&key) {
            return *known;
        }
        let image = root.images.get(number)?;
        let decoded = self.bytes(image).and_then(|bytes| Texture::decode(&bytes, cutoff, &mut self.room));
        let found = match decoded {
            Ok(texture) => {
                textures.push(texture);
                Some(textures.len() - 1)
            }
            Err(fault) => {
                if self.faults.len() < MOST_NAMED {
                    // The contents of a `data:` URI are no name.
                    let uri = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
                    let name = uri.or(image.name.as_deref()).map(|name| format!("{}: ", shown(name)));
                    self.faults.push(format!("{}{}", name.unwrap_or_default(), fault.found));
                }
                None
            }
        };
        self.known.insert(key, found);
        found
    }

    fn bytes(&self, image: &Image) -> Result<Vec<u8>, Mismatch> {
        if let Some(view) = image.buffer_view {
            return self.file.view(view.value()).map(<[u8]>::to_vec);
        }
        let uri = image.uri.as_deref().unwrap_or_default();
        match uri::data(uri) {
            Some(data) => data,
            None => {
                let path = uri::file(uri, self.input.path)?;
                let most = self.file.most_bytes;
                let read = read_beside(self.input.beside(&path), uri, &mut most.clone(), self.input.path);
                read.map_err(|error| Mismatch::new("", error.to_string()))?
            }
        }
    }
}
