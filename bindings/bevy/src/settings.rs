use bevy_ecs::resource::Resource;

/// When the plugin uses the index, and when Bevy's way: a plain pass over all entities. The visible sets are the same either way.
///
/// The limits are about where the two ways cross (`cargo bench -- limits`). The resource may be changed at any time.
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct OspCullingSettings {
    /// With fewer entities there is no index: a plain pass is faster.
    pub least_entities: usize,
    /// If more than this part of the entities changes in a frame (moves, comes, gets another box), mean over some frames, or more than
    /// 6,000 of them, the index is given up, and the plugin waits until they rest. From 1 on there is no limit.
    pub most_moved: f32,
    /// If more than this part of the entities changes in one frame, the index is given up at once.
    pub most_moved_at_once: f32,
    /// A view for which the index finds more than this part of the entities is culled by a plain pass: to look up each
    /// of so many takes longer than to walk over all.
    pub most_found: f32,
    /// An entity that has not changed for so many frames is put into the index. Until then it is tested in every frame.
    pub settle_frames: u32,
    /// An index of all entities is filled over about so many frames.
    pub fill_frames: u32,
}

impl Default for OspCullingSettings {
    fn default() -> Self {
        Self {
            least_entities: 2000,
            most_moved: 0.015,
            most_moved_at_once: 0.1,
            most_found: 0.125,
            settle_frames: 2,
            fill_frames: 64,
        }
    }
}

impl OspCullingSettings {
    /// The index always, whatever it costs: for tests and measurements.
    pub fn always() -> Self {
        Self {
            least_entities: 0,
            most_moved: 1.0,
            most_moved_at_once: 1.0,
            most_found: 1.0,
            settle_frames: 1,
            fill_frames: 1,
        }
    }

    /// A plain pass always.
    pub fn never() -> Self {
        Self { least_entities: usize::MAX, ..Self::default() }
    }

    /// A part of a number of entities; from 1 on there is no limit.
    pub(crate) fn part(part: f32, entities: usize) -> usize {
        if part >= 1.0 { usize::MAX } else { (f64::from(part) * entities as f64) as usize }
    }
}
