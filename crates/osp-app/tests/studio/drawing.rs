use std::path::Path;

use osp::{
    glam::{Vec2, Vec3},
    occlusion::Occlusion,
};
use osp_app::{Autosaves, Button, Command, Held, Input, Session, Snap, Studio, ToolChoice};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Pace, StrokeId, Tool},
    replay::CameraChoice,
};

const SIZE_PX: Vec2 = Vec2::new(800.0, 600.0);

pub(crate) struct Table {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) studio: Studio,
}

impl Table {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let autosaves = Autosaves::new(Some(folder.path().to_owned()));
        let mut studio = Studio::new(Session::new(&autosaves), autosaves, IndexKind::Osp);
        studio.frame(SIZE_PX, 0.0);
        Self { folder, studio }
    }

    pub(crate) fn input(&mut self, input: Input) {
        self.studio.input(input, Held::default(), SIZE_PX);
    }

    /// Drags from place to place, with a frame after each sample, like a slow hand.
    pub(crate) fn drag(&mut self, button: Button, places: &[(f32, f32)]) {
        self.input(Input::Move(Vec2::from(places[0])));
        self.input(Input::Press(button));
        for &place in &places[1..] {
            self.input(Input::Move(Vec2::from(place)));
            self.frame();
        }
        self.input(Input::Release(button));
        self.frame();
    }

    fn press_and_move(&mut self, places: &[(f32, f32)]) {
        self.input(Input::Move(Vec2::from(places[0])));
        self.input(Input::Press(Button::Primary));
        places[1..].iter().for_each(|&place| self.input(Input::Move(Vec2::from(place))));
    }

    /// Drags with keys held.
    pub(crate) fn drag_held(&mut self, places: &[(f32, f32)], held: Held) {
        self.press_and_move(places);
        self.studio.input(Input::Release(Button::Primary), held, SIZE_PX);
        self.frame();
    }

    pub(crate) fn click(&mut self, place: (f32, f32), held: Held) {
        self.studio.input(Input::Move(Vec2::from(place)), held, SIZE_PX);
        self.studio.input(Input::Press(Button::Primary), held, SIZE_PX);
        self.studio.input(Input::Release(Button::Primary), held, SIZE_PX);
        self.frame();
    }

    pub(crate) fn frame(&mut self) -> osp_app::FrameReport {
        self.studio.frame(SIZE_PX, 0.016)
    }

    /// Gives these commands, then ends the frame.
    pub(crate) fn act(&mut self, commands: impl IntoIterator<Item = Command>) {
        commands.into_iter().for_each(|command| self.studio.command(command));
        self.frame();
    }

    pub(crate) fn visible(&self) -> u64 {
        self.studio.scene().counts().visible
    }
}

/// Returns a line across the window at this height, -1 to 1.
pub(crate) fn across(height: f32) -> Vec<(f32, f32)> {
    (0..20).map(|i| (-0.5 + i as f32 * 0.05, height)).collect()
}

/// Draws a ribbon across the window of a studio.
pub(crate) fn draw_across(studio: &mut Studio, height: f32) {
    studio.command(Command::Tool(ToolChoice::Draw(Tool::Ribbon)));
    studio.frame(SIZE_PX, 0.016);
    for (number, place) in across(height).into_iter().enumerate() {
        studio.input(Input::Move(Vec2::from(place)), Held::default(), SIZE_PX);
        if number == 0 {
            studio.input(Input::Press(Button::Primary), Held::default(), SIZE_PX);
        }
    }
    studio.input(Input::Release(Button::Primary), Held::default(), SIZE_PX);
    studio.frame(SIZE_PX, 0.016);
}

/// Returns a table with ribbons, from the highest down, and their numbers.
pub(crate) fn ribbons(heights: &[f32]) -> (Table, Vec<StrokeId>) {
    let mut table = Table::new();
    for &y in heights {
        table.drag(Button::Primary, &across(y));
    }
    let ids = table.studio.scene().strokes().iter().filter_map(|stroke| stroke.id()).collect();
    (table, ids)
}

#[test]
fn what_the_hand_draws_is_in_the_very_next_frame() {
    let mut table = Table::new();
    table.input(Input::Move(Vec2::new(-0.5, 0.0)));
    table.input(Input::Press(Button::Primary));
    table.frame();
    let mut drawn = 0;
    for i in 1..20 {
        table.input(Input::Move(Vec2::new(-0.5 + 0.05 * i as f32, 0.02 * i as f32)));
        let report = table.frame();
        // Two samples make the first polygon.
        assert!(report.samples >= 1 && report.record.inserted >= 1, "sample {i}: {report:?}");
        assert!(report.drawn > drawn, "the new polygon is among those drawn");
        drawn = report.drawn;
    }
}

