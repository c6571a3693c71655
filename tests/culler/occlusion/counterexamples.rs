//! Small scenes in which the paper's rules hide what is visible, and what a culler must not hide in general.

use super::{
    judge::{hides, is_blocked, is_in_window},
    random::{Polygon, Random, shadows_of, sound_cullers, straight},
};
use glam::{DVec3, Vec3};
use osp::{
    math::{Aabb, Sphere},
    occlusion::{NotAnOccluder, Occlusion, OcclusionCuller, ShadowVolume, Soundness, Verdict},
    view::ViewWindow,
};
use osp_lab::Method;
use osp_rivals::{
    RivalOcclusion,
    occlusion::{MsvbspPaper, PaperCaps},
};

/// A polygon in the plane z = `distance`, given by where it is seen in the plane z = 1.
fn seen_at(distance: f32, outline: &[(f32, f32)]) -> Polygon {
    outline.iter().map(|&(x, y)| Vec3::new(x, y, 1.0) * distance).collect()
}

fn square(distance: f32, x: [f32; 2], y: [f32; 2]) -> Polygon {
    seen_at(distance, &[(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])])
}

/// Tiny balls at twice the distance, all over the window: how many of those that can be seen are called hidden, in
/// per mille of the visible ones.
fn wrongly_hidden_per_mille(
    culler: &mut dyn OcclusionCuller,
    window: &ViewWindow,
    polygons: &[Polygon],
    distance: f64,
) -> u64 {
    culler.build(window, &shadows_of(window, polygons));
    let mut random = Random::new(7);
    let (mut visible, mut wrong) = (0, 0);
    for _ in 0..20_000 {
        let x = DVec3::new(random.range(-2.0, 2.0), random.range(-2.0, 2.0), 1.0) * distance;
        if !is_in_window(window, x) || is_blocked(window, polygons, x) {
            continue;
        }
        visible += 1;
        let ball = Sphere { center: (x + window.eye_in_world()).as_vec3(), radius_m: 1.0e-4 };
        wrong += u64::from(culler.test_sphere(&ball).verdict == Verdict::Hidden);
    }
    wrong * 1000 / visible
}

fn built(kind: Method, window: &ViewWindow, polygons: &[Polygon]) -> Box<dyn OcclusionCuller> {
    let mut culler = kind.create(16);
    culler.build(window, &shadows_of(window, polygons));
    culler
}

fn assert_only_the_paper_is_wrong(window: &ViewWindow, polygons: &[Polygon], paper_at_least_per_mille: u64) {
    for kind in Method::CULLERS {
        let mut culler = kind.create(16);
        let wrong = wrongly_hidden_per_mille(&mut *culler, window, polygons, 6.0);
        match culler.soundness() {
            Soundness::Conservative => assert_eq!(wrong, 0, "{}", culler.name()),
            Soundness::Unsound(_) => {
                assert!(wrong >= paper_at_least_per_mille, "{}: {wrong}", culler.name());
            }
        }
    }
}

/// Rule 2: the triangle never reaches the quadrant x < 0, y < 0, but one of its planes is all that is left there. Rule 5: a
/// united outline is not convex any more, so a cell may keep another part of it than the part that reaches the cell. Rule 6:
/// the worse square loses its left side also below the better one, where nobody else has that plane.
#[test]
fn rules_2_5_and_6_lose_planes() {
    // The paper's splitters have to be x = 0, then y = 0: the first outline starts there.
    let of_2 = [
        seen_at(2.0, &[(0.0, 0.0), (0.0, 2.0), (-2.0, 2.0), (-2.0, 0.0)]),
        seen_at(3.0, &[(-1.0, 1.0), (0.1, 0.1), (2.0, -1.0)]),
    ];
    // Two squares with a common edge, and a third whose planes sort into the wrong cells.
    let united = [[-1.0, 0.0], [0.0, 1.0]].map(|x| square(2.0, x, [0.0, 1.0]));
    let of_5 = [&united[..], &[seen_at(3.0, &[(-1.5, 0.5), (-0.9, -0.9), (1.5, -1.5)])]].concat();
    let of_6 = [square(2.0, [0.0, 1.0], [0.0, 1.0]), square(2.0, [1.0, 2.0], [-0.5, 0.5])];
    for (polygons, paper_at_least_per_mille) in [(&of_2[..], 100), (&of_5, 0), (&of_6, 20)] {
        assert_only_the_paper_is_wrong(&straight(2.0, 0.01), polygons, paper_at_least_per_mille);
    }
}

