//! Frusta far from the origin, where `f32` hardly tells the eye from what it looks at: nothing in view is culled, and
//! little else is kept. Judged in `f64`, relative to the eye, as things are drawn.

use glam::{Affine3A, DMat3, DVec3, DVec4, EulerRot, Mat4, Quat, Vec3, Vec4};
use osp::{
    math::{Aabb, Containment, Frustum, Obb, Plane, Sphere, rotate},
    polygon::ConvexPolygon,
    view::{Projection, View},
};
use osp_lab::Reach;
use osp_testkit::Random;

/// How far from the origin, metres.
const PLACES_M: [f32; 9] = [0.0, 1.0, 30.0, 1.0e3, 3.0e3, 1.0e4, 1.0e5, 1.0e6, 1.0e9];

/// A turn about three axes.
pub(crate) fn turn(random: &mut Random) -> Quat {
    let [x, y, z] = [(); 3].map(|()| random.range(-3.2, 3.2) as f32);
    Quat::from_euler(EulerRot::XYZ, x, y, z)
}

fn any_view(random: &mut Random, place_m: f32) -> View {
    let at = random.in_cube() * f64::from(place_m);
    let (left, bottom) = (random.range(-2.0, 0.5) as f32, random.range(-2.0, 0.5) as f32);
    let near_m = random.log_range(0.001, 0.2) as f32;
    let projection = Projection {
        left,
        right: left + random.log_range(0.01, 3.0) as f32,
        bottom,
        top: bottom + random.log_range(0.01, 3.0) as f32,
        near_m,
        far_m: near_m + random.log_range(1.0, 3000.0) as f32,
    };
    View { eye_in_world: at.as_vec3(), world_from_view: turn(random), projection }
}

/// A number near 0 of either sign, as often of one size as of another.
fn nearly_nothing(random: &mut Random) -> f64 {
    let size = random.log_range(1.0e-9, 1.0e-3);
    if random.chance(0.5) { size } else { -size }
}

