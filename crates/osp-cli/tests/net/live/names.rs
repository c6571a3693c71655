//! The names beside the rings where others draw.

use osp::glam;
use osp_app::{
    Button, Held, Input, Studio,
    egui::{Context, Event, FullOutput, Key, Modifiers, Pos2, RawInput, Rect, Shape, Vec2},
    ui::Interface,
};
use osp_testkit::wait_until;

use super::{
    server::Server,
    sketch::{SIZE_PX, Window},
};

/// A window with its panels, which shows the model in this part.
struct Desk {
    studio: Studio,
    interface: Interface,
    model: Rect,
}

/// The window as egui lays it out, frame by frame.
struct Harness {
    context: Context,
    desk: Desk,
    events: Vec<Event>,
    output: FullOutput,
}

impl Harness {
    fn new(desk: Desk) -> Self {
        let mut harness =
            Self { context: Context::default(), desk, events: Vec::new(), output: FullOutput::default() };
        harness.step();
        harness
    }

    fn state(&self) -> &Desk {
        &self.desk
    }

    fn event(&mut self, event: Event) {
        self.events.push(event);
    }

    fn step(&mut self) {
        let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(1280.0, 800.0));
        let events = std::mem::take(&mut self.events);
        let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
        let desk = &mut self.desk;
        self.output = self.context.run_ui(input, |ui| {
            desk.model = desk.interface.show(ui, &mut desk.studio);
            let size_px = glam::Vec2::new(desk.model.width(), desk.model.height());
            desk.studio.frame(size_px, 0.016);
        });
        // Nothing is painted here.
        self.output.textures_delta.clear();
    }

    fn run_steps(&mut self, steps: usize) {
        (0..steps).for_each(|_| self.step());
    }
}

/// The texts on the window, with where they are and which part of it they are cut off at.
fn written(harness: &Harness, text: &str) -> Vec<(Rect, Rect)> {
    let shapes = harness.output.shapes.iter();
    let texts = shapes.filter_map(|clipped| match &clipped.shape {
        Shape::Text(shape) if shape.galley.text() == text => {
            Some((shape.visual_bounding_rect(), clipped.clip_rect))
        }
        _ => None,
    });
    texts.collect()
}

/// On the model, not in the list of authors.
fn on_model(harness: &Harness, text: &str) -> Vec<Rect> {
    let model = harness.state().model;
    let texts = written(harness, text).into_iter().filter(|(_, clip)| model.contains_rect(*clip));
    texts.map(|(at, _)| at).collect()
}

/// How far ahead of the eye the pen of the other is, metres.
fn ahead_m(studio: &Studio) -> f32 {
    let pen = studio.session().live().expect("a session").pens().next().expect("Bob draws");
    (pen.at - studio.navigator().eye()).dot(studio.views()[0].view.forward_in_world())
}

/// Frames of both windows until this is so.
fn until(ann: &mut Harness, bob: &mut Window, what: &str, is_so: impl Fn(&Harness) -> bool) {
    wait_until(what, || {
        bob.frame();
        ann.step();
        is_so(ann)
    });
}

#[test]
fn the_name_of_who_draws_stands_beside_the_ring_and_nowhere_else() {
    let Some(server) = Server::start() else { return };
    let (ann, mut bob) = (Window::author(&server, "Ann"), Window::author(&server, "Bob"));
    let Window { studio, folder: _folder } = ann;
    let desk = Desk { studio, interface: Interface::new("a test".to_owned()), model: Rect::NOTHING };
    let mut ann = Harness::new(desk);
    until(&mut ann, &mut bob, "both are there", |ann| ann.state().studio.scene().authors().count() == 2);
    ann.run_steps(2);
    assert!(on_model(&ann, "Bob").is_empty() && !written(&ann, "Bob").is_empty(), "the list has it");

    let input = |bob: &mut Window, input| bob.studio.input(input, Held::default(), SIZE_PX);
    input(&mut bob, Input::Move(glam::Vec2::new(-0.18, 0.02)));
    input(&mut bob, Input::Press(Button::Primary));
    for i in 1..10 {
        input(&mut bob, Input::Move(glam::Vec2::new(-0.18 + 0.02 * i as f32, 0.02)));
        bob.frame();
    }
    until(&mut ann, &mut bob, "the name is there", |ann| on_model(ann, "Bob").len() == 1);
    until(&mut ann, &mut bob, "all has come", |ann| ann.state().studio.scene().counts().points >= 9);
    ann.run_steps(2);
    let Desk { studio, model, .. } = ann.state();
    let [ref other] = studio.others_in_view(model.width() / model.height())[..] else { panic!("one pen") };
    let ring = model.min + model.size() * Vec2::new(other.at.x, 1.0 - other.at.y);
    let [name] = on_model(&ann, "Bob")[..] else { panic!("one name") };
    let gap = name.min.x - ring.x;
    assert!(gap > other.radius * model.height() && gap < 40.0, "{name} {ring}");
    assert!((name.center().y - ring.y).abs() < 4.0, "{name} {ring}");
    // Nobody has a name at the own pen.
    assert!(on_model(&ann, "Ann").is_empty());

    // Past the pen it is behind the eye, though it still draws.
    let key = |key, pressed| Event::Key {
        key,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    ann.event(key(Key::W, true));
    until(&mut ann, &mut bob, "it is behind", |ann| ahead_m(&ann.state().studio) < -0.2);
    ann.event(key(Key::W, false));
    ann.run_steps(2);
    assert!(on_model(&ann, "Bob").is_empty() && ahead_m(&ann.state().studio) < -0.2);
    ann.event(key(Key::S, true));
    until(&mut ann, &mut bob, "it is in view again", |ann| on_model(ann, "Bob").len() == 1);
    input(&mut bob, Input::Release(Button::Primary));
    until(&mut ann, &mut bob, "the stroke has ended", |ann| on_model(ann, "Bob").is_empty());
}
