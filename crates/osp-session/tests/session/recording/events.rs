//! Random events for the other tests, and helpers to read and write them.

use std::{
    io::{BufRead, BufReader},
    path::Path,
};

use glam::{Quat, Vec3};
use osp_session::recording::{
    Author, Event, EventSource, Flush, GroupId, Header, NormalRule, Notes, OpenOptions, Paint,
    RecordingError, RonReader, RonWriter, SketchExtensions, StrokeId, Tool, Transform, open,
};
use osp_testkit::events::{Begin, SOLE, polygon};
use proptest::prelude::*;

pub(crate) fn undo(t: f64) -> Event {
    Event::Undo { author: Author::SOLE, t }
}

pub(crate) fn write(header: &Header, events: &[Event]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = RonWriter::new(&mut bytes, "test.ron", header, Flush::EachEvent).unwrap();
    for event in events {
        writer.write(event).unwrap();
    }
    drop(writer);
    bytes
}

#[derive(Debug, Default)]
pub(crate) struct Outcome {
    pub(crate) events: Vec<Event>,
    pub(crate) notes: Notes,
    pub(crate) error: Option<RecordingError>,
}

/// Reads all events; an error of the header counts as an error before the first event.
pub(crate) fn read(bytes: &[u8], options: OpenOptions) -> Outcome {
    read_from(BufReader::with_capacity(97, bytes), options)
}

pub(crate) fn read_from(input: impl BufRead + Send, options: OpenOptions) -> Outcome {
    match RonReader::new(input, "test.ron", options) {
        Ok(mut reader) => read_rest(&mut reader),
        Err(error) => Outcome { error: Some(error), ..Outcome::default() },
    }
}

/// As [`read`], from a file.
pub(crate) fn read_file(path: &Path, options: OpenOptions) -> Outcome {
    match open(path, &options) {
        Ok(mut session) => read_rest(&mut *session.events),
        Err(error) => Outcome { error: Some(error), ..Outcome::default() },
    }
}

fn read_rest(reader: &mut dyn EventSource) -> Outcome {
    let mut outcome = Outcome::default();
    outcome.error = loop {
        match reader.next_event() {
            Ok(Some(event)) => outcome.events.push(event),
            Ok(None) => break None,
            Err(error) => break Some(error),
        }
    };
    assert!(matches!(reader.next_event(), Ok(None)), "nothing follows the end or an error");
    outcome.notes = reader.notes();
    outcome
}

pub(crate) const STRICT: OpenOptions = OpenOptions::STRICT;
pub(crate) const LENIENT: OpenOptions = OpenOptions::LENIENT;

/// A few events of every kind.
pub(crate) fn sample_events() -> Vec<Event> {
    let q = Quat::from_xyzw(0.5, -0.5, 0.5, 0.5);
    let stroke = StrokeId(7);
    let paint = Paint {
        scale: 0.5,
        layer: 1,
        hidden: true,
        sketch_group: 5,
        sketch_flags: 2,
        sketch_extensions: frame_two(),
        ..Paint::new("Ink", 77)
    };
    let (author, t) = (Author::SOLE, 0.136);
    let layer = |name, hidden, locked| Event::Layer { author, t, layer: 2, name, hidden, locked, mine: None };
    vec![
        Event::Head { author: Author::SOLE, t: 0.016, p: Vec3::new(0.1, 1.6, -0.3), q },
        Begin {
            width: 0.02,
            color: (0.25, 1.0, 0.0, 1.0),
            normal: NormalRule::Travel,
            thinnest: 0.1,
            paint: Some(Box::new(paint)),
            ..Begin::of(stroke)
        }
        .event(),
        Event::Point { t: 0.03, stroke, p: Vec3::new(1e-7, -0.0, 3.4e10), q, pressure: 0.8 },
        Event::Point { t: 0.04, stroke, p: Vec3::ONE, q: Quat::IDENTITY, pressure: 0.5 },
        Event::Point { t: 0.05, stroke, p: Vec3::ONE, q, pressure: 1.0 },
        Event::Point { t: 0.06, stroke, p: Vec3::ONE, q: Quat::IDENTITY, pressure: 1.0 },
        Event::End { t: 0.07, stroke },
        SOLE.erase(stroke),
        SOLE.undo(),
        SOLE.redo(),
        SOLE.moved([stroke, StrokeId(0)], Vec3::new(0.0, 0.5, 0.0)),
        SOLE.grouped(GroupId(3), [stroke], None),
        SOLE.grouped(GroupId(4), [], Some(GroupId(3))),
        SOLE.placed(GroupId(3), Transform { p: Vec3::X, q, s: 2.0 }),
        Event::Step { author: Author::SOLE, t: 0.135, edits: 3 },
        layer(Some("sky".into()), Some(true), None),
        layer(None, None, Some(false)),
        Event::Assign { author: Author::SOLE, t: 0.138, layer: 2, strokes: vec![stroke, StrokeId(0)] },
        Event::View { author: Author::SOLE, t: 0.139, slot: 3, p: Vec3::X, q, distance: 2.5 },
        polygon(Some(StrokeId(9)), [Vec3::ZERO, Vec3::X, Vec3::Y], (1.0, 1.0, 1.0, 0.5)),
    ]
}

/// Coordinates of every magnitude, including special values: zeros of both signs, subnormals, the limits.
pub(crate) fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -10.0f32..10.0,
        2 => any::<u32>().prop_map(f32::from_bits).prop_filter("in range", |x| x.abs() <= 1e15),
        1 => Just(0.0),
        1 => Just(-0.0),
        1 => Just(f32::MIN_POSITIVE / 8.0),
        1 => Just(1e15),
    ]
}

