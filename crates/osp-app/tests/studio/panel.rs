use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, Vec2, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable};
use osp::{glam, occlusion::Occlusion};
use osp_app::{Autosaves, Command, FrameReport, Room, Session, Span, Studio, ToolChoice, ui::Interface};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Pace, Tool},
    replay::CameraChoice,
    rig::Rig,
};

/// A window without a display: the panels, followed by the frame, like in the real window.
pub(crate) struct Window {
    pub(crate) studio: Studio,
    pub(crate) interface: Interface,
    pub(crate) model: Rect,
    report: FrameReport,
    pub(crate) folder: tempfile::TempDir,
}

pub(crate) fn window(subject: impl FnOnce(&Autosaves) -> Session) -> Harness<'static, Window> {
    let folder = tempfile::tempdir().expect("a folder");
    let autosaves = Autosaves::new(Some(folder.path().to_owned()));
    let studio = Studio::new(subject(&autosaves), autosaves, IndexKind::Osp);
    panels(studio, folder, Vec2::new(1280.0, 800.0))
}

/// Returns the panels of a studio that uses a folder.
pub(crate) fn panels(studio: Studio, folder: tempfile::TempDir, size: Vec2) -> Harness<'static, Window> {
    let interface = Interface::new("a test".to_owned());
    let state = Window { studio, interface, model: Rect::NOTHING, report: FrameReport::default(), folder };
    let mut harness = Harness::builder().with_size(size).build_ui_state(
        |ui, window: &mut Window| {
            let events = window.studio.session().event_count();
            window.model = window.interface.show(ui, &mut window.studio);
            assert_eq!(window.studio.session().event_count(), events, "a layout draws nothing");
            window.interface.carry_out(&mut window.studio);
            let size_px = glam::Vec2::new(window.model.width(), window.model.height());
            window.report = window.studio.frame(size_px, 0.016);
        },
        state,
    );
    harness.run_steps(3);
    harness
}

/// Actions of a person, and the frames until the window shows the result.
pub(crate) trait Person {
    fn press(&mut self, key: Key);
    fn press_with(&mut self, modifiers: Modifiers, key: Key);
    fn click_on(&mut self, label: &str);
    fn click_button(&mut self, label: &str);
    /// Clicks what may be out of sight.
    fn choose(&mut self, label: &str);
    fn command(&mut self, command: Command);
    fn keep_settings(&mut self, path: std::path::PathBuf, ctx: &egui::Context);
}

impl Person for Harness<'_, Window> {
    fn keep_settings(&mut self, path: std::path::PathBuf, ctx: &egui::Context) {
        let Window { studio, interface, .. } = self.state_mut();
        interface.keep_settings(path, ctx, studio);
    }

    fn press(&mut self, key: Key) {
        self.key_press(key);
        self.run_steps(FRAMES);
    }

    fn press_with(&mut self, modifiers: Modifiers, key: Key) {
        self.key_press_modifiers(modifiers, key);
        self.run_steps(FRAMES);
    }

    fn click_on(&mut self, label: &str) {
        self.get_by_label(label).click();
        self.run_steps(FRAMES);
    }

    fn click_button(&mut self, label: &str) {
        self.get_by_role_and_label(Role::Button, label).click();
        self.run_steps(FRAMES);
    }

    fn choose(&mut self, label: &str) {
        self.get_by_label(label).click_accesskit();
        self.run_steps(FRAMES);
    }

    fn command(&mut self, command: Command) {
        self.state_mut().studio.command(command);
        self.run_steps(FRAMES);
    }
}

/// Number of frames that a window with menus and dialogs needs to show a result.
const FRAMES: usize = 4;

pub(crate) fn sketch() -> Harness<'static, Window> {
    window(Session::new)
}

/// The same with the culling panel.
fn with_panel(mut harness: Harness<'static, Window>) -> Harness<'static, Window> {
    harness.press(Key::F2);
    harness
}

pub(crate) fn replay() -> Harness<'static, Window> {
    let path = std::path::Path::new(osp_testkit::ROOT).join("recordings/scribble.ron");
    let player = Session::to_play(&path, Pace::Recorded, CameraChoice::Auto).expect("a session");
    window(|_| player)
}

pub(crate) fn button(at: Pos2, pressed: bool) -> Event {
    Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }
}

