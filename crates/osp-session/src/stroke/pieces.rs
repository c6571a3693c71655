use glam::Vec3;

use super::Drops;
use super::polygon::{push_checked, push_quad};
use crate::{brush::Surface, recording::Shading};
use osp::polygon::ConvexPolygon;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub polygon: ConvexPolygon,
    /// Normals, texture coordinates and alpha of its corners.
    pub surface: Surface,
}

/// The polygons of a quad (none, one or two): their positions in the stroke, and the quad's corners that each polygon
/// has.
#[derive(Clone, Copy, Debug, Default)]
pub struct QuadPieces {
    first: u32,
    count: u8,
    corners: [[u8; 4]; 2],
}

impl QuadPieces {
    /// The position of the first polygon. Without polygons, it is the next free position.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// The positions of all polygons, each with the surface data of its corners.
    pub fn painted(self, surface: Surface) -> impl Iterator<Item = (u32, Surface)> {
        (self.first..).zip(self.corners).take(usize::from(self.count)).map(move |(place, corners)| {
            let is_whole = corners == [0, 1, 2, 3];
            (place, if is_whole { surface } else { surface.with_corners(corners.map(usize::from)) })
        })
    }
}

/// Changes of a stroke's polygons by a sample. Polygons before the first changed polygon stay; all others are replaced.
///
/// Positions count from the stroke's first polygon.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    kept: u32,
    /// Number of polygons that no sample removes: all up to the last polygon that an event added directly.
    fixed: u32,
    fresh: Vec<Piece>,
    /// Scratch memory: polygons that will be appended to `fresh`.
    polygons: Vec<ConvexPolygon>,
}

impl Pieces {
    /// Starts a list of changes for a stroke that has `count` polygons. The first `fixed` polygons are never replaced.
    pub fn begin(&mut self, count: u32, fixed: u32) {
        (self.kept, self.fixed) = (count, fixed);
        self.fresh.clear();
    }

    pub fn len(&self) -> u32 {
        self.kept + self.fresh.len() as u32
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Removes all polygons from position `len` on, except for fixed ones.
    pub fn truncate(&mut self, len: u32) {
        let len = len.max(self.fixed);
        self.fresh.truncate(len.saturating_sub(self.kept) as usize);
        self.kept = self.kept.min(len);
    }

    /// The position of the first changed polygon.
    pub fn kept(&self) -> u32 {
        self.kept
    }

    /// The polygons from position [`Pieces::kept`] on.
    pub fn fresh(&self) -> &[Piece] {
        &self.fresh
    }

    /// Appends a polygon. A polygon that is degenerate or out of range is counted instead.
    pub fn push(&mut self, polygon: ConvexPolygon, surface: Surface, drops: &mut Drops) {
        let before = self.fresh.len();
        self.push_all(drops, |out, drops| push_checked(polygon, out, drops));
        self.fresh[before..].iter_mut().for_each(|piece| piece.surface = surface);
    }

    /// Appends a quad. `surface` has the surface data of its corners, in the same order. A planar convex quad becomes
    /// one polygon. If two neighbouring corners coincide, the quad becomes one triangle, otherwise two triangles. The
    /// surface data of a triangle repeat its last corner.
    pub fn push_quad(&mut self, corners: [Vec3; 4], surface: Surface, drops: &mut Drops) -> QuadPieces {
        let before = self.fresh.len();
        let mut pieces = self.no_quad();
        // If two neighbouring corners coincide, the quad is a triangle.
        let double = (0..4).find(|&i| corners[i] == corners[(i + 1) % 4]);
        self.push_all(drops, |out, drops| match double.map(|i| [1, 2, 3].map(|k| corners[(i + k) % 4])) {
            Some([a, b, c]) => push_checked(ConvexPolygon::triangle(a, b, c), out, drops),
            None => push_quad(corners, out, drops),
        });
        for (piece, places) in self.fresh[before..].iter_mut().zip(&mut pieces.corners) {
            // Each corner of a triangle equals a corner of the quad, bit for bit.
            let vertices = piece.polygon.vertices();
            let place = |i: usize| {
                let vertex = vertices[i.min(vertices.len() - 1)];
                corners.iter().position(|corner| *corner == vertex).unwrap_or(0) as u8
            };
            *places = if vertices.len() == 4 { [0, 1, 2, 3] } else { [0, 1, 2, 3].map(place) };
            pieces.count += 1;
        }
        for (place, surface) in pieces.painted(surface) {
            self.fresh[(place - self.kept) as usize].surface = surface;
        }
        pieces
    }

    /// Appends a quad, or a triangle if the first two or the last two corners coincide.
    pub fn push_side(&mut self, corners: [Vec3; 4], surface: Surface, drops: &mut Drops) {
        let [a, b, c, d] = corners;
        if c == d {
            self.push(ConvexPolygon::triangle(a, b, c), surface, drops);
        } else if a == b {
            self.push(ConvexPolygon::triangle(b, c, d), surface.with_corners([1, 2, 3, 3]), drops);
        } else {
            self.push_quad(corners, surface, drops);
        }
    }

    /// A quad without polygons at the current position.
    pub fn no_quad(&self) -> QuadPieces {
        QuadPieces { first: self.len(), ..QuadPieces::default() }
    }

    /// Gives all new pieces this colour, sRGB.
    pub fn paint(&mut self, color: [u8; 3]) {
        self.fresh.iter_mut().for_each(|piece| piece.surface = piece.surface.with_color(color));
    }

    /// Gives all new pieces the shading of the polygon that they are parts of.
    pub fn shade(&mut self, vertices: &[Vec3], shading: &Shading) {
        for piece in &mut self.fresh {
            let corners = piece.polygon.vertices();
            // Each corner of a piece equals a corner of the polygon, bit for bit.
            let place = |i: usize| {
                let corner = corners[i.min(corners.len() - 1)];
                vertices.iter().position(|p| *p == corner).unwrap_or_default()
            };
            let places = [0, 1, 2, 3].map(place);
            let uv = places.map(|at| shading.uv.get(at).copied().unwrap_or_default());
            let alpha = places.map(|at| shading.alpha.get(at).copied().unwrap_or(1.0));
            piece.surface = match shading.normals[..] {
                [] => Surface::flat(uv, alpha),
                ref normals => {
                    Surface::smooth(places.map(|at| normals.get(at).copied().unwrap_or(Vec3::Y)), uv, alpha)
                }
            };
        }
    }

    /// Appends polygons without texture.
    pub fn push_all(&mut self, drops: &mut Drops, make: impl FnOnce(&mut Vec<ConvexPolygon>, &mut Drops)) {
        make(&mut self.polygons, drops);
        let plain = |polygon| Piece { polygon, surface: Surface::PLAIN };
        self.fresh.extend(self.polygons.drain(..).map(plain));
    }
}
