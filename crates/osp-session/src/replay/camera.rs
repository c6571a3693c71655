use std::f64::consts::TAU;

use glam::{Quat, Vec3};

use crate::{
    recording::{Author, Camera, Event},
    scene::Scene,
};
use osp::{
    math::{Aabb, rotate, unit},
    view::{Projection, View},
};

/// Vertical field of view of the cameras that the recording does not specify, degrees.
const FOV_DEGREES: f32 = 60.0;
/// Aspect ratio, width divided by height, of every replay camera.
const ASPECT: f32 = 16.0 / 9.0;
/// Default direction from the model's centre to the eye of [`whole_view`]: in front, to the right and above.
const WHOLE_FROM: Vec3 = Vec3::new(0.45, ABOVE, 1.0);
/// Height of the eye above the model, divided by the horizontal distance.
const ABOVE: f32 = 0.35;
/// Factor of the eye's smallest distance. It leaves a narrow margin around the model.
const WHOLE_MARGIN: f32 = 1.04;
/// Number of frames of a full circle of the orbiting cameras.
const FRAMES_A_ROUND: f64 = 720.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraChoice {
    /// The recorded head path if the session has one, else the session's own camera, else [`CameraChoice::Orbit`].
    Auto,
    /// A circle around the whole model, looking at its centre; nearly the whole model is in view.
    Orbit,
    /// Behind the hand, looking at the current stroke.
    Follow,
    /// At the centre of the model, rotating; about a sixth of the model is in view.
    Inside,
}

impl CameraChoice {
    pub const ALL: &'static [Self] = &[Self::Auto, Self::Orbit, Self::Follow, Self::Inside];

    /// The choice's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Orbit => "orbit",
            Self::Follow => "follow",
            Self::Inside => "inside",
        }
    }
}

/// The poses of head and hand in a frame, from which a camera follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    pub frame: u64,
    /// Latest head pose: position, and rotation to world space.
    pub head: Option<(Vec3, Quat)>,
    pub hand: Option<Vec3>,
    /// The author whose head and hand are stored: the first with a head pose since the start, or since the previous
    /// author left. `None` before this pose.
    pub author: Option<Author>,
}

impl Moment {
    pub fn note(&mut self, event: &Event) {
        match event {
            Event::Head { p, q, author, .. } if *self.author.get_or_insert(*author) == *author => {
                self.head = Some((*p, unit(*q)));
            }
            Event::Point { p, stroke, .. } if self.is_followed(stroke.author()) => self.hand = Some(*p),
            Event::Polygon { vertices, author, .. } if self.is_followed(*author) => {
                self.hand = vertices.first().copied();
            }
            Event::Leave { author, .. } if self.author == Some(*author) => self.author = None,
            _ => {}
        }
    }

    /// Whether the camera follows this author of a stroke. With a sole author it follows every stroke, because their
    /// numbers do not contain the author.
    fn is_followed(&self, author: Author) -> bool {
        self.author.is_none_or(|followed| followed.is_sole() || followed == author)
    }
}

/// The side from which an artist begins a model, usually the model's front. The mean side over all samples is a worse
/// guess, because an artist who walks around a model draws much of its back. The side of the last samples is worse,
/// too.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArtistSide {
    moment: Moment,
    /// Sum of the directions from the model to the eye at the first samples.
    sum_to_eye: Vec3,
    samples: u32,
}

impl ArtistSide {
    /// Number of samples that count as the beginning: a few strokes, half a minute of continuous drawing.
    const BEGINNING: u32 = 1_000;

    pub fn note(&mut self, event: &Event) {
        self.moment.note(event);
        let is_sample = matches!(event, Event::Point { .. } | Event::Polygon { .. });
        if let Some((_, q)) = self.moment.head.filter(|_| is_sample && self.samples < Self::BEGINNING) {
            self.sum_to_eye += rotate(q, Vec3::Z);
            self.samples += 1;
        }
    }

    /// The direction from the model to the eye of the session's own camera. Without a camera, it is the direction to
    /// the artist: the mean over the first samples, or the latest head pose, if no sample follows any pose. The
    /// direction to the artist is slightly raised from the horizontal, whatever the tilt of the head. `None` without
    /// camera and head pose.
    pub fn direction_to_artist(&self, camera: Option<Camera>) -> Option<Vec3> {
        if let Some(camera) = camera {
            return Some(rotate(unit(camera.q), Vec3::Z));
        }
        let (_, q) = self.moment.head?;
        let back = if self.samples > 0 { self.sum_to_eye } else { rotate(q, Vec3::Z) };
        Some(Vec3::new(back.x, ABOVE * back.with_y(0.0).length(), back.z))
    }
}

