//! Unpacks compressed meshes: `EXT_meshopt_compression` by the crate `meshopt`, `KHR_draco_mesh_compression` by the crate
//! `draco-core`. Without the feature `compress`, both are faults.

use serde_json::Value;

use super::{container::File, extensions};
use crate::recording::error::Mismatch;

/// Unpacks all packed parts of a file. Returns the faults of those that cannot be unpacked.
pub(super) fn unpack(file: &mut File) -> Vec<Mismatch> {
    let mut faults = Vec::new();
    for number in 0..file.root.buffer_views.len() {
        let extensions = file.root.buffer_views[number].extensions.as_ref();
        let packed = extensions::MESHOPT.iter().find_map(|name| extensions?.others.get(*name));
        let Some(packed) = packed.cloned() else { continue };
        match meshopt(file, &packed) {
            Ok(bytes) => {
                file.unpacked.insert(number, bytes);
            }
            Err(fault) => {
                faults.push(Mismatch { found: format!("{} in buffer view {number}", fault.found), ..fault })
            }
        }
    }
    for mesh in 0..file.root.meshes.len() {
        for primitive in 0..file.root.meshes[mesh].primitives.len() {
            let extensions = file.root.meshes[mesh].primitives[primitive].extensions.as_ref();
            let packed = extensions.and_then(|of| of.others.get(extensions::DRACO)).cloned();
            if let Some(Err(fault)) = packed.map(|packed| draco(file, mesh, primitive, &packed)) {
                faults.push(Mismatch {
                    found: format!("{} in mesh {mesh}, primitive {primitive}", fault.found),
                    ..fault
                });
            }
        }
    }
    faults
}

#[cfg(feature = "compress")]
fn number(of: &Value, name: &str) -> Option<u64> {
    of.get(name)?.as_u64()
}

#[cfg(not(feature = "compress"))]
fn meshopt(_file: &mut File, _packed: &Value) -> Result<Vec<u8>, Mismatch> {
    Err(Mismatch::new(PACKED, "a build without it"))
}

#[cfg(not(feature = "compress"))]
fn draco(_file: &mut File, _mesh: usize, _primitive: usize, _packed: &Value) -> Result<(), Mismatch> {
    Err(Mismatch::new(PACKED, "a build without it"))
}

#[cfg(not(feature = "compress"))]
const PACKED: &str = "a build of osp that reads packed meshes (`cargo build --release --features render`)";

/// Most bytes that a packed byte becomes: a column of zeros.
#[cfg(feature = "compress")]
const MOST_UNPACKED: u64 = 1024;

#[cfg(feature = "compress")]
fn meshopt(file: &mut File, packed: &Value) -> Result<Vec<u8>, Mismatch> {
    let damaged = || Mismatch::new("a buffer view packed by meshopt", "a damaged one");
    let of = |name: &str| number(packed, name).ok_or_else(damaged);
    let (count, stride, length) = (of("count")?, of("byteStride")?, of("byteLength")?);
    let most = file.most_bytes.min(length.saturating_mul(MOST_UNPACKED));
    let size = count.checked_mul(stride).filter(|&size| size <= most).ok_or_else(damaged)?;
    let buffer = usize::try_from(of("buffer")?).map_err(|_| damaged())?;
    let start = number(packed, "byteOffset").unwrap_or_default();
    let bytes = file.bytes(buffer, start, length).ok_or_else(damaged)?;
    let (count, text) = (count as usize, |name: &str| packed[name].as_str().unwrap_or_default());
    let narrow = |indices: Vec<u16>| indices.into_iter().flat_map(u16::to_ne_bytes).collect();
    let wide = |indices: Vec<u32>| indices.into_iter().flat_map(u32::to_ne_bytes).collect();
    let mut out: Vec<u8> = match (text("mode"), stride) {
        ("TRIANGLES", 2) => meshopt::decode_index_buffer(bytes, count).map(narrow),
        ("TRIANGLES", 4) => meshopt::decode_index_buffer(bytes, count).map(wide),
        ("INDICES", 2) => meshopt::decode_index_sequence(bytes, count).map(narrow),
        ("INDICES", 4) => meshopt::decode_index_sequence(bytes, count).map(wide),
        ("ATTRIBUTES", _) => Ok(vertices(bytes, count, stride).ok_or_else(damaged)?),
        _ => return Err(damaged()),
    }
    .map_err(|_| damaged())?;
    filter(&mut out, text("filter"), stride).ok_or_else(damaged)?;
    file.most_bytes -= size;
    Ok(out)
}

/// Decodes vertices of a stride of 4 to 128 bytes.
#[cfg(feature = "compress")]
fn vertices(bytes: &[u8], count: usize, stride: u64) -> Option<Vec<u8>> {
    macro_rules! of_words {
        ($($words:literal)*) => {
            match (stride % 4, stride / 4) {
                $((0, $words) => meshopt::decode_vertex_buffer::<[u32; $words]>(bytes, count).ok().map(raw),)*
                _ => None,
            }
        };
    }
    fn raw<const N: usize>(vertices: Vec<[u32; N]>) -> Vec<u8> {
        vertices.into_iter().flatten().flat_map(u32::to_ne_bytes).collect()
    }
    of_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
}

