use glam::Vec3;

use osp::{
    index::{Node, SpatialIndex, Visit, Visitor},
    math::{Containment, Frustum, rotate},
    occlusion::ShadowVolume,
    polygon::PolygonId,
    view::View,
};
use osp_render::{Depth, LineBatch, LineColor};
use osp_session::{recording::Motion, scene::Scene};

/// Largest number of boxes drawn; more boxes would cover each other.
const MAX_BOXES: usize = 20_000;
/// Largest number of polygon edges drawn.
const MAX_EDGES: usize = 60_000;

/// Debug structures drawn over the model: boxes of the index, shadow volumes, culled polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerChoice {
    /// The boxes of the index's nodes, coloured by depth.
    pub nodes: bool,
    /// Deepest level whose boxes are drawn.
    pub node_depth: u32,
    /// The occluders and their shadow volumes.
    pub shadows: bool,
    /// Culled polygons, tinted by the reason; shown only while the culling camera is frozen.
    pub culled: bool,
    /// Polygons that intersect the side planes of the culling camera's frustum.
    pub cut: bool,
    /// The depth pyramid of `hzb` instead of the picture.
    pub pyramid: bool,
    /// Level of the depth pyramid, from 1: a texel of level n covers 2^n by 2^n pixels.
    pub pyramid_level: u32,
    /// The grid on the floor.
    pub grid: bool,
    /// Strokes in the colours of their authors.
    pub authors: bool,
}

impl Default for LayerChoice {
    fn default() -> Self {
        Self {
            nodes: false,
            node_depth: 6,
            shadows: false,
            culled: true,
            cut: false,
            pyramid: false,
            pyramid_level: 4,
            grid: true,
            authors: false,
        }
    }
}

/// A colour for a level of the tree, different from the colours of the neighbouring levels.
fn depth_color(depth: u32) -> LineColor {
    const COLORS: [LineColor; 7] = [
        [240, 240, 240, 200],
        [255, 130, 90, 190],
        [250, 200, 80, 180],
        [130, 220, 110, 170],
        [80, 200, 220, 160],
        [110, 140, 255, 150],
        [220, 120, 240, 150],
    ];
    COLORS[depth as usize % COLORS.len()]
}

/// Draws the boxes of an index's nodes in the frustum, down to a depth. Returns the number of boxes.
pub(super) fn draw_nodes(
    index: &dyn SpatialIndex,
    frustum: &Frustum,
    max_depth: u32,
    out: &mut LineBatch,
) -> usize {
    struct Boxes<'a> {
        out: &'a mut LineBatch,
        max_depth: u32,
        count: usize,
    }
    impl Visitor for Boxes<'_> {
        fn node(&mut self, node: &Node<'_>) -> Visit {
            if self.count >= MAX_BOXES {
                return Visit::Skip;
            }
            if node.bounds.is_valid() {
                self.count += 1;
                self.out.aabb(node.bounds, depth_color(node.depth), Depth::Hidden);
            }
            if node.depth >= self.max_depth { Visit::Skip } else { Visit::Descend }
        }

        fn polygons(&mut self, _ids: &[PolygonId], _decision: Visit) {}
    }
    let mut boxes = Boxes { out, max_depth, count: 0 };
    index.traverse(frustum, &mut boxes);
    boxes.count
}

/// Draws the outlines of polygons, transformed by a motion.
pub(super) fn draw_outlines(
    scene: &Scene,
    ids: impl Iterator<Item = PolygonId>,
    motion: &Motion,
    color: LineColor,
    out: &mut LineBatch,
) {
    for id in ids.take(MAX_EDGES / 4) {
        let polygon = scene.polygon(id).map(|p| motion.point(p));
        out.outline(polygon.vertices(), color, Depth::Through);
    }
}

/// Tests the boxes of the polygons in view. Returns the number of polygons inside the frustum, and the polygons that
/// intersect its planes.
pub(super) fn inside_and_cut(
    scene: &Scene,
    frustum: &Frustum,
    in_view: impl Iterator<Item = PolygonId>,
) -> (u64, Vec<PolygonId>) {
    let (mut inside, mut cut) = (0, Vec::new());
    for id in in_view {
        match frustum.classify(&scene.bounds(id)) {
            Containment::Inside => inside += 1,
            // A polygon in view cannot be outside.
            Containment::Intersects | Containment::Outside => cut.push(id),
        }
    }
    (inside, cut)
}

