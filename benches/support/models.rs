//! Boxes of models that grow.

use osp::{
    glam::Vec3,
    math::Aabb,
    polygon::{Change, PolygonId},
};
use osp_session::{
    recording::{SynthKind, synthesize},
    scene::Scene,
};
use rand_pcg::{Pcg32, rand_core::Rng};

/// The boxes of a synthetic session, by number.
pub(crate) fn session(polygons: u32) -> Vec<Aabb> {
    let (mut scene, mut changes, mut boxes) = (Scene::new(), Vec::new(), Vec::new());
    for event in synthesize(SynthKind::Scribble, polygons, 1) {
        changes.clear();
        scene.apply(&event.expect("a synthetic session is whole"), &mut changes);
        for change in &changes {
            if let Change::Insert(PolygonId(id)) = *change
                && id as usize == boxes.len()
            {
                boxes.push(scene.bounds(PolygonId(id)));
            }
        }
    }
    boxes
}

/// Boxes in a cube of 100 metres, in no order.
pub(crate) fn shuffled(polygons: u32) -> Vec<Aabb> {
    let mut lot = Pcg32::new(7, 3);
    let mut unit = || lot.next_u32() as f32 / u32::MAX as f32;
    let boxes = (0..polygons).map(|_| {
        let center = (Vec3::new(unit(), unit(), unit()) - 0.5) * 100.0;
        Aabb::cube(center, 0.05 + 0.2 * unit())
    });
    boxes.collect()
}
