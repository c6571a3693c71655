//! Painting with brushes.

use crate::{drawing::Table, panel, panel::Person};
use egui::Key;
use egui_kittest::{Harness, kittest::Queryable};
use osp::glam::{Quat, Vec3};
use osp_app::{Button, Command, tracker};
use osp_session::{
    brush,
    recording::{Event, NormalRule, StrokeId, Tool},
    scene::Scene,
};
use osp_testkit::events::events_in;

fn wave(y: f32) -> Vec<(f32, f32)> {
    (0..30).map(|i| (150.0 + i as f32 * 15.0, y + (i as f32 * 0.3).sin() * 60.0)).collect()
}

fn paint(table: &mut Table, brush: &str, y: f32) {
    table.studio.command(Command::Paint(brush::find(brush)));
    table.drag(Button::Primary, &wave(y));
}

/// Returns the number of visible polygons of a stroke of the session, painted or not.
fn polygons_of(events: &[Event], number: u32, is_painted: bool) -> u64 {
    let mut scene = Scene::new();
    for event in events {
        let mut event = event.clone();
        let stroke = match &mut event {
            Event::Begin { stroke, paint, .. } => {
                paint.take_if(|_| !is_painted);
                *stroke
            }
            Event::Point { stroke, .. } | Event::End { stroke, .. } => *stroke,
            _ => continue,
        };
        if stroke == StrokeId(number) {
            scene.apply(&event, &mut Vec::new());
        }
    }
    scene.counts().visible
}

#[test]
fn strokes_are_painted_with_the_chosen_brush_undone_saved_and_read_again() {
    let mut table = Table::new();
    let brushes = ["Light", "MatteHull", "Ink", "WigglyGraphite", "Bubbles"];
    for (i, brush) in brushes.iter().enumerate() {
        paint(&mut table, brush, 100.0 + 90.0 * i as f32);
    }
    let drawn: Vec<_> = table.studio.scene().strokes().iter().map(|stroke| stroke.brush()).collect();
    assert_eq!(drawn, brushes.map(brush::find));
    let before = table.visible();
    table.act([Command::Undo]);
    assert!(table.visible() < before);
    table.act([Command::Redo]);
    assert_eq!(table.visible(), before);

    let saved = table.folder.path().join("painted.ron");
    table.act([Command::SaveAs(saved.clone())]);
    let events = events_in(&saved);
    for (i, name) in brushes.iter().enumerate() {
        let painted = polygons_of(&events, i as u32, true);
        assert!(painted > 0, "{name}");
    }
    let hull = |is_painted| polygons_of(&events, 1, is_painted);
    assert_ne!(hull(true), hull(false), "a hull is no ribbon");
    let all: u64 = (0..brushes.len() as u32).map(|i| polygons_of(&events, i, true)).sum();
    assert_eq!(all, before, "the window shows what the brushes make of the samples");
    let paints: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            Event::Begin { paint, normal, .. } => Some((paint.as_ref()?.brush.clone(), *normal)),
            _ => None,
        })
        .collect();
    let expected: Vec<_> = brushes.iter().map(|name| ((*name).to_owned(), NormalRule::Travel)).collect();
    assert_eq!(paints, expected);

    // Opened again, it is the same model, and the brush is still chosen.
    table.act([Command::New]);
    assert_eq!(table.visible(), 0);
    assert_eq!(table.studio.brush().paint(), brush::find("Bubbles"));
    table.act([Command::Open(saved)]);
    assert_eq!(table.visible(), before);
    let again: Vec<_> = table.studio.scene().strokes().iter().map(|stroke| stroke.brush()).collect();
    assert_eq!(again, drawn);
}

