//! A block: a few thousand polygons that lie close together, as bytes and in memory. All numbers are little-endian:
//!
//! | byte | contents |
//! |---|---|
//! | 0 | `OSPB` |
//! | 4 | numbers of polygons, pieces and boxes: 32 bits each |
//! | 16 | for each piece (polygons of one colour): its first polygon, number of polygons (32 bits each), red, green, blue, opacity (32-bit floats) |
//! | then | the polygons: four corners, 32-bit floats; a triangle has its last corner twice |
//! | then | boxes that are larger than the polygon's corners require, because the polygon is animated: index in the block (32 bits), least and greatest corner |

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use glam::Vec3;

use super::{
    WorldError,
    boxes::PolygonBoxes,
    bytes::{Reader, put_bounds, put_floats},
};
use osp::{
    index::IndexConfig,
    math::{Aabb, Containment, Frustum},
    polygon::{ConvexPolygon, PolygonId, VisibleBlocks},
};
use osp_session::replay::SetFingerprint;

/// Largest number of polygons of a block. With larger blocks, flights need fewer requests and boxes, but load more
/// polygons out of view.
pub const BLOCK_POLYGONS: usize = 4096;

const MAGIC: &[u8; 4] = b"OSPB";
const HEAD_BYTES: usize = 16;
const PIECE_BYTES: usize = 24;
const POLYGON_BYTES: usize = 48;
const BOX_BYTES: usize = 28;

/// The smallest and the largest size of a block of `polygons` polygons, bytes.
pub(super) fn bytes_of(polygons: usize) -> std::ops::RangeInclusive<usize> {
    HEAD_BYTES + PIECE_BYTES + polygons * POLYGON_BYTES
        ..=HEAD_BYTES + polygons * (PIECE_BYTES + POLYGON_BYTES + BOX_BYTES)
}

/// Polygons with consecutive numbers and one colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The number of the first polygon.
    pub first: PolygonId,
    /// Number of polygons.
    pub polygons: u32,
    /// Red, green, blue, opacity, sRGB.
    pub color: [f32; 4],
}

/// A block that is being filled.
#[derive(Debug, Default)]
pub(super) struct BlockBuilder {
    pieces: Vec<Piece>,
    corners: Vec<u8>,
    pub(super) polygons: usize,
    boxes: Vec<(u32, Aabb)>,
    bounds: Option<Aabb>,
}

impl BlockBuilder {
    /// Box of all polygons.
    pub(super) fn bounds(&self) -> Aabb {
        self.bounds.unwrap_or(Aabb::EMPTY)
    }

    pub(super) fn add(&mut self, id: PolygonId, color: [f32; 4], polygon: &ConvexPolygon, bounds: &Aabb) {
        match self.pieces.last_mut() {
            Some(last)
                if u64::from(last.first.0) + u64::from(last.polygons) == u64::from(id.0)
                    && last.color == color =>
            {
                last.polygons += 1;
            }
            _ => self.pieces.push(Piece { first: id, polygons: 1, color }),
        }
        let corners = corners_of(polygon);
        corners.iter().for_each(|corner| put_floats(&mut self.corners, &corner.to_array()));
        if Aabb::from_points(&corners) != *bounds {
            self.boxes.push((self.polygons as u32, *bounds));
        }
        self.bounds = Some(self.bounds().union(bounds));
        self.polygons += 1;
    }

    /// Appends the block's bytes to `out`, and begins the next block.
    pub(super) fn put(&mut self, out: &mut Vec<u8>) {
        out.extend(MAGIC);
        for count in [self.polygons, self.pieces.len(), self.boxes.len()] {
            out.extend((count as u32).to_le_bytes());
        }
        for piece in &self.pieces {
            out.extend(piece.first.0.to_le_bytes());
            out.extend(piece.polygons.to_le_bytes());
            put_floats(out, &piece.color);
        }
        out.extend_from_slice(&self.corners);
        for (at, bounds) in &self.boxes {
            out.extend(at.to_le_bytes());
            put_bounds(out, bounds);
        }
        self.pieces.clear();
        self.corners.clear();
        self.boxes.clear();
        (self.polygons, self.bounds) = (0, None);
    }
}

/// The corners of a polygon; a triangle repeats its last corner.
fn corners_of(polygon: &ConvexPolygon) -> [Vec3; 4] {
    let corners = polygon.vertices();
    std::array::from_fn(|i| corners[i.min(corners.len() - 1)])
}

