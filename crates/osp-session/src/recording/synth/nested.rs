use std::collections::VecDeque;

use glam::{DVec3, Quat};

use super::{
    CENTER, SynthKind, VOLUME_M,
    artist::{position, rounded},
    random::Random,
    vector::{perpendicular, quaternion, turned},
};
use crate::recording::{
    Author, Event, EventSource, GroupId, Header, NormalRule, RecordingError, Root, StrokeId, Tool, Transform,
};

/// Everything is drawn around this point, and groups turn about it.
const BENCH: DVec3 = DVec3::new(0.0, 1.2, 0.0);
/// Time from one sample to the next, and between two strokes, seconds.
const SAMPLE_SECS: f64 = 1.0 / 60.0;
const PAUSE_SECS: f64 = 0.3;
/// Samples from one head pose to the next.
const SAMPLES_A_HEAD: u32 = 6;
/// Segments of a stroke: more make a ring smoother.
const SAMPLES: u32 = 36;
/// Steps of the journey, and the time of each, seconds.
const STEPS: u32 = 320;
const STEP_SECS: f64 = 1.0 / 15.0;
/// Part of the journey after which the satellite leaves the planet and goes with the ship.
const DOCKS_AT: f64 = 0.6;

/// A thing that is drawn, becomes a group, and moves.
struct Thing {
    name: &'static str,
    parent: Option<usize>,
    /// Part of all polygons.
    share: f64,
    color: (f64, f64, f64),
    form: Form,
}

#[derive(Clone, Copy)]
enum Form {
    /// Rings of bands around a ball of this radius, metres.
    Ball(f64),
    /// Rings of bands around an axis: length and radius, metres.
    Barrel(f64, f64),
    /// Bands to both sides of a middle: length and width, metres.
    Panels(f64, f64),
}

const PLANET: usize = 0;
const MOON: usize = 1;
const SATELLITE: usize = 2;
const SHIP: usize = 3;
const ENGINES: [usize; 2] = [5, 6];

/// The tree: parents before children.
const THINGS: [Thing; 7] = [
    Thing { name: "planet", parent: None, share: 0.36, color: (0.25, 0.45, 0.75), form: Form::Ball(0.42) },
    Thing {
        name: "moon",
        parent: Some(PLANET),
        share: 0.12,
        color: (0.7, 0.7, 0.66),
        form: Form::Ball(0.12),
    },
    Thing {
        name: "satellite",
        parent: Some(PLANET),
        share: 0.08,
        color: (0.85, 0.75, 0.3),
        form: Form::Panels(0.3, 0.08),
    },
    Thing {
        name: "spaceship",
        parent: None,
        share: 0.04,
        color: (0.8, 0.3, 0.25),
        form: Form::Panels(0.7, 0.16),
    },
    Thing {
        name: "hull",
        parent: Some(SHIP),
        share: 0.24,
        color: (0.82, 0.82, 0.8),
        form: Form::Barrel(0.8, 0.1),
    },
    Thing {
        name: "left engine",
        parent: Some(SHIP),
        share: 0.08,
        color: (0.5, 0.5, 0.55),
        form: Form::Barrel(0.22, 0.05),
    },
    Thing {
        name: "right engine",
        parent: Some(SHIP),
        share: 0.08,
        color: (0.5, 0.5, 0.55),
        form: Form::Barrel(0.22, 0.05),
    },
];

/// A planet with a moon and a satellite, and a spaceship with a hull and engines: drawn thing by thing, put into groups that
/// hang under one another, and sent on a journey in which groups move within groups.
pub(super) struct Nested {
    rng: Random,
    time_secs: f64,
    samples: u32,
    polygons: u32,
    thing: usize,
    /// Polygons of the current thing so far.
    drawn: f64,
    strokes: Vec<StrokeId>,
    next_stroke: u32,
    step: u32,
    queue: VecDeque<Event>,
}

impl Nested {
    pub(super) fn new(polygons: u32, seed: u64) -> Self {
        Self {
            rng: Random::new(seed),
            time_secs: 0.0,
            samples: 0,
            polygons,
            thing: if polygons == 0 { THINGS.len() } else { 0 },
            drawn: 0.0,
            strokes: Vec::new(),
            next_stroke: 0,
            step: if polygons == 0 { STEPS } else { 0 },
            queue: VecDeque::new(),
        }
    }

