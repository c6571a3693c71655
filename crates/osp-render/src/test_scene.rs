use glam::Vec3;
use osp_session::{
    recording::{Author, Event},
    scene::Scene,
};

/// A scene of polygons with these corners and colours.
pub(crate) fn of(polygons: impl IntoIterator<Item = (Vec<Vec3>, (f32, f32, f32, f32))>) -> Scene {
    let mut scene = Scene::new();
    for (vertices, color) in polygons {
        let event =
            Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, shading: None, color };
        scene.apply(&event, &mut Vec::new());
    }
    scene
}
