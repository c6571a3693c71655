//! In random worlds, frame by frame, an app with the plugin has the same visible sets as an app without.

mod twins;

use std::any::TypeId;

use bevy_app::App;
use bevy_asset::{Assets, Handle};
use bevy_camera::{
    Camera, OrthographicProjection, PerspectiveProjection, Projection,
    primitives::{Aabb, Frustum, Sphere},
    visibility::{
        InheritedVisibility, NoCpuCulling, NoFrustumCulling, RenderLayers, ViewVisibility, Visibility,
        VisibilityClass, VisibilityRange, VisibleEntities,
    },
};
use bevy_ecs::{entity::Entity, hierarchy::ChildOf, world::World};
use bevy_math::{Quat, Vec3, primitives::Cuboid};
use bevy_mesh::{Mesh, Mesh3d};
use bevy_osp::{OspCulling, OspCullingSettings};
use bevy_transform::components::{GlobalTransform, Transform};
use rand_pcg::{
    Pcg64Mcg,
    rand_core::{Rng, SeedableRng},
};
use twins::{Twins, new_app};

/// Two classes that renderers could have.
struct ClassA;
struct ClassB;

struct Dice(Pcg64Mcg);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        (self.0.next_u64() % end as u64) as usize
    }

    fn one_in(&mut self, many: usize) -> bool {
        self.below(many) == 0
    }

    fn signed(&mut self) -> f32 {
        self.0.next_u32() as f32 / u32::MAX as f32 * 2.0 - 1.0
    }

    fn vector(&mut self, reach: f32) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed()) * reach
    }

    fn transform(&mut self) -> Transform {
        let rotation =
            Quat::from_rotation_y(self.signed() * 4.0) * Quat::from_rotation_x(self.signed() * 4.0);
        let mut scale = Vec3::ONE + self.vector(0.9);
        if self.one_in(10) {
            scale.x = -scale.x;
        }
        let mut translation = self.vector(60.0);
        match self.below(60) {
            0 => translation.x = f32::NAN,
            1 => translation.y = f32::INFINITY,
            2 => translation *= 1.0e6,
            3 => scale *= 100.0,
            4 => scale.z = 0.0,
            5 => translation.z = f32::MAX,
            _ => {}
        }
        Transform { translation, rotation, scale }
    }

    fn aabb(&mut self) -> Aabb {
        let mut half_extents = self.vector(2.0).abs();
        match self.below(30) {
            0 => half_extents.x = f32::INFINITY,
            1 => half_extents.y = -1.0,
            2 => half_extents = Vec3::ZERO,
            _ => {}
        }
        Aabb { center: self.vector(1.0).into(), half_extents: half_extents.into() }
    }

    fn class(&mut self) -> VisibilityClass {
        let mut class = VisibilityClass::default();
        if !self.one_in(20) {
            class.push(if self.one_in(3) { TypeId::of::<ClassA>() } else { TypeId::of::<ClassB>() });
        }
        if self.one_in(10) {
            class.push(TypeId::of::<ClassA>());
        }
        class
    }

    fn visibility(&mut self) -> Visibility {
        [Visibility::Inherited, Visibility::Hidden, Visibility::Visible, Visibility::Inherited][self.below(4)]
    }

    fn layers(&mut self) -> RenderLayers {
        [
            RenderLayers::layer(0),
            RenderLayers::layer(1),
            RenderLayers::from_layers(&[0, 1]),
            RenderLayers::none(),
        ][self.below(4)]
        .clone()
    }

    fn range(&mut self) -> VisibilityRange {
        let near = self.signed().abs() * 30.0;
        VisibilityRange { use_aabb: self.one_in(2), ..VisibilityRange::abrupt(near, near + 40.0) }
    }

    fn camera(&mut self) -> (Camera, Projection, Transform) {
        let projection = if self.one_in(3) {
            Projection::Orthographic(OrthographicProjection {
                scale: 0.01 + self.signed().abs() * 0.1,
                far: 50.0,
                ..OrthographicProjection::default_3d()
            })
        } else {
            Projection::Perspective(PerspectiveProjection { far: 80.0, ..Default::default() })
        };
        let camera = Camera { is_active: !self.one_in(5), ..Camera::default() };
        (
            camera,
            projection,
            Transform::from_translation(self.vector(30.0)).looking_at(self.vector(10.0), Vec3::Y),
        )
    }
}

/// A random world. The same seed creates the same world.
struct Game {
    dice: Dice,
    entities: Vec<Entity>,
    cameras: Vec<Entity>,
    meshes: Vec<Handle<Mesh>>,
}

