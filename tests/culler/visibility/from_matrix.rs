//! A view from an engine's matrix sees all that the matrix shows, and hardly more.

use glam::{DMat4, DVec3, DVec4, Mat4, Vec2, Vec3};
use osp::{
    Depth,
    math::{Aabb, Ray},
    view::{Projection, View, ViewWindow},
};
use proptest::prelude::*;

use super::any_view;

/// Whether a matrix shows a point, by its own numbers.
fn shows(matrix: &Mat4, depth: Depth, point: Vec3, slack: f64) -> bool {
    let DVec4 { x, y, z, w } = matrix.as_dmat4() * point.as_dvec3().extend(1.0);
    let lowest = if depth == Depth::MinusOneToOne { -w } else { 0.0 };
    let more = slack * w.abs();
    w > 0.0 && x.abs() <= w + more && y.abs() <= w + more && z >= lowest - more && z <= w + more
}

fn along_ray(ray: &Ray, distance_m: f32) -> Vec3 {
    ray.origin + ray.direction * distance_m
}

/// An engine's matrices for a view: reversed and forward depth, without end, OpenGL's, and y downwards.
fn matrices(view: &View) -> Vec<(Mat4, Depth)> {
    let p = view.projection;
    let world_from_view =
        DMat4::from_rotation_translation(view.world_from_view.as_dquat(), view.eye_in_world.as_dvec3());
    let view_from_world = world_from_view.inverse();
    let [l, r, b, t, n, f] = [p.left, p.right, p.bottom, p.top, p.near_m, p.far_m].map(f64::from);
    let with = |z: DVec4, up: f64| {
        let rows = DMat4::from_cols(
            DVec4::new(2.0 / (r - l), 0.0, (r + l) / (r - l), 0.0),
            DVec4::new(0.0, up * 2.0 / (t - b), up * (t + b) / (t - b), 0.0),
            z,
            DVec4::new(0.0, 0.0, -1.0, 0.0),
        );
        (rows.transpose() * view_from_world).as_mat4()
    };
    let row = |z: f64, one: f64| DVec4::new(0.0, 0.0, z, one);
    vec![
        (view.clip_from_world(), Depth::OneToZero),
        (with(row(-f / (f - n), -n * f / (f - n)), 1.0), Depth::ZeroToOne),
        (with(row(0.0, n), 1.0), Depth::OneToZero),
        (with(row(-1.0, -n), -1.0), Depth::ZeroToOne),
        (with(row(-(f + n) / (f - n), -2.0 * n * f / (f - n)), 1.0), Depth::MinusOneToOne),
    ]
}

proptest! {
    #[test]
    fn all_that_a_matrix_shows_is_in_its_view(
        view in any_view(),
        points in proptest::collection::vec((-1.02f32..1.02, -1.02f32..1.02, 0.0f32..1.0), 64),
    ) {
        for (number, (matrix, depth)) in matrices(&view).into_iter().enumerate() {
            let found = View::from_matrix(&matrix, depth);
            let Some(found) = found else { panic!("matrix {number} of {view:?}") };
            prop_assert!((found.eye_in_world - view.eye_in_world).length() < 1.0e-4);
            let near_m = f64::from(found.projection.near_m) / f64::from(view.projection.near_m);
            prop_assert!((near_m - 1.0).abs() < 2.0e-3, "matrix {}: near {} times", number, near_m);
            let frustum = found.frustum();
            prop_assert!(found.window().is_some());
            for &(x, y, along) in &points {
                // Many on the borders, and at the near distance.
                let ray = view.ray_through(Vec2::new(x.clamp(-1.0, 1.0), y.clamp(-1.0, 1.0)));
                let distance_m = view.projection.near_m * 1.001 + along * along * 19.0;
                let point = along_ray(&ray, distance_m);
                if shows(&matrix, depth, point, 0.0) {
                    let is_in = frustum.may_see(&Aabb::from_points(&[point]));
                    prop_assert!(is_in, "matrix {}: {} is culled", number, point);
                }
                let point = along_ray(&view.ray_through(Vec2::new(x * 1.2, y * 1.2)), distance_m);
                if frustum.may_see(&Aabb::from_points(&[point])) {
                    let is_near = shows(&matrix, depth, point, 1.0e-2);
                    prop_assert!(is_near, "matrix {}: {} is not shown", number, point);
                }
            }
        }
    }
}

