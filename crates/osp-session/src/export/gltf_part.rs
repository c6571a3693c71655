use std::collections::HashMap;

use glam::Vec3;

use crate::brush::Surface;
use osp::polygon::ConvexPolygon;

/// Number of bytes of a vertex that viewers draw: position and normal as floats, colour as four 16-bit numbers, texture
/// coordinates as floats.
const DRAWN_BYTES: usize = 12 + 12 + 8 + 8;
/// The same with time and stroke, floats.
pub(super) const VERTEX_BYTES: usize = DRAWN_BYTES + 4 + 4;

/// Vertices and triangles of one material in one object.
#[derive(Default)]
pub(super) struct Part {
    pub(super) vertices: Vec<u8>,
    pub(super) indices: Vec<u32>,
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    /// Numbers of the vertices, by their bytes, if equal vertices are merged. Merged vertices have neither time nor
    /// stroke.
    known: Option<HashMap<[u8; DRAWN_BYTES], u32>>,
}

impl Part {
    /// A part whose equal vertices are merged, without times and strokes.
    pub(super) fn welded() -> Self {
        Self { known: Some(HashMap::new()), ..Self::default() }
    }

    /// Number of bytes of a vertex.
    pub(super) fn stride(&self) -> usize {
        if self.known.is_some() { DRAWN_BYTES } else { VERTEX_BYTES }
    }

    /// Whether the vertices have a time and the number of a stroke.
    pub(super) fn has_tail(&self) -> bool {
        self.known.is_none()
    }

    pub(super) fn count(&self) -> usize {
        self.vertices.len() / self.stride()
    }

    pub(super) fn bytes(&self) -> usize {
        self.vertices.len() + self.indices.len() * 4
    }

    /// Adds a polygon. `paint` gives the colour and the texture coordinates of a corner. `tail` has the values that are
    /// the same at all corners: the time, seconds, and the number of the stroke.
    pub(super) fn add(
        &mut self,
        polygon: &ConvexPolygon,
        surface: &Surface,
        paint: impl Fn(usize) -> ([f32; 4], [f32; 2]),
        tail: [f32; 2],
    ) {
        let corners = polygon.vertices();
        let flat = unit_normal(polygon.area_vector());
        if self.vertices.is_empty() {
            (self.min, self.max) = (corners[0], corners[0]);
        }
        let mut numbers = [0; 4];
        for (i, (&corner, number)) in corners.iter().zip(&mut numbers).enumerate() {
            (self.min, self.max) = (self.min.min(corner), self.max.max(corner));
            let normal = surface.normal(i).unwrap_or(flat);
            let (color, uv) = paint(i);
            let mut bytes = [0; DRAWN_BYTES];
            let floats = corner.to_array().into_iter().chain(normal.to_array());
            bytes[..24].as_chunks_mut().0.iter_mut().zip(floats).for_each(|(to, n)| *to = n.to_le_bytes());
            let color = color.map(|c| (c * 65535.0).round() as u16);
            bytes[24..32].as_chunks_mut().0.iter_mut().zip(color).for_each(|(to, n)| *to = n.to_le_bytes());
            bytes[32..].as_chunks_mut().0.iter_mut().zip(uv).for_each(|(to, n)| *to = n.to_le_bytes());
            let next = self.count() as u32;
            *number = match &mut self.known {
                Some(known) => *known.entry(bytes).or_insert(next),
                None => next,
            };
            if *number == next {
                self.vertices.extend(bytes);
                if self.has_tail() {
                    self.vertices.extend(tail.iter().flat_map(|number| number.to_le_bytes()));
                }
            }
        }
        for i in 2..corners.len() {
            self.indices.extend([numbers[0], numbers[i - 1], numbers[i]]);
        }
    }
}

/// Unit normal of a polygon with this area vector. If the area vector of a huge polygon has overflowed, the result
/// is any unit vector.
fn unit_normal(area_vector: Vec3) -> Vec3 {
    area_vector.try_normalize().filter(|normal| normal.is_finite()).unwrap_or(Vec3::Y)
}