    pub(super) fn header(source: String) -> Header {
        let root = Some(Root { center: CENTER, size: VOLUME_M });
        Header { root, ..Header::new(SynthKind::Nested.name(), source) }
    }

    /// A sample later; now and then the head is told.
    fn pass(&mut self, secs: f64) {
        self.time_secs += secs;
        self.samples += 1;
        if !self.samples.is_multiple_of(SAMPLES_A_HEAD) {
            return;
        }
        // Slowly around the bench.
        let angle = 0.11 * self.time_secs;
        let eye = BENCH + DVec3::new(libm::sin(angle) * 1.9, 0.5, libm::cos(angle) * 1.9);
        let back = (eye - BENCH).normalize_or(DVec3::Z);
        let up = perpendicular(DVec3::Y, back);
        let q = quaternion(up.cross(back), up, back);
        self.queue.push_back(Event::Head {
            author: Author::SOLE,
            t: self.time(),
            p: position(eye),
            q: rotation(q),
        });
    }

    fn time(&self) -> f64 {
        (self.time_secs * 1e3).round() / 1e3
    }

    /// Draws a stroke of the current thing; once it has its share, makes it a group.
    fn draw(&mut self) {
        let thing = &THINGS[self.thing];
        let share = thing.share * f64::from(self.polygons);
        let along = (self.drawn / share.max(1.0)).min(1.0);
        let color = self.rng.color_near(thing.color, 0.15);
        match thing.form {
            Form::Ball(radius) => {
                let angle = (along - 0.5) * 0.92 * std::f64::consts::PI;
                let (height, around) = (radius * libm::sin(angle), radius * libm::cos(angle));
                self.ring(DVec3::Y * height, around, [DVec3::X, DVec3::Z], radius * 0.12, color);
            }
            Form::Barrel(length, radius) => {
                let taper = 1.0 - 0.5 * along * along;
                let middle = DVec3::Z * ((along - 0.5) * length);
                self.ring(middle, radius * taper, [DVec3::X, DVec3::Y], radius * 0.35, color);
            }
            Form::Panels(length, width) => self.panel(along, length, width, color),
        }
        if self.drawn >= share {
            let group = GroupId(self.thing as u32);
            let parent = thing.parent.map(|parent| GroupId(parent as u32));
            let (t, strokes) = (self.time(), std::mem::take(&mut self.strokes));
            self.queue.push_back(Event::Group {
                author: Author::SOLE,
                t,
                group,
                strokes,
                parent,
                name: Some(thing.name.to_owned()),
            });
            self.place(self.thing, 0.0);
            self.drawn = 0.0;
            self.thing += 1;
        }
    }

    /// A closed band around a middle (from the bench).
    fn ring(
        &mut self,
        middle: DVec3,
        radius: f64,
        [u, v]: [DVec3; 2],
        width_m: f64,
        color: (f32, f32, f32, f32),
    ) {
        let stroke = self.begin(width_m, color);
        let first = self.rng.between(0.0, std::f64::consts::TAU);
        for i in 0..=SAMPLES {
            let (sin, cos) = libm::sincos(first + std::f64::consts::TAU * f64::from(i) / f64::from(SAMPLES));
            self.point(stroke, BENCH + middle + (u * cos + v * sin) * radius);
        }
        self.end(stroke);
    }

    /// A flat band that leads away from the middle, left and right in turns; each pair a little farther back.
    fn panel(&mut self, along: f64, length: f64, width: f64, color: (f32, f32, f32, f32)) {
        let stroke = self.begin(width * 0.2, color);
        let side = if self.next_stroke.is_multiple_of(2) { 1.0 } else { -1.0 };
        let (z, height) = ((along - 0.5) * width, self.rng.between(-0.01, 0.01));
        for i in 0..=SAMPLES {
            let x = side * (0.05 + 0.5 * length * f64::from(i) / f64::from(SAMPLES));
            self.point(stroke, BENCH + DVec3::new(x, height, z));
        }
        self.end(stroke);
    }

