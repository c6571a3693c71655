//! Converts a stroke to the conventions of a `.tilt`: decimetres, Unity's axes, a brush of Tilt Brush.

use glam::{Mat3, Quat, Vec3};

use super::kept_strokes::{KeptPoint, KeptStroke};
use crate::{
    brush::{self, Brush},
    recording::{
        Motion, NormalRule, Paint, SketchExtensions, Tool,
        import::{
            axes,
            tilt_layout::{METERS_PER_UNIT, point_mask, stroke_mask},
        },
    },
    stroke::{Sample, frame},
};
use osp::math::{COORDINATE_LIMIT_M, TOLERANCE_M, unit};

/// The brush that is most similar to a stroke without a brush. A ribbon's brush depends on whether its width follows
/// the pressure. A wall becomes the convex hull of its corners.
fn stand_in(stroke: &KeptStroke) -> Option<&'static Brush> {
    brush::find(match stroke.tool {
        Tool::Ribbon if stroke.thinnest < 1.0 => "Marker",
        Tool::Ribbon => "Flat",
        Tool::Tube => "Wire",
        Tool::Wall => "MatteHull",
    })
}

/// A reader multiplies by two factors and rounds each product. The writer searches for a number that the reader maps
/// back exactly. It tries all floats within this number of units in the last place.
const INVERSE_REACH: u32 = 8;

pub(super) struct TiltStroke<'s> {
    stroke: &'s KeptStroke,
    motion: Motion,
    pub(super) guid: &'s str,
    /// For a stroke without a brush, the brush that replaces it. It determines how pressures become widths.
    pub(super) plain: Option<&'static Brush>,
    size_units: f32,
    scale: f32,
}

pub(super) struct Place {
    pub(super) brush: u32,
    pub(super) layer: u32,
    pub(super) group: u32,
}

impl<'s> TiltStroke<'s> {
    /// Converts a stroke. `None` if the format cannot represent the width or a point, because the stroke was
    /// scaled to a point or is too far away.
    pub(super) fn new(stroke: &'s KeptStroke, motion: Motion) -> Option<Self> {
        let paint = stroke.paint.as_deref();
        let named = paint.map_or("", |paint| &paint.brush);
        let known = brush::find(named);
        let plain = if known.is_none() && !is_guid(named) { stand_in(stroke) } else { None };
        let guid = known.or(plain).map_or(named, |brush| &brush.guid);
        let (mut width_m, mut scale) = (stroke.width_m, paint.map_or(1.0, |paint| paint.scale));
        if motion != Motion::STAY {
            (width_m, scale) = (width_m * motion.to.s, scale * motion.to.s);
        }
        let size_units = unscaled(width_m, scale);
        let is_sound = (0.0..COORDINATE_LIMIT_M).contains(&width_m)
            && size_units.is_finite()
            && scale > 0.0
            && scale <= COORDINATE_LIMIT_M;
        let this = Self { stroke, motion, guid, plain, size_units, scale };
        let is_near = |p: Vec3| p.is_finite() && p.abs().max_element() < COORDINATE_LIMIT_M;
        (is_sound && stroke.points.iter().all(|point| is_near(this.moved(point).p))).then_some(this)
    }

