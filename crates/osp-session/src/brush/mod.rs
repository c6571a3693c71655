//! Brushes of Tilt Brush and Open Brush: the way from a stroke to polygons, and their look.
//!
//! The facts are a table in the crate, `brushes.ron`; [`find`] looks a brush up by name or GUID. [`stroke`](crate::stroke)
//! makes polygons of samples; the renderer draws their look.
//!
//! Depends on no other module.

mod surface;
mod table;
pub mod texture;

pub(crate) use surface::UV_PERIOD;
pub use surface::{Surface, UV_LIMIT};
pub use table::{all, find};
pub use texture::solid_across;

use serde::Deserialize;

use texture::picture::Picture;

/// Most particles, and most squares of a spray, on the way from a sample to the next. More: longer leaps of the hand are
/// drawn whole, and a made-up file of leaps fills more memory.
pub const MAX_SCATTERED: u64 = 500;

/// Way between two particles at a rate of 1 and a stroke's scale of 1, metres.
pub const PARTICLE_STEP_M: f32 = 0.0025;

/// Mapping of textures along a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Uv {
    /// From 0 to 1 over a segment.
    Stretched,
    /// By distance, repeated.
    Distance,
    /// The whole texture on each quad.
    EachQuad,
}

/// The outline of a welded ribbon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Outline {
    /// Width of the samples.
    Plain,
    /// Pointed at both ends.
    DoubleTaper,
    /// Three noisy copies, drawn together at both ends.
    Bolt,
}

/// Change of a tube's radius along a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum TubeShape {
    /// Radius of the samples.
    Plain,
    /// Falls to nothing at the end.
    Taper,
    /// Half a sine wave.
    Sine,
    /// A head and a tail.
    Comet,
    /// Half a sine wave, bent outwards.
    Petal,
    /// Rises and falls over five control points at each end.
    DoubleTaper,
}

/// Polygons that the samples of a stroke become.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum Family {
    /// A ribbon of quads, smoothed where they meet.
    QuadStrip(Uv),
    /// A ribbon whose quads share their edges.
    Welded {
        /// Mapping of textures along it.
        uv: Uv,
        /// Its outline.
        shape: Outline,
    },
    /// A tube around the samples.
    Tube {
        /// Corners of its section.
        points: u8,
        /// Flat facets instead of a round section.
        hard_edges: bool,
        /// Whether cones close its ends.
        caps: bool,
        /// Length of a cone as a part of the radius.
        cap_aspect: f32,
        /// Mapping of textures along it.
        uv: Uv,
        /// Change of its radius.
        shape: TubeShape,
        /// Factor of [`TubeShape::Taper`].
        taper: f32,
        /// Largest turn of a frame before the tube breaks; see `brushes.ron`.
        break_mult: f32,
    },
    /// The convex hull of all samples.
    Hull {
        /// Flat facets; smooth if not.
        faceted: bool,
    },
    /// The convex hulls of five samples in a row each.
    WindowedHull,
    /// Squares that face the eye.
    Particles,
    /// Squares in the plane of the stroke.
    Spray {
        /// Placed by the middle of each step.
        midpoint: bool,
    },
    /// A tube of rectangular section.
    BoxSection,
    /// A ribbon with a raised middle.
    ThickRibbon,
    /// A square across the stroke at each sample.
    Slices,
}

/// Blending of polygons with the background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Draw {
    /// They hide it.
    Opaque,
    /// They hide it where the texture is solid; elsewhere there is nothing.
    Cutout,
    /// Their light is added to it.
    Additive,
    /// They cover it in part.
    Blended,
}

/// Lighting of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum Lighting {
    /// Its own colour.
    Unlit,
    /// Matte.
    Lambert,
    /// Matte with highlights.
    Specular {
        /// Reflectance straight on: red, green, blue.
        f0: (f32, f32, f32),
        /// 0 rough to 1 smooth.
        gloss: f32,
    },
}

/// Additional effect of a brush's shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
#[expect(missing_docs, reason = "each is named after the brush, or the shader, that it is for")]
pub enum Effect {
    #[default]
    None,
    Bloom,
    Soft,
    Smoke,
    Snow,
    Stars,
    Embers,
    Bubbles,
    Dots,
    Fire,
    Streamers,
    Rainbow,
    Waveform,
    ChromaticWave,
    NeonPulse,
    Comet,
    Plasma,
    Electricity,
    HyperGrid,
    DiamondHull,
    Toon,
    Hypercolor,
    LightWire,
    Petal,
    Disco,
    WigglyGraphite,
}

