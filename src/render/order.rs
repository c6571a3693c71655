use std::ops::Range;

use glam::Vec3;

use crate::scene::{PolygonId, Scene};

/// Whether polygons hide what is behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// They do.
    Opaque,
    /// What is behind shines through.
    Transparent,
}

/// A part of the list to draw that takes one draw call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Places in [`DrawOrder::ids`].
    pub range: Range<u32>,
    /// Which polygons of the scene it reaches: those from `page` times the page's length.
    pub page: u32,
    /// Which style they are drawn in.
    pub style: u32,
    /// How they are blended.
    pub blend: Blend,
}

/// Opaque polygons are sorted into this many steps of distance; a step is about 6 % of the distance.
const STEPS: usize = 1 << (32 - STEP_SHIFT);
/// Bits of a squared distance that do not matter: sign and exponent and three bits of the mantissa stay.
const STEP_SHIFT: u32 = 20;

/// The order in which polygons are drawn, rebuilt every frame in memory that is kept.
///
/// Opaque polygons: by step of distance to the eye, then by number; transparent ones: by distance, farthest first,
/// then by number. The place of a polygon among others does not depend on what else is in the list, nor on the order
/// in which it came in: leaving out what is hidden leaves the picture as it is.
#[derive(Clone, Debug, Default)]
pub struct DrawOrder {
    ids: Vec<u32>,
    runs: Vec<Run>,
    /// One bit for each polygon of the list at hand.
    marks: Vec<u64>,
    opaque: Vec<(u32, u16)>,
    /// Distance squared (its bits sort like the number), place in the list of styles, polygon.
    transparent: Vec<(u32, u32, u32)>,
    steps: Vec<u32>,
}

impl DrawOrder {
    /// An empty order.
    pub fn new() -> Self {
        Self::default()
    }

    /// The polygons' numbers in the order of drawing.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// The draw calls, in order: all opaque ones first.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Starts a new frame.
    pub fn clear(&mut self) {
        self.ids.clear();
        self.runs.clear();
        self.transparent.clear();
    }

    /// Adds a list of polygons, each once whatever the list says, to be drawn in `style`. Numbers that the scene does
    /// not have are left out.
    pub fn add(
        &mut self,
        scene: &Scene,
        ids: &[PolygonId],
        style: u32,
        eye_in_world: Vec3,
        page_len: usize,
        blend_of: impl Fn(PolygonId) -> Blend,
    ) {
        let count = scene.polygon_count();
        self.marks.resize(count.div_ceil(64), 0);
        for id in ids.iter().filter(|id| id.index() < count) {
            self.marks[id.index() / 64] |= 1 << (id.index() % 64);
        }
        // Reading the marks gives the polygons in the order of their numbers, page after page.
        let mut page = 0;
        for word in 0..self.marks.len() {
            let mut bits = std::mem::take(&mut self.marks[word]);
            while bits != 0 {
                let id = PolygonId((word * 64) as u32 + bits.trailing_zeros());
                bits &= bits - 1;
                if id.index() / page_len != page {
                    self.end_page(page, style);
                    page = id.index() / page_len;
                }
                // A distance that is not a number sorts as the farthest; it is drawn all the same.
                let distance_squared = scene.bounds(id).center().distance_squared(eye_in_world).to_bits();
                match blend_of(id) {
                    Blend::Opaque => self.opaque.push((id.0, (distance_squared >> STEP_SHIFT) as u16)),
                    Blend::Transparent => self.transparent.push((distance_squared, style, id.0)),
                }
            }
        }
        self.end_page(page, style);
    }

