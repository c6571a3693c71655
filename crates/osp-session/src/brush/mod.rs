//! The brushes of Tilt Brush and Open Brush. A brush determines the polygons of a stroke, and their appearance.
//!
//! The brushes are a table in the crate, `brushes.ron`; [`find`] looks a brush up by name or GUID.
//! [`stroke`](crate::stroke) makes polygons of samples.
//!
//! Depends on no other module.

mod at_rest;
mod surface;
mod table;
pub mod texture;

pub use at_rest::{BrushAtRest, Seen};
pub(crate) use surface::UV_PERIOD;
pub use surface::{Surface, UV_LIMIT};
pub use table::{all, find};
pub use texture::solid_across;

use serde::Deserialize;

use texture::picture::Picture;

/// Largest number of particles, or of squares of a spray, between two samples. With a larger number, longer jumps of
/// the hand would be drawn completely, but a malicious file could fill more memory.
pub const MAX_SCATTERED: u64 = 500;

/// Distance between two particles at a particle rate of 1 and a stroke scale of 1, metres.
pub const PARTICLE_STEP_M: f32 = 0.0025;

/// Mapping of textures along a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Uv {
    /// The coordinate goes from 0 to 1 over a segment.
    Stretched,
    /// The coordinate is proportional to the distance; the texture repeats.
    Distance,
    /// Each quad shows the whole texture.
    EachQuad,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Outline {
    /// The outline has the width of the samples.
    Plain,
    /// The outline is pointed at both ends.
    DoubleTaper,
    /// A lightning bolt: three noisy copies of the ribbon that meet at both ends.
    Bolt,
}

/// Change of a tube's radius along a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum TubeShape {
    /// The tube has the radius of the samples.
    Plain,
    /// The radius falls to zero at the end.
    Taper,
    /// The radius is half a sine wave.
    Sine,
    /// The radius has the shape of a comet: a head and a tail.
    Comet,
    /// The radius is half a sine wave, and the sides bend outwards.
    Petal,
    /// The radius rises over the first five control points, and falls over the last five.
    DoubleTaper,
}

/// The type of polygons that the samples of a stroke become.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum Family {
    /// A ribbon of quads, smoothed where they meet.
    QuadStrip(Uv),
    /// A ribbon whose quads share their edges.
    Welded {
        uv: Uv,
        shape: Outline,
    },
    Tube {
        /// Number of corners of the tube's cross-section.
        points: u8,
        /// Whether facets are shaded flat instead of smooth.
        hard_edges: bool,
        /// Whether cones close the tube's ends.
        caps: bool,
        /// Length of a cone divided by the radius.
        cap_aspect: f32,
        uv: Uv,
        shape: TubeShape,
        /// Factor of [`TubeShape::Taper`].
        taper: f32,
        /// Factor of the largest rotation of the frame between two segments. A larger rotation splits the tube; see
        /// `brushes.ron`.
        break_mult: f32,
    },
    Hull {
        faceted: bool,
    },
    /// The convex hulls of every five consecutive samples.
    WindowedHull,
    /// Squares that face the eye.
    Particles,
    /// Squares in the plane of the stroke, a spray.
    Spray {
        /// Whether squares are centred on each step, as in Open Brush's midpoint spray.
        midpoint: bool,
    },
    /// A tube with a rectangular cross-section.
    BoxSection,
    /// A ribbon with a raised middle.
    ThickRibbon,
    /// A square perpendicular to the stroke at each sample.
    Slices,
}

