use bevy_app::{App, Plugin, PostUpdate};
use bevy_camera::visibility::{
    VisibilityPlugin, VisibilitySystems, check_visibility_cpu_culling, check_visibility_ranges,
};
use bevy_ecs::schedule::{IntoScheduleConfigs, ScheduleCleanupPolicy, SystemSet};

use crate::{OspCulling, OspCullingSettings, check::check_visibility};

/// The system of the plugin, in [`VisibilitySystems::CheckVisibility`], in the place of Bevy's `check_visibility_cpu_culling`.
///
/// A system of your own that comes after that function by its name has to come after this set.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OspCullingSystems;

/// Replaces Bevy's frustum culling on the CPU by an index. Add it beside Bevy's own plugins, in any order.
///
/// # Panics
/// When the app is finished, if it has no [`VisibilityPlugin`] (part of Bevy's `CameraPlugin` and `DefaultPlugins`).
#[derive(Clone, Debug, Default)]
pub struct OspCullingPlugin {
    /// When the index is used.
    pub settings: OspCullingSettings,
}

impl Plugin for OspCullingPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.settings.clone()).init_resource::<OspCulling>();
        if app.is_plugin_added::<VisibilityPlugin>() {
            replace(app);
        }
    }

    fn finish(&self, app: &mut App) {
        assert!(
            app.is_plugin_added::<VisibilityPlugin>(),
            "OspCullingPlugin expects Bevy's CameraPlugin in the app"
        );
        replace(app);
    }
}

/// Puts the system in the place of Bevy's, unless that has been done.
fn replace(app: &mut App) {
    let removed = app.remove_systems_in_set(
        PostUpdate,
        check_visibility_cpu_culling,
        ScheduleCleanupPolicy::RemoveSystemsOnly,
    );
    if removed.is_ok_and(|systems| systems > 0) {
        app.add_systems(
            PostUpdate,
            check_visibility
                .in_set(VisibilitySystems::CheckVisibility)
                .in_set(OspCullingSystems)
                .after(check_visibility_ranges)
                // What others have put before Bevy's system.
                .after(check_visibility_cpu_culling),
        );
    }
}
