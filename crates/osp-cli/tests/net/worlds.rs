//! Worlds larger than memory: what a walk sees is what the same sessions in memory show, within the memory that it was given, and
//! nothing that is damaged or unfinished passes for a world.

#[cfg(all(feature = "worlds-cloud", feature = "serve"))]
mod address;
mod damage;
mod exact;
mod packing;
mod program;

use std::{path::Path, sync::Arc};

use glam::Vec3;
use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp},
    math::Aabb,
    polygon::{ConvexPolygon, Geometry, PolygonId},
    view::View,
};
use osp_net::world::{PackOrder, Place, Replacing, ResidentConfig, Walk, World, WorldError, WorldWriter};
use osp_session::{
    recording::{SynthKind, synthesize},
    replay::fingerprint_of_frame,
    scene::Scene,
};

fn temp() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// The model at the end of a made-up session.
fn session(kind: SynthKind, polygons: u32, seed: u64) -> Scene {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in synthesize(kind, polygons, seed) {
        scene.apply(&event.expect("an event"), &mut changes);
        changes.clear();
        scene.free_unreachable();
    }
    scene
}

fn place_to_write(folder: &Path) -> Place {
    Place::to_write(folder.to_str().expect("a name in UTF-8")).expect("a folder")
}

fn place_to_read(folder: &Path) -> Place {
    Place::to_read(folder.to_str().expect("a name in UTF-8")).expect("a folder")
}

/// Packs models, each at some places.
fn pack(folder: &Path, order: PackOrder, parts: &[(&Scene, &[Vec3])]) -> Result<(), WorldError> {
    let mut writer = WorldWriter::create(place_to_write(folder), Replacing::Never, order)?;
    for (number, (scene, offsets)) in parts.iter().enumerate() {
        writer.add(&format!("session {number}"), scene, offsets)?;
    }
    writer.finish().map(drop)
}

fn open(folder: &Path) -> Arc<World> {
    Arc::new(World::open(place_to_read(folder)).expect("a world"))
}

fn walk(world: &Arc<World>, memory: u64, loaders: usize) -> Walk {
    Walk::new(Arc::clone(world), ResidentConfig { memory, loaders }).expect("enough memory")
}

/// The least memory that a walk takes.
fn least_memory(world: &Arc<World>, loaders: usize) -> u64 {
    match Walk::new(Arc::clone(world), ResidentConfig { memory: 1, loaders }) {
        Err(WorldError::Memory { least, given: 1 }) => least,
        other => panic!("{other:?}"),
    }
}

/// The same models in memory, numbered as the world numbers them.
struct Together {
    polygons: Vec<Option<(Aabb, ConvexPolygon)>>,
}

impl Together {
    fn new(parts: &[(&Scene, &[Vec3])]) -> Self {
        let mut polygons = Vec::new();
        for (scene, offsets) in parts {
            for &offset in *offsets {
                polygons.extend((0..scene.id_end() as u32).map(PolygonId).map(|id| {
                    let Aabb { min, max } = Geometry::bounds(*scene, id);
                    let bounds = Aabb::new(min + offset, max + offset);
                    let polygon = Scene::polygon(scene, id).map(|corner| corner + offset);
                    (scene.is_present(id) && bounds.is_valid()).then_some((bounds, polygon))
                }));
            }
        }
        Self { polygons }
    }

    fn bounds(&self) -> Aabb {
        self.polygons.iter().flatten().fold(Aabb::EMPTY, |all, (bounds, _)| all.union(bounds))
    }

    /// Number and fingerprint of the polygons in each view, found by a pipeline in memory.
    fn seen(&self, views: &[View]) -> Vec<(u64, u64)> {
        let capacity = self.polygons.len();
        let root = Aabb::cube(self.bounds().center(), self.bounds().extent().max_element());
        let index = Osp::new(&IndexConfig { root, capacity });
        let mut pipeline = Pipeline::new(Box::new(index), capacity);
        pipeline.load(self);
        let seen = |view: &View| {
            pipeline.frame(self, &[], view);
            let list = pipeline.draw_list();
            (list.len() as u64, fingerprint_of_frame(list.ids()))
        };
        views.iter().map(seen).collect()
    }
}

impl Geometry for Together {
    fn id_end(&self) -> usize {
        self.polygons.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.polygons[id.index()].is_some()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.polygons[id.index()].map_or(Aabb::EMPTY, |(bounds, _)| bounds)
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        self.polygons[id.index()].map(|(_, polygon)| polygon)
    }

    fn may_occlude(&self, _id: PolygonId) -> bool {
        false
    }
}
