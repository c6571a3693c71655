//! A sketch that grows while a camera flies through it. In each frame ribbons arrive, each as an entity with its
//! bounds. The last ribbon of each hand still grows. The example needs no window: it prints the work of the plugin and
//! the time of a frame.
//!
//! `cargo run --release --example sketching`

#![expect(clippy::print_stdout, reason = "this is what it shows")]

use std::{any::TypeId, time::Instant};

use bevy_app::{App, TaskPoolPlugin, Update};
use bevy_asset::AssetPlugin;
use bevy_camera::{
    Camera, CameraPlugin, PerspectiveProjection, Projection,
    primitives::Aabb,
    visibility::{Visibility, VisibilityClass, VisibleEntities},
};
use bevy_ecs::{
    change_detection::{Res, ResMut},
    component::Component,
    entity::Entity,
    query::With,
    resource::Resource,
    system::{Commands, Query},
};
use bevy_math::{Quat, Vec3};
use bevy_mesh::MeshPlugin;
use bevy_osp::{OspCulling, OspCullingPlugin};
use bevy_transform::{TransformPlugin, components::Transform};

/// A ribbon; a renderer would draw its mesh.
#[derive(Component)]
struct Ribbon {
    /// Smallest and largest corner so far, world space, metres.
    min: Vec3,
    max: Vec3,
}

/// Number of hands that draw at once: a whole class of artists.
const HANDS: usize = 100;
/// Number of frames, each with one sample of its hand, in which a ribbon grows.
const FRAMES_OF_RIBBON: usize = 4;
/// Half the width of a ribbon, metres.
const HALF_WIDTH_M: f32 = 0.01;
/// Duration of a frame in seconds.
const FRAME_SECS: f32 = 0.02;

/// The drawing of the hands so far.
#[derive(Resource, Default)]
struct Hands {
    frame: usize,
    /// The ribbon that each hand is drawing.
    ribbons: Vec<Entity>,
}

impl Hands {
    fn time_secs(&self) -> f32 {
        self.frame as f32 * FRAME_SECS
    }
}

/// Returns the place of a hand: a curve that does not close, through a room of forty metres.
fn hand_at(hand: usize, time_secs: f32) -> Vec3 {
    let shift = hand as f32 * 1.7;
    let time = time_secs * 5.0;
    let slow =
        Vec3::new((time * 0.031 + shift).sin(), (time * 0.017 + shift).sin(), (time * 0.023 - shift).cos());
    let fast = Vec3::new((time * 1.3).sin(), (time * 1.9 + shift).cos(), (time * 1.1).cos());
    slow * 20.0 + fast
}

fn draw(
    mut commands: Commands<'_, '_>,
    mut hands: ResMut<'_, Hands>,
    mut ribbons: Query<'_, '_, (&mut Ribbon, &mut Aabb)>,
) {
    let time_secs = hands.time_secs();
    let begins = hands.frame.is_multiple_of(FRAMES_OF_RIBBON);
    hands.frame += 1;
    if begins {
        hands.ribbons.clear();
    }
    for hand in 0..HANDS {
        let (from, to) = (hand_at(hand, time_secs - FRAME_SECS), hand_at(hand, time_secs));
        let (low, high) = (from.min(to) - HALF_WIDTH_M, from.max(to) + HALF_WIDTH_M);
        if begins {
            let mut class = VisibilityClass::default();
            class.push(TypeId::of::<Ribbon>());
            let bundle = (Ribbon { min: low, max: high }, Aabb::from_min_max(low, high), class);
            hands.ribbons.push(commands.spawn((bundle, Transform::default(), Visibility::default())).id());
        } else if let Ok((mut ribbon, mut aabb)) = ribbons.get_mut(hands.ribbons[hand]) {
            // The ribbon grows in place. Bevy's change detection reports this to the plugin.
            (ribbon.min, ribbon.max) = (ribbon.min.min(low), ribbon.max.max(high));
            *aabb = Aabb::from_min_max(ribbon.min, ribbon.max);
        }
    }
}

fn fly(hands: Res<'_, Hands>, mut cameras: Query<'_, '_, &mut Transform, With<Camera>>) {
    for mut place in &mut cameras {
        let time_secs = hands.time_secs();
        place.rotation = Quat::from_rotation_y(time_secs * 0.3);
        place.translation = Vec3::new((time_secs * 0.1).sin(), 0.0, (time_secs * 0.13).cos()) * 10.0;
    }
}

fn main() {
    let mut app = App::new();
    app.add_plugins((
        TaskPoolPlugin::default(),
        TransformPlugin,
        AssetPlugin::default(),
        MeshPlugin,
        CameraPlugin,
    ));
    app.add_plugins(OspCullingPlugin::default());
    app.init_resource::<Hands>().add_systems(Update, (draw, fly));
    let projection = PerspectiveProjection { aspect_ratio: 16.0 / 9.0, ..Default::default() };
    let camera = (Camera::default(), Projection::Perspective(projection), Transform::default());
    let camera = app.world_mut().spawn(camera).id();
    app.finish();
    app.cleanup();

    println!("frame  entities  indexed  loose  found   seen  frame, ms (mean of 100)");
    let mut start = Instant::now();
    for frame in 1..=1500 {
        app.update();
        if frame % 100 == 0 {
            let mean_ms = start.elapsed().as_secs_f64() * 1e3 / 100.0;
            let counts = app.world().resource::<OspCulling>().counts();
            let visible = app.world().get::<VisibleEntities>(camera).expect("a camera has a list");
            let seen = visible.len(TypeId::of::<Ribbon>());
            println!(
                "{frame:5}  {:8}  {:7}  {:5}  {:5}  {seen:5}  {mean_ms:.3}",
                counts.entities, counts.indexed, counts.loose, counts.found
            );
            start = Instant::now();
        }
    }
    let counts = app.world().resource::<OspCulling>().counts();
    assert!(counts.views_by_index == 1 && counts.indexed > 10_000, "{counts:?}");
}
