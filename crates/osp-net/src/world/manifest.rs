//! The manifest of a world: contents and position of each block. All numbers are little-endian:
//!
//! | byte | contents |
//! |---|---|
//! | 0 | `osp world 1` and a line end |
//! | 12 | number of blocks, number of polygons: 64 bits each |
//! | 28 | number of objects, number of sources: 32 bits each |
//! | 36 | for each source: polygons of one copy (64 bits), number of copies, length of the name in bytes (32 bits each), name (UTF-8) |
//! | then | for each object: XXH3-64 of its contents (its name is this number in hex), size in bytes, number of blocks (64 bits each) |
//! | then | for each block, in the order of the objects: size in bytes, polygons (32 bits each), XXH3-64, least and greatest corner (32-bit floats) |
//! | the last 8 | XXH3-64 of all bytes before |

use xxhash_rust::xxh3::xxh3_64;

use super::{
    BLOCK_POLYGONS, WorldError,
    block::bytes_of,
    bytes::{Reader, put_bounds},
};
use osp::math::Aabb;

/// The name of the manifest's object.
pub(super) const MANIFEST: &str = "manifest.osp-world";
/// Size of the longest manifest that is read, bytes: six million blocks.
pub(super) const MOST_BYTES: u64 = 256 << 20;

const MAGIC: &[u8; 10] = b"osp world ";
const VERSION: &[u8; 2] = b"1\n";
const SOURCE_BYTES: u64 = 16;
const OBJECT_BYTES: u64 = 24;
const BLOCK_BYTES: u64 = 40;

/// A session in a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The name of the session's file.
    pub name: String,
    /// Number of polygons of each copy.
    pub polygons: u64,
    /// Number of copies.
    pub copies: u32,
}

/// An object, which consists of consecutive blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ObjectEntry {
    pub(super) hash: u64,
    pub(super) bytes: u64,
    pub(super) blocks: u64,
}

impl ObjectEntry {
    pub(super) fn name(&self) -> String {
        format!("blocks/{:016x}.osp-blocks", self.hash)
    }
}

/// A block in the manifest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockEntry {
    /// A box that contains all polygons of the block, world space, metres.
    pub bounds: Aabb,
    /// Number of polygons.
    pub polygons: u32,
    pub(super) bytes: u32,
    pub(super) hash: u64,
    pub(super) object: u32,
    /// Offset of the block in its object, bytes.
    pub(super) at: u64,
}

/// Contents of a world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Manifest {
    /// The sessions, in the order in which they were packed.
    pub sources: Vec<Source>,
    pub(super) objects: Vec<ObjectEntry>,
    /// The blocks.
    pub blocks: Vec<BlockEntry>,
}

impl Manifest {
    /// Number of stored objects (files) that hold the blocks.
    pub fn object_count(&self) -> usize {
        self.objects.len()
    }

    /// Number of polygons of the world.
    pub fn polygon_count(&self) -> u64 {
        self.blocks.iter().map(|block| u64::from(block.polygons)).sum()
    }

    /// Size of all blocks, bytes.
    pub fn block_bytes(&self) -> u64 {
        self.objects.iter().map(|object| object.bytes).sum()
    }

    /// Box of the world.
    pub fn bounds(&self) -> Aabb {
        self.blocks.iter().fold(Aabb::EMPTY, |all, block| all.union(&block.bounds))
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        let names: usize = self.sources.iter().map(|source| source.name.capacity()).sum();
        names
            + self.sources.capacity() * size_of::<Source>()
            + self.objects.capacity() * size_of::<ObjectEntry>()
            + self.blocks.capacity() * size_of::<BlockEntry>()
    }

    pub(super) fn write(&self) -> Vec<u8> {
        let mut out = [&MAGIC[..], VERSION].concat();
        out.extend((self.blocks.len() as u64).to_le_bytes());
        out.extend(self.polygon_count().to_le_bytes());
        out.extend((self.objects.len() as u32).to_le_bytes());
        out.extend((self.sources.len() as u32).to_le_bytes());
        for source in &self.sources {
            out.extend(source.polygons.to_le_bytes());
            out.extend(source.copies.to_le_bytes());
            out.extend((source.name.len() as u32).to_le_bytes());
            out.extend(source.name.as_bytes());
        }
        for object in &self.objects {
            [object.hash, object.bytes, object.blocks].iter().for_each(|n| out.extend(n.to_le_bytes()));
        }
        for block in &self.blocks {
            out.extend(block.bytes.to_le_bytes());
            out.extend(block.polygons.to_le_bytes());
            out.extend(block.hash.to_le_bytes());
            put_bounds(&mut out, &block.bounds);
        }
        let hash = xxh3_64(&out);
        out.extend(hash.to_le_bytes());
        out
    }

