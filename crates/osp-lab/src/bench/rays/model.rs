//! The model for ray queries: its polygons, and the positions of the queries.

use glam::Vec3;

use crate::{Contender, bench::curves::synthetic_name, scenes::Random};
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Ray},
    polygon::{ConvexPolygon, PolygonId},
};
use osp_rivals::Bsp;
use osp_session::{recording::RecordingError, scene::Scene};

/// Polygons numbered in drawing order.
#[derive(Clone, Debug)]
pub struct RaysModel {
    pub recording: String,
    pub(in crate::bench) polygons: Vec<ConvexPolygon>,
    pub(in crate::bench) boxes: Vec<Aabb>,
    pub(in crate::bench) root: Aabb,
}

impl RaysModel {
    /// The visible polygons of a scene.
    pub fn of_scene(recording: &str, scene: &Scene, root: Aabb) -> Self {
        let ids = (0..scene.polygon_count()).map(|id| PolygonId(id as u32));
        let polygons: Vec<ConvexPolygon> =
            ids.filter(|&id| scene.is_visible(id)).map(|id| scene.polygon(id)).collect();
        Self::new(recording, polygons, root)
    }

    /// The first polygons of a synthetic session of loose strokes in a 4 m cube.
    ///
    /// # Errors
    /// Never, because synthetic sessions have no damage.
    pub fn synthetic(polygons: u32) -> Result<Self, RecordingError> {
        let drawing = super::super::growth::Drawing::new(polygons, polygons as usize)?;
        let mut shapes = drawing.shapes;
        shapes.truncate(polygons as usize);
        Ok(Self::new(&synthetic_name(polygons), shapes, IndexConfig::default().root))
    }

    pub(super) fn new(recording: &str, polygons: Vec<ConvexPolygon>, root: Aabb) -> Self {
        let boxes = polygons.iter().map(ConvexPolygon::bounds).collect();
        Self { recording: recording.to_owned(), polygons, boxes, root }
    }

    pub(in crate::bench) fn around(&self) -> Aabb {
        self.boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b))
    }

    /// An index of this kind with the first `count` polygons, and capacity for all.
    pub(super) fn filled(&self, kind: Contender, count: usize) -> Box<dyn SpatialIndex> {
        let config = IndexConfig { root: self.root, capacity: self.boxes.len() };
        let mut index = kind.create(&config);
        (0..count).for_each(|at| self.insert(index.as_mut(), at));
        index.commit();
        index
    }

    pub(super) fn insert(&self, index: &mut dyn SpatialIndex, at: usize) {
        let id = PolygonId(at as u32);
        // The boxes of a scene are finite, and each id is inserted once, so no error can occur.
        let inserted = index.insert(id, &self.boxes[at]);
        debug_assert_eq!(inserted, Ok(()));
        if let Some(tree) = Bsp::of(index) {
            tree.shape(id, &self.polygons[at]);
        }
    }
}

/// The queries, the same for every structure.
pub(super) struct Queries {
    /// Rays from a sphere around the model to the centres of polygons.
    pub(super) outside: Vec<Ray>,
    /// Rays from positions in the model in random directions.
    pub(super) inside: Vec<Ray>,
    /// Boxes with edges of a tenth of the model's, each around a polygon.
    pub(super) boxes: Vec<Aabb>,
    pub(super) points: Vec<Vec3>,
}

impl Queries {
    pub(super) fn new(model: &RaysModel, count: usize) -> Self {
        let around = model.around();
        let mut random = Random::new(1);
        let place =
            |random: &mut Random| random.within(around.min.as_dvec3(), around.max.as_dvec3()).as_vec3();
        let last = model.boxes.len() - 1;
        let polygon = |random: &mut Random| ((random.unit() * (last + 1) as f64) as usize).min(last);
        let far_m = around.extent().length();
        let mut queries = Self {
            outside: Vec::with_capacity(count),
            inside: Vec::with_capacity(count),
            boxes: Vec::with_capacity(count),
            points: Vec::with_capacity(count),
        };
        for _ in 0..count {
            let from = around.center() + random.direction().as_vec3() * far_m;
            let aim = model.boxes[polygon(&mut random)].center();
            queries.outside.push(Ray::new(from, aim - from));
            let from = place(&mut random);
            queries.inside.push(Ray::new(from, random.direction().as_vec3()));
            let half = around.extent() * 0.05;
            let middle = model.boxes[polygon(&mut random)].center();
            queries.boxes.push(Aabb::new(middle - half, middle + half));
            queries.points.push(place(&mut random));
        }
        queries
    }
}