#[test]
fn brushes_are_found_by_typing_and_chosen_by_keys() {
    let mut harness = panel::sketch();
    harness.press(Key::B);
    let press = |harness: &mut Harness<'_, panel::Window>, keys: &[Key]| {
        for key in keys {
            harness.press(*key);
        }
    };
    // The row of the chosen brush, "plain", is the first.
    press(&mut harness, &[Key::ArrowDown, Key::ArrowDown, Key::ArrowUp, Key::Enter]);
    let offered = |brush: &&'static brush::Brush| brush.is_offered;
    let first = harness.state().studio.brush().paint().expect("a brush");
    assert!(offered(&first) && harness.query_by_label("MatteHull").is_none(), "{}", first.name);

    harness.press(Key::B);
    harness.event(egui::Event::Text("hull".to_owned()));
    harness.run_steps(3);
    let hulls: Vec<_> = brush::all().iter().filter(offered).filter(|b| b.name.contains("Hull")).collect();
    assert!(hulls.len() > 1, "{hulls:?}");
    assert!(harness.query_by_label("CelVinyl").is_none(), "the list holds what was typed alone");
    for hull in &hulls {
        assert!(harness.query_by_label(&hull.name).is_some(), "{}", hull.name);
    }
    press(&mut harness, &[Key::ArrowUp, Key::ArrowDown, Key::Enter]);
    let chosen = harness.state().studio.brush().paint().expect("a brush");
    assert!(hulls.iter().any(|hull| std::ptr::eq(*hull, chosen)), "{}", chosen.name);

    harness.press(Key::B);
    harness.event(egui::Event::Text("no such".to_owned()));
    harness.run_steps(3);
    assert!(harness.query_by_label("no brush of this name").is_some());
    press(&mut harness, &[Key::Enter, Key::Escape]);
    let still = harness.state().studio.brush().paint().expect("a brush");
    assert!(std::ptr::eq(still, chosen) && harness.query_by_label("no brush of this name").is_none());
}

#[test]
fn a_tracker_paints_with_a_brush_by_its_name() {
    use tracker::{BrushChoice, Hands, Message, osc_packet, parse_line, parse_osc, write_line};
    let choice = |line: &str| match parse_line(line) {
        Ok(Some(Message::Brush { brush, .. })) => brush,
        other => panic!("{line}: {other:?}"),
    };
    let light = choice("brush Light 0.05 1 0.5 0 1");
    assert_eq!(
        (light.tool, light.paint, light.normal),
        (Tool::Ribbon, brush::find("Light"), NormalRule::Travel)
    );
    assert_eq!(choice("brush Light 0.05 1 0.5 0 1 2 local-x").normal, NormalRule::LocalX);
    assert_eq!(choice("brush ribbon 0.05 1 0.5 0 1").normal, NormalRule::LocalX);
    assert_eq!(parse_line("brush"), Err(tracker::Malformed));
    // Every brush survives both forms of message, even brushes with several words.
    for brush in brush::all() {
        let message = Message::Brush { hand: 1, brush: BrushChoice { paint: Some(brush), ..light } };
        let (mut line, mut read) = (String::new(), Vec::new());
        write_line(&message, &mut line);
        assert_eq!(parse_line(line.trim_end()), Ok(Some(message)), "{line}");
        assert_eq!((parse_osc(&osc_packet(&message), &mut read), read), (0, vec![message]));
    }
    // The hand's stroke is painted.
    let (mut hands, mut events) = (Hands::default(), Vec::new());
    let p = Vec3::ZERO;
    let brush = Message::Brush { hand: 0, brush: light };
    for message in [brush, Message::Hand { hand: 0, p, q: Quat::IDENTITY, pressure: 0.5 }] {
        hands.take(0.0, &message, || StrokeId(5), &mut events);
    }
    let Event::Begin { paint: Some(paint), .. } = &events[0] else { panic!("{events:?}") };
    assert_eq!((paint.brush.as_str(), paint.seed), ("Light", 5));
    // A brush that is sent again is the same.
    let (mut encoder, mut told) = (tracker::EventEncoder::new(), Vec::new());
    events.iter().for_each(|event| encoder.encode(event, &mut told));
    assert_eq!(told[0], brush);
}
