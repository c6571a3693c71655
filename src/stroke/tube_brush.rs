use glam::{Quat, Vec2, Vec3};

use super::{
    Drops, Pieces, Sample, StrokeSettings,
    frame::{any_perpendicular, perpendicular_part},
    knots::{Knot, Knots, Spacing},
    random::Random,
    tube_shape::{Shape, Span},
};
use crate::{
    brush::{Brush, Family, Surface, TubeShape, Uv},
    math::rotate,
    polygon::ConvexPolygon,
};

/// A tube breaks where the hand moves less than this, metres at scale 1.
const SHORTEST_MOVE_M: f32 = 5.0e-4;

/// Textures run by distance modulo this: it leaves room below [`crate::brush::UV_LIMIT`].
const UV_PERIOD: f32 = 7.0;

/// Makes a tube around the samples, in segments: it breaks where the hand turns sharply.
///
/// A tube whose texture runs by distance grows at its end. One that has a shape, or a texture stretched over a segment,
/// changes as a whole with each sample; it is made anew in [`TubeBrushBuilder::settle`], once a frame.
#[derive(Clone, Debug)]
pub struct TubeBrushBuilder {
    brush: &'static Brush,
    shape: Shape,
    uv: Uv,
    is_hard: bool,
    /// Length of the cones that close a segment, in radii.
    cap_aspect: Option<f32>,
    break_mult: f32,
    shortest_move_m: f32,
    random: Random,
    /// Cosine and sine of each corner of a section, and of the middle of each side.
    circle: Vec<[(f32, f32); 2]>,
    knots: Knots,
    /// The kept samples, and then a provisional end.
    line: Vec<Knot>,
    has_end: bool,
    /// Of `line`; the last two may still change.
    rings: Vec<Ring>,
    /// What is drawn and will not change.
    done: Cursor,
    /// What was dropped of that which may still change.
    pending: Drops,
    is_unsettled: bool,
}

/// The cross-section at a knot, and the way to it from the one before.
#[derive(Clone, Copy, Debug)]
struct Ring {
    middle: Vec3,
    radius_m: f32,
    /// From the ring before.
    length_m: f32,
    /// None at the start and where the tube breaks: nothing joins the ring to the one before.
    frame: Option<Frame>,
}

/// Unit vectors. Open Brush's are left-handed; here `right` is `ahead` x `up`.
#[derive(Clone, Copy, Debug)]
struct Frame {
    ahead: Vec3,
    up: Vec3,
    right: Vec3,
}

/// A ring's corners, and how it is painted.
#[derive(Clone, Debug)]
struct Section {
    corners: Vec<Vec3>,
    frame: Frame,
    u: f32,
    /// How far its sides are moved outwards.
    petal_m: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    /// The last knot that is drawn.
    knot: usize,
    /// Polygons so far.
    place: u32,
    /// Corners that Open Brush would have made: the random numbers of a segment start from them.
    corners: u32,
    /// Where the texture has come to, by distance.
    u: f32,
    row: u8,
}

impl TubeBrushBuilder {
    /// A stroke without samples, if the brush makes tubes.
    pub fn new(settings: &StrokeSettings, brush: &'static Brush) -> Option<Self> {
        let Family::Tube { points, hard_edges, caps, cap_aspect, uv, shape, taper, break_mult } =
            brush.family
        else {
            return None;
        };
        let angle = |half_steps: usize| {
            let (sin, cos) = libm::sincosf(std::f32::consts::PI * half_steps as f32 / f32::from(points));
            (cos, sin)
        };
        Some(Self {
            brush,
            shape: Shape { kind: shape, taper, width_m: settings.width_m },
            uv,
            is_hard: hard_edges,
            cap_aspect: caps.then_some(cap_aspect),
            break_mult,
            shortest_move_m: SHORTEST_MOVE_M * settings.scale,
            random: Random::new(settings.seed),
            circle: (0..usize::from(points)).map(|i| [angle(2 * i), angle(2 * i + 1)]).collect(),
            knots: Knots::new(settings, brush, Spacing { length_m: brush.min_length_m, part_of_size: 0.2 }),
            line: Vec::new(),
            has_end: false,
            rings: Vec::new(),
            done: Cursor::default(),
            pending: Drops::default(),
            is_unsettled: false,
        })
    }

