//! Boxes and frusta with which some index has failed.

use glam::Vec3;
use osp::{
    index::IndexConfig,
    math::{Aabb, Frustum, Plane},
    view::{Projection, View},
};
use osp_testkit::boxes::{Rng, drawn, shuffled};

/// A named list of polygon boxes, in order of arrival.
pub(crate) struct TestScene {
    pub(crate) name: &'static str,
    pub(crate) boxes: Vec<Aabb>,
}

pub(crate) fn around(center: Vec3, size_m: f32) -> Aabb {
    Aabb::cube(center, size_m)
}

fn point(p: Vec3) -> Aabb {
    Aabb::new(p, p)
}

/// `count` small boxes scattered in `room`.
pub(crate) fn scattered(count: usize, room: &Aabb, size_m: f32, seed: u64) -> Vec<Aabb> {
    let mut random = Rng(seed);
    (0..count)
        .map(|_| {
            let min = random.point(room);
            Aabb::new(min, min + random.point(&Aabb::new(Vec3::ZERO, Vec3::splat(size_m))))
        })
        .collect()
}

/// Boxes that touch, cross or lie in the planes that halve the root again and again.
fn on_split_planes(root: &Aabb) -> Vec<Aabb> {
    let mut random = Rng(5);
    let snap = |random: &mut Rng, axis: usize| {
        let cells = 1 << random.below(6);
        let k = random.below(cells + 1) as f32;
        root.min[axis] + root.extent()[axis] * (k / cells as f32)
    };
    (0..120)
        .map(|i| {
            let p = random.point(root);
            let mut a = p;
            let mut b = p + Vec3::splat(0.01);
            let axis = i % 3;
            a[axis] = snap(&mut random, axis);
            match i / 3 % 4 {
                0 => b[axis] = a[axis],
                1 => b[axis] = a[axis] + 0.01,
                2 => (a[axis], b[axis]) = (a[axis] - 0.01, a[axis]),
                _ => (a[axis], b[axis]) = (a[axis] - 0.01, a[axis] + 0.01),
            }
            Aabb::new(a, b)
        })
        .collect()
}

pub(crate) fn scenes() -> Vec<TestScene> {
    let root = IndexConfig::default().root;
    let mut strokes = drawn(600, 1);
    for b in &mut strokes {
        (b.min, b.max) = (b.min + root.center(), b.max + root.center());
    }
    let mixed = shuffled(strokes.clone(), 2);
    let mut scenes = Vec::new();
    let mut add = |name, boxes| scenes.push(TestScene { name, boxes });

    add("empty", Vec::new());
    add("one", vec![around(Vec3::new(0.3, 1.0, -0.2), 0.1)]);
    add("one at the middle of the root", vec![around(root.center(), 0.1)]);
    add("coincident", vec![around(Vec3::new(0.3, 1.0, -0.2), 0.1); 90]);
    add("coincident points", vec![point(Vec3::new(0.5, 1.0, 0.5)); 70]);
    add("coincident centres", (1..70).map(|i| around(Vec3::ONE, 0.03 * i as f32)).collect());
    add("coincident centres, shrinking", (1..70).rev().map(|i| around(Vec3::ONE, 0.03 * i as f32)).collect());
    add("two piles", (0..80).map(|i| around(Vec3::splat((i % 2) as f32), 0.02)).collect());
    add("row", (0..150).map(|i| around(Vec3::new(i as f32 * 0.01, 1.0, 0.0), 0.02)).collect());
    add("row, backwards", (0..150).map(|i| around(Vec3::new(0.0, 1.0, i as f32 * -0.01), 0.02)).collect());
    add(
        "shrinking steps",
        (0..100).map(|i| around(Vec3::splat(2.0f32.powi(-i)), 2.0f32.powi(-i - 3))).collect(),
    );
    add("scattered", scattered(300, &root, 0.05, 3));
    add("large among small", {
        let mut boxes = scattered(150, &root, 0.03, 4);
        boxes.extend(scattered(20, &root, 3.0, 5));
        boxes
    });
    add("huge", {
        let mut boxes = scattered(60, &root, 0.03, 6);
        boxes.push(around(Vec3::ZERO, 1.0e4));
        boxes.push(around(Vec3::ZERO, 1.0e20));
        boxes.push(Aabb::new(Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX)));
        boxes.push(Aabb::new(Vec3::splat(-f32::MAX), Vec3::splat(-f32::MAX)));
        boxes.push(Aabb::new(Vec3::new(1.0, 1.0, -f32::MAX), Vec3::new(1.0, 2.0, f32::MAX)));
        boxes
    });
    add("tiny", {
        let mut boxes = scattered(60, &around(Vec3::ONE, 1.0e-5), 1.0e-6, 7);
        boxes.extend((0..20).map(|i| point(Vec3::splat(f32::from_bits(i)))));
        boxes.extend((0..20).map(|i| point(Vec3::splat(-f32::MIN_POSITIVE * i as f32))));
        boxes
    });
    add("on split planes", on_split_planes(&root));
    add("far from the origin", scattered(150, &around(Vec3::new(3.0e6, -2.0e6, 1.0e6), 20.0), 1.0, 8));
    add("outside the root", {
        let mut boxes = scattered(100, &around(Vec3::new(30.0, 1.5, -20.0), 15.0), 0.1, 9);
        boxes.extend(scattered(60, &around(root.center(), 9.0), 0.4, 10));
        boxes
    });
    add("sticking out of the root", {
        let corners = root.corners();
        corners.iter().flat_map(|&c| [around(c, 0.1), around(c, 1.0), point(c)]).collect()
    });
    add("one outlier", {
        let mut boxes = scattered(120, &root, 0.02, 11);
        boxes.insert(60, point(Vec3::splat(1.0e15)));
        boxes
    });
    add("flat", {
        let mut boxes = scattered(120, &root, 0.1, 12);
        for b in &mut boxes {
            (b.min.y, b.max.y) = (1.0, 1.0);
        }
        boxes
    });
    add("too far apart for a number", {
        let mut boxes = vec![around(Vec3::ONE, 1.0)];
        boxes.extend((0..60).map(|i| around(Vec3::new([2.0e38, -2.0e38][i % 2], i as f32, 2.0e38), 1.0)));
        boxes
    });
    add("on a grid", {
        // Faces and edges of many boxes lie in one plane, and many boxes are flat.
        let mut random = Rng(41);
        let mut eighths =
            |n: usize| Vec3::from_array(std::array::from_fn(|_| random.below(n) as f32 * 0.125));
        let mut at = || (eighths(32) - 2.0, eighths(3));
        (0..300).map(|_| at()).map(|(min, sides)| Aabb::new(min, min + sides)).collect()
    });
    add("strokes", strokes);
    add("strokes, shuffled", mixed);
    scenes
}