impl Game {
    fn new(world: &mut World, seed: u64, entities: usize) -> Self {
        let mut game = Self {
            dice: Dice(Pcg64Mcg::seed_from_u64(seed)),
            entities: Vec::new(),
            cameras: Vec::new(),
            meshes: Vec::new(),
        };
        for size in [1.0, 3.0] {
            let mesh = Mesh::from(Cuboid::new(size, 1.0, size));
            game.meshes.push(world.resource_mut::<Assets<Mesh>>().add(mesh));
        }
        (0..entities).for_each(|_| game.spawn(world));
        (0..3).for_each(|_| game.spawn_camera(world));
        game
    }

    fn spawn(&mut self, world: &mut World) {
        let dice = &mut self.dice;
        let mut entity = world.spawn((dice.transform(), Visibility::default()));
        match dice.below(10) {
            0 => {
                entity.insert((dice.class(), Sphere { center: dice.vector(50.0).into(), radius: 2.0 }));
            }
            1 => {
                entity.insert(Mesh3d(self.meshes[dice.below(2)].clone()));
            }
            2 => {
                entity.insert(dice.class());
            }
            _ => {
                entity.insert((dice.class(), dice.aabb()));
            }
        }
        self.entities.push(entity.id());
    }

    fn spawn_camera(&mut self, world: &mut World) {
        let mut camera = world.spawn(self.dice.camera());
        if self.dice.one_in(3) {
            camera.insert(self.dice.layers());
        }
        self.cameras.push(camera.id());
    }

    fn any(&mut self) -> Option<Entity> {
        (!self.entities.is_empty()).then(|| self.entities[self.dice.below(self.entities.len())])
    }

    /// Changes one entity in some way.
    fn change(&mut self, world: &mut World) {
        let Some(id) = self.any() else { return };
        let other = self.any();
        let dice = &mut self.dice;
        let mut entity = world.entity_mut(id);
        match dice.below(26) {
            0..5 => {
                entity.insert(dice.transform());
            }
            5 => {
                entity.despawn();
                self.entities.retain(|there| world.get_entity(*there).is_ok());
            }
            6 | 7 => self.spawn(world),
            8 => {
                entity.insert(dice.visibility());
            }
            9 => {
                // An entity must not be its own ancestor. So only an entity without a parent becomes a parent, and only
                // an entity without children gets a parent.
                if let Some(parent) = other
                    && parent != id
                    && !entity.contains::<bevy_ecs::hierarchy::Children>()
                    && !world.entity(parent).contains::<ChildOf>()
                {
                    world.entity_mut(id).insert(ChildOf(parent));
                }
            }
            10 => {
                entity.remove::<ChildOf>();
            }
            11 => {
                entity.insert(dice.layers());
            }
            12 => {
                entity.remove::<RenderLayers>();
            }
            13 => {
                entity.insert(dice.range());
            }
            14 => {
                entity.remove::<VisibilityRange>();
            }
            15 => {
                entity.insert(NoFrustumCulling);
            }
            16 => {
                entity.remove::<NoFrustumCulling>();
            }
            17 => {
                entity.insert(NoCpuCulling);
            }
            18 => {
                entity.remove::<NoCpuCulling>();
            }
            19 => {
                let aabb = dice.aabb();
                if let Some(mut there) = entity.get_mut::<Aabb>() {
                    *there = aabb;
                }
            }
            20 => {
                if dice.one_in(2) {
                    entity.remove::<Aabb>();
                } else {
                    entity.insert(dice.aabb());
                }
            }
            21 => {
                if dice.one_in(2) {
                    entity.remove::<Sphere>();
                } else {
                    entity.insert(Sphere { center: dice.vector(50.0).into(), radius: dice.signed() * 9.0 });
                }
            }
            22 => match dice.below(6) {
                0 => {
                    entity.remove::<GlobalTransform>();
                }
                1 => {
                    entity.insert(GlobalTransform::from(dice.transform()));
                }
                2 => {
                    entity.remove::<ViewVisibility>();
                }
                3 => {
                    entity.insert(ViewVisibility::default());
                }
                4 => {
                    entity.remove::<InheritedVisibility>();
                }
                _ => {
                    entity.insert(InheritedVisibility::VISIBLE);
                }
            },
            23 => {
                entity.insert(dice.class());
            }
            24 => {
                entity.remove::<VisibilityClass>();
            }
            _ => {
                let mesh = self.meshes[dice.below(2)].clone();
                entity.insert(Mesh3d(mesh));
            }
        }
    }

