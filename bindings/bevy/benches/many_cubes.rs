//! Measures Bevy's own culling and the plugin, frame by frame in one process. `cargo bench` prints the table of the
//! README. An argument selects another table, and further arguments are numbers of cubes:
//! * `cargo bench -- limits`: the limits of `OspCullingSettings`.
//! * `cargo bench -- sun`: a sun whose shadows have four cascades.
//! * `cargo bench -- lamps`: point lights and spot lights.
//! * `cargo bench -- movers`: several fractions of moving cubes.

#![expect(clippy::print_stdout, reason = "the bench prints a table")]

#[expect(dead_code, reason = "tests use two threads, this bench as many as Bevy chooses")]
#[path = "../tests/twins/mod.rs"]
mod twins;

use std::{
    any::TypeId,
    time::{Duration, Instant},
};

use bevy_app::{App, PostUpdate};
use bevy_camera::{
    Camera, PerspectiveProjection, Projection,
    primitives::Aabb,
    visibility::{Visibility, VisibilityClass, VisibilitySystems},
};
use bevy_ecs::{change_detection::ResMut, entity::Entity, resource::Resource, schedule::IntoScheduleConfigs};
use bevy_light::{CascadeShadowConfigBuilder, DirectionalLight, PointLight, SpotLight};
use bevy_math::{Quat, Vec3, Vec3A};
use bevy_mesh::Mesh3d;
use bevy_osp::{OspCulling, OspCullingCounts, OspCullingSettings};
use bevy_transform::components::Transform;
use rand_pcg::{
    Pcg64Mcg,
    rand_core::{Rng, SeedableRng},
};
use twins::{Twins, new_app_on};

/// The visibility class of the cubes.
struct Cube;

/// The time at which the check of the last frame began, and its duration.
#[derive(Resource)]
struct CheckTime(Instant, Duration);

fn begin(mut time: ResMut<'_, CheckTime>) {
    time.0 = Instant::now();
}

