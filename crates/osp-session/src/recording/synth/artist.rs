//! The simulated artist: a clock, a hand, a head, and the events that they generate.

use std::collections::VecDeque;

use glam::{DVec3, Quat, Vec3};

use super::hand::{Hand, HandPath, HandSample, RATE_HZ};
use super::head::Head;
use super::path::Node;
use super::random::Random;
use crate::recording::{Author, Event, GroupId, NormalRule, StrokeId, Tool, Transform};

/// Number of samples of the hand between two head poses: 30 head poses a second.
const TICKS_A_HEAD: u64 = 3;

/// Longest walk to the next stroke, samples of the hand. If the walk would take longer, the artist draws from a
/// distance.
const LONGEST_WALK_TICKS: u32 = 1800;

const MEMORY: usize = 64;

/// Largest distance of the head from its target when a stroke begins, metres.
const NEAR_M: f64 = 0.3;

/// Distance from the hand to the eye while drawing, metres.
const ARM_M: f64 = 0.55;

/// Width at pressure 0 divided by the full width.
const THINNEST: f32 = 0.2;

/// The subject of the session. Once the session has the requested number of polygons, the artist ignores further
/// strokes.
pub(super) trait Subject: Send {
    /// Draws the next unit of work: a stroke, or a few strokes that belong together.
    fn work(&mut self, artist: &mut Artist);
}

/// Position of the head, and the point that it looks at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stance {
    pub(super) eye: DVec3,
    pub(super) at: DVec3,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct RibbonStyle {
    pub(super) width_m: f64,
    pub(super) color: (f32, f32, f32, f32),
    /// Speed of the hand: 1 is usual, 2 is twice as fast.
    pub(super) pace: f64,
    pub(super) mirrored: Mirrored,
}

/// Whether a stroke is drawn on both sides of the plane x = 0 simultaneously.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mirrored {
    No,
    Yes,
}

#[derive(Debug)]
pub(super) struct Artist {
    pub(super) rng: Random,
    hand: Hand,
    head: Head,
    /// Strokes that the artist may edit, the newest last.
    recent: Vec<StrokeId>,
    queue: VecDeque<Event>,
    ticks: u64,
    next_stroke: u32,
    next_group: u32,
    polygons: u64,
    pub(super) wanted: u64,
}

impl Artist {
    pub(super) fn new(polygons: u32, seed: u64) -> Self {
        let mut rng = Random::new(seed);
        let hand = Hand::new(&mut rng);
        Self {
            rng,
            hand,
            head: Head::new(DVec3::new(0.0, 1.65, 1.6), DVec3::NEG_Z, 1.3),
            recent: Vec::new(),
            queue: VecDeque::new(),
            ticks: 0,
            next_stroke: 0,
            next_group: 0,
            polygons: 0,
            wanted: u64::from(polygons),
        }
    }

    /// Sets the initial pose of the head; `speed_limit` is in m/s.
    pub(super) fn stand(&mut self, eye: DVec3, look: DVec3, speed_limit: f64) {
        self.head = Head::new(eye, look, speed_limit);
    }

    pub(super) fn next_event(&mut self) -> Option<Event> {
        self.queue.pop_front()
    }

    pub(super) fn has_finished(&self) -> bool {
        self.polygons >= self.wanted
    }

    /// Share of the session's polygons that are finished, 0 to 1.
    pub(super) fn progress(&self) -> f64 {
        self.polygons as f64 / self.wanted.max(1) as f64
    }

    pub(super) fn eye(&self) -> DVec3 {
        self.head.eye
    }

    /// Head position at arm's length from `at`, in the direction `outward`, for an artist who stands on the floor.
    pub(super) fn standing(&self, at: DVec3, outward: DVec3) -> Stance {
        let mut eye = at + outward * ARM_M;
        eye.y = (at.y + 0.25).clamp(0.9, 1.72);
        Stance { eye, at }
    }

    /// Head position at arm's length from `at`, on the side of the current head position, at any height.
    pub(super) fn floating(&self, at: DVec3) -> Stance {
        Stance { eye: at + self.head.from(at) * ARM_M + DVec3::Y * 0.15, at }
    }

    /// Walks to a stance. The walk takes at least as long as a natural pause between two strokes.
    pub(super) fn walk(&mut self, stance: Stance) {
        if self.has_finished() {
            return;
        }
        let pause = self.rng.log_normal(0.55, 0.6) * RATE_HZ;
        for tick in 0..LONGEST_WALK_TICKS {
            if f64::from(tick) >= pause && (self.head.eye - stance.eye).length() < NEAR_M {
                break;
            }
            self.tick(stance);
        }
    }

