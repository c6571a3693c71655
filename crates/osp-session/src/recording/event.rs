use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Author, GroupId, SketchExtensions, StrokeId};
use osp::math::COORDINATE_LIMIT_M;

/// The newest recording format that this crate reads: the format with several [`Author`]s. A recording is written in
/// the oldest format that can represent it.
pub const FORMAT_VERSION: u32 = 4;

/// The first format that supports several [`Author`]s.
pub const AUTHORS_FORMAT: u32 = 4;

/// The format of a session that one author draws in the window. It is the oldest format with all events of the window.
pub const ONE_AUTHOR_FORMAT: u32 = 3;

/// Longest line of a recording, bytes. It bounds the memory of a reader. A polygon of [`Event::MAX_VERTICES`] corners
/// takes about 50 kB. A move takes at most 11 bytes for each stroke, so a line can list 1.5 million strokes.
pub const MAX_LINE_BYTES: usize = 1 << 24;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tool {
    /// A band of quads along the samples.
    Ribbon,
    /// One planar polygon; the samples are its corners.
    Wall,
    /// A closed tube along the samples.
    Tube,
}

/// The brush of a stroke and its settings. A program that lacks the brush draws the stroke by its tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paint {
    /// Name or GUID of the brush. If it is empty, the stroke is drawn by its tool.
    pub brush: String,
    /// Seed of the brush's random numbers.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub seed: u32,
    /// Factor of the brush's own lengths (spacing, fading), not of the stroke's width.
    #[serde(default = "full", skip_serializing_if = "is_full")]
    pub scale: f32,
    /// Index of the layer in [`Header::layers`](super::Header::layers), if the session has layers.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub layer: u32,
    /// Whether the stroke is hidden, because its layer was hidden when the session was saved.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
    /// Group in a Tilt Brush or Open Brush sketch, 0 for none. These programs select the strokes of a group together.
    /// The number is no [`GroupId`] of the session, and no event changes it.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub sketch_group: u32,
    /// Flags in a Tilt Brush or Open Brush sketch. Bit 1: undo treats the stroke and the one before as one step.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub sketch_flags: u32,
    /// Other extensions of the stroke in a Tilt Brush or Open Brush sketch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sketch_extensions: Option<Box<SketchExtensions>>,
}

impl Paint {
    pub const MAX_NAME_BYTES: usize = 64;

    /// A brush with scale 1, on the first layer.
    pub fn new(brush: impl Into<String>, seed: u32) -> Self {
        Self {
            brush: brush.into(),
            seed,
            scale: 1.0,
            layer: 0,
            hidden: false,
            sketch_group: 0,
            sketch_flags: 0,
            sketch_extensions: None,
        }
    }

    fn check(&self) -> Result<(), &'static str> {
        if self.brush.len() > Self::MAX_NAME_BYTES {
            return Err("a brush's name of at most 64 bytes");
        }
        if !(self.scale > 0.0 && self.scale <= COORDINATE_LIMIT_M) {
            return Err("a scale of the brush above 0, at most 1e15");
        }
        Ok(())
    }
}

/// Orientation of a ribbon relative to the pose of the tracker that drew it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum NormalRule {
    /// The tracker's local X axis is the ribbon's normal (the OSP paper, Fig. 17).
    #[default]
    LocalX,
    /// The tracker's local X axis points along the ribbon's width (A-Painter).
    SideX,
    /// Tilt Brush's frame, computed from the direction of travel, the controller's forward axis (local -z) and its up
    /// axis (local y).
    Travel,
    /// No orientation was recorded, so a rotation-minimising frame along the stroke is used.
    Transport,
}

/// A similarity transform: scale, then rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// Translation, metres.
    pub p: Vec3,
    /// Rotation, unit quaternion.
    pub q: Quat,
    /// Uniform scale, positive.
    pub s: f32,
}

/// Shading of a polygon of a model. Each list is empty, or has an entry for each corner.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shading {
    /// Normals of a curved surface, of any length but 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normals: Vec<Vec3>,
    /// Texture coordinates, if the stroke has a brush.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uv: Vec<Vec2>,
    /// Opacity of the brush's paint, 0 to 1.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alpha: Vec<f32>,
}

impl Shading {
    fn check(&self, corners: usize) -> Result<(), &'static str> {
        let Self { normals, uv, alpha } = self;
        let fits = |count: usize| count == 0 || count == corners;
        let are_finite = uv.iter().all(|uv| uv.is_finite()) && alpha.iter().all(|alpha| alpha.is_finite());
        if !(fits(normals.len()) && fits(uv.len()) && fits(alpha.len()) && are_finite) {
            return Err("a shading with finite numbers for each vertex, or none");
        }
        normals.iter().try_for_each(|&normal| check_point(normal))
    }
}

