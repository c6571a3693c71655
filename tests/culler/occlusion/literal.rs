//! The paper's ways to test a node and to score an occluder: what they find, and which of them may be believed.

use super::{
    random::{Polygon, scenes, shadows_of, straight, volume},
    session::{Told, polygon, view},
};
use glam::Vec3;
use osp::{
    math::Aabb,
    occlusion::{
        Cell, Grouping, Needed, OccluderPool, Occlusion, OcclusionCuller, PoolConfig, Score, SelectConfig,
        Selector, Soundness, Verdict,
    },
};
use osp_lab::Method;
use osp_lab::literal::CornersApart;
use osp_rivals::RivalOcclusion;

/// A rectangle in the plane z = `distance`, from the origin along +z.
fn rectangle(distance: f32, x: [f32; 2], y: [f32; 2]) -> Polygon {
    [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])].map(|(x, y)| Vec3::new(x, y, distance)).to_vec()
}

fn build(culler: &mut dyn OcclusionCuller, polygons: &[Polygon]) {
    let window = straight(2.0, 0.01);
    let shadows = shadows_of(&window, polygons);
    assert_eq!(shadows.len(), polygons.len());
    culler.build(&window, &shadows);
}

/// Figure 14, on the left: all eight corners of the large box are hidden, and its middle is in plain sight.
#[test]
fn eight_corners_are_tested_in_one_shadow_or_they_hide_what_is_visible() {
    let walls = [rectangle(2.0, [-3.0, -1.0], [-3.0, 3.0]), rectangle(2.0, [1.0, 3.0], [-3.0, 3.0])];
    let spanning = Aabb::new(Vec3::new(-3.0, -0.2, 4.0), Vec3::new(3.0, 0.2, 4.2));
    let behind_one = Aabb::new(Vec3::new(2.5, -0.2, 4.0), Vec3::new(3.0, 0.2, 4.2));
    for kind in Method::conservative_cullers() {
        let mut culler = kind.create(4);
        build(&mut *culler, &walls);
        assert_ne!(culler.test_corners(&spanning).verdict, Verdict::Hidden, "{}", kind.name());
        assert_eq!(culler.test_corners(&behind_one).verdict, Verdict::Hidden, "{}", kind.name());
        let apart = CornersApart::new(culler);
        assert_eq!(apart.test_corners(&spanning).verdict, Verdict::Hidden, "{}: the paper's", kind.name());
        assert_ne!(apart.test_box(&spanning).verdict, Verdict::Hidden, "{}", kind.name());
        assert!(matches!(apart.soundness(), Soundness::Unsound(_)));
    }
}

/// Two walls without a gap: the box that both hide together is found, its corners are not in one shadow.
#[test]
fn corners_find_at_most_what_the_box_finds() {
    let walls = [rectangle(2.0, [-3.0, 0.0], [-3.0, 3.0]), rectangle(2.0, [0.0, 3.0], [-3.0, 3.0])];
    let spanning = Aabb::new(Vec3::new(-1.0, -0.2, 4.0), Vec3::new(1.0, 0.2, 4.2));
    for kind in [RivalOcclusion::Svbsp.into(), Method::Own(Occlusion::Msvbsp)] {
        let mut culler = kind.create(4);
        build(&mut *culler, &walls);
        assert_eq!(culler.test_box(&spanning).verdict, Verdict::Hidden, "{}", kind.name());
        assert_ne!(culler.test_corners(&spanning).verdict, Verdict::Hidden, "{}", kind.name());
    }
    let mut hidden = [0, 0];
    for kind in Method::conservative_cullers() {
        let mut culler = kind.create(64);
        for (_, mut random, scene) in scenes(0xC0, 20) {
            let (shadows, polygons) = scene.occluders();
            culler.build(&scene.window, &shadows);
            for _ in 0..50 {
                let bounds = volume(&scene.window, &polygons, &mut random);
                let by_corners = culler.test_corners(&bounds).verdict == Verdict::Hidden;
                let by_box = culler.test_box(&bounds).verdict == Verdict::Hidden;
                assert!(by_corners <= by_box, "{}: {bounds:?}", kind.name());
                hidden[0] += u32::from(by_corners);
                hidden[1] += u32::from(by_box);
            }
        }
    }
    assert!(0 < hidden[0] && hidden[0] < hidden[1], "{hidden:?}");
}

/// Two walls that share an edge are one to the paper. Each is before the other's plane, or behind it.
#[test]
fn a_group_hides_what_lies_behind_all_its_walls() {
    let edge = [Vec3::new(0.0, -2.0, 3.0), Vec3::new(0.0, 2.0, 3.0)];
    let wall = |x: f32, z: f32| vec![edge[0], Vec3::new(x, -2.0, z), Vec3::new(x, 2.0, z), edge[1]];
    let roof = [wall(-3.0, 5.0), wall(3.0, 5.0)];
    let mut culler = RivalOcclusion::MsvbspPaper.culler()(4);
    build(&mut *culler, &roof);
    let cube = |x: f32, z: f32| Aabb::cube(Vec3::new(x, 0.0, z), 0.2);
    // The planes of the walls go on: what lies across one is behind the other.
    let (behind_both, behind_one) = ([cube(-0.5, 6.0), cube(0.5, 6.0)], [cube(-1.0, 3.6), cube(1.0, 3.6)]);
    for bounds in behind_both {
        assert_eq!(culler.test_box(&bounds).verdict, Verdict::Hidden, "{bounds:?}");
    }
    for bounds in behind_one {
        assert_ne!(culler.test_box(&bounds).verdict, Verdict::Hidden, "{bounds:?}");
    }
    let boxes = [behind_both, behind_one].concat();
    let tested = culler.test_boxes(&boxes, Cell::ALL, Needed::Verdict);
    assert_eq!((tested.hidden, tested.unoccluded & 0b11), (0b11, 0));
}

/// Equation (1) takes the whole area of a wall of which the window shows a corner.
#[test]
fn the_scores_choose_different_occluders() {
    let walls = [[2.2, 30.0], [-1.0, 1.0]].map(|x| polygon(&rectangle(-5.0, x, [-1.0, 1.0]), 1.0));
    let told = Told::of(&walls);
    let mut pool = OccluderPool::new(PoolConfig { grouping: Grouping::Single, ..PoolConfig::default() });
    pool.follow(&told.scene, &told.changes);
    let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
    let best = |score: Score, occluders: usize| -> Vec<f64> {
        let mut selector = Selector::new(SelectConfig { score, occluders, ..SelectConfig::default() });
        let counts = selector.select(&pool, &told.scene, &window);
        assert_eq!(counts.chosen as usize, selector.chosen().len());
        selector.chosen().iter().map(|shadow| shadow.solid_angle_in(&window)).collect()
    };
    let (paper, measured) = (best(Score::Paper, 1), best(Score::SolidAngle, 1));
    assert_eq!((paper.len(), measured.len()), (1, 1));
    assert!(paper[0] < measured[0], "{paper:?} {measured:?}");
    // With room for both, the order is all that differs.
    let (mut paper, measured) = (best(Score::Paper, 2), best(Score::SolidAngle, 2));
    paper.reverse();
    assert_eq!(paper, measured);
}
