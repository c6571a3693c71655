//! The oracle itself: it sees what is there, however small, and it catches who hides it.

use super::session::view;
use glam::Vec3;
use osp::{
    frame::StageClock,
    index::IndexConfig,
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, CullConfig, Occlusion, OcclusionCuller, PoolConfig, PreviousFrameOccluders,
        SelectConfig, ShadowVolume, Soundness, Tested, Verdict,
    },
    polygon::{ConvexPolygon, PolygonId},
    view::ViewWindow,
};
use osp_lab::Method;
use osp_lab::{
    oracle::{Oracle, OracleConfig, Sight, Subject},
    scenes::TestScene,
    verify::{Trial, Verifier, VerifyConfig},
};
use osp_rivals::IndexKind;
use osp_rivals::occlusion::{MsvbspPaper, PaperCaps};
use osp_session::{
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

fn square(center: Vec3, size: f32) -> ConvexPolygon {
    let at = |x: f32, y: f32| center + Vec3::new(x, y, 0.0) * (size * 0.5);
    ConvexPolygon::quad([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)])
}

fn sights(polygons: &[(ConvexPolygon, bool)], pixels: usize) -> Vec<Sight> {
    let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
    let subjects = polygons.iter().enumerate().map(|(i, (polygon, opaque))| Subject {
        id: PolygonId(i as u32),
        polygon: *polygon,
        occluder: opaque.then_some(*polygon),
    });
    let config = OracleConfig { width: pixels, height: pixels };
    Oracle::new(&window, subjects, config).answers().map(|(_, sight)| sight).collect()
}

#[test]
fn the_oracle_knows_before_from_behind() {
    let wall = square(Vec3::new(0.0, 0.0, -5.0), 2.0);
    let before = square(Vec3::new(0.0, 0.0, -4.0), 0.5);
    let behind = square(Vec3::new(0.0, 0.0, -6.0), 0.5);
    let beside = square(Vec3::new(2.0, 0.0, -6.0), 0.5);
    let outside = square(Vec3::new(50.0, 0.0, -6.0), 0.5);
    let across = square(Vec3::new(1.2, 0.0, -6.0), 0.5);
    for pixels in [16, 64, 1000] {
        use Sight::{Hidden, Outside, Visible};
        let list = [wall, before, behind, beside, outside, across].map(|p| (p, true));
        assert_eq!(sights(&list, pixels), [Visible, Visible, Hidden, Visible, Outside, Visible], "{pixels}");
        // Glass hides nothing, but is hidden.
        let list = [(wall, false), (behind, true), (before, false)];
        assert_eq!(sights(&list, pixels), [Visible, Visible, Visible]);
        let list = [(wall, true), (behind, false)];
        assert_eq!(sights(&list, pixels), [Visible, Hidden]);
    }
}

#[test]
fn the_oracle_sees_what_is_smaller_than_a_pixel() {
    // A thousandth of a pixel, before a wall, and another one behind it.
    let wall = square(Vec3::new(0.0, 0.0, -5.0), 20.0);
    let speck = square(Vec3::new(0.017, 0.023, -4.9), 1.0e-5);
    let hidden = square(Vec3::new(0.017, 0.023, -5.1), 1.0e-5);
    assert_eq!(
        sights(&[wall, speck, hidden].map(|p| (p, true)), 100),
        [Sight::Visible, Sight::Visible, Sight::Hidden]
    );
}

#[test]
fn the_oracle_sees_no_crack_between_neighbours() {
    // A wall of triangles that share edges, and a square behind each corner and edge.
    let mut polygons = Vec::new();
    let at =
        |x: i32, y: i32| Vec3::new(x as f32 * 0.37 - 1.9, y as f32 * 0.41 - 2.1, -5.0 - x as f32 * 0.013);
    for y in 0..10 {
        for x in 0..10 {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            polygons.push((ConvexPolygon::triangle(a, b, c), true));
            polygons.push((ConvexPolygon::triangle(a, c, d), true));
        }
    }
    let walls = polygons.len();
    for y in 2..8 {
        for x in 2..8 {
            polygons.push((square(at(x, y) * 1.3, 0.05), true));
            polygons.push((square((at(x, y) + at(x + 1, y)) * 0.65, 0.05), true));
        }
    }
    for pixels in [33, 200, 1001] {
        let sights = sights(&polygons, pixels);
        assert!(sights[..walls].iter().all(|s| *s == Sight::Visible));
        assert!(sights[walls..].iter().all(|s| *s == Sight::Hidden), "{pixels}");
    }
}

#[test]
fn of_polygons_in_one_place_all_are_visible() {
    let p = square(Vec3::new(0.0, 0.0, -5.0), 2.0);
    assert_eq!(sights(&[p, p, p].map(|p| (p, true)), 64), [Sight::Visible; 3]);
}

