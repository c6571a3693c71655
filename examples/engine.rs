//! An engine's own keys and geometry, culled by the frustum and by occluders. It needs no features: `cargo run
//! --example engine`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::collections::HashMap;

use osp::{
    frame::{PassConfig, Pipeline},
    glam::Vec3,
    index::{IndexConfig, Osp},
    math::Aabb,
    occlusion::Occlusion,
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, ids_of},
    view::{Projection, View},
};

/// An object of the engine: a mesh with its box, or a wall with its corners.
enum Object {
    Mesh(Aabb),
    Wall([Vec3; 4]),
}

/// The engine's keys have 64 bits and are sparse. Each object has a slot in an array; the number of the slot is the
/// object's `PolygonId`.
#[derive(Default)]
struct World {
    slots: Vec<Option<(u64, Object)>>,
    free: Vec<u32>,
    slot_of: HashMap<u64, u32>,
    /// Changes since the last frame.
    changes: Vec<Change>,
}

impl World {
    fn spawn(&mut self, key: u64, object: Object) {
        let slot = self.free.pop().unwrap_or(self.slots.len() as u32);
        if slot as usize == self.slots.len() {
            self.slots.push(None);
        }
        self.slots[slot as usize] = Some((key, object));
        self.slot_of.insert(key, slot);
        self.changes.push(Change::Insert(PolygonId(slot)));
    }

    fn despawn(&mut self, key: u64) {
        let Some(slot) = self.slot_of.remove(&key) else { return };
        self.slots[slot as usize] = None;
        self.free.push(slot);
        self.changes.push(Change::Remove(PolygonId(slot)));
    }

    fn get(&self, id: PolygonId) -> Option<&(u64, Object)> {
        self.slots.get(id.index())?.as_ref()
    }
}

impl Geometry for World {
    fn id_end(&self) -> usize {
        self.slots.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.get(id).is_some()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        match self.get(id) {
            Some((_, Object::Mesh(bounds))) => *bounds,
            Some((_, Object::Wall(corners))) => Aabb::from_points(corners),
            None => Aabb::EMPTY,
        }
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        match self.get(id) {
            Some((_, Object::Wall(corners))) => Some(ConvexPolygon::quad(*corners)),
            _ => None,
        }
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        matches!(self.get(id), Some((_, Object::Wall(_))))
    }
}

fn main() {
    // A wall of 6 m by 4 m, with a thousand meshes behind and beside it.
    const WALL: u64 = 0xBEEF << 40;
    let mut world = World::default();
    for i in 0..1000 {
        let center = Vec3::new((i % 50) as f32 * 0.4 - 9.8, 1.0, -8.0 - (i / 50) as f32 * 0.4);
        world.spawn(i << 32, Object::Mesh(Aabb::cube(center, 0.3)));
    }
    let wall = [[-3.0, 0.0, -5.0], [3.0, 0.0, -5.0], [3.0, 4.0, -5.0], [-3.0, 4.0, -5.0]].map(Vec3::from);
    world.spawn(WALL, Object::Wall(wall));

    let index = Osp::new(&IndexConfig { root: Aabb::cube(Vec3::ZERO, 64.0), capacity: 4096 });
    let culler = Pipeline::new(Box::new(index), 4096);
    let mut culler = culler.with_occlusion(PassConfig::new(Occlusion::Msvbsp));

    let projection = Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 100.0);
    let view = View::look_at(Vec3::new(0.0, 1.6, 0.0), Vec3::new(0.0, 1.6, -5.0), projection);
    let mut hidden = Vec::new();
    for frame in 0..2 {
        if frame == 1 {
            // Without the wall, the same frame draws the meshes that it hid. A new mesh reuses the wall's slot.
            world.despawn(WALL);
            world.spawn(1 << 63, Object::Mesh(Aabb::cube(Vec3::new(0.0, 1.0, -4.0), 0.3)));
        }
        let record = culler.frame(&world, &world.changes, &view);
        world.changes.clear();
        let blocks = culler.draw_list().blocks();
        let keys = blocks.flat_map(|(block, mask)| ids_of(block, mask)).filter_map(|id| world.get(id));
        let drawn = keys.map(|(key, _)| *key).collect::<Vec<_>>();
        println!(
            "frame {frame}: {} in view, {} of them hidden by the wall, {} drawn",
            record.visible,
            record.hidden(),
            drawn.len()
        );
        hidden.push(record.hidden());
    }
    assert!(hidden[0] > 100 && hidden[1] == 0);
}
