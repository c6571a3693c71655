use std::collections::BTreeSet;

use glam::Vec3;
use xxhash_rust::xxh3::xxh3_64;

use super::{
    BLOCK_POLYGONS, BlockEntry, Manifest, PackOrder, Place, Source, WorldError,
    block::BlockBuilder,
    lock::PackLock,
    manifest::{MANIFEST, MOST_BYTES, ObjectEntry},
};
use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, Geometry, PolygonId},
};
use osp_session::scene::Scene;

/// Number of blocks of an object. Such an object takes 13 MB. With more blocks, a world has fewer objects and requests,
/// but a pack takes more memory, and a killed pack loses more work.
const OBJECT_BLOCKS: u64 = 64;

/// If a session (or copy) ends in a block with at least this number of polygons, the block ends there. The next session
/// may lie elsewhere, and the block's box would span both sessions.
const FULL_ENOUGH: usize = BLOCK_POLYGONS / 4;

/// Treatment of an existing world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Replacing {
    /// An existing world is never replaced; the pack is refused.
    Never,
    /// When the new world is complete, it replaces the existing world.
    World,
}

/// The result of a pack.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// Contents of the world.
    pub manifest: Manifest,
    /// Number of polygons that were skipped, because their boxes are not finite. Such polygons cannot be drawn.
    pub refused: u64,
}

/// Packs finished sessions into a world. The world can be opened only after [`WorldWriter::finish`]. A pack removes the
/// blocks that an interrupted pack has left at the same place. In a folder, a second pack is refused while another pack
/// runs. A pack takes memory for one object, and for an entry for each block.
#[derive(Debug)]
pub struct WorldWriter {
    place: Place,
    replacing: Replacing,
    order: PackOrder,
    manifest: Manifest,
    block: BlockBuilder,
    object: Vec<u8>,
    object_blocks: u64,
    /// Number of polygon ids that were assigned.
    ids: u64,
    refused: u64,
    /// The lock that excludes other packs, if the place supports locks.
    _lock: Option<PackLock>,
}

impl WorldWriter {
    /// Largest number of polygons of a world, whose numbers have 32 bits.
    pub const MOST_POLYGONS: u64 = u32::MAX as u64;

    /// Begins a world.
    ///
    /// # Errors
    /// [`WorldError::Exists`], [`WorldError::Busy`], or the place does not answer.
    pub fn create(place: Place, replacing: Replacing, order: PackOrder) -> Result<Self, WorldError> {
        if replacing == Replacing::Never && place.holds(MANIFEST)? {
            return Err(WorldError::Exists { place: place.text().to_owned() });
        }
        let lock = place.lock()?;
        Ok(Self {
            place,
            replacing,
            order,
            manifest: Manifest::default(),
            block: BlockBuilder::default(),
            object: Vec::new(),
            object_blocks: 0,
            ids: 0,
            refused: 0,
            _lock: lock,
        })
    }

    /// Adds the present polygons of a model, once for each offset (metres). A polygon's number in the world is its
    /// number in the model plus the number of ids of all models and copies added before.
    ///
    /// # Errors
    /// The blocks cannot be written, or [`WorldError::TooMany`].
    pub fn add(&mut self, name: &str, scene: &Scene, offsets: &[Vec3]) -> Result<(), WorldError> {
        let ids = scene.id_end() as u64;
        if self.ids + ids * offsets.len() as u64 > Self::MOST_POLYGONS {
            return Err(WorldError::TooMany { most: Self::MOST_POLYGONS });
        }
        let mut all: Vec<PolygonId> = scene.visible_ids().collect();
        let present = all.len();
        all.retain(|&id| scene.bounds(id).is_valid());
        self.refused += ((present - all.len()) * offsets.len()) as u64;
        let bounds = all.iter().fold(Aabb::EMPTY, |bounds, &id| bounds.union(&scene.bounds(id)));
        let all = self.order.sort(scene, all, &bounds);
        for &offset in offsets {
            for &id in &all {
                self.add_polygon(scene, id, offset)?;
            }
            if self.block.polygons >= FULL_ENOUGH {
                self.end_block()?;
            }
            self.ids += ids;
        }
        let (name, copies) = (name.to_owned(), offsets.len() as u32);
        self.manifest.sources.push(Source { name, polygons: all.len() as u64, copies });
        Ok(())
    }