/// The rotation that a quaternion is in the renderer's matrix, in `f64`.
fn rotation(q: Quat) -> DMat3 {
    let [x, y, z, w] = q.to_array().map(f64::from);
    DMat3::from_cols(
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
}

/// How far a point lies inside each of the six borders, in units of its depth for the sides and in metres for near and
/// far: negative outside.
fn inside(view: &View, p: Vec3) -> [f64; 6] {
    let p = rotation(view.world_from_view).inverse() * (p.as_dvec3() - view.eye_in_world.as_dvec3());
    let depth = -p.z;
    let Projection { left, right, bottom, top, near_m, far_m } = view.projection;
    [
        p.x / depth - f64::from(left),
        f64::from(right) - p.x / depth,
        p.y / depth - f64::from(bottom),
        f64::from(top) - p.y / depth,
        depth - f64::from(near_m),
        f64::from(far_m) - depth,
    ]
}

fn is_in_view(view: &View, p: Vec3) -> bool {
    inside(view, p).iter().all(|&distance| distance >= 0.0)
}

/// A point close to a border of the view, or to an edge or corner: as close as `f32` can put it.
pub(crate) fn border_point(view: &View, random: &mut Random) -> Vec3 {
    let Projection { left, right, bottom, top, near_m, far_m } = view.projection;
    let mut tangent = |low: f32, high: f32| {
        let (low, high) = (f64::from(low), f64::from(high));
        let beside = nearly_nothing(random) * (high - low);
        match random.below(3) {
            0 => low + beside,
            1 => high - beside,
            _ => random.range(low, high),
        }
    };
    let (x, y) = (tangent(left, right), tangent(bottom, top));
    let (near_m, far_m) = (f64::from(near_m), f64::from(far_m));
    let depth = match random.below(6) {
        0 => near_m * (1.0 + nearly_nothing(random)),
        1 => far_m * (1.0 + nearly_nothing(random)),
        _ => random.log_range(near_m, far_m),
    };
    let p = rotation(view.world_from_view) * (DVec3::new(x, y, -1.0) * depth);
    (view.eye_in_world.as_dvec3() + p).as_vec3()
}

/// The frustum as `f32` gives it at once, without a margin.
fn without_margin(view: &View) -> Frustum {
    let Projection { left, right, bottom, top, near_m, far_m } = view.projection;
    let side = |normal: Vec3| {
        let normal = rotate(view.world_from_view, normal).normalize_or_zero();
        Plane::from_point_normal(view.eye_in_world, normal)
    };
    let forward = view.forward_in_world();
    Frustum::new([
        side(Vec3::new(1.0, 0.0, left)),
        side(Vec3::new(-1.0, 0.0, -right)),
        side(Vec3::new(0.0, 1.0, bottom)),
        side(Vec3::new(0.0, -1.0, -top)),
        Plane::from_point_normal(view.eye_in_world + forward * near_m, forward),
        Plane::from_point_normal(view.eye_in_world + forward * far_m, -forward),
    ])
}

/// A box that has the point in it: at a corner, in a face, inside, or nothing else.
fn box_with(p: Vec3, random: &mut Random) -> Aabb {
    let mut other = || {
        let by = random.in_cube() * random.log_range(1.0e-4, 10.0);
        (p.as_dvec3() + by).as_vec3()
    };
    let (a, b) = (other(), other());
    match random.below(3) {
        0 => Aabb::new(p, p),
        1 => Aabb::from_points(&[p, a]),
        _ => Aabb::from_points(&[p, a, b]),
    }
}

#[test]
fn nothing_at_the_border_of_a_view_is_culled_wherever_the_eye_is() {
    let mut random = Random::new(1);
    for place_m in PLACES_M {
        let (mut cases, mut would_be_lost) = (0, 0);
        for _ in 0..600 {
            let view = any_view(&mut random, place_m);
            let (frustum, plain) = (view.frustum(), without_margin(&view));
            for _ in 0..150 {
                let p = border_point(&view, &mut random);
                if !is_in_view(&view, p) {
                    continue;
                }
                cases += 1;
                let bounds = box_with(p, &mut random);
                would_be_lost += usize::from(!plain.may_see(&bounds));
                assert!(frustum.may_see(&bounds), "{view:?} {p} {bounds:?}: {:?}", inside(&view, p));
                assert_ne!(frustum.classify(&bounds), Containment::Outside);
                assert_ne!(frustum.classify_volume(&bounds), Containment::Outside);
                assert_ne!(frustum.classify_volume(&Sphere::around(&bounds)), Containment::Outside);
                let obb = Obb::from_points(&bounds.corners()).expect("finite points");
                assert_ne!(frustum.classify_volume(&obb), Containment::Outside);
            }
        }
        assert!(cases > if place_m > 1.0e6 { 1000 } else { 15_000 }, "{place_m} m: {cases} cases");
        assert!(would_be_lost > 0 || place_m < 1.0, "{place_m} m: the cases show nothing");
    }
}

/// What `f32` coordinates there cannot tell apart is kept, and no more: a few units in the last place of the eye's
/// coordinates, and of the distance from it.
#[test]
fn little_is_kept_beside_a_view_wherever_the_eye_is() {
    const UNIT: f64 = f32::EPSILON as f64 * 0.5;
    let mut random = Random::new(2);
    for place_m in PLACES_M {
        let (mut culled, mut kept) = (0, 0);
        for _ in 0..600 {
            let view = any_view(&mut random, place_m);
            let frustum = view.frustum();
            let Projection { left, right, bottom, top, near_m, far_m } = view.projection;
            let eye_terms = f64::from(view.eye_in_world.abs().element_sum());
            let steepest =
                view.corner_directions().map(|d| f64::from(d.length())).into_iter().fold(0.0, f64::max);
            for _ in 0..100 {
                let p = border_point(&view, &mut random);
                let from_eye = p.as_dvec3() - view.eye_in_world.as_dvec3();
                let depth = from_eye.dot(rotation(view.world_from_view) * DVec3::NEG_Z);
                let sides = inside(&view, p);
                let is_beside = (0..6).any(|i| {
                    let beyond_m = match [left, right, bottom, top].get(i) {
                        Some(tangent) => -sides[i] * depth / f64::from(*tangent).hypot(1.0),
                        None => -sides[i],
                    };
                    let reach_m = [depth, depth, depth, depth, f64::from(near_m), f64::from(far_m)][i];
                    beyond_m > UNIT * (6.0 * eye_terms + 16.0 * steepest * reach_m) + 1.0e-37
                });
                if depth > 0.0 && is_beside {
                    assert!(!frustum.may_see(&Aabb::new(p, p)), "{view:?} {p}: {sides:?}");
                    culled += 1;
                } else if depth > 0.0 && !is_in_view(&view, p) {
                    kept += 1;
                }
            }
        }
        assert!(culled > 500 || place_m > 1.0e4, "{place_m} m: {culled} culled, {kept} kept");
    }
}

/// Triangles that cut a border, a corner or the whole view, against their boxes.
#[test]
fn no_polygon_that_reaches_into_a_view_is_culled() {
    let mut random = Random::new(3);
    for place_m in PLACES_M {
        let mut reaching = 0;
        for _ in 0..300 {
            let view = any_view(&mut random, place_m);
            let (frustum, reach) = (view.frustum(), Reach::new(&view));
            for _ in 0..100 {
                let mut corner = || {
                    let p = border_point(&view, &mut random);
                    let by = random.in_cube() * random.log_range(1.0e-3, 100.0);
                    (p.as_dvec3() + by).as_vec3()
                };
                let triangle = ConvexPolygon::triangle(corner(), corner(), corner());
                if reach.holds_part_of(&triangle) {
                    reaching += 1;
                    assert!(frustum.may_see(&triangle.bounds()), "{view:?} {triangle:?}");
                }
            }
        }
        assert!(reaching > 2000, "{place_m} m: {reaching}");
    }
}

/// The reference itself, against points: a triangle whose middle is in view reaches into it, one beyond a border does not.
#[test]
fn the_reference_knows_what_reaches_into_a_view() {
    let mut random = Random::new(4);
    for place_m in [0.0, 30.0, 3.0e3] {
        let (mut yes, mut no) = (0, 0);
        for _ in 0..20_000 {
            let view = any_view(&mut random, place_m);
            let reach = Reach::new(&view);
            let size = random.log_range(1.0e-3, 30.0);
            let p = border_point(&view, &mut random).as_dvec3();
            let corners = [(); 3].map(|()| (p + random.in_cube() * size).as_vec3());
            let is_reached =
                reach.holds_part_of(&ConvexPolygon::triangle(corners[0], corners[1], corners[2]));
            let some_corner = corners.iter().any(|&c| inside(&view, c).iter().all(|&d| d > 1.0e-6));
            let in_front = |c: &Vec3| inside(&view, *c)[4] > 0.0;
            let one_side = (0..6).any(|i| {
                let beyond = |c: &Vec3| inside(&view, *c)[i] < -1.0e-6 && (i > 3 || in_front(c));
                corners.iter().all(beyond)
            });
            assert!(is_reached || !some_corner, "{view:?} {corners:?}");
            assert!(!is_reached || !one_side, "{view:?} {corners:?}");
            (yes, no) = (yes + usize::from(is_reached), no + usize::from(!is_reached));
        }
        assert!(yes > 3000 && no > 3000, "{yes} {no}");
    }
    // No corner in view, but the middle; behind the eye; on the border from outside; bent, in its second half only.
    let view = View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(90.0, 1.0, 0.5, 10.0));
    let reach = Reach::new(&view);
    let across = |z: f32| [Vec3::new(-99.0, -99.0, z), Vec3::new(99.0, -99.0, z), Vec3::new(0.0, 200.0, z)];
    let holds = |[a, b, c]: [Vec3; 3]| reach.holds_part_of(&ConvexPolygon::triangle(a, b, c));
    assert!(holds(across(-2.0)) && !holds(across(2.0)) && !holds(across(-0.4)) && !holds(across(-10.5)));
    assert!(!holds(across(-10.0)) && !holds(across(-0.5)));
    let fan = [
        Vec3::new(5.0, 0.0, -2.0),
        Vec3::new(5.0, 4.0, -2.0),
        Vec3::new(0.0, 4.0, -2.0),
        Vec3::new(0.0, 0.0, -2.0),
    ];
    assert!(reach.holds_part_of(&ConvexPolygon::quad(fan)));
    assert!(!holds([Vec3::NAN, Vec3::X, Vec3::Y]));
}

