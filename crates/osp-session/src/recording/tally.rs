//! Counts the contents of a session, event by event, and compares the counts with the limits.

use std::{collections::HashMap, fmt};

use glam::Vec3;

use super::{Event, Limits, StrokeId, Tool};
use crate::brush::{self, Brush, Family};

/// Number of polygons that a sample of a tube counts as: the sides of the tube.
const TUBE_POLYGONS: u64 = 8;

/// The counts so far of everything that takes memory.
#[derive(Clone, Copy, Debug, Default)]
struct Amount {
    strokes: u64,
    points: u64,
    faces: u64,
    groupings: u64,
    events: u64,
    polygons: u64,
}

impl Amount {
    /// The first exceeded limit, and its name.
    fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        [
            (self.polygons, limits.polygons, "polygons"),
            (self.strokes, limits.strokes(), "strokes"),
            (self.groupings, limits.strokes(), "groupings"),
            (self.events, limits.events(), "events and strokes in edits"),
        ]
        .into_iter()
        .find_map(|(read, most, what)| (read > most).then_some((most, what)))
    }
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { strokes, points, faces, groupings, events, .. } = self;
        write!(
            f,
            "{strokes} strokes, {points} points, {faces} faces, {groupings} groupings, {events} events in all"
        )
    }
}

/// The rule for the number of polygons that a sample counts as.
#[derive(Clone, Debug)]
enum Weight {
    /// Each sample counts as this number of polygons.
    Each(u64),
    /// The number depends on the distance from the last sample, for particles and sprays.
    ByDistance { brush: &'static Brush, width_m: f32, scale: f32, last: Option<Vec3> },
}

impl Weight {
    fn of(&mut self, p: Vec3, pressure: f32) -> u64 {
        match self {
            Self::Each(polygons) => *polygons,
            Self::ByDistance { brush, width_m, scale, last } => {
                let way_m = last.replace(p).map_or(0.0, |last| last.distance(p));
                let step_m = match brush.family {
                    Family::Particles => brush::PARTICLE_STEP_M * *scale / brush.particle_rate,
                    _ => *width_m * brush.size(pressure) / brush.spray_rate,
                };
                let count = (way_m / step_m) as u64;
                1 + if step_m > 0.0 { count.min(brush::MAX_SCATTERED) } else { 0 }
            }
        }
    }
}

/// Counts everything in a session that takes memory.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    read: Amount,
    /// Weight of the next sample of each open stroke.
    open: HashMap<StrokeId, Weight>,
    /// Stroke of the last sample and its weight, if it is constant. It is a cache, because the next sample is usually
    /// of the same stroke.
    last: Option<(StrokeId, u64)>,
    /// Stroke of the last face. It is a cache, because the next face is usually of the same stroke.
    last_face: Option<StrokeId>,
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.read.fmt(f)
    }
}

impl Tally {
    pub fn is_open(&self, stroke: StrokeId) -> bool {
        self.open.contains_key(&stroke)
    }

    /// Counts an event, unless it exceeds a limit; the error is this limit and its name.
    pub fn count(&mut self, event: &Event, limits: &Limits) -> Result<(), (u64, &'static str)> {
        let before = self.read;
        self.add(event);
        self.excess(limits).map_or(Ok(()), |excess| {
            self.read = before;
            Err(excess)
        })
    }

    pub fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        self.read.excess(limits)
    }

    pub fn add(&mut self, event: &Event) {
        let read = &mut self.read;
        read.events += 1;
        match event {
            Event::Begin { stroke, tool, width, paint, .. } => {
                read.strokes += 1;
                let brush = paint.as_ref().and_then(|paint| brush::find(&paint.brush));
                let scale = paint.as_ref().map_or(1.0, |paint| paint.scale);
                let weight = match brush.map(|brush| (brush, brush.family)) {
                    Some((_, Family::Tube { .. } | Family::BoxSection)) => Weight::Each(TUBE_POLYGONS),
                    Some((brush, Family::Particles | Family::Spray { .. })) => {
                        Weight::ByDistance { brush, width_m: *width, scale, last: None }
                    }
                    None if *tool == Tool::Tube => Weight::Each(TUBE_POLYGONS),
                    _ => Weight::Each(1),
                };
                self.open.entry(*stroke).or_insert(weight);
            }
            Event::Point { stroke, p, pressure, .. } => {
                read.points += 1;
                if let Some((last, polygons)) = self.last
                    && last == *stroke
                {
                    read.polygons += polygons;
                } else if let Some(weight) = self.open.get_mut(stroke) {
                    read.polygons += weight.of(*p, *pressure);
                    self.last = match weight {
                        Weight::Each(polygons) => Some((*stroke, *polygons)),
                        Weight::ByDistance { .. } => None,
                    };
                } else {
                    self.last = None;
                }
            }
            Event::End { stroke, .. } => {
                self.open.remove(stroke);
                self.last = None;
            }
            Event::Polygon { vertices, stroke, .. } => {
                read.faces += 1;
                read.strokes += u64::from(stroke.is_some() && *stroke != self.last_face);
                self.last_face = *stroke;
                read.polygons += vertices.len().saturating_sub(2) as u64;
            }
            Event::Move { strokes, .. } | Event::Assign { strokes, .. } => {
                read.events += strokes.len() as u64
            }
            Event::Group { strokes, .. } => {
                read.groupings += 1;
                read.events += strokes.len() as u64;
            }
            Event::Join { .. }
            | Event::Leave { .. }
            | Event::Head { .. }
            | Event::Erase { .. }
            | Event::Undo { .. }
            | Event::Redo { .. }
            | Event::Step { .. }
            | Event::Layer { .. }
            | Event::View { .. }
            | Event::Place { .. } => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaps_of_particles_and_sprays_count_as_what_they_become() {
        for (name, step_m) in [("Snow", None), ("Splatter", Some(0.1))] {
            let brush = brush::find(name).expect("a brush of the table");
            let step_m = match step_m {
                Some(width_m) => width_m * brush.size(1.0) / brush.spray_rate,
                None => brush::PARTICLE_STEP_M / brush.particle_rate,
            };
            let mut weight = Weight::ByDistance { brush, width_m: 0.1, scale: 1.0, last: None };
            assert_eq!(weight.of(Vec3::ZERO, 1.0), 1);
            assert_eq!(weight.of(Vec3::X * step_m * 10.5, 1.0), 11, "{name}");
            assert_eq!(weight.of(Vec3::X * 1.0e9, 1.0), 1 + brush::MAX_SCATTERED, "{name}");
        }
    }
}
