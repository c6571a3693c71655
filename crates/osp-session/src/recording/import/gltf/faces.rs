//! Converts the triangles of a primitive to polygons with one colour each.

use glam::{DAffine3, DMat3, Mat3, Vec2, Vec3, Vec4};
use gltf_json::{
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};

use super::{
    accessor::Elements,
    container::File,
    surfaces::{Surface, Surfaces},
};
use crate::brush::{Brush, BrushAtRest};
use crate::recording::{
    error::Mismatch,
    import::paint::{Corner, Painted, Splitter},
};
use osp::math::is_flat_and_convex;

#[derive(Default)]
pub(super) struct Faces {
    next: usize,
    /// The previous triangle, if it may form a quad with the next triangle.
    pending: Option<[u32; 3]>,
    /// The fault of the first skipped triangle that was not reported yet.
    pub(super) fault: Option<Mismatch>,
}

impl Faces {
    /// Decodes at most `most` further triangles. Returns `false` after the last triangle.
    pub(super) fn decode(
        &mut self,
        file: &File,
        (surfaces, splitter): (&Surfaces, &mut Splitter),
        primitive: &Primitive,
        residual: &DAffine3,
        most: usize,
        out: &mut Vec<Painted>,
    ) -> Result<bool, Mismatch> {
        let Some(mesh) = Mesh::new(file, surfaces, primitive, residual)? else { return Ok(false) };
        let look = surfaces.look(mesh.surface);
        let mut push = |fault: &mut Option<Mismatch>, numbers: &[u32]| {
            let corners: Vec<Corner> = numbers.iter().map(|&number| mesh.corner(number)).collect();
            match Corner::check(&corners) {
                Err(expected) => {
                    fault.get_or_insert(Mismatch::new(expected, format!("vertices {numbers:?}")));
                }
                Ok(()) if mesh.brush.is_some() => out.push(Painted::by_brush(&corners)),
                Ok(()) => splitter.paint(&corners, &look, out),
            }
        };
        let count = mesh.triangles();
        let end = count.min(self.next.saturating_add(most));
        while self.next < end {
            let triangle = mesh.triangle(self.next);
            self.next += 1;
            if let Some(number) = triangle.into_iter().find(|&number| number as usize >= mesh.positions.len())
            {
                let expected = format!("vertices below {}", mesh.positions.len());
                self.fault.get_or_insert(Mismatch::new(expected, format!("vertex {number}")));
                continue;
            }
            let Some(before) = self.pending.replace(triangle) else { continue };
            match mesh.quad(before, triangle) {
                Some(quad) => {
                    self.pending = None;
                    push(&mut self.fault, &quad);
                }
                None => push(&mut self.fault, &before),
            }
        }
        if self.next == count
            && let Some(last) = self.pending.take()
        {
            push(&mut self.fault, &last);
        }
        Ok(self.next < count)
    }
}

struct Mesh<'a> {
    positions: Elements<'a>,
    colors: Option<Elements<'a>>,
    indices: Option<Elements<'a>>,
    mode: Mode,
    normals: Option<Elements<'a>>,
    uvs: Option<Elements<'a>>,
    surface: &'a Surface,
    brush: Option<&'static Brush>,
    residual: DAffine3,
    /// Transform of normals.
    turn: Mat3,
}

