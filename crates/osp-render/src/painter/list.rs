use osp_session::platform::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::{MOST_POLYGONS, Painter, PainterError, facets, tolerance_m};
use osp::{
    index::{IndexConfig, SpatialIndex as _},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_rivals::{Bsp, BspConfig};
use osp_session::scene::Scene;

/// Largest number of parts of a tree during its construction, including parts that were cut again: some 400 MB. Beyond
/// this number, polygons are not cut.
const MOST_PARTS: usize = 3_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PartCorner {
    /// Position relative to the eye, world axes, metres.
    pub(super) from_eye: [f32; 3],
    /// The polygon of the corner, which determines the colour.
    pub(super) polygon: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PaintStats {
    /// Number of polygons; a quad that is not flat counts as two.
    pub facets: usize,
    /// Number of parts into which the polygons were cut.
    pub parts: usize,
    /// Number of parts that the tree could not order. They are ordered by distance.
    pub unordered: usize,
    /// Number of nodes of the tree; 0 without a tree.
    pub nodes: usize,
    /// Depth of the deepest node of the tree; the top has depth 0.
    pub depth: usize,
    /// Time for finding the order, nanoseconds.
    pub ns: u64,
}

/// The polygons in view, back to front.
#[derive(Clone, Debug, Default)]
pub struct PaintList {
    pub(super) corners: Vec<PartCorner>,
    pub stats: PaintStats,
}

impl PaintList {
    /// Finds the order in which a painter draws these polygons for this eye.
    ///
    /// # Errors
    /// [`PainterError`]: too many polygons are in view.
    pub fn new(
        painter: Painter,
        scene: &Scene,
        polygons: &VisibleBlocks,
        eye_in_world: Vec3,
    ) -> Result<Self, PainterError> {
        if polygons.len() > MOST_POLYGONS {
            return Err(PainterError::TooMany { polygons: polygons.len() });
        }
        let start = Instant::now();
        let mut list = Self::default();
        match painter {
            Painter::Bsp => list.by_tree(scene, polygons, eye_in_world),
            Painter::Centre => list.by_centre(scene, polygons, eye_in_world),
        }
        list.stats.ns = u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
        Ok(list)
    }

    /// Orders facets by a tree. The id of a polygon in the tree is the facet's index. Facets in one plane keep their
    /// order.
    fn by_tree(&mut self, scene: &Scene, polygons: &VisibleBlocks, eye_in_world: Vec3) {
        let facets = facets(scene, polygons, tolerance_m(scene, polygons));
        let max_pieces_per_polygon = MOST_PARTS / facets.len().max(1);
        let index = IndexConfig { capacity: facets.len(), ..IndexConfig::default() };
        let mut tree = Bsp::new(BspConfig { max_pieces_per_polygon, ..BspConfig::default() }, &index);
        for (facet, place) in facets.iter().zip((0..).map(PolygonId)) {
            // A facet that is not finite covers no pixel, so it is left out.
            if tree.insert(place, &facet.shape.bounds()).is_ok() {
                tree.shape(place, &facet.shape);
            }
        }
        tree.commit();
        let counts = tree.counts();
        self.stats = PaintStats {
            facets: facets.len(),
            parts: counts.pieces,
            unordered: counts.unordered,
            nodes: counts.nodes,
            depth: counts.depth,
            ns: 0,
        };
        tree.back_to_front(eye_in_world, &mut |place, corners| {
            self.add(facets[place.index()].polygon, corners, eye_in_world);
        });
    }

    /// Orders facets by the distance of their centres. Facets at the same distance keep their order.
    fn by_centre(&mut self, scene: &Scene, polygons: &VisibleBlocks, eye_in_world: Vec3) {
        let facets = facets(scene, polygons, tolerance_m(scene, polygons));
        let distance = |corners: &[Vec3]| {
            let middle = corners.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / corners.len() as f64;
            middle.distance_squared(eye_in_world.as_dvec3())
        };
        let mut order: Vec<_> = facets.iter().map(|facet| (distance(facet.corners()), facet)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.stats = PaintStats { facets: facets.len(), parts: facets.len(), ..PaintStats::default() };
        for (_, facet) in order {
            self.add(facet.polygon, facet.corners(), eye_in_world);
        }
    }

    /// Adds a convex part as triangles around its first corner.
    fn add(&mut self, id: PolygonId, corners: &[Vec3], eye_in_world: Vec3) {
        // The shader computes the same difference, so uncut polygons cover exactly the same pixels.
        let corner = |p: Vec3| {
            let from_eye = (p - eye_in_world).to_array();
            PartCorner { from_eye, polygon: id.0 }
        };
        let Some((&first, others)) = corners.split_first() else { return };
        for pair in others.windows(2) {
            self.corners.extend([first, pair[0], pair[1]].map(corner));
        }
    }
}