    fn change_camera(&mut self, world: &mut World) {
        let dice = &mut self.dice;
        let at = dice.below(self.cameras.len());
        let mut entity = world.entity_mut(self.cameras[at]);
        match dice.below(9) {
            0..4 => {
                entity.insert(dice.camera());
            }
            4 => {
                entity.remove::<Frustum>();
            }
            5 => {
                entity.insert(Frustum::default());
            }
            6 => {
                entity.insert(dice.layers());
            }
            7 => {
                if entity.contains::<NoCpuCulling>() {
                    entity.remove::<NoCpuCulling>();
                } else {
                    entity.insert(NoCpuCulling);
                }
            }
            _ => {
                entity.despawn();
                self.cameras.remove(at);
                self.spawn_camera(world);
            }
        }
    }

    fn frame(&mut self, world: &mut World) {
        let changes = if self.dice.one_in(12) { 0 } else { self.dice.below(40) };
        (0..changes).for_each(|_| self.change(world));
        if self.dice.one_in(3) {
            self.change_camera(world);
        }
        if self.dice.one_in(25) {
            // Everything moves.
            let mut transforms = world.query::<&mut Transform>();
            transforms.iter_mut(world).for_each(|mut transform| transform.translation.x += 0.5);
        }
        if self.dice.one_in(25) {
            let mesh = self.meshes[0].clone();
            let size = 1.0 + self.dice.signed().abs() * 4.0;
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            meshes.insert(&mesh, Mesh::from(Cuboid::from_length(size))).expect("the handle is of this app");
        }
    }
}

/// Limits that make the plugin change its method often in worlds of some hundred entities.
fn restless() -> OspCullingSettings {
    OspCullingSettings {
        least_entities: 250,
        most_moved: 0.08,
        most_moved_at_once: 0.15,
        most_found: 0.5,
        settle_frames: 3,
        fill_frames: 3,
        is_measured: false,
    }
}

/// Plays a game in an app with Bevy's culling and in an app with the plugin. Returns the number of frames with an
/// index, and the number of views that the index culled.
fn play(settings: OspCullingSettings, seed: u64, entities: usize, frames: usize) -> (usize, usize) {
    let mut apps = [new_app(None), new_app(Some(settings))];
    let mut games = apps.each_mut().map(|app| Game::new(app.world_mut(), seed, entities));
    let mut twins = Twins::new();
    let (mut indexed, mut by_index) = (0, 0);
    for frame in 0..frames {
        for (app, game) in apps.iter_mut().zip(&mut games) {
            if frame > 0 {
                game.frame(app.world_mut());
            }
            app.update();
        }
        assert!(games[0].entities == games[1].entities, "the two games went apart");
        twins.compare(&mut apps, &format!("seed {seed}, frame {frame}"));
        let culling = apps[1].world().resource::<OspCulling>();
        indexed += usize::from(culling.is_indexed());
        by_index += culling.counts().views_by_index;
    }
    (indexed, by_index)
}

#[test]
fn by_the_index_always() {
    for seed in 0..6 {
        let (indexed, by_index) = play(OspCullingSettings::always(), seed, 300, 80);
        assert!(indexed == 80 && by_index > 80, "{indexed} frames, {by_index} views");
    }
}

#[test]
fn by_an_index_that_comes_and_goes() {
    let (mut indexed, mut by_index) = (0, 0);
    for seed in 10..16 {
        let (frames, views) = play(restless(), seed, 280, 100);
        (indexed, by_index) = (indexed + frames, by_index + views);
    }
    assert!(indexed > 60 && indexed < 540, "{indexed} frames with an index");
    assert!(by_index > 20, "{by_index} views by the index");
    // Whichever method is faster on this machine, the sets are the same.
    play(OspCullingSettings { is_measured: true, ..restless() }, 16, 280, 300);
}

#[test]
fn by_a_plain_pass_always() {
    assert_eq!(play(OspCullingSettings::never(), 20, 300, 40), (0, 0));
    assert_eq!(play(OspCullingSettings::default(), 21, 300, 40), (0, 0));
}

#[test]
fn in_an_empty_world() {
    for settings in [OspCullingSettings::always(), OspCullingSettings::default()] {
        play(settings, 30, 0, 10);
    }
    // A world without a camera, and one with only a camera.
    let mut apps = [new_app(None), new_app(Some(OspCullingSettings::always()))];
    apps.iter_mut().for_each(App::update);
    for app in &mut apps {
        app.world_mut().spawn(Camera::default());
    }
    apps.iter_mut().for_each(App::update);
    Twins::new().compare(&mut apps, "a camera alone");
    let mut views = apps[1].world_mut().query::<&VisibleEntities>();
    assert_eq!(views.iter(apps[1].world()).count(), 1);
}
