use std::collections::HashMap;

use glam::Vec3;

use crate::brush::Surface;
use osp::polygon::ConvexPolygon;

/// Size of a vertex's standard attributes, bytes: position and normal as floats, colour as four 16-bit numbers, texture
/// coordinates as floats.
pub(super) const DRAWN_BYTES: usize = 12 + 12 + 8 + 8;

const FLOAT: u32 = 5126;
const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;

/// Number of a vertex's standard attributes.
const TAIL_FROM: usize = 4;

/// Largest distance between two neighbouring grid positions, metres: a small part of the width of the thinnest strokes.
const MOST_STEP_M: f32 = 0.000_5;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    pub(super) origin: Vec3,
    pub(super) step_m: f32,
}

impl Grid {
    /// The grid over a box; `None` if its positions would be more than [`MOST_STEP_M`] apart.
    pub(super) fn of(min: Vec3, max: Vec3) -> Option<Self> {
        let step_m = (max - min).max_element() / f32::from(u16::MAX);
        (step_m > 0.0 && step_m <= MOST_STEP_M).then_some(Self { origin: min, step_m })
    }

    pub(super) fn place(&self, position: Vec3) -> [u16; 3] {
        ((position - self.origin) / self.step_m).round().to_array().map(|n| n as u16)
    }
}

/// The number formats of a vertex's attributes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layout {
    /// Number of further attributes: none; time and stroke number; or these and the brush's own colour.
    pub(super) tail: usize,
    /// The grid, if positions are 16-bit grid coordinates. Without a grid, positions are floats.
    pub(super) grid: Option<Grid>,
    /// Whether normals are signed bytes, not floats.
    pub(super) has_byte_normals: bool,
    /// Whether texture coordinates are 16-bit numbers, not floats.
    pub(super) has_small_uvs: bool,
}

pub(super) struct Attribute {
    pub(super) name: &'static str,
    /// Offset in the vertex, bytes.
    pub(super) offset: usize,
    pub(super) component: u32,
    pub(super) is_normalized: bool,
    /// glTF's name for the type, such as `VEC3`.
    pub(super) shape: &'static str,
}

impl Layout {
    /// The attributes of a vertex, each with its size in bytes.
    fn values(self) -> impl Iterator<Item = (usize, Attribute)> {
        let position = if self.grid.is_some() { (8, UNSIGNED_SHORT, false) } else { (12, FLOAT, false) };
        let normal = if self.has_byte_normals { (4, BYTE, true) } else { (12, FLOAT, false) };
        let uv = if self.has_small_uvs { (4, UNSIGNED_SHORT, true) } else { (8, FLOAT, false) };
        let values: [(&str, (usize, u32, bool), &str); TAIL_FROM + 3] = [
            ("POSITION", position, "VEC3"),
            ("NORMAL", normal, "VEC3"),
            ("COLOR_0", (8, UNSIGNED_SHORT, true), "VEC4"),
            ("TEXCOORD_0", uv, "VEC2"),
            ("_TIMESTAMP", (4, FLOAT, false), "SCALAR"),
            ("_STROKE", (4, FLOAT, false), "SCALAR"),
            ("COLOR_1", (4, UNSIGNED_BYTE, true), "VEC4"),
        ];
        let mut end = 0;
        values.into_iter().take(TAIL_FROM + self.tail).map(
            move |(name, (bytes, component, is_normalized), shape)| {
                let offset = end;
                end += bytes;
                (bytes, Attribute { name, offset, component, is_normalized, shape })
            },
        )
    }

    pub(super) fn attributes(self) -> impl Iterator<Item = Attribute> {
        self.values().map(|(_, attribute)| attribute)
    }

