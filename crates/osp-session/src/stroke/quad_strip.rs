use glam::{Vec2, Vec3};

use super::{
    Drops, Pieces, QuadPieces, Sample, StrokeSettings, frame,
    knots::{Knots, Spacing, Step},
    random::Random,
    refresh::Refresh,
};
use crate::brush::{Brush, Surface, UV_PERIOD, Uv};
use osp::math::rotate;

/// Shorter movements are ignored; metres at scale 1.
const LEAST_MOVE_M: f32 = 0.0005;
const SPACING: Spacing = Spacing { length_m: 0.0015, part_of_size: 0.2 };
/// Length of the fade at the end of a ribbon whose texture coordinate is proportional to distance; metres at scale 1.
const FADE_M: f32 = 0.025;

/// Builds a ribbon of rectangles between the samples that its brush keeps. A rectangle is smoothed with its neighbours
/// when the next rectangle exists.
///
/// If the hand reverses its direction, the ribbon breaks into segments that are not joined. Source of its rules and
/// constants: the quad strips of Tilt Brush (Apache-2.0).
#[derive(Clone, Debug)]
pub struct QuadStripBuilder {
    brush: &'static Brush,
    uv: Uv,
    scale: f32,
    random: Random,
    knots: Knots,
    /// The quads whose shape or surface may still change: kept quads, then a provisional end if there is one.
    quads: Vec<Quad>,
    kept: usize,
    /// Number of kept quads since the last break.
    in_segment: usize,
    /// Number of kept quads of the whole stroke.
    count: u32,
    last: Option<Last>,
    /// Reduction of the ribbon's width in sharp bends, metres.
    shrink_m: f32,
    /// The first quad of the segment that was last painted, and the state of its painting.
    painted: (u32, Refresh),
    is_finished: bool,
}

/// The last kept quad before it was smoothed and joined to the previous quad.
#[derive(Clone, Copy, Debug)]
struct Last {
    form: Rectangle,
    direction: Vec3,
    joined: Form,
}

/// A rectangle: its centre, and the vectors from the centre to its leading edge and to its right edge.
#[derive(Clone, Copy, Debug)]
struct Rectangle {
    middle: Vec3,
    forward: Vec3,
    right: Vec3,
}

/// The shape of a quad. Its corners are left and right of the trailing edge, then right and left of the leading edge.
#[derive(Clone, Copy, Debug)]
struct Form {
    corners: [Vec3; 4],
    /// Normals of the trailing and the leading edge.
    normals: [Vec3; 2],
}

#[derive(Clone, Copy, Debug)]
struct Quad {
    form: Form,
    number: u32,
    /// Index of the first quad of its segment.
    first: u32,
    /// Length of the segment before the quad, metres.
    before_m: f32,
    /// Texture coordinate by distance, at the trailing and the leading edge.
    u: [f32; 2],
    alpha: [f32; 2],
    pieces: QuadPieces,
}

impl Rectangle {
    fn corners(&self) -> [Vec3; 4] {
        let Self { middle, forward, right } = *self;
        [
            middle - forward - right,
            middle - forward + right,
            middle + forward + right,
            middle + forward - right,
        ]
    }
}

impl Form {
    fn length_m(&self) -> f32 {
        let [trailing_left, trailing_right, leading_right, leading_left] = self.corners;
        0.5 * (leading_left.distance(trailing_left) + leading_right.distance(trailing_right))
    }

    /// Gives two neighbouring quads a common edge. For kept quads it is the mean of their edges; for a provisional end,
    /// it is the edge of the quad `behind`.
    fn join(behind: &mut Self, ahead: &mut Self, is_kept: bool) {
        if is_kept {
            for (leading, trailing) in [(3, 0), (2, 1)] {
                behind.corners[leading] = 0.5 * (behind.corners[leading] + ahead.corners[trailing]);
            }
            behind.normals[1] = (behind.normals[1] + ahead.normals[0]).normalize_or(behind.normals[1]);
        }
        ahead.corners[0] = behind.corners[3];
        ahead.corners[1] = behind.corners[2];
        ahead.normals[0] = behind.normals[1];
    }
}

impl Quad {
    fn is_first(&self) -> bool {
        self.number == self.first
    }

    fn end_m(&self) -> f32 {
        self.before_m + self.form.length_m()
    }

    fn surface(&self, [u0, u1]: [f32; 2], [v0, v1]: [f32; 2], [a0, a1]: [f32; 2]) -> Surface {
        let [n0, n1] = self.form.normals;
        let uv = [Vec2::new(u0, v0), Vec2::new(u0, v1), Vec2::new(u1, v1), Vec2::new(u1, v0)];
        Surface::smooth([n0, n0, n1, n1], uv, [a0, a0, a1, a1])
    }
}