/// The main part of `bounds`, world space, metres. It excludes polygons far from all others, such as stray particles.
/// Along each axis it spans the polygons' centres between the first and the 99th percentile. A margin of half of its
/// longest side is added on all sides. O(polygons) in time and memory.
pub fn main_bounds(scene: &Scene, bounds: &Aabb) -> Aabb {
    let middles: Vec<Vec3> = scene.visible_ids().map(|id| scene.bounds(id).center()).collect();
    let Some(last) = middles.len().checked_sub(1) else { return *bounds };
    let strays = middles.len() / 100;
    let mut along: Vec<f32> = Vec::with_capacity(middles.len());
    let mut ends = |axis: usize| {
        along.clear();
        along.extend(middles.iter().map(|middle| middle[axis]));
        [strays, last - strays].map(|place| *along.select_nth_unstable_by(place, f32::total_cmp).1)
    };
    let [x, y, z] = [0, 1, 2].map(&mut ends);
    let (low, high) = (Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]));
    let room = 0.5 * (high - low).max_element();
    let main = Aabb { min: bounds.min.max(low - room), max: bounds.max.min(high + room) };
    // If the box of the centres has no extent, all of `bounds` is shown.
    if room > 0.0 && main.min.cmple(main.max).all() { main } else { *bounds }
}

/// Whether the middles of at least half of the visible polygons lie in the view. O(polygons).
pub fn sees_most(view: &View, scene: &Scene) -> bool {
    let frustum = view.frustum();
    let mut balance = 0i64;
    for id in scene.visible_ids() {
        balance += if frustum.may_see(&Aabb::from_points(&[scene.bounds(id).center()])) { 1 } else { -1 };
    }
    balance >= 0
}

/// A view that shows all of `bounds` on a screen of this `aspect` (width divided by height). `to_eye` is the direction
/// from the model to the eye. If absent, the eye is in front of the model.
pub fn whole_view(bounds: &Aabb, to_eye: Option<Vec3>, aspect: f32) -> View {
    let path = CameraPath::new(CameraChoice::Orbit, None, bounds);
    let away = to_eye.unwrap_or(WHOLE_FROM).normalize_or(Vec3::Z);
    let towards =
        View::look_at(path.center + away, path.center, Projection::symmetric(FOV_DEGREES, aspect, 1.0, 2.0));
    let [right, up] = [Vec3::X, Vec3::Y].map(|axis| rotate(towards.world_from_view, axis));
    let Projection { right: tan_x, top: tan_y, .. } = towards.projection;
    let half = if bounds.is_empty() { Vec3::splat(path.radius_m) } else { bounds.extent() * 0.5 };
    // At this distance, every corner of the box lies within the four side planes of the frustum.
    let mut distance_m = 0.0f32;
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let p = half * Vec3::new(sign(0), sign(1), sign(2));
        let beside = (p.dot(right).abs() / tan_x).max(p.dot(up).abs() / tan_y);
        distance_m = distance_m.max(p.dot(away) + beside);
    }
    let eye = path.center + away * (distance_m.max(path.radius_m * 1.0e-2) * WHOLE_MARGIN);
    let projection = Projection { near_m: 1.0e-3 * path.radius_m, ..towards.projection };
    let far_m = eye.distance(path.center) + 2.0 * path.radius_m;
    View { eye_in_world: eye, projection: Projection { far_m, ..projection }, ..towards }
}

/// Returns the view for a picture of a whole session: the view of its own camera, else a view of the model's [main
/// part](main_bounds). `to_eye` is the direction from the model to the eye, and `bounds` are those of the session.
/// O(polygons).
pub fn still_view(
    scene: &Scene,
    bounds: &Aabb,
    camera: Option<Camera>,
    to_eye: Option<Vec3>,
    aspect: f32,
) -> View {
    if camera.is_none() {
        return whole_view(&main_bounds(scene, bounds), to_eye, aspect);
    }
    // The moment has no head pose, because a head pose would take precedence over the session's own camera.
    CameraPath::new(CameraChoice::Auto, camera, bounds).view(&Moment::default()).with_aspect(aspect)
}

#[derive(Clone, Copy, Debug)]
pub struct CameraPath {
    choice: CameraChoice,
    fixed: Option<Camera>,
    center: Vec3,
    radius_m: f32,
}