impl<'a> Mesh<'a> {
    /// Opens the primitive's data; `None` if the primitive consists of points or lines.
    fn new(
        file: &'a File,
        surfaces: &'a Surfaces,
        primitive: &Primitive,
        residual: &DAffine3,
    ) -> Result<Option<Self>, Mismatch> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(Mismatch::new("a mode of 0 to 6", "another"));
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            return Ok(None);
        }
        let attribute = |semantic: Semantic| {
            let found = primitive.attributes.get(&Checked::Valid(semantic));
            found.map(|accessor| Elements::new(file, accessor.value())).transpose()
        };
        let positions = attribute(Semantic::Positions)?.filter(|of| of.width == 3);
        let positions = positions.ok_or_else(|| Mismatch::new("positions as VEC3", "none"))?;
        let surface = surfaces.of(primitive.material.map(|material| material.value()));
        let brush = surface.brush_of(primitive);
        // A brush of our own files has its colours beside those that other programs show.
        let own = u32::from(brush.is_some() && surface.brush.is_none());
        let colors = attribute(Semantic::Colors(own))?.filter(|of| of.width >= 3);
        if let Some(colors) = &colors
            && colors.len() < positions.len()
        {
            let found = format!("{} colours", colors.len());
            return Err(Mismatch::new(format!("as many colours as positions, {}", positions.len()), found));
        }
        let indices = primitive.indices.map(|accessor| Elements::new(file, accessor.value())).transpose()?;
        if indices.as_ref().is_some_and(|indices| indices.width != 1) {
            return Err(Mismatch::new("indices as SCALAR", "vectors"));
        }
        let uvs = attribute(Semantic::TexCoords(surface.coordinates))?.filter(|of| of.width == 2);
        let normals = attribute(Semantic::Normals)?.filter(|of| of.width == 3);
        Ok(Some(Self {
            positions,
            colors,
            normals,
            uvs,
            indices,
            mode,
            surface,
            brush,
            turn: turn_of(residual),
            residual: *residual,
        }))
    }

    fn triangles(&self) -> usize {
        let corners = self.indices.as_ref().map_or(self.positions.len(), Elements::len);
        match self.mode {
            Mode::Triangles => corners / 3,
            _ => corners.saturating_sub(2),
        }
    }

    fn triangle(&self, at: usize) -> [u32; 3] {
        let places = match self.mode {
            Mode::Triangles => [3 * at, 3 * at + 1, 3 * at + 2],
            Mode::TriangleFan => [0, at + 1, at + 2],
            // Every second triangle of a strip has the opposite winding.
            _ if at % 2 == 1 => [at + 1, at, at + 2],
            _ => [at, at + 1, at + 2],
        };
        places.map(|place| match &self.indices {
            Some(indices) => indices.integer(place),
            None => place as u32,
        })
    }

    fn corner(&self, number: u32) -> Corner {
        let at = number as usize;
        let color = self.colors.as_ref().map_or([1.0; 4], |colors| colors.vector(at, [1.0; 4]));
        let [u, v, ..] = self.uvs.as_ref().map_or([0.0; 4], |uvs| uvs.vector(at, [0.0; 4]));
        let uv = self.surface.transform.transform_point2(Vec2::new(u, v));
        let is_ours = self.surface.brush.is_none();
        let uv = self.brush.filter(|_| is_ours).map_or(uv, |brush| BrushAtRest::brush_uv(brush, uv));
        let [x, y, z, _] = self.normals.as_ref().map_or([0.0; 4], |normals| normals.vector(at, [0.0; 4]));
        let normal = self.turn * Vec3::new(x, y, z);
        Corner { p: self.position(number), normal, uv, color: Vec4::from(color) }
    }

    fn position(&self, number: u32) -> Vec3 {
        let [x, y, z, _] = self.positions.vector(number as usize, [0.0; 4]);
        let corner = Vec3::new(x, y, z);
        if self.residual == DAffine3::IDENTITY {
            return corner;
        }
        self.residual.transform_point3(corner.as_dvec3()).as_vec3()
    }

    /// The flat, convex quad that two triangles form. Its diagonal is the triangles' shared edge.
    fn quad(&self, one: [u32; 3], other: [u32; 3]) -> Option<[u32; 4]> {
        let turned = |[a, b, c]: [u32; 3]| [[a, b, c], [b, c, a], [c, a, b]];
        let mut pairs = turned(one).into_iter().flat_map(|one| turned(other).map(|other| (one, other)));
        let ([a, b, c], [_, _, d]) = pairs.find(|([a, _, c], [x, y, _])| a == x && c == y)?;
        let quad = [a, b, c, d];
        (b != d && is_flat_and_convex(quad.map(|number| self.position(number)))).then_some(quad)
    }
}

/// The transform of normals under a transform of points; 0 if it flattens everything.
fn turn_of(points: &DAffine3) -> Mat3 {
    let [x, y, z] = [points.matrix3.x_axis, points.matrix3.y_axis, points.matrix3.z_axis];
    // The cofactors are the inverse's transpose, but for a factor.
    let turn = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    let largest = turn.x_axis.length().max(turn.y_axis.length()).max(turn.z_axis.length());
    if largest > 0.0 && largest.is_finite() { (turn * (1.0 / largest)).as_mat3() } else { Mat3::ZERO }
}
