//! The pictures that brushes paint with.

use super::shapes;
use crate::brush::Brush;

/// A picture that brushes paint with. It is generated: `brushes.ron` and the comment of each function describe the
/// shapes.
#[allow(missing_docs, reason = "each is told where it is made")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Picture {
    Taper,
    Leaf,
    Tent,
    SoftTip,
    Ink,
    OilPaint,
    WetPaint,
    Gouache,
    DryBrush,
    VelvetInk,
    Graphite,
    Felt,
    Taffy,
    Hypercolor,
    Light,
    Smoke,
    Ember,
    Dot,
    Bubble,
    Stars,
    Snow,
    Splatter,
    Bristles,
    Leaves,
    Disc,
    Fire,
    Paper,
    Tape,
    ThickPaint,
    Charcoal,
    Grid,
    Feather,
    Deckled,
    Leaky,
    Wing,
    Streamer,
    Blobs,
    Curls,
    Drop,
    Triangle,
    Fibres,
}

impl Picture {
    /// All of them, each at the place of its layer.
    pub const ALL: [Self; 41] = [
        Self::Taper,
        Self::Leaf,
        Self::Tent,
        Self::SoftTip,
        Self::Ink,
        Self::OilPaint,
        Self::WetPaint,
        Self::Gouache,
        Self::DryBrush,
        Self::VelvetInk,
        Self::Graphite,
        Self::Felt,
        Self::Taffy,
        Self::Hypercolor,
        Self::Light,
        Self::Smoke,
        Self::Ember,
        Self::Dot,
        Self::Bubble,
        Self::Stars,
        Self::Snow,
        Self::Splatter,
        Self::Bristles,
        Self::Leaves,
        Self::Disc,
        Self::Fire,
        Self::Paper,
        Self::Tape,
        Self::ThickPaint,
        Self::Charcoal,
        Self::Grid,
        Self::Feather,
        Self::Deckled,
        Self::Leaky,
        Self::Wing,
        Self::Streamer,
        Self::Blobs,
        Self::Curls,
        Self::Drop,
        Self::Triangle,
        Self::Fibres,
    ];

    /// Pictures with a relief, in the order of the layers that follow the pictures'.
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

    /// Its layer.
    pub fn layer(self) -> usize {
        self as usize
    }

    /// The layer of the normals of its relief.
    pub fn relief_layer(self) -> Option<usize> {
        Self::WITH_RELIEF.iter().position(|with| *with == self).map(|place| Self::ALL.len() + place)
    }
}

impl Picture {
    /// Picture of a brush; `None` for a plain one.
    pub fn of(brush: &Brush) -> Option<Self> {
        Some(match brush.name.as_str() {
            "TaperedMarker" | "TaperedFlat" | "TaperedHighlighter" | "TaperedMarker_Flat"
            | "TaperedMarkerGeo" => Self::Taper,
            "CelVinyl" | "TaperedHueShift" => Self::Leaf,
            "Marker" | "Highlighter" | "Marker Geometry" => Self::Tent,
            "SoftHighlighter" => Self::SoftTip,
            "Ink" | "InkGeometry" => Self::Ink,
            "OilPaint" | "Oil Paint (Geometry)" => Self::OilPaint,
            "WetPaint" | "WetPaintGeo" => Self::WetPaint,
            "Gouache" => Self::Gouache,
            "DryBrush" => Self::DryBrush,
            "VelvetInk" => Self::VelvetInk,
            "WigglyGraphite" => Self::Graphite,
            "Felt" => Self::Felt,
            "Taffy" => Self::Taffy,
            "Hypercolor" => Self::Hypercolor,
            "Light" | "Drafting" => Self::Light,
            "Smoke" => Self::Smoke,
            "Embers" => Self::Ember,
            "Dots" => Self::Dot,
            "Bubbles" | "Rising Bubbles" => Self::Bubble,
            "Stars" => Self::Stars,
            "Snow" => Self::Snow,
            "Splatter" => Self::Splatter,
            "CoarseBristles" => Self::Bristles,
            "Leaves" | "Leaves2" => Self::Leaves,
            "DotMarker" => Self::Disc,
            "Fire" | "Fire2" => Self::Fire,
            "Paper" | "PaperGeo" => Self::Paper,
            "DuctTape" | "DuctTapeGeometry" | "ThickGeometry" => Self::Tape,
            "ThickPaint" => Self::ThickPaint,
            "Charcoal" => Self::Charcoal,
            "HyperGrid" => Self::Grid,
            "Feather" => Self::Feather,
            "Watercolor Paper" | "WatercolorPaperGeo" | "Marbled Rainbow" => Self::Deckled,
            "LeakyPen" => Self::Leaky,
            "Lacewing" => Self::Wing,
            "Streamers" => Self::Streamer,
            "Comet" => Self::Blobs,
            "Wind" => Self::Curls,
            "Rain" | "Sparks" => Self::Drop,
            "WaveformParticles" => Self::Triangle,
            "Guts" | "Muscle" => Self::Fibres,
            _ => return None,
        })
    }

