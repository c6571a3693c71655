//! Cross-sections of welded ribbons. A section consists of line segments, the lanes. Each lane becomes a side of the
//! ribbon.

use glam::Vec3;

use super::{
    bolt,
    track::{Node, Track},
};

pub(super) const LANES: usize = 4;

/// Height of a diamond's middle, as a fraction of half its width.
const BELLY: f32 = 0.125;
/// Fraction of the texture that is cropped at each side of a diamond, because the texture is ragged there.
const CHOP: f32 = 0.1;
/// Height of a box as a fraction of its width.
const BOX_HEIGHT: f32 = 0.375;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    /// A straight line across the ribbon.
    Flat,
    /// A line whose width shrinks to zero at both ends of a segment.
    Tapered,
    /// Three lines with noisy displacements, which meet at both ends of a segment.
    Bolt,
    /// A diamond: raised in the middle on both sides, pinched at the ends.
    Diamond,
    /// A rectangle, closed at both ends of the segment.
    Box,
}

/// One lane of a section: its end points, with normals.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rim {
    pub ends: [Vec3; 2],
    pub normals: [Vec3; 2],
}

pub(super) type Rims = [Rim; LANES];

impl Section {
    pub(super) fn lanes(self) -> usize {
        match self {
            Self::Flat | Self::Tapered => 1,
            Self::Bolt => 3,
            Self::Diamond | Self::Box => 4,
        }
    }

    /// Number of vertices of a section in the original application. The seeds of random numbers depend on it.
    pub(super) fn vertices(self) -> u32 {
        match self {
            Self::Flat | Self::Tapered | Self::Bolt => 2,
            Self::Diamond => 6,
            Self::Box => 8,
        }
    }

    pub(super) fn depends_on_length(self) -> bool {
        matches!(self, Self::Tapered | Self::Bolt)
    }

    /// Range of texture coordinates across the stroke for a lane.
    pub(super) fn across(self, lane: usize) -> [f32; 2] {
        match self {
            Self::Flat | Self::Tapered | Self::Bolt => [0.0, 1.0],
            Self::Diamond => [[CHOP, 0.5], [0.5, 1.0 - CHOP], [1.0 - CHOP, 0.5], [0.5, CHOP]][lane],
            Self::Box => [0.5; 2],
        }
    }

    /// Factor of a section's offsets from the centre line, at the fraction `u` of the segment's length.
    pub(super) fn envelope(self, u: f32) -> f32 {
        let sine = libm::sinf(std::f32::consts::PI * u.clamp(0.0, 1.0)).max(0.0);
        match self {
            Self::Tapered => sine,
            Self::Bolt => 1.0 - (1.0 - sine).powi(10),
            _ => 1.0,
        }
    }

    /// The section at node `i`, at the end of a piece.
    pub(super) fn at(self, track: &Track, i: usize, envelope: f32) -> Rims {
        let nodes = &track.nodes;
        let (node, before) = (&nodes[i], &nodes[i - 1]);
        let after = nodes.get(i + 1);
        let is_end = after.is_none_or(|after| !after.is_linked);
        let half = |node: &Node| 0.5 * node.width_m * node.right;
        let mut frame =
            Frame { middle: node.position, half: half(node), normal: node.normal, is_end, envelope };
        if self == Self::Flat && !track.is_old {
            let after = after.unwrap_or(node);
            frame.middle = 0.3 * before.position + 0.4 * node.position + 0.3 * after.position;
            if !is_end {
                let half_before = if before.is_linked { half(before) } else { frame.half };
                frame.half = 0.3 * half_before + 0.4 * frame.half + 0.3 * half(after);
            }
        }
        self.rims(&frame)
    }

    /// The section at the node before node `i`, at the start of a segment.
    pub(super) fn at_start(self, track: &Track, i: usize) -> Rims {
        let (node, before) = (&track.nodes[i], &track.nodes[i - 1]);
        self.rims(&Frame {
            middle: before.position,
            half: 0.5 * before.size_m * node.right,
            normal: node.normal,
            is_end: true,
            envelope: self.envelope(0.0),
        })
    }

    fn rims(self, frame: &Frame) -> Rims {
        let Frame { middle, half, normal, is_end, envelope } = *frame;
        let line =
            |middle: Vec3, half: Vec3| Rim { ends: [middle - half, middle + half], normals: [normal; 2] };
        let mut rims = Rims::default();
        match self {
            Self::Flat | Self::Tapered => rims[0] = line(middle, half * envelope),
            Self::Bolt => {
                for (copy, rim) in rims.iter_mut().enumerate().take(3) {
                    let to_side = bolt::displacement_m(middle, half.length(), copy) * envelope;
                    *rim = line(middle + to_side, half * envelope);
                }
            }
            Self::Diamond => {
                let rise = if is_end { Vec3::ZERO } else { normal * (BELLY * half.length()) };
                let tilt = if is_end { Vec3::ZERO } else { half.normalize_or_zero() * BELLY };
                let (left, right) = (middle - half, middle + half);
                let (top, bottom) = (middle + rise, middle - rise);
                rims = [
                    Rim { ends: [left, top], normals: [normal - tilt, normal] },
                    Rim { ends: [top, right], normals: [normal, normal + tilt] },
                    Rim { ends: [right, bottom], normals: [tilt - normal, -normal] },
                    Rim { ends: [bottom, left], normals: [-normal, -normal - tilt] },
                ];
            }
            Self::Box => {
                let up = normal * (BOX_HEIGHT * half.length());
                let side = half.normalize_or_zero();
                let corners = [up - half, up + half, half - up, -up - half].map(|offset| middle + offset);
                for (k, normal) in [normal, side, -normal, -side].into_iter().enumerate() {
                    rims[k] = Rim { ends: [corners[k], corners[(k + 1) % 4]], normals: [normal; 2] };
                }
            }
        }
        rims
    }
}

struct Frame {
    middle: Vec3,
    half: Vec3,
    normal: Vec3,
    is_end: bool,
    envelope: f32,
}