pub(crate) fn time() -> impl Strategy<Value = f64> {
    prop_oneof![4 => 0.0..1e5, 1 => any::<f64>().prop_filter("finite", |t| t.is_finite()), 1 => Just(-0.0)]
}

fn point() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

fn rotation() -> impl Strategy<Value = Quat> {
    let any = [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0]
        .prop_map(Quat::from_array)
        .prop_filter("not zero", |q| q.length() > 0.01)
        .prop_map(Quat::normalize);
    prop_oneof![4 => any, 1 => Just(Quat::IDENTITY), 1 => Just(Quat::from_xyzw(-0.0, 0.0, 0.0, 1.0))]
}

fn stroke() -> impl Strategy<Value = StrokeId> {
    any::<u32>().prop_map(StrokeId)
}

fn color() -> impl Strategy<Value = (f32, f32, f32, f32)> {
    (0.0f32..=1.0, 0.0f32..=1.0, 0.0f32..=1.0, 0.0f32..=1.0)
}

fn pressure() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 0.0f32..=1.0, 1 => Just(1.0)]
}

pub(crate) fn pose_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (time(), point(), rotation()).prop_map(|(t, p, q)| Event::Head { author: Author::SOLE, t, p, q }),
        (time(), stroke(), point(), rotation(), pressure())
            .prop_map(|(t, stroke, p, q, pressure)| Event::Point { t, stroke, p, q, pressure }),
    ]
}

/// The extensions of a stroke in frame 2 of an animation.
fn frame_two() -> Option<Box<SketchExtensions>> {
    let text = "IAAAAAAAAAAEAAAAAgAAAA==".to_owned();
    let extensions: SketchExtensions = text.try_into().expect("sound extensions");
    assert_eq!(extensions.frame(), Some(2));
    Some(Box::new(extensions))
}

pub(crate) fn event() -> impl Strategy<Value = Event> {
    let tool = prop_oneof![Just(Tool::Ribbon), Just(Tool::Wall), Just(Tool::Tube)];
    let normal = prop_oneof![
        Just(NormalRule::LocalX),
        Just(NormalRule::SideX),
        Just(NormalRule::Travel),
        Just(NormalRule::Transport),
    ];
    let paint = prop::option::of(("[ -~]{0,64}", any::<[u32; 4]>(), 1e-6f32..1e6, any::<bool>()).prop_map(
        |(brush, [seed, layer, sketch_group, sketch_flags], scale, hidden)| {
            let sketch_extensions = frame_two().filter(|_| hidden);
            Box::new(Paint {
                brush,
                seed,
                scale,
                layer,
                hidden,
                sketch_group,
                sketch_flags,
                sketch_extensions,
            })
        },
    ));
    let strokes = || prop::collection::vec(stroke(), 0..20);
    let group = || any::<u32>().prop_map(GroupId);
    prop_oneof![
        4 => pose_event(),
        1 => (time(), stroke(), tool, 0.0f32..10.0, color(), normal, 0.0f32..=1.0, paint).prop_map(
            |(t, stroke, tool, width, color, normal, thinnest, paint)| Event::Begin { author: Author::SOLE,
                t, stroke, tool, width, color, normal, thinnest, paint
            }
        ),
        1 => (time(), stroke()).prop_map(|(t, stroke)| Event::End { t, stroke }),
        1 => (time(), stroke()).prop_map(|(t, stroke)| Event::Erase { author: Author::SOLE, t, stroke }),
        1 => time().prop_map(undo),
        1 => time().prop_map(|t| Event::Redo { author: Author::SOLE, t }),
        1 => (time(), strokes(), point()).prop_map(|(t, strokes, by)| Event::Move { author: Author::SOLE, t, strokes, by }),
        1 => (time(), group(), strokes(), prop::option::of(group()))
            .prop_map(|(t, group, strokes, parent)| Event::Group { author: Author::SOLE, t, group, strokes, parent, name: None }),
        1 => (time(), group(), point(), rotation(), 1e-6f32..1e6)
            .prop_map(|(t, group, p, q, s)| Event::Place { author: Author::SOLE, t, group, to: Transform { p, q, s } }),
        1 => (time(), any::<u32>()).prop_map(|(t, edits)| Event::Step { author: Author::SOLE, t, edits }),
        1 => (
            time(),
            0..Event::MAX_LAYERS,
            prop::option::of("[ -~]{0,64}"),
            prop::option::of(any::<bool>()),
            prop::option::of(any::<bool>()),
        )
            .prop_map(|(t, layer, name, hidden, locked)| Event::Layer { author: Author::SOLE, t, layer, name, hidden, locked, mine: None }),
        1 => (time(), 0..Event::MAX_VIEWS, point(), rotation(), 1e-6f32..1e6)
            .prop_map(|(t, slot, p, q, distance)| Event::View { author: Author::SOLE, t, slot, p, q, distance }),
        1 => (time(), 0..Event::MAX_LAYERS, strokes())
            .prop_map(|(t, layer, strokes)| Event::Assign { author: Author::SOLE, t, layer, strokes }),
        1 => (time(), prop::option::of(stroke()), prop::collection::vec(point(), 3..20), color())
            .prop_map(|(t, stroke, vertices, color)| Event::Polygon { author: Author::SOLE, t, stroke, vertices, shading: None, color }),
    ]
}