/// Section 3.2.3: single planes are sorted, so the planes of a square in a wall's shadow open a part of that shadow.
/// Nothing visible is hidden by it. A tree of whole occluders keeps the shadow, and so does rule 4.
#[test]
fn an_occluder_in_a_shadow_opens_it_where_single_planes_are_sorted() {
    let window = straight(2.0, 0.01);
    let wall = square(2.0, [-1.0, 1.0], [-1.0, 1.0]);
    let inner = square(3.0, [-0.2, 0.2], [-0.2, 0.2]);
    let verdict = |kind: Method, polygons: &[Polygon]| {
        let beside_inner = Aabb::cube(Vec3::new(0.7, 0.7, 1.0) * 6.0, 0.5);
        built(kind, &window, polygons).test_box(&beside_inner).verdict
    };
    let sorted = RivalOcclusion::SvbspPaper.into();
    assert_eq!(verdict(sorted, std::slice::from_ref(&wall)), Verdict::Hidden);
    let both = [wall, inner];
    assert_eq!(verdict(sorted, &both), Verdict::Unoccluded);
    for kind in
        [RivalOcclusion::Svbsp.into(), Method::Own(Occlusion::Msvbsp), RivalOcclusion::MsvbspPaper.into()]
    {
        assert_eq!(verdict(kind, &both), Verdict::Hidden, "{}", kind.name());
    }
    assert_only_the_paper_is_wrong(&window, &both, 0);
}

/// Without a cap everything between the eye and the occluder is culled.
#[test]
fn what_is_before_its_occluder_is_visible() {
    let wall = square(5.0, [-1.0, 1.0], [-1.0, 1.0]);
    let window = straight(2.0, 0.01);
    let before = Aabb::cube(Vec3::new(0.0, 0.0, 3.0), 0.5);
    let behind = Aabb::cube(Vec3::new(0.0, 0.0, 9.0), 0.5);
    let through = Aabb::cube(Vec3::new(0.0, 0.0, 5.0), 0.5);
    let mut capless = MsvbspPaper::new(PaperCaps::None, 512);
    capless.build(&window, &shadows_of(&window, std::slice::from_ref(&wall)));
    assert_eq!(capless.test_box(&before).verdict, Verdict::Hidden);
    for kind in Method::CULLERS {
        let culler = built(*kind, &window, std::slice::from_ref(&wall));
        let before = culler.test_box(&before).verdict;
        match kind {
            &Method::NONE => {}
            _ => {
                assert_eq!(before, Verdict::Unoccluded, "{}", kind.name());
                assert_eq!(culler.test_box(&behind).verdict, Verdict::Hidden, "{}", kind.name());
                assert_eq!(culler.test_box(&through).verdict, Verdict::PartlyHidden, "{}", kind.name());
            }
        }
    }
}

/// A box behind two walls that meet is hidden only by both together: that is what the trees are for.
#[test]
fn walls_that_meet_hide_together_what_none_hides_alone() {
    let window = straight(2.0, 0.01);
    let walls = [square(2.0, [-1.0, 0.0], [-1.0, 1.0]), square(2.0, [0.0, 1.0], [-1.0, 1.0])];
    let behind = Aabb::cube(Vec3::new(0.0, 0.0, 6.0), 1.0);
    for (kind, verdict) in [
        (RivalOcclusion::Frusta.into(), Verdict::PartlyHidden),
        (RivalOcclusion::Svbsp.into(), Verdict::Hidden),
        (RivalOcclusion::SvbspPaper.into(), Verdict::Hidden),
        (Method::Own(Occlusion::Msvbsp), Verdict::Hidden),
    ] {
        let culler = built(kind, &window, &walls);
        assert_eq!(culler.test_box(&behind).verdict, verdict, "{}", kind.name());
    }
}

/// The eye inside a box, a box around everything, a box behind the eye, boxes that are no boxes.
#[test]
fn boxes_without_an_outline_are_never_hidden() {
    let window = straight(2.0, 0.01);
    let wall = square(5.0, [-2.5, 2.5], [-2.5, 2.5]);
    let nan = f32::NAN;
    for culler in sound_cullers(&window, &shadows_of(&window, &[wall])) {
        for bounds in [
            Aabb::cube(Vec3::ZERO, 1.0),
            Aabb::cube(Vec3::Z * -0.5, 0.1),
            Aabb::cube(Vec3::Z * -5.0, 0.1),
            Aabb::cube(Vec3::ZERO, 1.0e30),
            Aabb::new(Vec3::NEG_INFINITY, Vec3::INFINITY),
            Aabb::EMPTY,
            Aabb::new(Vec3::splat(nan), Vec3::splat(nan)),
            Aabb::new(Vec3::new(-1.0, -1.0, nan), Vec3::new(1.0, 1.0, 20.0)),
        ] {
            assert!(!hides(&*culler, &bounds), "{} {bounds:?}", culler.name());
        }
    }
}

