//! Cameras of every kind of matrix see whatever the matrix shows, and little else.

use osp::{
    Camera, CameraError, Culler, Dense, Depth,
    glam::{DMat4, DQuat, DVec3, DVec4, EulerRot, Quat, Vec3},
    math::Aabb,
    view::{Projection, View},
};

use osp_testkit::boxes::Rng;

/// A perspective with these tangents from the axis to its borders; `far` may be infinite.
fn perspective([left, right, bottom, top]: [f64; 4], near: f64, far: f64, depth: Depth) -> DMat4 {
    let (at_near, at_far) = depths(depth);
    // Depth is a + b / distance.
    let b = (at_near - at_far) / (1.0 / near - if far.is_finite() { 1.0 / far } else { 0.0 });
    let a = at_near - b / near;
    DMat4::from_cols(
        DVec4::X * (2.0 / (right - left)),
        DVec4::Y * (2.0 / (top - bottom)),
        DVec4::new((right + left) / (right - left), (top + bottom) / (top - bottom), -a, -1.0),
        DVec4::new(0.0, 0.0, b, 0.0),
    )
}

fn parallel(half: [f64; 2], near: f64, far: f64, depth: Depth) -> DMat4 {
    let (at_near, at_far) = depths(depth);
    let slope = (at_far - at_near) / (far - near);
    DMat4::from_cols(
        DVec4::X / half[0],
        DVec4::Y / half[1],
        DVec4::Z * -slope,
        DVec4::new(0.0, 0.0, at_near - slope * near, 1.0),
    )
}

fn depths(depth: Depth) -> (f64, f64) {
    match depth {
        Depth::ZeroToOne => (0.0, 1.0),
        Depth::OneToZero => (1.0, 0.0),
        Depth::MinusOneToOne => (-1.0, 1.0),
    }
}

struct Case {
    name: String,
    clip_from_world: DMat4,
    depth: Depth,
    /// Distances along the view.
    near: f64,
    far: f64,
    is_parallel: bool,
    /// Of the eye from the origin, at most, metres.
    reach: f64,
}

impl Case {
    /// The depth at a distance along the view, if the near plane is square to it.
    fn depth_at(&self, distance: f64) -> f64 {
        let (at_near, at_far) = depths(self.depth);
        let inverse = |distance: f64| if self.is_parallel { distance } else { 1.0 / distance };
        let t = (inverse(distance) - inverse(self.near)) / (inverse(self.far) - inverse(self.near));
        at_near + (at_far - at_near) * t
    }
}

/// Every kind of projection, in every kind of depth, from here and from far away.
fn cases(rng: &mut Rng) -> Vec<Case> {
    let mut cases = Vec::new();
    for depth in [Depth::ZeroToOne, Depth::OneToZero, Depth::MinusOneToOne] {
        let on_axis = [-1.3, 1.3, -0.7, 0.7];
        let off_axis = [-1.3, 0.9, -0.4, 1.1];
        let mut mirrored = DMat4::IDENTITY;
        mirrored.x_axis.x = -1.0;
        let mut oblique = DMat4::IDENTITY;
        // Depth grows sideways, too: what a mirror of water does.
        oblique.x_axis.z = 0.2;
        let endless = f64::INFINITY;
        let projections = [
            ("finite", perspective(on_axis, 0.1, 200.0, depth), 0.1, 200.0),
            ("endless", perspective(on_axis, 0.1, endless, depth), 0.1, endless),
            ("off-axis", perspective(off_axis, 0.05, 1000.0, depth), 0.05, 1000.0),
            ("mirrored", mirrored * perspective(off_axis, 0.1, endless, depth), 0.1, endless),
            ("oblique", oblique * perspective(on_axis, 0.1, 50.0, depth), 0.1, 50.0),
            ("parallel", parallel([20.0, 15.0], 0.0, 100.0, depth), 0.0, 100.0),
            ("parallel from behind", parallel([20.0, 15.0], -50.0, 100.0, depth), -50.0, 100.0),
        ];
        for (name, clip_from_view, near, far) in projections {
            for reach in [1.0, 1.0e3, 1.0e6] {
                let mut any = || f64::from(rng.range(-1.0, 1.0));
                let eye = DVec3::new(any(), any(), any()) * reach;
                let turn = DQuat::from_euler(EulerRot::YXZ, any() * 3.0, any(), any());
                let view_from_world = DMat4::from_rotation_translation(turn, eye).inverse();
                let is_parallel = name.starts_with("parallel");
                let name = format!("{name}, {depth:?}, {reach} m from the origin");
                let clip_from_world = clip_from_view * view_from_world;
                cases.push(Case { name, clip_from_world, depth, near, far, is_parallel, reach });
            }
        }
    }
    cases
}

