//! An engine's own numbers and geometry, culled by the frustum and by what hides what. No features needed:
//! `cargo run --no-default-features --example engine`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use osp::{
    frame::{PassConfig, Pipeline, StageClock},
    glam::Vec3,
    index::{IndexConfig, Osp},
    math::Aabb,
    occlusion::Occlusion,
    polygon::{Change, ConvexPolygon, Geometry, PolygonId},
    view::{Projection, View},
};

/// What the engine has: meshes, known by their boxes, and walls, known by their corners.
enum Object {
    Mesh(Aabb),
    Wall([Vec3; 4]),
}

struct World {
    /// By number; what is gone leaves its place empty.
    objects: Vec<Option<Object>>,
}

impl Geometry for World {
    fn id_end(&self) -> usize {
        self.objects.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.objects.get(id.index()).is_some_and(Option::is_some)
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        match &self.objects[id.index()] {
            Some(Object::Mesh(bounds)) => *bounds,
            Some(Object::Wall(corners)) => Aabb::from_points(corners),
            None => Aabb::EMPTY,
        }
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        match &self.objects[id.index()] {
            Some(Object::Wall(corners)) => Some(ConvexPolygon::quad(*corners)),
            _ => None,
        }
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        true
    }
}

fn main() {
    // A wall of 6 m by 4 m, and behind it, and beside it, a thousand meshes.
    let wall = [[-3.0, 0.0, -5.0], [3.0, 0.0, -5.0], [3.0, 4.0, -5.0], [-3.0, 4.0, -5.0]].map(Vec3::from);
    let mesh = |i: u32| {
        let center = Vec3::new((i % 50) as f32 * 0.4 - 9.8, 1.0, -8.0 - (i / 50) as f32 * 0.4);
        Some(Object::Mesh(Aabb::cube(center, 0.3)))
    };
    let mut world = World { objects: (0..1000).map(mesh).collect() };
    world.objects.push(Some(Object::Wall(wall)));

    let index = Osp::new(&IndexConfig { root: Aabb::cube(Vec3::ZERO, 64.0), capacity: 4096 });
    // To draw a mesh costs about 10 us, so that a test for each is worth it.
    let method = Occlusion::Msvbsp;
    let occlusion = PassConfig { polygon_ns: 10_000.0, ..PassConfig::new(method) };
    let mut pipeline = Pipeline::new(Box::new(index), 4096, StageClock::default()).with_occlusion(occlusion);
    pipeline.load(&world);

    let projection = Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 100.0);
    let view = View::look_at(Vec3::new(0.0, 1.6, 0.0), Vec3::new(0.0, 1.6, -5.0), projection);
    let before = pipeline.frame(&world, &[], &view);
    println!("{} in view, {} of them hidden by the wall", before.visible, before.occlusion.occluded);

    // The wall is taken down: what it hid is drawn in the same frame.
    world.objects[1000] = None;
    let after = pipeline.frame(&world, &[Change::Remove(PolygonId(1000))], &view);
    println!(
        "{} in view, {} hidden; {} blocks to draw",
        after.visible,
        after.occlusion.occluded,
        pipeline.draw_list().blocks().count()
    );
    assert!(before.occlusion.occluded > 100 && after.occlusion.occluded == 0);
}
