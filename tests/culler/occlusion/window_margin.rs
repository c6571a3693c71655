//! The window of a view is wider than its screen, and its near plane farther, by more than a renderer's rounding.

use super::random::Random;
use glam::{DVec3, Vec3};
use osp::view::{Projection, View, WINDOW_MARGIN};

fn any_view(random: &mut Random) -> View {
    let mut tangents = |low: f64, high: f64| random.range(low, high) as f32;
    let (left, bottom) = (tangents(-2.0, 0.5), tangents(-2.0, 0.5));
    let projection = Projection {
        left,
        right: left + tangents(0.2, 3.0),
        bottom,
        top: bottom + tangents(0.2, 3.0),
        near_m: tangents(0.01, 1.0),
        far_m: 100.0,
    };
    let eye = random.in_cube().as_vec3() * 10.0;
    View::look_at(eye, eye + random.direction().as_vec3(), projection)
}

/// What the renderer's matrix, in `f32`, takes to be on the screen, up to its border, lies in the window; what it takes to
/// lie at the near plane is before the window's near plane, so that no occluder ends there.
#[test]
fn what_rounding_brings_onto_the_screen_is_in_the_window() {
    let (mut on_screen, mut at_near) = (0, 0);
    for n in 0..2000 {
        let mut random = Random::new(0x3A26 + n);
        let view = any_view(&mut random);
        let window = view.window().expect("a window");
        let clip_from_world = view.clip_from_world();
        for k in 0..16 {
            let border = |along: f64| match k % 4 {
                0 => (-1.0, along),
                1 => (1.0, along),
                2 => (along, -1.0),
                _ => (along, 1.0),
            };
            let (x, y) = border(random.range(-1.0, 1.0));
            let ray = view.ray_through(glam::Vec2::new(x as f32, y as f32));
            let point = view.eye_in_world + ray.direction * random.log_range(1.0, 50.0) as f32;
            let clip = clip_from_world * point.extend(1.0);
            let from_eye = window.from_eye(point);
            if clip.x.abs() <= clip.w && clip.y.abs() <= clip.w {
                on_screen += 1;
                let corners = window.corners();
                let sides: [DVec3; 4] =
                    std::array::from_fn(|i| corners[i].cross(corners[(i + 1) % 4]).normalize());
                for side in sides {
                    assert!(side.dot(from_eye) > 0.0, "{n}: {point} {clip}");
                }
            }
            let point = view.eye_in_world + ray.direction * view.projection.near_m;
            let clip = clip_from_world * point.extend(1.0);
            if clip.z >= clip.w {
                at_near += 1;
                assert!(
                    window.forward().dot(window.from_eye(point)) < window.near_m(),
                    "{n}: {point} {clip}"
                );
            }
        }
    }
    assert!(on_screen > 5000 && at_near > 5000, "{on_screen} {at_near}");
}

/// By no less than the margin says, and not by much more: the window stays one that culling is worth doing for.
#[test]
fn the_margin_is_a_ten_thousandth_of_the_screen() {
    let projection = Projection { left: -1.0, right: 2.0, bottom: -0.5, top: 1.0, near_m: 0.5, far_m: 9.0 };
    let view = View::look_at(Vec3::ZERO, Vec3::NEG_Z, projection);
    let window = view.window().expect("a window");
    assert!((window.near_m() - 0.5 * (1.0 + WINDOW_MARGIN)).abs() < 1.0e-12);
    let flat = window.corners().map(|c| c / -c.z);
    let (low, high) =
        flat.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), c| (l.min(*c), h.max(*c)));
    let half = 0.5 * WINDOW_MARGIN;
    for (found, wanted) in [
        (low.x, -1.0 - 3.0 * half),
        (high.x, 2.0 + 3.0 * half),
        (low.y, -0.5 - 1.5 * half),
        (high.y, 1.0 + 1.5 * half),
    ] {
        assert!((found - wanted).abs() < 1.0e-6, "{found} {wanted}");
    }
}