    /// Whether its smaller levels [keep the share of it](super::coverage) that is solid: soft smoke fades.
    pub fn keeps_coverage(self) -> bool {
        self != Self::Smoke
    }

    /// Red, green, blue, alpha at a place: `u` along the stroke, `v` across, 0 to 1 each.
    pub fn texel(self, u: f32, v: f32) -> [f32; 4] {
        let white = |alpha: f32| [1.0, 1.0, 1.0, alpha];
        match self {
            Self::Taper => white(shapes::taper(u, v)),
            Self::Leaf => white(shapes::leaf(u, v)),
            Self::Tent => white(1.0 - 1.9 * (v - 0.5).abs()),
            Self::SoftTip => white(shapes::soft_tip(u, v)),
            Self::Ink => white(shapes::ink(u, v)),
            Self::OilPaint => white(shapes::oil_paint(u, v)),
            Self::WetPaint => white(shapes::wet_paint(u, v)),
            Self::Gouache => white(shapes::gouache(u, v)),
            Self::DryBrush => white(shapes::dry_brush(u, v)),
            Self::VelvetInk => white(shapes::velvet_ink(u, v)),
            Self::Graphite => white(shapes::graphite(u, v)),
            Self::Felt => white(shapes::felt(u, v)),
            Self::Taffy => white(shapes::taffy(u, v)),
            Self::Hypercolor => shapes::hypercolor(u, v),
            Self::Light => white(shapes::light(u, v)),
            Self::Smoke => white(shapes::smoke(u, v)),
            Self::Ember => white(shapes::ember(u, v)),
            Self::Dot => shapes::dot(u, v),
            Self::Bubble => shapes::bubble(u, v),
            Self::Stars => white(shapes::stars(u, v)),
            Self::Snow => white(shapes::snow(u, v)),
            Self::Splatter => white(shapes::splatter(u, v)),
            Self::Bristles => white(shapes::bristles(u, v)),
            Self::Leaves => white(shapes::leaves(u, v)),
            Self::Disc => white(shapes::disc(u, v)),
            Self::Fire => shapes::fire(u, v),
            Self::Paper => white(shapes::paper(u, v)),
            Self::Tape => shapes::tape(u, v),
            Self::ThickPaint => white(shapes::thick_paint(u, v)),
            Self::Charcoal => white(shapes::charcoal(u, v)),
            Self::Grid => white(shapes::grid(u, v)),
            Self::Feather => white(shapes::feather(u, v)),
            Self::Deckled => white(shapes::deckled(u, v)),
            Self::Leaky => white(shapes::leaky(u, v)),
            Self::Wing => white(shapes::wing(u, v)),
            Self::Streamer => shapes::streamer(u, v),
            Self::Blobs => shapes::blobs(u, v),
            Self::Curls => white(shapes::curls(u, v)),
            Self::Drop => white(shapes::drop(u, v)),
            Self::Triangle => white(shapes::triangle(u, v)),
            Self::Fibres => shapes::fibres(u, v),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brush::{self, Draw};

    #[test]
    fn every_picture_has_the_layer_of_its_place() {
        for (place, picture) in Picture::ALL.iter().enumerate() {
            assert_eq!(picture.layer(), place);
        }
        for brush in brush::all().iter().filter(|brush| brush.has_normal_map) {
            let picture = Picture::of(brush);
            assert!(picture.is_none_or(|picture| picture.relief_layer().is_some()), "{} is flat", brush.name);
        }
    }

    /// The table has the solidity of the original in eight steps along and across.
    #[test]
    fn what_is_cut_out_has_the_shape_of_the_table() {
        const STEP: usize = 16;
        const SIDE: usize = 8 * STEP;
        let (mut sum, mut count) = (0.0, 0);
        for brush in brush::all().iter().filter(|brush| brush.draw == Draw::Cutout) {
            let (Some(picture), Some(along), Some(across)) = (Picture::of(brush), brush.along, brush.across)
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
