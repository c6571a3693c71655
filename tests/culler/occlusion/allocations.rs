//! Steady builds allocate nothing, and work is bounded by budgets.

use super::random::{scenes, volume};
use osp::occlusion::{
    OcclusionCuller,
    msvbsp::{Msvbsp, MsvbspConfig},
};
use osp_lab::Method;
use osp_testkit::allocations;

#[test]
fn steady_builds_and_queries_allocate_nothing() {
    for kind in Method::CULLERS {
        let mut culler = kind.create(64);
        for warm in [true, false] {
            for (_, mut random, scene) in scenes(0xA110C, 4) {
                let (shadows, polygons) = scene.occluders();
                let bounds = volume(&scene.window, &polygons, &mut random);
                let before = allocations();
                culler.build(&scene.window, &shadows);
                std::hint::black_box(culler.test_box(&bounds));
                std::hint::black_box(culler.test_sphere(&osp::math::Sphere::around(&bounds)));
                let made = allocations() - before;
                assert!(warm || made == 0, "{}: {made} allocations", kind.name());
            }
        }
    }
}

#[test]
fn the_tree_is_bounded_by_its_budget() {
    for node_budget in [0, 1, 7, 64, 500] {
        let mut culler = Msvbsp::new(MsvbspConfig { node_budget, ..MsvbspConfig::default() });
        let mut left_out = 0;
        for (_, _, scene) in scenes(0, 20) {
            let counts = culler.build(&scene.window, &scene.occluders().0);
            assert!(counts.nodes as usize <= node_budget, "{counts:?}");
            left_out += counts.left_out;
        }
        assert!(node_budget >= 64 || left_out > 0, "a budget of {node_budget} was never felt");
    }
}