/// An event of a session. `t` is in seconds since the session's start. Times may be zero, repeat or decrease. The order
/// of events is their order in the file; the time affects only the pace of a replay. `author` exists since format 4. In
/// a recording with one author it is 0 and is not written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Event {
    /// An author joins the session (since format 4). Authors are numbered from 1 in the order in which they join. An
    /// author who returns gets a new number.
    Join {
        t: f64,
        author: Author,
        /// The author's name; several authors may have the same name.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        name: String,
        /// Colour of the author's strokes if strokes are coloured by author: red, green, blue, each 0 to 1, sRGB.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        color: Option<(f32, f32, f32)>,
    },
    /// An author leaves permanently (since format 4). Unfinished strokes of the author end, and no undo reverts the
    /// author's work.
    Leave {
        t: f64,
        author: Author,
    },
    Head {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        p: Vec3,
        /// Rotation from the head, which looks along its -z, to world space.
        q: Quat,
    },
    Begin {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        /// Number of the stroke. Each number is used only once in a session.
        stroke: StrokeId,
        tool: Tool,
        /// Full width at full pressure, metres.
        width: f32,
        /// Red, green, blue, opacity, each 0 to 1, sRGB.
        color: (f32, f32, f32, f32),
        /// Orientation of a ribbon relative to the tracker.
        #[serde(default, skip_serializing_if = "crate::is_default")]
        normal: NormalRule,
        /// Width at pressure 0 divided by the full width (1: pressure has no effect).
        #[serde(default, skip_serializing_if = "is_zero")]
        thinnest: f32,
        /// The brush and its settings (since format 2).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        paint: Option<Box<Paint>>,
    },
    /// A control point of a stroke that has begun.
    Point {
        t: f64,
        stroke: StrokeId,
        p: Vec3,
        /// Orientation: the rotation from the tracker to world space.
        #[serde(default = "identity", skip_serializing_if = "is_identity")]
        q: Quat,
        /// Pressure, 0 to 1.
        #[serde(default = "full", skip_serializing_if = "is_full")]
        pressure: f32,
    },
    End {
        t: f64,
        stroke: StrokeId,
    },
    Erase {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        stroke: StrokeId,
    },
    /// The author's last edit is undone. An edit begins, erases, moves, groups or assigns strokes, or places a group; a
    /// [`Step`](Event::Step) counts as one edit. At most the last thousand edits can be undone
    /// ([`Scene::UNDO_DEPTH`](crate::scene::Scene::UNDO_DEPTH)); a further undo changes nothing. Edits of other authors
    /// stay: the state results from all edits that are not undone, in order.
    Undo {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
    },
    /// The author's last undone edit is redone, if the author has made no other edit since.
    Redo {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
    },
    /// Strokes are translated by a vector in world space. A stroke in a group stores the translation in the group's
    /// space. When the group is placed again, the translation therefore rotates and scales with the group. In a group
    /// of scale 0 no stroke can be moved.
    Move {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        strokes: Vec<StrokeId>,
        /// The translation, metres.
        by: Vec3,
    },
    /// Strokes become members of a group, which is created if it does not exist. Their coordinates are then in the
    /// group's space: if the group was placed, the strokes move.
    Group {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        group: GroupId,
        /// The strokes; each leaves its former group.
        strokes: Vec<StrokeId>,
        /// The parent group. If absent, the group has no parent from now on.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<GroupId>,
        /// The group's new name; if absent, the name does not change (since format 2).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
    },
    /// A group is placed: this transform replaces the group's former one.
    Place {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        group: GroupId,
        /// Transform from the group's own space to its parent group's space, or to world space.
        to: Transform,
    },
    /// The author's next edits form one step for undo and redo. The step ends after `edits` edits, at the next step, or
    /// at the next undo or redo that has an effect (since format 3).
    Step {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        /// Number of edits; 0 ends the previous step.
        edits: u32,
    },
    /// Changes properties of a layer (event since format 3). Absent properties keep their values. The change is not an
    /// edit, so undo does not revert it.
    Layer {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        /// Index of the layer in [`Header::layers`](super::Header::layers). An index after the last layer creates a
        /// layer.
        layer: u32,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        hidden: Option<bool>,
        /// Whether the window refuses to edit the layer's strokes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        locked: Option<bool>,
        /// Whether only the layer's owner may draw on the layer and change it: see
        /// [`Scene::may_touch`](crate::scene::Scene::may_touch) (since format 4).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mine: Option<bool>,
    },
    /// Strokes are assigned to a layer (since format 3).
    Assign {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        layer: u32,
        strokes: Vec<StrokeId>,
    },
    /// A view is stored under a number (since format 3). The event is not an edit.
    View {
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        /// Number of the view; it replaces an earlier view of this number.
        slot: u32,
        /// Position of the eye, world space.
        p: Vec3,
        /// Rotation from the camera, which looks along its -z, to world space.
        q: Quat,
        /// Distance from the eye to the point that the view looks at, metres.
        distance: f32,
    },
    /// A finished polygon: a part of `stroke`, or a stroke that has only this polygon. A polygon that is not convex or
    /// not planar is split.
    Polygon {
        #[serde(default)]
        t: f64,
        #[serde(default, skip_serializing_if = "Author::is_sole")]
        author: Author,
        /// The stroke of the polygon. If absent, the polygon becomes a new stroke.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stroke: Option<StrokeId>,
        /// 3 to [`Event::MAX_VERTICES`] corners in order.
        vertices: Vec<Vec3>,
        /// How the polygon is shaded, if it is not flat and plain.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shading: Option<Box<Shading>>,
        /// Red, green, blue, opacity, each 0 to 1, sRGB.
        color: (f32, f32, f32, f32),
    },
}

