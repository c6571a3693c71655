//! What is asked about what the frustum has culled: verification notices a loss, and there is none, also far away.

use super::far_from_origin::turn;
use glam::{UVec3, Vec3};
use osp::{
    frame::StageClock,
    index::{IndexConfig, SpatialIndex},
    math::Aabb,
    occlusion::{CullConfig, Occlusion, PoolConfig, SelectConfig},
    polygon::{Change, PolygonId},
    view::{Projection, View},
};
use osp_lab::{
    Method, lost_polygons,
    oracle::OracleConfig,
    pvs::{BakeConfig, Baker, ViewCells},
    verify::{Verifier, VerifyConfig},
};
use osp_rivals::IndexKind;
use osp_session::scene::Scene;
use osp_testkit::{Altered, Random, events::polygon};

/// Quads in a cube of 4 m around a place, a few of them large. Their corners lie on a grid of `points_a_metre`.
/// Wherever `f32` can represent all grid points, the quads have the same shape to the last bit.
fn model(at: Vec3, points_a_metre: f32) -> (Scene, Vec<Change>) {
    let mut random = Random::new(11);
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for i in 0..3000 {
        let on_grid = |v: Vec3| (v * points_a_metre).round() / points_a_metre;
        let corner = on_grid((random.in_cube() * 2.0).as_vec3());
        let size = if i % 30 == 0 { 1.5 } else { 8.0 / f64::from(points_a_metre) };
        let [a, b] = [(); 2].map(|()| on_grid((random.in_cube() * size).as_vec3()));
        let vertices = [corner, corner + a, corner + a + b, corner + b].map(|p| p + at).to_vec();
        scene.apply(&polygon(None, vertices, (0.5, 0.5, 0.5, 1.0)), &mut changes);
    }
    (scene, changes)
}

fn verifier(index: Box<dyn SpatialIndex>, kinds: Vec<Method>) -> Verifier {
    let config = VerifyConfig {
        kinds,
        occluders: vec![32],
        pool: PoolConfig::default(),
        select: SelectConfig::default(),
        cull: CullConfig::default(),
        oracle: OracleConfig { width: 320, height: 240 },
        repeats: 1,
    };
    Verifier::new(index, config, StageClock::default())
}

fn view(random: &mut Random, at: Vec3) -> View {
    let eye = at + (random.in_cube() * 1.5).as_vec3();
    let projection = Projection::symmetric(40.0, 1.3, 0.05, 20.0);
    View { eye_in_world: eye, world_from_view: turn(random), projection }
}

#[test]
fn verification_notices_what_the_frustum_loses() {
    let (scene, changes) = model(Vec3::ZERO, 128.0);
    let looking_at_it =
        View::look_at(Vec3::new(0.0, 0.0, 6.0), Vec3::ZERO, Projection::symmetric(60.0, 1.0, 0.1, 20.0));
    let in_view = |id| looking_at_it.frustum().may_see(&scene.bounds(id));
    assert!(scene.visible_ids().all(in_view), "all of the model is in view");
    let away = View::look_at(Vec3::new(0.0, 0.0, 6.0), Vec3::Z * 9.0, looking_at_it.projection);
    let lost = PolygonId(1234);
    let mut verifier = verifier(Box::new(Altered::by(move |list| list.retain(|&id| id != lost))), Vec::new());
    verifier.follow(&scene, &changes);
    verifier.verify_view(&scene, &away);
    assert_eq!((verifier.views().lost, verifier.views().first_lost), (0, None), "it is not in view");
    verifier.verify_view(&scene, &looking_at_it);
    verifier.verify_view(&scene, &looking_at_it);
    assert_eq!((verifier.views().lost, verifier.views().first_lost), (2, Some((1, lost))));
    // Erased polygons and such as cannot be drawn are not missed.
    let some: Vec<PolygonId> = scene.visible_ids().filter(|id| id.0 % 3 != 0).collect();
    let lost = lost_polygons(&scene, &looking_at_it, &some);
    assert!(lost.len() > 900 && lost.len() + some.len() == scene.visible_ids().count());
    assert!(lost.iter().all(|id| id.0 % 3 == 0));
    assert_eq!(lost_polygons(&Scene::new(), &looking_at_it, &[]), []);
}

/// With every polygon asked about, in view or not.
#[test]
fn no_sound_method_loses_a_polygon_far_from_the_origin() {
    let mut random = Random::new(12);
    for place_m in [0.0, 3.0e3, 65536.0] {
        let at = Vec3::new(place_m, -place_m, place_m * 0.5);
        let (scene, changes) = model(at, 128.0);
        let kinds = vec![Occlusion::Msvbsp.into(), Occlusion::Depth.into()];
        let mut verifier = verifier(IndexKind::Osp.create(&IndexConfig::default()), kinds);
        verifier.follow(&scene, &changes);
        for _ in 0..if place_m > 1.0e3 { 12 } else { 3 } {
            verifier.verify_view(&scene, &view(&mut random, at));
        }
        assert_eq!(verifier.views().first_lost, None, "{place_m} m");
        for trial in verifier.trials() {
            let totals = trial.totals();
            assert_eq!((totals.false_culls, totals.misreported), (0, 0), "{place_m} m: {}", trial.name());
            assert!(totals.hidden > 0, "{place_m} m: nothing is hidden");
        }
    }
}

/// Sets of what can be seen from where are the same wherever the model stands.
#[test]
fn cells_far_from_the_origin_see_the_same() {
    let sets = |at: Vec3| {
        let (scene, changes) = model(at, 16.0);
        let mut index = IndexKind::Osp.create(&IndexConfig::default());
        for change in changes {
            if let Change::Insert(id) = change {
                index.insert(id, &scene.bounds(id)).expect("a finite box");
            }
        }
        index.commit();
        let cells = ViewCells { min: at - Vec3::ONE, side_m: 1.0, count: UVec3::splat(2) };
        let bounds = scene.visible_ids().fold(Aabb::EMPTY, |all, id| all.union(&scene.bounds(id)));
        let baker = Baker::new(&scene, &bounds, cells, BakeConfig { samples: 3, pixels: 96 });
        (0..cells.len()).map(|cell| baker.cell(cell, &*index)).collect::<Vec<_>>()
    };
    assert_eq!(sets(Vec3::new(524_288.0, 262_144.0, -524_288.0)), sets(Vec3::ZERO));
}