    /// Sorts the opaque polygons of one page by steps (a counting sort: equal steps keep the order of numbers).
    fn end_page(&mut self, page: usize, style: u32) {
        if self.opaque.is_empty() {
            return;
        }
        self.steps.clear();
        self.steps.resize(STEPS, 0);
        for (_, step) in &self.opaque {
            self.steps[*step as usize] += 1;
        }
        let first = self.ids.len() as u32;
        let mut at = first;
        for step in &mut self.steps {
            at += std::mem::replace(step, at);
        }
        self.ids.resize(at as usize, 0);
        for (id, step) in self.opaque.drain(..) {
            let place = &mut self.steps[step as usize];
            self.ids[*place as usize] = id;
            *place += 1;
        }
        self.runs.push(Run { range: first..at, page: page as u32, style, blend: Blend::Opaque });
    }

    /// Ends the frame: appends the transparent polygons of all lists.
    pub fn finish(&mut self, page_len: usize) {
        self.transparent.sort_unstable_by(|a, b| b.0.cmp(&a.0).then_with(|| (a.2, a.1).cmp(&(b.2, b.1))));
        for &(_, style, id) in &self.transparent {
            let page = id / page_len as u32;
            let at = self.ids.len() as u32;
            self.ids.push(id);
            match self.runs.last_mut() {
                Some(run) if run.blend == Blend::Transparent && run.page == page && run.style == style => {
                    run.range.end = at + 1;
                }
                _ => self.runs.push(Run { range: at..at + 1, page, style, blend: Blend::Transparent }),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Event;

    /// Polygon `i` lies `i + 1` metres in front of the origin.
    fn scene_of(count: u32) -> Scene {
        let mut scene = Scene::new();
        let mut changes = Vec::new();
        for i in 0..count {
            let z = -(i as f32 + 1.0);
            let corner = |x, y| Vec3::new(x, y, z);
            let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
            let event = Event::Polygon { t: 0.0, stroke: None, vertices, color: (1.0, 1.0, 1.0, 1.0) };
            scene.apply(&event, &mut changes);
        }
        scene
    }

    fn order_of(ids: &[u32], page_len: usize, blend: Blend) -> DrawOrder {
        let scene = scene_of(200);
        let ids: Vec<_> = ids.iter().map(|&i| PolygonId(i)).collect();
        let mut order = DrawOrder::new();
        order.add(&scene, &ids, 0, Vec3::ZERO, page_len, |_| blend);
        order.finish(page_len);
        order
    }

    #[test]
    fn opaque_polygons_go_front_to_back_and_transparent_ones_back_to_front() {
        let near_and_far = [150, 3, 70, 20, 3];
        assert_eq!(order_of(&near_and_far, 1000, Blend::Opaque).ids(), [3, 20, 70, 150]);
        assert_eq!(order_of(&near_and_far, 1000, Blend::Transparent).ids(), [150, 70, 20, 3]);
    }

    #[test]
    fn the_place_of_a_polygon_does_not_depend_on_the_others() {
        let all: Vec<u32> = (0..200).rev().collect();
        let some: Vec<u32> = (0..200).filter(|i| i % 3 != 0).collect();
        for blend in [Blend::Opaque, Blend::Transparent] {
            let mut of_all = order_of(&all, 1000, blend).ids().to_vec();
            of_all.retain(|i| i % 3 != 0);
            assert_eq!(of_all, order_of(&some, 1000, blend).ids());
        }
    }

    #[test]
    fn every_page_is_a_run_of_its_own() {
        let all: Vec<u32> = (0..200).collect();
        let order = order_of(&all, 64, Blend::Opaque);
        let pages: Vec<_> = order.runs().iter().map(|run| (run.page, run.range.len())).collect();
        assert_eq!(pages, [(0, 64), (1, 64), (2, 64), (3, 8)]);
        for run in order.runs() {
            let ids = &order.ids()[run.range.start as usize..run.range.end as usize];
            assert!(ids.iter().all(|id| id / 64 == run.page));
        }
        assert_eq!(order_of(&[199, 7, 64], 64, Blend::Transparent).runs().len(), 3);
    }

    #[test]
    fn unknown_numbers_are_left_out() {
        assert_eq!(order_of(&[5, 200, u32::MAX], 1000, Blend::Opaque).ids(), [5]);
    }
}
