//! The cases of the benches `moving` and `spikes`: the order of the boxes, and the sizes of the model.

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

/// Returns the boxes of a synthetic session, by number.
fn session(polygons: u32) -> Vec<Aabb> {
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

/// Returns random boxes in a cube of 100 metres.
fn shuffled(polygons: u32) -> Vec<Aabb> {
    let mut lot = Pcg32::new(7, 3);
    let mut unit = || lot.next_u32() as f32 / u32::MAX as f32;
    let boxes = (0..polygons).map(|_| {
        let center = (Vec3::new(unit(), unit(), unit()) - 0.5) * 100.0;
        Aabb::cube(center, 0.05 + 0.2 * unit())
    });
    boxes.collect()
}

/// The words of the command line, which select the cases. Without words, all cases run.
pub(crate) struct Cases {
    words: Vec<String>,
}

/// Returns the boxes of a model with about this number of polygons.
pub(crate) type MakeBoxes = fn(u32) -> Vec<Aabb>;

impl Cases {
    pub(crate) fn of_command_line() -> Self {
        Self { words: std::env::args().skip(1).collect() }
    }

    pub(crate) fn has(&self, word: &str) -> bool {
        self.words.iter().any(|w| w == word)
    }

    /// Returns the sizes on the command line, polygons, or else the usual sizes.
    pub(crate) fn sizes(&self, usual: &[u32]) -> Vec<u32> {
        let sizes: Vec<u32> = self.words.iter().filter_map(|size| size.parse().ok()).collect();
        if sizes.is_empty() { usual.to_vec() } else { sizes }
    }

    /// Returns the selected orders of the boxes, with their names.
    pub(crate) fn orders(&self) -> impl Iterator<Item = (&'static str, MakeBoxes)> {
        let all = [("drawn", session as MakeBoxes), ("shuffled", shuffled)];
        let is_named = all.iter().any(|(order, _)| self.has(order));
        all.into_iter().filter(move |(order, _)| !is_named || self.has(order))
    }
}
