//! Light beyond its budget is drawn at half resolution: it looks almost the same, and is hidden where it was hidden.

use std::ops::Range;

use super::{
    painted::{line, lit, stroke},
    scenes::{all_ids, gpu, set, square, view_from},
};
use glam::Vec3;
use osp_render::{DrawTimes, Image, Layer, Offscreen};
use osp_session::{recording::Event, scene::Scene};
use osp_testkit::events::scene_of;

/// Odd, so that pixels at the border lie in pixels of light that the picture does not fill.
const SIZE: (u32, u32) = (321, 241);

/// Bands of light, three metres in front of the eye, with glass before them on the right, and a wall on the left.
fn bands(count: u32) -> Vec<Event> {
    let mut events = vec![
        square(Vec3::new(-1.3, 0.0, -2.0), 1.0, (0.4, 0.4, 0.4, 1.0)),
        square(Vec3::new(1.3, 0.0, -2.0), 1.0, (0.1, 0.5, 0.1, 0.5)),
    ];
    for number in 0..count {
        let part = number as f32 / count as f32;
        let middle = Vec3::new(part - 0.5, (part * 9.0).sin() * 0.5, -3.0 - part * 0.1);
        let points = line(Vec3::ZERO).map(|p| middle + Vec3::new(p.x * 3.0, p.x * part, 0.0));
        events.extend(stroke(number, "Highlighter", (0.06 * part, 0.05, 0.06, 1.0), 0.8, points));
    }
    events
}

fn picture(drawer: &mut Offscreen, scene: &Scene, has_budget: bool) -> (DrawTimes, Image) {
    drawer.set_light_budget_of(0, has_budget);
    let view = view_from(Vec3::ZERO, Vec3::NEG_Z);
    let times = drawer.draw(scene, &view, &[Layer::plain(&set(&all_ids(scene)))]).expect("a drawn frame");
    (times, drawer.image().expect("a picture"))
}

/// Mean and largest difference in columns of two pictures.
fn difference(a: &Image, b: &Image, columns: Range<u32>) -> (f64, u8) {
    let of_column = |(pixel, _): &(usize, _)| columns.contains(&(*pixel as u32 % SIZE.0));
    let pixels = a.rgba().chunks_exact(4).zip(b.rgba().chunks_exact(4)).enumerate().filter(of_column);
    let differences: Vec<u8> = pixels
        .flat_map(|(_, (a, b))| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).collect::<Vec<_>>())
        .collect();
    let sum: u64 = differences.iter().map(|&by| u64::from(by)).sum();
    (sum as f64 / differences.len() as f64, differences.into_iter().max().unwrap_or(0))
}

#[test]
fn light_within_its_budget_is_drawn_as_ever() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&bands(5));
    let mut drawer = lit(&gpu, SIZE);
    let (_, expected) = picture(&mut drawer, &scene, false);
    let (times, image) = picture(&mut drawer, &scene, true);
    assert_eq!((times.at_half_resolution, image.differing_pixels(&expected)), (0, 0));
}

#[test]
fn light_beyond_its_budget_is_drawn_at_half_resolution() {
    let Some(gpu) = gpu() else { return };
    let scene = scene_of(&bands(40));
    let mut drawer = lit(&gpu, SIZE);
    let (full, expected) = picture(&mut drawer, &scene, false);
    let (half, image) = picture(&mut drawer, &scene, true);
    assert_eq!((full.at_half_resolution, half.listed), (0, full.listed));
    assert!(half.at_half_resolution * 10 > half.listed, "{half:?}");
    assert!(image.differing_pixels(&expected) > 100, "the shaders run less often");
    let all = difference(&image, &expected, 0..SIZE.0);
    let wall = difference(&image, &expected, 0..SIZE.0 / 5);
    let glass = difference(&image, &expected, SIZE.0 * 3 / 4..SIZE.0);
    eprintln!("all {all:?}, wall {wall:?}, glass {glass:?}");
    assert!(all.0 < 0.5, "{all:?}");
    assert!(wall.1 <= 1, "the wall hides the light: {wall:?}");
    assert!(glass.0 < 0.5, "the glass is before the light: {glass:?}");
    let (_, again) = picture(&mut drawer, &scene, false);
    assert_eq!(again.differing_pixels(&expected), 0);
}
