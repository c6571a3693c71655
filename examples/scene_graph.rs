//! Nested groups that move: a sun, a planet and its moon. The engine multiplies the matrices. The culler keeps each
//! body in its own space, and needs one change for each moving body.
//!
//! `cargo run --example scene_graph`

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use osp::{
    frame::Pipeline,
    glam::{Affine3A, Quat, Vec3},
    index::{IndexConfig, Osp},
    math::Aabb,
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, SpaceId, SpacePlace},
    view::{Projection, View},
};

/// Number of plates of a body. The culler stores the box of each plate.
const PLATES: usize = 1000;

const NAMES: [&str; 3] = ["sun", "planet", "moon"];
const PLANET: usize = 1;
const MOON: usize = 2;

struct World {
    /// The plates in the space of a body; all bodies have the same plates.
    plates: Vec<Aabb>,
    /// Each body's parent, and the transform from the body to its parent.
    bodies: [(Option<usize>, Affine3A); 3],
}

impl World {
    fn world_from(&self, body: usize) -> Affine3A {
        let (parent, parent_from_body) = self.bodies[body];
        parent.map_or(Affine3A::IDENTITY, |parent| self.world_from(parent)) * parent_from_body
    }
}

fn body_of(id: PolygonId) -> usize {
    id.index() / PLATES
}

impl Geometry for World {
    fn id_end(&self) -> usize {
        self.bodies.len() * PLATES
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.id_end()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        let world_from_body = self.world_from(body_of(id));
        let corners = self.bounds_in_space(id).corners();
        Aabb::from_points(&corners.map(|corner| world_from_body.transform_point3(corner)))
    }

    fn polygon(&self, _: PolygonId) -> Option<ConvexPolygon> {
        None
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        false
    }

    fn space(&self, id: PolygonId) -> Option<SpaceId> {
        Some(SpaceId(body_of(id) as u32))
    }

    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        self.plates[id.index() % PLATES]
    }

    fn place(&self, space: SpaceId) -> SpacePlace {
        SpacePlace::from(self.world_from(space.0 as usize))
    }
}

/// Returns the box of one plate on a unit sphere.
fn plate(number: usize) -> Aabb {
    let (height, angle) = (number as f32 / (PLATES / 2) as f32 - 1.0, number as f32 * 2.4);
    let around = (1.0 - height * height).max(0.0).sqrt();
    Aabb::cube(Vec3::new(around * angle.cos(), height, around * angle.sin()), 0.05)
}

/// Returns the transform from a body to its parent, for a body on an orbit.
fn orbit(degrees: f32, radius_m: f32, size: f32) -> Affine3A {
    Affine3A::from_rotation_y(degrees.to_radians())
        * Affine3A::from_scale_rotation_translation(Vec3::splat(size), Quat::IDENTITY, Vec3::X * radius_m)
}

fn main() {
    let planet = orbit(45.0, 5.0, 0.5);
    let bodies = [(None, Affine3A::IDENTITY), (None, planet), (Some(PLANET), orbit(30.0, 3.0, 0.4))];
    let mut world = World { plates: (0..PLATES).map(plate).collect(), bodies };
    let index = Osp::new(&IndexConfig { root: Aabb::cube(Vec3::ZERO, 64.0), capacity: 4096 });
    let mut culler = Pipeline::new(Box::new(index), 4096);
    culler.load(&world);

    let projection = Projection::symmetric(40.0, 1.5, 0.1, 100.0);
    let view = View::look_at(Vec3::new(0.0, 1.0, 9.0), Vec3::ZERO, projection);
    for day in 0..6 {
        // One matrix changes, and moves the planet and the moon: two changes for two thousand plates.
        world.bodies[PLANET].1 = orbit(45.0 + 60.0 * day as f32, 5.0, 0.5);
        let changes = [PLANET, MOON].map(|body| Change::Place(SpaceId(body as u32)));
        culler.frame(&world, &changes, &view);
        let mut in_view = [0; NAMES.len()];
        culler.draw_list().ids().for_each(|id| in_view[body_of(id)] += 1);
        let counts = NAMES.iter().zip(in_view).map(|(name, count)| format!("{name} {count}"));
        let moon_at = world.world_from(MOON).translation;
        println!(
            "day {day}: the moon is at {moon_at:.2}; plates in view: {}",
            counts.collect::<Vec<_>>().join(", ")
        );
    }
}
