//! The painter's algorithm: polygons are drawn back to front, each over what is there, with no test of depth.
//!
//! In which order is the question. By the distance of the polygons' middles ([`Painter::Centre`]) a large polygon may come
//! too late or too early, and two that pass through each other have no right order at all. A BSP tree ([`Painter::Bsp`],
//! H. Fuchs, Z. M. Kedem, B. F. Naylor, "On Visible Surface Generation by A Priori Tree Structures", 1980) cuts polygons by
//! planes of others until there is a right order, from wherever the eye is.

mod bsp;
mod draw;
mod list;

use glam::{DVec3, Vec3};
use thiserror::Error;

pub use bsp::BspTree;
pub(super) use draw::PartPass;
pub use list::{PaintList, PaintStats};

use osp::polygon::{PolygonId, VisibleBlocks};
use osp_session::scene::Scene;

/// How the painter finds out what is behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Painter {
    /// By a BSP tree of the polygons: always right.
    Bsp,
    /// By the distance of the polygons' middles: often wrong.
    Centre,
}

impl Painter {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Bsp, Self::Centre];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bsp => "bsp",
            Self::Centre => "centre",
        }
    }
}

/// Why a painter gives up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum PainterError {
    /// There is too much in view.
    #[error(
        "{polygons} polygons are in view: a painter draws at most {MOST_POLYGONS}; look at an earlier frame or a part of the model"
    )]
    TooMany {
        /// Polygons in view.
        polygons: usize,
    },
    /// They cut each other into too many parts.
    #[error(
        "the polygons in view cut each other into more than {MOST_PARTS} parts: a painter draws no more; look at an earlier frame or a part of the model"
    )]
    TooManyParts,
}

/// Most polygons that a painter takes.
pub const MOST_POLYGONS: usize = 250_000;
/// Most parts that a tree may cut them into: some 300 MB.
pub const MOST_PARTS: usize = 1_000_000;

/// A polygon of the scene, or one of the two triangles of a quad that is not flat, as the painter takes it.
#[derive(Clone, Copy, Debug)]
struct Facet {
    polygon: PolygonId,
    corners: [Vec3; 4],
    count: usize,
}

impl Facet {
    fn corners(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }

    /// Unit length; zero where there is no area.
    fn normal(&self) -> DVec3 {
        let [a, b, c, d] = self.corners.map(|p| p.as_dvec3());
        let area = if self.count == 4 { (c - a).cross(d - b) } else { (b - a).cross(c - a) };
        area.normalize_or_zero()
    }
}

/// The polygons as facets. A quad is drawn as two triangles: one whose fourth corner is farther than `tolerance_m` from the
/// plane of the others comes as these.
fn facets(scene: &Scene, polygons: &VisibleBlocks, tolerance_m: f64) -> Vec<Facet> {
    let mut facets = Vec::with_capacity(polygons.len());
    for id in polygons.ids() {
        let polygon = scene.polygon(id);
        let triangle = |a, b, c| Facet { polygon: id, corners: [a, b, c, c], count: 3 };
        match *polygon.vertices() {
            [a, b, c, d] => {
                let quad = Facet { polygon: id, corners: [a, b, c, d], count: 4 };
                let normal = quad.normal();
                let from = normal.dot(a.as_dvec3());
                let is_flat = |p: Vec3| (normal.dot(p.as_dvec3()) - from).abs() <= tolerance_m;
                match is_flat(b) && is_flat(c) && is_flat(d) {
                    true => facets.push(quad),
                    false => facets.extend([triangle(a, b, c), triangle(a, c, d)]),
                }
            }
            [a, b, c] => facets.push(triangle(a, b, c)),
            _ => {}
        }
    }
    // What has no area covers no pixel, and has no plane.
    facets.retain(|facet| facet.normal() != DVec3::ZERO);
    facets
}

/// Closer than this to a plane, a corner lies on it, metres: what the polygons' coordinates can tell apart.
fn tolerance_m(scene: &Scene, polygons: &VisibleBlocks) -> f64 {
    let farthest = polygons.ids().fold(0.0f32, |most, id| {
        let bounds = scene.bounds(id);
        most.max(bounds.min.abs().max_element()).max(bounds.max.abs().max_element())
    });
    f64::from(farthest) * 2.0e-7
}