fn identity() -> Quat {
    Quat::IDENTITY
}

fn full() -> f32 {
    1.0
}

// Default values are not written. The comparison is bit by bit, so that -0.0 is written.
fn is_identity(q: &Quat) -> bool {
    q.to_array().map(f32::to_bits) == Quat::IDENTITY.to_array().map(f32::to_bits)
}

fn is_full(pressure: &f32) -> bool {
    pressure.to_bits() == full().to_bits()
}

fn is_zero(value: &f32) -> bool {
    value.to_bits() == 0
}

impl Event {
    /// The events that add strokes to a group: one event, or several if the strokes do not fit into one line. Only the
    /// first event has the group's name.
    pub fn grouping(
        t: f64,
        group: GroupId,
        strokes: &[StrokeId],
        parent: Option<GroupId>,
        mut name: Option<String>,
    ) -> impl Iterator<Item = Self> {
        let first = strokes.len().min(Self::MAX_STROKES_NAMED);
        let parts =
            std::iter::once(&strokes[..first]).chain(strokes[first..].chunks(Self::MAX_STROKES_NAMED));
        parts.map(move |part| Self::Group {
            author: Author::SOLE,
            t,
            group,
            strokes: part.to_vec(),
            parent,
            name: name.take(),
        })
    }

    /// Largest number of corners of a polygon event.
    pub const MAX_VERTICES: usize = 1024;

    pub const MAX_LAYERS: u32 = 1024;

    pub const MAX_VIEWS: u32 = 64;

    pub const MAX_GROUP_NAME_BYTES: usize = 256;

    /// Largest number of strokes that one event may list. The event then fits into a line, whatever the strokes'
    /// numbers.
    pub const MAX_STROKES_NAMED: usize = (MAX_LINE_BYTES - 2048) / 11;

    pub fn time_secs(&self) -> f64 {
        match *self {
            Self::Join { t, .. }
            | Self::Leave { t, .. }
            | Self::Head { t, .. }
            | Self::Begin { t, .. }
            | Self::Point { t, .. }
            | Self::End { t, .. }
            | Self::Erase { t, .. }
            | Self::Undo { t, .. }
            | Self::Redo { t, .. }
            | Self::Move { t, .. }
            | Self::Group { t, .. }
            | Self::Place { t, .. }
            | Self::Step { t, .. }
            | Self::Layer { t, .. }
            | Self::Assign { t, .. }
            | Self::View { t, .. }
            | Self::Polygon { t, .. } => t,
        }
    }

    /// The event's author; `None` for points and ends. With several authors, the number of their stroke contains the
    /// author ([`StrokeId::author`]).
    pub fn author(&self) -> Option<Author> {
        match *self {
            Self::Join { author, .. }
            | Self::Leave { author, .. }
            | Self::Head { author, .. }
            | Self::Begin { author, .. }
            | Self::Erase { author, .. }
            | Self::Undo { author, .. }
            | Self::Redo { author, .. }
            | Self::Move { author, .. }
            | Self::Group { author, .. }
            | Self::Place { author, .. }
            | Self::Step { author, .. }
            | Self::Layer { author, .. }
            | Self::Assign { author, .. }
            | Self::View { author, .. }
            | Self::Polygon { author, .. } => Some(author),
            Self::Point { .. } | Self::End { .. } => None,
        }
    }

    /// Whether only a recording with several authors can contain the event.
    pub fn names_author(&self) -> bool {
        matches!(self, Self::Join { .. } | Self::Leave { .. } | Self::Layer { mine: Some(_), .. })
            || self.author().is_some_and(|author| !author.is_sole())
    }

    /// Whether the event is a sample of the hand; a replay counts samples for `samples:N`. Finished polygons, moves of
    /// strokes and placements of groups also count as samples.
    pub fn is_sample(&self) -> bool {
        matches!(self, Self::Point { .. } | Self::Polygon { .. } | Self::Move { .. } | Self::Place { .. })
    }

