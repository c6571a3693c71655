use glam::Vec3;

use super::run::{Blend, Run, push};
use osp::polygon::PolygonId;
use osp_session::scene::Scene;

/// The order in which opaque polygons are drawn. At the same depth the polygon drawn later wins. Except for such polygons,
/// every order gives the same picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OpaqueOrder {
    /// By number, in order of arrival. This is the renderer's default.
    #[default]
    None,
    /// The nearest polygon first, by the distance of the box's centre. The early depth test rejects later polygons
    /// behind others.
    FrontToBack,
    /// The farthest polygon first. Most shaded samples are then overwritten.
    BackToFront,
    /// By material, then by number. A renderer with a pipeline for each material changes pipelines least often in this
    /// order.
    Material,
    /// By number, in two passes: first depth alone, then colours. No shaded sample is overwritten.
    ZPrepass,
}

impl OpaqueOrder {
    pub const ALL: [Self; 5] =
        [Self::None, Self::FrontToBack, Self::BackToFront, Self::Material, Self::ZPrepass];

    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::FrontToBack => "front-to-back",
            Self::BackToFront => "back-to-front",
            Self::Material => "material",
            Self::ZPrepass => "z-prepass",
        }
    }

    fn key(self, scene: &Scene, id: PolygonId, eye_in_world: Vec3) -> u32 {
        // The bits of a non-negative float sort like its value.
        let distance = || scene.bounds(id).center().distance_squared(eye_in_world).to_bits();
        match self {
            Self::None | Self::ZPrepass => 0,
            Self::FrontToBack => distance(),
            Self::BackToFront => !distance(),
            Self::Material => material_of(scene, id),
        }
    }
}

/// Cost of an order, in calls and changes of state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OrderCounts {
    /// Number of draw calls of all passes.
    pub draw_calls: u64,
    /// Number of pipelines that are bound in all passes.
    pub pipelines: u64,
    /// Number of ranges of opaque polygons with one material, in drawing order. A renderer with a pipeline for each
    /// material would change it that often. This renderer reads the material with the polygon.
    pub material_runs: u64,
}

/// Number of a polygon's material; 0 without a brush.
fn material_of(scene: &Scene, id: PolygonId) -> u32 {
    scene.stroke_of(id).brush().map_or(0, |brush| 1 + u32::from(brush.number()))
}

pub(super) fn sort(
    order: OpaqueOrder,
    scene: &Scene,
    eye_in_world: Vec3,
    page_len: usize,
    ids: &mut Vec<PolygonId>,
    runs: &mut Vec<Run>,
) {
    if matches!(order, OpaqueOrder::None | OpaqueOrder::ZPrepass) {
        return;
    }
    let mut keyed = Vec::with_capacity(ids.len());
    for run in runs.iter() {
        let listed = &ids[run.range.start as usize..run.range.end as usize];
        keyed.extend(listed.iter().map(|&id| (order.key(scene, id, eye_in_world), id.0, run.style)));
    }
    keyed.sort_unstable();
    ids.clear();
    runs.clear();
    for (_, id, style) in keyed {
        push(ids, runs, page_len, PolygonId(id), style, Blend::Opaque);
    }
}

/// Divides runs, so that each run has polygons of a single material.
pub(super) fn split_by_material(scene: &Scene, ids: &[PolygonId], runs: &mut Vec<Run>) {
    let mut split = Vec::with_capacity(runs.len());
    for run in runs.iter() {
        let mut at = run.range.start;
        let listed = &ids[run.range.start as usize..run.range.end as usize];
        for same in listed.chunk_by(|a, b| material_of(scene, *a) == material_of(scene, *b)) {
            let end = at + same.len() as u32;
            split.push(Run { range: at..end, ..run.clone() });
            at = end;
        }
    }
    *runs = split;
}

pub(super) fn material_runs(scene: &Scene, ids: impl Iterator<Item = PolygonId>) -> u64 {
    let (mut runs, mut last) = (0, None);
    for id in ids {
        let material = Some(material_of(scene, id));
        runs += u64::from(material != last);
        last = material;
    }
    runs
}