/// The smallest box around a point.
fn around(p: DVec3) -> [[f32; 3]; 2] {
    let below = |v: f64| if f64::from(v as f32) > v { (v as f32).next_down() } else { v as f32 };
    [p.to_array().map(below), p.to_array().map(|v| -below(-v))]
}

/// Whether all of a cube lies beyond one side of the screen, by a fiftieth.
fn is_beside(clip_from_world: &DMat4, middle: DVec3, half: f64) -> bool {
    let corners: [DVec4; 8] = std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { half } else { -half };
        *clip_from_world * (middle + DVec3::new(sign(0), sign(1), sign(2))).extend(1.0)
    });
    let sides: [fn(DVec4) -> f64; 4] = [|c| c.x, |c| -c.x, |c| c.y, |c| -c.y];
    sides.iter().any(|side| corners.iter().all(|&corner| side(corner) > 1.02 * corner.w))
}

#[test]
fn a_camera_sees_what_its_matrix_shows_and_little_else() {
    let mut rng = Rng(7);
    for case in cases(&mut rng) {
        // As it is, and as an engine that has `f32` passes it: taken as exact either way.
        for is_single in [false, true] {
            let single = case.clip_from_world.as_mat4();
            let (matrix, camera) = match is_single {
                true => (single.as_dmat4(), Camera::from_matrix(single.to_cols_array(), case.depth)),
                false => {
                    let matrix = case.clip_from_world;
                    (matrix, Camera::from_matrix(matrix.to_cols_array(), case.depth))
                }
            };
            let name = format!("{}, single: {is_single}", case.name);
            let camera = camera.unwrap_or_else(|e| panic!("{name}: {e}"));
            let world_from_clip = matrix.inverse();
            let mut culler = Culler::<Dense>::new();
            let (mut inside, mut outside) = (Vec::new(), Vec::new());
            for i in 0..800 {
                // About half of it outside.
                let (x, y) = (f64::from(rng.range(-1.7, 1.7)), f64::from(rng.range(-1.7, 1.7)));
                let distance = case.near + f64::from(rng.unit()) * (case.far.min(300.0) - case.near);
                let screen = DVec3::new(x, y, case.depth_at(distance));
                let p = world_from_clip.project_point3(screen);
                // A matrix in `f32` cuts a little off elsewhere.
                let clip = matrix * p.extend(1.0);
                let (low, high) = (depths(case.depth).0.min(depths(case.depth).1), 1.0);
                let is_between = (low..=high).contains(&(clip.z / clip.w)) && clip.w > 0.0;
                let half = p.abs().max_element() * f64::from(f32::EPSILON) * 8.0;
                if x.abs().max(y.abs()) < 1.0 - 1.0e-9 && is_between {
                    inside.push(Dense(i));
                } else if is_beside(&matrix, p, half) {
                    outside.push(Dense(i));
                }
                culler.set(Dense(i), around(p));
            }
            assert!(inside.len() > 50 && outside.len() > 50, "{name}: {} {}", inside.len(), outside.len());
            let frame = culler.cull(&[camera]);
            assert!(inside.iter().all(|&i| frame[0].contains(i)), "{name}");
            let wide = outside.iter().filter(|&&i| frame[0].contains(i)).count();
            assert_eq!(wide, 0, "{name}: of {}", outside.len());
        }
    }
}

