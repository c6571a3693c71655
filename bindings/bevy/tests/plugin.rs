//! The plugin in an app: its place among the systems, the index over many frames, and messages that it may miss.

mod twins;

use std::any::TypeId;

use bevy_app::{App, PostUpdate, TaskPoolPlugin};
use bevy_asset::{AssetPlugin, Assets, Handle, RenderAssetUsages};
use bevy_camera::{
    Camera, CameraPlugin,
    primitives::Aabb,
    visibility::{
        InheritedVisibility, ViewVisibility, Visibility, VisibilityClass, VisibilitySystems, VisibleEntities,
        check_visibility_cpu_culling,
    },
};
use bevy_ecs::{
    change_detection::ResMut,
    component::Component,
    entity::Entity,
    query::With,
    reflect::{AppTypeRegistry, ReflectResource},
    resource::Resource,
    schedule::IntoScheduleConfigs,
    system::Query,
};
use bevy_math::{Vec3, Vec3A};
use bevy_mesh::{Mesh, Mesh3d, MeshPlugin, PrimitiveTopology};
use bevy_osp::{OspCulling, OspCullingPlugin, OspCullingSettings};
use bevy_transform::{TransformPlugin, components::Transform};
use twins::{Twins, new_app};

#[derive(Component)]
struct Thing;

fn spawn_thing(app: &mut App, place: Vec3) -> Entity {
    let mut class = VisibilityClass::default();
    class.push(TypeId::of::<Thing>());
    let aabb = Aabb { center: Vec3A::ZERO, half_extents: Vec3A::splat(0.5) };
    let place = Transform::from_translation(place);
    app.world_mut().spawn((Thing, place, Visibility::default(), class, aabb)).id()
}

fn spawn_camera(app: &mut App) -> Entity {
    app.world_mut().spawn((Camera::default(), bevy_camera::Projection::default(), Transform::default())).id()
}

#[derive(Resource, Default)]
struct SeenAfter(Vec<usize>);

/// Systems that are ordered relative to Bevy's function keep their order. The plugins may be added in any order.
#[test]
fn it_is_where_bevys_system_was() {
    for plugin_first in [true, false] {
        let mut app = App::new();
        app.add_plugins((TaskPoolPlugin::default(), TransformPlugin, AssetPlugin::default(), MeshPlugin));
        let plugin = OspCullingPlugin { settings: OspCullingSettings::always() };
        if plugin_first {
            app.add_plugins((plugin, CameraPlugin));
        } else {
            app.add_plugins((CameraPlugin, plugin));
        }
        let hide = |mut things: Query<'_, '_, &mut InheritedVisibility, With<Thing>>| {
            things.iter_mut().take(2).for_each(|mut thing| *thing = InheritedVisibility::HIDDEN);
        };
        let look = |mut after: ResMut<'_, SeenAfter>, views: Query<'_, '_, &VisibleEntities>| {
            after.0.extend(views.iter().map(|view| view.len(TypeId::of::<Thing>())));
        };
        app.init_resource::<SeenAfter>().add_systems(
            PostUpdate,
            (
                look.in_set(VisibilitySystems::CheckVisibility).after(check_visibility_cpu_culling),
                hide.after(VisibilitySystems::VisibilityPropagate).before(check_visibility_cpu_culling),
            ),
        );
        app.finish();
        app.cleanup();
        spawn_camera(&mut app);
        for i in 0..5 {
            spawn_thing(&mut app, Vec3::new(i as f32 * 0.1, 0.0, -5.0));
        }
        (0..20).for_each(|_| app.update());
        assert_eq!(app.world().resource::<SeenAfter>().0, [3; 20], "plugin first: {plugin_first}");
        assert_eq!(app.world().resource::<OspCulling>().counts().views_by_index, 1);
    }
}

#[test]
#[should_panic(expected = "expects Bevy's CameraPlugin")]
fn without_bevys_cameras_it_panics_with_a_message() {
    let mut app = App::new();
    app.add_plugins((TaskPoolPlugin::default(), TransformPlugin, OspCullingPlugin::default()));
    app.finish();
}

/// Messages about removed components live for two frames. Missed messages must not leave an old box in the index.
#[test]
fn messages_that_were_missed_are_noticed() {
    let mut apps = [new_app(None), new_app(Some(OspCullingSettings::always()))];
    let mut twins = Twins::new();
    let mut ids = Vec::new();
    for app in &mut apps {
        spawn_camera(app);
        // These are behind the camera, so they are culled as long as they have a box.
        ids = (0..20).map(|i| spawn_thing(app, Vec3::new(0.0, 0.0, 5.0 + i as f32))).collect();
    }
    for frame in 0..6 {
        apps.iter_mut().for_each(App::update);
        twins.compare(&mut apps, &format!("frame {frame}"));
    }
    assert_eq!(apps[1].world().resource::<OspCulling>().counts().indexed, 20);
    for app in &mut apps {
        app.world_mut().entity_mut(ids[3]).remove::<Aabb>();
        (0..3).for_each(|_| app.world_mut().clear_trackers());
        app.update();
        assert!(app.world().get::<ViewVisibility>(ids[3]).unwrap().get());
    }
    twins.compare(&mut apps, "after messages were missed");
}

