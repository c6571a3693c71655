use osp_session::brush::texture::{
    noise::{noise, octaves, on_line, step},
    picture::Picture,
};

/// Factor from the slope of a height field to normals.
const STEEPNESS: f32 = 0.05;

/// A texel of a picture's normal map: red along the stroke, green across it, blue out of the surface. The value 0.5
/// stands for 0.
pub(super) fn texel(picture: Picture, u: f32, v: f32, side: usize) -> [f32; 4] {
    let by = 1.0 / side as f32;
    let [x, y] = match picture {
        Picture::Ink => ink(u, v),
        Picture::OilPaint => oil_paint(u, v),
        Picture::Hypercolor => hypercolor(u, v),
        _ => {
            let slope = |a: f32, b: f32| (a - b) / (2.0 * by) * STEEPNESS;
            let along = slope(height(picture, u + by, v), height(picture, u - by, v));
            let across = slope(height(picture, u, v + by), height(picture, u, v - by));
            let scale = 1.0 / (along * along + across * across + 1.0).sqrt();
            [-along * scale, -across * scale]
        }
    };
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    [0.5 + 0.5 * x, 0.5 + 0.5 * y, 0.5 + 0.5 * z, 1.0]
}

/// Height above the surface, 0 to about 1.
fn height(picture: Picture, u: f32, v: f32) -> f32 {
    // Rows of strokes are rounded like rods.
    let rod = |v: f32| {
        let aside = ((v * 4.0).rem_euclid(1.0) - 0.5) * 2.0;
        (1.0 - aside * aside).max(0.0).sqrt() * 0.5
    };
    match picture {
        Picture::WetPaint | Picture::Gouache => 0.8 * rod(v) + 0.1 * octaves(u, v, (8, 32), 2, 41),
        Picture::DryBrush | Picture::Felt => 0.3 * rod(v) + 0.35 * octaves(u, v, (4, 64), 2, 42),
        Picture::Leaves => 0.2 * octaves(u, v, (16, 16), 2, 44),
        // The plates of the paint are flat, with raised edges.
        Picture::ThickPaint => 0.25 * picture.texel(u, v.clamp(0.0, 1.0))[3] + 0.15 * ridges(u, v),
        Picture::Tape => {
            0.03 * ((u * 48.0 * std::f32::consts::TAU).sin() + (v * 24.0 * std::f32::consts::TAU).sin())
        }
        Picture::Fibres => 0.4 * octaves(u, v, (3, 16), 3, 35),
        _ => 0.25 * octaves(u, v, (16, 16), 3, 45),
    }
}

fn ridges(u: f32, v: f32) -> f32 {
    (1.0 - (octaves(u, v, (7, 7), 3, 46) - 0.5).abs() * 14.0).max(0.0)
}

/// The slope across a stroke of furrows of random depth along it. Its mean over a few furrows is 0.
fn furrows(u: f32, v: f32, cells: (i32, i32), seed: u32) -> f32 {
    let half = 0.5 / cells.1 as f32;
    octaves(u, v + half, cells, 2, seed) - octaves(u, v - half, cells, 2, seed)
}

/// Relief of ink: each of the picture's four rows is rounded across its width, with a few long hairs towards the end.
fn ink(u: f32, v: f32) -> [f32; 2] {
    let rows = v.clamp(0.0, 0.9999) * 4.0;
    let across = [
        [0.04, 0.13, 0.21, 0.29, 0.38, 0.46, 0.54, 0.63, 0.71, 0.79, 0.88, 0.96],
        [-0.14, -0.36, -0.4, -0.32, -0.21, -0.08, 0.06, 0.18, 0.26, 0.31, 0.33, 0.29],
    ];
    let along = [[0.0, 0.06, 0.14, 0.22, 0.3, 0.6, 1.0], [-0.24, -0.17, -0.05, -0.02, 0.0, 0.09, 0.0]];
    let hairs = furrows(u, v, (2, 64), 40) * (0.04 + 0.3 * step(0.6, 1.0, u));
    [on_line(&along, u), on_line(&across, rows.fract()) + hairs]
}

/// Relief of oil paint: flat, with raised edges and thin broken scratches. Most scratches are at the rims of the
/// picture's four rows and towards the end.
fn oil_paint(u: f32, v: f32) -> [f32; 2] {
    let row = (v.clamp(0.0, 0.9999) * 4.0).fract();
    let rim = step(0.12, 0.04, row) * -0.12 + step(0.88, 0.96, row) * 0.1;
    // The edge of the paint stands out.
    let half = 1.0 / 256.0;
    let alpha = |v: f32| Picture::OilPaint.texel(u, v)[3];
    let edge = 0.35 * (alpha(v - half) - alpha(v + half));
    let places = step(0.45, 0.6, noise(u, v, (9, 24), 47));
    let many = (0.3 + 0.7 * (step(0.25, 0.1, row) + step(0.75, 0.9, row)).max(step(0.55, 0.8, u))).min(1.0);
    [0.0, rim + edge + 0.6 * furrows(u, v, (12, 96), 42) * places * many]
}

/// Fine furrows along the stroke.
fn hypercolor(u: f32, v: f32) -> [f32; 2] {
    let rim = step(0.15, 0.04, v) * -0.23 + step(0.85, 0.96, v) * 0.26;
    let along = on_line(&[[0.0, 0.2, 0.8, 1.0], [-0.15, 0.0, 0.0, 0.05]], u);
    [along, (rim + 1.65 * furrows(u, v, (6, 96), 43)).clamp(-0.9, 0.9)]
}