/// A view so long, or an eye so far away, that `f32` hardly tells its planes: in `f64` they are all there.
#[test]
fn no_plane_of_a_long_view_is_lost() {
    let mut rng = Rng(17);
    let ends = [(0.1, 3.0e4), (0.1, 7.0e4), (0.1, 1.0e7), (1.0e-3, 1.0e5), (1.0e-3, f64::INFINITY)];
    for (i, (near, far)) in (0..40).flat_map(|i| ends.map(|ends| (i, ends))) {
        let depth = [Depth::ZeroToOne, Depth::OneToZero, Depth::MinusOneToOne][i % 3];
        let mut any = || f64::from(rng.range(-1.0, 1.0));
        let eye = DVec3::new(any(), any(), any()) * if far.is_finite() { 1.0e3 } else { 1.0e7 };
        let turn = DQuat::from_euler(EulerRot::YXZ, any() * 3.0, any(), any());
        let view_from_world = DMat4::from_rotation_translation(turn, eye).inverse();
        let matrix = perspective([-1.0, 1.0, -1.0, 1.0], near, far, depth) * view_from_world;
        let camera = Camera::from_matrix(matrix.to_cols_array(), depth).expect("a camera");
        let sees = |x: f64, y: f64, distance: f64| {
            let [min, max] = around(eye + turn * (DVec3::new(x, y, -1.0) * distance));
            camera.frustum().may_see(&Aabb::new(min.into(), max.into()))
        };
        let middle = if far.is_finite() { far * 0.9 } else { 1.0e7 };
        for (x, y) in [(0.0, 0.0), (0.99, 0.0), (-0.99, 0.0), (0.0, 0.99), (0.0, -0.99)] {
            assert!(sees(x, y, middle), "{near} to {far}, {depth:?}");
            let is_beside = (x, y) != (0.0, 0.0);
            assert!(!is_beside || !sees(x * 1.02, y * 1.02, middle), "{near} to {far}, {depth:?}: {x} {y}");
        }
        assert!(far.is_infinite() || !sees(0.0, 0.0, far * 1.02), "{near} to {far}, {depth:?}");
    }
}

/// The ends of a parallel camera, such as a sun, may be as far away as anything.
#[test]
fn a_parallel_camera_draws_the_same_however_far_away_its_ends_are() {
    let mut rng = Rng(19);
    let mut culler = Culler::<Dense>::new();
    let world = Aabb::cube(Vec3::ZERO, 60.0);
    let boxes: Vec<Aabb> = (0..20_000).map(|_| Aabb::cube(rng.point(&world), 0.6 * rng.unit())).collect();
    for (number, bounds) in (0..).zip(&boxes) {
        culler.set(Dense(number), [bounds.min, bounds.max]);
    }
    let eye = DMat4::from_rotation_translation(DQuat::from_rotation_y(0.3), DVec3::new(13.0, 3.0, 40.0));
    for (near, far) in [(0.1, 100.0), (0.1, 1.0e6), (0.1, 1.0e9), (-1.0e6, 1.0e6), (-1.0e5, 1.0e9)] {
        let exact = parallel([10.0, 7.0], near, far, Depth::ZeroToOne) * eye.inverse();
        for matrix in [exact, exact.as_mat4().as_dmat4()] {
            let camera = Camera::from_matrix(matrix.to_cols_array(), Depth::ZeroToOne).expect("a camera");
            let is_outside = |bounds: &Aabb| {
                let corners = bounds.corners().map(|corner| matrix * corner.as_dvec3().extend(1.0));
                let beyond = |side: fn(DVec4) -> f64| corners.iter().all(|&c| side(c) > c.w);
                let beside = beyond(|c| c.x) || beyond(|c| -c.x) || beyond(|c| c.y) || beyond(|c| -c.y);
                beside || beyond(|c| c.z) || beyond(|c| c.w - c.z)
            };
            let expected: Vec<u32> =
                (0..).zip(&boxes).filter(|(_, bounds)| !is_outside(bounds)).map(|(i, _)| i).collect();
            let seen: Vec<u32> = culler.cull(&[camera])[0].iter().map(|Dense(number)| number).collect();
            assert_eq!(seen, expected, "{near} to {far}");
            let hidden =
                culler.are_hidden(&camera, &boxes.iter().map(|b| [b.min, b.max]).collect::<Vec<_>>());
            assert!(boxes.iter().zip(hidden).all(|(bounds, is_hidden)| is_hidden == is_outside(bounds)));
        }
    }
}

