use glam::{Vec2, Vec3};

use super::{
    Drops, Pieces, Sample, StrokeSettings,
    knots::{Knot, Knots, Spacing},
    random::Random,
    refresh::Refresh,
    tube_frame::Frame,
    tube_shape::{Shape, Span, swelling},
};
use crate::brush::{Brush, Family, Surface, TubeShape, UV_PERIOD, Uv};
use osp::polygon::ConvexPolygon;

/// A tube breaks if the hand moves less than this distance, metres at scale 1.
const SHORTEST_MOVE_M: f32 = 5.0e-4;

/// Builds a tube along the samples. At sharp turns of the hand, the tube breaks into segments.
///
/// A tube whose texture coordinate is proportional to distance grows at its end. A tube with a shape, or with a texture
/// stretched over a segment, changes as a whole with each sample. [`TubeBrushBuilder::settle`] rebuilds the segment's
/// end once a frame, and sometimes the whole segment. The whole segment is rebuilt when the segment or the stroke ends.
#[derive(Clone, Debug)]
pub struct TubeBrushBuilder {
    brush: &'static Brush,
    shape: Shape,
    uv: Uv,
    is_hard: bool,
    /// Length of the cones that close a segment, divided by the radius.
    cap_aspect: Option<f32>,
    break_mult: f32,
    shortest_move_m: f32,
    random: Random,
    /// Cosine and sine of the angle of each corner of a section, and of the middle of each side.
    circle: Vec<[(f32, f32); 2]>,
    knots: Knots,
    /// The kept samples, then a provisional end if there is one.
    line: Vec<Knot>,
    has_end: bool,
    /// The rings at the knots of `line`. The last two may still change.
    rings: Vec<Ring>,
    /// End of the drawn part that no longer changes.
    done: Cursor,
    /// Counts of dropped polygons in the part that may still change.
    pending: Drops,
    is_unsettled: bool,
    /// The last segment, if it changes as a whole.
    open: Open,
}

/// The cross-section at a knot, and its connection with the previous ring.
#[derive(Clone, Copy, Debug)]
struct Ring {
    middle: Vec3,
    radius_m: f32,
    /// Distance from the previous ring, metres.
    length_m: f32,
    /// `None` at the start and at a break of the tube, where the ring is not joined to the previous one.
    frame: Option<Frame>,
    /// Index of the segment's first ring that is joined to the ring before it.
    first: usize,
    /// Distance from the start of the segment, metres.
    along_m: f32,
}

/// A ring's corners and texture coordinate.
#[derive(Clone, Debug)]
struct Section {
    corners: Vec<Vec3>,
    frame: Frame,
    radius_m: f32,
    u: f32,
    /// Distance by which the sides are moved outwards, metres.
    petal_m: f32,
}

/// A range of rings, each joined to the previous ring.
#[derive(Clone, Copy, Debug)]
struct Segment {
    first: usize,
    last: usize,
    /// Frame at the segment's start.
    frame: Frame,
    span: Span,
}

/// A segment that is drawn before it has its final shape.
#[derive(Clone, Debug, Default)]
struct Open {
    first: usize,
    sections: Vec<Drawn>,
    refresh: Refresh,
    /// Whether some sections were built when the segment was shorter.
    is_outdated: bool,
}

/// A drawn section of a segment, and the state after it.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    until: Cursor,
    radius_m: f32,
    petal_m: f32,
    u: f32,
    /// Texture coordinate by distance.
    u_by_distance: f32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    /// Index of the last knot that is drawn.
    knot: usize,
    /// Number of polygons so far.
    place: u32,
    /// Number of corners that Open Brush would have created; it is the seed of a segment's random numbers.
    corners: u32,
    /// Texture coordinate by distance.
    u: f32,
    row: u8,
}

