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
    /// The file cannot be read.
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
            return Err("finite corners");
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
    /// Arrangement of the pictures for the two eyes.
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
            return invalid("a finite place for the head".to_owned());
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4;

    fn to_screen(view: &View, p: Vec3) -> Vec3 {
        let clip: Vec4 = view.clip_from_world() * p.extend(1.0);
        clip.truncate() / clip.w
    }

    #[test]
    fn the_corners_of_a_screen_are_the_corners_of_its_picture() {
        for name in Rig::shipped() {
            let rig = Rig::open(name).expect("a shipped rig");
            for head in [rig.head, rig.head + Vec3::new(0.11, -0.07, 0.05)] {
                for screen in &rig.screens {
                    let eye = rig.eye_in_room(Eye::Left, head, Quat::IDENTITY);
                    let view = screen.view(eye, 0.01, 100.0).expect("the head stands before every screen");
                    let corners = [
                        (screen.lower_left, -1.0, -1.0),
                        (screen.lower_right, 1.0, -1.0),
                        (screen.upper_left, -1.0, 1.0),
                    ];
                    for (corner, x, y) in corners {
                        let seen = to_screen(&view, corner);
                        assert!((seen.x - x).abs() < 1.0e-4 && (seen.y - y).abs() < 1.0e-4, "{name}: {seen}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_straight_look_at_the_middle_is_the_symmetric_projection() {
        let screen = Screen {
            name: String::new(),
            lower_left: Vec3::new(-1.0, -0.5, -2.0),
            lower_right: Vec3::new(1.0, -0.5, -2.0),
            upper_left: Vec3::new(-1.0, 0.5, -2.0),
            outputs: Vec::new(),
        };
        let view = screen.view(Vec3::ZERO, 0.1, 10.0).expect("a view");
        let fov_degrees = 2.0 * (0.25f32).atan().to_degrees();
        let plain = Projection::symmetric(fov_degrees, 2.0, 0.1, 10.0);
        assert!((view.projection.right - plain.right).abs() < 1.0e-6);
        assert!((view.projection.bottom - plain.bottom).abs() < 1.0e-6);
        assert!(view.forward_in_world().distance(Vec3::NEG_Z) < 1.0e-6);
    }

    #[test]
    fn neighbouring_screens_meet_at_their_common_edge() {
        let rig = Rig::open("dual-wall").expect("a shipped rig");
        let [a, b] = &rig.screens[..] else { panic!("two screens") };
        assert!(a.lower_right.distance(b.lower_left) < 1.0e-6, "they share an edge");
        let (a_along, b_along) = (a.lower_right - a.lower_left, b.lower_right - b.lower_left);
        assert!(a_along.dot(b_along).abs() < 1.0e-4, "at a right angle");
        let eye = rig.head;
        let on_edge = a.lower_right + Vec3::Y * 0.7;
        let (in_a, in_b) = (
            to_screen(&a.view(eye, 0.01, 100.0).expect("a view"), on_edge),
            to_screen(&b.view(eye, 0.01, 100.0).expect("a view"), on_edge),
        );
        assert!((in_a.x - 1.0).abs() < 1.0e-4 && (in_b.x + 1.0).abs() < 1.0e-4, "{in_a} {in_b}");
        assert!((in_a.y - in_b.y).abs() < 1.0e-4);
    }

    #[test]
    fn an_eye_behind_or_on_a_screen_sees_nothing() {
        let rig = Rig::open("desktop").expect("a shipped rig");
        let screen = &rig.screens[0];
        assert!(screen.view(screen.lower_left, 0.01, 10.0).is_none());
        assert!(screen.view(screen.lower_left + Vec3::NEG_Z, 0.01, 10.0).is_none());
        assert!(screen.view(Vec3::NAN, 0.01, 10.0).is_none());
    }

    #[test]
    fn wrong_rigs_are_refused_with_a_reason() {
        let screen = "(name: \"a\", lower_left: (0,0,0), lower_right: (1,0,0), upper_left: (0,1,0))";
        let rig = |screens: &str, more: &str| {
            Rig::parse(&format!("(name: \"r\", head: (0,0,1), screens: [{screens}]{more})"), "r.ron")
        };
        assert!(rig(screen, "").is_ok());
        let reason = |outcome: Result<Rig, RigError>| outcome.expect_err("a wrong rig").to_string();
        assert!(reason(rig("", "")).contains("1 to 16 screens"));
        assert!(reason(rig(&screen.replace("(1,0,0)", "(1,1,0)"), "")).contains("right angles"));
        assert!(reason(rig(&screen.replace("(1,0,0)", "(0,0,0)"), "")).contains("different corners"));
        assert!(reason(rig(&screen.replace("(1,0,0)", "(inf,0,0)"), "")).contains("finite"));
        assert!(reason(rig(screen, ", eye_separation_m: -1")).contains("eye separation"));
        assert!(reason(rig(screen, ",\n\n huh: 1")).contains("line 3"));
        assert!(
            reason(rig(screen, ", room_from_tracker: (p: (0,0,0), q: (0,0,0,2))"))
                .contains("unit quaternion")
        );
        let on = |outputs: &str| {
            screen.replace("upper_left: (0,1,0)", &format!("upper_left: (0,1,0), outputs: [{outputs}]"))
        };
        assert!(rig(&on("(monitor: \"1\"), (monitor: \"2\")"), "").is_ok());
        for (outputs, more, expected) in [
            ("(monitor: \" \")", "", "name or number of a monitor in the outputs of screen `a`"),
            ("(monitor: \"1\", viewport: (0.5, 0, 0.6, 1))", "", "a viewport"),
            ("(monitor: \"1\", viewport: (0, 0, 0, 1))", "", "a viewport"),
            ("(monitor: \"1\", viewport: (0, 0, inf, 1))", "", "a viewport"),
            ("(monitor: \"1\", eyes: Left)", "", "no `eyes`"),
            ("(monitor: \"1\")", ", stereo: Windows", "`eyes: Left` or `eyes: Right`"),
            ("(monitor: \"1\", eyes: Left)", ", stereo: Windows", "an output for the right eye"),
            ("(monitor: \"1\", eyes: Right)", ", stereo: SideBySide", "an output for the left eye"),
            (
                "(monitor: \"1\"), (monitor: \"1\", viewport: (0.5, 0.5, 0.5, 0.5))",
                "",
                "share a part of monitor `1`",
            ),
        ] {
            let said = reason(rig(&on(outputs), more));
            assert!(said.contains(expected), "{said}");
        }
        assert!(
            reason(rig(&format!("{screen}, {screen}"), ""))
                .contains("r.ron: expected names of screens that differ")
        );
        let halves =
            "(monitor: \"1\", viewport: (0, 0, 0.5, 1)), (monitor: \"1\", viewport: (0.5, 0, 0.5, 1))";
        assert!(rig(&on(halves), "").is_ok());
        assert!(reason(Rig::open("no/such/rig.ron")).contains("no/such/rig.ron"));
    }
}
