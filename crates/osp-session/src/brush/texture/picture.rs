//! The pictures that brushes use as textures.

use serde::Deserialize;

use super::shapes;

/// Defines [`Picture`]: each name, and the function of [`shapes`] that generates the picture.
macro_rules! pictures {
    ($($name:ident $shape:ident),* $(,)?) => {
        /// A generated picture that brushes use as a texture. `shapes.rs` describes and generates each picture.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
        pub enum Picture {
            $($name),*
        }

        impl Picture {
            /// All pictures; the index of a picture is its texture layer.
            pub const ALL: [Self; [$(stringify!($name)),*].len()] = [$(Self::$name),*];

            /// Red, green, blue and alpha at a position: `u` along the stroke, `v` across, each 0 to 1.
            pub fn texel(self, u: f32, v: f32) -> [f32; 4] {
                match self {
                    $(Self::$name => shapes::$shape(u, v).into_texel()),*
                }
            }
        }
    };
}

pictures! {
    Taper taper,
    Leaf leaf,
    Tent tent,
    SoftTip soft_tip,
    Ink ink,
    OilPaint oil_paint,
    WetPaint wet_paint,
    Gouache gouache,
    DryBrush dry_brush,
    VelvetInk velvet_ink,
    Graphite graphite,
    Felt felt,
    Taffy taffy,
    Hypercolor hypercolor,
    Light light,
    Smoke smoke,
    Ember ember,
    Dot dot,
    Bubble bubble,
    Stars stars,
    Snow snow,
    Splatter splatter,
    Bristles bristles,
    Leaves leaves,
    Disc disc,
    Fire fire,
    Paper paper,
    Tape tape,
    ThickPaint thick_paint,
    Charcoal charcoal,
    Grid grid,
    Feather feather,
    Deckled deckled,
    Leaky leaky,
    Wing wing,
    Streamer streamer,
    Blobs blobs,
    Curls curls,
    Drop drop,
    Triangle triangle,
    Fibres fibres,
}

/// A texel of a shape: white with an alpha, or a colour.
trait Shape {
    fn into_texel(self) -> [f32; 4];
}

impl Shape for f32 {
    fn into_texel(self) -> [f32; 4] {
        [1.0, 1.0, 1.0, self]
    }
}

impl Shape for [f32; 4] {
    fn into_texel(self) -> [f32; 4] {
        self
    }
}

impl Picture {
    /// Pictures with a relief, in the order of their normal maps. The texture layers of the normal maps follow those of
    /// the pictures.
    pub const WITH_RELIEF: [Self; 15] = [
        Self::Ink,
        Self::OilPaint,
        Self::WetPaint,
        Self::Gouache,
        Self::DryBrush,
        Self::Felt,
        Self::Hypercolor,
        Self::Leaves,
        Self::Paper,
        Self::Tape,
        Self::ThickPaint,
        Self::Charcoal,
        Self::Deckled,
        Self::Wing,
        Self::Fibres,
    ];

    pub fn layer(self) -> usize {
        self as usize
    }

    pub fn relief_layer(self) -> Option<usize> {
        Self::WITH_RELIEF.iter().position(|with| *with == self).map(|place| Self::ALL.len() + place)
    }
}
