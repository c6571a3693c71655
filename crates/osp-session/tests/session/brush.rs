//! Brushes: their table, their surfaces, and their textures.

use glam::{Vec2, Vec3};
use osp_session::brush::{
    Brush, BrushAtRest, Draw, Effect, Seen, Surface, UV_LIMIT, all, find, solid_across, texture::SIDE,
};

#[test]
fn every_brush_is_found_by_its_name_and_its_guids() {
    assert!(all().len() > 100);
    for (i, brush) in all().iter().enumerate() {
        for name in [&brush.name, &brush.guid].into_iter().chain(&brush.also) {
            assert_eq!(find(name).map(Brush::number), Some(i as u16), "{name}");
        }
    }
    assert_eq!(find("no such brush"), None);
}

#[test]
fn sizes_and_opacities_follow_the_pressure() {
    let ink = find("Ink").expect("a brush of the table");
    assert_eq!(ink.size(1.0), 1.0);
    assert_eq!(ink.size(0.0), ink.pressure_size_min);
    assert!(all().iter().all(|brush| (0.0..=1.0).contains(&brush.opacity(0.3)) && brush.size(-1.0) >= 0.0));
}

#[test]
fn what_is_packed_comes_back() {
    let normals = [Vec3::X, Vec3::new(1.0, -2.0, -3.0), Vec3::NEG_Z, Vec3::new(-0.2, 0.1, 0.9)];
    let uv = [Vec2::ZERO, Vec2::new(0.25, 1.0), Vec2::new(7.5, -3.0), Vec2::new(100.0, 0.0)];
    let surface = Surface::smooth(normals, uv, [0.0, 0.5, 1.0, 2.0]);
    for (i, normal) in normals.iter().enumerate() {
        let unpacked = surface.normal(i).expect("smooth");
        assert!(unpacked.distance(normal.normalize()) < 1.0e-4, "{normal} became {unpacked}");
        assert!(surface.uv(i).distance(uv[i].min(Vec2::splat(UV_LIMIT))) < 5.0e-4);
    }
    assert_eq!([0, 1, 2, 3].map(|i| (surface.alpha(i) * 255.0).round()), [0.0, 128.0, 255.0, 255.0]);
    let turned = surface.with_corners([1, 2, 3, 3]);
    assert_eq!((turned.uv(0), turned.normal(2)), (surface.uv(1), surface.normal(3)));
    let facing = Surface::facing(1.25, uv, 0.5);
    assert!(facing.is_facing() && facing.normal(0).is_none());
    assert_eq!(facing.with_corners([0, 1, 2, 2]).roll_radians(), 1.25);
    assert_eq!(Surface::PLAIN.normal(0), None);
}

const SEEN: Seen = Seen { view_cosine: 1.0, light: Vec3::ONE };

fn at_rest(name: &str) -> BrushAtRest {
    BrushAtRest::of(find(name).expect("a brush of the table"))
}

#[test]
fn every_number_is_one_of_a_picture() {
    for brush in all() {
        let at_rest = BrushAtRest::of(brush);
        let side = at_rest.side();
        let numbers = (0..side * side).flat_map(|i| at_rest.texel(i % side, i / side));
        let paint = [0.0, 0.3, 1.0]
            .map(|own| at_rest.paint(Vec3::new(1.0, 0.4, 0.0), own, Vec2::new(3.0, 0.5), SEEN));
        let is_good = |n: f32| (0.0..=1.0).contains(&n);
        assert!(numbers.chain(paint.into_iter().flatten()).all(is_good), "{}", brush.name);
    }
}

#[test]
fn dark_light_covers_nothing() {
    let is_of_soap = |brush: &Brush| brush.effect == Effect::DiamondHull;
    for brush in all().iter().filter(|brush| brush.draw == Draw::Additive && !is_of_soap(brush)) {
        let black = BrushAtRest::of(brush).paint(Vec3::ZERO, 1.0, Vec2::splat(0.5), SEEN);
        assert_eq!(black[3], 0.0, "{} in black", brush.name);
    }
    let alpha = |view_cosine: f32| {
        at_rest("DiamondHull").paint(Vec3::ONE, 1.0, Vec2::ZERO, Seen { view_cosine, ..SEEN })[3]
    };
    assert!(alpha(1.0) < 0.3 && alpha(0.5) < 0.5 && alpha(0.01) > 0.9);
}

#[test]
fn strokes_of_one_brush_keep_their_colours() {
    let red = at_rest("NeonPulse").paint(Vec3::new(1.0, 0.1, 0.1), 1.0, Vec2::ZERO, SEEN);
    let blue = at_rest("NeonPulse").paint(Vec3::new(0.1, 0.1, 1.0), 1.0, Vec2::ZERO, SEEN);
    assert!(red[0] > red[2] && blue[2] > blue[0], "{red:?} {blue:?}");
}

#[test]
fn brushes_with_relief_have_a_picture_with_relief() {
    for brush in all().iter().filter(|brush| brush.has_normal_map) {
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
    for brush in all().iter().filter(|brush| brush.draw == Draw::Cutout) {
        let (Some(picture), Some(along), Some(across)) = (brush.picture, brush.along, brush.across) else {
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

#[test]
fn a_marker_is_solid_in_its_middle_and_a_taper_not_at_its_tip() {
    let find = |name| find(name).expect("a brush of the table");
    let (low, high) = solid_across(find("Marker"), (0.2, 0.4), (0.0, 1.0)).expect("a solid middle");
    assert!(low < 0.2 && high > 0.8 && low > 0.0 && high < 1.0, "{low} to {high}");
    let taper = find("TaperedMarker");
    let widest = solid_across(taper, (0.1, 0.2), (0.0, 1.0)).map_or(0.0, |(low, high)| high - low);
    let thin = solid_across(taper, (0.7, 0.8), (0.0, 1.0)).map_or(0.0, |(low, high)| high - low);
    assert!(widest > 0.7 && thin < 0.6, "{widest}, {thin}");
    assert_eq!(solid_across(taper, (0.9, 1.0), (0.0, 1.0)), None);
    assert_eq!(solid_across(find("Light"), (0.4, 0.5), (0.0, 1.0)), None, "light hides nothing");
}

#[test]
fn what_is_solid_has_no_hole() {
    for brush in all().iter().filter(|brush| brush.draw == Draw::Cutout) {
        let Some(picture) = brush.picture else { continue };
        for i in 0..32 {
            let u = (i as f32 / 32.0, (i + 1) as f32 / 32.0);
            let Some((low, high)) = solid_across(brush, u, (0.0, 1.0)) else { continue };
            for k in 0..=20 {
                let (u, v) = (u.0 + (u.1 - u.0) * 0.37, low + (high - low) * k as f32 / 20.0);
                let texel = |x: f32| ((x * SIDE as f32).floor().min(127.0) + 0.5) / SIDE as f32;
                let alpha = picture.texel(texel(u), texel(v))[3];
                assert!(alpha > brush.cutoff, "{} at {u}, {v}: {alpha}", brush.name);
            }
        }
    }
}