#[test]
fn every_tool_draws_and_a_click_is_no_stroke() {
    for tool in [Tool::Ribbon, Tool::Wall, Tool::Tube] {
        let mut table = Table::new();
        table.studio.command(Command::Tool(ToolChoice::Draw(tool)));
        table.drag(Button::Primary, &[(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)]);
        assert!(table.visible() > 0, "{tool:?}");
        let before = (table.visible(), table.studio.scene().strokes().len());
        table.click((0.7, 0.7), Held::default());
        assert_eq!((table.visible(), table.studio.scene().strokes().len()), before);
    }
}

#[test]
fn pressure_makes_a_stroke_thinner() {
    let width_of = |pressure: f32| {
        let mut table = Table::new();
        table.input(Input::Pressure(pressure));
        table.input(Input::Move(Vec2::new(-0.5, 0.0)));
        table.input(Input::Press(Button::Primary));
        for (x, y) in &across(0.0)[1..] {
            table.input(Input::Pressure(pressure));
            table.input(Input::Move(Vec2::new(*x, *y)));
        }
        table.input(Input::Release(Button::Primary));
        let scene = table.studio.scene();
        let first = scene.visible_ids().nth(3).expect("a polygon");
        scene.bounds(first).extent().y
    };
    assert!(width_of(0.2) < 0.5 * width_of(1.0));
}

#[test]
fn touching_a_stroke_erases_it_and_nothing_else() {
    let mut table = Table::new();
    table.drag(Button::Primary, &across(0.3));
    let first = table.visible();
    table.drag(Button::Primary, &across(-0.3));
    let both = table.visible();
    table.studio.command(Command::Tool(ToolChoice::Erase));
    table.click((0.0, 0.0), Held::default());
    assert_eq!(table.visible(), both, "between the strokes there is nothing");
    table.click((0.0, -0.3), Held::default());
    assert_eq!(table.visible(), first);
    table.studio.command(Command::Undo);
    assert_eq!(table.visible(), both);
    // A single fast movement goes across both.
    table.drag(Button::Primary, &[(0.0, -0.6), (0.0, 0.6)]);
    assert_eq!(table.visible(), 0);
    assert!(table.studio.culling().searches().rays > 4);
}

/// A pointer is often exactly on the seam of two polygons, because strokes have a seam at each former position of the
/// pointer.
#[test]
fn what_one_way_of_the_eraser_takes_is_brought_back_by_one_undo() {
    let (mut table, ids) = ribbons(&[0.6, 0.3, 0.0, -0.3]);
    let all = table.visible();
    table.studio.command(Command::Tool(ToolChoice::Erase));
    table.drag(Button::Primary, &[(0.0, 0.7), (0.0, 0.15)]);
    let is_there = |table: &Table| {
        ids.iter().filter(|id| table.studio.scene().stroke(**id).expect("a stroke").is_visible()).count()
    };
    assert_eq!(is_there(&table), 2);
    table.drag(Button::Primary, &[(0.0, 0.1), (0.0, -0.1)]);
    assert_eq!(is_there(&table), 1);
    table.studio.command(Command::Undo);
    assert_eq!(is_there(&table), 2);
    table.act([Command::Undo]);
    assert_eq!((is_there(&table), table.visible()), (4, all));
    // A drag that hits nothing is no step.
    table.studio.command(Command::Tool(ToolChoice::Erase));
    table.drag(Button::Primary, &[(0.9, 0.9), (0.9, 0.8)]);
    table.studio.command(Command::Undo);
    assert_eq!(is_there(&table), 3);
}

#[test]
fn a_stroke_has_no_gaps_to_point_through() {
    let mut table = Table::new();
    table.drag(Button::Primary, &[(-0.4, -0.3), (-0.2, -0.1), (0.0, 0.1), (0.1, 0.1), (0.4, -0.2)]);
    table.drag(Button::Secondary, &[(0.0, 0.0), (0.15, 0.1), (0.3, 0.2)]);
    let scene = table.studio.scene();
    let eye = table.studio.navigator().eye();
    let ids: Vec<_> = scene.visible_ids().collect();
    let mut seams = 0;
    for pair in ids.windows(2) {
        let (a, b) = (scene.polygon(pair[0]), scene.polygon(pair[1]));
        let shared: Vec<Vec3> = a.vertices().iter().copied().filter(|v| b.vertices().contains(v)).collect();
        let [p, q] = shared[..] else { continue };
        seams += 1;
        for part in 1..200 {
            let ray = osp::math::Ray::new(eye, p.lerp(q, part as f32 / 200.0) - eye);
            let meets = |polygon: &osp::polygon::ConvexPolygon| {
                let corners = polygon.vertices();
                corners[1..].windows(2).any(|w| ray.meet_triangle([corners[0], w[0], w[1]]).is_some())
            };
            assert!(meets(&a) || meets(&b), "through the seam of {:?} at {part}", pair);
        }
    }
    assert!(seams > 2, "{seams}");
}

