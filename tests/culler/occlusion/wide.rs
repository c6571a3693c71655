//! Boxes that are tested sixteen at a time, and from the cell of a box around them, get the answers that each gets alone.

use glam::Vec3;
use osp::{
    math::Aabb,
    occlusion::{Cell, Needed, Occlusion, Verdict},
};
use osp_lab::Method;

use super::random::{Random, scenes, volume};

const SCENES: u64 = 48;

/// A part of a box.
fn part(bounds: &Aabb, random: &mut Random) -> Aabb {
    let mut at =
        || bounds.min + bounds.extent() * Vec3::from_array(std::array::from_fn(|_| random.unit() as f32));
    let (a, b) = (at().clamp(bounds.min, bounds.max), at().clamp(bounds.min, bounds.max));
    Aabb { min: a.min(b), max: a.max(b) }
}

#[test]
fn sixteen_boxes_at_once_get_the_answers_of_one_at_a_time() {
    let (mut found, mut wanted) = (0, 0);
    let (mut hidden, mut steps, mut planes, mut alone, mut inside) = (0, 0, 0, 0, 0);
    for kind in Method::CULLERS {
        let mut culler = kind.create(64);
        for (name, mut random, scene) in scenes(977, SCENES) {
            let (shadows, polygons) = scene.occluders();
            culler.build(&scene.window, &shadows);
            for _ in 0..6 {
                let outer = volume(&scene.window, &polygons, &mut random);
                let (outer_test, cell) = culler.test_box_in(&outer, Cell::ALL);
                assert_eq!(outer_test.verdict, culler.test_box(&outer).verdict, "{} {name}", kind.name());
                let count = random.below(17);
                let boxes: Vec<Aabb> = (0..count).map(|_| part(&outer, &mut random)).collect();
                let expected: Vec<_> = boxes.iter().map(|bounds| culler.test_box(bounds)).collect();
                let is_hidden = |i: usize| expected.get(i).is_some_and(|t| t.verdict == Verdict::Hidden);
                let mask = (0..16).fold(0, |mask, i| mask | u16::from(is_hidden(i)) << i);
                let tested = culler.test_boxes(&boxes, Cell::ALL, Needed::Hidden);
                assert_eq!(tested.hidden, mask, "{} {name}: {boxes:?}", kind.name());
                let from_cell = culler.test_boxes(&boxes, cell, Needed::Hidden);
                assert_eq!(from_cell.hidden, mask, "{} {name}, from a cell: {boxes:?}", kind.name());
                let verdicts = culler.test_boxes(&boxes, cell, Needed::Verdict);
                assert_eq!(verdicts.hidden, mask, "{} {name}, verdicts: {boxes:?}", kind.name());
                for (i, alone) in expected.iter().enumerate() {
                    let is_unoccluded = verdicts.unoccluded >> i & 1 == 1;
                    assert!(!is_unoccluded || alone.verdict == Verdict::Unoccluded, "{name}");
                    found += u32::from(is_unoccluded);
                    wanted += u32::from(alone.verdict == Verdict::Unoccluded);
                }
                for (bounds, alone) in boxes.iter().zip(&expected) {
                    assert_eq!(culler.test_box_in(bounds, cell).0.verdict, alone.verdict, "{name}");
                }
                if *kind == Occlusion::Msvbsp.into() {
                    hidden += mask.count_ones();
                    alone += expected.iter().map(|t| t.steps).sum::<u32>();
                    (steps, planes) = (steps + tested.steps, planes + tested.planes);
                    inside += from_cell.planes;
                }
            }
        }
    }
    assert!(hidden > 500, "{hidden}");
    assert!(wanted > 500 && found * 100 > wanted * 99, "{found} of {wanted} unoccluded");
    assert!(steps <= alone, "no box is tested more often than alone: {steps} of {alone}");
    assert!(planes * 3 < alone, "a plane is read once for many boxes: {planes} of {alone}");
    assert!(
        inside * 10 < planes * 9,
        "what is known of the box around them is not tested again: {inside} of {planes}"
    );
}

#[test]
fn boxes_that_are_not_finite_are_not_hidden_in_company_either() {
    let (_, _, scene) = scenes(5, 1).nth(1).expect("tiles");
    let (shadows, _) = scene.occluders();
    for kind in Method::CULLERS {
        let mut culler = kind.create(64);
        culler.build(&scene.window, &shadows);
        let far = Vec3::splat(f32::INFINITY);
        let bad = [
            Aabb { min: Vec3::NAN, max: Vec3::NAN },
            Aabb { min: -far, max: far },
            Aabb { min: far, max: far },
        ];
        assert_eq!(culler.test_boxes(&bad, Cell::ALL, Needed::Verdict).hidden, 0, "{}", kind.name());
        assert_eq!(culler.test_boxes(&[], Cell::ALL, Needed::Hidden).hidden, 0, "{}", kind.name());
    }
}