/// Draws the frustum of a view up to `length_m` from the eye.
pub(super) fn draw_view(view: &View, length_m: f32, out: &mut LineBatch) {
    let color = [255, 214, 90, 255];
    let ends = view.corner_directions().map(|direction| view.eye_in_world + direction * length_m);
    for end in ends {
        out.line(view.eye_in_world, end, color, Depth::Hidden);
    }
    out.outline(&ends, color, Depth::Hidden);
    let near = view.corner_directions().map(|direction| view.eye_in_world + direction * (length_m * 0.15));
    out.outline(&near, color, Depth::Hidden);
}

/// Draws occluders and their shadow volumes up to `length_m` from the eye; returns the number of occluders.
pub(super) fn draw_shadows(
    eye_in_world: Vec3,
    shadows: &[ShadowVolume],
    length_m: f32,
    out: &mut LineBatch,
) -> usize {
    for shadow in shadows {
        let corners = shadow.corners().iter().map(|v| eye_in_world + v.as_vec3());
        let ends = shadow.corners().iter().map(|v| {
            let far_m = v.length().max(f64::from(length_m));
            eye_in_world + (v.normalize_or_zero() * far_m).as_vec3()
        });
        let (corners, ends): (Vec<Vec3>, Vec<Vec3>) = (corners.collect(), ends.collect());
        for (from, to) in corners.iter().zip(&ends) {
            out.line(*from, *to, [120, 200, 255, 120], Depth::Hidden);
        }
        for i in 0..corners.len() {
            let next = (i + 1) % corners.len();
            out.face(&[corners[i], corners[next], ends[next], ends[i]], [90, 160, 255, 14]);
        }
        out.outline(&corners, [255, 240, 120, 255], Depth::Through);
        out.outline(&ends, [120, 200, 255, 70], Depth::Hidden);
    }
    shadows.len()
}

/// Draws a grid on the floor, with a cell size that suits the distance of the eye.
pub(super) fn draw_grid(eye: Vec3, target: Vec3, distance_m: f32, out: &mut LineBatch) {
    /// Number of cells from the middle to the border.
    const CELLS: i32 = 20;
    let cell = 10.0f32.powf((distance_m * 0.4).max(1.0e-6).log10().floor());
    let middle = Vec3::new((target.x / cell).round() * cell, 0.0, (target.z / cell).round() * cell);
    if !middle.is_finite() || eye.y.abs() > cell * 1000.0 {
        return;
    }
    let reach = cell * CELLS as f32;
    for i in -CELLS..=CELLS {
        let along = i as f32 * cell;
        for (side, across) in [(Vec3::X, Vec3::Z), (Vec3::Z, Vec3::X)] {
            let at = middle + side * along;
            let world = if side == Vec3::X { at.x } else { at.z };
            let color: LineColor = match () {
                () if world.abs() < cell * 0.01 && side == Vec3::X => [90, 110, 190, 150],
                () if world.abs() < cell * 0.01 => [190, 90, 90, 150],
                () if ((world / cell).round() as i64) % 10 == 0 => [150, 155, 165, 90],
                () => [140, 145, 155, 38],
            };
            out.line(at - across * reach, at + across * reach, color, Depth::Hidden);
        }
    }
}

/// Draws the plane on which strokes are drawn: a square around `at` that faces the viewer.
pub(super) fn draw_plane(view: &View, at: Vec3, half_m: f32, out: &mut LineBatch) {
    let q = view.world_from_view;
    let (right, up) = (rotate(q, Vec3::X) * half_m, rotate(q, Vec3::Y) * half_m);
    out.face(&[at - right - up, at + right - up, at + right + up, at - right + up], [120, 170, 255, 12]);
    for i in -4..=4 {
        let part = i as f32 * 0.25;
        let color = if i == 0 { [120, 170, 255, 90] } else { [120, 170, 255, 34] };
        out.line(at + right * part - up, at + right * part + up, color, Depth::Hidden);
        out.line(at + up * part - right, at + up * part + right, color, Depth::Hidden);
    }
}

/// Draws the pointer in space: a circle of radius `radius_m`, half the width of the brush.
pub(super) fn draw_cursor(view: &View, at: Vec3, radius_m: f32, color: LineColor, out: &mut LineBatch) {
    let q = view.world_from_view;
    let (right, up) = (rotate(q, Vec3::X) * radius_m, rotate(q, Vec3::Y) * radius_m);
    out.outline(&circle::<24>(at, right, up), color, Depth::Through);
}

/// Points of a circle; `right` and `up` lead from the middle to two of them.
pub(super) fn circle<const CORNERS: usize>(middle: Vec3, right: Vec3, up: Vec3) -> [Vec3; CORNERS] {
    std::array::from_fn(|i| {
        let angle = i as f32 / CORNERS as f32 * std::f32::consts::TAU;
        middle + right * angle.cos() + up * angle.sin()
    })
}