    fn begin(&mut self, width_m: f64, color: (f32, f32, f32, f32)) -> StrokeId {
        let stroke = StrokeId(self.next_stroke);
        self.next_stroke += 1;
        self.queue.push_back(Event::Begin {
            author: Author::SOLE,
            t: self.time(),
            stroke,
            tool: Tool::Ribbon,
            width: rounded(width_m, 1e4),
            color,
            normal: NormalRule::Transport,
            thinnest: 1.0,
            paint: None,
        });
        stroke
    }

    fn point(&mut self, stroke: StrokeId, p: DVec3) {
        let (t, q) = (self.time(), Quat::IDENTITY);
        self.queue.push_back(Event::Point { t, stroke, p: position(p), q, pressure: 1.0 });
        self.pass(SAMPLE_SECS);
    }

    fn end(&mut self, stroke: StrokeId) {
        self.queue.push_back(Event::End { t: self.time(), stroke });
        self.time_secs += PAUSE_SECS;
        self.strokes.push(stroke);
        self.drawn += f64::from(SAMPLES);
    }

    /// Places a thing as it is after part of the journey, in the space of what it hangs under.
    fn place(&mut self, thing: usize, along: f64) {
        let turn = std::f64::consts::TAU;
        let (at, axis, angle, scale) = match thing {
            PLANET => (DVec3::new(-0.5, 0.3, -0.4), DVec3::Y, turn * 1.5 * along, 1.0),
            MOON => {
                let (sin, cos) = libm::sincos(turn * 2.0 * along);
                (DVec3::new(0.75 * cos, 0.1 * sin, 0.75 * sin), DVec3::Y, turn * 3.0 * along, 1.0)
            }
            // Once it has docked, it goes with the ship.
            SATELLITE if along >= DOCKS_AT => (DVec3::new(0.0, 0.16, 0.1), DVec3::Z, 0.0, 0.6),
            SATELLITE => {
                let (sin, cos) = libm::sincos(-turn * 2.5 * along);
                (DVec3::new(0.58 * cos, 0.2, 0.58 * sin), DVec3::X, turn * along, 0.8)
            }
            SHIP => {
                let (sin, cos) = libm::sincos(turn * along);
                (DVec3::new(1.1 * sin, 0.35 + 0.3 * along, 0.9 * cos), DVec3::Y, turn * along, 1.0)
            }
            engine if ENGINES.contains(&engine) => {
                let side = if engine == ENGINES[0] { -1.0 } else { 1.0 };
                let swing = 0.5 * libm::sin(turn * 4.0 * along) * side;
                (DVec3::new(0.18 * side, 0.0, 0.38), DVec3::X, swing, 1.0)
            }
            _ => (DVec3::ZERO, DVec3::Y, 0.0, 1.0),
        };
        let turned = |v: DVec3| turned(v, axis, angle);
        let q = rotation(quaternion(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z)));
        let to = Transform { p: position(BENCH + at - turned(BENCH) * scale), q, s: rounded(scale, 1e3) };
        self.queue.push_back(Event::Place {
            author: Author::SOLE,
            t: self.time(),
            group: GroupId(thing as u32),
            to,
        });
    }

    /// A step of the journey: things that hang under others move within them.
    fn travel(&mut self) {
        let before = f64::from(self.step) / f64::from(STEPS);
        self.step += 1;
        let along = f64::from(self.step) / f64::from(STEPS);
        if before < DOCKS_AT && along >= DOCKS_AT {
            let (t, group) = (self.time(), GroupId(SATELLITE as u32));
            let parent = Some(GroupId(SHIP as u32));
            self.queue.push_back(Event::Group {
                author: Author::SOLE,
                t,
                group,
                strokes: Vec::new(),
                parent,
                name: None,
            });
            self.place(SATELLITE, along);
        }
        self.place(PLANET, along);
        self.place(MOON, along);
        if along < DOCKS_AT {
            self.place(SATELLITE, along);
        }
        self.place(SHIP, along);
        ENGINES.iter().for_each(|&engine| self.place(engine, along));
        self.pass(STEP_SECS);
    }
}

fn rotation(q: [f64; 4]) -> Quat {
    Quat::from_array(q.map(|c| rounded(c, 1e5)))
}

impl EventSource for Nested {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        while self.queue.is_empty() {
            if self.thing < THINGS.len() {
                self.draw();
            } else if self.step < STEPS {
                self.travel();
            } else {
                return Ok(None);
            }
        }
        Ok(self.queue.pop_front())
    }
}
