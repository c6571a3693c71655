use bytemuck::{Pod, Zeroable};

use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, PolygonId},
};
use osp_session::{
    brush::Draw,
    scene::{Scene, Stroke},
};

/// A polygon in the memory layout of the vertex shader: four corners with their paint. A triangle repeats its last
/// corner.
///
/// The fourth words of the four corners are, in this order:
/// - the colour: red, green, blue, opacity from the lowest byte;
/// - the corners' alpha, a byte each;
/// - the material and the flags;
/// - the range of animation of a square that faces the eye, metres.
///
/// The corners are stored as integers. A colour stored as a float could be a signalling NaN, which some drivers change
/// to a quiet NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PolygonRecord {
    pub(super) corners: [[u32; 4]; 4],
    pub(super) uv: [u32; 4],
    pub(super) normals: [u32; 4],
}

/// Flag of a square that faces the eye. Flags use the bits above the material's number.
pub(super) const FACING: u32 = 1 << 16;
/// Flag of a polygon whose corners have normals of their own.
pub(super) const SMOOTH: u32 = 1 << 17;

/// The colours in which polygons are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colors {
    #[default]
    Own,
    /// The colours of the polygons' authors ([`Scene::author_color`]), with the opacity of the paint.
    Authors,
}

impl Colors {
    fn of(self, scene: &Scene, id: PolygonId) -> (f32, f32, f32, f32) {
        match self {
            Self::Own => scene.color(id),
            Self::Authors => {
                let stroke = scene.stroke_of(id);
                let (r, g, b) = scene.author_color(stroke.author());
                (r, g, b, stroke.color().3)
            }
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DrawClass {
    /// The polygon hides the background, at least in its solid parts.
    Solid,
    /// The polygon's light is added to the background.
    Additive,
    /// The polygon covers the background in part.
    Transparent,
}

impl DrawClass {
    pub(super) fn of(stroke: &Stroke) -> Self {
        match stroke.brush().map(|brush| brush.draw) {
            Some(Draw::Opaque | Draw::Cutout) => Self::Solid,
            Some(Draw::Additive) => Self::Additive,
            Some(Draw::Blended) => Self::Transparent,
            None if color_bytes(stroke.color())[3] < 255 => Self::Transparent,
            None => Self::Solid,
        }
    }
}

impl PolygonRecord {
    pub(super) const SIZE: u64 = size_of::<Self>() as u64;

    pub(super) fn of(scene: &Scene, id: PolygonId, colors: Colors) -> Self {
        let polygon = scene.polygon(id);
        let corners = polygon.vertices();
        let last = corners.len() - 1;
        let mut record = Self::default();
        for (i, words) in record.corners.iter_mut().enumerate() {
            let p = corners[i.min(last)];
            *words = [p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), 0];
        }
        let (stroke, surface) = (scene.stroke_of(id), scene.surface_in_world(id));
        (record.normals, record.uv) = surface.words();
        record.corners[0][3] = u32::from_le_bytes(color_bytes(colors.of(scene, id)));
        record.corners[1][3] = u32::from_le_bytes(surface.alpha_bytes());
        // Number 0 stands for polygons without a brush.
        let material = stroke.brush().map_or(0, |brush| 1 + u32::from(brush.number()));
        let facing = if surface.is_facing() { FACING } else { 0 };
        let smooth = if surface.is_smooth() { SMOOTH } else { 0 };
        record.corners[2][3] = material | facing | smooth;
        if surface.is_facing() {
            record.corners[3][3] = room_m(&polygon, &scene.bounds(id)).to_bits();
        }
        record
    }
}

/// Largest distance along each axis by which the sphere around a square can move within the box, metres.
fn room_m(square: &ConvexPolygon, bounds: &Aabb) -> f32 {
    let around = square.bounds();
    let middle = around.center();
    let radius = square.vertices().iter().map(|p| p.distance(middle)).fold(0.0, f32::max);
    let half = (bounds.max - middle).min(middle - bounds.min).min_element();
    // The result is reduced by the largest rounding error of the shader.
    (half - radius * 1.001) * 0.999
}

fn color_bytes((r, g, b, a): (f32, f32, f32, f32)) -> [u8; 4] {
    [r, g, b, a].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
}