/// Memory of blocks and of buffers that become blocks, bytes: now, and the largest value so far.
#[derive(Debug, Default)]
pub(super) struct MemoryUse {
    now: AtomicU64,
    most: AtomicU64,
}

impl MemoryUse {
    pub(super) fn most(&self) -> u64 {
        self.most.load(Ordering::Relaxed)
    }
}

/// A share of the memory in [`MemoryUse`], which is subtracted when the share is dropped.
#[derive(Debug)]
pub(super) struct MemoryShare {
    held: Arc<MemoryUse>,
    bytes: u64,
}

impl MemoryShare {
    pub(super) fn new(held: &Arc<MemoryUse>, bytes: usize) -> Self {
        let bytes = bytes as u64;
        let now = held.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
        held.most.fetch_max(now, Ordering::Relaxed);
        Self { held: Arc::clone(held), bytes }
    }
}

impl Drop for MemoryShare {
    fn drop(&mut self) {
        self.held.now.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// A block in memory.
pub struct Block {
    pieces: Vec<Piece>,
    corners: Vec<[Vec3; 4]>,
    /// The boxes of the polygons, by position in the block.
    boxes: PolygonBoxes,
    /// The fingerprint of all polygons.
    pub(super) all: SetFingerprint,
    /// Memory of the block, bytes.
    pub bytes: usize,
    _share: Option<MemoryShare>,
}

impl std::fmt::Debug for Block {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Block").field("polygons", &self.corners.len()).finish_non_exhaustive()
    }
}

impl Block {
    /// Upper bound of the memory of a block of `polygons` polygons, bytes: its pieces, corners and boxes, and their
    /// construction.
    pub(super) fn max_memory_of(polygons: usize) -> u64 {
        (polygons * (PIECE_BYTES + POLYGON_BYTES + 2 * size_of::<Aabb>()) + (2 << 10)) as u64
    }

    /// Reads a block. `polygons` and `bounds` come from the manifest; the box must contain all polygons of the block.
    ///
    /// # Errors
    /// The bytes are damaged. The error names the object by `object`; the block begins at the object's byte `start`.
    pub(super) fn read(
        object: &dyn Fn() -> String,
        start: u64,
        bytes: &[u8],
        bounds: &Aabb,
        polygons: usize,
    ) -> Result<Self, WorldError> {
        let mut reader = Reader::new(object, start, bytes);
        let magic = reader.take(4, "the mark of a block")?;
        if magic != MAGIC {
            return Err(reader.damaged(4, "`OSPB`, the mark of a block", format!("{magic:02x?}")));
        }
        let count = reader.u32("polygons of the block")?;
        if count as usize != polygons || polygons > BLOCK_POLYGONS {
            return Err(reader.damaged(4, format!("{polygons} polygons, as in the manifest"), count));
        }
        let (pieces, boxes) = (reader.u32("pieces of the block")?, reader.u32("boxes of the block")?);
        let wanted = (polygons * POLYGON_BYTES) as u64
            + u64::from(pieces) * PIECE_BYTES as u64
            + u64::from(boxes) * BOX_BYTES as u64;
        if wanted != reader.left() as u64 || pieces > count || boxes > count {
            let expected = format!("pieces and boxes that fit {} bytes", reader.left());
            return Err(reader.damaged(8, expected, format!("{pieces} pieces and {boxes} boxes")));
        }
        let pieces = read_pieces(&mut reader, pieces, polygons)?;
        let corners_at = reader.left();
        let mut corners = Vec::with_capacity(polygons);
        let mut tight = Vec::with_capacity(polygons);
        for _ in 0..polygons {
            let floats: [f32; 12] = reader.floats("corners of a polygon")?;
            let polygon: [Vec3; 4] = std::array::from_fn(|i| Vec3::from_slice(&floats[3 * i..]));
            if !polygon.iter().all(|corner| corner.is_finite()) {
                return Err(reader.damaged(POLYGON_BYTES, "finite corners", format!("{polygon:?}")));
            }
            corners.push(polygon);
            tight.push(Aabb::from_points(&polygon));
        }
        for _ in 0..boxes {
            let at = reader.u32("the place of a polygon in the block")? as usize;
            if at >= polygons {
                return Err(reader.damaged(4, format!("a place below {polygons}"), at));
            }
            tight[at] = reader.bounds("the box of a polygon")?;
        }
        for (i, bounds_of_one) in tight.iter().enumerate() {
            let fits = bounds.contains(bounds_of_one) && bounds_of_one.is_valid();
            if !fits {
                let byte = start + (bytes.len() - corners_at + i * POLYGON_BYTES) as u64;
                return Err(WorldError::Damaged {
                    object: object(),
                    byte,
                    expected: format!("a polygon in the box of its block, {} to {}", bounds.min, bounds.max),
                    found: format!("{} to {}", bounds_of_one.min, bounds_of_one.max),
                });
            }
        }
        let boxes = PolygonBoxes::new(&tight);
        let all = SetFingerprint::of(pieces.iter().flat_map(ids_of_piece));
        let bytes = size_of::<Self>()
            + pieces.capacity() * size_of::<Piece>()
            + corners.capacity() * POLYGON_BYTES
            + boxes.bytes();
        Ok(Self { pieces, corners, boxes, all, bytes, _share: None })
    }