    pub(super) fn stride(self) -> usize {
        self.values().map(|(bytes, _)| bytes).sum()
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Packed {
    pub(super) vertices: Vec<u8>,
    pub(super) indices: Vec<u8>,
}

/// Vertices and triangles of one material in one object.
pub(super) struct Part {
    pub(super) layout: Layout,
    pub(super) vertices: Vec<u8>,
    pub(super) indices: Vec<u32>,
    /// The compressed bytes, if the file stores these instead of `vertices` and `indices`.
    pub(super) packed: Option<Packed>,
    /// Bounds of the positions, metres or grid coordinates.
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    /// The number of each vertex, by its bytes, if equal vertices are merged.
    known: Option<HashMap<[u8; DRAWN_BYTES], u32>>,
}

impl Part {
    /// Creates an empty part. If `is_welded`, equal vertices are merged, and vertices have no tail.
    pub(super) fn new(is_welded: bool, has_brush: bool) -> Self {
        let tail = if is_welded { 0 } else { 2 + usize::from(has_brush) };
        Self {
            layout: Layout { tail, ..Layout::default() },
            vertices: Vec::new(),
            indices: Vec::new(),
            packed: None,
            min: Vec3::ZERO,
            max: Vec3::ZERO,
            known: is_welded.then(HashMap::new),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.vertices.len() / self.layout.stride()
    }

    /// Sizes of the vertices and of the indices before compression, bytes.
    pub(super) fn raw_bytes(&self) -> [usize; 2] {
        [self.vertices.len(), self.indices.len() * 4]
    }

    /// Sizes of the vertices and of the indices in the file, bytes.
    pub(super) fn stored_bytes(&self) -> [usize; 2] {
        self.packed.as_ref().map_or(self.raw_bytes(), |packed| [packed.vertices.len(), packed.indices.len()])
    }

    /// Size in the file, bytes. Includes the padding of both ranges.
    pub(super) fn bytes(&self) -> usize {
        self.stored_bytes().map(aligned).into_iter().sum()
    }

    /// Adds a polygon. `paint` returns the colour of a corner, its texture coordinates, and the brush's own colour.
    /// `tail` is the time, seconds, and the number of the stroke, the same at all corners.
    pub(super) fn add(
        &mut self,
        polygon: &ConvexPolygon,
        surface: &Surface,
        paint: &dyn Fn(usize) -> ([f32; 4], [f32; 2], [u8; 4]),
        tail: [f32; 2],
    ) {
        let corners = polygon.vertices();
        let flat = unit_normal(polygon.area_vector());
        if self.vertices.is_empty() {
            (self.min, self.max) = (corners[0], corners[0]);
        }
        let stride = self.layout.stride();
        let mut numbers = [0; 4];
        for (i, (&corner, number)) in corners.iter().zip(&mut numbers).enumerate() {
            (self.min, self.max) = (self.min.min(corner), self.max.max(corner));
            let normal = surface.normal(i).unwrap_or(flat);
            let (color, uv, own) = paint(i);
            let mut bytes = [0; DRAWN_BYTES];
            let floats = corner.to_array().into_iter().chain(normal.to_array());
            bytes[..24].as_chunks_mut().0.iter_mut().zip(floats).for_each(|(to, n)| *to = n.to_le_bytes());
            let color = color.map(|c| (c * 65535.0).round() as u16);
            bytes[24..32].as_chunks_mut().0.iter_mut().zip(color).for_each(|(to, n)| *to = n.to_le_bytes());
            bytes[32..].as_chunks_mut().0.iter_mut().zip(uv).for_each(|(to, n)| *to = n.to_le_bytes());
            let next = (self.vertices.len() / stride) as u32;
            *number = match &mut self.known {
                Some(known) => *known.entry(bytes).or_insert(next),
                None => next,
            };
            if *number == next {
                self.vertices.extend(bytes);
                let tail = tail.map(f32::to_le_bytes).into_iter().chain([own]);
                self.vertices.extend(tail.take(self.layout.tail).flatten());
            }
        }
        for i in 2..corners.len() {
            self.indices.extend([numbers[0], numbers[i - 1], numbers[i]]);
        }
    }
}

/// Padded length of a part of the binary chunk with contents of this length, bytes.
pub(super) fn aligned(bytes: usize) -> usize {
    bytes.next_multiple_of(4)
}

/// Unit normal of a polygon with this area vector. If the area vector of a huge polygon has overflowed, the result
/// is any unit vector.
fn unit_normal(area_vector: Vec3) -> Vec3 {
    area_vector.try_normalize().filter(|normal| normal.is_finite()).unwrap_or(Vec3::Y)
}