/// Blending of polygons with the background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Draw {
    /// The polygons hide the background.
    Opaque,
    /// The polygons hide the background where the alpha reaches [`Brush::cutoff`]. Elsewhere they are fully
    /// transparent.
    Cutout,
    /// The colour is added to that of the background.
    Additive,
    /// The colour is blended with that of the background by its alpha.
    Blended,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum Lighting {
    /// The surface has its own colour, independent of the light.
    Unlit,
    /// The surface is matte.
    Lambert,
    /// The surface is matte with highlights.
    Specular {
        /// Reflectance at normal incidence: red, green, blue.
        f0: (f32, f32, f32),
        /// Smoothness, 0 (rough) to 1 (smooth).
        gloss: f32,
    },
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
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

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Brush {
    #[serde(skip)]
    number: u16,
    pub name: String,
    /// The GUID that identifies the brush in files.
    pub guid: String,
    /// GUIDs of older brushes that this brush replaces.
    #[serde(default)]
    pub also: Vec<String>,
    /// Whether the original application offers the brush for drawing. Other brushes occur in old files only, or are
    /// experimental.
    #[serde(default)]
    pub is_offered: bool,
    /// Whether osp draws only a similar brush: it has no films of soap and no pictures of a headset's cameras.
    #[serde(default)]
    pub is_approximate: bool,
    pub family: Family,
    pub draw: Draw,
    pub lighting: Lighting,
    #[serde(default)]
    pub effect: Effect,
    /// The texture, a picture; `None` if the polygons have no texture.
    #[serde(default)]
    pub picture: Option<Picture>,
    /// Alpha below which a pixel is not drawn.
    #[serde(default)]
    pub cutoff: f32,
    /// Strength of emitted light, as an exponent.
    #[serde(default)]
    pub emission_gain: f32,
    /// Size at pressure 0 divided by the size at pressure 1.
    #[serde(default = "one")]
    pub pressure_size_min: f32,
    /// Random variation of sizes, as a fraction of the size.
    #[serde(default)]
    pub size_variance: f32,
    /// The smallest size that the application offers, decimetres. The spread of particles is proportional to it.
    #[serde(default)]
    pub size_min: f32,
    #[serde(default = "one")]
    pub opacity: f32,
    #[serde(default = "one")]
    pub pressure_opacity_min: f32,
    #[serde(default = "one")]
    pub pressure_opacity_max: f32,
    /// Number of squares of a spray per length of one brush size.
    #[serde(default = "one")]
    pub spray_rate: f32,
    /// Largest random rotation of a spray's squares in either direction, degrees.
    #[serde(default)]
    pub rotation_variance_degrees: f32,
    /// Largest random offset of a spray's squares, as a fraction of the size.
    #[serde(default)]
    pub position_variance: f32,
    /// Length and width of a spray's squares, as fractions of the size.
    #[serde(default = "both_one")]
    pub size_ratio: (f32, f32),
    /// Number of particles per 0.0025 m of the stroke.
    #[serde(default = "one")]
    pub particle_rate: f32,
    /// Spread of particles, in units of size per [`Brush::size_min`].
    #[serde(default)]
    pub particle_speed: f32,
    #[serde(default)]
    pub particle_rotation_range_degrees: f32,
    /// Whether each particle or square has a random alpha instead of the opacity.
    #[serde(default)]
    pub randomize_alpha: bool,
    /// Factor of the texture repetitions per distance.
    #[serde(default = "one")]
    pub tile_rate: f32,
    /// Number of rows of the texture atlas; a segment shows one row. For particles and sprays, a number above 1 means
    /// two by two cells.
    #[serde(default = "one_row")]
    pub atlas_rows: u8,
    /// Smallest spacing of control points of tubes and hulls, metres.
    #[serde(default)]
    pub min_length_m: f32,
    /// Whether pressure is smoothed over 0.1 m instead of 0.2 m.
    #[serde(default)]
    pub has_short_pressure_window: bool,
    /// Whether the ribbon's front faces the author while the ribbon is drawn.
    #[serde(default)]
    pub back_is_invisible: bool,
    /// Largest distance by which animation moves polygons out of their bounding boxes, metres.
    #[serde(default)]
    pub bounds_padding_m: f32,
    /// Whether the original application culls back faces.
    #[serde(default)]
    pub culls_back: bool,
    /// Whether a normal map gives the surface relief.
    #[serde(default)]
    pub has_normal_map: bool,
    /// Whether the alpha of all corners is 1.
    #[serde(default)]
    pub is_alpha_one: bool,
    #[serde(default)]
    pub is_animated: bool,
    /// Mean alpha or brightness of the original texture in eight steps along the stroke, from start to end.
    #[serde(default)]
    pub along: Option<[f32; 8]>,
    /// Mean alpha or brightness of the original texture in eight steps across the stroke.
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
    /// Index of the brush in [`all`].
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Full width at this pressure, divided by the width at pressure 1.
    pub fn size(&self, pressure: f32) -> f32 {
        self.pressure_size_min + (1.0 - self.pressure_size_min) * pressure.clamp(0.0, 1.0)
    }

    pub fn opacity(&self, pressure: f32) -> f32 {
        let (min, max) = (self.pressure_opacity_min, self.pressure_opacity_max);
        (self.opacity * (min + (max - min) * pressure)).clamp(0.0, 1.0)
    }
}