/// Beyond 2.4e38 m the sums of a box test may overflow.
#[test]
fn an_eye_as_far_away_as_numbers_go_sees_what_is_before_it() {
    let mut rng = Rng(23);
    for size in [1.0e30_f32, 8.0e37, 1.0e38, 2.5e38, 3.3e38] {
        for _ in 0..60 {
            let mut any = || rng.range(-1.0, 1.0);
            let (eye, turn) =
                (Vec3::new(any(), any(), any()) * size, Quat::from_xyzw(any(), any(), any(), 1.0));
            let projection = Projection {
                left: -1.0,
                right: 1.0,
                bottom: -1.0,
                top: 1.0,
                near_m: size * 1.0e-5,
                far_m: f32::MAX,
            };
            let view = View { eye_in_world: eye, world_from_view: turn.normalize(), projection };
            let mut culler = Culler::<Dense>::new();
            for number in 0..60 {
                let distance = f64::from(size * rng.range(0.01, 1.0));
                let [x, y] = [(); 2].map(|()| f64::from(rng.range(-0.9, 0.9)));
                let by = view.world_from_view.as_dquat() * (DVec3::new(x, y, -1.0) * distance);
                let point = (eye.as_dvec3() + by).as_vec3();
                culler.set(Dense(number), [point, point]);
            }
            // What lies beyond the largest number is refused.
            let count = culler.len();
            assert_eq!(culler.cull(&[Camera::from(&view)])[0].len(), count, "{view:?}");
        }
    }
}

#[test]
fn a_ray_goes_from_the_near_plane_to_what_lies_behind_its_place_on_the_screen() {
    let mut rng = Rng(11);
    for case in cases(&mut rng) {
        let Case { name, clip_from_world, near, far, reach, .. } = &case;
        let camera = Camera::from_matrix(clip_from_world.to_cols_array(), case.depth).expect("a camera");
        for _ in 0..20 {
            let (x, y) = (rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            let ray = camera.ray(x, y);
            assert!((ray.direction.length() - 1.0).abs() < 1.0e-6, "{name}");
            let at = |distance: f64| {
                let screen = DVec3::new(x.into(), y.into(), case.depth_at(distance));
                clip_from_world.inverse().project_point3(screen)
            };
            // An oblique far plane may lie behind the eye.
            let along = at(far.min(near.max(0.1) * 1.5)) - at(*near);
            let rounding = (reach + 50.0) * f64::from(f32::EPSILON);
            assert!(ray.origin.as_dvec3().distance(at(*near)) <= rounding, "{name}");
            assert!(along.normalize().dot(ray.direction.as_dvec3()) > 0.999_999, "{name}");
        }
    }
}

#[test]
fn a_perspective_by_rows_is_refused_and_a_level_mirror_is_not() {
    let is_refused = |matrix: DMat4, depth| {
        let columns = matrix.to_cols_array();
        let single = columns.map(|number| number as f32);
        let results = [Camera::from_matrix(columns, depth), Camera::from_matrix(single, depth)];
        results.iter().all(|result| *result == Err(CameraError::Transposed))
    };
    for case in cases(&mut Rng(13)) {
        let is_plain = !case.is_parallel && !case.name.starts_with("oblique");
        if is_plain && case.reach < 1.0e6 {
            assert!(is_refused(case.clip_from_world.transpose(), case.depth), "{}", case.name);
        }
    }
    // Not turned, so the transpose is not sheared.
    let endless = perspective([-1.0, 1.0, -1.0, 1.0], 0.1, f64::INFINITY, Depth::OneToZero);
    assert!(is_refused(endless.transpose(), Depth::OneToZero));
    let error =
        Camera::from_matrix(endless.transpose().to_cols_array(), Depth::OneToZero).expect_err("by rows");
    assert!(error.to_string().contains("column by column"), "{error}");
    // What an eye 1 m under water sees above it. The near plane is the water, which the middle of the screen misses.
    let mut mirror = endless;
    (mirror.y_axis.z, mirror.z_axis.z, mirror.w_axis.z) = (1.0, 0.0, -1.0);
    for turn in [DQuat::IDENTITY, DQuat::from_rotation_y(0.7)] {
        let eye = DMat4::from_rotation_translation(turn, DVec3::NEG_Y);
        let camera = Camera::from_matrix((mirror * eye.inverse()).to_cols_array(), Depth::ZeroToOne);
        assert!(camera.is_ok(), "{camera:?}");
    }
}

#[test]
fn what_is_no_camera_says_why() {
    let mut numbers = DMat4::IDENTITY.to_cols_array();
    numbers[6] = f64::NAN;
    let error = Camera::from_matrix(numbers, Depth::ZeroToOne).expect_err("a number is none");
    assert_eq!(error.to_string(), "clip_from_world: expected finite numbers, found NaN in column 1, row 2");
    assert_eq!(Camera::from_matrix([0.0_f32; 16], Depth::ZeroToOne), Err(CameraError::Singular));
    let flat = DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)).to_cols_array();
    assert_eq!(Camera::from_matrix(flat, Depth::OneToZero), Err(CameraError::Singular));
}
