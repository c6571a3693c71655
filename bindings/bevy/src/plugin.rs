use bevy_app::{App, Plugin, PostUpdate};
use bevy_camera::visibility::{VisibilityPlugin, VisibilitySystems, check_visibility_cpu_culling};
use bevy_ecs::{
    schedule::{IntoScheduleConfigs, IntoSystemSet, ScheduleCleanupPolicy},
    system::{CombinatorSystem, Combine, IntoSystem, RunSystemError, System, SystemIn},
};
#[cfg(feature = "light")]
use bevy_light::{
    LightPlugin, SimulationLightSystems, check_dir_light_mesh_visibility, check_point_light_mesh_visibility,
};
#[cfg(feature = "light")]
use bevy_transform::TransformSystems;
use bevy_utils::prelude::DebugName;

#[cfg(feature = "light")]
use crate::lights::{check_cascades, check_lamps};
use crate::{OspCulling, OspCullingSettings, check::check_visibility};

/// Replaces Bevy's frustum culling on the CPU with an index. Add it together with Bevy's own plugins, in any order.
///
/// Its system replaces Bevy's [`check_visibility_cpu_culling`]. Systems that are ordered before or after that function
/// run before or after this one.
///
/// # Panics
/// Panics when the app is finished, if it has no [`VisibilityPlugin`] (part of Bevy's `CameraPlugin` and
/// `DefaultPlugins`).
#[derive(Clone, Debug, Default)]
pub struct OspCullingPlugin {
    /// Limits for the use of the index.
    pub settings: OspCullingSettings,
}

impl Plugin for OspCullingPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<OspCullingSettings>();
        app.insert_resource(self.settings.clone()).init_resource::<OspCulling>();
        // An app that is never finished, for example in tests, also gets the system.
        if app.is_plugin_added::<VisibilityPlugin>() {
            replace(app);
        }
        #[cfg(feature = "light")]
        replace_lights(app);
    }

    fn finish(&self, app: &mut App) {
        assert!(
            app.is_plugin_added::<VisibilityPlugin>(),
            "OspCullingPlugin expects Bevy's CameraPlugin in the app"
        );
        replace(app);
        #[cfg(feature = "light")]
        replace_lights(app);
        let is_in_place = app.world().resource::<OspCulling>().is_in_place();
        assert!(
            is_in_place,
            "OspCullingPlugin expects Bevy's system check_visibility_cpu_culling in PostUpdate"
        );
    }
}

/// Replaces Bevy's system by the plugin's, unless this has been done.
fn replace(app: &mut App) {
    if app.world().resource::<OspCulling>().is_in_place() {
        return;
    }
    let name = "bevy_osp::check_visibility";
    if let Some(system) = in_place_of(app, check_visibility_cpu_culling, check_visibility, name) {
        app.add_systems(PostUpdate, system.in_set(VisibilitySystems::CheckVisibility));
        app.world_mut().resource_mut::<OspCulling>().set_in_place();
    }
}

/// Replaces Bevy's systems for lights, if the app has them, unless this has been done.
#[cfg(feature = "light")]
fn replace_lights(app: &mut App) {
    if app.world().resource::<OspCulling>().are_lights_in_place || !app.is_plugin_added::<LightPlugin>() {
        return;
    }
    let cascades =
        in_place_of(app, check_dir_light_mesh_visibility, check_cascades, "bevy_osp::check_cascades");
    let lamps = in_place_of(app, check_point_light_mesh_visibility, check_lamps, "bevy_osp::check_lamps");
    let systems =
        [cascades.map(IntoScheduleConfigs::into_configs), lamps.map(IntoScheduleConfigs::into_configs)];
    for system in systems.into_iter().flatten() {
        // `LightPlugin` orders Bevy's systems in the same way.
        let system = system
            .in_set(SimulationLightSystems::CheckLightVisibility)
            .after(VisibilitySystems::CalculateBounds)
            .after(TransformSystems::Propagate)
            .after(SimulationLightSystems::UpdateLightFrusta)
            .after(VisibilitySystems::CheckVisibility)
            .before(VisibilitySystems::MarkNewlyHiddenEntitiesInvisible);
        app.add_systems(PostUpdate, system);
    }
    app.world_mut().resource_mut::<OspCulling>().are_lights_in_place = true;
}

/// Removes Bevy's system; returns the plugin's system, or `None` if the app does not have Bevy's system.
fn in_place_of<A, B, InA, InB, SetA>(
    app: &mut App,
    bevys: A,
    ours: B,
    name: &'static str,
) -> Option<CombinatorSystem<SecondOnly, A::System, B::System>>
where
    A: IntoSystem<(), (), InA> + IntoSystemSet<SetA> + Copy,
    B: IntoSystem<(), (), InB>,
{
    let removed = app.remove_systems_in_set(PostUpdate, bevys, ScheduleCleanupPolicy::RemoveSystemsOnly);
    // A combined system is in the sets of both, so the order relative to Bevy's function stays.
    removed.is_ok_and(|systems| systems > 0).then(|| {
        CombinatorSystem::new(
            IntoSystem::into_system(bevys),
            IntoSystem::into_system(ours),
            DebugName::borrowed(name),
        )
    })
}

/// Runs only the second of two systems.
struct SecondOnly;

impl<A: System<In = ()>, B: System<In = (), Out = ()>> Combine<A, B> for SecondOnly {
    type In = ();
    type Out = ();

    fn combine<T>(
        (): (),
        data: &mut T,
        _first: impl FnOnce(SystemIn<'_, A>, &mut T) -> Result<A::Out, RunSystemError>,
        second: impl FnOnce(SystemIn<'_, B>, &mut T) -> Result<(), RunSystemError>,
    ) -> Result<(), RunSystemError> {
        second((), data)
    }
}
