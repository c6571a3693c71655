//! The paper's tree: the O(1) placement finds the node at which the walk of Fig. 5 ends, and changes do not degrade the
//! tree.

use glam::Vec3;
use osp::{index::SpatialIndex, math::Aabb, polygon::PolygonId};
use osp_rivals::{OspGrid, OspPaper};
use proptest::{collection::vec, prelude::*};

#[derive(Clone, Debug)]
struct Cube {
    center: Vec3,
    size_m: f32,
    max_depth: u32,
}

fn cube() -> impl Strategy<Value = Cube> {
    let size = prop_oneof![Just(4.0f32), Just(3.3), Just(1.0e-3), Just(1.0e6), 0.001f32..100.0];
    let center = prop_oneof![
        Just(Vec3::new(0.0, 1.5, 0.0)),
        Just(Vec3::splat(1.0e4)),
        (-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0).prop_map(|(x, y, z)| Vec3::new(x, y, z)),
    ];
    (center, size, 0u32..12).prop_map(|(center, size_m, max_depth)| Cube { center, size_m, max_depth })
}

/// A coordinate as a fraction of the root's edge: anywhere, on a splitting plane, or next to one by a rounding error.
fn fraction() -> impl Strategy<Value = (f32, i32)> {
    let on_plane = (0u32..=16, 0u32..=4).prop_map(|(k, level)| k as f32 / (1u32 << level) as f32);
    prop_oneof![
        4 => (-0.1f32..1.1).prop_map(|f| (f, 0)),
        2 => on_plane.clone().prop_map(|f| (f, 0)),
        1 => (on_plane, -1..=1i32),
    ]
}

fn corner() -> impl Strategy<Value = [(f32, i32); 3]> {
    [fraction(), fraction(), fraction()]
}

fn place_in(cube: &Cube, corner: [(f32, i32); 3]) -> Vec3 {
    let min = cube.center - Vec3::splat(cube.size_m * 0.5);
    Vec3::from_array(std::array::from_fn(|axis| {
        let (fraction, steps) = corner[axis];
        let x = min[axis] + cube.size_m * fraction;
        match steps {
            1 => x.next_up(),
            -1 => x.next_down(),
            _ => x,
        }
    }))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn placement_is_the_walk(
        cube in cube(),
        boxes in vec((corner(), corner(), 0.0f32..1.0), 1..60),
    ) {
        let grid = OspGrid::new(cube.center, cube.size_m, cube.max_depth);
        let mut tree = OspPaper::new(grid, 0);
        for (i, (a, b, shrink)) in boxes.into_iter().enumerate() {
            let (a, mut b) = (place_in(&cube, a), place_in(&cube, b));
            if i % 3 > 0 {
                // The box is small, so that it reaches deep levels.
                b = a + (b - a) * shrink * 0.02;
            }
            let bounds = Aabb::new(a.min(b), a.max(b));
            let id = PolygonId(i as u32);
            tree.insert(id, &bounds).expect("a finite box under a new id");
            prop_assert_eq!(grid.place(&bounds), tree.place_of(id), "{:?}", bounds);
        }
    }
}

#[test]
fn placement_by_hand() {
    // The cube goes from 0 to 8, and x is split at 4; two levels on x, two on y, one on z.
    let grid = OspGrid::new(Vec3::splat(4.0), 8.0, 5);
    let place = |min: [f32; 3], max: [f32; 3]| {
        grid.place(&Aabb::new(Vec3::from_array(min), Vec3::from_array(max))).map(|p| (p.depth, p.path))
    };
    assert_eq!(place([0.0; 3], [8.0; 3]), Some((0, 0)));
    assert_eq!(place([5.0, 5.0, 5.0], [5.5, 5.5, 5.5]), Some((5, 0b11100)));
    assert_eq!(place([1.0, 5.0, 5.0], [1.5, 5.5, 5.5]), Some((5, 0b01100)));
    assert_eq!(place([6.5, 3.0, 1.0], [7.0, 3.5, 1.5]), Some((5, 0b10011)));
    assert_eq!(place([5.0, 5.0, 3.0], [5.5, 5.5, 5.0]), Some((2, 0b11)), "cut by the first plane across z");
    assert_eq!(
        place([4.0, 5.0, 5.0], [5.5, 5.5, 5.5]),
        Some((0, 0)),
        "touches the first plane: stays at the root"
    );
    assert_eq!(place([-0.1, 5.0, 5.0], [1.0, 5.5, 5.5]), None);
    assert_eq!(place([1.0, 5.0, 5.0], [1.0, 5.5, 8.5]), None);
}

#[test]
fn outside_is_counted_and_found() {
    let mut tree = OspPaper::new(OspGrid::new(Vec3::ZERO, 2.0, 6), 0);
    tree.insert(PolygonId(0), &Aabb::cube(Vec3::splat(0.3), 0.1)).expect("valid");
    tree.insert(PolygonId(1), &Aabb::cube(Vec3::splat(0.97), 0.1)).expect("valid");
    tree.insert(PolygonId(2), &Aabb::cube(Vec3::splat(5.0), 0.1)).expect("valid");
    assert_eq!(tree.outside().0.len(), 2);
    assert_eq!(tree.place_of(PolygonId(1)), None);
    tree.update(PolygonId(1), &Aabb::cube(Vec3::splat(0.9), 0.1)).expect("valid");
    assert_eq!(tree.outside().0.len(), 1);
    assert!(tree.place_of(PolygonId(1)).is_some());
}
