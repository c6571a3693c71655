use base64::{Engine as _, prelude::BASE64_STANDARD};
use serde::{Deserialize, Serialize};

use super::import::tilt_layout::{point_mask, stroke_mask};

/// Extensions of a stroke in a Tilt Brush or Open Brush sketch that osp does not interpret, such as the number of its
/// animation frame. They are kept byte for byte. Text holds them as base64.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SketchExtensions {
    /// The bits of the stroke's mask, and the data of these bits, as in the file.
    pub(crate) stroke_mask: u32,
    pub(crate) stroke: Vec<u8>,
    /// The bits of the control points' mask, and a word for each bit of each point.
    pub(crate) point_mask: u32,
    pub(crate) points: Vec<u8>,
}

impl SketchExtensions {
    /// Largest size of the data of a stroke, bytes.
    pub(crate) const MOST_BYTES: u64 = 1 << 18;

    /// The stroke's animation frame in Open Brush, from 0.
    pub fn frame(&self) -> Option<u32> {
        // The frame is the first of these extensions.
        let has_frame = self.stroke_mask >> stroke_mask::FRAME & 1 == 1;
        self.stroke.first_chunk().filter(|_| has_frame).map(|word| u32::from_le_bytes(*word))
    }

    /// Number of bytes for each control point.
    pub(crate) fn point_len(&self) -> usize {
        4 * self.point_mask.count_ones() as usize
    }

    fn is_sound(&self) -> bool {
        let (mut left, known) = (&self.stroke[..], 1 << stroke_mask::FRAME);
        for bit in (0..u32::BITS).filter(|bit| self.stroke_mask >> bit & 1 == 1) {
            let Some((word, rest)) = left.split_first_chunk() else { return false };
            let length = if bit < stroke_mask::FIRST_LONG { 0 } else { u32::from_le_bytes(*word) };
            let Some(rest) = rest.get(length as usize..) else { return false };
            left = rest;
        }
        let are_other = self.stroke_mask & (known - 1) == 0 && self.point_mask & point_mask::KNOWN == 0;
        let is_whole = self.points.is_empty()
            || (self.point_len() > 0 && self.points.len().is_multiple_of(self.point_len()));
        left.is_empty() && are_other && is_whole
    }
}

impl From<SketchExtensions> for String {
    fn from(this: SketchExtensions) -> Self {
        let head = [this.stroke_mask, this.point_mask, this.stroke.len() as u32].map(u32::to_le_bytes);
        BASE64_STANDARD.encode([head.as_flattened(), &this.stroke, &this.points].concat())
    }
}

impl TryFrom<String> for SketchExtensions {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, &'static str> {
        let read = || {
            let bytes = BASE64_STANDARD.decode(text).ok()?;
            let (head, data) = bytes.split_at_checked(12)?;
            let [stroke_mask, point_mask, length] =
                [0, 4, 8].map(|at| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]));
            let (stroke, points) = data.split_at_checked(length as usize)?;
            let (stroke, points) = (stroke.to_vec(), points.to_vec());
            Some(Self { stroke_mask, stroke, point_mask, points }).filter(Self::is_sound)
        };
        read().ok_or("expected the extensions of a stroke of a sketch")
    }
}