#[cfg(feature = "compress")]
fn filter(bytes: &mut Vec<u8>, name: &str, stride: u64) -> Option<()> {
    macro_rules! filtered {
        ($number:ty, $count:literal, $filter:path) => {{
            const SIZE: usize = size_of::<$number>();
            let number = |of: &[[u8; SIZE]], i: usize| <$number>::from_ne_bytes(of[i]);
            let elements = bytes.as_chunks::<{ SIZE * $count }>().0.iter().map(|of| of.as_chunks().0);
            let mut values: Vec<[$number; $count]> =
                elements.map(|of| std::array::from_fn(|i| number(of, i))).collect();
            $filter(&mut values);
            *bytes = values.into_iter().flatten().flat_map(<$number>::to_ne_bytes).collect();
        }};
    }
    match (name, stride) {
        ("" | "NONE", _) => {}
        ("OCTAHEDRAL", 4) => filtered!(i8, 4, meshopt::decode_filter_oct),
        ("OCTAHEDRAL", 8) => filtered!(i16, 4, meshopt::decode_filter_oct),
        ("QUATERNION", 8) => filtered!(i16, 4, meshopt::decode_filter_quat),
        ("EXPONENTIAL", _) => filtered!(u32, 1, meshopt::decode_filter_exp),
        ("COLOR", 4) => filtered!(u8, 4, meshopt::decode_filter_color),
        ("COLOR", 8) => filtered!(u16, 4, meshopt::decode_filter_color),
        _ => return None,
    }
    Some(())
}

#[cfg(feature = "compress")]
fn draco(file: &mut File, mesh: usize, primitive: usize, packed: &Value) -> Result<(), Mismatch> {
    use gltf_json::{
        Index,
        accessor::{ComponentType, GenericComponentType},
        validation::{Checked, USize64},
    };
    let damaged = || Mismatch::new("a mesh packed by Draco", "a damaged one");
    let view =
        number(packed, "bufferView").and_then(|view| usize::try_from(view).ok()).ok_or_else(damaged)?;
    let mut decoded = draco_core::Mesh::new();
    let mut buffer = draco_core::DecoderBuffer::new(file.view(view)?);
    draco_core::MeshDecoder::new().decode(&mut buffer, &mut decoded).map_err(|_| damaged())?;
    let points = decoded.num_points();
    let described = &file.root.meshes[mesh].primitives[primitive];
    let mut accessors = Vec::new();
    for (semantic, accessor) in &described.attributes {
        let Checked::Valid(name) = semantic else { continue };
        let id = number(&packed["attributes"], &name.to_string()).and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| decoded.attribute_by_unique_id(id));
        let (Some(attribute), Some(old)) = (attribute, file.root.accessors.get(accessor.value())) else {
            continue;
        };
        let Checked::Valid(kind) = old.type_ else { continue };
        let most = match old.component_type {
            Checked::Valid(GenericComponentType(kind)) if old.normalized => match kind {
                ComponentType::I8 => f32::from(i8::MAX),
                ComponentType::U8 => f32::from(u8::MAX),
                ComponentType::I16 => f32::from(i16::MAX),
                ComponentType::U16 => f32::from(u16::MAX),
                ComponentType::U32 | ComponentType::F32 => 1.0,
            },
            _ => 1.0,
        };
        let values = attribute.read_f32s(points, kind.multiplicity());
        let bytes = values.into_iter().flat_map(|value| (value / most).to_le_bytes()).collect();
        let component_type = Checked::Valid(GenericComponentType(ComponentType::F32));
        let new = gltf_json::Accessor { component_type, normalized: false, ..old.clone() };
        accessors.push((Some(semantic.clone()), new, points, bytes));
    }
    let positions = accessors.first().map(|(_, accessor, ..)| accessor.clone()).ok_or_else(damaged)?;
    let corners = decoded.faces().iter().flatten();
    let bytes: Vec<u8> = corners.flat_map(|corner| corner.0.to_le_bytes()).collect();
    let component_type = Checked::Valid(GenericComponentType(ComponentType::U32));
    let type_ = Checked::Valid(gltf_json::accessor::Type::Scalar);
    let indices = gltf_json::Accessor { component_type, type_, normalized: false, ..positions };
    accessors.push((None, indices, 3 * decoded.num_faces(), bytes));
    for (semantic, accessor, count, bytes) in accessors {
        // No view of the file has this number.
        let view = file.root.buffer_views.len() + file.unpacked.len();
        file.unpacked.insert(view, bytes);
        let new = Index::push(
            &mut file.root.accessors,
            gltf_json::Accessor {
                buffer_view: Some(Index::new(view as u32)),
                byte_offset: None,
                count: USize64(count as u64),
                sparse: None,
                ..accessor
            },
        );
        let described = &mut file.root.meshes[mesh].primitives[primitive];
        match semantic {
            Some(semantic) => drop(described.attributes.insert(semantic, new)),
            None => described.indices = Some(new),
        }
    }
    Ok(())
}
