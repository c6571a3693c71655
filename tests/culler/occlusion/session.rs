//! Scenes made by events, and what follows them.

use super::random::{Polygon, Random};
use glam::Vec3;
use osp::{
    occlusion::{OccluderPool, PoolConfig},
    polygon::Change,
    view::{Projection, View},
};
use osp_session::{
    recording::{Event, StrokeId},
    scene::Scene,
};
use osp_testkit::events::{self, Begin, point};

/// A scene that is told events, and the changes of the last ones.
#[derive(Default)]
pub(crate) struct Told {
    pub(crate) scene: Scene,
    pub(crate) changes: Vec<Change>,
}

impl Told {
    pub(crate) fn of(events: &[Event]) -> Self {
        let mut told = Self::default();
        told.tell(events);
        told
    }

    /// A pool that has followed the last changes only.
    pub(crate) fn pool(&self) -> OccluderPool {
        let mut pool = OccluderPool::new(PoolConfig::default());
        pool.follow(&self.scene, &self.changes);
        pool
    }

    pub(crate) fn polygons(&self) -> Vec<Polygon> {
        let ids = self.scene.visible_ids();
        ids.map(|id| self.scene.polygon(id).vertices().to_vec()).collect()
    }

    pub(crate) fn tell(&mut self, events: &[Event]) -> &[Change] {
        self.changes.clear();
        for event in events {
            self.scene.apply(event, &mut self.changes);
        }
        &self.changes
    }
}

pub(crate) fn polygon(vertices: &[Vec3], opacity: f32) -> Event {
    events::polygon(None, vertices, (0.5, 0.5, 0.5, opacity))
}

pub(crate) fn polygon_of(stroke: u32, vertices: &[Vec3]) -> Event {
    events::polygon(Some(StrokeId(stroke)), vertices, (0.5, 0.5, 0.5, 1.0))
}

/// A wandering ribbon in the cube from -2 to 2.
pub(crate) fn ribbon(stroke: u32, points: usize, width: f32, random: &mut Random) -> Vec<Event> {
    let stroke = StrokeId(stroke);
    let mut events = vec![Begin { width, color: (0.5, 0.5, 0.5, 1.0), ..Begin::of(stroke) }.event()];
    let mut at = random.in_cube() * 2.0;
    let mut travel = random.direction();
    for _ in 0..points {
        events.push(point(stroke, at.as_vec3()));
        travel = (travel + random.direction() * 0.25).normalize_or(travel);
        at += travel * 0.04;
    }
    events.push(Event::End { t: 0.0, stroke });
    events
}

pub(crate) fn view(eye: Vec3, target: Vec3) -> View {
    View::look_at(eye, target, Projection::symmetric(60.0, 1.5, 0.01, 1000.0))
}