impl QuadStripBuilder {
    pub fn new(settings: StrokeSettings, brush: &'static Brush, uv: Uv) -> Self {
        Self {
            brush,
            uv,
            scale: settings.scale,
            random: Random::new(settings.seed),
            knots: Knots::new(&settings, brush, SPACING),
            quads: Vec::new(),
            kept: 0,
            in_segment: 0,
            count: 0,
            last: None,
            shrink_m: 0.0,
            painted: (0, Refresh::default()),
            is_finished: false,
        }
    }

    /// Processes a sample: replaces a provisional end, and changes at most the two quads before it.
    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let Some(step) = self.knots.push(sample, drops) else { return };
        if step.length_m < LEAST_MOVE_M * self.scale || step.length_m == 0.0 {
            drops.zero_length += 1;
            return;
        }
        let changed = self.kept.saturating_sub(2);
        if let Some(quad) = self.quads.get(changed) {
            out.truncate(quad.pieces.first());
        }
        self.take_back_end();
        let (form, direction, normal, width_m, is_break) = self.next(&step);
        self.append(&form, direction, normal, step, is_break);
        self.measure(width_m);
        let mut again = Drops::default();
        for i in changed.min(self.quads.len() - 1)..self.quads.len() {
            let is_new = i + 1 == self.quads.len() && step.is_kept;
            let surface = self.surface_of(i);
            let quad = &mut self.quads[i];
            quad.pieces = out.push_quad(quad.form.corners, surface, if is_new { drops } else { &mut again });
        }
    }

    /// Ends the stroke. Removes a segment of a single quad, and a provisional end after fewer than two quads.
    pub fn finish(&mut self, out: &mut Pieces) {
        let is_break = self.quads.last().is_some_and(Quad::is_first) && self.quads.len() > self.kept;
        let stays = match self.in_segment {
            1 => self.kept - 1,
            0 => self.kept,
            _ if is_break => self.kept,
            _ => self.quads.len(),
        };
        if let Some(quad) = self.quads.get(stays) {
            out.truncate(quad.pieces.first());
        }
        self.quads.truncate(stays);
        self.kept = stays;
        self.is_finished = true;
    }

    /// Repaints the quads whose surface may have changed since the last call. Quads that can no longer change are
    /// dropped.
    pub fn repaint(&mut self, out: &mut Vec<(u32, Surface)>) {
        let settled = match self.uv {
            Uv::Stretched => self.repaint_stretched(out),
            Uv::Distance => self.repaint_fading(out),
            Uv::EachQuad => self.kept.saturating_sub(3),
        };
        self.quads.drain(..settled);
        self.kept -= settled;
    }

    fn take_back_end(&mut self) {
        self.quads.truncate(self.kept);
        if let (Some(quad), Some(last)) = (self.quads.last_mut(), &self.last) {
            quad.form = last.joined;
        }
    }

    /// The rectangle up to a sample, its direction and normal, its width, and whether the ribbon breaks before it.
    fn next(&mut self, step: &Step) -> (Rectangle, Vec3, Vec3, f32, bool) {
        let (from, to) = (step.from.sample.position, step.to.sample.position);
        let orientation = step.to.sample.orientation;
        let previous = match &self.last {
            _ if self.brush.back_is_invisible => step.travel.cross(rotate(orientation, Vec3::NEG_Z)),
            Some(last) => last.form.right.normalize_or_zero(),
            None => Vec3::ZERO,
        };
        let [right, normal] = frame::ribbon(previous, step.travel, orientation);
        let mut direction = step.travel;
        if !step.is_kept
            && let Some(last) = &self.last
        {
            let spacing_m = SPACING.length_m * self.scale + SPACING.part_of_size * step.to.size_m;
            direction = between(last.direction, direction, step.length_m / spacing_m);
        }
        let mut width_m = (step.to.size_m - self.shrink_m).max(0.0);
        let mut form = Rectangle {
            middle: 0.5 * (from + to),
            forward: direction * (0.5 * step.length_m),
            right: right * (0.5 * width_m),
        };
        let Some(last) = self.last.as_ref().map(|last| last.form).filter(|_| self.in_segment > 0) else {
            return (form, direction, normal, width_m, false);
        };
        if last.forward.dot(form.middle - from) <= 0.0 {
            return (form, direction, normal, width_m, true);
        }
        let ahead_right = last.forward.dot(form.middle + form.right - last.middle);
        let ahead_left = last.forward.dot(form.middle - form.right - last.middle);
        let mut shrink_m = self.shrink_m;
        if ahead_right * ahead_left < 0.0 {
            // The inner end of the edge would lie behind the previous quad. It is moved to that quad's inner end, which
            // makes this quad narrower.
            form.right = if ahead_left < 0.0 {
                form.middle - (last.middle - last.right)
            } else {
                last.middle + last.right - form.middle
            };
            let across = form.right.normalize_or_zero();
            let along = form.middle - from;
            let forward = (along - across * across.dot(along)).normalize_or_zero();
            form.forward = forward * (0.5 * form.middle.distance(last.middle));
            let narrow_m = 2.0 * form.right.length();
            shrink_m += width_m - narrow_m;
            width_m = narrow_m;
        } else {
            shrink_m -= shrink_m.min(step.length_m);
        }
        if step.is_kept {
            self.shrink_m = shrink_m;
        }
        (form, direction, normal, width_m, false)
    }

    fn append(&mut self, form: &Rectangle, direction: Vec3, normal: Vec3, step: Step, is_break: bool) {
        let is_kept = step.is_kept;
        let opacity = self.brush.opacity(step.to.smoothed);
        let behind = self.quads.last();
        let alpha = [behind.map_or(opacity, |quad| quad.alpha[1]), opacity];
        let first = behind.filter(|_| !is_break).map_or(self.count, |quad| quad.first);
        let mut ahead = Form { corners: form.corners(), normals: [normal; 2] };
        let in_segment = self.in_segment;
        let last = self.last.as_ref().map(|last| last.form);
        match self.quads.as_mut_slice() {
            [.., back, mid] if in_segment > 1 && is_break => {
                // The last quad keeps its shape, except for the common edge.
                if let Some(last) = last {
                    mid.form.corners = last.corners();
                }
                Form::join(&mut back.form, &mut mid.form, is_kept);
            }
            [.., _] if is_break => {
                if is_kept {
                    // A single quad between two breaks is removed.
                    self.quads.pop();
                    self.kept -= 1;
                }
            }
            [.., back, mid] if in_segment > 1 => {
                for (i, corner) in mid.form.corners.iter_mut().enumerate() {
                    *corner = 0.5 * (back.form.corners[i] + ahead.corners[i]);
                }
                Form::join(&mut back.form, &mut mid.form, is_kept);
                Form::join(&mut mid.form, &mut ahead, is_kept);
            }
            [.., mid] => Form::join(&mut mid.form, &mut ahead, is_kept),
            [] => {}
        }
        let number = self.count;
        let quad = Quad {
            form: ahead,
            number,
            first,
            before_m: 0.0,
            u: [0.0; 2],
            alpha,
            pieces: QuadPieces::default(),
        };
        self.quads.push(quad);
        if is_kept {
            self.last = Some(Last { form: *form, direction, joined: ahead });
            self.kept += 1;
            self.count += 1;
            self.in_segment = if is_break { 1 } else { in_segment + 1 };
        }
    }

    /// Computes the texture coordinates of the last three quads, which have changed.
    fn measure(&mut self, width_m: f32) {
        for i in self.quads.len().saturating_sub(3)..self.quads.len() {
            let behind = i.checked_sub(1).map(|i| self.quads[i]);
            let quad = &mut self.quads[i];
            let (before_m, u) = match behind {
                Some(behind) if !quad.is_first() => (behind.end_m(), behind.u[1]),
                _ if quad.is_first() => (0.0, self.random.unit(quad.first.wrapping_mul(6))),
                // The quad behind this one is final and dropped, so this quad is final, too.
                _ => (quad.before_m, quad.u[0]),
            };
            quad.before_m = before_m;
            let tiles = self.brush.tile_rate * (quad.form.length_m() / width_m.max(f32::MIN_POSITIVE));
            // Textures repeat, so an integer offset has no effect. A short quad, whose texture is visible, may have a
            // longer period. In a needle the end of the texture is not visible.
            let u = if tiles <= 1.0 { u.rem_euclid(UV_PERIOD) } else { u - u.floor() };
            quad.u = [u, u + if tiles < 1.0e6 { tiles } else { 0.0 }];
        }
    }

    /// Range of texture coordinates across the stroke for a segment.
    fn row(&self, quad: &Quad) -> [f32; 2] {
        let random = self.random.unit(quad.first.wrapping_mul(6));
        let rows = u32::from(self.brush.atlas_rows.max(1));
        let row = match self.uv {
            Uv::Stretched => (random * rows as f32) as u32,
            Uv::Distance => (random * 3331.0) as u32 % rows,
            Uv::EachQuad => return [0.0, 1.0],
        };
        [row, row + 1].map(|row| row as f32 / rows as f32)
    }

    /// Surface of quad `i` of `quads`, for the current length of the stroke.
    fn surface_of(&self, i: usize) -> Surface {
        let quad = &self.quads[i];
        let segment = self.quads[i..].iter().take_while(|other| other.first == quad.first);
        match self.uv {
            Uv::Stretched => stretched(quad, segment.last().map_or(0.0, Quad::end_m), self.row(quad)),
            Uv::Distance => {
                let ahead_m = segment.skip(1).map(|other| other.form.length_m()).sum();
                self.fading(quad, ahead_m)
            }
            Uv::EachQuad => quad.surface([0.0, 1.0], [0.0, 1.0], quad.alpha),
        }
    }

    /// Repaints segments whose texture spans their whole length. The last segment will change again, so usually only
    /// its end is repainted.
    fn repaint_stretched(&mut self, out: &mut Vec<(u32, Surface)>) -> usize {
        let last_first = if self.is_finished { self.quads.len() } else { self.kept - self.in_segment };
        let (closed, open) = self.quads.split_at(last_first);
        for segment in closed.chunk_by(|a, b| a.first == b.first) {
            self.stretch(segment, segment.len(), out);
        }
        if let [first, .., last] | [first @ last] = open {
            // A provisional end may form a separate segment.
            let is_one = first.first == last.first;
            let (segment, end) = open.split_at(if is_one { open.len() } else { self.in_segment });
            let mut painted = std::mem::take(&mut self.painted);
            if painted.0 != first.first {
                painted = (first.first, Refresh::default());
            }
            let length_m = segment.last().map_or(0.0, Quad::end_m);
            self.stretch(segment, painted.1.parts(segment.len(), length_m), out);
            self.stretch(end, end.len(), out);
            self.painted = painted;
        }
        self.kept.saturating_sub(self.in_segment.max(2))
    }

    /// Paints the last `count` quads of a segment.
    fn stretch(&self, segment: &[Quad], count: usize, out: &mut Vec<(u32, Surface)>) {
        let Some(last) = segment.last() else { return };
        let (row, total_m) = (self.row(last), last.end_m());
        let quads = &segment[segment.len() - count.min(segment.len())..];
        out.extend(quads.iter().flat_map(|quad| quad.pieces.painted(stretched(quad, total_m, row))));
    }

    /// Repaints the quads near the end of a segment. Quads far from the end become final. The distance is measured
    /// along quads whose shape is final.
    fn repaint_fading(&mut self, out: &mut Vec<(u32, Surface)>) -> usize {
        let from = out.len();
        let (mut ahead_m, mut settled_ahead_m, mut settled) = (0.0, 0.0, 0);
        let keep_form = self.kept.saturating_sub(2);
        for (i, quad) in self.quads.iter().enumerate().rev() {
            if self.quads.get(i + 1).is_none_or(|next| next.is_first()) {
                ahead_m = 0.0;
                // A segment that ends with a kept quad is final as a whole.
                settled_ahead_m = if i < keep_form { f32::INFINITY } else { 0.0 };
            }
            if settled == 0 && i < keep_form && settled_ahead_m >= FADE_M * self.scale {
                settled = i + 1;
            }
            out.extend(quad.pieces.painted(self.fading(quad, ahead_m)));
            let length_m = quad.form.length_m();
            ahead_m += length_m;
            settled_ahead_m += if i < keep_form { length_m } else { 0.0 };
        }
        out[from..].sort_unstable_by_key(|(place, _)| *place);
        // The last three quads may change, and one more is needed to compute them.
        settled.min(self.kept.saturating_sub(4))
    }

    /// Surface of a quad whose texture coordinate is proportional to distance. `ahead_m` is the length of the segment
    /// after the quad.
    fn fading(&self, quad: &Quad, ahead_m: f32) -> Surface {
        let fade_m = (FADE_M * self.scale).max(f32::MIN_POSITIVE);
        let leading = (ahead_m / fade_m).min(1.0);
        let trailing = ((ahead_m + quad.form.length_m()) / fade_m).min(1.0);
        let alpha = [if quad.is_first() { 0.0 } else { trailing }, leading];
        quad.surface(quad.u, self.row(quad), alpha)
    }
}

fn stretched(quad: &Quad, total_m: f32, row: [f32; 2]) -> Surface {
    let total_m = if total_m > 0.0 { total_m } else { 1.0 };
    quad.surface([quad.before_m / total_m, quad.end_m() / total_m], row, quad.alpha)
}

/// Spherical interpolation between two unit directions.
fn between(from: Vec3, to: Vec3, part: f32) -> Vec3 {
    let cos = from.dot(to).clamp(-1.0, 1.0);
    if cos.abs() > 0.9995 {
        return from.lerp(to, part).normalize_or(to);
    }
    let angle = libm::acosf(cos);
    (from * libm::sinf((1.0 - part) * angle) + to * libm::sinf(part * angle)) / libm::sinf(angle)
}
