//! Lights have the same entities in their shadow views with the plugin as without.

#![cfg(feature = "light")]

mod twins;

use bevy_app::App;
use bevy_asset::Handle;
use bevy_camera::{
    Camera, Camera3d, PerspectiveProjection, Projection,
    primitives::{Aabb, Sphere},
    visibility::{
        CascadesVisibleEntities, CubemapVisibleEntities, NoFrustumCulling, RenderLayers, ViewVisibility,
        Visibility, VisibilityRange, VisibleMeshEntities,
    },
};
use bevy_ecs::{component::Component, entity::Entity};
use bevy_light::{CascadeShadowConfigBuilder, DirectionalLight, NotShadowCaster, PointLight, SpotLight};
use bevy_math::{Quat, Vec3, Vec3A};
use bevy_mesh::{Mesh, Mesh3d};
use bevy_osp::{OspCulling, OspCullingSettings};
use bevy_transform::components::{GlobalTransform, Transform};
use rand_pcg::{
    Pcg64Mcg,
    rand_core::{Rng, SeedableRng},
};
use twins::{Twins, new_app};

/// Number of entities of a world.
const COUNT: usize = 600;

#[derive(Component)]
struct Caster;

fn signed(random: &mut Pcg64Mcg) -> f32 {
    random.next_u32() as f32 / u32::MAX as f32 * 2.0 - 1.0
}

fn vector(random: &mut Pcg64Mcg, reach: f32) -> Vec3 {
    Vec3::new(signed(random), signed(random), signed(random)) * reach
}

/// Spawns the same random world in every app that gets an equal generator; returns the entities.
fn spawn(app: &mut App, random: &mut Pcg64Mcg) -> Vec<Entity> {
    let eyes = [Vec3::ZERO, Vec3::new(20.0, 5.0, 0.0)];
    for (order, eye) in eyes.into_iter().enumerate() {
        let turn = Quat::from_rotation_y(signed(random) * 3.0);
        let far_m = PerspectiveProjection { far: 80.0, ..Default::default() };
        app.world_mut().spawn((
            Camera3d::default(),
            Camera { order: order as isize, ..Camera::default() },
            Projection::Perspective(far_m),
            Transform::from_translation(eye).with_rotation(turn),
        ));
    }
    for is_lit in [true, false] {
        let cascades =
            CascadeShadowConfigBuilder { num_cascades: 3, maximum_distance: 60.0, ..Default::default() };
        let light = DirectionalLight { shadow_maps_enabled: is_lit, ..DirectionalLight::default() };
        let way = vector(random, 1.0).normalize_or(Vec3::NEG_Y);
        let mut light =
            app.world_mut().spawn((light, cascades.build(), Transform::default().looking_to(way, Vec3::X)));
        if !is_lit {
            light.insert(RenderLayers::layer(1));
        }
    }
    (0..COUNT)
        .map(|i| {
            let half_extents = Vec3A::from(vector(random, 1.5).abs());
            let transform = Transform::from_translation(vector(random, 60.0))
                .with_rotation(Quat::from_rotation_x(signed(random)));
            let mut entity = app.world_mut().spawn((Caster, transform, Visibility::default()));
            if i % 50 != 0 {
                entity.insert(Mesh3d(Handle::<Mesh>::default()));
            }
            match i % 20 {
                // Without a box, or with a sphere alone.
                0 => {}
                1 => {
                    entity.insert(Sphere { center: transform.translation.into(), radius: 1.0 });
                }
                _ => {
                    entity.insert(Aabb { center: Vec3A::ZERO, half_extents });
                }
            }
            match i % 23 {
                3 => drop(entity.insert(NotShadowCaster)),
                4 => drop(entity.insert(NoFrustumCulling)),
                5 => drop(entity.insert(RenderLayers::from_layers(&[1]))),
                6 => drop(entity.insert(VisibilityRange::abrupt(0.0, 40.0))),
                7 => drop(entity.insert(Visibility::Hidden)),
                8 => drop(entity.remove::<ViewVisibility>()),
                9 => drop(entity.remove::<GlobalTransform>()),
                _ => {}
            }
            entity.id()
        })
        .collect()
}

