use std::sync::Arc;

use glam::{Quat, Vec3};
use osp::{
    polygon::{Change, PolygonId, VisibleBlocks},
    view::{Projection, View},
};
use osp_render::{Gpu, Image, Layer, Offscreen, RendererConfig};
use osp_session::{
    recording::{Author, Event, NormalRule, StrokeId, Tool},
    scene::Scene,
};
use osp_testkit::events::Begin;

/// A drawer of pictures of this size.
pub(crate) fn drawer(gpu: &Arc<Gpu>, (width, height): (u32, u32)) -> Offscreen {
    Offscreen::on(Arc::clone(gpu), width, height, &RendererConfig::default()).expect("a drawer")
}

/// The picture of these polygons.
pub(crate) fn picture_of(drawer: &mut Offscreen, scene: &Scene, view: &View, ids: &[PolygonId]) -> Image {
    drawer.draw(scene, view, &[Layer::plain(&set(ids))]).expect("a drawn frame");
    drawer.image().expect("a picture")
}

/// The picture of all polygons.
pub(crate) fn picture(drawer: &mut Offscreen, scene: &Scene, view: &View) -> Image {
    picture_of(drawer, scene, view, &all_ids(scene))
}

/// The colour of a pixel.
pub(crate) fn pixel<const CHANNELS: usize>(image: &Image, x: u32, y: u32) -> [u8; CHANNELS] {
    let at = (y * image.width() + x) as usize * 4;
    image.rgba()[at..at + CHANNELS].try_into().expect("its bytes")
}

/// The width, the height and the bytes of a PNG.
pub(crate) fn read_png(path: &std::path::Path) -> (u32, u32, Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut bytes).expect("a PNG");
    bytes.truncate(info.buffer_size());
    (info.width, info.height, bytes)
}

/// An adapter, or a line that says why there is none.
pub(crate) fn gpu() -> Option<Arc<Gpu>> {
    match Gpu::headless() {
        Ok(gpu) => Some(Arc::new(gpu)),
        Err(error) if osp_testkit::nothing_may_be_skipped() => panic!("{error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

pub(crate) fn apply(scene: &mut Scene, events: &[Event]) -> Vec<Change> {
    let mut changes = Vec::new();
    for event in events {
        scene.apply(event, &mut changes);
    }
    changes
}

/// A square that faces +z, with its middle at `center`.
pub(crate) fn square(center: Vec3, half_m: f32, color: (f32, f32, f32, f32)) -> Event {
    let corner = |x: f32, y: f32| center + Vec3::new(x, y, 0.0) * half_m;
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, shading: None, color }
}

/// A stroke that winds around the y axis.
pub(crate) fn winding_stroke(
    number: u32,
    tool: Tool,
    points: u32,
    color: (f32, f32, f32, f32),
) -> Vec<Event> {
    let stroke = StrokeId(number);
    let (t, normal, thinnest) = (0.0, NormalRule::Transport, 0.3);
    let mut events = vec![Begin { tool, width: 0.08, color, normal, thinnest, ..Begin::of(stroke) }.event()];
    for i in 0..points {
        let angle = i as f32 * 0.21 + number as f32;
        let radius = 0.3 + 0.05 * (number % 7) as f32;
        let height = 0.1 * (number % 11) as f32 + 0.004 * i as f32;
        let p = Vec3::new(radius * angle.cos(), height, radius * angle.sin());
        events.push(Event::Point { t, stroke, p, q: Quat::IDENTITY, pressure: 0.5 + 0.4 * angle.sin() });
    }
    events.push(Event::End { t, stroke });
    events
}

/// A few dozen strokes of every kind, some of them transparent, and a wall.
pub(crate) fn sketch() -> Vec<Event> {
    let mut events = vec![square(Vec3::new(0.0, 0.6, -0.6), 0.5, (0.8, 0.8, 0.75, 1.0))];
    for number in 0..24 {
        let tool = if number % 3 == 0 { Tool::Tube } else { Tool::Ribbon };
        let part = number as f32 / 24.0;
        let opacity = if number % 4 == 1 { 0.4 } else { 1.0 };
        events.extend(winding_stroke(number, tool, 90, (part, 1.0 - part, 0.6, opacity)));
    }
    events
}

pub(crate) fn view_from(eye: Vec3, target: Vec3) -> View {
    View::look_at(eye, target, Projection::symmetric(60.0, 4.0 / 3.0, 0.01, 100.0))
}

pub(crate) fn all_ids(scene: &Scene) -> Vec<PolygonId> {
    scene.visible_ids().collect()
}

/// The set of these polygons.
pub(crate) fn set(ids: &[PolygonId]) -> VisibleBlocks {
    ids.iter().copied().collect()
}
