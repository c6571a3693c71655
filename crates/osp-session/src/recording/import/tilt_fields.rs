//! Readers of single fields of a `.tilt`'s metadata, and the types of these fields.

use std::marker::PhantomData;
use std::path::Path;

use glam::{Quat, Vec3};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

use super::axes;
use crate::recording::{RecordingError, error::Mismatch};
use osp::math::rotate;

/// Largest number of characters of the program's and authors' names in a header, and of a quotation in a warning.
pub(super) const MOST_CHARS: usize = 200;

/// Position, rotation (x, y, z, w) and uniform scale, in Unity's axes and decimetres.
#[derive(Clone, Copy, Deserialize)]
#[serde(expecting = "a list of a position, a rotation and a scale")]
pub(super) struct TiltTransform(pub(super) Vec3, pub(super) Quat, pub(super) f32);

impl TiltTransform {
    pub(super) const IDENTITY: Self = Self(Vec3::ZERO, Quat::IDENTITY, 1.0);

    /// Transforms a pose by the inverse of this transform.
    pub(super) fn take_back(self, p: Vec3, q: Quat) -> (Vec3, Quat) {
        let back = axes::inverse(axes::unit(self.1));
        (rotate(back, p - self.0) / self.2, axes::product(back, q))
    }
}

/// The text, truncated after `most` characters.
pub(super) fn shorten(text: &str, most: usize) -> String {
    let mut chars = text.chars();
    let mut short: String = chars.by_ref().take(most).collect();
    if chars.next().is_some() {
        short.push('…');
    }
    short
}

pub(super) fn mismatch(path: &Path, expected: &str, error: &serde_json::Error) -> RecordingError {
    Mismatch::new(expected, shorten(&error.to_string(), MOST_CHARS)).in_line(path, error.line() as u64)
}

/// The metadata, from which single fields are read.
pub(super) struct Fields<'a> {
    pub(super) text: &'a [u8],
    pub(super) path: &'a Path,
    pub(super) warnings: &'a mut Vec<String>,
}

impl Fields<'_> {
    /// The value of a field. `None` if the field is absent, or (with a warning) damaged.
    pub(super) fn read<T: DeserializeOwned>(&mut self, name: &str) -> Option<T> {
        let mut json = serde_json::Deserializer::from_slice(self.text);
        Field { name, value: PhantomData::<T> }.deserialize(&mut json).unwrap_or_else(|error| {
            let error = mismatch(self.path, &format!("a sound `{name}`"), &error);
            self.warnings.push(format!("{error}; read without it"));
            None
        })
    }

    /// A transform between two spaces; the identity if the field is absent. A transform without an inverse gives `None`
    /// and a warning, because it leaves the camera's position unknown.
    pub(super) fn transform(&mut self, name: &str) -> Option<TiltTransform> {
        let found = self.read(name).unwrap_or(TiltTransform::IDENTITY);
        let TiltTransform(p, q, scale) = found;
        if p.is_finite() && axes::unit(q).is_finite() && scale > 0.0 && scale.is_finite() {
            return Some(found);
        }
        self.warnings.push(format!(
            "{}: expected a rotation and a scale above 0 in `{name}`; found {q} and scale {scale}; \
             read without it and without a camera",
            self.path.display()
        ));
        None
    }

    pub(super) fn warn(&mut self, text: std::fmt::Arguments<'_>) {
        self.warnings.push(format!("{}: {text}; read without it", self.path.display()));
    }
}

/// A value that must be a JSON object. Without this type, serde would also accept a list of the fields' values.
pub(super) struct Object<T>(pub(super) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Object<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ObjectVisitor(PhantomData))
    }
}

struct ObjectVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
    type Value = Object<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Object)
    }
}

/// One field of the outermost object; the other fields are skipped.
struct Field<'n, T> {
    name: &'n str,
    value: PhantomData<T>,
}

impl<'de, T: DeserializeOwned> DeserializeSeed<'de> for Field<'_, T> {
    type Value = Option<T>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de, T: DeserializeOwned> Visitor<'de> for Field<'_, T> {
    type Value = Option<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut value = None;
        while let Some(name) = map.next_key::<String>()? {
            if name == self.name {
                value = map.next_value()?;
            } else {
                map.next_value::<IgnoredAny>()?;
            }
        }
        Ok(value)
    }
}

/// A list of which only the first `MOST` elements are kept.
pub(super) struct Listed<T, const MOST: usize> {
    pub(super) first: Vec<T>,
    pub(super) count: usize,
}

impl<'de, T: Deserialize<'de>, const MOST: usize> Deserialize<'de> for Listed<T, MOST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ListVisitor(PhantomData))
    }
}

struct ListVisitor<T, const MOST: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const MOST: usize> Visitor<'de> for ListVisitor<T, MOST> {
    type Value = Listed<T, MOST>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut first = Vec::new();
        while first.len() < MOST {
            let Some(item) = seq.next_element()? else { return Ok(Listed { count: first.len(), first }) };
            first.push(item);
        }
        let mut count = first.len();
        while seq.next_element::<IgnoredAny>()?.is_some() {
            count += 1;
        }
        Ok(Listed { first, count })
    }
}