#[test]
fn selected_strokes_are_moved_in_one_step() {
    let (mut table, _) = ribbons(&[0.3, -0.3]);
    table.studio.command(Command::Tool(ToolChoice::Select));
    table.click((0.0, 0.3), Held::default());
    assert_eq!(table.studio.selection().strokes().len(), 1);
    table.click((0.0, -0.3), Held { shift: true, ..Held::default() });
    assert_eq!(table.studio.selection().strokes().len(), 2);
    let bounds = |table: &Table| {
        let scene = table.studio.scene();
        scene.visible_ids().fold(osp::math::Aabb::EMPTY, |all, id| all.union(&scene.bounds(id)))
    };
    let before = bounds(&table);
    table.drag(Button::Primary, &[(0.0, 0.3), (0.1, 0.35), (0.2, 0.4)]);
    let after = bounds(&table);
    let by = after.center() - before.center();
    assert!(by.length() > 0.05, "{by}");
    assert!((after.extent() - before.extent()).length() < 1.0e-4);
    table.studio.command(Command::Undo);
    let left = bounds(&table).center() - before.center();
    assert!(left.length() < 1.0e-5, "one undo takes the whole move back");
    // The selection can be erased. A click on nothing clears the selection.
    table.studio.command(Command::EraseSelected);
    assert_eq!(table.visible(), 0);
    table.act([Command::Undo, Command::SelectAll]);
    table.click((0.9, 0.9), Held::default());
    assert!(table.studio.selection().is_empty());
}

#[test]
fn a_stroke_starts_on_what_is_under_the_pointer() {
    for (snap, is_on_wall) in [(Snap::Start, true), (Snap::Off, false)] {
        let mut table = Table::new();
        // The wall is drawn on the plane of the camera's target. Then the eye moves, and the plane with it.
        table.studio.command(Command::Tool(ToolChoice::Draw(Tool::Wall)));
        table.drag(Button::Primary, &[(-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)]);
        let wall = table.studio.scene().bounds(table.studio.scene().visible_ids().next().expect("a wall"));
        table.studio.set_flight(Vec3::new(0.0, 0.0, 1.0));
        for _ in 0..30 {
            table.frame();
        }
        table.studio.set_flight(Vec3::ZERO);
        table.act([Command::Snap(snap), Command::Tool(ToolChoice::Draw(Tool::Ribbon))]);
        let first = table.studio.scene().polygon_count();
        table.drag(Button::Primary, &across(0.0));
        let scene = table.studio.scene();
        let ribbon = scene.bounds(osp::polygon::PolygonId(first as u32 + 1));
        let grown = osp::math::Aabb::new(wall.min - Vec3::splat(0.05), wall.max + Vec3::splat(0.05));
        assert_eq!(grown.contains(&ribbon), is_on_wall, "{snap:?}: {ribbon:?} and the wall {wall:?}");
    }
}

#[test]
fn a_pose_snapped_to_surfaces_does_not_climb_on_itself() {
    let mut table = Table::new();
    table.studio.command(Command::Snap(Snap::Surface));
    // The drag goes back and forth over the same place.
    let places: Vec<(f32, f32)> =
        (0..200).map(|i| ((i as f32 * 0.7).sin() * 0.1, (i as f32 * 0.9).cos() * 0.1)).collect();
    let start = table.studio.navigator().target();
    table.drag(Button::Primary, &places);
    let scene = table.studio.scene();
    let forward = table.studio.views()[0].view.forward_in_world();
    let farthest = scene
        .visible_ids()
        .flat_map(|id| scene.bounds(id).corners())
        .fold(0.0f32, |far, p| far.max((p - start).dot(forward).abs()));
    assert!(farthest < 0.08, "{farthest} m off the plane");
}

