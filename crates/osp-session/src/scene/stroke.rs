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

#[derive(Clone, Debug)]
pub struct Stroke {
    pub(super) id: Option<StrokeId>,
    pub(super) color: (f32, f32, f32, f32),
    pub(super) brush: Option<&'static Brush>,
    /// Largest distance by which the brush's animation may move polygons out of their boxes, metres, in the stroke's
    /// own space.
    pub(super) padding_m: f32,
    pub(super) layer: u32,
    pub(super) is_hidden: bool,
    /// Whether the stroke was hidden at its beginning. An event that hides or shows the stroke's layer takes
    /// precedence.
    pub(super) was_hidden: bool,
    pub(super) points: u32,
    /// Id ranges of the stroke's polygons. There are several ranges if strokes overlap in time.
    pub(super) polygons: Vec<Range<u32>>,
    /// Number of polygons in use. Further polygons are points until the stroke needs them again.
    pub(super) used: u32,
    /// Number of polygons that stay when new samples rebuild the stroke: all up to the last polygon of an
    /// [`Event::Polygon`](crate::recording::Event::Polygon).
    pub(super) fixed: u32,
    /// Whether the stroke has samples that [`Scene::paint`](super::Scene::paint) has not processed.
    pub(super) is_unpainted: bool,
    pub(super) erasers: u16,
    pub(super) author: u16,
    pub(super) undone: bool,
    /// Whether undo and redo no longer reach the stroke, so that its polygons will be freed.
    pub(super) is_gone: bool,
    /// Sum of the stroke's [moves](crate::recording::Event::Move), in the space of its group (world space without a
    /// group).
    pub(super) offset: Vec3,
    pub(super) group: Option<usize>,
    /// Whether the polygons must be transformed again before the changes are returned.
    pub(super) is_displaced: bool,
    /// Whether the stroke became visible or invisible in this frame, and was not reported yet.
    pub(super) is_unreported: bool,
    /// Whether the stroke was transformed while it was invisible, without a reported change.
    pub(super) was_displaced_unseen: bool,
    pub(super) builder: Option<Box<StrokeBuilder>>,
}

impl Stroke {
    pub(super) fn new(id: Option<StrokeId>, color: (f32, f32, f32, f32)) -> Self {
        Self { id, color, ..Self::NONE }
    }

    /// Placeholder for a stroke that was freed.
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
        is_unreported: false,
        was_displaced_unseen: false,
        builder: None,
    };

    /// The stroke's number in the recording; `None` for a polygon without a stroke.
    pub fn id(&self) -> Option<StrokeId> {
        self.id
    }

    pub fn author(&self) -> Author {
        Author(u32::from(self.author))
    }

    /// Red, green, blue, opacity, sRGB.
    pub fn color(&self) -> (f32, f32, f32, f32) {
        self.color
    }

    /// The brush; `None` if the recording names no known brush.
    pub fn brush(&self) -> Option<&'static Brush> {
        self.brush
    }

    /// Index of the stroke's layer in [`Header::layers`](crate::recording::Header::layers).
    pub fn layer(&self) -> u32 {
        self.layer
    }

    /// Whether the stroke is not drawn because its layer is hidden in the recording.
    pub fn is_hidden(&self) -> bool {
        self.is_hidden
    }

    /// Whether the stroke is erased or undone.
    pub fn is_taken_away(&self) -> bool {
        self.erasers > 0 || self.undone
    }

    /// Whether the stroke's polygons are in the model now.
    pub fn is_visible(&self) -> bool {
        !self.is_taken_away() && !self.is_hidden
    }

    /// Whether the stroke was moved while it was invisible. A change reports the move when the stroke becomes visible.
    pub fn was_displaced_unseen(&self) -> bool {
        self.was_displaced_unseen
    }

    pub fn offset(&self) -> Vec3 {
        self.offset
    }

    pub fn is_open(&self) -> bool {
        self.builder.is_some()
    }

    /// Number of control points so far.
    pub fn point_count(&self) -> u32 {
        self.points
    }

    /// Number of polygons in use. All corners of an unused polygon coincide until the stroke needs the polygon again.
    pub fn polygon_count(&self) -> u32 {
        self.used
    }

    /// Number of the stroke's polygons, including unused ones.
    pub(super) fn kept_polygons(&self) -> u64 {
        self.polygons.iter().map(|range| u64::from(range.end - range.start)).sum()
    }

    /// The id of the stroke's polygon at a position, counted from its first polygon.
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

    /// The box, in world space, of a polygon of the stroke.
    pub(super) fn bounds_of(&self, world: &ConvexPolygon, surface: &Surface, world_scale: f32) -> Aabb {
        let mut bounds = world.bounds();
        if surface.is_facing() {
            // For every eye position, the polygon stays in the ball through its corners. The factor covers rounding.
            let middle = bounds.center();
            let radius = world.vertices().iter().map(|p| p.distance(middle)).fold(0.0, f32::max) * 1.001;
            bounds = Aabb { min: middle - radius, max: middle + radius };
        }
        let padding = self.padding_m * world_scale;
        if padding > 0.0 { Aabb { min: bounds.min - padding, max: bounds.max + padding } } else { bounds }
    }

    pub fn polygon_ids(&self) -> impl Iterator<Item = PolygonId> + '_ {
        self.polygons.iter().flat_map(|r| r.clone().map(PolygonId))
    }
}
