use bevy_ecs::{reflect::ReflectResource, resource::Resource};
use bevy_reflect::{Reflect, std_traits::ReflectDefault};

/// Limits for the choice between the index and Bevy's method, which is a plain pass over all entities. The visible sets
/// are the same with both.
///
/// At the default limits, both methods take about the same time (`cargo bench -- limits`). Set `is_measured` to `false`
/// if equal frames must use the same method, as in tests. The resource may be changed at any time, also through
/// reflection, as editors and inspectors do.
#[derive(Resource, Clone, Debug, PartialEq, Reflect)]
#[reflect(Resource, Default)]
pub struct OspCullingSettings {
    /// Least number of entities for an index. With fewer entities a plain pass is faster.
    pub least_entities: usize,
    /// Largest fraction of the entities that may change in a frame (move, appear, get another box), as a mean over some
    /// frames. If more of them change, or more than 6,000, the plugin drops the index, and waits until fewer change.
    /// With 1 or more there is no limit.
    pub most_moved: f32,
    /// Largest fraction of the entities that may change in a single frame. If more change, the plugin drops the index
    /// at once.
    pub most_moved_at_once: f32,
    /// Largest fraction of the entities that the index may find for a view. If it finds more, a plain pass culls the
    /// view, because looking up so many entities takes longer than a pass over all.
    pub most_found: f32,
    /// Number of frames without a change after which an entity is put into the index. Until then it is tested in every
    /// frame.
    pub settle_frames: u32,
    /// Approximate number of frames in which a new index is filled.
    pub fill_frames: u32,
    /// Whether measured times decide, too: within the limits, the plugin uses the method that was faster in the last
    /// frames. The default is `true`, except on `wasm32`, which has no clock.
    pub is_measured: bool,
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
            is_measured: cfg!(not(target_arch = "wasm32")),
        }
    }
}

impl OspCullingSettings {
    /// Always uses the index, at any cost: for tests and measurements.
    pub fn always() -> Self {
        Self {
            least_entities: 0,
            most_moved: 1.0,
            most_moved_at_once: 1.0,
            most_found: 1.0,
            settle_frames: 1,
            fill_frames: 1,
            is_measured: false,
        }
    }

    /// Always uses a plain pass.
    pub fn never() -> Self {
        Self { least_entities: usize::MAX, ..Self::default() }
    }

    /// Returns a fraction of a number of entities; no limit if the fraction is 1 or more.
    pub(crate) fn part(part: f32, entities: usize) -> usize {
        if part >= 1.0 { usize::MAX } else { (f64::from(part) * entities as f64) as usize }
    }
}