    pub(super) fn wait(&mut self, secs: f64, stance: Stance) {
        if self.has_finished() {
            return;
        }
        for _ in 0..(secs * RATE_HZ) as u32 {
            self.tick(stance);
        }
    }

    /// Walks to the stance, draws a ribbon along the path, and sometimes makes an edit. Returns the stroke's number.
    pub(super) fn ribbon(&mut self, nodes: Vec<Node>, style: RibbonStyle, stance: Stance) -> StrokeId {
        let way = HandPath::new(nodes);
        self.walk(Stance { at: way.first().p, ..stance });
        let count = Hand::samples_for(&mut self.rng, &way, style.pace);
        let id = self.begin(Tool::Ribbon, style);
        let twin = (style.mirrored == Mirrored::Yes).then(|| self.begin(Tool::Ribbon, style));
        let mut ribbons = [RibbonCount::new(style.width_m); 2];
        for index in 0..count {
            let sample = self.hand.sample(&way, index, count, self.ticks as f64 / RATE_HZ);
            self.polygons += ribbons[0].push(self.point(id, &sample));
            if let Some(twin) = twin {
                self.polygons += ribbons[1].push(self.point(twin, &sample.mirrored()));
            }
            self.tick(Stance { at: sample.p, ..stance });
        }
        for id in std::iter::once(id).chain(twin) {
            self.end(id);
        }
        if !self.has_finished() {
            self.edit(if twin.is_some() { 2 } else { 1 }, stance);
        }
        id
    }

    /// Draws a wall: one planar polygon, corner by corner.
    pub(super) fn wall(&mut self, corners: [DVec3; 4], color: (f32, f32, f32, f32), stance: Stance) {
        if self.has_finished() {
            return;
        }
        let style = RibbonStyle { width_m: 0.01, color, pace: 1.0, mirrored: Mirrored::No };
        let id = self.begin(Tool::Wall, style);
        for p in corners {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z];
            self.point(id, &HandSample { p, axes, pressure: 1.0 });
            self.wait(0.3, stance);
        }
        self.polygons += 1;
        self.end(id);
    }

    pub(super) fn polygon(&mut self, corners: &[DVec3], color: (f32, f32, f32, f32)) {
        if self.has_finished() {
            return;
        }
        let vertices = corners.iter().map(|&p| position(p)).collect();
        let (author, stroke, shading) = (Author::SOLE, None, None);
        self.push(|t| Event::Polygon { author, t, stroke, vertices, shading, color });
        self.polygons += corners.len().saturating_sub(2).min(1) as u64;
    }

    /// Puts strokes into a new group, and rotates the group by `angle` about `center`.
    pub(super) fn group(&mut self, strokes: &[StrokeId], center: DVec3, angle: f64, by: DVec3) {
        if self.has_finished() {
            return;
        }
        let group = GroupId(self.next_group);
        self.next_group += 1;
        let (author, strokes) = (Author::SOLE, strokes.to_vec());
        self.push(|t| Event::Group { author, t, group, strokes, parent: None, name: None });
        let turned = |v: DVec3| super::vector::turned(v, DVec3::Y, angle);
        let q = super::vector::quaternion(turned(DVec3::X), DVec3::Y, turned(DVec3::Z));
        let to = Transform { p: position(center - turned(center) + by), q: rotation(q), s: 1.0 };
        self.push(|t| Event::Place { author, t, group, to });
    }

    fn begin(&mut self, tool: Tool, style: RibbonStyle) -> StrokeId {
        let stroke = StrokeId(self.next_stroke);
        self.next_stroke += 1;
        let (author, width, color) = (Author::SOLE, rounded(style.width_m, 1e4), style.color);
        let (normal, paint) = (NormalRule::LocalX, None);
        let thinnest = if tool == Tool::Ribbon { THINNEST } else { 0.0 };
        self.push(|t| Event::Begin { author, t, stroke, tool, width, color, normal, thinnest, paint });
        stroke
    }

    fn point(&mut self, stroke: StrokeId, sample: &HandSample) -> HandSample {
        let q = rotation(sample.orientation());
        let pressure = rounded(sample.pressure, 1e3);
        self.push(|t| Event::Point { t, stroke, p: position(sample.p), q, pressure });
        *sample
    }

    fn end(&mut self, stroke: StrokeId) {
        self.push(|t| Event::End { t, stroke });
        if self.recent.len() == MEMORY {
            self.recent.remove(0);
        }
        self.recent.push(stroke);
    }

    /// Called after a stroke, or after several simultaneous strokes: sometimes undoes, redoes, erases or moves a
    /// stroke.
    fn edit(&mut self, strokes_at_once: usize, stance: Stance) {
        let choice = self.rng.unit();
        if choice < 0.04 {
            let strokes = strokes_at_once.min(self.recent.len());
            if !self.undo(strokes, stance) {
                self.recent.truncate(self.recent.len() - strokes);
            }
        } else if choice < 0.08 && self.recent.len() > 4 {
            let at = self.rng.index(self.recent.len());
            let stroke = self.recent[at];
            self.wait(0.7, stance);
            self.push(|t| Event::Erase { author: Author::SOLE, t, stroke });
            if !self.rng.chance(0.3) || self.undo(1, stance) {
                self.recent.remove(at);
            }
        } else if choice < 0.11 && self.recent.len() > 8 {
            let count = 2 + self.rng.index(5);
            let first = self.rng.index(self.recent.len() - count);
            let strokes = self.recent[first..first + count].to_vec();
            let by = position(self.rng.direction() * self.rng.between(0.005, 0.05) + DVec3::ZERO);
            self.wait(0.9, stance);
            self.push(|t| Event::Move { author: Author::SOLE, t, strokes, by });
            if self.rng.chance(0.3) {
                self.undo(1, stance);
            }
        }
    }

    /// Undoes the last `edits` edits, and in half of the cases redoes them. Returns whether they were redone.
    fn undo(&mut self, edits: usize, stance: Stance) -> bool {
        let again = self.rng.chance(0.5);
        for _ in 0..edits {
            self.wait(0.3, stance);
            self.push(|t| Event::Undo { author: Author::SOLE, t });
        }
        if again {
            self.wait(0.8, stance);
            for _ in 0..edits {
                self.push(|t| Event::Redo { author: Author::SOLE, t });
            }
        }
        again
    }

    pub(super) fn push(&mut self, event: impl FnOnce(f64) -> Event) {
        let t = self.time();
        self.queue.push_back(event(t));
    }

    /// Advances the clock to the next sample of the hand.
    fn tick(&mut self, stance: Stance) {
        self.ticks += 1;
        self.head.advance(stance.eye, stance.at);
        if self.ticks.is_multiple_of(TICKS_A_HEAD) {
            let (p, q) = self.head.pose();
            self.push(|t| Event::Head { author: Author::SOLE, t, p: position(p), q: rotation(q) });
        }
    }

    fn time(&self) -> f64 {
        (self.ticks as f64 / RATE_HZ * 1e4).round() / 1e4
    }
}

