use std::ops::Range;

use glam::Vec3;

use crate::{
    brush::{Brush, Surface},
    recording::{Author, StrokeId},
    stroke::StrokeBuilder,
};
use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, PolygonId},
};

/// A stroke and its state in the scene.
#[derive(Clone, Debug)]
pub struct Stroke {
    pub(super) id: Option<StrokeId>,
    pub(super) color: (f32, f32, f32, f32),
    /// Its brush, if its recording names a known one.
    pub(super) brush: Option<&'static Brush>,
    /// Largest distance by which the brush's animation may move polygons out of their boxes, metres, in the stroke's
    /// own space.
    pub(super) padding_m: f32,
    pub(super) layer: u32,
    /// It is not drawn.
    pub(super) is_hidden: bool,
    /// Whether its beginning hides it; an event that shows its layer ends that.
    pub(super) was_hidden: bool,
    pub(super) points: u32,
    /// Its polygons; more than one range where strokes overlap in time.
    pub(super) polygons: Vec<Range<u32>>,
    /// Polygons in use; those after them have shrunk to a point until the stroke needs them again.
    pub(super) used: u32,
    /// Polygons that samples do not replace: all up to the last one that an
    /// [`Event::Polygon`](crate::recording::Event::Polygon) added to it.
    pub(super) fixed: u32,
    /// Samples have come since it was last painted.
    pub(super) is_unpainted: bool,
    /// Number of authors that have erased it.
    pub(super) erasers: u16,
    pub(super) author: u16,
    pub(super) undone: bool,
    /// Out of reach of undo and redo; its polygons are let go next.
    pub(super) is_gone: bool,
    /// Sum of its [moves](crate::recording::Event::Move), in the space of its group (the world's, if it is in none).
    pub(super) offset: Vec3,
    pub(super) group: Option<usize>,
    /// It has to be placed again before the changes are handed out.
    pub(super) is_displaced: bool,
    /// It has come or gone in this frame.
    pub(super) is_untold: bool,
    /// It was placed again while it was invisible, without a change.
    pub(super) was_displaced_unseen: bool,
    /// Present while it is being drawn.
    pub(super) builder: Option<Box<StrokeBuilder>>,
}

impl Stroke {
    pub(super) fn new(id: Option<StrokeId>, color: (f32, f32, f32, f32)) -> Self {
        Self { id, color, ..Self::NONE }
    }

    /// Placeholder for a stroke that was let go.
    pub(super) const NONE: Self = Self {
        id: None,
        color: (0.0, 0.0, 0.0, 0.0),
        brush: None,
        padding_m: 0.0,
        layer: 0,
        is_hidden: false,
        was_hidden: false,
        points: 0,
        polygons: Vec::new(),
        used: 0,
        fixed: 0,
        is_unpainted: false,
        erasers: 0,
        author: 0,
        undone: true,
        is_gone: true,
        offset: Vec3::ZERO,
        group: None,
        is_displaced: false,
        is_untold: false,
        was_displaced_unseen: false,
        builder: None,
    };

    /// Its number in the recording; none for a polygon that came without a stroke.
    pub fn id(&self) -> Option<StrokeId> {
        self.id
    }

    /// Its author.
    pub fn author(&self) -> Author {
        Author(u32::from(self.author))
    }

    /// Red, green, blue, opacity, sRGB.
    pub fn color(&self) -> (f32, f32, f32, f32) {
        self.color
    }

    /// Its brush, if its recording names a known one.
    pub fn brush(&self) -> Option<&'static Brush> {
        self.brush
    }

    /// Its layer, a place in [`Header::layers`](crate::recording::Header::layers).
    pub fn layer(&self) -> u32 {
        self.layer
    }

    /// Whether it is not drawn, as its layer is hidden in the recording.
    pub fn is_hidden(&self) -> bool {
        self.is_hidden
    }

    /// Whether it is erased or undone.
    pub fn is_taken_away(&self) -> bool {
        self.erasers > 0 || self.undone
    }

    /// Whether its polygons are in the model now.
    pub fn is_visible(&self) -> bool {
        !self.is_taken_away() && !self.is_hidden
    }

    /// Whether it was moved while it was invisible: a change reports that when it comes back.
    pub fn was_displaced_unseen(&self) -> bool {
        self.was_displaced_unseen
    }

    /// Its offset, in the space of its group.
    pub fn offset(&self) -> Vec3 {
        self.offset
    }

    /// Whether it is still being drawn.
    pub fn is_open(&self) -> bool {
        self.builder.is_some()
    }

    /// Its control points so far.
    pub fn point_count(&self) -> u32 {
        self.points
    }

    /// Its polygons in use; others have shrunk to a point until it needs them again.
    pub fn polygon_count(&self) -> u32 {
        self.used
    }

    /// Its polygons, also those that have shrunk to a point.
    pub(super) fn kept_polygons(&self) -> u64 {
        self.polygons.iter().map(|range| u64::from(range.end - range.start)).sum()
    }

    /// The id of its polygon at a place, counted from its first.
    pub(super) fn id_at(&self, place: u32) -> Option<PolygonId> {
        let mut left = place;
        for range in &self.polygons {
            let count = range.end - range.start;
            if left < count {
                return Some(PolygonId(range.start + left));
            }
            left -= count;
        }
        None
    }

    /// The box of one of its polygons in the world.
    pub(super) fn bounds_of(&self, world: &ConvexPolygon, surface: &Surface, world_scale: f32) -> Aabb {
        let mut bounds = world.bounds();
        if surface.is_facing() {
            // It stays in the ball through its corners, whatever the eye. The factor covers rounding.
            let middle = bounds.center();
            let radius = world.vertices().iter().map(|p| p.distance(middle)).fold(0.0, f32::max) * 1.001;
            bounds = Aabb { min: middle - radius, max: middle + radius };
        }
        let padding = self.padding_m * world_scale;
        if padding > 0.0 { Aabb { min: bounds.min - padding, max: bounds.max + padding } } else { bounds }
    }

    /// Its polygons, in order of arrival.
    pub fn polygon_ids(&self) -> impl Iterator<Item = PolygonId> + '_ {
        self.polygons.iter().flat_map(|r| r.clone().map(PolygonId))
    }
}