    pub(super) fn paint(&self) -> Option<&'s Paint> {
        self.stroke.paint.as_deref()
    }

    pub(super) fn point_count(&self) -> usize {
        self.stroke.points.len()
    }

    /// Number of control points whose times the format cannot represent.
    pub(super) fn points_out_of_time(&self) -> u64 {
        let is_out = |point: &&KeptPoint| !(0.0..=f64::from(u32::MAX)).contains(&milliseconds(point.t));
        self.stroke.points.iter().filter(is_out).count() as u64
    }

    /// Extensions of the stroke that osp does not know, and the bytes of each control point. The bytes are `None` if
    /// the stroke no longer has the control points that it was read with.
    fn others(&self) -> (Option<&'s SketchExtensions>, Option<std::slice::Chunks<'s, u8>>) {
        let others = self.paint().and_then(|paint| paint.sketch_extensions.as_deref());
        let of_points = others.filter(|others| {
            others.point_mask > 0 && others.points.len() == self.point_count() * others.point_len()
        });
        (others, of_points.map(|others| others.points.chunks(others.point_len())))
    }

    /// Whether extensions of the control points are not written.
    pub(super) fn loses_extensions(&self) -> bool {
        let (others, of_points) = self.others();
        others.is_some_and(|others| others.point_mask > 0) && of_points.is_none()
    }

    /// Whether the stroke has an extension that needs version 6 of `data.sketch`.
    pub(super) fn has_long_extension(&self) -> bool {
        self.others().0.is_some_and(|others| others.stroke_mask >> stroke_mask::FIRST_LONG > 0)
    }

    /// Appends the stroke in the format of `data.sketch`.
    pub(super) fn write(&self, place: &Place, out: &mut Vec<u8>) {
        let paint = self.paint();
        let seed = paint.map_or(0, |paint| paint.seed);
        let flags = paint.map_or(0, |paint| paint.sketch_flags);
        // The bits of all known extensions precede those of all others.
        let (others, mut of_points) = self.others();
        let (r, g, b, a) = self.stroke.color;
        let mut word = |word: u32| out.extend(word.to_le_bytes());
        word(place.brush);
        [r, g, b, a, self.size_units].into_iter().for_each(|x| word(x.to_bits()));
        let bit = |bit: u32| 1 << bit;
        let group = if place.group == 0 { 0 } else { bit(stroke_mask::GROUP) };
        let mask = bit(stroke_mask::FLAGS) | bit(stroke_mask::SCALE) | group;
        let mask = mask | bit(stroke_mask::SEED) | bit(stroke_mask::LAYER);
        word(mask | others.map_or(0, |others| others.stroke_mask));
        word(
            point_mask::KNOWN | others.filter(|_| of_points.is_some()).map_or(0, |others| others.point_mask),
        );
        word(flags);
        word(self.scale.to_bits());
        if place.group != 0 {
            word(place.group);
        }
        word(seed);
        word(place.layer);
        out.extend(others.iter().flat_map(|others| &others.stroke));
        out.extend((self.stroke.points.len() as u32).to_le_bytes());
        let points = match self.plain {
            Some(brush) => self.plain_points(brush),
            None => self.stroke.points.clone(),
        };
        for point in &points {
            let KeptPoint { t, p, q, pressure } = self.moved(point);
            let p = axes::position_from_unity(p).to_array().map(|x| unscaled(x, 1.0));
            let q = axes::rotation_from_unity(q).to_array();
            let numbers = p.into_iter().chain(q).chain([pressure]).map(f32::to_bits);
            // The cast clamps the time to the range of `u32`.
            let words = numbers.chain([milliseconds(t) as u32]);
            out.extend(words.flat_map(u32::to_le_bytes));
            out.extend(of_points.as_mut().and_then(Iterator::next).into_iter().flatten());
        }
    }

    /// Transforms a point to world space. The points of a stroke that was not moved stay the same, bit for
    /// bit.
    fn moved(&self, point: &KeptPoint) -> KeptPoint {
        if self.motion == Motion::STAY {
            return *point;
        }
        KeptPoint { p: self.motion.point(point.p), q: self.motion.orientation(point.q), ..*point }
    }

    /// Converts the points of a stroke without a brush for the brush that replaces it. The tracker's forward axis
    /// becomes the ribbon's normal. Pressures are converted to keep the widths, within the range of the brush.
    fn plain_points(&self, brush: &Brush) -> Vec<KeptPoint> {
        let points = &self.stroke.points;
        let least = brush.pressure_size_min;
        let mut side = None;
        let mut turned = |at: usize| {
            let point = points[at];
            let steps = [(at.checked_sub(1), Some(at)), (Some(at), Some(at + 1))];
            let step = steps.into_iter().find_map(|(from, to)| {
                let step = points.get(to?)?.p - points.get(from?)?.p;
                (step.length() > TOLERANCE_M).then(|| step.normalize_or_zero())
            });
            let Some(travel) = step.filter(|step| *step != Vec3::ZERO) else { return point.q };
            let sample = Sample { position: point.p, orientation: unit(point.q), pressure: point.pressure };
            let width = frame::side(self.stroke.normal, &sample, travel, side);
            side = Some(width);
            // Local x, y and z in the world: the tracker looks along -z.
            let normal = width.cross(travel).normalize_or_zero();
            if normal == Vec3::ZERO {
                return point.q;
            }
            let right = travel.cross(-normal).normalize_or_zero();
            Quat::from_mat3(&Mat3::from_cols(right, travel, -normal))
        };
        let pressure = |pressure: f32| {
            let size = self.stroke.thinnest + (1.0 - self.stroke.thinnest) * pressure.clamp(0.0, 1.0);
            if least < 1.0 { ((size - least) / (1.0 - least)).clamp(0.0, 1.0) } else { pressure }
        };
        let is_ribbon = self.stroke.tool == Tool::Ribbon && self.stroke.normal != NormalRule::Travel;
        (0..points.len())
            .map(|at| KeptPoint {
                q: if is_ribbon { turned(at) } else { points[at].q },
                pressure: pressure(points[at].pressure),
                ..points[at]
            })
            .collect()
    }
}

fn milliseconds(secs: f64) -> f64 {
    (secs * 1000.0).round()
}

/// Whether a name is a GUID. Brushes that the crate's table lacks have a GUID as name.
fn is_guid(name: &str) -> bool {
    let is_hyphen = |at: usize| [8, 13, 18, 23].contains(&at);
    let is_part =
        |(at, byte): (usize, u8)| if is_hyphen(at) { byte == b'-' } else { byte.is_ascii_hexdigit() };
    name.len() == 36 && name.bytes().enumerate().all(is_part)
}

/// The number of units that a reader scales to exactly these metres, or else the nearest number.
fn unscaled(meters: f32, scale: f32) -> f32 {
    let nearest = (f64::from(meters) / f64::from(METERS_PER_UNIT) / f64::from(scale)) as f32;
    let reads = |units: &f32| (units * scale * METERS_PER_UNIT).to_bits() == meters.to_bits();
    let (mut below, mut above) = (nearest, nearest);
    for _ in 0..=INVERSE_REACH {
        if let Some(found) = [below, above].into_iter().find(reads) {
            return found;
        }
        (below, above) = (below.next_down(), above.next_up());
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_that_were_read_come_back_to_the_same_metres() {
        let mut units = 1.0e-6_f32;
        while units < 1.0e6 {
            for scale in [1.0, 0.37, 2.0, 11.3] {
                for units in [units, -units, units.next_up()] {
                    let meters = units * scale * METERS_PER_UNIT;
                    let back = unscaled(meters, scale) * scale * METERS_PER_UNIT;
                    assert_eq!(back.to_bits(), meters.to_bits(), "{units} x {scale}");
                }
            }
            units *= 1.0173;
        }
        assert_eq!(unscaled(-0.0, 1.0).to_bits(), (-0.0_f32).to_bits());
    }
}