/// Drags through these places of the model's part of the window (0 to 1), with a frame for each. Returns the report of
/// each frame.
pub(crate) fn drag(harness: &mut Harness<'_, Window>, places: &[(f32, f32)]) -> Vec<FrameReport> {
    let model = harness.state().model;
    let place = |(x, y): (f32, f32)| model.min + model.size() * Vec2::new(x, y);
    let mut reports = Vec::new();
    harness.event(Event::PointerMoved(place(places[0])));
    harness.step();
    harness.event(button(place(places[0]), true));
    harness.step();
    for &at in &places[1..] {
        harness.event(Event::PointerMoved(place(at)));
        harness.step();
        reports.push(harness.state().report);
    }
    harness.event(button(place(places[places.len() - 1]), false));
    harness.step();
    reports
}

pub(crate) fn across() -> Vec<(f32, f32)> {
    (0..16).map(|i| (0.2 + i as f32 * 0.04, 0.5)).collect()
}

#[test]
fn every_tool_has_a_button_and_a_key() {
    let mut harness = sketch();
    for (name, key, tool) in [
        ("Wall (2)", Key::Num2, ToolChoice::Draw(Tool::Wall)),
        ("Tube (3)", Key::Num3, ToolChoice::Draw(Tool::Tube)),
        ("Erase (4, X)", Key::X, ToolChoice::Erase),
        ("Select (5, V)", Key::V, ToolChoice::Select),
        ("Select in a box (R)", Key::R, ToolChoice::Span(Span::Box)),
        ("Select in a sphere (G)", Key::G, ToolChoice::Span(Span::Sphere)),
        ("Measure (M)", Key::M, ToolChoice::Span(Span::Distance)),
        ("Ribbon (1)", Key::Num1, ToolChoice::Draw(Tool::Ribbon)),
    ] {
        let before = harness.state().studio.tool();
        assert_ne!(before, tool);
        harness.click_on(name);
        assert_eq!(harness.state().studio.tool(), tool, "the button {name}");
        harness.state_mut().studio.command(Command::Tool(before));
        harness.press(key);
        assert_eq!(harness.state().studio.tool(), tool, "the key {key:?}");
    }
    harness.click_on("colour 64 168 214");
    let [r, g, b, a] = harness.state().studio.brush().color.map(|c| (c * 255.0).round() as u8);
    assert_eq!([r, g, b, a], [64, 168, 214, 255]);
}

#[test]
fn keys_straighten_mirror_and_show_all() {
    let mut harness = sketch();
    harness.press(Key::U);
    harness.press(Key::Y);
    let aids = harness.state().studio.aids();
    assert!(aids.straight && aids.mirror_x.is_some(), "{aids:?}");
    drag(&mut harness, &across());
    assert_eq!(harness.state().studio.scene().strokes().len(), 2);
    let size_px = glam::Vec2::new(800.0, 600.0);
    harness.state_mut().studio.input(osp_app::Input::Wheel(20.0), osp_app::Held::default(), size_px);
    harness.run_steps(2);
    let record = harness.state().report.record;
    assert!(record.visible < record.polygons, "{record:?}");
    harness.press(Key::F);
    let record = harness.state().report.record;
    assert_eq!(record.visible, record.polygons);
}

#[test]
fn a_replay_is_played_and_stepped_by_its_bar() {
    let mut harness = replay();
    let position = |harness: &Harness<'_, Window>| {
        let player = harness.state().studio.session().replay().expect("a replay");
        player.position()
    };
    // A recorded frame for each shown frame.
    let player = harness.state().studio.session().replay().expect("a replay");
    let frames = player.frame_count();
    let speed = player.secs_at(frames) / (frames as f64 * 0.016);
    harness.command(Command::Speed(speed));
    harness.get_by_label("Play").click();
    harness.run_steps(30);
    harness.click_on("Pause");
    let stood = position(&harness);
    assert!(stood > 20, "{stood}");
    harness.run_steps(5);
    assert_eq!(position(&harness), stood);
    harness.click_on("<");
    assert_eq!(position(&harness), stood - 1);
    harness.click_on(">");
    assert_eq!(position(&harness), stood);
    // Nothing is drawn by a drag over the panel.
    let strokes = harness.state().studio.scene().strokes().len();
    let reports = drag(&mut harness, &across());
    assert!(reports.iter().all(|report| report.record.inserted == 0));
    assert_eq!(harness.state().studio.scene().strokes().len(), strokes);
    assert!(harness.query_by_label("Undo").is_none(), "a replay has no tools");
}

