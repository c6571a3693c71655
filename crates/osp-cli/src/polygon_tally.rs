use osp_session::scene::Scene;

/// The polygons of the strokes that are not erased.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PolygonTally {
    /// Visible polygons with an area.
    pub(super) drawn: u64,
    /// Polygons with an area in hidden layers.
    pub(super) hidden: u64,
    /// Visible polygons without an area.
    pub(super) without_area: u64,
}

impl PolygonTally {
    pub(super) fn of(scene: &Scene) -> Self {
        let mut tally = Self::default();
        for stroke in scene.strokes().iter().filter(|stroke| !stroke.is_taken_away()) {
            for id in stroke.polygon_ids() {
                match (stroke.is_visible(), scene.has_area(id)) {
                    (true, true) => tally.drawn += 1,
                    (true, false) => tally.without_area += 1,
                    (false, has_area) => tally.hidden += u64::from(has_area),
                }
            }
        }
        tally
    }
}