#[test]
fn every_index_draws_the_same_and_switching_loses_nothing() {
    let (mut table, _) = ribbons(&[-0.4, -0.1, 0.2, 0.5]);
    let drawn = |table: &mut Table| {
        table.frame();
        let mut ids = table.studio.culling().drawn(0).to_vec();
        ids.sort();
        ids
    };
    let expected = drawn(&mut table);
    assert!(!expected.is_empty());
    for &kind in IndexKind::ALL {
        // A stroke is being drawn while the index changes. No frame has included its last polygons yet.
        table.press_and_move(&across(-0.7)[..8]);
        table.studio.command(Command::Index(kind));
        table.input(Input::Release(Button::Primary));
        let with = drawn(&mut table);
        assert!(with.len() > expected.len(), "{}", kind.name());
        table.studio.command(Command::Undo);
        assert_eq!(drawn(&mut table), expected, "{}", kind.name());
        table.studio.culling().index().validate().expect("a sound index");
    }
}

#[test]
fn a_frozen_camera_goes_on_culling_from_where_it_stood() {
    let mut table = Table::new();
    table.drag(Button::Primary, &across(0.0));
    table.drag(Button::Secondary, &[(0.0, 0.0), (0.3, 0.0), (0.9, 0.0)]);
    table.drag(Button::Primary, &across(0.0));
    // The camera moves so near that a part of the model is out of view.
    for _ in 0..14 {
        table.input(Input::Wheel(1.0));
    }
    let visible = table.frame().record.visible;
    assert!(visible < table.visible(), "{visible} of {}", table.visible());
    table.studio.command(Command::Freeze(true));
    for _ in 0..30 {
        table.input(Input::Wheel(-1.0));
        assert_eq!(table.frame().record.visible, visible);
    }
    assert_eq!(table.studio.culled().len() as u64, table.visible() - visible);
    assert!(!table.studio.lines().is_empty());
    table.studio.command(Command::Freeze(false));
    assert_eq!(table.frame().record.visible, table.visible());
    assert!(table.studio.culled().is_empty());
    table.studio.command(Command::FrustumCulling(false));
    assert_eq!(table.frame().drawn, table.visible());
}

/// Returns a replay of the rooms at its beginning. The folder is for saved files.
fn rooms() -> (tempfile::TempDir, Studio) {
    let path = Path::new(osp_testkit::ROOT).join("recordings/room.ron");
    let folder = tempfile::tempdir().expect("a folder");
    let player = Session::to_play(&path, Pace::Samples(16), CameraChoice::Auto).expect("a session");
    let autosaves = Autosaves::new(Some(folder.path().to_owned()));
    let studio = Studio::new(player, autosaves, IndexKind::Osp);
    (folder, studio)
}

#[test]
fn what_others_hide_is_left_out_and_shown_when_the_camera_is_frozen() {
    let (_folder, mut studio) = rooms();
    // Here the head looks at a wall with rooms behind it.
    studio.command(Command::Seek(301));
    let whole = studio.frame(SIZE_PX, 0.016);
    assert_eq!(whole.drawn, whole.record.visible);
    let mut most = 0;
    for kind in Method::conservative_cullers() {
        studio.command(Command::Occlusion(kind));
        let report = studio.frame(SIZE_PX, 0.016);
        assert_eq!(report.record.visible, whole.record.visible, "{}", kind.name());
        assert_eq!(report.drawn + report.record.occlusion.occluded, report.record.visible);
        most = most.max(report.record.occlusion.occluded);
        studio.command(Command::Freeze(true));
        let frozen = studio.frame(SIZE_PX, 0.016);
        assert_eq!(studio.hidden().len() as u64, frozen.record.occlusion.occluded, "{}", kind.name());
        let all = frozen.drawn + (studio.hidden().len() + studio.culled().len()) as u64;
        assert_eq!(all, frozen.record.polygons, "each polygon is drawn, hidden or out of view");
        studio.command(Command::Freeze(false));
    }
    assert!(most > 50, "{most} polygons hidden");
}

#[test]
fn a_replay_is_entered_anywhere_with_every_way_to_find_what_is_hidden() {
    let (_folder, mut studio) = rooms();
    let methods = Method::conservative_cullers().into_iter();
    for choice in methods.chain([Occlusion::Auto, Occlusion::PreviousFrame].map(Method::Own)) {
        studio.command(Command::Occlusion(choice));
        for seek in [300, 301, 20, 21, 400, 120, 5, 6, 0, 350, 349, 40] {
            studio.command(Command::Seek(seek));
            let report = studio.frame(SIZE_PX, 0.016);
            assert_eq!(report.record.polygons, studio.scene().counts().visible, "{}", choice.name());
            assert_eq!(report.drawn + report.record.occlusion.occluded, report.record.visible);
        }
    }
}