/// Views and degenerate frusta. Every index must report the reference's set for all of them.
pub(crate) fn frusta(boxes: &[Aabb]) -> Vec<Frustum> {
    let bounds = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let middle = boxes.get(boxes.len() / 2).map_or(Vec3::ONE, Aabb::center);
    let away = Vec3::new(0.3, 0.2, 1.0);
    let size_m = bounds.extent().max_element().clamp(1.0e-6, 1.0e6);
    let wide = Projection::symmetric(70.0, 1.6, 0.001, 100.0);
    let off_axis = Projection { left: -0.1, right: 1.4, bottom: -0.8, top: 0.05, near_m: 0.01, far_m: 3.0 };
    let needle = Projection::symmetric(1.0, 1.0, 0.001, 1.0e5);
    let x_slab = |from: f32, to: f32| {
        let mut planes = [Plane { normal: Vec3::ZERO, d: 1.0 }; 6];
        planes[2] = Plane { normal: Vec3::X, d: -from };
        planes[3] = Plane { normal: Vec3::NEG_X, d: to };
        Frustum::new(planes)
    };
    let all_planes = |normal: Vec3, d: f32| Frustum::new([Plane { normal, d }; 6]);
    let mut frusta = vec![
        View::look_at(Vec3::new(0.0, 1.7, 6.0), Vec3::new(0.0, 1.5, 0.0), wide).frustum(),
        View::look_at(Vec3::new(0.2, 1.6, 0.3), Vec3::new(0.7, 1.2, -2.0), wide).frustum(),
        View::look_at(Vec3::new(0.2, 1.6, 0.3), Vec3::new(-0.7, 1.2, 2.0), off_axis).frustum(),
        View::look_at(middle + away * size_m, middle, wide).frustum(),
        View::look_at(middle + away * size_m, middle, needle).frustum(),
        View::look_at(middle, middle + away, off_axis).frustum(),
        x_slab(middle.x, middle.x),
        x_slab(middle.x - 0.2 * size_m, middle.x),
        x_slab(middle.x, middle.x - 1.0),
        // The first contains all boxes, the second none, and the third decides nothing.
        all_planes(Vec3::ZERO, 1.0),
        all_planes(Vec3::ZERO, -1.0),
        all_planes(Vec3::ZERO, 0.0),
        all_planes(Vec3::X, f32::INFINITY),
        all_planes(Vec3::X, f32::NEG_INFINITY),
        all_planes(Vec3::splat(f32::NAN), 0.0),
        all_planes(Vec3::new(f32::INFINITY, -1.0, f32::NEG_INFINITY), 1.0),
        all_planes(Vec3::new(-0.0, 1.0e-40, 3.0e38), -1.0),
    ];
    let mut one_bad = *frusta[1].planes();
    one_bad[4].normal.y = f32::NAN;
    frusta.push(Frustum::new(one_bad));
    frusta
}

/// A view between two random points near `room`.
pub(crate) fn random_frustum(random: &mut Rng, room: &Aabb) -> Frustum {
    let eye = random.point(room) * 1.5;
    let target = random.point(room);
    let projection = Projection {
        left: -2.0 * random.unit(),
        right: 0.01 + 2.0 * random.unit(),
        bottom: -2.0 * random.unit(),
        top: 0.01 + 2.0 * random.unit(),
        near_m: 0.001 + random.unit(),
        far_m: 1.0 + 10.0 * random.unit(),
    };
    View::look_at(eye, target, projection).frustum()
}
