//! Readers of single fields of a `.tilt`'s metadata, and the types of these fields.

use std::{collections::BTreeMap, marker::PhantomData, path::Path};

use glam::{Quat, Vec3};
use serde::Deserialize;
use serde::de::{DeserializeOwned, Deserializer, IgnoredAny, SeqAccess, Visitor};
use serde_json::value::RawValue;

use super::axes;
use crate::recording::error::{Mismatch, Result};
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

/// The metadata, from which single fields are read.
pub(super) struct Fields<'a> {
    text: &'a str,
    values: BTreeMap<String, &'a RawValue>,
    path: &'a Path,
    pub(super) warnings: &'a mut Vec<String>,
}

impl<'a> Fields<'a> {
    /// Finds the fields. The text must be a JSON object.
    pub(super) fn new(text: &'a str, path: &'a Path, warnings: &'a mut Vec<String>) -> Result<Self> {
        let values = serde_json::from_str(text).map_err(|error| {
            let found = shorten(&error.to_string(), MOST_CHARS);
            Mismatch::new("the metadata of a sketch as a JSON object", found)
                .in_line(path, error.line() as u64)
        })?;
        Ok(Self { text, values, path, warnings })
    }

    /// The value of a field; `None` if the field is absent.
    pub(super) fn value<T: DeserializeOwned>(&self, name: &str, expected: &str) -> Result<Option<T>> {
        let Some(value) = self.values.get(name).map(|value| value.get()) else { return Ok(None) };
        serde_json::from_str(value).map(Some).map_err(|error| {
            let start = value.as_ptr() as usize - self.text.as_ptr() as usize;
            let line = self.text[..start].matches('\n').count() + error.line();
            // The position in the value would be taken for one in the file.
            let found = error.to_string();
            let found = found.rsplit_once(" at line ").map_or(&*found, |(found, _)| found);
            Mismatch::new(expected, shorten(found, MOST_CHARS)).in_line(self.path, line as u64)
        })
    }

    /// The value of a field. `None` if the field is absent, or (with a warning) damaged.
    pub(super) fn read<T: DeserializeOwned>(&mut self, name: &str) -> Option<T> {
        let found = self.value::<Option<T>>(name, &format!("a sound `{name}`"));
        found.map(Option::flatten).unwrap_or_else(|error| {
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
