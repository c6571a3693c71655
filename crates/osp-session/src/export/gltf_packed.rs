//! Smaller vertices (`KHR_mesh_quantization`) and compressed buffers (`EXT_meshopt_compression`).

#[cfg(feature = "compress")]
use std::io;

use glam::Vec3;

use super::{
    error::ExportError,
    gltf_part::{DRAWN_BYTES, Grid, Layout, Packed, Part},
};

/// Quantises the vertices of a welded part. Positions become grid coordinates if there is a grid, and normals become
/// bytes. Texture coordinates become 16-bit numbers if all are from 0 to 1.
pub(super) fn quantize(part: &mut Part, grid: Option<Grid>) {
    let rows = std::mem::take(&mut part.vertices);
    let rows = rows.as_chunks::<DRAWN_BYTES>().0;
    let has_small_uvs =
        rows.iter().all(|row| floats_at::<2>(row, 32).iter().all(|uv| (0.0..=1.0).contains(uv)));
    part.layout = Layout { tail: 0, grid, has_byte_normals: true, has_small_uvs };
    for row in rows {
        match &grid {
            Some(grid) => {
                let place = grid.place(Vec3::from_array(floats_at(row, 0)));
                part.vertices.extend(place.into_iter().chain([0]).flat_map(u16::to_le_bytes));
            }
            None => part.vertices.extend_from_slice(&row[..12]),
        }
        let normal = floats_at::<3>(row, 12).map(|n| (n * 127.0).round() as i8 as u8);
        part.vertices.extend(normal.into_iter().chain([0]));
        part.vertices.extend_from_slice(&row[24..32]);
        match has_small_uvs {
            true => {
                let uvs = floats_at::<2>(row, 32).map(|uv| (uv * 65535.0).round() as u16);
                part.vertices.extend(uvs.into_iter().flat_map(u16::to_le_bytes));
            }
            false => part.vertices.extend_from_slice(&row[32..40]),
        }
    }
    if let Some(grid) = &grid {
        // Grid coordinates increase with the positions, so the bounds stay bounds.
        [part.min, part.max] = [part.min, part.max].map(|p| Vec3::from(grid.place(p).map(f32::from)));
    }
}

/// Reads the floats of a vertex, from byte `from` on.
fn floats_at<const N: usize>(row: &[u8; DRAWN_BYTES], from: usize) -> [f32; N] {
    std::array::from_fn(|i| f32::from_le_bytes(std::array::from_fn(|byte| row[from + 4 * i + byte])))
}

/// Compresses a part. The triangles keep their order, because blended triangles depend on it.
#[cfg(feature = "compress")]
pub(super) fn compress(part: &Part) -> Result<Packed, ExportError> {
    fn rows<const STRIDE: usize>(bytes: &[u8]) -> meshopt::Result<Vec<u8>> {
        /// Version of the codec that the glTF extension requires.
        const VERSION: i32 = 0;
        meshopt::encode_vertex_buffer_level(bytes.as_chunks::<STRIDE>().0, 2, Some(VERSION))
    }
    let packed = |error| ExportError::Io(io::Error::other(error));
    let vertices = match part.layout.stride() {
        24 => rows::<24>(&part.vertices),
        28 => rows::<28>(&part.vertices),
        _ => rows::<32>(&part.vertices),
    };
    Ok(Packed {
        vertices: vertices.map_err(packed)?,
        indices: meshopt::encode_index_buffer(&part.indices, part.count()).map_err(packed)?,
    })
}

#[cfg(not(feature = "compress"))]
pub(super) fn compress(_part: &Part) -> Result<Packed, ExportError> {
    Err(ExportError::NotCompressed)
}
