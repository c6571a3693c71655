//! The cascades of directional lights have the same entities with the plugin as without.

#![cfg(feature = "light")]

mod twins;

use bevy_app::App;
use bevy_asset::Handle;
use bevy_camera::{
    Camera, Camera3d, PerspectiveProjection, Projection,
    primitives::{Aabb, Sphere},
    visibility::{
        CascadesVisibleEntities, NoFrustumCulling, RenderLayers, ViewVisibility, Visibility, VisibilityRange,
    },
};
use bevy_ecs::{component::Component, entity::Entity};
use bevy_light::{CascadeShadowConfigBuilder, DirectionalLight, NotShadowCaster};
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
        assert_eq!(
            (counts.cascades_by_index, counts.cascades_by_pass),
            if by_index { (6, 0) } else { (0, 6) }
        );
    }
}