fn verified(
    scene: TestScene,
    kinds: Vec<Method>,
    add: impl FnOnce(&mut Verifier),
    occluders: usize,
    views: usize,
) -> Verifier {
    let config = VerifyConfig {
        kinds,
        occluders: vec![occluders],
        pool: PoolConfig::default(),
        select: SelectConfig::default(),
        cull: CullConfig::default(),
        oracle: OracleConfig { width: 640, height: 360 },
        repeats: 1,
    };
    let index = IndexKind::Osp.create(&IndexConfig::default());
    let mut verifier = Verifier::new(index, config, StageClock::default());
    add(&mut verifier);
    let (mut model, mut changes, mut moments) = (Scene::new(), Vec::new(), Vec::new());
    let mut moment = Moment::default();
    for event in scene.events() {
        model.apply(&event, &mut changes);
        moment.note(&event);
        if moment.head.is_some() {
            moments.push(moment);
        }
    }
    verifier.follow(&model, &changes);
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    for moment in moments.iter().take(views) {
        verifier.verify_view(&model, &camera.view(moment));
    }
    verifier
}

#[test]
fn no_sound_method_culls_what_is_visible_in_the_built_in_scenes() {
    let views = if cfg!(debug_assertions) { 1 } else { 24 };
    for scene in TestScene::ALL {
        let last = |verifier: &mut Verifier| {
            verifier.add_last(PreviousFrameOccluders::new(PreviousFrameOccluders::PICTURE, 0))
        };
        let verifier = verified(*scene, Method::conservative_cullers(), last, 64, views);
        assert_eq!(verifier.trials().last().map(Trial::name), Some("depth-last"));
        for trial in verifier.trials() {
            let totals = trial.totals();
            let name = format!("{} {}", scene.name(), trial.name());
            assert_eq!((totals.false_culls, totals.misreported), (0, 0), "{name}: {:?}", totals.first_false);
            assert!(totals.hidden > 0, "{name}");
        }
    }
}

#[test]
fn the_sound_tree_finds_what_it_is_made_for() {
    let views = if cfg!(debug_assertions) { 2 } else { 24 };
    for (scene, least) in [(TestScene::Rooms, 93.0), (TestScene::Panels, 73.0)] {
        let verifier = verified(scene, vec![Occlusion::Msvbsp.into()], |_| {}, 64, views);
        let found = verifier.trials()[0].totals().hidden_culled_percent();
        assert!(found >= least, "{}: {found:.1} % of the hidden polygons", scene.name());
    }
}

/// The paper's tree to the letter: without caps, it hides what lies before an occluder, too.
fn capless_paper() -> Box<dyn OcclusionCuller> {
    Box::new(MsvbspPaper::new(PaperCaps::None, 2048))
}

/// Promises what it does not keep.
struct Liar;

impl OcclusionCuller for Liar {
    fn name(&self) -> &'static str {
        "liar"
    }

    fn build(&mut self, _: &ViewWindow, _: &[ShadowVolume]) -> BuildCounts {
        BuildCounts::default()
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        let verdict = if bounds.center().x > 6.0 { Verdict::Hidden } else { Verdict::PartlyHidden };
        Tested { verdict, steps: 1 }
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.test_box(&Aabb::cube(sphere.center, sphere.radius_m))
    }
}

#[test]
fn a_method_that_breaks_its_promise_fails_and_one_that_promises_nothing_does_not() {
    let add = |verifier: &mut Verifier| {
        verifier.add(capless_paper(), 64);
        verifier.add(Box::new(Liar), 64);
    };
    let verifier = verified(TestScene::Rooms, vec![Method::NONE], add, 64, 2);
    let failed: Vec<_> = verifier.trials().iter().map(|t| (t.name(), t.failed())).collect();
    assert_eq!(failed, [("none", false), ("msvbsp-paper-capless", false), ("liar", true)]);
    assert!(verifier.trials()[1].totals().false_culls > 0);
    assert!(verifier.trials()[2].totals().first_false.is_some());
}

/// A coarse picture, too: every frame of the camera at rest is compared.
#[test]
fn what_was_visible_last_is_compared_with_the_truth() {
    for (pixels, least) in [(PreviousFrameOccluders::PICTURE, 80.0), ([64, 36], 10.0)] {
        let last = |verifier: &mut Verifier| verifier.add_last(PreviousFrameOccluders::new(pixels, 10_000));
        let verifier = verified(TestScene::Rooms, Vec::new(), last, 64, 3);
        let trial = &verifier.trials()[0];
        let totals = trial.totals();
        assert_eq!((trial.soundness(), trial.failed()), (Soundness::Conservative, false));
        assert_eq!((totals.false_culls, totals.first_false), (0, None), "{pixels:?}: {totals:?}");
        // What the first frame has drawn hides most in the next ones, where each view is a jump from the last.
        assert!(totals.hidden_culled_percent() > least, "{}", totals.hidden_culled_percent());
        assert_eq!((totals.views, totals.misreported), (3, 0));
        assert!(totals.occluders > 0 && totals.planes > 0 && totals.polygon_tests > 0);
    }
}
