//! Rays through a window and windows of another shape, against the matrix that drawing goes by.

use glam::{Vec2, Vec3};
use osp::view::{Projection, View};

/// Windows of which no border is the opposite of another.
fn views() -> [View; 2] {
    let from = |eye, target, (left, right, bottom, top)| {
        View::look_at(eye, target, Projection { left, right, bottom, top, near_m: 0.1, far_m: 100.0 })
    };
    [
        from(Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 1.0), (-0.3, 0.9, -0.8, 0.25)),
        from(Vec3::new(-4.0, 0.0, 0.5), Vec3::ZERO, (-1.1, -0.2, 0.1, 0.7)),
    ]
}

#[test]
fn a_ray_goes_through_its_point_of_the_window() {
    for view in views() {
        for at in [(0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-0.4, -0.9), (0.7, 0.2)].map(Vec2::from) {
            let ray = view.ray_through(at);
            for along_m in [0.5, 3.0, 40.0] {
                let clip = view.clip_from_world() * (ray.origin + ray.direction * along_m).extend(1.0);
                let found = Vec2::new(clip.x, clip.y) / clip.w;
                assert!(found.distance(at) < 1.0e-4, "{at}: {found} at {along_m} m");
                assert!((clip.w - along_m).abs() < 1.0e-3, "{at}: {} for {along_m} m", clip.w);
            }
        }
    }
}

#[test]
fn another_shape_changes_the_width_only() {
    for view in views() {
        for aspect in [0.5, 1.0, 2.35] {
            let (before, after) = (view.projection, view.with_aspect(aspect).projection);
            let (width, height) = (after.right - after.left, after.top - after.bottom);
            assert_eq!((before.bottom, before.top), (after.bottom, after.top));
            assert!((width - aspect * height).abs() < 1.0e-6, "{width} by {height} is no {aspect}");
            // What is to the left of the direction of view stays the same share.
            let share = |of: Projection| of.left / (of.right - of.left);
            assert!((share(before) - share(after)).abs() < 1.0e-6);
        }
    }
}