impl CameraPath {
    /// A camera path for a session. `bounds` are the bounds of its polygons, and `fixed` is its own camera.
    pub fn new(choice: CameraChoice, fixed: Option<Camera>, bounds: &Aabb) -> Self {
        let (center, radius_m) = if bounds.is_empty() {
            (Vec3::ZERO, 1.0)
        } else {
            (bounds.center(), bounds.extent().length() * 0.5)
        };
        // A session without extent gets a small radius, so that the eye has a distance.
        let radius_m = if radius_m.is_finite() { radius_m.max(1.0e-4) } else { 1.0 };
        Self { choice, fixed, center, radius_m }
    }

    pub fn view(&self, moment: &Moment) -> View {
        match self.choice {
            CameraChoice::Auto => match (moment.head, self.fixed) {
                (Some((p, q)), _) => self.posed(p, q, FOV_DEGREES, 0.02),
                (None, Some(camera)) => {
                    let near_m = camera.near_m.unwrap_or(1.0e-3 * self.radius_m);
                    self.posed(camera.p, unit(camera.q), camera.fov_degrees, near_m)
                }
                (None, None) => self.orbit(moment.frame),
            },
            CameraChoice::Orbit => self.orbit(moment.frame),
            CameraChoice::Follow => self.follow(moment),
            CameraChoice::Inside => self.inside(moment.frame),
        }
    }

    fn projection(&self, fov_degrees: f32, near_m: f32, eye: Vec3) -> Projection {
        // The far distance is large enough for the whole model, wherever the eye is.
        let far_m = eye.distance(self.center) + 2.0 * self.radius_m;
        Projection::symmetric(fov_degrees, ASPECT, near_m, far_m.max(near_m * 100.0))
    }

    fn posed(&self, eye: Vec3, world_from_view: Quat, fov_degrees: f32, near_m: f32) -> View {
        View { eye_in_world: eye, world_from_view, projection: self.projection(fov_degrees, near_m, eye) }
    }

    fn on_circle(frame: u64) -> Vec3 {
        let angle = frame as f64 / FRAMES_A_ROUND * TAU;
        Vec3::new(libm::sin(angle) as f32, 0.0, libm::cos(angle) as f32)
    }

    fn orbit(&self, frame: u64) -> View {
        // From 1 / sin(30 degrees) = 2 radii the whole bounding sphere fits into a 60 degree view.
        let eye = self.center + (Self::on_circle(frame) + Vec3::Y * 0.3) * (1.9 * self.radius_m);
        let projection = self.projection(FOV_DEGREES, 1.0e-3 * self.radius_m, eye);
        View::look_at(eye, self.center, projection)
    }

    fn inside(&self, frame: u64) -> View {
        let projection = self.projection(FOV_DEGREES, 1.0e-3 * self.radius_m, self.center);
        View::look_at(self.center, self.center + Self::on_circle(frame), projection)
    }

    fn follow(&self, moment: &Moment) -> View {
        let hand = moment.hand.unwrap_or(self.center);
        let away = match moment.head {
            Some((_, q)) => rotate(q, Vec3::Z),
            None => Self::on_circle(moment.frame) + Vec3::Y * 0.3,
        };
        let eye = hand + away * (0.4 * self.radius_m);
        View::look_at(eye, hand, self.projection(FOV_DEGREES, 1.0e-3 * self.radius_m, eye))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene_of(middles: impl Iterator<Item = Vec3>) -> (Scene, Aabb) {
        let (mut scene, mut changes) = (Scene::new(), Vec::new());
        let mut bounds = Aabb::EMPTY;
        for p in middles {
            let vertices = vec![p, p + Vec3::X * 0.01, p + Vec3::Y * 0.01];
            let polygon = Event::Polygon {
                author: Author::SOLE,
                t: 0.0,
                stroke: None,
                vertices,
                shading: None,
                color: (1.0, 1.0, 1.0, 1.0),
            };
            scene.apply(&polygon, &mut changes);
        }
        for id in scene.visible_ids() {
            bounds = bounds.union(&scene.bounds(id));
        }
        (scene, bounds)
    }

    #[test]
    fn strays_do_not_make_a_model_small() {
        let row = || (0..300).map(|i| Vec3::new(i as f32 * 0.01, 0.0, 0.0));
        let (scene, bounds) = scene_of(row());
        assert_eq!(main_bounds(&scene, &bounds), bounds, "nothing is far off");
        let (scene, all) = scene_of(row().chain([Vec3::new(900.0, 0.0, 0.0), Vec3::new(0.0, -50.0, 0.0)]));
        let main = main_bounds(&scene, &all);
        assert!(main.max.x < 5.0 && main.min.y > -2.0, "{main:?}");
        assert!(main.min.cmple(bounds.min).all() && main.max.cmpge(bounds.max).all(), "all else is within");
        assert_eq!(main_bounds(&Scene::new(), &all), all);
    }
}
