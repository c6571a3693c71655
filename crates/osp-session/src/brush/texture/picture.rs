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

#[cfg(test)]
mod tests {
    use crate::brush::{self, Draw};

    #[test]
    fn brushes_with_relief_have_a_picture_with_relief() {
        for brush in brush::all().iter().filter(|brush| brush.has_normal_map) {
            let picture = brush.picture;
            assert!(picture.is_none_or(|picture| picture.relief_layer().is_some()), "{} is flat", brush.name);
        }
    }

    /// `brushes.ron` has the mean alpha of the original textures in eight steps along and across.
    #[test]
    fn what_is_cut_out_has_the_shape_of_the_table() {
        const STEP: usize = 16;
        const SIDE: usize = 8 * STEP;
        let (mut sum, mut count) = (0.0, 0);
        for brush in brush::all().iter().filter(|brush| brush.draw == Draw::Cutout) {
            let (Some(picture), Some(along), Some(across)) = (brush.picture, brush.along, brush.across)
            else {
                continue;
            };
            let mut found = [[0.0f32; 8]; 2];
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let [u, v] = [x, y].map(|i| (i as f32 + 0.5) / SIDE as f32);
                    if picture.texel(u, v)[3] >= brush.cutoff {
                        found[0][x / STEP] += 1.0 / (STEP * SIDE) as f32;
                        found[1][y / STEP] += 1.0 / (STEP * SIDE) as f32;
                    }
                }
            }
            let mean = |values: &[f32; 8]| values.iter().sum::<f32>() / 8.0;
            let off = (mean(&found[0]) - mean(&along)).abs();
            assert!(off < 0.12, "{}: {:.2} is solid, not {:.2}", brush.name, mean(&found[0]), mean(&along));
            for (found, known) in found.iter().zip([along, across]) {
                let off = found.iter().zip(known).map(|(a, b)| (a - b).abs()).sum::<f32>() / 8.0;
                assert!(off < 0.2, "{}: {found:.2?}, not {known:?}", brush.name);
                sum += off;
                count += 1;
            }
        }
        assert!(count > 40 && sum / count as f32 <= 0.1, "{count}: {} on average", sum / count as f32);
    }
}