    fn add_polygon(&mut self, scene: &Scene, id: PolygonId, offset: Vec3) -> Result<(), WorldError> {
        let Aabb { min, max } = scene.bounds(id);
        let bounds = Aabb::new(min + offset, max + offset);
        let polygon: ConvexPolygon = scene.polygon(id).map(|corner| corner + offset);
        if !bounds.is_valid() || !polygon.vertices().iter().all(|corner| corner.is_finite()) {
            self.refused += 1;
            return Ok(());
        }
        let (r, g, b, a) = scene.stroke_of(id).color();
        // The number is below `MOST_POLYGONS`, as checked above.
        let number = PolygonId((self.ids + u64::from(id.0)) as u32);
        self.block.add(number, [r, g, b, a], &polygon, &bounds);
        if self.block.polygons == BLOCK_POLYGONS { self.end_block() } else { Ok(()) }
    }

    fn end_block(&mut self) -> Result<(), WorldError> {
        let at = self.object.len();
        let (bounds, polygons) = (self.block.bounds(), self.block.polygons as u32);
        self.block.put(&mut self.object);
        let bytes = &self.object[at..];
        let (hash, bytes) = (xxh3_64(bytes), bytes.len() as u32);
        let object = self.manifest.objects.len() as u32;
        self.manifest.blocks.push(BlockEntry { bounds, polygons, bytes, hash, object, at: at as u64 });
        self.object_blocks += 1;
        if self.object_blocks == OBJECT_BLOCKS { self.end_object() } else { Ok(()) }
    }

    fn end_object(&mut self) -> Result<(), WorldError> {
        let bytes = std::mem::take(&mut self.object);
        let blocks = std::mem::take(&mut self.object_blocks);
        let entry = ObjectEntry { hash: xxh3_64(&bytes), bytes: bytes.len() as u64, blocks };
        // The name is a hash of the contents, so an object of another world is never replaced by different contents.
        self.place.replace(&entry.name(), bytes)?;
        self.manifest.objects.push(entry);
        Ok(())
    }

    /// Writes the remaining blocks, and then the manifest, which makes the place a world. Then removes blocks that belong
    /// to no world.
    ///
    /// # Errors
    /// An object cannot be written, or another world has appeared at the place ([`WorldError::Exists`]). At an address,
    /// another pack may also have removed written blocks. The other world then stays.
    pub fn finish(mut self) -> Result<Packed, WorldError> {
        if self.block.polygons > 0 {
            self.end_block()?;
        }
        if self.object_blocks > 0 {
            self.end_object()?;
        }
        let manifest = self.manifest.write();
        if manifest.len() as u64 > MOST_BYTES {
            return Err(self.place.unusable(&format!("expected a manifest of at most {MOST_BYTES} bytes")));
        }
        let names: BTreeSet<String> = self.manifest.objects.iter().map(ObjectEntry::name).collect();
        for name in &names {
            if !self.place.holds(name)? {
                let problem = "written, but gone: another pack or program has removed it".to_owned();
                return Err(WorldError::Object { object: self.place.name_of(name), problem });
            }
        }
        match self.replacing {
            Replacing::Never => self.place.create(MANIFEST, manifest)?,
            Replacing::World => self.place.replace(MANIFEST, manifest)?,
        }
        for left in self.place.list("blocks")? {
            if left.ends_with(".osp-blocks") && !names.contains(&left) {
                self.place.remove(&left)?;
            }
        }
        Ok(Packed { manifest: self.manifest, refused: self.refused })
    }
}
