//! The oracle for draw lists: it never blames a right one, and finds wrong ones.

use osp::{
    Camera, Culler, Depth, Occluder,
    glam::{DMat4, Vec3},
    math::Aabb,
    oracle::{Oracle, OracleError},
    view::{Projection, View},
};

use osp_testkit::boxes::Rng;

/// The twelve triangles of a box.
fn triangles_of(bounds: &Aabb) -> Vec<[[f32; 3]; 3]> {
    let corner = |bits: usize| {
        let at = |axis: usize| if bits >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] };
        [at(0), at(1), at(2)]
    };
    let faces = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    faces.into_iter().flat_map(halves).map(|triangle| triangle.map(corner)).collect()
}

/// Boxes, the larger of which hide what is behind them, around a place.
fn world(rng: &mut Rng, at: Vec3) -> (Culler<u32>, Oracle) {
    let (mut culler, mut oracle) = (Culler::new(), Oracle::new());
    let room = Aabb::new(at - Vec3::new(9.0, 7.0, 30.0), at + Vec3::new(9.0, 7.0, -3.0));
    for object in 0..400 {
        let is_wall = object % 10 == 0;
        let bounds = Aabb::cube(rng.point(&room), if is_wall { rng.range(1.0, 5.0) } else { 0.4 });
        culler.set(object, [bounds.min, bounds.max]);
        oracle.add(object, triangles_of(&bounds)).expect("finite triangles");
        if is_wall {
            let occluder = Occluder::cuboid([bounds.min, bounds.max]).expect("a box");
            culler.set_occluder(object, occluder);
        }
    }
    (culler, oracle)
}

fn cameras(at: Vec3) -> [Camera; 3] {
    let forward = View::look_at(at, at - Vec3::Z, Projection::symmetric(70.0, 1.3, 0.05, 60.0));
    let to_place = DMat4::from_translation(-at.as_dvec3());
    // Reversed depth without end.
    let endless = DMat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.2, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, 0.1, 0.0],
    ]);
    let endless = endless * to_place;
    // 16 m wide, 12 m high, 40 m deep.
    let parallel = DMat4::from_cols_array_2d(&[
        [0.125, 0.0, 0.0, 0.0],
        [0.0, 1.0 / 6.0, 0.0, 0.0],
        [0.0, 0.0, -0.025, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);
    let parallel = parallel * to_place;
    [
        Camera::from(&forward),
        Camera::from_matrix(endless.to_cols_array(), Depth::OneToZero).expect("a perspective"),
        Camera::from_matrix(parallel.to_cols_array(), Depth::ZeroToOne).expect("a parallel projection"),
    ]
}

#[test]
fn the_oracle_finds_what_a_list_lacks_and_blames_no_list_of_the_culler() {
    let mut rng = Rng(17);
    for (scene, at) in [Vec3::ZERO, Vec3::new(-3.0, 2.0, 8.0), Vec3::splat(2000.0)].into_iter().enumerate() {
        let (mut culler, oracle) = world(&mut rng, at);
        for (number, camera) in cameras(at).into_iter().enumerate() {
            let frame = culler.cull(&[camera.hide_by_occluders()]);
            let seen = &frame[0];
            assert!(number == 2 || seen.hidden() > 40, "scene {scene}, camera {number}: {seen:?}");
            let missing = oracle.missing(&camera, |object| seen.contains(object), 12);
            assert_eq!(missing, [], "scene {scene}, camera {number}");

            // Without any object, the oracle names what is shown, and no more than what is drawn.
            let all = oracle.missing(&camera, |_| false, 12);
            assert!(all.iter().all(|found| seen.contains(found.object)), "scene {scene}, camera {number}");
            assert!(all.len() * 2 > seen.len(), "{} of {}", all.len(), seen.len());
            for found in all.iter().step_by(5) {
                let one = oracle.missing(&camera, |object| object != found.object, 12);
                assert_eq!(one, [*found], "scene {scene}, camera {number}");
                // The point lies on the object.
                let [min, max] = culler.bounds(found.object).expect("it is there").map(point);
                let at = point(found.point_m);
                assert!((at - at.clamp(min, max)).length() < 1.0e-3, "{found:?}");
            }
        }
    }
}

fn point(numbers: [f32; 3]) -> Vec3 {
    Vec3::from_array(numbers)
}

#[test]
fn a_triangle_that_is_not_finite_is_refused_by_its_place() {
    let (mut oracle, whole) = (Oracle::new(), [[0.0_f32; 3], [1.0, 0.0, -2.0], [0.0, 1.0, -2.0]]);
    let broken = [[0.0, f32::NAN, 0.0], whole[1], whole[2]];
    let error = oracle.add(7, [whole, broken]).expect_err("NaN");
    assert!(matches!(error, OracleError::NotFinite { triangle: 1, .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "triangle 1: expected finite coordinates, found [[0.0, NaN, 0.0], [1.0, 0.0, -2.0], [0.0, 1.0, -2.0]]"
    );
    let [camera, _, parallel] = cameras(Vec3::ZERO);
    assert_eq!(oracle.missing(&camera, |_| false, 30).len(), 1, "the one before it was added");
    let away = |by: f32| whole.map(|[x, y, z]| [x, y, z - by]);
    oracle.add(8, [away(0.5); 2]).expect("finite");
    assert_eq!(oracle.missing(&camera, |_| false, 30).len(), 2, "a surface does not hide itself");
    let mut line = Oracle::new();
    line.add(7, [[[-1.0, 0.0, -2.0], [0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]]).expect("finite");
    line.add(8, [away(60.0)]).expect("beyond the far planes");
    for camera in [camera, parallel] {
        assert_eq!(line.missing(&camera, |_| false, 4), [], "it covers nothing");
    }
}
