//! Strokes in the colours of those who drew them.

use super::scenes::{apply, drawer, gpu, picture, pixel, square, view_from};
use glam::Vec3;
use osp_render::Colors;
use osp_session::{
    recording::{Author, Event},
    scene::Scene,
};

const SIZE: (u32, u32) = (160, 120);
const WHITE: (f32, f32, f32, f32) = (1.0, 1.0, 1.0, 1.0);

/// Of a colour, which channels are more than half of its largest.
fn bright([r, g, b]: [u8; 3]) -> [bool; 3] {
    [r, g, b].map(|c| c > r.max(g).max(b) / 2)
}

#[test]
fn polygons_are_drawn_in_the_colours_of_their_authors_and_in_their_own_again() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new();
    let (red, green) = (Author(1), Author(2));
    let join =
        |author, color| Event::Join { t: 0.0, author, name: "somebody".to_owned(), color: Some(color) };
    let mut events = vec![join(red, (1.0, 0.0, 0.0)), join(green, (0.0, 1.0, 0.0))];
    for (by, x) in [(red, -0.5), (green, 0.5)] {
        let mut polygon = square(Vec3::new(x, 0.0, 0.0), 0.4, WHITE);
        if let Event::Polygon { author, .. } = &mut polygon {
            *author = by;
        }
        events.push(polygon);
    }
    let changes = apply(&mut scene, &events);
    let mut drawer = drawer(&gpu, SIZE);
    drawer.renderer.follow(&changes);
    let view = view_from(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO);
    let mut colors = |choice| {
        drawer.renderer.set_colors(choice);
        let image = picture(&mut drawer, &scene, &view);
        let at = |x: u32| bright(pixel(&image, x, SIZE.1 / 2));
        [at(50), at(110)]
    };
    let plain = [[true; 3]; 2];
    assert_eq!(colors(Colors::Own), plain);
    assert_eq!(colors(Colors::Authors), [[true, false, false], [false, true, false]]);
    assert_eq!(colors(Colors::Own), plain);
    // Who has said no colour gets one that its neighbours have not.
    let others: Vec<_> = (1..9).map(|n| Scene::new().author_color(Author(n))).collect();
    assert!((1..8).all(|n| others[..n].iter().all(|other| *other != others[n])));
}
