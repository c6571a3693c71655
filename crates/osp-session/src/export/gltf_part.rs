use glam::{Vec2, Vec3};

use crate::brush::Surface;
use osp::polygon::ConvexPolygon;

/// Number of bytes of a vertex: position and normal as floats, colour as four 16-bit numbers, texture coordinates, time
/// and stroke as floats.
pub(super) const VERTEX_BYTES: usize = 12 + 12 + 8 + 8 + 4 + 4;

/// Vertices and triangles of one material in one object.
#[derive(Default)]
pub(super) struct Part {
    pub(super) vertices: Vec<u8>,
    pub(super) indices: Vec<u32>,
    pub(super) min: Vec3,
    pub(super) max: Vec3,
}

impl Part {
    pub(super) fn count(&self) -> usize {
        self.vertices.len() / VERTEX_BYTES
    }

    pub(super) fn bytes(&self) -> usize {
        self.vertices.len() + self.indices.len() * 4
    }

    /// Adds a polygon. `tail` has the values that are the same at all corners: the time, seconds, and the
    /// number of the stroke.
    pub(super) fn add(
        &mut self,
        polygon: &ConvexPolygon,
        surface: &Surface,
        color: [f32; 4],
        tail: [f32; 2],
    ) {
        let corners = polygon.vertices();
        let flat = unit_normal(polygon.area_vector());
        let first = self.count() as u32;
        if first == 0 {
            (self.min, self.max) = (corners[0], corners[0]);
        }
        for (i, &corner) in corners.iter().enumerate() {
            (self.min, self.max) = (self.min.min(corner), self.max.max(corner));
            let normal = surface.normal(i).unwrap_or(flat);
            let Vec2 { x, y } = surface.uv(i);
            for number in corner.to_array().into_iter().chain(normal.to_array()) {
                self.vertices.extend(number.to_le_bytes());
            }
            let [r, g, b, a] = color;
            let color = [r, g, b, a * surface.alpha(i)].map(|c| (c * 65535.0).round() as u16);
            self.vertices.extend(color.iter().flat_map(|c| c.to_le_bytes()));
            let [secs, stroke] = tail;
            self.vertices.extend([x, y, secs, stroke].iter().flat_map(|number| number.to_le_bytes()));
        }
        for i in 2..corners.len() as u32 {
            self.indices.extend([first, first + i - 1, first + i]);
        }
    }
}

/// Unit normal of a polygon with this area vector. If the area vector of a huge polygon has overflowed, the result
/// is any unit vector.
fn unit_normal(area_vector: Vec3) -> Vec3 {
    area_vector.try_normalize().filter(|normal| normal.is_finite()).unwrap_or(Vec3::Y)
}
