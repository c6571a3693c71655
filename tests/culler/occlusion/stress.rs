//! Random scenes made to be difficult; every "hidden" is recomputed.

use super::{
    judge::{is_blocked, points_of_ball, points_of_box},
    random::{ball, scenes, volume},
};
use osp::occlusion::{
    CoverageBuffer, Occlusion, OcclusionCuller, Soundness, Verdict,
    msvbsp::{Msvbsp, MsvbspConfig},
};
use osp_lab::Method;
use osp_rivals::occlusion::ShadowFrusta;

/// Scenes of each family: all the tests here together ask more than a million questions, in release builds of each culler.
const SCENES: u64 = if cfg!(debug_assertions) { 64 } else { 280 };
const VOLUMES: usize = 60;

/// What a culler answered and how often that was wrong.
#[derive(Debug, Default)]
struct Tally {
    asked: u64,
    hidden: u64,
    wrong: u64,
    example: Option<String>,
}

/// Asks a culler about volumes in every family of scenes and has each "hidden" judged.
fn tally(culler: &mut dyn OcclusionCuller, seed: u64) -> Tally {
    let mut tally = Tally::default();
    for (n, (name, mut random, scene)) in scenes(seed, SCENES).enumerate() {
        let (mut shadows, polygons) = scene.occluders();
        // The order of occluders changes the effect only.
        if n % 3 == 0 {
            (1..shadows.len()).rev().for_each(|i| shadows.swap(i, random.below(i + 1)));
        }
        culler.build(&scene.window, &shadows);
        for _ in 0..VOLUMES {
            let bounds = volume(&scene.window, &polygons, &mut random);
            let sphere = ball(&bounds);
            let hidden_box = culler.test_box(&bounds).verdict == Verdict::Hidden;
            let hidden_ball = culler.test_sphere(&sphere).verdict == Verdict::Hidden;
            tally.asked += 3;
            tally.hidden += u64::from(hidden_box) + u64::from(hidden_ball);
            let mut points = Vec::new();
            if hidden_box {
                points.extend(points_of_box(&scene.window, &bounds));
            }
            if hidden_ball {
                points.extend(points_of_ball(&scene.window, &sphere));
            }
            if let Some(x) = points.iter().find(|x| !is_blocked(&scene.window, &polygons, **x)) {
                tally.wrong += 1;
                tally.example.get_or_insert_with(|| format!("{name}: {x} of {bounds:?}"));
            }
        }
    }
    tally
}

fn assert_sound(culler: &mut dyn OcclusionCuller, seed: u64) {
    assert_eq!(culler.soundness(), Soundness::Conservative);
    let tally = tally(culler, seed);
    assert_eq!(tally.wrong, 0, "{}: {:?}", culler.name(), tally.example);
    // It must have been worth asking.
    assert!(tally.hidden * 200 > tally.asked, "{}: {} of {}", culler.name(), tally.hidden, tally.asked);
}

#[test]
fn random_stress_of_every_sound_culler_exposes_nothing() {
    for (i, kind) in Method::CULLERS.iter().enumerate() {
        let mut culler = kind.create(64);
        if *kind != Method::NONE
            && *kind != Occlusion::Depth.into()
            && culler.soundness() == Soundness::Conservative
        {
            assert_sound(&mut *culler, i as u64);
        }
    }
}

#[test]
fn random_stress_of_msvbsp_with_tiny_budgets_exposes_nothing() {
    for node_budget in [0, 1, 2, 5, 9, 14] {
        let mut culler = Msvbsp::new(MsvbspConfig { node_budget, ..MsvbspConfig::default() });
        assert_eq!(tally(&mut culler, 102).wrong, 0);
    }
    for point_budget in [0, 4, 30, 100, 300] {
        let mut culler = Msvbsp::new(MsvbspConfig { point_budget, ..MsvbspConfig::default() });
        assert_eq!(tally(&mut culler, 103).wrong, 0);
    }
}

#[test]
fn random_stress_of_outlines_in_a_picture_of_surfaces_exposes_nothing() {
    // Coarse pixels are the harder test, and the faster one.
    for (width, height) in [(64, 36), (256, 144)] {
        assert_sound(&mut CoverageBuffer::new(width, height), 104);
    }
}

#[test]
fn hidden_by_sphere_implies_by_box() {
    let mut culler = Msvbsp::new(MsvbspConfig::default());
    let (mut by_sphere, mut by_box) = (0, 0);
    for (_, mut random, scene) in scenes(0xF4, SCENES) {
        let (shadows, polygons) = scene.occluders();
        culler.build(&scene.window, &shadows);
        for _ in 0..VOLUMES {
            let bounds = volume(&scene.window, &polygons, &mut random);
            // A little more than the corners' distance: centre and radius are rounded.
            let around = osp::math::Sphere::around(&bounds);
            let rounding = around.center.abs().max_element() * 1.0e-6;
            let around = osp::math::Sphere { radius_m: around.radius_m * 1.001 + rounding, ..around };
            let hidden = |tested: osp::occlusion::Tested| tested.verdict == Verdict::Hidden;
            let answers = [hidden(culler.test_sphere(&around)), hidden(culler.test_box(&bounds))];
            assert!(answers[0] <= answers[1], "{answers:?} {bounds:?}");
            by_sphere += u32::from(answers[0]);
            by_box += u32::from(answers[1]);
        }
    }
    eprintln!("hidden by sphere {by_sphere}, box {by_box}");
    assert!(0 < by_sphere && by_sphere < by_box);
}

#[test]
fn one_occluder_hides_as_much_in_the_tree_as_alone() {
    let mut tree = Msvbsp::new(MsvbspConfig::default());
    let mut alone = ShadowFrusta::new(1);
    let mut hidden = 0;
    for (_, mut random, scene) in scenes(0xF5, SCENES) {
        let (shadows, polygons) = scene.occluders();
        for shadow in shadows.iter().take(3) {
            tree.build(&scene.window, std::slice::from_ref(shadow));
            alone.build(&scene.window, std::slice::from_ref(shadow));
            for _ in 0..VOLUMES / 3 {
                let bounds = volume(&scene.window, &polygons, &mut random);
                if alone.test_box(&bounds).verdict == Verdict::Hidden {
                    hidden += 1;
                    assert_eq!(tree.test_box(&bounds).verdict, Verdict::Hidden, "{bounds:?}");
                }
            }
        }
    }
    assert!(hidden > 100);
}