#[test]
fn what_is_no_number_in_a_view_is_seen() {
    let good = View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 1.0, 0.1, 100.0));
    let with = |change: &dyn Fn(&mut View)| {
        let mut view = good;
        change(&mut view);
        view
    };
    let before = Aabb::cube(Vec3::new(0.0, 0.0, -5.0), 0.1);
    let everything = Aabb::new(Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX));
    let nan = [
        with(&|v| v.eye_in_world = Vec3::NAN),
        with(&|v| v.eye_in_world.y = f32::INFINITY),
        with(&|v| v.eye_in_world.x = f32::NEG_INFINITY),
        with(&|v| v.world_from_view = Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)),
        with(&|v| v.projection.left = f32::NAN),
        with(&|v| v.projection.top = f32::INFINITY),
        with(&|v| v.projection.near_m = f32::NAN),
        with(&|v| v.projection.far_m = f32::NAN),
        with(&|v| v.projection.far_m = f32::INFINITY),
        with(&|v| v.eye_in_world = Vec3::splat(-f32::MAX)),
    ];
    for view in nan {
        let frustum = view.frustum();
        for plane in frustum.planes() {
            assert!(plane.normal.is_finite() && plane.d.is_finite(), "{view:?}: {plane:?}");
        }
        assert!(frustum.may_see(&everything), "{view:?}");
        // But for the one that really looks from elsewhere.
        assert!(
            frustum.may_see(&before) || view.eye_in_world == Vec3::splat(-f32::MAX),
            "{view:?}: {frustum:?}"
        );
    }
    // Without a far plane the sides cull on.
    let endless = with(&|v| v.projection.far_m = f32::INFINITY).frustum();
    assert!(endless.may_see(&Aabb::cube(Vec3::new(0.0, 0.0, -1.0e9), 1.0)));
    assert!(!endless.may_see(&Aabb::cube(Vec3::new(0.0, 2.0e9, -1.0e9), 1.0)));
    assert!(!endless.may_see(&Aabb::cube(Vec3::new(0.0, 0.0, 1.0), 1.0)));
    // From the eye itself on.
    let near = with(&|v| v.projection.near_m = 0.0).frustum();
    assert!(near.may_see(&Aabb::new(Vec3::ZERO, Vec3::ZERO)) && !near.may_see(&Aabb::cube(Vec3::Z, 1.0)));
}

