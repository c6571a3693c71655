//! Creates apps with and without the plugin, and compares them.

use bevy_app::{App, Last, TaskPoolOptions, TaskPoolPlugin};
#[cfg(feature = "light")]
use bevy_asset::AssetApp;
use bevy_asset::AssetPlugin;
use bevy_camera::{
    CameraPlugin,
    visibility::{ViewVisibility, VisibleEntities},
};
use bevy_ecs::{
    change_detection::ResMut,
    entity::Entity,
    query::{Changed, QueryState},
    resource::Resource,
    system::Query,
};
use bevy_mesh::MeshPlugin;
use bevy_osp::{OspCullingPlugin, OspCullingSettings};
use bevy_transform::TransformPlugin;

/// The entities whose visibility counts as changed in a frame. Renderers depend on these changes.
#[derive(Resource, Default, PartialEq, Debug)]
struct Changes(Vec<Entity>);

fn note_changes(mut changes: ResMut<'_, Changes>, changed: Query<'_, '_, Entity, Changed<ViewVisibility>>) {
    changes.0 = changed.iter().collect();
    changes.0.sort_unstable();
}

/// A number larger than the number of resources and systems.
const FIRST_ENTITY: u32 = 256;

/// Creates an app with Bevy's cameras and lights. If there are settings, it has the plugin.
///
/// It has at least two threads, so that lists from several threads are compared.
pub(crate) fn new_app(settings: Option<OspCullingSettings>) -> App {
    new_app_on(2, settings)
}

/// Does the same, with at least this many threads for systems.
pub(crate) fn new_app_on(least_threads: usize, settings: Option<OspCullingSettings>) -> App {
    let mut app = App::new();
    let mut task_pool_options = TaskPoolOptions::default();
    task_pool_options.compute.min_threads = least_threads;
    app.add_plugins((
        TaskPoolPlugin { task_pool_options },
        TransformPlugin,
        AssetPlugin::default(),
        MeshPlugin,
    ));
    app.add_plugins(CameraPlugin);
    #[cfg(feature = "light")]
    app.init_asset::<bevy_image::Image>().add_plugins(bevy_light::LightPlugin);
    if let Some(settings) = settings {
        app.add_plugins(OspCullingPlugin { settings });
    }
    app.init_resource::<Changes>().add_systems(Last, note_changes);
    app.finish();
    app.cleanup();
    app.update();
    // Resources are entities, too, and the plugin has some. From here on, both apps create the same ids.
    while app.world_mut().spawn_empty().id().index_u32() < FIRST_ENTITY - 1 {}
    app
}

/// Compares two apps.
pub(crate) struct Twins(
    [Option<(QueryState<(Entity, &'static ViewVisibility)>, QueryState<(Entity, &'static VisibleEntities)>)>;
        2],
);

impl Twins {
    pub(crate) fn new() -> Self {
        Self([None, None])
    }

    /// Checks that the data of each entity and each view are the same, bit by bit.
    pub(crate) fn compare(&mut self, apps: &mut [App; 2], when: &str) {
        let mut states = Vec::new();
        for (app, queries) in apps.iter_mut().zip(&mut self.0) {
            let world = app.world_mut();
            let (entities, views) = queries.get_or_insert_with(|| (world.query(), world.query()));
            let mut entities = entities.iter(world).map(|(id, seen)| (id, *seen)).collect::<Vec<_>>();
            entities.sort_unstable_by_key(|(id, _)| *id);
            let mut views =
                views.iter(world).map(|(id, seen)| (id, seen.entities.clone())).collect::<Vec<_>>();
            views.sort_unstable_by_key(|(id, _)| *id);
            states.push((entities, views, std::mem::take(&mut world.resource_mut::<Changes>().0)));
        }
        let [bevy, ours] = states.try_into().expect("two apps");
        assert_eq!(bevy.0.len(), ours.0.len(), "{when}");
        for (bevy, ours) in bevy.0.iter().zip(&ours.0) {
            assert_eq!(bevy, ours, "{when}");
        }
        for (bevy, ours) in bevy.1.iter().zip(&ours.1) {
            assert_eq!(bevy, ours, "{when}");
        }
        assert_eq!(bevy.2, ours.2, "changes, {when}");
    }
}
