use glam::{Quat, Vec2, Vec3};

use super::{
    navigator::Navigator,
    test_pattern,
    tracker::{Message, Pose},
};
use osp::{
    math::{Aabb, rotate},
    view::{Projection, View},
};
use osp_render::{Channels, LineBatch};
use osp_session::{
    replay::{NEAREST_EYE_M, far_m},
    rig::{Eye, Rig, RoomFromTracker, RoomPlace, Screen, Stereo},
};

/// Near distance of the views on a rig's screens, metres.
const NEAR_M: f32 = 0.02;

/// One picture of a frame: the view of an eye on a screen, and its part of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomView {
    pub view: View,
    /// Index of the rig's screen.
    pub screen: usize,
    pub eye: Eye,
    /// Lower left corner of the picture's part of the window, 0 to 1.
    pub from: Vec2,
    /// Upper right corner of the same part.
    pub to: Vec2,
    /// Colour channels of the window in which the picture is drawn.
    pub channels: Channels,
    /// Whether the eye is behind the screen or too near to it. The view is then from the nearest position in front of
    /// the screen.
    pub is_clamped: bool,
}

/// The screens of a frame: one window on a desk, or the screens of a rig around a tracked head.
#[derive(Clone, Debug, Default)]
pub struct Room {
    rig: Option<Rig>,
    /// Arrangement of the pictures for the two eyes.
    pub stereo: Stereo,
    /// Whether the pictures of the two eyes are exchanged.
    pub swaps_eyes: bool,
    shows_pattern: bool,
}

impl Room {
    pub fn new(rig: Rig) -> Self {
        Self { stereo: rig.stereo, swaps_eyes: rig.swap_eyes, rig: Some(rig), shows_pattern: false }
    }

    /// The rig; `None` for a plain window.
    pub fn rig(&self) -> Option<&Rig> {
        self.rig.as_ref()
    }

    /// Sets the distance between the eyes, metres.
    pub fn set_eye_separation_m(&mut self, separation_m: f32) {
        if let Some(rig) = &mut self.rig {
            rig.eye_separation_m = separation_m.clamp(0.0, 1.0);
        }
    }

    /// Whether the screens of the rig show a test pattern instead of the model.
    pub fn shows_pattern(&self) -> bool {
        self.shows_pattern && self.rig.is_some()
    }

    /// Shows a test pattern (`true`) or the model on the screens of the rig.
    pub fn show_pattern(&mut self, shows: bool) {
        self.shows_pattern = shows;
    }

    /// Sets the transform from tracker space to room space.
    pub fn calibrate(&mut self, room_from_tracker: RoomFromTracker) {
        if let Some(rig) = &mut self.rig {
            rig.room_from_tracker = room_from_tracker;
        }
    }

    pub(super) fn draw_pattern(&self, navigator: &Navigator, view: &RoomView, out: &mut LineBatch) {
        let Some(rig) = &self.rig else { return };
        let place = Self::place(rig, navigator);
        test_pattern::draw(&rig.screens[view.screen], view.screen, view.eye, &|p| place.to_world(p), out);
    }

    /// The eye that gets the picture rendered for `eye`: the other eye if the pictures are exchanged.
    pub(super) fn shown_at(&self, eye: Eye) -> Eye {
        if self.swaps_eyes { eye.other() } else { eye }
    }

    /// The colour channels of the picture that an eye gets.
    pub(super) fn channels_at(&self, shown_at: Eye) -> Channels {
        match (self.stereo, shown_at) {
            (Stereo::Anaglyph, Eye::Left) => Channels::Red,
            (Stereo::Anaglyph, Eye::Right) => Channels::Cyan,
            _ => Channels::All,
        }
    }

    /// Transform of the rig's room to the world. The rig's head position is at the camera, so flying moves the room.
    fn place(rig: &Rig, navigator: &Navigator) -> RoomPlace {
        RoomPlace::around(rig, navigator.eye(), navigator.world_from_view())
    }

    /// Transforms a point from room space to world space.
    pub fn to_world(&self, navigator: &Navigator, p: Vec3) -> Vec3 {
        self.rig.as_ref().map_or(p, |rig| Self::place(rig, navigator).to_world(p))
    }

    /// Transforms a pose, position and orientation, from room space to world space.
    pub fn pose_to_world(&self, navigator: &Navigator, (p, q): Pose) -> Pose {
        (self.to_world(navigator, p), self.turn_to_world(navigator, q))
    }

    fn turn_to_world(&self, navigator: &Navigator, q: Quat) -> Quat {
        self.rig.as_ref().map_or(q, |rig| Self::place(rig, navigator).turn_to_world(q))
    }

    /// The rig's head position, and `world_from_head` transformed to room space; `None` without a rig.
    pub fn head_tilted_like(&self, world_from_head: Quat) -> Option<Pose> {
        let rig = self.rig.as_ref()?;
        Some((rig.head, RoomPlace::around(rig, Vec3::ZERO, world_from_head).turn_to_room(world_from_head)))
    }

    /// A tracker's message with poses transformed to room space.
    pub fn message_to_room(&self, message: Message) -> Message {
        let Some(of_rig) = self.rig.as_ref().map(|rig| rig.room_from_tracker) else { return message };
        message.transformed(|p| of_rig.point(p), |q| of_rig.turn(q))
    }

    /// A message in room space with positions transformed to world space. The head stays in room space, because it
    /// determines the views of the screens.
    pub fn message_to_world(&self, navigator: &Navigator, message: Message) -> Message {
        match message {
            Message::Head { .. } => message,
            _ => message.transformed(|p| self.to_world(navigator, p), |q| self.turn_to_world(navigator, q)),
        }
    }

