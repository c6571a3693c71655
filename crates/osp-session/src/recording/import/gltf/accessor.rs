//! Reads numbers from buffers in place. Sizes that a damaged file states therefore allocate no memory.

use gltf_json::{
    accessor::{ComponentType, Type},
    validation::Checked,
};

use super::container::File;
use crate::recording::error::Mismatch;

/// Elements at a constant stride in a buffer.
#[derive(Clone, Copy)]
struct Row<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Row<'a> {
    /// `count` elements of `size` bytes each, from `offset` in a buffer view.
    fn new(file: &'a File, view: usize, offset: u64, count: u64, size: usize) -> Result<Self, Mismatch> {
        let bytes = file.view(view)?;
        let described = file.root.buffer_views.get(view);
        let stride = described.and_then(|described| described.byte_stride).map_or(size, |stride| stride.0);
        let few = || {
            let expected = format!("{count} elements of {size} bytes in buffer view {view}");
            Mismatch::new(expected, format!("a view of {} bytes", bytes.len()))
        };
        if stride < size {
            return Err(Mismatch::new(
                format!("a stride of {size} bytes in buffer view {view}"),
                stride.to_string(),
            ));
        }
        let bytes = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..)).ok_or_else(few)?;
        let Some(last) = count.checked_sub(1) else { return Ok(Self { bytes: &[], stride }) };
        let needed = last.checked_mul(stride as u64).and_then(|bytes| bytes.checked_add(size as u64));
        if needed.is_none_or(|needed| needed > bytes.len() as u64) {
            return Err(few());
        }
        Ok(Self { bytes, stride })
    }

    fn at(&self, number: usize) -> &'a [u8] {
        self.bytes.get(number.saturating_mul(self.stride)..).unwrap_or(&[])
    }
}

pub(super) struct Elements<'a> {
    count: usize,
    pub(super) width: usize,
    kind: ComponentType,
    normalized: bool,
    /// The stored elements. If `None`, all elements are zero.
    base: Option<Row<'a>>,
    sparse: Option<Sparse<'a>>,
}

/// Elements that replace those of `Elements::base`, sorted by index.
struct Sparse<'a> {
    count: usize,
    numbers: Row<'a>,
    number_kind: ComponentType,
    values: Row<'a>,
}

impl<'a> Elements<'a> {
    pub(super) fn new(file: &'a File, accessor: usize) -> Result<Self, Mismatch> {
        let accessors = &file.root.accessors;
        let missing =
            || Mismatch::new(format!("accessor {accessor}"), format!("{} of them", accessors.len()));
        let described = accessors.get(accessor).ok_or_else(missing)?;
        let (Checked::Valid(component), Checked::Valid(shape)) =
            (&described.component_type, &described.type_)
        else {
            let expected = format!("a component type and a type of glTF in accessor {accessor}");
            return Err(Mismatch::new(expected, "others"));
        };
        let width = match shape {
            Type::Scalar => 1,
            Type::Vec2 => 2,
            Type::Vec3 => 3,
            Type::Vec4 => 4,
            Type::Mat2 | Type::Mat3 | Type::Mat4 => {
                return Err(Mismatch::new(
                    format!("a scalar or a vector in accessor {accessor}"),
                    "a matrix",
                ));
            }
        };
        let kind = component.0;
        let (count, size) = (described.count.0, width * kind.size());
        let counted = u32::try_from(count)
            .map_err(|_| Mismatch::new(format!("fewer than 2^32 elements in accessor {accessor}"), "more"))?;
        let base = described
            .buffer_view
            .map(|view| {
                Row::new(file, view.value(), described.byte_offset.unwrap_or_default().0, count, size)
            })
            .transpose()?;
        let sparse = described.sparse.as_ref().map(|sparse| {
            let Checked::Valid(number_kind) = &sparse.indices.component_type else {
                return Err(Mismatch::new("the component type of sparse indices", "another"));
            };
            let (count, indices) = (sparse.count.0, &sparse.indices);
            let number_kind = number_kind.0;
            let numbers = Row::new(
                file,
                indices.buffer_view.value(),
                indices.byte_offset.0,
                count,
                number_kind.size(),
            )?;
            let values =
                Row::new(file, sparse.values.buffer_view.value(), sparse.values.byte_offset.0, count, size)?;
            Ok(Sparse { count: count as usize, numbers, number_kind, values })
        });
        let sparse = sparse.transpose()?;
        let normalized = described.normalized;
        Ok(Self { count: counted as usize, width, kind, normalized, base, sparse })
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    fn bytes(&self, number: usize) -> &'a [u8] {
        if let Some(sparse) = &self.sparse {
            let number_at = |at| integer(sparse.number_kind, sparse.numbers.at(at)) as usize;
            let (mut low, mut high) = (0, sparse.count);
            while low < high {
                let middle = low + (high - low) / 2;
                if number_at(middle) < number { low = middle + 1 } else { high = middle }
            }
            if low < sparse.count && number_at(low) == number {
                return sparse.values.at(low);
            }
        }
        self.base.map_or(&[], |row| row.at(number))
    }

    /// The element as an integer; 0 if it does not exist.
    pub(super) fn integer(&self, number: usize) -> u32 {
        integer(self.kind, self.bytes(number))
    }

    /// The components of an element. Components beyond the accessor's width have the values of `usual`.
    pub(super) fn vector(&self, number: usize, usual: [f32; 4]) -> [f32; 4] {
        let bytes = self.bytes(number);
        let mut values = usual;
        for (component, value) in values.iter_mut().enumerate().take(self.width) {
            let bytes = bytes.get(component * self.kind.size()..).unwrap_or(&[]);
            *value = self.float(bytes);
        }
        values
    }

    fn float(&self, bytes: &[u8]) -> f32 {
        let raw = integer(self.kind, bytes);
        let (value, most) = match self.kind {
            ComponentType::F32 => return f32::from_bits(raw),
            ComponentType::I8 => (f32::from(raw as u8 as i8), f32::from(i8::MAX)),
            ComponentType::U8 => (raw as f32, f32::from(u8::MAX)),
            ComponentType::I16 => (f32::from(raw as u16 as i16), f32::from(i16::MAX)),
            ComponentType::U16 => (raw as f32, f32::from(u16::MAX)),
            ComponentType::U32 => (raw as f32, u32::MAX as f32),
        };
        if self.normalized { (value / most).max(-1.0) } else { value }
    }
}

/// The bits of a component; 0 if it does not exist.
fn integer(kind: ComponentType, bytes: &[u8]) -> u32 {
    let mut word = [0; 4];
    let size = kind.size();
    if let Some(bytes) = bytes.get(..size) {
        word[..size].copy_from_slice(bytes);
    }
    u32::from_le_bytes(word)
}