fn end(mut time: ResMut<'_, CheckTime>) {
    time.1 = time.0.elapsed();
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lights {
    None,
    /// A directional light with four cascades.
    Sun,
    /// Four point lights and four spot lights with Bevy's default range of 20 m.
    Lamps,
}

#[derive(Clone, Debug)]
struct Case {
    cubes: usize,
    /// Fraction of the cubes that moves in each frame.
    moved: f32,
    /// Vertical field of view, degrees.
    fov_degrees: f32,
    settings: OspCullingSettings,
    /// The lights for which the cubes cast shadows.
    lights: Lights,
}

impl Case {
    fn new(cubes: usize) -> Self {
        Self {
            cubes,
            moved: 0.0,
            fov_degrees: 45.0,
            settings: OspCullingSettings::default(),
            lights: Lights::None,
        }
    }
}

/// A cloud of cubes around a rotating camera, as in Bevy's example `many_cubes`.
struct Cloud {
    random: Pcg64Mcg,
    cubes: Vec<Entity>,
    camera: Entity,
    moved: usize,
    next: usize,
    angle: f32,
}

impl Cloud {
    fn new(app: &mut App, case: &Case) -> Self {
        let mut random = Pcg64Mcg::seed_from_u64(11);
        // The density is the same for every number of cubes.
        let reach = (case.cubes as f32).cbrt() * 2.0;
        let world = app.world_mut();
        let mut cubes = Vec::with_capacity(case.cubes);
        for _ in 0..case.cubes {
            let mut class = VisibilityClass::default();
            class.push(TypeId::of::<Cube>());
            let aabb = Aabb { center: Vec3A::ZERO, half_extents: Vec3A::splat(0.5) };
            let transform = Transform::from_translation(vector(&mut random) * reach);
            let mut cube = world.spawn((transform, Visibility::default(), class, aabb));
            if case.lights != Lights::None {
                cube.insert(Mesh3d::default());
            }
            cubes.push(cube.id());
        }
        let projection = PerspectiveProjection {
            fov: case.fov_degrees.to_radians(),
            aspect_ratio: 16.0 / 9.0,
            ..Default::default()
        };
        let camera =
            world.spawn((Camera::default(), Projection::Perspective(projection), Transform::default())).id();
        match case.lights {
            Lights::None => {}
            Lights::Sun => {
                let sun = DirectionalLight { shadow_maps_enabled: true, ..DirectionalLight::default() };
                let way = Transform::default().looking_to(Vec3::new(0.3, -1.0, 0.2), Vec3::X);
                world.spawn((sun, way, CascadeShadowConfigBuilder::default().build()));
            }
            Lights::Lamps => {
                for _ in 0..4 {
                    let place = Transform::from_translation(vector(&mut random) * 15.0);
                    world.spawn((PointLight { shadow_maps_enabled: true, ..PointLight::default() }, place));
                    world.spawn((SpotLight { shadow_maps_enabled: true, ..SpotLight::default() }, place));
                }
            }
        }
        let moved = (case.moved * case.cubes as f32).round() as usize;
        Self { random, cubes, camera, moved, next: 0, angle: 0.0 }
    }

    fn frame(&mut self, app: &mut App) {
        let world = app.world_mut();
        for _ in 0..self.moved {
            self.next = (self.next + 1) % self.cubes.len();
            let step = vector(&mut self.random) * 0.1;
            world.get_mut::<Transform>(self.cubes[self.next]).expect("a cube").translation += step;
        }
        self.angle += 0.01;
        let rotation = Quat::from_rotation_y(self.angle) * Quat::from_rotation_x(self.angle * 0.3);
        world.get_mut::<Transform>(self.camera).expect("the camera").rotation = rotation;
    }
}

fn vector(random: &mut Pcg64Mcg) -> Vec3 {
    let mut signed = || random.next_u32() as f32 / u32::MAX as f32 * 2.0 - 1.0;
    Vec3::new(signed(), signed(), signed())
}

/// Number of frames before the measurement. In these frames the plugin builds an index, and drops it if it costs too
/// much.
const WARM_FRAMES: usize = 260;

struct Measured {
    /// Medians in milliseconds: Bevy's, and the plugin's.
    check_ms: [f64; 2],
    update_ms: [f64; 2],
    counts: OspCullingCounts,
    seen: usize,
}

fn measure(case: &Case) -> Measured {
    let mut apps = [new_app_on(1, None), new_app_on(1, Some(case.settings.clone()))];
    for app in &mut apps {
        app.insert_resource(CheckTime(Instant::now(), Duration::ZERO));
        let before = (VisibilitySystems::UpdateFrusta, VisibilitySystems::CalculateBounds);
        app.add_systems(
            PostUpdate,
            (
                begin
                    .after(before.0)
                    .after(before.1)
                    .after(VisibilitySystems::VisibilityPropagate)
                    .before(VisibilitySystems::CheckVisibility),
                end.after(VisibilitySystems::CheckVisibility)
                    .before(VisibilitySystems::MarkNewlyHiddenEntitiesInvisible),
            ),
        );
    }
    let mut clouds = apps.each_mut().map(|app| Cloud::new(app, case));
    let mut twins = Twins::new();
    let frames = (3_000_000 / case.cubes.max(1)).clamp(61, 2001);
    let (mut check, mut update) = ([const { Vec::new() }; 2], [const { Vec::new() }; 2]);
    for frame in 0..WARM_FRAMES + frames {
        // The app that runs second has a colder cache, so the order alternates.
        let order = if frame % 2 == 0 { [0, 1] } else { [1, 0] };
        for which in order {
            clouds[which].frame(&mut apps[which]);
            let start = Instant::now();
            apps[which].update();
            let took = start.elapsed();
            if frame >= WARM_FRAMES {
                update[which].push(took.as_secs_f64() * 1e3);
                check[which].push(apps[which].world().resource::<CheckTime>().1.as_secs_f64() * 1e3);
            }
        }
        if frame % 40 == 0 || frame + 1 == WARM_FRAMES + frames {
            twins.compare(&mut apps, &format!("{case:?}, frame {frame}"));
        }
    }
    let counts = *apps[1].world().resource::<OspCulling>().counts();
    let world = apps[1].world();
    let seen = world
        .get::<bevy_camera::visibility::VisibleEntities>(clouds[1].camera)
        .map_or(0, |visible| visible.get(TypeId::of::<Cube>()).len());
    Measured { check_ms: check.map(median), update_ms: update.map(median), counts, seen }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn row(name: &str, case: &Case) {
    let Measured { check_ms, update_ms, counts, seen } = measure(case);
    let method = if counts.views_by_index > 0 { "index" } else { "pass" };
    let ratio = |times: [f64; 2]| times[1] / times[0];
    println!(
        "| {} | {name} | {seen} | {method} | {:.3} | {:.3} | {:.2} | {:.3} | {:.3} | {:.2} |",
        case.cubes,
        check_ms[0],
        check_ms[1],
        ratio(check_ms),
        update_ms[0],
        update_ms[1],
        ratio(update_ms),
    );
}

fn main() {
    let arguments = std::env::args().skip(1).filter(|argument| argument != "--bench").collect::<Vec<_>>();
    let sizes = arguments.iter().filter_map(|argument| argument.parse().ok()).collect::<Vec<usize>>();
    let sizes_or = |default: &[usize]| if sizes.is_empty() { default.to_vec() } else { sizes.clone() };
    println!(
        "| cubes | | seen | method | check, Bevy, ms | check, plugin, ms | ratio | update, Bevy, ms | update, plugin, ms | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    if arguments.iter().any(|argument| argument == "limits") {
        for cubes in sizes_or(&[100, 1_000, 2_000, 5_000, 10_000, 100_000]) {
            let always = Case { settings: OspCullingSettings::always(), ..Case::new(cubes) };
            row("still", &always);
            for fov_degrees in [90.0, 120.0, 150.0] {
                row(&format!("still, {fov_degrees} degrees"), &Case { fov_degrees, ..always.clone() });
            }
            for moved in [0.02, 0.05, 0.1, 0.2] {
                row(&format!("{:.0} % move", moved * 100.0), &Case { moved, ..always.clone() });
            }
        }
        return;
    }
    if arguments.iter().any(|argument| argument == "movers") {
        for cubes in sizes_or(&[1_000, 10_000, 100_000]) {
            for moved in [0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5, 1.0] {
                row(&format!("{} % move", moved * 100.0), &Case { moved, ..Case::new(cubes) });
            }
        }
        return;
    }
    for (name, lights) in [("sun", Lights::Sun), ("lamps", Lights::Lamps)] {
        if arguments.iter().any(|argument| argument == name) {
            for cubes in sizes_or(&[1_000, 10_000, 100_000]) {
                for (share, moved) in [("still", 0.0), ("1 % move", 0.01), ("all move", 1.0)] {
                    row(&format!("{name}, {share}"), &Case { moved, lights, ..Case::new(cubes) });
                }
            }
            return;
        }
    }
    for cubes in sizes_or(&[100, 1_000, 10_000, 100_000, 1_000_000]) {
        for (name, moved) in [("still", 0.0), ("1 % move", 0.01), ("all move", 1.0)] {
            row(name, &Case { moved, ..Case::new(cubes) });
        }
    }
}