    /// The views of a frame on a window of this aspect ratio, width divided by height.
    pub fn views(
        &self,
        navigator: &Navigator,
        head: Option<Pose>,
        aspect: f32,
        bounds: &Aabb,
    ) -> Vec<RoomView> {
        let mut views = Vec::new();
        self.views_into(navigator, head, aspect, bounds, &mut views);
        views
    }

    /// Does the same as [`Room::views`], but writes to an existing list.
    pub fn views_into(
        &self,
        navigator: &Navigator,
        head: Option<Pose>,
        aspect: f32,
        bounds: &Aabb,
        out: &mut Vec<RoomView>,
    ) {
        out.clear();
        let eyes = self.stereo.eyes();
        let screens = self.rig.as_ref().map_or(1, |rig| rig.screens.len());
        let on_walls = self.rig.as_ref().is_some_and(Rig::needs_windows);
        for screen in 0..screens {
            for &eye in eyes {
                let shown_at = self.shown_at(eye);
                let here =
                    if on_walls && self.stereo == Stereo::Windows { Stereo::SideBySide } else { self.stereo };
                let (from, to) = here.part_of(shown_at);
                // A copy of a wall's picture has the aspect ratio of the wall.
                let (margin, size) = match &self.rig {
                    Some(rig) if on_walls => fitted(rig.screens[screen].aspect(), aspect / screens as f32),
                    _ => (Vec2::ZERO, Vec2::ONE),
                };
                let corner = |part: [f32; 2]| {
                    let part = margin + size * Vec2::from(part);
                    Vec2::new((screen as f32 + part.x) / screens as f32, part.y)
                };
                let (from, to) = (corner(from), corner(to));
                let channels = self.channels_at(shown_at);
                let seen = match &self.rig {
                    Some(rig) => Self::on_screen(rig, &rig.screens[screen], eye, navigator, head, bounds),
                    None => {
                        let part = (to - from) * Vec2::new(aspect, 1.0);
                        Some((at_desk(eye, navigator, head, part.x / part.y, bounds), false))
                    }
                };
                if let Some((view, is_clamped)) = seen {
                    out.push(RoomView { view, screen, eye, from, to, channels, is_clamped });
                }
            }
        }
    }

    /// The names of the screens that the head is behind, or nearly touches.
    pub fn screens_behind<'a>(&'a self, views: &'a [RoomView]) -> impl Iterator<Item = &'a str> + Clone {
        let screens = self.rig.as_ref().map_or(&[][..], |rig| &rig.screens);
        screens
            .iter()
            .enumerate()
            .filter(|(i, _)| views.iter().any(|view| view.screen == *i && view.is_clamped))
            .map(|(_, screen)| screen.name.as_str())
    }

    fn on_screen(
        rig: &Rig,
        screen: &Screen,
        eye: Eye,
        navigator: &Navigator,
        head: Option<Pose>,
        bounds: &Aabb,
    ) -> Option<(View, bool)> {
        let (head, turn) = head.unwrap_or((rig.head, Quat::IDENTITY));
        let tracked = rig.eye_in_room(eye, head, turn);
        let eye_in_room = screen.in_front(tracked, NEAREST_EYE_M);
        let place = Self::place(rig, navigator);
        let far_m = far_m(place.to_world(eye_in_room), bounds);
        let view = screen.view(eye_in_room, NEAR_M, far_m)?;
        Some((place.view_to_world(view), eye_in_room != tracked))
    }

    /// The view under a point of the window (-1 to 1), and that point on its own screen (-1 to 1).
    pub fn under(&self, views: &[RoomView], at: Vec2) -> Option<(View, Vec2)> {
        let part = at * 0.5 + 0.5;
        let found = views.iter().find(|v| part.cmpge(v.from).all() && part.cmple(v.to).all());
        let found = found.or_else(|| views.first())?;
        let on_screen = (part - found.from) / (found.to - found.from) * 2.0 - 1.0;
        Some((found.view, on_screen))
    }
}

/// The largest rectangle with aspect ratio `aspect`, centred in an area with aspect ratio `into`. Returns its corner
/// and size as fractions of the area.
fn fitted(aspect: f32, into: f32) -> (Vec2, Vec2) {
    let size = Vec2::new((aspect / into).min(1.0), (into / aspect).min(1.0));
    ((Vec2::ONE - size) * 0.5, size)
}

fn at_desk(eye: Eye, navigator: &Navigator, head: Option<Pose>, aspect: f32, bounds: &Aabb) -> View {
    let mut view = navigator.view(aspect, bounds);
    if let Some((p, q)) = head {
        (view.eye_in_world, view.world_from_view) = (p, q);
        view.projection.far_m = view.projection.far_m.max(far_m(p, bounds));
    }
    // An eye separation of a thirtieth of the distance is comfortable. The two pictures coincide at the plane through
    // the centre of the view.
    let distance_m = navigator.distance_m();
    let half_m = distance_m / 60.0;
    let sideways_m = match eye {
        Eye::Left => -half_m,
        Eye::Middle => return view,
        Eye::Right => half_m,
    };
    view.eye_in_world += rotate(view.world_from_view, Vec3::X * sideways_m);
    let shift = sideways_m / distance_m;
    let Projection { left, right, .. } = view.projection;
    view.projection = Projection { left: left - shift, right: right - shift, ..view.projection };
    view
}
