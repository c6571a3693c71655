//! Screens around a tracked head: Robert Kooima, "Generalized Perspective Projection", 2009.
//!
//! A screen is a rectangle in the room, defined by three of its corners. The frustum of an eye is the pyramid from the
//! eye to the rectangle. The frustum's axis is perpendicular to the screen's plane and need not meet the rectangle.
//!
//! Differences from the paper: the projection is stored as the tangents of [`Projection`], not as a matrix. The frustum
//! and the clip matrix are computed from the tangents. An eye on or behind the screen's plane has no view.

use std::{io::ErrorKind, path::Path};

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{Eye, Output, RoomFromTracker, Stereo};
use crate::small_file::read_text;
use osp::math::{COORDINATE_LIMIT_M, rotate};
use osp::view::{Projection, View};

/// Largest number of screens of a rig: a room has six walls, a tiled display a few more screens.
pub(super) const MAX_SCREENS: usize = 16;
/// Largest size of a rig file, bytes. A screen takes a few lines.
const MOST_BYTES: u64 = 1 << 20;
/// Smallest distance of an eye from a screen's plane, metres. A nearer eye has no view, because its frustum would
/// degenerate.
const NEAREST_EYE_M: f32 = 1.0e-3;
/// Largest cosine of the angle between a screen's sides that still counts as a right angle.
const SQUARE: f32 = 1.0e-3;

#[derive(Debug, Error)]
pub enum RigError {
    #[error("{path}: {cause}")]
    Io { path: String, cause: std::io::Error },
    #[error("no rig is called `{0}`, and there is no such file: expected {shipped} or a file that describes a rig", shipped = Rig::shipped().collect::<Vec<_>>().join(", "))]
    Unknown(String),
    /// The text is not a rig. Lines count from 1.
    #[error("{path}, line {line}: expected a rig; {found}")]
    Text { path: String, line: usize, found: String },
    #[error("{place}: expected {expected}")]
    Invalid { place: String, expected: String },
}

/// A rectangle on which the world is shown, room space, metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Screen {
    pub name: String,
    /// Lower left corner, seen from the front.
    pub lower_left: Vec3,
    /// Lower right corner, seen from the front.
    pub lower_right: Vec3,
    /// Upper left corner, seen from the front.
    pub upper_left: Vec3,
    /// Outputs of the screen's picture. Without outputs, the window shows the picture beside those of the other
    /// screens.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<Output>,
}

impl Screen {
    /// Width divided by height.
    pub fn aspect(&self) -> f32 {
        self.lower_left.distance(self.lower_right) / self.lower_left.distance(self.upper_left)
    }

    /// The vectors from the lower left corner to the lower right and to the upper left corner, room space.
    pub fn sides(&self) -> (Vec3, Vec3) {
        (self.lower_right - self.lower_left, self.upper_left - self.lower_left)
    }

    /// The normal that points to the front of the screen, room space.
    pub fn towards_eye(&self) -> Vec3 {
        let (along, upwards) = self.sides();
        along.normalize_or_zero().cross(upwards.normalize_or_zero()).normalize_or_zero()
    }

    /// The eye, in room space. If it is behind the screen's plane or nearer than `least_m` metres, it is moved to this
    /// distance in front of the plane.
    pub fn in_front(&self, eye: Vec3, least_m: f32) -> Vec3 {
        let towards_eye = self.towards_eye();
        let distance_m = (eye - self.lower_left).dot(towards_eye);
        if distance_m >= least_m { eye } else { eye + towards_eye * (least_m - distance_m) }
    }

    /// The view of an eye through the screen, both in room space; `None` if the eye is not in front of the screen.
    pub fn view(&self, eye: Vec3, near_m: f32, far_m: f32) -> Option<View> {
        let (along, upwards) = self.sides();
        let (right, up) = (along.normalize_or_zero(), upwards.normalize_or_zero());
        let towards_eye = self.towards_eye();
        let to_corner = self.lower_left - eye;
        let distance_m = -to_corner.dot(towards_eye);
        if distance_m.is_nan() || distance_m < NEAREST_EYE_M {
            return None;
        }
        let left = to_corner.dot(right) / distance_m;
        let bottom = to_corner.dot(up) / distance_m;
        let projection = Projection {
            left,
            right: left + along.length() / distance_m,
            bottom,
            top: bottom + upwards.length() / distance_m,
            near_m,
            far_m,
        };
        let world_from_view = Quat::from_rotation_axes(right, up, towards_eye).normalize();
        Some(View { eye_in_world: eye, world_from_view, projection })
    }

    fn check(&self) -> Result<(), &'static str> {
        let corners = [self.lower_left, self.lower_right, self.upper_left];
        if corners.iter().any(|p| !(p.is_finite() && p.abs().max_element() <= COORDINATE_LIMIT_M)) {
            return Err("corners with coordinates up to 1e15 m");
        }
        let right = (self.lower_right - self.lower_left).normalize_or_zero();
        let up = (self.upper_left - self.lower_left).normalize_or_zero();
        if right == Vec3::ZERO || up == Vec3::ZERO {
            return Err("three different corners");
        }
        if right.dot(up).abs() > SQUARE { Err("corners at right angles") } else { Ok(()) }
    }
}