    /// Takes a sample and says in `out` what that does.
    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let Some(step) = self.knots.push(sample, drops) else {
            if let (true, Some(first)) = (self.line.is_empty(), self.knots.last()) {
                self.line.push(*first);
                self.done.place = out.len();
            }
            return;
        };
        if self.has_end {
            self.line.pop();
        }
        self.line.push(step.to);
        self.has_end = !step.is_kept;
        if self.changes_as_a_whole() {
            self.is_unsettled = true;
        } else {
            self.grow(out, drops);
        }
    }

    /// Makes anew what changes as a whole with each sample.
    pub fn settle(&mut self, out: &mut Pieces, drops: &mut Drops) {
        if !std::mem::take(&mut self.is_unsettled) {
            return;
        }
        self.update_rings();
        out.truncate(self.done.place);
        let (mut cursor, mut dropped) = (self.done, Drops::default());
        let end = self.rings.len();
        let mut first = cursor.knot + 1;
        while first < end {
            let span = (first..end).take_while(|&i| self.rings[i].frame.is_some()).count();
            if span > 0 {
                self.add_segment(first, first + span - 1, &mut cursor, out, &mut dropped);
            }
            // The knot after a segment is a break.
            first += span + 1;
            if first + 1 < end {
                (cursor.knot, cursor.place) = (first - 1, out.len());
                self.done = cursor;
                add(drops, &std::mem::take(&mut dropped));
            }
        }
        self.pending = dropped;
    }

    /// Ends the stroke.
    pub fn finish(&mut self, out: &mut Pieces, drops: &mut Drops) {
        self.settle(out, drops);
        add(drops, &std::mem::take(&mut self.pending));
    }

    fn changes_as_a_whole(&self) -> bool {
        self.uv == Uv::Stretched || self.shape.kind != TubeShape::Plain
    }

    /// Makes the last two pieces anew.
    fn grow(&mut self, out: &mut Pieces, drops: &mut Drops) {
        self.update_rings();
        out.truncate(self.done.place);
        let (mut cursor, mut dropped) = (self.done, Drops::default());
        let last = self.rings.len() - 1;
        for i in cursor.knot + 1..=last {
            self.add_piece(i, &mut cursor, out, &mut dropped);
            if i + 1 == last && !self.has_end {
                self.done = cursor;
                add(drops, &std::mem::take(&mut dropped));
            }
        }
        self.add_front_cap(last, None, &mut cursor, out, &mut dropped);
        self.pending = dropped;
    }

    fn update_rings(&mut self) {
        self.rings.truncate(self.rings.len().saturating_sub(2));
        for i in self.rings.len()..self.line.len() {
            let ring = self.ring(i);
            self.rings.push(ring);
        }
    }

    /// The ring at knot `i`; the one before it is known.
    fn ring(&self, i: usize) -> Ring {
        let knot = &self.line[i];
        let at = knot.sample.position;
        let before = i.checked_sub(1).map(|before| (self.line[before].sample.position, self.rings[before]));
        let middle = match (&before, self.line.get(i + 1)) {
            (Some((before, _)), Some(after)) => at * 0.5 + (*before + after.sample.position) * 0.25,
            _ => at,
        };
        let ring = Ring { middle, radius_m: 0.5 * knot.size_m, length_m: 0.0, frame: None };
        let Some((_, before)) = before else { return ring };
        let step = middle - before.middle;
        let length_m = step.length();
        if !(length_m.is_finite() && length_m > 0.0 && length_m >= self.shortest_move_m) {
            return ring;
        }
        let ahead = step / length_m;
        let frame = match before.frame {
            Some(last) => {
                let sharpest = self.break_mult * libm::atanf(length_m / knot.size_m);
                let turn = libm::atan2f(last.ahead.cross(ahead).length(), last.ahead.dot(ahead));
                (turn <= sharpest).then(|| last.turned_to(ahead))
            }
            None => Some(Frame::first(ahead, knot.sample.orientation)),
        };
        Ring { length_m, frame, ..ring }
    }

    /// Joins knot `i` to the one before, as wide as the samples say.
    fn add_piece(&self, i: usize, cursor: &mut Cursor, out: &mut Pieces, drops: &mut Drops) {
        let (before, ring) = (self.rings[i - 1], self.rings[i]);
        if let Some(frame) = ring.frame {
            if before.frame.is_none() {
                self.begin_segment(cursor);
            }
            let back = self.section(before.middle, before.radius_m, before.frame.unwrap_or(frame), cursor.u);
            if before.frame.is_none() {
                self.add_back_cap(&back, before, frame, cursor, out, drops);
            }
            let u = cursor.u + self.u_over(ring.length_m, ring.radius_m);
            let front = self.section(ring.middle, ring.radius_m, frame, u);
            self.add_sides(&back, &front, cursor, out, drops);
        } else {
            self.add_front_cap(i - 1, None, cursor, out, drops);
        }
        (cursor.knot, cursor.place) = (i, out.len());
    }

    /// Adds the segment of these knots, all of which are joined to the one before.
    fn add_segment(
        &self,
        first: usize,
        last: usize,
        cursor: &mut Cursor,
        out: &mut Pieces,
        drops: &mut Drops,
    ) {
        let (before, Some(frame)) = (self.rings[first - 1], self.rings[first].frame) else { return };
        self.begin_segment(cursor);
        let sections = if self.shape.kind == TubeShape::Plain {
            self.plain_sections(first, last, frame, cursor.u)
        } else {
            self.shaped_sections(first, last, frame, cursor.u)
        };
        self.add_back_cap(&sections[0], before, frame, cursor, out, drops);
        for pair in sections.windows(2) {
            self.add_sides(&pair[0], &pair[1], cursor, out, drops);
        }
        self.add_front_cap(last, sections.last(), cursor, out, drops);
    }

    fn plain_sections(&self, first: usize, last: usize, frame: Frame, start_u: f32) -> Vec<Section> {
        let before = self.rings[first - 1];
        let u = self.u_along(first, last, start_u);
        let start = self.section(before.middle, before.radius_m, frame, u[0]);
        let others = self.rings[first..=last]
            .iter()
            .zip(&u[1..])
            .map(|(ring, &u)| self.section(ring.middle, ring.radius_m, ring.frame.unwrap_or(frame), u));
        std::iter::once(start).chain(others).collect()
    }

    /// In Open Brush a ring belongs to two knots, and the shape moves it to the later one, with the earlier one's frame;
    /// so a shaped segment starts at its first knot, not at the one before.
    fn shaped_sections(&self, first: usize, last: usize, frame: Frame, start_u: f32) -> Vec<Section> {
        let rings = &self.rings[first..=last];
        let end = &self.line[last];
        let end_m = end.sample.position.distance(self.line[last - 1].sample.position);
        let span = Span {
            count: rings.len(),
            length_m: rings.iter().map(|ring| ring.length_m).sum(),
            progress: (end_m / self.knots.spacing_m(end)).min(1.0),
        };
        let u = self.u_along(first, last, start_u);
        let mut along_m = 0.0;
        let of = |(number, ring): (usize, &Ring)| {
            along_m += ring.length_m;
            let t = along_m / span.length_m;
            let frame = rings[number.saturating_sub(1)].frame.unwrap_or(frame);
            let radius_m = ring.radius_m * self.shape.curve(&span, number, t);
            let petal_m = self.shape.petal_m(t, self.line[first + number].smoothed);
            Section { petal_m, ..self.section(ring.middle, radius_m, frame, u[number]) }
        };
        rings.iter().enumerate().map(of).collect()
    }

    /// How far the texture has come at the start of a segment and at each of its knots.
    fn u_along(&self, first: usize, last: usize, start_u: f32) -> Vec<f32> {
        let count = last - first + 1;
        if self.uv == Uv::Stretched {
            return (0..=count).map(|i| i.min(count - 1) as f32 / count as f32).collect();
        }
        let mut u = start_u;
        let others = self.rings[first..=last].iter().map(|ring| {
            u += self.u_over(ring.length_m, ring.radius_m);
            u
        });
        std::iter::once(start_u).chain(others).collect()
    }

    /// By how much a texture advances over a length on a tube of this radius.
    fn u_over(&self, length_m: f32, radius_m: f32) -> f32 {
        let u = self.brush.tile_rate * length_m / (std::f32::consts::TAU * radius_m);
        if u.is_finite() { u } else { 0.0 }
    }

    fn begin_segment(&self, cursor: &mut Cursor) {
        let random = self.random.unit(cursor.corners.wrapping_sub(1));
        cursor.u = random;
        // Cast: below 3331.
        cursor.row = ((random * 3331.0) as u32 % u32::from(self.brush.atlas_rows.max(1))) as u8;
        cursor.count(self.corners_of_ring());
    }

    /// As Open Brush counts them: hard edges have two corners in one place, and so has the seam of a soft tube.
    fn corners_of_ring(&self) -> usize {
        if self.is_hard { 2 * self.circle.len() } else { self.circle.len() + 1 }
    }

    fn section(&self, middle: Vec3, radius_m: f32, frame: Frame, u: f32) -> Section {
        let corners =
            self.circle.iter().map(|[corner, _]| middle + frame.outwards(*corner) * radius_m).collect();
        Section { corners, frame, u, petal_m: 0.0 }
    }

    fn add_sides(
        &self,
        back: &Section,
        front: &Section,
        cursor: &mut Cursor,
        out: &mut Pieces,
        drops: &mut Drops,
    ) {
        let count = self.circle.len();
        // Any whole number may go; a short quad keeps apart what a longer period needs (one bulb of seven lit).
        let first_u = match front.u - back.u {
            ..=1.0 => back.u - back.u.rem_euclid(UV_PERIOD),
            _ => back.u.floor(),
        };
        let u = [back.u, front.u].map(|u| u - first_u);
        for i in 0..count {
            let j = (i + 1) % count;
            let v = [i, i + 1].map(|corner| self.v(corner as f32, cursor.row));
            let uv =
                [Vec2::new(u[0], v[0]), Vec2::new(u[0], v[1]), Vec2::new(u[1], v[1]), Vec2::new(u[1], v[0])];
            let lift = |section: &Section| section.frame.outwards(self.circle[i][1]) * section.petal_m;
            let (back_lift, front_lift) = (lift(back), lift(front));
            let corners = [
                back.corners[i] + back_lift,
                back.corners[j] + back_lift,
                front.corners[j] + front_lift,
                front.corners[i] + front_lift,
            ];
            let normals = [(back, i), (back, j), (front, j), (front, i)]
                .map(|(section, corner)| section.frame.outwards(self.circle[corner][0]));
            push_side(corners, self.surface(normals, uv), out, drops);
        }
        cursor.u = front.u - first_u;
        cursor.count(self.corners_of_ring());
    }

    fn surface(&self, normals: [Vec3; 4], uv: [Vec2; 4]) -> Surface {
        if self.is_hard { Surface::flat(uv, [1.0; 4]) } else { Surface::smooth(normals, uv, [1.0; 4]) }
    }

    /// The texture's other coordinate, round the tube: at a corner of a section, or between two.
    fn v(&self, corner: f32, row: u8) -> f32 {
        (f32::from(row) + corner / self.circle.len() as f32) / f32::from(self.brush.atlas_rows.max(1))
    }

    fn add_back_cap(
        &self,
        back: &Section,
        ring: Ring,
        frame: Frame,
        cursor: &mut Cursor,
        out: &mut Pieces,
        drops: &mut Drops,
    ) {
        let Some(aspect) = self.cap_aspect else { return };
        let tip = ring.middle - frame.ahead * (ring.radius_m * aspect);
        self.add_cap(back, ring.radius_m, (tip, -frame.ahead), -1.0, cursor, out, drops);
    }

    /// Closes the tube at knot `i`, if it has come there.
    fn add_front_cap(
        &self,
        i: usize,
        section: Option<&Section>,
        cursor: &mut Cursor,
        out: &mut Pieces,
        drops: &mut Drops,
    ) {
        let ring = self.rings[i];
        let (Some(frame), Some(aspect)) = (ring.frame, self.cap_aspect) else { return };
        let tip = ring.middle + frame.ahead * (ring.radius_m * aspect);
        match section {
            Some(section) => {
                self.add_cap(section, ring.radius_m, (tip, frame.ahead), 1.0, cursor, out, drops)
            }
            None => {
                let section = self.section(ring.middle, ring.radius_m, frame, cursor.u);
                self.add_cap(&section, ring.radius_m, (tip, frame.ahead), 1.0, cursor, out, drops);
            }
        }
    }

    /// A cone from a section to its tip, whose normal is given; `sign` says whether it lies ahead.
    #[expect(clippy::too_many_arguments, reason = "two caps share the rest")]
    fn add_cap(
        &self,
        section: &Section,
        radius_m: f32,
        (tip, tip_normal): (Vec3, Vec3),
        sign: f32,
        cursor: &mut Cursor,
        out: &mut Pieces,
        drops: &mut Drops,
    ) {
        let count = self.circle.len();
        let first_u = section.u - section.u.rem_euclid(UV_PERIOD);
        let u = section.u - first_u;
        let u_tip = match self.uv {
            Uv::Stretched => u,
            _ => u + sign * self.u_over(section.corners[0].distance(tip), radius_m),
        };
        for i in 0..count {
            let ends = if sign > 0.0 { [i, i + 1] } else { [i + 1, i] };
            let [a, b] = ends.map(|corner| section.corners[corner % count]);
            let [n, o] = ends.map(|corner| section.frame.outwards(self.circle[corner % count][0]));
            let [v, w] = ends.map(|corner| self.v(corner as f32, cursor.row));
            let tip_uv = Vec2::new(u_tip, self.v(i as f32 + 0.5, cursor.row));
            let uv = [Vec2::new(u, v), Vec2::new(u, w), tip_uv, tip_uv];
            let surface = self.surface([n, o, tip_normal, tip_normal], uv);
            out.push(ConvexPolygon::triangle(a, b, tip), surface, drops);
        }
        cursor.count(count);
    }
}

