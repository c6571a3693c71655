//! The windows that cover a rig's monitors, and the pictures in them.

use super::room::{Room, RoomView};
use osp_render::Channels;
use osp_session::rig::{Eye, Eyes, Output, Stereo, Viewport};

/// A window of a rig, which covers a monitor or is a plain window.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wall {
    /// The monitor by its name or number; `None` for a plain window.
    pub(super) monitor: Option<String>,
    pub(super) title: String,
    /// Aspect ratio, width divided by height, of the first screen on the wall.
    pub(super) aspect: f32,
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq)]
struct Part {
    screen: usize,
    output: Output,
}

/// The walls of a room's rig; empty without a rig.
pub(super) fn walls(room: &Room) -> Vec<Wall> {
    let Some(rig) = room.rig() else { return Vec::new() };
    let mut walls: Vec<Wall> = Vec::new();
    for (number, screen) in rig.screens.iter().enumerate() {
        for output in &screen.outputs {
            let part = Part { screen: number, output: output.clone() };
            match walls.iter_mut().find(|wall| wall.monitor.as_ref() == Some(&output.monitor)) {
                Some(wall) => {
                    wall.title += &format!(", {}", screen.name);
                    wall.parts.push(part);
                }
                None => walls.push(Wall {
                    monitor: Some(output.monitor.clone()),
                    title: format!("osp wall: {}", screen.name),
                    aspect: screen.aspect(),
                    parts: vec![part],
                }),
            }
        }
    }
    if walls.is_empty() && rig.stereo == Stereo::Windows {
        for (number, screen) in rig.screens.iter().enumerate() {
            for &eye in rig.stereo.eyes() {
                let eyes = if eye == Eye::Left { Eyes::Left } else { Eyes::Right };
                let output = Output { monitor: String::new(), viewport: Viewport::WHOLE, eyes };
                walls.push(Wall {
                    monitor: None,
                    title: format!("osp wall: {}, {}", screen.name, eye.name()),
                    aspect: screen.aspect(),
                    parts: vec![Part { screen: number, output }],
                });
            }
        }
    }
    walls
}

impl Wall {
    /// The part of the window that shows a view, and its colour channels; `None` if the window does not show the view.
    pub(super) fn place_of(&self, room: &Room, view: &RoomView) -> Option<(Viewport, Channels)> {
        let shown_at = room.shown_at(view.eye);
        let part = self.parts.iter().find(|part| {
            part.screen == view.screen && (view.eye == Eye::Middle || part.output.shows(shown_at))
        })?;
        let channels = if part.output.eyes == Eyes::Both { view.channels } else { Channels::All };
        Some((part.output.place_of(room.stereo, shown_at), channels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigator::Navigator;
    use osp::math::Aabb;
    use osp_session::rig::Rig;

    fn room(text: &str) -> Room {
        Room::new(Rig::parse(text, "r.ron").expect("a rig"))
    }

    fn views(room: &Room) -> Vec<RoomView> {
        room.views(&Navigator::default(), None, 1.5, &Aabb::EMPTY)
    }

    const LEFT: &str = "lower_left: (-1,0,0), lower_right: (0,0,-1), upper_left: (-1,1,0)";
    const RIGHT: &str = "lower_left: (0,0,-1), lower_right: (1,0,0), upper_left: (0,1,-1)";

    #[test]
    fn screens_on_one_monitor_share_a_window_by_their_viewports() {
        let mut room = room(&format!(
            "(name: \"r\", head: (0,0.5,0), stereo: TopBottom, screens: [\
             (name: \"a\", {LEFT}, outputs: [(monitor: \"2\", viewport: (0, 0, 0.5, 1))]),\
             (name: \"b\", {RIGHT}, outputs: [(monitor: \"2\", viewport: (0.5, 0, 0.5, 1)), (monitor: \"3\")])])"
        ));
        let walls = walls(&room);
        assert_eq!(walls.len(), 2);
        assert_eq!([&walls[0].title, &walls[1].title], ["osp wall: a, b", "osp wall: b"]);
        let places = |room: &Room, wall: usize| -> Vec<Option<Viewport>> {
            views(room).iter().map(|view| walls[wall].place_of(room, view).map(|(place, _)| place)).collect()
        };
        let upper = |x: f32, width: f32| Some(Viewport(x, 0.0, width, 0.5));
        let lower = |x: f32, width: f32| Some(Viewport(x, 0.5, width, 0.5));
        assert_eq!(places(&room, 0), [upper(0.0, 0.5), lower(0.0, 0.5), upper(0.5, 0.5), lower(0.5, 0.5)]);
        assert_eq!(places(&room, 1), [None, None, upper(0.0, 1.0), lower(0.0, 1.0)]);
        room.swaps_eyes = true;
        assert_eq!(places(&room, 0), [lower(0.0, 0.5), upper(0.0, 0.5), lower(0.5, 0.5), upper(0.5, 0.5)]);
    }

    #[test]
    fn each_eye_has_its_own_projector() {
        let mut room = room(&format!(
            "(name: \"r\", head: (0,0.5,0), stereo: Windows, screens: [(name: \"a\", {LEFT}, outputs: \
             [(monitor: \"DP-1\", eyes: Left), (monitor: \"DP-2\", eyes: Right)])])"
        ));
        let of = walls(&room);
        let shown = |room: &Room| -> Vec<[bool; 2]> {
            let whole = Some((Viewport::WHOLE, Channels::All));
            let shown = |view| [&of[0], &of[1]].map(|wall| wall.place_of(room, view) == whole);
            views(room).iter().map(shown).collect()
        };
        assert_eq!(shown(&room), [[true, false], [false, true]]);
        room.swaps_eyes = true;
        assert_eq!(shown(&room), [[false, true], [true, false]]);
        // With one picture for both eyes, both projectors show it.
        room.stereo = Stereo::Mono;
        assert_eq!(shown(&room), [[true, true]]);
    }

    #[test]
    fn without_outputs_there_are_windows_only_where_stereo_asks_for_them() {
        let text = format!(
            "(name: \"r\", head: (0,0.5,0), screens: [(name: \"a\", {LEFT}), (name: \"b\", {RIGHT})])"
        );
        assert!(walls(&room(&text)).is_empty());
        let rig = Rig::parse(&text, "r.ron").expect("a rig").with_stereo(Stereo::Windows).expect("a rig");
        let room = Room::new(rig);
        let of = walls(&room);
        assert_eq!(of.len(), 4);
        for (wall, i) in of.iter().zip(0..) {
            let places: Vec<_> = views(&room).iter().map(|view| wall.place_of(&room, view)).collect();
            assert_eq!(places.iter().position(Option::is_some), Some(i));
            assert_eq!(places.iter().flatten().count(), 1);
        }
        assert!(walls(&Room::default()).is_empty());
    }

    #[test]
    fn swapped_eyes_change_places_and_colours_but_not_where_they_are() {
        let text =
            format!("(name: \"r\", head: (0,0.5,0), stereo: Anaglyph, screens: [(name: \"a\", {LEFT})])");
        let mut room = room(&text);
        let before = views(&room);
        room.swaps_eyes = true;
        let after = views(&room);
        assert_eq!([before[0].channels, after[0].channels], [Channels::Red, Channels::Cyan]);
        assert_eq!(before[0].view, after[0].view);
        room.set_eye_separation_m(0.5);
        let wider = views(&room);
        let apart = |views: &[RoomView]| views[0].view.eye_in_world.distance(views[1].view.eye_in_world);
        assert!((apart(&after) - 0.064).abs() < 1.0e-5 && (apart(&wider) - 0.5).abs() < 1.0e-5);
    }
}