/// Screens around one tracked head. Room space equals tracker space, unless `room_from_tracker` is set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    pub name: String,
    pub screens: Vec<Screen>,
    /// Distance between the eyes, metres.
    #[serde(default = "usual_eye_separation_m")]
    pub eye_separation_m: f32,
    #[serde(default)]
    pub stereo: Stereo,
    /// Position of the head until a tracker sends one, room space.
    pub head: Vec3,
    /// Whether the eyes' pictures are exchanged, for glasses or projectors that exchange left and right.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub swap_eyes: bool,
    #[serde(default, skip_serializing_if = "RoomFromTracker::is_identity")]
    pub room_from_tracker: RoomFromTracker,
}

fn usual_eye_separation_m() -> f32 {
    0.064
}

const SHIPPED: &[(&str, &str)] = &[
    ("desktop", include_str!("rigs/desktop.ron")),
    ("dual-wall", include_str!("rigs/dual-wall.ron")),
    ("cave4", include_str!("rigs/cave4.ron")),
];

impl Rig {
    /// The names of the rigs that come with the program.
    pub fn shipped() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// The shipped rig of this name, or the rig in this file.
    ///
    /// # Errors
    /// The file cannot be read or is not a rig.
    pub fn open(name_or_path: &str) -> Result<Self, RigError> {
        if let Some((name, text)) = SHIPPED.iter().find(|(name, _)| *name == name_or_path) {
            return Self::parse(text, name);
        }
        let text = read_text(Path::new(name_or_path), MOST_BYTES).map_err(|cause| match cause.kind() {
            ErrorKind::NotFound => RigError::Unknown(name_or_path.to_owned()),
            _ => RigError::Io { path: name_or_path.to_owned(), cause },
        })?;
        Self::parse(&text, name_or_path)
    }

    /// Parses a rig; `path` is the name of the text in errors.
    ///
    /// # Errors
    /// The text is not a rig, or a number in it is invalid.
    pub fn parse(text: &str, path: &str) -> Result<Self, RigError> {
        let rig: Self = ron::from_str(text).map_err(|error| RigError::Text {
            path: path.to_owned(),
            line: error.span.start.line,
            found: error.code.to_string(),
        })?;
        rig.check(path)?;
        Ok(rig)
    }

    fn check(&self, place: &str) -> Result<(), RigError> {
        let invalid = |expected: String| Err(RigError::Invalid { place: place.to_owned(), expected });
        if self.screens.is_empty() || self.screens.len() > MAX_SCREENS {
            return invalid(format!("1 to {MAX_SCREENS} screens"));
        }
        if !(0.0..=1.0).contains(&self.eye_separation_m) {
            return invalid("an eye separation of 0 to 1 m".to_owned());
        }
        if !(self.head.is_finite() && self.head.abs().max_element() <= COORDINATE_LIMIT_M) {
            return invalid("a place of the head with coordinates up to 1e15 m".to_owned());
        }
        for screen in &self.screens {
            if let Err(expected) = screen.check() {
                return invalid(format!("{expected} of screen `{}`", screen.name));
            }
        }
        if let Err(expected) = self.room_from_tracker.check() {
            return invalid(format!("{expected} in room_from_tracker"));
        }
        let mut outputs = Vec::new();
        for (i, screen) in self.screens.iter().enumerate() {
            if self.screens[..i].iter().any(|other| other.name == screen.name) {
                return invalid(format!("names of screens that differ; two are called `{}`", screen.name));
            }
            outputs.extend(screen.outputs.iter().map(|output| (screen.name.as_str(), output)));
        }
        Output::check(&outputs, self.stereo).or_else(invalid)?;
        for screen in self.screens.iter().filter(|screen| !screen.outputs.is_empty()) {
            let is_shown = |eye: &&Eye| screen.outputs.iter().any(|output| output.shows(**eye));
            if let Some(eye) = self.stereo.eyes().iter().find(|eye| !is_shown(eye)) {
                return invalid(format!(
                    "an output for the {} among the outputs of screen `{}`",
                    eye.name(),
                    screen.name
                ));
            }
        }
        Ok(())
    }

    /// Whether the rig's screens are shown in separate windows.
    pub fn needs_windows(&self) -> bool {
        self.stereo == Stereo::Windows || self.screens.iter().any(|screen| !screen.outputs.is_empty())
    }

    /// Returns the rig with another arrangement of the pictures for two eyes.
    ///
    /// # Errors
    /// The rig's outputs do not fit the arrangement.
    pub fn with_stereo(self, stereo: Stereo) -> Result<Self, RigError> {
        let rig = Self { stereo, ..self };
        rig.check(&format!("rig `{}` with stereo {}", rig.name, stereo.name()))?;
        Ok(rig)
    }

    /// Position of an eye, for a head at `head`; room space.
    pub fn eye_in_room(&self, eye: Eye, head: Vec3, room_from_head: Quat) -> Vec3 {
        let sideways = match eye {
            Eye::Left => -0.5,
            Eye::Middle => 0.0,
            Eye::Right => 0.5,
        };
        head + rotate(room_from_head, Vec3::X * (sideways * self.eye_separation_m))
    }
}