/// First there are few entities, then many that do not move, then all move, then none moves.
#[test]
fn the_index_comes_when_it_pays_and_goes_when_all_moves() {
    let settings =
        OspCullingSettings { least_entities: 600, is_measured: false, ..OspCullingSettings::default() };
    let mut apps = [new_app(None), new_app(Some(settings))];
    let mut twins = Twins::new();
    let place = |i: usize| Vec3::new((i % 30) as f32, (i / 30) as f32, 10.0 - (i % 7) as f32 * 9.0) * 2.0;
    let spawn = |app: &mut App, range: std::ops::Range<usize>| -> Vec<Entity> {
        range.map(|i| spawn_thing(app, place(i))).collect()
    };
    let mut things = Vec::new();
    for app in &mut apps {
        spawn_camera(app);
        things = spawn(app, 0..400);
    }
    let mut run = |apps: &mut [App; 2], frames: usize, moves: bool, things: &[Entity]| {
        for frame in 0..frames {
            for app in apps.iter_mut() {
                if moves {
                    for id in things {
                        app.world_mut().get_mut::<Transform>(*id).unwrap().translation.x += 0.1;
                    }
                }
                app.update();
            }
            twins.compare(apps, &format!("frame {frame}"));
        }
        let culling = apps[1].world().resource::<OspCulling>();
        (culling.is_indexed(), culling.counts().indexed, culling.counts().views_by_index)
    };
    assert_eq!(run(&mut apps, 40, false, &things), (false, 0, 0), "few");
    for app in &mut apps {
        things.truncate(400);
        things.extend(spawn(app, 400..1000));
    }
    // The camera has no box, so one entity is not in the index.
    assert_eq!(run(&mut apps, 60, false, &things), (true, 1000, 1), "many that rest");
    assert_eq!(run(&mut apps, 1, true, &things), (false, 0, 0), "all move");
    assert_eq!(run(&mut apps, 40, true, &things), (false, 0, 0), "all move still");
    assert_eq!(run(&mut apps, 120, false, &things), (true, 1000, 1), "they rest again");
    for app in &mut apps {
        things[100..].iter().for_each(|id| app.world_mut().entity_mut(*id).despawn());
    }
    assert_eq!(run(&mut apps, 1, false, &[]), (false, 0, 0), "few again");
}

/// A stroke whose mesh gets points in every frame. Bevy recomputes its box, and the plugin uses the new box.
#[test]
fn a_mesh_that_grows_is_seen_as_soon_as_it_reaches_the_view() {
    let mut apps = [new_app(None), new_app(Some(OspCullingSettings::always()))];
    let mut twins = Twins::new();
    let (mut strokes, mut meshes) = (Vec::new(), Vec::<Handle<Mesh>>::new());
    for app in &mut apps {
        spawn_camera(app);
        let mesh = Mesh::new(PrimitiveTopology::LineStrip, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0_f32, 0.0, 5.0]]);
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        let stroke = spawn_thing(app, Vec3::ZERO);
        app.world_mut().entity_mut(stroke).remove::<Aabb>().insert(Mesh3d(mesh.clone()));
        strokes.push(stroke);
        meshes.push(mesh);
    }
    let mut seen = Vec::new();
    // From 5 m behind the camera to 4 m in front of it.
    for frame in 0..20_u8 {
        for (app, handle) in apps.iter_mut().zip(&meshes) {
            let points = (0..=frame).map(|i| [0.0, 0.0, 5.0 - f32::from(i) * 0.5]).collect::<Vec<_>>();
            let mut assets = app.world_mut().resource_mut::<Assets<Mesh>>();
            let mut mesh = assets.get_mut(handle).unwrap();
            mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, points);
            drop(mesh);
            app.update();
        }
        twins.compare(&mut apps, &format!("frame {frame}"));
        seen.push(apps[1].world().get::<ViewVisibility>(strokes[1]).unwrap().get());
    }
    assert!(!seen[5] && seen[19], "{seen:?}");
    assert!(apps[1].world().resource::<OspCulling>().is_indexed());
}

#[test]
fn the_settings_are_reached_by_reflection() {
    let app = new_app(Some(OspCullingSettings::always()));
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let registration = registry.get(TypeId::of::<OspCullingSettings>()).expect("a registered type");
    assert!(registration.data::<ReflectResource>().is_some());
}