/// There are two screens and two eyes. Polygons that a wall hides are left out of every view.
#[test]
fn occluders_are_shown_limited_and_looked_for_on_every_screen() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("wall.ron");
    std::fs::write(&path, walls_and_squares()).expect("written");
    let open = |autosaves: &Autosaves| Session::open(&path, autosaves).expect("a session").0;
    let mut harness = with_panel(window(|autosaves| open(autosaves)));
    harness.state_mut().studio.set_room(Room::new(Rig::open("dual-wall").expect("a shipped rig")));
    harness.run_steps(2);
    let in_view = harness.state().report.record.visible;
    let drawn = |harness: &Harness<'_, Window>, i: usize| harness.state().studio.culling().drawn(i).len();
    let each: Vec<usize> = (0..4).map(|i| drawn(&harness, i)).collect();
    assert_eq!(each.iter().sum::<usize>() as u64, in_view);
    assert!(each.iter().all(|&count| count > 100), "{each:?}");
    harness.command(Command::Occlusion(Occlusion::Msvbsp.into()));
    for (i, all) in each.iter().enumerate() {
        assert!(drawn(&harness, i) < all - 50, "screen {i}: {} of {all}", drawn(&harness, i));
    }
    let record = harness.state().report.record;
    assert_eq!(record.drawn(), harness.state().report.drawn);
    assert!(record.occlusion.occluders >= 4 && record.occlusion.nodes >= 12, "{record:?}");
    harness.get_by_label("split planes");

    let faces = harness.state().studio.lines().triangle_count();
    harness.choose("occluders and shadow volumes");
    // A wall's shadow has four sides.
    assert!(harness.state().studio.lines().triangle_count() >= faces + 8);

    // With the smallest budget there is one occluder in each view.
    harness.command(Command::Occluders(Some(1)));
    assert_eq!(harness.state().report.record.occlusion.occluders, 4);
    assert!(harness.query_all_by_label("max. occluders").next().is_some());
    harness.command(Command::Index(IndexKind::OctreeRebuild));
    assert_eq!(harness.state().report.record.occlusion.occluders, 4, "another index keeps the limit");
}

/// Returns a wall before each screen of the rig `dual-wall`, with small squares behind it.
fn walls_and_squares() -> String {
    let mut text =
        "Header(format:1,name:\"walls\",camera:(p:(0.0,1.6,0.0),q:(0.0,0.0,0.0,1.0),fov_degrees:60.0))\n"
            .to_owned();
    let mut square = |away_m: f32, middle: (f32, f32), half_m: f32, screen: f32| {
        let corner = |(right, up): (f32, f32)| {
            let (x, y) = (middle.0 + right * half_m, middle.1 + up * half_m);
            // Turned by 45 degrees to the left (-1) or right (1).
            let (x, z) = ((x + screen * away_m) / 2.0f32.sqrt(), (screen * x - away_m) / 2.0f32.sqrt());
            format!("({x:?},{:?},{z:?})", 1.6 + y)
        };
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).join(",");
        text += &format!("Polygon(t:0.0,vertices:[{corners}],color:(0.8,0.7,0.6,1.0))\n");
    };
    for screen in [-1.0, 1.0] {
        square(2.0, (0.0, 0.0), 1.2, screen);
        for i in 0..400 {
            let middle = ((i % 20) as f32 * 0.05 - 0.5, (i / 20) as f32 * 0.05 - 0.5);
            square(3.0, middle, 0.02, screen);
        }
    }
    text
}

/// The counts are those of boxes against the culling frustum.
#[test]
fn what_the_sides_of_the_view_cut_is_counted() {
    let mut harness = with_panel(replay());
    harness.command(Command::Seek(301));
    assert_eq!(harness.state().studio.inside_and_cut(), None);
    harness.choose("polygons that the frustum cuts");
    let studio = &harness.state().studio;
    let (inside, cut) = studio.inside_and_cut().expect("it is shown");
    assert_eq!(inside + cut, harness.state().report.record.visible);
    assert!(inside > 0 && cut > 0, "{inside} {cut}");
    assert!(harness.query_by_label_contains(" inside, ").is_some());
}

#[test]
fn a_key_shows_the_depth_pyramid_and_the_panel_says_what_it_needs() {
    let mut harness = with_panel(replay());
    assert!(!harness.state().studio.layers().pyramid);
    harness.press(Key::F3);
    assert!(harness.state().studio.layers().pyramid);
    let needs = "only hzb has a pyramid: choose hzb under occlusion";
    assert!(harness.query_by_label(needs).is_some());
    harness.command(Command::Occlusion(Method::Hzb));
    assert!(harness.query_by_label(needs).is_none());
    harness.press(Key::F3);
    assert!(!harness.state().studio.layers().pyramid);
}
