use std::collections::VecDeque;

use glam::{Quat, Vec3};

use super::{CENTER, SynthKind, VOLUME_M};
use crate::{
    brush::{self, Brush},
    recording::{
        Author, Camera, Environment, Event, EventSource, Header, NormalRule, Paint, RecordingError, Root,
        StrokeId, Tool,
    },
};

const COLUMNS: u32 = 8;
/// Distance between neighbouring strokes: along a row and between rows, metres.
const CELL_M: [f32; 2] = [0.34, 0.24];
/// Distance between two walls of strokes, metres.
const DEPTH_M: f32 = 0.5;
const SAMPLES: u32 = 48;

/// A sample sheet: each offered brush draws one wave, in rows that form a wall. Further walls in other colours follow
/// behind it.
pub(super) struct Brushes {
    brushes: Vec<&'static Brush>,
    next: u32,
    time_secs: f64,
    /// Number of remaining samples. A sample makes about one polygon.
    left: u32,
    seed: u64,
    events: VecDeque<Event>,
}

impl Brushes {
    pub(super) fn new(polygons: u32, seed: u64) -> Self {
        let brushes = brush::all().iter().filter(|brush| brush.is_offered).collect();
        Self { brushes, next: 0, time_secs: 0.0, left: polygons, seed, events: VecDeque::new() }
    }

    pub(super) fn header(&self, source: String) -> Header {
        let rows = (self.brushes.len() as u32).div_ceil(COLUMNS) as f32;
        let environment = Environment {
            sky: [Vec3::new(0.28, 0.28, 0.32), Vec3::new(0.04, 0.04, 0.09)],
            ambient: Vec3::splat(0.39),
            lights: [
                (Vec3::new(0.0, -0.866, -0.5), Vec3::new(0.78, 0.82, 0.99)),
                (Vec3::new(0.0, -0.643, 0.766), Vec3::new(0.43, 0.42, 0.35)),
            ],
            reflection: 0.3,
            ..Environment::default()
        };
        let eye = CENTER + Vec3::Z * (rows * CELL_M[1] * 1.5);
        let camera = Camera { p: eye, q: Quat::IDENTITY, fov_degrees: 45.0, near_m: None };
        let header = Header::new(SynthKind::Brushes.name(), source);
        Header {
            root: Some(Root { center: CENTER, size: VOLUME_M }),
            camera: Some(camera),
            environment: Some(Box::new(environment)),
            ..header
        }
    }

    fn stroke(&mut self) {
        let count = self.brushes.len() as u32;
        let (wall, place) = (self.next / count, self.next % count);
        let brush = self.brushes[place as usize];
        let [column, row] = [place % COLUMNS, place / COLUMNS];
        let middle = |i: u32, of: u32| i as f32 - (of - 1) as f32 * 0.5;
        let start = CENTER
            + Vec3::new(
                middle(column, COLUMNS) * CELL_M[0],
                -middle(row, count.div_ceil(COLUMNS)) * CELL_M[1],
                wall as f32 * -DEPTH_M,
            );
        // Neighbouring strokes and neighbouring walls differ in hue.
        let hue = (place as f32 * 0.381_966 + wall as f32 * 0.21 + self.seed as f32 * 0.1).fract();
        let channel =
            |shift: f32| 0.2 + 0.75 * (((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        let color = (channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0), 1.0);
        let stroke = StrokeId(self.next);
        let seed = (self.seed as u32).wrapping_mul(0x9e37_79b9) ^ self.next;
        self.events.push_back(Event::Begin {
            author: Author::SOLE,
            t: self.time_secs,
            stroke,
            tool: Tool::Ribbon,
            width: 0.05,
            color,
            normal: NormalRule::Travel,
            thinnest: brush.pressure_size_min,
            paint: Some(Box::new(Paint::new(&*brush.name, seed))),
        });
        for i in 0..SAMPLES {
            let along = i as f32 / (SAMPLES - 1) as f32;
            let wave = libm::sinf(along * 1.5 * std::f32::consts::TAU) * 0.045;
            let p = start + Vec3::new((along - 0.5) * CELL_M[0] * 0.75, wave, 0.02 * along);
            self.time_secs += 1.0 / 90.0;
            let pressure = libm::sqrtf(libm::sinf(along * std::f32::consts::PI).max(0.0)).clamp(0.1, 1.0);
            self.events.push_back(Event::Point { t: self.time_secs, stroke, p, q: Quat::IDENTITY, pressure });
        }
        self.events.push_back(Event::End { t: self.time_secs, stroke });
        self.time_secs += 0.5;
        self.next += 1;
        self.left = self.left.saturating_sub(SAMPLES);
    }
}

impl EventSource for Brushes {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        if self.events.is_empty() && self.left > 0 {
            self.stroke();
        }
        Ok(self.events.pop_front())
    }
}
