//! The painter's algorithm: polygons are drawn back to front, each over the polygons before it, without a depth test.
//!
//! The difficulty is the order. If polygons are ordered by the distances of their centres ([`Painter::Centre`]), a
//! large polygon may come too early or too late. Two polygons that pass through each other have no right order at all.
//! A BSP tree ([`Painter::Bsp`], [`osp_rivals::Bsp`]) cuts polygons by the planes of other polygons until every eye
//! position has a right order.

mod draw;
mod list;

use glam::{DVec3, Vec3};
use thiserror::Error;

pub(super) use draw::PartPass;
pub use list::{PaintList, PaintStats};

use osp::polygon::{ConvexPolygon, PolygonId, VisibleBlocks};
use osp_session::scene::Scene;

/// The method by which the painter finds the order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Painter {
    /// By a BSP tree of the polygons. The order is right except for a few parts ([`PaintStats::unordered`]).
    Bsp,
    /// By the distance of the polygons' centres. The order is often wrong.
    Centre,
}

impl Painter {
    pub const ALL: [Self; 2] = [Self::Bsp, Self::Centre];

    pub fn name(self) -> &'static str {
        match self {
            Self::Bsp => "bsp",
            Self::Centre => "centre",
        }
    }
}

/// The reason why a painter draws nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PainterError {
    #[error(
        "{polygons} polygons are in view: a painter draws at most {MOST_POLYGONS}; look at an earlier frame or a part of the model"
    )]
    TooMany { polygons: usize },
}

pub const MOST_POLYGONS: usize = 250_000;

/// A polygon of the scene, or one of the two triangles of a quad that is not flat.
#[derive(Clone, Copy, Debug)]
struct Facet {
    polygon: PolygonId,
    shape: ConvexPolygon,
}

impl Facet {
    fn corners(&self) -> &[Vec3] {
        self.shape.vertices()
    }

    /// The unit normal; zero if the facet has no area.
    fn normal(&self) -> DVec3 {
        let between = |from: Vec3, to: Vec3| to.as_dvec3() - from.as_dvec3();
        let area = match *self.corners() {
            [a, b, c, d] => between(a, c).cross(between(b, d)),
            [a, b, c] => between(a, b).cross(between(a, c)),
            _ => DVec3::ZERO,
        };
        area.normalize_or_zero()
    }
}

/// Converts polygons to facets. The renderer draws a quad as two triangles. These triangles become two facets if the
/// quad's fourth corner is farther than `tolerance_m` from the plane of the others.
fn facets(scene: &Scene, polygons: &VisibleBlocks, tolerance_m: f64) -> Vec<Facet> {
    let mut facets = Vec::with_capacity(polygons.len());
    for id in polygons.ids() {
        let whole = Facet { polygon: id, shape: scene.polygon(id) };
        let normal = whole.normal();
        let height_m = |p: Vec3| normal.dot(p.as_dvec3());
        match *whole.corners() {
            [a, b, c, d] if [b, c, d].iter().any(|&p| (height_m(p) - height_m(a)).abs() > tolerance_m) => {
                let halves = [ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(a, c, d)];
                facets.extend(halves.map(|shape| Facet { polygon: id, shape }));
            }
            _ => facets.push(whole),
        }
    }
    // A facet without area covers no pixel, and has no plane.
    facets.retain(|facet| facet.normal() != DVec3::ZERO);
    facets
}

/// A corner closer to a plane than this distance counts as on the plane, metres. It is the precision of the polygons'
/// coordinates.
fn tolerance_m(scene: &Scene, polygons: &VisibleBlocks) -> f64 {
    let farthest = polygons.ids().fold(0.0f32, |most, id| {
        let bounds = scene.bounds(id);
        most.max(bounds.min.abs().max_element()).max(bounds.max.abs().max_element())
    });
    f64::from(farthest) * 2.0e-7
}