/// The part of a stroke that is being drawn.
struct Draft<'a> {
    cursor: Cursor,
    out: &'a mut Pieces,
    /// Counts of dropped polygons since the last final knot.
    drops: Drops,
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
            open: Open::default(),
        })
    }

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

    /// Rebuilds the parts that change with each sample. For a growing segment these are usually only the parts at the
    /// end.
    pub fn settle(&mut self, out: &mut Pieces, drops: &mut Drops) {
        if std::mem::take(&mut self.is_unsettled) {
            self.make_segments(false, out, drops);
        }
    }

    pub fn finish(&mut self, out: &mut Pieces, drops: &mut Drops) {
        if std::mem::take(&mut self.is_unsettled) || self.open.is_outdated {
            self.make_segments(true, out, drops);
        }
        add(drops, &std::mem::take(&mut self.pending));
    }

    /// Rebuilds the segments that may still change. If `is_end`, a segment that changes as a whole is rebuilt
    /// completely.
    fn make_segments(&mut self, is_end: bool, out: &mut Pieces, drops: &mut Drops) {
        self.update_rings();
        let mut open = std::mem::take(&mut self.open);
        let mut draft = Draft { cursor: self.done, out, drops: Drops::default() };
        let end = self.rings.len();
        let segments = self.changing_segments();
        // A segment grows if it includes one of the last two rings, which may change.
        let is_growing = |segment: &Segment| segment.last + 3 >= end;
        let mut from = 0;
        if let Some(segment) = segments.iter().find(|segment| is_growing(segment)) {
            from = self.first_to_make(segment, &mut open);
        }
        // At the end of a stroke and before a break, the shape of a segment becomes final, so the whole segment is
        // rebuilt.
        if is_end || segments.first().is_none_or(|segment| !is_growing(segment)) {
            from = 0;
        }
        open.is_outdated = from > 0;
        let first = open.sections.get(from).filter(|_| from > 0).map_or(self.done.place, |at| at.until.place);
        draft.out.truncate(first);
        // The drawn part up to a final break no longer changes.
        let last_break = end.saturating_sub(3);
        let mut until = self.done.knot;
        for segment in &segments {
            if until < last_break.min(segment.first - 1) {
                self.close(last_break.min(segment.first - 1), &mut draft, drops);
            }
            if open.first == segment.first {
                self.add_segment(segment, from, &mut open.sections, &mut draft);
            } else {
                self.add_segment(segment, 0, &mut Vec::new(), &mut draft);
            }
            until = segment.last;
        }
        if until < last_break {
            self.close(last_break, &mut draft, drops);
        }
        self.pending = draft.drops;
        self.open = open;
    }

    /// Makes the drawn part final, including the knots up to `knot`.
    fn close(&mut self, knot: usize, draft: &mut Draft<'_>, drops: &mut Drops) {
        draft.reach(knot);
        self.done = draft.cursor;
        add(drops, &std::mem::take(&mut draft.drops));
    }

    fn changing_segments(&self) -> Vec<Segment> {
        let mut segments = Vec::new();
        let mut end = self.rings.len();
        while end > self.done.knot + 1 {
            end -= 1;
            if self.rings[end].frame.is_some() {
                let last = end;
                end = self.rings[last].first;
                segments.extend(self.segment(end, last));
            }
        }
        segments.reverse();
        segments
    }

    fn segment(&self, first: usize, last: usize) -> Option<Segment> {
        let end = &self.line[last];
        let end_m = end.sample.position.distance(self.line[last - 1].sample.position);
        let span = Span {
            count: last - first + 1,
            length_m: self.rings[last].along_m,
            progress: (end_m / self.knots.spacing_m(end)).min(1.0),
        };
        Some(Segment { first, last, frame: self.rings[first].frame?, span })
    }

    /// Index of the first section of a growing segment that is rebuilt.
    fn first_to_make(&self, segment: &Segment, open: &mut Open) -> usize {
        if open.first != segment.first {
            *open = Open { first: segment.first, ..Open::default() };
        }
        let count = self.count_sections(segment);
        let parts = open.refresh.parts(count, segment.span.length_m);
        // The last two drawn rings may have changed.
        (count - parts.min(count)).min(open.sections.len().saturating_sub(4))
    }

    fn changes_as_a_whole(&self) -> bool {
        self.uv == Uv::Stretched || self.shape.kind != TubeShape::Plain
    }

    /// Rebuilds the last two pieces.
    fn grow(&mut self, out: &mut Pieces, drops: &mut Drops) {
        self.update_rings();
        out.truncate(self.done.place);
        let mut draft = Draft { cursor: self.done, out, drops: Drops::default() };
        let last = self.rings.len() - 1;
        for i in self.done.knot + 1..=last {
            self.add_piece(i, &mut draft);
            if i + 1 == last && !self.has_end {
                self.done = draft.cursor;
                add(drops, &std::mem::take(&mut draft.drops));
            }
        }
        self.add_front_cap(last, None, &mut draft);
        self.pending = draft.drops;
    }

    fn update_rings(&mut self) {
        self.rings.truncate(self.rings.len().saturating_sub(2));
        for i in self.rings.len()..self.line.len() {
            let ring = self.ring(i);
            self.rings.push(ring);
        }
    }

    /// The ring at knot `i`; the previous ring must exist.
    fn ring(&self, i: usize) -> Ring {
        let knot = &self.line[i];
        let at = knot.sample.position;
        let before = i.checked_sub(1).map(|before| (self.line[before].sample.position, self.rings[before]));
        let middle = match (&before, self.line.get(i + 1)) {
            (Some((before, _)), Some(after)) => at * 0.5 + (*before + after.sample.position) * 0.25,
            _ => at,
        };
        let radius_m = 0.5 * knot.size_m;
        let ring = Ring { middle, radius_m, length_m: 0.0, frame: None, first: i, along_m: 0.0 };
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
        let (first, before_m) =
            if before.frame.is_some() { (before.first, before.along_m) } else { (i, 0.0) };
        Ring { length_m, frame, first, along_m: before_m + length_m, ..ring }
    }

    /// Adds the piece between knot `i` and the previous knot, with the samples' widths.
    fn add_piece(&self, i: usize, draft: &mut Draft<'_>) {
        let (before, ring) = (self.rings[i - 1], self.rings[i]);
        if let Some(frame) = ring.frame {
            if before.frame.is_none() {
                self.begin_segment(&mut draft.cursor);
            }
            let frame_before = before.frame.unwrap_or(frame);
            let back = self.section(before.middle, before.radius_m, frame_before, draft.cursor.u);
            if before.frame.is_none() {
                self.add_back_cap(&back, before, frame, draft);
            }
            let u = draft.cursor.u + self.u_over(ring.length_m, ring.radius_m);
            let front = self.section(ring.middle, ring.radius_m, frame, u);
            self.add_sides(&back, &front, draft);
        } else {
            self.add_front_cap(i - 1, None, draft);
        }
        draft.reach(i);
    }

    /// Adds a segment. The sections before index `from` were drawn before, and `drawn` contains them. Afterwards
    /// `drawn` contains all sections.
    fn add_segment(&self, segment: &Segment, from: usize, drawn: &mut Vec<Drawn>, draft: &mut Draft<'_>) {
        drawn.truncate(if from > 0 { from + 1 } else { 0 });
        let (mut back, mut u_by_distance) = match drawn.last() {
            Some(at) => {
                draft.cursor = at.until;
                let (ring, frame) = self.place_of(segment, from);
                let section = self.section(ring.middle, at.radius_m, frame, at.u);
                (Section { petal_m: at.petal_m, ..section }, at.u_by_distance)
            }
            None => {
                self.begin_segment(&mut draft.cursor);
                let u_by_distance = draft.cursor.u;
                let start = self.section_of(segment, 0, u_by_distance);
                let before = self.rings[segment.first - 1];
                self.add_back_cap(&start, before, segment.frame, draft);
                drawn.push(Drawn::new(&start, u_by_distance, draft));
                (start, u_by_distance)
            }
        };
        for number in from + 1..self.count_sections(segment) {
            let ring = &self.rings[segment.first + number - 1];
            u_by_distance += self.u_over(ring.length_m, ring.radius_m);
            let front = self.section_of(segment, number, u_by_distance);
            self.add_sides(&back, &front, draft);
            drawn.push(Drawn::new(&front, u_by_distance, draft));
            back = front;
        }
        self.add_front_cap(segment.last, Some(&back), draft);
    }

    fn count_sections(&self, segment: &Segment) -> usize {
        segment.span.count + usize::from(self.shape.kind == TubeShape::Plain)
    }

    /// The ring and the frame of the section with index `number`.
    ///
    /// In Open Brush a ring belongs to two knots. A shape moves the ring to the later knot, with the earlier knot's
    /// frame. So a shaped segment starts at its first knot, not at the previous one.
    fn place_of(&self, segment: &Segment, number: usize) -> (Ring, Frame) {
        let at = segment.first + number;
        let before = self.rings[(at - 1).max(segment.first)];
        let ring = if self.shape.kind == TubeShape::Plain { self.rings[at - 1] } else { self.rings[at] };
        (ring, before.frame.unwrap_or(segment.frame))
    }

    /// The section with index `number`; `u` is its texture coordinate by distance.
    fn section_of(&self, segment: &Segment, number: usize, u: f32) -> Section {
        let (ring, frame) = self.place_of(segment, number);
        let u = match self.uv {
            Uv::Stretched => number.min(segment.span.count - 1) as f32 / segment.span.count as f32,
            _ => u,
        };
        if self.shape.kind == TubeShape::Plain {
            return self.section(ring.middle, ring.radius_m, frame, u);
        }
        let t = ring.along_m / segment.span.length_m;
        let radius_m = ring.radius_m * self.shape.curve(&segment.span, number, t);
        let petal_m = self.shape.petal_m(t, self.line[segment.first + number].smoothed);
        Section { petal_m, ..self.section(ring.middle, radius_m, frame, u) }
    }

    /// Change of the texture coordinate over a length on a tube of this radius.
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

    /// Number of corners of a ring in Open Brush: a hard tube has two corners at each edge, a soft tube only at its
    /// seam.
    fn corners_of_ring(&self) -> usize {
        if self.is_hard { 2 * self.circle.len() } else { self.circle.len() + 1 }
    }

    fn section(&self, middle: Vec3, radius_m: f32, frame: Frame, u: f32) -> Section {
        let count = self.circle.len() as f32;
        let at = |(i, [corner, _]): (usize, &[_; 2])| {
            middle + frame.outwards(*corner) * (radius_m * swelling(self.brush.effect, u, i as f32 / count))
        };
        let corners = self.circle.iter().enumerate().map(at).collect();
        Section { corners, frame, radius_m, u, petal_m: 0.0 }
    }

    fn add_sides(&self, back: &Section, front: &Section, draft: &mut Draft<'_>) {
        let count = self.circle.len();
        // Subtracting an integer does not change the texture. Short quads subtract multiples of seven, because one bulb
        // of seven is lit.
        let first_u = match front.u - back.u {
            ..=1.0 => back.u - back.u.rem_euclid(UV_PERIOD),
            _ => back.u.floor(),
        };
        let u = [back.u, front.u].map(|u| u - first_u);
        for i in 0..count {
            let j = (i + 1) % count;
            let v = [i, i + 1].map(|corner| self.v(corner as f32, draft.cursor.row));
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
            // The normal of a hard side is constant around the tube and changes along it.
            let normal = |section: &Section, corner: usize| {
                section.frame.outwards(if self.is_hard { self.circle[i][1] } else { self.circle[corner][0] })
            };
            let normals = [normal(back, i), normal(back, j), normal(front, j), normal(front, i)];
            draft.out.push_side(corners, Surface::smooth(normals, uv, [1.0; 4]), &mut draft.drops);
        }
        draft.cursor.u = front.u - first_u;
        draft.cursor.count(self.corners_of_ring());
    }

    /// The texture coordinate around the tube, at a corner of a section or between two corners.
    fn v(&self, corner: f32, row: u8) -> f32 {
        (f32::from(row) + corner / self.circle.len() as f32) / f32::from(self.brush.atlas_rows.max(1))
    }

    fn add_back_cap(&self, back: &Section, ring: Ring, frame: Frame, draft: &mut Draft<'_>) {
        let Some(aspect) = self.cap_aspect else { return };
        let tip = ring.middle - frame.ahead * (ring.radius_m * aspect);
        self.add_cap(back, ring.radius_m, (tip, -frame.ahead), -1.0, draft);
    }

    /// Closes the tube at knot `i`, if a piece ends there.
    fn add_front_cap(&self, i: usize, section: Option<&Section>, draft: &mut Draft<'_>) {
        let ring = self.rings[i];
        let (Some(frame), Some(aspect)) = (ring.frame, self.cap_aspect) else { return };
        let tip = ring.middle + frame.ahead * (ring.radius_m * aspect);
        let own = section.is_none().then(|| self.section(ring.middle, ring.radius_m, frame, draft.cursor.u));
        let Some(section) = section.or(own.as_ref()) else { return };
        self.add_cap(section, ring.radius_m, (tip, frame.ahead), 1.0, draft);
    }

    /// Adds a cone from a section to its tip. `sign` is 1 if the tip is ahead of the section, else -1.
    fn add_cap(
        &self,
        section: &Section,
        radius_m: f32,
        (tip, tip_normal): (Vec3, Vec3),
        sign: f32,
        draft: &mut Draft<'_>,
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
            let [v, w] = ends.map(|corner| self.v(corner as f32, draft.cursor.row));
            let tip_uv = Vec2::new(u_tip, self.v(i as f32 + 0.5, draft.cursor.row));
            let uv = [Vec2::new(u, v), Vec2::new(u, w), tip_uv, tip_uv];
            let surface = match self.is_hard {
                true => Surface::flat(uv, [1.0; 4]),
                false => Surface::smooth([n, o, tip_normal, tip_normal], uv, [1.0; 4]),
            };
            draft.out.push(ConvexPolygon::triangle(a, b, tip), surface, &mut draft.drops);
        }
        draft.cursor.count(count);
    }
}

impl Drawn {
    fn new(section: &Section, u_by_distance: f32, draft: &Draft<'_>) -> Self {
        let until = Cursor { place: draft.out.len(), ..draft.cursor };
        let Section { radius_m, petal_m, u, .. } = *section;
        Self { until, radius_m, petal_m, u, u_by_distance }
    }
}

impl Draft<'_> {
    /// Moves the cursor to a knot, behind everything drawn so far.
    fn reach(&mut self, knot: usize) {
        (self.cursor.knot, self.cursor.place) = (knot, self.out.len());
    }
}

impl Cursor {
    fn count(&mut self, corners: usize) {
        self.corners = self.corners.wrapping_add(corners as u32);
    }
}

fn add(drops: &mut Drops, more: &Drops) {
    drops.degenerate += more.degenerate;
    drops.out_of_range += more.out_of_range;
}