/// An occluder does not hide itself, nor what touches it.
#[test]
fn an_occluder_does_not_hide_itself() {
    let window = straight(2.0, 0.01);
    let corners = [[-3.0, -3.0, 4.0], [3.0, -3.0, 5.0], [3.0, 3.0, 7.0], [-3.0, 3.0, 6.0]];
    let tilted = corners.map(Vec3::from).to_vec();
    let bounds = Aabb::from_points(&tilted);
    for kind in Method::CULLERS {
        let culler = built(*kind, &window, std::slice::from_ref(&tilted));
        assert_ne!(culler.test_box(&bounds).verdict, Verdict::Hidden, "{}", kind.name());
        for corner in &tilted {
            let touching = Aabb::new(*corner, *corner);
            assert_ne!(culler.test_box(&touching).verdict, Verdict::Hidden, "{}", kind.name());
        }
    }
}

/// What sticks out of the window's edge is judged by its part inside only.
#[test]
fn a_box_across_the_windows_edge_is_judged_by_what_is_inside() {
    let window = straight(2.0, 0.01);
    let wall = square(5.0, [-2.5, 2.5], [-2.5, 2.5]);
    let culler = built(Method::Own(Occlusion::Msvbsp), &window, &[wall]);
    let across = Aabb::cube(Vec3::new(20.0, 0.0, 10.0), 6.0);
    assert_eq!(culler.test_box(&across).verdict, Verdict::Hidden);
}

/// A wall that reaches to the eye's own plane: what is nearer than the near plane is not drawn and hides nothing.
#[test]
fn what_the_near_plane_cuts_off_hides_nothing() {
    let window = straight(2.0, 1.0);
    // A wall at the right, along the view, from beside the eye to far away.
    let wall =
        [[-5.0, 0.0], [-5.0, 20.0], [5.0, 20.0], [5.0, 0.0]].map(|[y, z]| Vec3::new(1.0, y, z)).to_vec();
    assert_eq!(ShadowVolume::of_polygon(&wall, &window), Err(NotAnOccluder::CutByNear));
    let halves = shadows_of(&window, std::slice::from_ref(&wall));
    assert_eq!(halves.len(), 2);
    for half in halves {
        assert!(half.corners().iter().all(|v| v.z >= 1.0 - 1.0e-12), "{half:?}");
    }
    let own = [Occlusion::Msvbsp, Occlusion::Depth].map(Method::Own);
    for kind in [RivalOcclusion::Svbsp, RivalOcclusion::Frusta].map(Method::Rival).into_iter().chain(own) {
        let mut culler = kind.create(16);
        // At the window's right edge the wall is nearer than the near plane.
        let wrong = wrongly_hidden_per_mille(&mut *culler, &window, std::slice::from_ref(&wall), 6.0);
        assert_eq!(wrong, 0, "{}", kind.name());
    }
}

/// All of the window lies behind one plane of an occluder beside it.
#[test]
fn an_occluder_beside_the_window_hides_nothing_in_it() {
    let window = straight(2.0, 0.01);
    let (beside, across) = ([2.5, 3.5], [-1.0, 1.0]);
    let (left, below) = ([-3.5, -2.5], [-3.5, -2.5]);
    let occluders = [
        square(2.0, beside, across),
        square(2.0, left, across),
        square(2.0, across, beside),
        square(2.0, across, below),
        square(2.0, beside, below),
    ];
    // One that divides the window comes first: cells, too, lie behind a plane of what is beside them.
    let wall = square(1.5, [-1.9, -1.0], [-1.9, 1.9]);
    for occluder in &occluders {
        for polygons in [vec![occluder.clone()], vec![wall.clone(), occluder.clone()]] {
            for culler in sound_cullers(&window, &shadows_of(&window, &polygons)) {
                for i in 0..25 {
                    let at = Vec3::new((i % 5) as f32 * 0.5 - 0.5, (i / 5) as f32 * 0.8 - 1.6, 1.0) * 6.0;
                    let bounds = Aabb::cube(at, 0.1);
                    assert!(!is_blocked(&window, &polygons, window.from_eye(at)));
                    let verdict = culler.test_box(&bounds).verdict;
                    assert_ne!(verdict, Verdict::Hidden, "{}: {at} by {occluder:?}", culler.name());
                }
            }
        }
    }
}

/// What an occluder's planes leave of the window, or of a cell, may be a triangle.
#[test]
fn an_occluder_over_a_corner_of_the_window_hides_what_is_behind_it() {
    let window = straight(2.0, 0.01);
    let corner = seen_at(2.0, &[(3.5, -0.5), (5.0, 5.0), (-0.5, 3.5)]);
    let wall = square(1.5, [-1.9, -1.0], [-1.9, 1.9]);
    for polygons in [vec![corner.clone()], vec![wall, corner]] {
        for culler in sound_cullers(&window, &shadows_of(&window, &polygons)) {
            let behind = Aabb::cube(Vec3::new(1.8, 1.8, 1.0) * 6.0, 0.2);
            assert_eq!(culler.test_box(&behind).verdict, Verdict::Hidden, "{}", culler.name());
            let beside = Aabb::cube(Vec3::new(1.4, 1.4, 1.0) * 6.0, 0.2);
            assert_ne!(culler.test_box(&beside).verdict, Verdict::Hidden, "{}", culler.name());
        }
    }
}