/// Rounds positions to 10 µm. This is finer than any tracker, and shortens the lines of a recording.
pub(super) fn position(p: DVec3) -> Vec3 {
    Vec3::new(rounded(p.x, 1e5), rounded(p.y, 1e5), rounded(p.z, 1e5))
}

fn rotation(q: [f64; 4]) -> Quat {
    Quat::from_array(q.map(|c| rounded(c, 1e4)))
}

pub(super) fn rounded(value: f64, parts: f64) -> f32 {
    // The addition of 0.0 turns -0.0 into 0.0, which is shorter in text.
    ((value * parts).round() / parts + 0.0) as f32
}

/// Counts the polygons of a growing ribbon: one for a flat segment, two for a twisted segment.
#[derive(Clone, Copy, Debug)]
struct RibbonCount {
    width_m: f64,
    last: Option<HandSample>,
    border: Option<[DVec3; 2]>,
}

impl RibbonCount {
    /// A quad is flat if its bend is below this fraction of its longest edge.
    const FLATNESS: f64 = 1e-2;

    fn new(width_m: f64) -> Self {
        Self { width_m, last: None, border: None }
    }

    fn border_at(&self, sample: &HandSample, travel: DVec3) -> [DVec3; 2] {
        let thinnest = f64::from(THINNEST);
        let half = 0.5 * self.width_m * (thinnest + (1.0 - thinnest) * sample.pressure);
        let side = super::vector::perpendicular(sample.axes[0], travel).cross(travel) * half;
        [sample.p + side, sample.p - side]
    }

    fn push(&mut self, sample: HandSample) -> u64 {
        let Some(last) = self.last.replace(sample) else { return 0 };
        let Some(travel) = (sample.p - last.p).try_normalize() else { return 0 };
        let [a, b] = self.border.unwrap_or_else(|| self.border_at(&last, travel));
        let [d, c] = self.border_at(&sample, travel);
        self.border = Some([d, c]);
        let bend = (c - a).cross(d - b).normalize_or_zero().dot(b - a).abs();
        let longest = (b - a).length().max((c - d).length()).max((d - a).length()).max((c - b).length());
        if bend <= Self::FLATNESS * longest { 1 } else { 2 }
    }
}