impl Cursor {
    fn count(&mut self, corners: usize) {
        self.corners = self.corners.wrapping_add(corners as u32);
    }
}

impl Frame {
    fn new(ahead: Vec3, up: Vec3) -> Self {
        let up = perpendicular_part(up, ahead).unwrap_or_else(|| any_perpendicular(ahead));
        Self { ahead, up, right: ahead.cross(up) }
    }

    /// Where a segment starts.
    fn first(ahead: Vec3, orientation: Quat) -> Self {
        let up = rotate(orientation, Vec3::Y);
        Self::new(ahead, if up.dot(ahead) < 0.01 { rotate(orientation, Vec3::X) } else { up })
    }

    /// Turned by the smallest rotation that takes it to another direction.
    fn turned_to(self, ahead: Vec3) -> Self {
        let both = self.ahead + ahead;
        let up = self.up - both * (ahead.dot(self.up) / (1.0 + self.ahead.dot(ahead)).max(1.0e-6));
        Self::new(ahead, up)
    }

    /// Away from the middle, for the cosine and sine of an angle that starts below.
    fn outwards(&self, (cos, sin): (f32, f32)) -> Vec3 {
        -self.up * cos - self.right * sin
    }
}

/// Adds a quad, or a triangle where the tube ends in a point.
fn push_side(corners: [Vec3; 4], surface: Surface, out: &mut Pieces, drops: &mut Drops) {
    let [a, b, c, d] = corners;
    if c == d {
        out.push(ConvexPolygon::triangle(a, b, c), surface, drops);
    } else if a == b {
        out.push(ConvexPolygon::triangle(b, c, d), surface.with_corners([1, 2, 3, 3]), drops);
    } else {
        out.push_quad(corners, surface, drops);
    }
}

fn add(drops: &mut Drops, more: &Drops) {
    drops.degenerate += more.degenerate;
    drops.out_of_range += more.out_of_range;
}