#[test]
fn far_from_the_origin_the_view_is_wider_or_there_is_none() {
    let projection = Projection::symmetric(60.0, 1.6, 0.1, 100.0);
    let view = View::look_at(Vec3::new(4096.1, 1.7, 2048.3), Vec3::new(4098.0, 1.0, 2040.0), projection);
    for (matrix, depth) in matrices(&view) {
        let found = View::from_matrix(&matrix, depth).expect("f32 holds the eye well enough");
        let frustum = found.frustum();
        for i in 0..2000 {
            let at = Vec2::new((i as f32 * 0.01).sin(), if i % 2 == 0 { 1.0 } else { -1.0 });
            let point = along_ray(&view.ray_through(at), 0.12 + 0.01 * (i % 50) as f32);
            if shows(&matrix, depth, point, 0.0) {
                assert!(frustum.may_see(&Aabb::from_points(&[point])), "{point} is culled");
            }
        }
        let closer = Projection { near_m: 1.0e-5, ..projection };
        let (matrix, depth) = matrices(&View { projection: closer, ..view })[2];
        assert_eq!(View::from_matrix(&matrix, depth), None);
    }
}

#[test]
fn what_is_no_perspective_gives_no_view() {
    let none = |matrix: Mat4| assert_eq!(View::from_matrix(&matrix, Depth::ZeroToOne), None, "{matrix}");
    none(Mat4::IDENTITY);
    none(Mat4::ZERO);
    none(Mat4::NAN);
    none(Mat4::from_scale(Vec3::splat(f32::INFINITY)));
    let sheared = [[1.0, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, -1.0], [0.0, 0.0, -0.1, 0.0]];
    none(Mat4::from_cols_array_2d(&sheared));
}

/// The matrix's own eye is not an `f32`: by `f64` numbers alone, all that it shows is in the view of the eye that is one.
#[test]
fn a_view_is_wider_by_what_its_eye_is_rounded() {
    let projections = [
        Projection::symmetric(60.0, 1.6, 0.05, 100.0),
        Projection { left: 0.2, right: 1.5, bottom: -0.9, top: -0.1, near_m: 0.02, far_m: 9.0 },
    ];
    let mut most_moved = 0.0f64;
    for (i, projection) in (0..40).flat_map(|i| projections.map(|projection| (i, projection))) {
        let eye = Vec3::new(900.1 + 3.7 * i as f32, 1.7, -611.3 * i as f32 / 40.0);
        let toward = eye + Vec3::new((i as f32).cos(), 0.3 * (2.0 * i as f32).sin(), (i as f32).sin());
        let matrix = View::look_at(eye, toward, projection).clip_from_world();
        let found = View::from_matrix(&matrix, Depth::ZeroToOne).expect("a perspective");
        let world_from_clip = matrix.as_dmat4().inverse();
        let view_from_world = found.world_from_view.as_dquat().inverse();
        let p = found.projection;
        let [left, right, bottom, top, near_m, far_m] =
            [p.left, p.right, p.bottom, p.top, p.near_m, p.far_m].map(f64::from);
        for corner in 0..8 {
            let of = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let point = world_from_clip.project_point3(DVec3::new(of(0), of(1), 0.5 + 0.5 * of(2)));
            let seen = view_from_world * (point - found.eye_in_world.as_dvec3());
            let (x, y, away_m) = (seen.x / -seen.z, seen.y / -seen.z, -seen.z);
            let context = format!("{i}, {projection:?}: ({x}, {y}) at {away_m} in {p:?}");
            assert!(x >= left && x <= right && y >= bottom && y <= top, "{context}");
            assert!(away_m >= near_m && away_m <= far_m, "{context}");
        }
        let matrix_eye = world_from_clip * DVec4::Z;
        let moved_m = (matrix_eye.truncate() / matrix_eye.w).distance(found.eye_in_world.as_dvec3());
        most_moved = most_moved.max(moved_m / f64::from(projection.near_m));
    }
    assert!(most_moved > 1.0e-3, "the eye is rounded by {most_moved} of the near distance");
}

/// `f64` holds an eye at 1e9 m to some 1e-7 m: more than a window allows where the near plane is at 0.1 m.
#[test]
fn a_window_has_the_matrixs_eye_or_there_is_none() {
    let projection = Projection::symmetric(60.0, 1.6, 0.1, 100.0);
    let view = View::look_at(Vec3::ZERO, Vec3::new(0.3, -0.2, 1.0), projection);
    let mut windows = Vec::new();
    for far in 0..16 {
        let eye = DVec3::new(0.7, -0.3, 0.9) * 10.0f64.powi(far);
        let matrix = view.clip_from_world().as_dmat4() * DMat4::from_translation(-eye);
        let window = ViewWindow::from_double_matrix(&matrix, Depth::ZeroToOne);
        if let Some(window) = &window {
            let moved_m = window.eye_in_world().distance(eye);
            assert!(moved_m < 1.0e-7 * 0.1, "10^{far} m: {moved_m} m");
        }
        windows.push(window.is_some());
    }
    assert!(windows[..5].iter().all(|is_some| *is_some), "{windows:?}");
    assert!(windows[9..].iter().all(|is_some| !is_some), "{windows:?}");
}