    /// Reads a manifest. Takes at most a few times the memory of `bytes`, even if the manifest contains wrong counts.
    pub(super) fn read(object: &dyn Fn() -> String, bytes: &[u8]) -> Result<Self, WorldError> {
        let mut reader = Reader::new(object, 0, bytes);
        let magic = reader.take(MAGIC.len(), "`osp world 1`").unwrap_or(bytes);
        if magic != MAGIC {
            return Err(Reader::new(object, 0, bytes).damaged(0, "`osp world 1`", "something else"));
        }
        let version = reader.take(VERSION.len(), "the version of the world")?;
        if version != VERSION {
            let found = String::from_utf8_lossy(version).trim_end().to_owned();
            return Err(reader.damaged(VERSION.len(), "version 1 of the format", format!("`{found}`")));
        }
        let (blocks, polygons) = (reader.u64("the number of blocks")?, reader.u64("the number of polygons")?);
        let (objects, sources) = (reader.u32("the number of objects")?, reader.u32("the number of sources")?);
        let least = u128::from(blocks) * u128::from(BLOCK_BYTES)
            + u128::from(objects) * u128::from(OBJECT_BYTES)
            + u128::from(sources) * u128::from(SOURCE_BYTES)
            + 8;
        if least > reader.left() as u128 {
            let found = format!("the end after {}", reader.left());
            return Err(reader.damaged(
                0,
                format!("{least} bytes for {blocks} blocks, {objects} objects and {sources} sources"),
                found,
            ));
        }
        let (body, end) = bytes.split_at(bytes.len() - 8);
        let stored = u64::from_le_bytes(end.try_into().unwrap_or_default());
        if xxh3_64(body) != stored {
            return Err(WorldError::Damaged {
                object: object(),
                byte: body.len() as u64,
                expected: format!("the checksum {:016x} of the bytes before", xxh3_64(body)),
                found: format!("{stored:016x}"),
            });
        }
        let sources = read_sources(&mut reader, sources)?;
        let objects = read_objects(&mut reader, objects, blocks)?;
        let blocks = read_blocks(&mut reader, &objects, blocks)?;
        if reader.left() != 8 {
            return Err(reader.damaged(0, "the checksum and the end", format!("{} bytes", reader.left())));
        }
        let this = Self { sources, objects, blocks };
        if this.polygon_count() != polygons {
            return Err(WorldError::Damaged {
                object: object(),
                byte: 20,
                expected: format!("the polygons of all blocks, {}", this.polygon_count()),
                found: polygons.to_string(),
            });
        }
        Ok(this)
    }
}

fn read_sources(reader: &mut Reader<'_>, count: u32) -> Result<Vec<Source>, WorldError> {
    let mut sources = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let (polygons, copies) = (reader.u64("polygons of a source")?, reader.u32("copies of a source")?);
        let length = reader.u32("bytes of a name")? as usize;
        let name = reader.take(length, "the name of a source")?;
        let name = match str::from_utf8(name) {
            Ok(name) => name.to_owned(),
            Err(_) => return Err(reader.damaged(length, "a name in UTF-8", "other bytes")),
        };
        sources.push(Source { name, polygons, copies });
    }
    Ok(sources)
}

fn read_objects(reader: &mut Reader<'_>, count: u32, blocks: u64) -> Result<Vec<ObjectEntry>, WorldError> {
    let mut objects = Vec::with_capacity(count as usize);
    let mut left = blocks;
    for _ in 0..count {
        let hash = reader.u64("the hash of an object")?;
        let bytes = reader.u64("the bytes of an object")?;
        let blocks = reader.u64("the blocks of an object")?;
        if blocks == 0 || blocks > left {
            return Err(reader.damaged(8, format!("1 to {left} blocks in the object"), blocks));
        }
        left -= blocks;
        objects.push(ObjectEntry { hash, bytes, blocks });
    }
    match left {
        0 => Ok(objects),
        _ => Err(reader.damaged(0, "objects that hold every block", format!("{left} blocks without one"))),
    }
}

fn read_blocks(
    reader: &mut Reader<'_>,
    objects: &[ObjectEntry],
    count: u64,
) -> Result<Vec<BlockEntry>, WorldError> {
    let mut blocks = Vec::with_capacity(count as usize);
    for (number, object) in objects.iter().enumerate() {
        let mut at = 0;
        for _ in 0..object.blocks {
            let (bytes, polygons) = (reader.u32("bytes of a block")?, reader.u32("polygons of a block")?);
            if !(1..=BLOCK_POLYGONS as u32).contains(&polygons) {
                return Err(reader.damaged(
                    4,
                    format!("1 to {BLOCK_POLYGONS} polygons in a block"),
                    polygons,
                ));
            }
            let fits = bytes_of(polygons as usize);
            if !fits.contains(&(bytes as usize)) {
                let expected = format!("{} to {} bytes for {polygons} polygons", fits.start(), fits.end());
                return Err(reader.damaged(8, expected, bytes));
            }
            let hash = reader.u64("the hash of a block")?;
            let bounds = reader.bounds("the box of a block")?;
            blocks.push(BlockEntry { bounds, polygons, bytes, hash, object: number as u32, at });
            at += u64::from(bytes);
        }
        if at != object.bytes {
            let expected = format!("blocks of {} bytes in the object {}", object.bytes, object.name());
            return Err(reader.damaged(0, expected, format!("blocks of {at} bytes")));
        }
    }
    Ok(blocks)
}
