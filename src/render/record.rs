use bytemuck::{Pod, Zeroable};

use crate::{polygon::PolygonId, scene::Scene};

/// A polygon as the vertex shader reads it: four corners (a triangle repeats its last), the colour in the first spare
/// word, as red, green, blue, opacity from the lowest byte.
///
/// Words, not floats: a colour read as a float could be a signalling NaN, which some drivers quieten.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PolygonRecord {
    corners: [[u32; 4]; 4],
}

impl PolygonRecord {
    /// Bytes of a polygon on the GPU.
    pub(super) const SIZE: u64 = size_of::<Self>() as u64;

    /// The record of a polygon as it is now.
    pub(super) fn of(scene: &Scene, id: PolygonId) -> Self {
        let polygon = scene.polygon(id);
        let corners = polygon.vertices();
        let last = corners.len() - 1;
        let mut record = Self::default();
        for (i, words) in record.corners.iter_mut().enumerate() {
            let p = corners[i.min(last)];
            *words = [p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), 0];
        }
        record.corners[0][3] = u32::from_le_bytes(color_bytes(scene.stroke_of(id).color()));
        record
    }
}

/// Whether something behind a polygon of this colour is seen through it.
pub(super) fn is_transparent(color: (f32, f32, f32, f32)) -> bool {
    color_bytes(color)[3] < 255
}

fn color_bytes((r, g, b, a): (f32, f32, f32, f32)) -> [u8; 4] {
    [r, g, b, a].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
}