/// A brush.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brush {
    /// Its place in [`all`].
    #[serde(skip)]
    number: u16,
    /// Its name, unique.
    pub name: String,
    /// The GUID that files name it by.
    pub guid: String,
    /// GUIDs of older brushes that this one replaces.
    #[serde(default)]
    pub also: Vec<String>,
    /// Whether the application it comes from offers it to draw with; the others are in old files only, or trials.
    #[serde(default)]
    pub is_offered: bool,
    /// Polygons that the samples become.
    pub family: Family,
    /// Blending with the background.
    pub draw: Draw,
    /// Its lighting.
    pub lighting: Lighting,
    /// Additional effect of its shader.
    #[serde(default)]
    pub effect: Effect,
    /// Picture that it paints with; a plain one has none.
    #[serde(default)]
    pub picture: Option<Picture>,
    /// Alpha below which nothing is drawn.
    #[serde(default)]
    pub cutoff: f32,
    /// Strength of emitted light, an exponent.
    #[serde(default)]
    pub emission_gain: f32,
    /// Part of the size that is left at pressure 0.
    #[serde(default = "one")]
    pub pressure_size_min: f32,
    /// Random variation of sizes, as a part of the size.
    #[serde(default)]
    pub size_variance: f32,
    /// The smallest size that the application offers, decimetres; particles spread in proportion to it.
    #[serde(default)]
    pub size_min: f32,
    /// Opacity.
    #[serde(default = "one")]
    pub opacity: f32,
    /// Factor of the opacity at pressure 0.
    #[serde(default = "one")]
    pub pressure_opacity_min: f32,
    /// Factor of the opacity at pressure 1.
    #[serde(default = "one")]
    pub pressure_opacity_max: f32,
    /// Squares of a spray in a length of one size.
    #[serde(default = "one")]
    pub spray_rate: f32,
    /// Largest random turn of a spray's squares to either side, degrees.
    #[serde(default)]
    pub rotation_variance_degrees: f32,
    /// Largest random shift of a spray's squares, as a part of the size.
    #[serde(default)]
    pub position_variance: f32,
    /// Length and width of a spray's squares, as parts of the size.
    #[serde(default = "both_one")]
    pub size_ratio: (f32, f32),
    /// Particles in a length of 0.0025 m.
    #[serde(default = "one")]
    pub particle_rate: f32,
    /// Spread of particles, in units of size per [`Brush::size_min`].
    #[serde(default)]
    pub particle_speed: f32,
    /// The range of angles that particles are turned by at random, degrees.
    #[serde(default)]
    pub particle_rotation_range_degrees: f32,
    /// Whether each particle or square has a random alpha, in place of an opacity.
    #[serde(default)]
    pub randomize_alpha: bool,
    /// Rate of textures by distance.
    #[serde(default = "one")]
    pub tile_rate: f32,
    /// Rows of the texture, of which a segment shows one; for particles and sprays, above 1 means two by two cells.
    #[serde(default = "one_row")]
    pub atlas_rows: u8,
    /// Least spacing of control points of tubes and hulls, metres.
    #[serde(default)]
    pub min_length_m: f32,
    /// Pressure is smoothed over 0.1 m instead of 0.2.
    #[serde(default)]
    pub has_short_pressure_window: bool,
    /// The ribbon always faces whoever draws it.
    #[serde(default)]
    pub back_is_invisible: bool,
    /// Largest distance by which animation moves polygons out of their boxes, metres.
    #[serde(default)]
    pub bounds_padding_m: f32,
    /// Back faces are not drawn by the original application.
    #[serde(default)]
    pub culls_back: bool,
    /// Whether relief is drawn by a map of normals.
    #[serde(default)]
    pub has_normal_map: bool,
    /// The alpha of all corners is 1.
    #[serde(default)]
    pub is_alpha_one: bool,
    /// Whether it moves with time.
    #[serde(default)]
    pub is_animated: bool,
    /// Solidity or brightness of the texture in eight steps from the start to the end of the stroke.
    #[serde(default)]
    pub along: Option<[f32; 8]>,
    /// The same from side to side.
    #[serde(default)]
    pub across: Option<[f32; 8]>,
}

fn one() -> f32 {
    1.0
}

fn both_one() -> (f32, f32) {
    (1.0, 1.0)
}

fn one_row() -> u8 {
    1
}

impl Brush {
    /// Its place in [`all`].
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Full width at this pressure, as a part of the width at pressure 1.
    pub fn size(&self, pressure: f32) -> f32 {
        self.pressure_size_min + (1.0 - self.pressure_size_min) * pressure.clamp(0.0, 1.0)
    }

    /// Opacity at this pressure, 0 to 1.
    pub fn opacity(&self, pressure: f32) -> f32 {
        let (min, max) = (self.pressure_opacity_min, self.pressure_opacity_max);
        (self.opacity * (min + (max - min) * pressure)).clamp(0.0, 1.0)
    }
}