/// The entities in each cascade of each light and view.
fn seen(app: &mut App) -> Vec<(Entity, Entity, Vec<Vec<Entity>>)> {
    let world = app.world_mut();
    let mut lights = Vec::new();
    for (light, lists) in world.query::<(Entity, &CascadesVisibleEntities)>().iter(world) {
        for (view, cascades) in &lists.entities {
            lights.push((light, *view, cascades.iter().map(|list| list.entities.clone()).collect()));
        }
    }
    lights.sort();
    lights
}

#[test]
fn each_cascade_has_the_entities_that_bevy_finds() {
    let passes = OspCullingSettings { most_found: 0.0, ..OspCullingSettings::always() };
    for (seed, settings) in
        [(1, OspCullingSettings::always()), (2, OspCullingSettings::always()), (3, passes)]
    {
        let mut apps = [new_app(None), new_app(Some(settings.clone()))];
        let (mut ids, mut twins) = (Vec::new(), Twins::new());
        for app in &mut apps {
            ids = spawn(app, &mut Pcg64Mcg::seed_from_u64(seed));
        }
        let mut random = Pcg64Mcg::seed_from_u64(seed + 100);
        let mut sizes = [0_usize; 3];
        for frame in 0..30 {
            let moved: Vec<_> = (0..10).map(|i| ids[(frame * 31 + i * 57) % COUNT]).collect();
            let by = vector(&mut random, 20.0);
            for app in &mut apps {
                for id in &moved {
                    app.world_mut().get_mut::<Transform>(*id).expect("a place").translation += by;
                }
                app.update();
            }
            let [bevy, osp] = apps.each_mut().map(seen);
            assert_eq!(bevy, osp, "seed {seed}, frame {frame}");
            twins.compare(&mut apps, &format!("seed {seed}, frame {frame}"));
            for (size, list) in sizes.iter_mut().zip(bevy.iter().flat_map(|(_, _, lists)| lists)) {
                *size += list.len();
            }
        }
        // Every cascade has some entities, and none has all.
        assert!(sizes.iter().all(|size| (1..COUNT * 30).contains(size)), "{sizes:?}");
        let counts = *apps[1].world().resource::<OspCulling>().counts();
        let by_index = settings.most_found > 0.0;
        assert_eq!((counts.shadows_by_index, counts.shadows_by_pass), if by_index { (6, 0) } else { (0, 6) });
    }
}

/// Ranges in metres of the point lights and the spot lights of a world; the last has no shadows.
const RANGES_M: [f32; 5] = [2.0, 5.0, 20.0, 1.0e3, 20.0];

fn spawn_lamps(app: &mut App, random: &mut Pcg64Mcg) {
    for (i, range) in RANGES_M.into_iter().enumerate() {
        let shadow_maps_enabled = i + 1 < RANGES_M.len();
        let place = Transform::from_translation(vector(random, 15.0))
            .with_rotation(Quat::from_rotation_y(signed(random) * 3.0));
        let outer_angle = 0.3 + 0.3 * i as f32;
        let bulb = PointLight { shadow_maps_enabled, range, ..PointLight::default() };
        let spot = SpotLight { shadow_maps_enabled, range, outer_angle, ..SpotLight::default() };
        app.world_mut().spawn((bulb, place));
        // A long box outside the range, which Bevy's test of a sphere and a box keeps, and a box that just reaches into
        // the range.
        let pole = (Vec3::new(2.5, 2.5, 0.0), Vec3A::new(0.5, 50.0, 0.5));
        for (way, half_extents) in [pole, (Vec3::X * 1.04, Vec3A::splat(0.05))] {
            let beside = Transform::from_translation(place.translation + way * range);
            let aabb = Aabb { center: Vec3A::ZERO, half_extents: half_extents * range };
            app.world_mut().spawn((Mesh3d(Handle::<Mesh>::default()), aabb, beside, Visibility::default()));
        }
        let mut spot = app.world_mut().spawn((spot, place));
        if i == 1 {
            spot.insert(RenderLayers::from_layers(&[0, 1]));
        }
    }
}

/// The six lists of each point light with its position and range, and the list of each spot light.
type Lamps = (Vec<(Vec3, f32, Vec<Vec<Entity>>)>, Vec<(Entity, Vec<Entity>)>);