    /// The block, with its memory added to `held`.
    pub(super) fn held_by(mut self, held: &Arc<MemoryUse>) -> Self {
        self._share = Some(MemoryShare::new(held, self.bytes));
        self
    }

    /// The polygons: number, corners, colour.
    pub fn polygons(&self) -> impl Iterator<Item = (PolygonId, ConvexPolygon, [f32; 4])> + '_ {
        let ids = self.pieces.iter().flat_map(|piece| ids_of_piece(piece).map(move |id| (id, piece.color)));
        ids.zip(&self.corners).map(|((id, color), &[a, b, c, d])| {
            let polygon =
                if c == d { ConvexPolygon::triangle(a, b, c) } else { ConvexPolygon::quad([a, b, c, d]) };
            (id, polygon, color)
        })
    }

    /// Sets `seen` to the positions of the polygons that the frustum may see. `how` is the outcome of the frustum test
    /// of the block's box. Returns `false` if the frustum may see all polygons of the block; in this case `seen` may be
    /// unchanged.
    pub(super) fn cull(&self, frustum: &Frustum, how: Containment, seen: &mut VisibleBlocks) -> bool {
        if how == Containment::Inside {
            return false;
        }
        seen.clear();
        self.boxes.cull(frustum, seen);
        seen.len() < self.boxes.len
    }

    /// The fingerprint of the polygons at the positions `seen`.
    pub(super) fn fingerprint_of(&self, seen: &VisibleBlocks) -> SetFingerprint {
        let mut pieces = self.pieces.iter();
        let (mut piece, mut begin) = (pieces.next(), 0);
        // Positions and pieces both ascend.
        SetFingerprint::of(seen.ids().filter_map(|place| {
            while let Some(current) = piece {
                if place.0 - begin < current.polygons {
                    return Some(PolygonId(current.first.0 + (place.0 - begin)));
                }
                begin += current.polygons;
                piece = pieces.next();
            }
            None
        }))
    }
}

fn ids_of_piece(piece: &Piece) -> impl Iterator<Item = PolygonId> + use<> {
    (piece.first.0..=piece.first.0 + (piece.polygons - 1)).map(PolygonId)
}

fn read_pieces(reader: &mut Reader<'_>, count: u32, polygons: usize) -> Result<Vec<Piece>, WorldError> {
    let mut pieces = Vec::with_capacity(count as usize);
    let mut left = polygons as u64;
    for _ in 0..count {
        let (first, polygons) = (reader.u32("the first number")?, reader.u32("polygons of a piece")?);
        if polygons == 0 || u64::from(polygons) > left || first.checked_add(polygons - 1).is_none() {
            let expected = format!("a piece of 1 to {left} polygons with numbers of 32 bits");
            return Err(reader.damaged(8, expected, format!("{polygons} from number {first}")));
        }
        left -= u64::from(polygons);
        let color = reader.floats("the colour of a piece")?;
        pieces.push(Piece { first: PolygonId(first), polygons, color });
    }
    if left != 0 {
        return Err(reader.damaged(
            0,
            "pieces that name every polygon",
            format!("{left} polygons without one"),
        ));
    }
    Ok(pieces)
}

/// A root cube for the index of polygons in a box.
pub(super) fn root_around(bounds: &Aabb) -> Aabb {
    let side_m = bounds.extent().max_element();
    match bounds.is_valid() && side_m.is_finite() {
        true => Aabb::cube(bounds.center(), side_m.max(1.0e-3) * 1.01),
        false => IndexConfig::default().root,
    }
}
