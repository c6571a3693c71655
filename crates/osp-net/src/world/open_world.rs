use super::{
    BlockEntry, Manifest, Place, WorldError,
    block::{Block, root_around},
    manifest::{MANIFEST, MOST_BYTES},
};
use osp::{
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum},
    polygon::{PolygonId, VisibleBlocks},
};
use xxhash_rust::xxh3::xxh3_64;

/// An open world: its manifest, and the boxes of its blocks in an index. The polygons stay in the folder or at the address.
pub struct World {
    place: Place,
    /// The manifest.
    pub manifest: Manifest,
    /// An index of the blocks, by their boxes.
    index: Osp,
    /// Box around all polygons, world space, metres.
    pub bounds: Aabb,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("World").field("place", &self.place).finish_non_exhaustive()
    }
}

impl World {
    /// Opens a world: reads its manifest.
    ///
    /// # Errors
    /// The manifest does not exist, or is damaged.
    pub fn open(place: Place) -> Result<Self, WorldError> {
        let Some(bytes) = place.read(MANIFEST, MOST_BYTES)? else {
            let problem = format!("expected a world: there is no {MANIFEST} (a pack writes it last)");
            return Err(place.unusable(&problem));
        };
        let manifest = Manifest::read(&|| place.name_of(MANIFEST), &bytes)?;
        let bounds = manifest.bounds();
        let mut index =
            Osp::new(&IndexConfig { root: root_around(&bounds), capacity: manifest.blocks.len() });
        for (number, block) in manifest.blocks.iter().enumerate() {
            // No error is expected: the box is valid, and the longest manifest has fewer blocks than the index has numbers.
            let inserted = index.insert(PolygonId(number as u32), &block.bounds);
            inserted.map_err(|error| place.unusable(&error.to_string()))?;
        }
        index.commit();
        Ok(Self { place, manifest, index, bounds })
    }

    /// Memory that the manifest and the index of the blocks take, bytes.
    pub fn bytes(&self) -> usize {
        self.manifest.bytes() + self.index.bytes()
    }

    /// Replaces the contents of `blocks` by the numbers of the blocks that the frustum may see.
    pub fn blocks_in_view(&self, frustum: &Frustum, blocks: &mut VisibleBlocks) {
        blocks.clear();
        self.index.frustum_cull_blocks(frustum, blocks);
    }

    pub(super) fn unusable(&self, problem: &str) -> WorldError {
        self.place.unusable(problem)
    }

    pub(super) fn entry(&self, block: u32) -> &BlockEntry {
        &self.manifest.blocks[block as usize]
    }

    /// Loads a block. Also returns the number of bytes that were read. Panics if the number does not exist.
    pub fn load(&self, block: u32) -> Result<(Block, u64), WorldError> {
        let entry = self.entry(block);
        let object = self.manifest.objects[entry.object as usize].name();
        let end = entry.at + u64::from(entry.bytes);
        let bytes = self.place.read_range(&object, entry.at..end)?;
        let name = || self.place.name_of(&object);
        let damaged = |byte, expected: String, found: String| WorldError::Damaged {
            object: name(),
            byte,
            expected,
            found,
        };
        if bytes.len() != entry.bytes as usize {
            let expected = format!("{} bytes of block {block}", entry.bytes);
            return Err(damaged(entry.at, expected, format!("{} bytes", bytes.len())));
        }
        let hash = xxh3_64(&bytes);
        if hash != entry.hash {
            let expected =
                format!("{} bytes of block {block} with the checksum {:016x}", entry.bytes, entry.hash);
            return Err(damaged(entry.at, expected, format!("{hash:016x}")));
        }
        let block = Block::read(&name, entry.at, &bytes, &entry.bounds, entry.polygons as usize)?;
        Ok((block, u64::from(entry.bytes)))
    }
}