    /// Number of strokes that an edit lists, or of corners of a polygon. The event's memory is proportional to this
    /// number.
    pub fn list_len(&self) -> usize {
        match self {
            Self::Move { strokes, .. } | Self::Group { strokes, .. } | Self::Assign { strokes, .. } => {
                strokes.len()
            }
            Self::Polygon { vertices, shading, .. } => vertices.len() * if shading.is_some() { 3 } else { 1 },
            _ => 0,
        }
    }

    /// Checks that every number is in its range. The error describes the expected form.
    ///
    /// # Errors
    /// A number is not finite or out of its range.
    pub fn check(&self) -> Result<(), &'static str> {
        let finite = |ok: bool, what| if ok { Ok(()) } else { Err(what) };
        finite(self.time_secs().is_finite(), "a finite time")?;
        finite(
            self.author().is_none_or(|author| author.is_valid()),
            "an author below 4096, as many as a session can have",
        )?;
        match self {
            Self::Join { author, name, color, .. } => {
                finite(!author.is_sole(), "an author from 1 to 4095")?;
                finite(name.len() <= Author::MAX_NAME_BYTES, "an author's name of at most 256 bytes")?;
                let is_color = |(r, g, b): (f32, f32, f32)| [r, g, b].iter().all(|c| (0.0..=1.0).contains(c));
                finite(color.is_none_or(is_color), "an author's colour, three numbers from 0 to 1")
            }
            Self::Leave { author, .. } => finite(!author.is_sole(), "an author from 1 to 4095"),
            Self::Head { p, q, .. } => check_pose(*p, *q),
            Self::Point { p, q, pressure, .. } => {
                check_pose(*p, *q)?;
                finite(pressure.is_finite(), "a finite pressure")
            }
            Self::Begin { width, color, thinnest, paint, .. } => {
                paint.as_ref().map_or(Ok(()), |paint| paint.check())?;
                finite((0.0..=COORDINATE_LIMIT_M).contains(width), "a width from 0 to 1e15 m")?;
                finite((0.0..=1.0).contains(thinnest), "`thinnest` between 0 and 1")?;
                check_color(*color)
            }
            Self::Move { by, .. } => check_point(*by),
            Self::Place { to, .. } => {
                check_pose(to.p, to.q)?;
                finite(to.s > 0.0 && to.s <= COORDINATE_LIMIT_M, "a scale above 0, at most 1e15")
            }
            Self::Polygon { vertices, shading, color, .. } => {
                finite((3..=Self::MAX_VERTICES).contains(&vertices.len()), "3 to 1024 vertices")?;
                vertices.iter().try_for_each(|&p| check_point(p))?;
                shading.as_ref().map_or(Ok(()), |shading| shading.check(vertices.len()))?;
                check_color(*color)
            }
            Self::Group { name, .. } => finite(
                name.as_ref().is_none_or(|name| name.len() <= Self::MAX_GROUP_NAME_BYTES),
                "a group's name of at most 256 bytes",
            ),
            Self::Layer { layer, name, .. } => {
                finite(*layer < Self::MAX_LAYERS, "a layer below 1024")?;
                finite(
                    name.as_ref().is_none_or(|name| name.len() <= Self::MAX_GROUP_NAME_BYTES),
                    "a layer's name of at most 256 bytes",
                )
            }
            Self::View { slot, p, q, distance, .. } => {
                check_pose(*p, *q)?;
                finite(*slot < Self::MAX_VIEWS, "a view's number below 64")?;
                finite(
                    *distance > 0.0 && *distance <= COORDINATE_LIMIT_M,
                    "a distance above 0, at most 1e15 m",
                )
            }
            Self::Assign { layer, .. } => finite(*layer < Self::MAX_LAYERS, "a layer below 1024"),
            Self::End { .. }
            | Self::Erase { .. }
            | Self::Undo { .. }
            | Self::Redo { .. }
            | Self::Step { .. } => Ok(()),
        }
    }
}

pub(super) fn check_point(p: Vec3) -> Result<(), &'static str> {
    if p.is_finite() && p.abs().max_element() <= COORDINATE_LIMIT_M {
        Ok(())
    } else {
        Err("finite coordinates below 1e15 m")
    }
}

pub(super) fn check_pose(p: Vec3, q: Quat) -> Result<(), &'static str> {
    check_point(p)?;
    let length_squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (length_squared - 1.0).abs() <= 0.02 { Ok(()) } else { Err("a unit quaternion (x, y, z, w)") }
}

fn check_color((r, g, b, a): (f32, f32, f32, f32)) -> Result<(), &'static str> {
    if [r, g, b, a].iter().all(|c| c.is_finite()) { Ok(()) } else { Err("a finite colour") }
}
