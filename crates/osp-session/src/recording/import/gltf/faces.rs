//! Converts the triangles of a primitive to polygons with one colour each.

use glam::{DAffine3, Vec3};
use gltf_json::{
    material::{AlphaMode, Material},
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};

use super::{accessor::Elements, container::File, look::srgb_from_linear};
use crate::recording::{Author, Event, error::Mismatch};
use osp::math::is_flat_and_convex;

/// A polygon. [`channels`] decodes its colour.
pub(super) struct Polygon {
    pub(super) corners: Vec<Vec3>,
    pub(super) color: u32,
}

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
        primitive: &Primitive,
        residual: &DAffine3,
        most: usize,
        out: &mut Vec<Polygon>,
    ) -> Result<bool, Mismatch> {
        let Some(mesh) = Mesh::new(file, primitive, residual)? else { return Ok(false) };
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
                    self.push(&mesh, &quad, out);
                }
                None => self.push(&mesh, &before, out),
            }
        }
        if self.next == count
            && let Some(last) = self.pending.take()
        {
            self.push(&mesh, &last, out);
        }
        Ok(self.next < count)
    }

    fn push(&mut self, mesh: &Mesh<'_>, numbers: &[u32], out: &mut Vec<Polygon>) {
        let corners: Vec<Vec3> = numbers.iter().map(|&number| mesh.corner(number)).collect();
        let color = mesh.color(numbers);
        let event = Event::Polygon {
            author: Author::SOLE,
            t: 0.0,
            stroke: None,
            vertices: corners,
            color: channels(color),
        };
        if let Err(expected) = event.check() {
            self.fault.get_or_insert(Mismatch::new(expected, format!("vertices {numbers:?}")));
        } else if let Event::Polygon { vertices: corners, .. } = event {
            out.push(Polygon { corners, color });
        }
    }
}

struct Mesh<'a> {
    positions: Elements<'a>,
    colors: Option<Elements<'a>>,
    indices: Option<Elements<'a>>,
    mode: Mode,
    material: Option<&'a Material>,
    residual: DAffine3,
}

impl<'a> Mesh<'a> {
    /// Opens the primitive's data; `None` if the primitive consists of points or lines.
    fn new(file: &'a File, primitive: &Primitive, residual: &DAffine3) -> Result<Option<Self>, Mismatch> {
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
        let colors = attribute(Semantic::Colors(0))?.filter(|of| of.width >= 3);
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
        let material = primitive.material.and_then(|material| file.root.materials.get(material.value()));
        Ok(Some(Self { positions, colors, indices, mode, material, residual: *residual }))
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

    fn corner(&self, number: u32) -> Vec3 {
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
        (b != d && is_flat_and_convex(quad.map(|number| self.corner(number)))).then_some(quad)
    }

    fn color(&self, numbers: &[u32]) -> u32 {
        let base = self.material.map_or([1.0; 4], |of| of.pbr_metallic_roughness.base_color_factor.0);
        let mut color = base;
        if let Some(colors) = &self.colors {
            let mut sum = [0.0; 4];
            for &number in numbers {
                let of_vertex = colors.vector(number as usize, [1.0; 4]);
                sum.iter_mut().zip(of_vertex).for_each(|(sum, part)| *sum += part);
            }
            color.iter_mut().zip(sum).for_each(|(part, sum)| *part *= sum / numbers.len() as f32);
        }
        let [r, g, b, a] = color;
        let alpha =
            match self.material.map(|of| (of.alpha_mode, of.alpha_cutoff)) {
                Some((Checked::Valid(AlphaMode::Blend), _)) => a,
                Some((Checked::Valid(AlphaMode::Mask), cutoff)) => {
                    if a >= cutoff.map_or(0.5, |cutoff| cutoff.0) { 1.0 } else { 0.0 }
                }
                _ => 1.0,
            };
        let byte = |part: f32| (part.clamp(0.0, 1.0) * 255.0).round() as u8;
        let srgb = |part: f32| byte(srgb_from_linear(part));
        u32::from_be_bytes([srgb(r), srgb(g), srgb(b), byte(alpha)])
    }
}

/// The channels of a colour in a recording: red, green, blue, opacity.
pub(super) fn channels(color: u32) -> (f32, f32, f32, f32) {
    let [r, g, b, a] = color.to_be_bytes().map(|byte| f32::from(byte) / 255.0);
    (r, g, b, a)
}

/// A colour rounded to 16 steps a channel.
pub(super) fn rounded(color: u32) -> u32 {
    u32::from_be_bytes(color.to_be_bytes().map(|byte| ((u16::from(byte) + 8) / 17 * 17) as u8))
}
