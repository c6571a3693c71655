//! A sketch that grows while a camera flies through it. In each frame, each of a hundred hands adds a point to the mesh
//! of its ribbon. Bevy recomputes the box of a changed mesh, and the plugin uses it in the same frame. The example
//! needs no window: it prints the plugin's counts and the time of a frame. In a game, with Bevy's `DefaultPlugins`, the
//! ribbons also need a `MeshMaterial3d`.
//!
//! `cargo run --release --example sketching [-- FRAMES]`

#![expect(clippy::print_stdout, reason = "the example prints its results")]

use std::{any::TypeId, time::Instant};

use bevy_app::{App, TaskPoolPlugin, Update};
use bevy_asset::{AssetPlugin, Assets, RenderAssetUsages};
use bevy_camera::{Camera, CameraPlugin, PerspectiveProjection, Projection, visibility::VisibleEntities};
use bevy_ecs::{
    change_detection::{Res, ResMut},
    entity::Entity,
    query::With,
    resource::Resource,
    system::{Commands, Query},
};
use bevy_math::{Quat, Vec3};
use bevy_mesh::{Mesh, Mesh3d, MeshPlugin, PrimitiveTopology};
use bevy_osp::{OspCulling, OspCullingPlugin, OspCullingSettings};
use bevy_transform::{TransformPlugin, components::Transform};

/// Number of hands that draw at once: a whole class of artists.
const HANDS: usize = 100;
/// Number of frames in which a ribbon grows, by one point in each frame.
const FRAMES_OF_RIBBON: usize = 8;
/// Duration of a frame in seconds.
const FRAME_SECS: f32 = 0.02;

/// The drawing of the hands so far.
#[derive(Resource, Default)]
struct Hands {
    frame: usize,
    /// The ribbon that each hand is drawing, and its points.
    ribbons: Vec<(Mesh3d, Vec<[f32; 3]>)>,
}

impl Hands {
    fn time_secs(&self) -> f32 {
        self.frame as f32 * FRAME_SECS
    }
}

/// Returns the position of a hand: a point of a curve that does not close, in a cube of about forty metres.
fn hand_at(hand: usize, time_secs: f32) -> Vec3 {
    let shift = hand as f32 * 1.7;
    let time = time_secs * 5.0;
    let slow =
        Vec3::new((time * 0.031 + shift).sin(), (time * 0.017 + shift).sin(), (time * 0.023 - shift).cos());
    let fast = Vec3::new((time * 1.3).sin(), (time * 1.9 + shift).cos(), (time * 1.1).cos());
    slow * 20.0 + fast
}

fn draw(mut commands: Commands<'_, '_>, mut hands: ResMut<'_, Hands>, mut meshes: ResMut<'_, Assets<Mesh>>) {
    let time_secs = hands.time_secs();
    if hands.frame.is_multiple_of(FRAMES_OF_RIBBON) {
        let begin = |hand| {
            let points = vec![hand_at(hand, time_secs - FRAME_SECS).to_array()];
            let mesh =
                Mesh3d(meshes.add(Mesh::new(PrimitiveTopology::LineStrip, RenderAssetUsages::default())));
            commands.spawn(mesh.clone());
            (mesh, points)
        };
        hands.ribbons = (0..HANDS).map(begin).collect();
    }
    hands.frame += 1;
    for (hand, (mesh, points)) in hands.ribbons.iter_mut().enumerate() {
        points.push(hand_at(hand, time_secs).to_array());
        if let Some(mut mesh) = meshes.get_mut(&mesh.0) {
            mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, points.clone());
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

/// The ribbons that the camera sees.
fn seen(app: &App, camera: Entity) -> Vec<Entity> {
    let visible = app.world().get::<VisibleEntities>(camera).expect("a camera has a list");
    visible.get(TypeId::of::<Mesh3d>()).to_vec()
}

fn sketch(settings: OspCullingSettings) -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((TaskPoolPlugin::default(), TransformPlugin, AssetPlugin::default()));
    app.add_plugins((MeshPlugin, CameraPlugin, OspCullingPlugin { settings }));
    app.init_resource::<Hands>().add_systems(Update, (draw, fly));
    let projection = PerspectiveProjection { aspect_ratio: 16.0 / 9.0, ..Default::default() };
    let camera = (Camera::default(), Projection::Perspective(projection), Transform::default());
    let camera = app.world_mut().spawn(camera).id();
    app.finish();
    app.cleanup();
    (app, camera)
}

fn main() {
    let frames = std::env::args().nth(1).and_then(|frames| frames.parse().ok()).unwrap_or(3000);
    let (mut app, camera) = sketch(OspCullingSettings::default());
    println!("frame  entities  indexed  loose  found   seen  frame, ms (mean of 100)");
    let mut start = Instant::now();
    for frame in 1..=frames {
        app.update();
        if frame % 100 == 0 {
            let mean_ms = start.elapsed().as_secs_f64() * 1e3 / 100.0;
            let counts = app.world().resource::<OspCulling>().counts();
            println!(
                "{frame:5}  {:8}  {:7}  {:5}  {:5}  {:5}  {mean_ms:.3}",
                counts.entities,
                counts.indexed,
                counts.loose,
                counts.found,
                seen(&app, camera).len()
            );
            start = Instant::now();
        }
    }
}

/// The ribbons with a point on the camera's screen.
#[cfg(test)]
fn on_screen(app: &App, camera: Entity, ribbons: &[Entity]) -> Vec<Entity> {
    let camera = app.world().entity(camera);
    let projection = camera.get::<Projection>().expect("a camera has a projection").get_clip_from_view();
    let clip_from_world =
        projection * camera.get::<Transform>().expect("a camera has a place").to_matrix().inverse();
    let meshes = app.world().resource::<Assets<Mesh>>();
    let is_on_screen = |ribbon: &Entity| {
        let mesh = app.world().get::<Mesh3d>(*ribbon).and_then(|mesh| meshes.get(mesh));
        let points = mesh.and_then(|mesh| mesh.attribute(Mesh::ATTRIBUTE_POSITION)?.as_float3());
        points.into_iter().flatten().any(|point| {
            let at = clip_from_world * Vec3::from(*point).extend(1.0);
            at.w > 0.1 && at.truncate().truncate().abs().max_element() <= at.w
        })
    };
    ribbons.iter().copied().filter(is_on_screen).collect()
}

/// Every ribbon with a point on the screen is visible.
#[test]
fn nothing_visible_is_missing() {
    let (mut app, camera) = sketch(OspCullingSettings::always());
    let (mut by_index, mut shown) = (0, 0);
    for frame in 0..500 {
        app.update();
        by_index += app.world().resource::<OspCulling>().counts().views_by_index;
        if frame % 5 != 0 {
            continue;
        }
        let world = app.world_mut();
        let all = world.query_filtered::<Entity, With<Mesh3d>>().iter(world).collect::<Vec<_>>();
        let (visible, on_screen) = (seen(&app, camera), on_screen(&app, camera, &all));
        assert!(frame < 20 || visible.len() < all.len() / 2, "{} of {}", visible.len(), all.len());
        assert!(on_screen.iter().all(|ribbon| visible.contains(ribbon)), "frame {frame}");
        shown += on_screen.len();
    }
    assert!(by_index > 100 && shown > 500, "{by_index} {shown}");
}
