//! A view from an engine's matrix sees all that the matrix shows, and hardly more.

use glam::{DMat4, DVec4, Mat4, Vec2, Vec3};
use osp::{
    math::{Aabb, Ray},
    view::{ClipDepth, Projection, View},
};
use proptest::prelude::*;

use crate::any_view;

/// Whether a matrix shows a point, by its own numbers.
fn shows(matrix: &Mat4, depth: ClipDepth, point: Vec3, slack: f64) -> bool {
    let DVec4 { x, y, z, w } = matrix.as_dmat4() * point.as_dvec3().extend(1.0);
    let lowest = if depth == ClipDepth::MinusOneToOne { -w } else { 0.0 };
    let more = slack * w.abs();
    w > 0.0 && x.abs() <= w + more && y.abs() <= w + more && z >= lowest - more && z <= w + more
}

fn along_ray(ray: &Ray, distance_m: f32) -> Vec3 {
    ray.origin + ray.direction * distance_m
}

/// An engine's matrices for a view: reversed and forward depth, without end, OpenGL's, and y downwards.
fn matrices(view: &View) -> Vec<(Mat4, ClipDepth)> {
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
        (view.clip_from_world(), ClipDepth::ZeroToOne),
        (with(row(-f / (f - n), -n * f / (f - n)), 1.0), ClipDepth::ZeroToOne),
        (with(row(0.0, n), 1.0), ClipDepth::ZeroToOne),
        (with(row(-1.0, -n), -1.0), ClipDepth::ZeroToOne),
        (with(row(-(f + n) / (f - n), -2.0 * n * f / (f - n)), 1.0), ClipDepth::MinusOneToOne),
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
    let none = |matrix: Mat4| assert_eq!(View::from_matrix(&matrix, ClipDepth::ZeroToOne), None, "{matrix}");
    none(Mat4::IDENTITY);
    none(Mat4::ZERO);
    none(Mat4::NAN);
    none(Mat4::from_scale(Vec3::splat(f32::INFINITY)));
    let sheared = [[1.0, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, -1.0], [0.0, 0.0, -0.1, 0.0]];
    none(Mat4::from_cols_array_2d(&sheared));
}