/// Matrices with a place in them: what they map into the clip volume, exactly, is in their frustum.
#[test]
fn nothing_in_the_clip_volume_of_a_matrix_is_culled() {
    let mut random = Random::new(5);
    for place_m in PLACES_M {
        let (mut cases, mut kept, mut beside) = (0, 0, 0);
        for n in 0..1200 {
            let view = any_view(&mut random, place_m);
            let to_eye = Mat4::from_rotation_translation(view.world_from_view, view.eye_in_world).inverse();
            let Projection { left, right, bottom, top, near_m, far_m } = view.projection;
            let [l, r, b, t] = [left, right, bottom, top].map(|tangent| tangent * near_m);
            let perspective = frustum_matrix(l, r, b, t, near_m, far_m);
            let clip_from_view = match n % 4 {
                0 => view.clip_from_world() * to_eye.inverse(),
                1 => perspective,
                2 => {
                    let [x, y, _, w] = [0, 1, 2, 3].map(|i| perspective.row(i));
                    // Reversed depth without a far plane.
                    Mat4::from_cols(x, y, Vec4::new(0.0, 0.0, 0.0, near_m), w).transpose()
                }
                _ => box_matrix(left, right, bottom, top, near_m, far_m.min(20.0)),
            };
            let clip_from_world = clip_from_view * to_eye;
            let exact = clip_from_world.as_dmat4();
            let frustum = Frustum::from_matrix(&clip_from_world);
            for _ in 0..60 {
                let p = border_point(&view, &mut random);
                let clip: DVec4 = exact * p.as_dvec3().extend(1.0);
                let bounds = [
                    clip.w + clip.x,
                    clip.w - clip.x,
                    clip.w + clip.y,
                    clip.w - clip.y,
                    clip.z,
                    clip.w - clip.z,
                ];
                if clip.w > 0.0 && bounds.iter().all(|&v| v >= 0.0) {
                    cases += 1;
                    let bounds = box_with(p, &mut random);
                    assert!(
                        frustum.may_see(&bounds),
                        "{place_m} m, {n}: {clip_from_world:?} {p} {clip} {frustum:?}"
                    );
                } else {
                    let from_eye = p.as_dvec3() - view.eye_in_world.as_dvec3();
                    let extent_m = from_eye.length() + if n % 4 == 3 { 30.0 } else { 0.0 };
                    let rounding_m =
                        2.5e-6 * (f64::from(view.eye_in_world.abs().element_sum()) + 5.0 * extent_m);
                    let (x, y, w) = (exact.row(0), exact.row(1), exact.row(3));
                    let is_beside = [w + x, w - x, w + y, w - y].iter().any(|side| {
                        side.dot(p.as_dvec3().extend(1.0)) < -rounding_m * side.truncate().length()
                    });
                    beside += usize::from(is_beside);
                    kept += usize::from(is_beside && frustum.may_see(&Aabb::new(p, p)));
                }
            }
        }
        assert!(cases > 500, "{place_m} m: {cases} cases");
        assert!(kept * 1000 <= beside, "{place_m} m: {kept} of {beside} kept");
    }
}