fn lamps(app: &mut App) -> Lamps {
    let world = app.world_mut();
    let mut bulbs = world.query::<(&PointLight, &GlobalTransform, &CubemapVisibleEntities)>();
    let faces = |lists: &CubemapVisibleEntities| lists.iter().map(|list| list.entities.clone()).collect();
    let bulbs = bulbs
        .iter(world)
        .map(|(bulb, place, lists)| (place.translation(), bulb.range, faces(lists)))
        .collect();
    let mut spots = world.query::<(Entity, &VisibleMeshEntities)>();
    let mut spots: Vec<_> = spots.iter(world).map(|(spot, list)| (spot, list.entities.clone())).collect();
    spots.sort_unstable();
    (bulbs, spots)
}

/// Whether an entity has a box that lies outside the cube around the range of a light.
fn is_beyond(app: &App, entity: Entity, center: Vec3, range: f32) -> bool {
    let entity = app.world().entity(entity);
    let (Some(aabb), Some(place)) = (entity.get::<Aabb>(), entity.get::<GlobalTransform>()) else {
        return false;
    };
    let corners: Vec<_> = (0..8_u8)
        .map(|i| {
            let sign = |bit: u8| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = aabb.center + aabb.half_extents * Vec3A::new(sign(0), sign(1), sign(2));
            (place.transform_point(corner.into()) - center).as_dvec3()
        })
        .collect();
    let range = f64::from(range);
    !entity.contains::<NoFrustumCulling>()
        && (0..3).any(|i| {
            corners.iter().all(|corner| corner[i] > range) || corners.iter().all(|corner| corner[i] < -range)
        })
}

/// For a point light, the plugin skips entities outside the cube around its range. Otherwise its lists equal Bevy's.
#[test]
fn each_lamp_has_the_entities_that_bevy_finds_in_its_range() {
    let passes = OspCullingSettings { most_found: 0.0, ..OspCullingSettings::always() };
    let mut beyond = 0;
    for (seed, settings) in (1..5).map(|seed| (seed, OspCullingSettings::always())).chain([(5, passes)]) {
        let mut apps = [new_app(None), new_app(Some(settings.clone()))];
        let mut ids = Vec::new();
        for app in &mut apps {
            let random = &mut Pcg64Mcg::seed_from_u64(seed);
            ids = spawn(app, random);
            spawn_lamps(app, random);
        }
        let mut random = Pcg64Mcg::seed_from_u64(seed + 100);
        let (mut most, mut listed) = (0, 0);
        for frame in 0..30 {
            let by = vector(&mut random, 20.0);
            for app in &mut apps {
                for i in 0..10 {
                    let id = ids[(frame * 31 + i * 57) % COUNT];
                    app.world_mut().get_mut::<Transform>(id).expect("a place").translation += by;
                }
                app.update();
            }
            let [mut bevy, osp] = apps.each_mut().map(lamps);
            for (center, range, list) in bevy
                .0
                .iter_mut()
                .flat_map(|(center, range, lists)| lists.iter_mut().map(|l| (*center, *range, l)))
            {
                let all = list.len();
                list.retain(|id| !is_beyond(&apps[0], *id, center, range));
                beyond += all - list.len();
                most = most.max(list.len());
                listed += list.len();
            }
            for ((at, range, bevys), (_, _, ours)) in bevy.0.iter().zip(&osp.0) {
                for (bevys, ours) in bevys.iter().zip(ours) {
                    assert_eq!(bevys, ours, "seed {seed}, frame {frame}, light at {at}, range {range}");
                }
            }
            assert_eq!(bevy.1, osp.1, "seed {seed}, frame {frame}");
            listed += osp.1.iter().map(|(_, list)| list.len()).sum::<usize>();
            for id in &ids {
                let [bevys, ours] = apps
                    .each_ref()
                    .map(|app| app.world().get::<ViewVisibility>(*id).is_some_and(|v| v.get()));
                let is_listed = || osp.0.iter().flat_map(|(_, _, lists)| lists).any(|list| list.contains(id));
                assert!(if ours { bevys } else { !is_listed() }, "seed {seed}, frame {frame}, {id}");
            }
        }
        assert!(most > 50 && listed > 1000, "{most} {listed}");
        let counts = *apps[1].world().resource::<OspCulling>().counts();
        let by_pass = settings.most_found == 0.0;
        assert_eq!(
            (counts.shadows_by_index == 0, counts.shadows_by_pass == 0),
            (by_pass, !by_pass),
            "{counts:?}"
        );
        assert!(counts.shadows_by_index + counts.shadows_by_pass > 6 + 7, "{counts:?}");
    }
    assert!(beyond > 0, "Bevy's test of a sphere and a box never differs");
}
