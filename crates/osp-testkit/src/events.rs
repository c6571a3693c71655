//! Events of a session, with defaults for the fields that a test does not need.

use std::path::Path;

use glam::{Quat, Vec3};
use osp_session::{
    recording::{Author, Event, GroupId, NormalRule, OpenOptions, Paint, StrokeId, Tool, Transform, open},
    scene::Scene,
};

/// The beginning of a stroke: `Begin { width: 0.2, ..Begin::of(stroke) }.event()`.
#[derive(Clone, Debug)]
pub struct Begin {
    /// The author. Default: the only one.
    pub author: Author,
    /// The stroke's number.
    pub stroke: StrokeId,
    /// The tool. Default: a ribbon.
    pub tool: Tool,
    /// The width in metres. Default: 0.1.
    pub width: f32,
    /// The colour. Default: white.
    pub color: (f32, f32, f32, f32),
    /// The rule for normals. Default: [`NormalRule::Transport`].
    pub normal: NormalRule,
    /// The share of the width without pressure. Default: 1.
    pub thinnest: f32,
    /// The paint. Default: none.
    pub paint: Option<Box<Paint>>,
}

impl Begin {
    /// Returns the beginning of a plain ribbon.
    pub fn of(stroke: StrokeId) -> Self {
        Self {
            author: Author::SOLE,
            stroke,
            tool: Tool::Ribbon,
            width: 0.1,
            color: (1.0, 1.0, 1.0, 1.0),
            normal: NormalRule::Transport,
            thinnest: 1.0,
            paint: None,
        }
    }

    /// Returns the event, at the time 0.
    pub fn event(self) -> Event {
        let Self { author, stroke, tool, width, color, normal, thinnest, paint } = self;
        Event::Begin { author, t: 0.0, stroke, tool, width, color, normal, thinnest, paint }
    }
}

/// The edits of an author, at the time 0.
#[derive(Clone, Copy, Debug)]
pub struct By(pub Author);

/// The edits of the only author.
pub const SOLE: By = By(Author::SOLE);

impl By {
    /// Returns an undo.
    pub const fn undo(self) -> Event {
        Event::Undo { author: self.0, t: 0.0 }
    }

    /// Returns a redo.
    pub const fn redo(self) -> Event {
        Event::Redo { author: self.0, t: 0.0 }
    }

    /// Returns the erasure of a stroke.
    pub fn erase(self, stroke: StrokeId) -> Event {
        Event::Erase { author: self.0, t: 0.0, stroke }
    }

    /// Returns a move of strokes.
    pub fn moved(self, strokes: impl Into<Vec<StrokeId>>, by: Vec3) -> Event {
        Event::Move { author: self.0, t: 0.0, strokes: strokes.into(), by }
    }

    /// Returns a group of strokes.
    pub fn grouped(
        self,
        group: GroupId,
        strokes: impl Into<Vec<StrokeId>>,
        parent: Option<GroupId>,
    ) -> Event {
        Event::Group { author: self.0, t: 0.0, group, strokes: strokes.into(), parent, name: None }
    }

    /// Returns the placing of a group.
    pub fn placed(self, group: GroupId, to: Transform) -> Event {
        Event::Place { author: self.0, t: 0.0, group, to }
    }
}

/// Returns a sample of a stroke, at full pressure.
pub fn point(stroke: StrokeId, p: Vec3) -> Event {
    Event::Point { t: 0.0, stroke, p, q: Quat::IDENTITY, pressure: 1.0 }
}

/// Returns a polygon of the only author.
pub fn polygon(
    stroke: Option<StrokeId>,
    vertices: impl Into<Vec<Vec3>>,
    color: (f32, f32, f32, f32),
) -> Event {
    Event::Polygon { author: Author::SOLE, t: 0.0, stroke, vertices: vertices.into(), shading: None, color }
}

/// Returns the scene after these events.
pub fn scene_of<'a>(events: impl IntoIterator<Item = &'a Event>) -> Scene {
    let mut scene = Scene::new();
    scene.apply_all(events, &mut Vec::new());
    scene
}

/// Returns the events of a session.
///
/// # Panics
///
/// Panics if a strict reader refuses a part of it.
pub fn events_in(path: impl AsRef<Path>) -> Vec<Event> {
    let session = open(path.as_ref(), &OpenOptions::STRICT).expect("a session");
    session.map(|event| event.expect("a whole event")).collect()
}