/// Depth from 0 (near) to 1.
fn frustum_matrix(left: f32, right: f32, bottom: f32, top: f32, near: f32, far: f32) -> Mat4 {
    let (w, h, d) = (right - left, top - bottom, near - far);
    Mat4::from_cols(
        Vec4::new(2.0 * near / w, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 2.0 * near / h, 0.0, 0.0),
        Vec4::new((right + left) / w, (top + bottom) / h, far / d, -1.0),
        Vec4::new(0.0, 0.0, near * far / d, 0.0),
    )
}

/// The same for parallel rays.
fn box_matrix(left: f32, right: f32, bottom: f32, top: f32, near: f32, far: f32) -> Mat4 {
    let (w, h, d) = (right - left, top - bottom, near - far);
    Mat4::from_cols(
        Vec4::new(2.0 / w, 0.0, 0.0, 0.0),
        Vec4::new(0.0, 2.0 / h, 0.0, 0.0),
        Vec4::new(0.0, 0.0, 1.0 / d, 0.0),
        Vec4::new(-(right + left) / w, -(top + bottom) / h, near / d, 1.0),
    )
}

/// Groups that lie far away, in views that are there or here.
#[test]
fn nothing_is_lost_in_the_space_of_a_group_far_away() {
    let mut random = Random::new(6);
    for place_m in PLACES_M {
        let (mut cases, mut kept, mut beside) = (0, 0, 0);
        for n in 0..1000 {
            let view = any_view(&mut random, place_m);
            let frustum = view.frustum();
            let scale = random.log_range(0.05, 20.0) as f32;
            let by = if n % 2 == 0 { view.eye_in_world } else { Vec3::ZERO };
            let by = by + (random.in_cube() * 3.0).as_vec3();
            let group = Affine3A::from_scale_rotation_translation(Vec3::splat(scale), turn(&mut random), by);
            let there = frustum.in_space(&group);
            let matrix = group.matrix3.to_cols_array_2d().map(|c| DVec3::from_array(c.map(f64::from)));
            let matrix = DMat3::from_cols(matrix[0], matrix[1], matrix[2]);
            let origin = Vec3::from(group.translation).as_dvec3();
            for _ in 0..40 {
                let p = border_point(&view, &mut random).as_dvec3();
                let local = (matrix.inverse() * (p - origin)).as_vec3();
                let world = matrix * local.as_dvec3() + origin;
                let least = frustum
                    .planes()
                    .iter()
                    .map(|plane| plane.normal.as_dvec3().dot(world) + f64::from(plane.d))
                    .fold(f64::INFINITY, f64::min);
                let bounds = box_with(local, &mut random);
                let answers = [
                    there.classify_volume(&bounds),
                    there.classify_volume(&Sphere::around(&bounds)),
                    there.classify_volume(&Obb::from_points(&bounds.corners()).expect("finite points")),
                ];
                if least >= 0.0 {
                    cases += 1;
                    assert!(
                        answers.iter().all(|&a| a != Containment::Outside),
                        "{place_m} m: {local} {group:?}"
                    );
                } else {
                    // The point is outside: nothing with it is inside.
                    let size =
                        view.eye_in_world.as_dvec3().length() + origin.length() + (world - origin).length();
                    if least < -1.0e-5 * size {
                        assert!(
                            answers.iter().all(|&a| a != Containment::Inside),
                            "{place_m} m: {local} {group:?}"
                        );
                        let point = there.classify_volume(&Aabb::new(local, local));
                        (beside, kept) = (beside + 1, kept + usize::from(point != Containment::Outside));
                    }
                }
            }
        }
        assert!(cases > 4000, "{place_m} m: {cases} cases");
        assert!(kept * 1000 <= beside, "{place_m} m: {kept} of {beside} kept");
    }
}

#[test]
fn a_view_from_as_far_as_numbers_go_looks_at_its_target() {
    let projection = Projection { left: -1.0, right: 1.0, bottom: -1.0, top: 1.0, near_m: 0.1, far_m: 100.0 };
    for eye in [3.0e38, 2.0e19, 1.0e19, 1.0, 1.0e-18_f32] {
        let view = View::look_at(Vec3::X * eye, Vec3::ZERO, projection);
        assert!(view.forward_in_world().distance(Vec3::NEG_X) < 1.0e-6, "{eye}");
    }
}
