use osp_session::brush::texture::{
    noise::{noise, octaves},
    picture::Picture,
};

/// How steep reliefs are.
const STEEPNESS: f32 = 0.05;

/// The normals of a picture's relief as colours: red along, green across, blue out of the surface, 0.5 for none.
pub(super) fn texel(picture: Picture, u: f32, v: f32, side: usize) -> [f32; 4] {
    let by = 1.0 / side as f32;
    let slope = |a: f32, b: f32| (a - b) / (2.0 * by) * STEEPNESS;
    let along = slope(height(picture, u + by, v), height(picture, u - by, v));
    let across = slope(height(picture, u, v + by), height(picture, u, v - by));
    let scale = 0.5 / (along * along + across * across + 1.0).sqrt();
    [0.5 - along * scale, 0.5 - across * scale, 0.5 + scale, 1.0]
}

/// Height over the surface, 0 to about 1.
fn height(picture: Picture, u: f32, v: f32) -> f32 {
    // Rows of strokes are rounded like rods.
    let rod = |v: f32| {
        let aside = ((v * 4.0).rem_euclid(1.0) - 0.5) * 2.0;
        (1.0 - aside * aside).max(0.0).sqrt() * 0.5
    };
    match picture {
        Picture::Ink => rod(v) + 0.08 * noise(u, v, (4, 64), 40),
        Picture::WetPaint | Picture::Gouache => 0.8 * rod(v) + 0.1 * octaves(u, v, (8, 32), 2, 41),
        Picture::OilPaint | Picture::DryBrush | Picture::Felt => {
            0.3 * rod(v) + 0.35 * octaves(u, v, (4, 64), 2, 42)
        }
        Picture::Hypercolor => 0.3 * octaves(u, v, (4, 40), 2, 43),
        Picture::Leaves => 0.2 * octaves(u, v, (16, 16), 2, 44),
        Picture::ThickPaint => 0.6 * octaves(u + 0.4 * v, v, (9, 13), 3, 24),
        Picture::Tape => {
            0.03 * ((u * 48.0 * std::f32::consts::TAU).sin() + (v * 24.0 * std::f32::consts::TAU).sin())
        }
        Picture::Fibres => 0.4 * octaves(u, v, (3, 16), 3, 35),
        _ => 0.25 * octaves(u, v, (16, 16), 3, 45),
    }
}
