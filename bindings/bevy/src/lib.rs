//! Frustum culling for [Bevy](https://bevy.org) by the index of [`osp`].
//!
//! In each frame and for each view, Bevy's own system tests every entity of the world. With [`OspCullingPlugin`], an
//! index finds the few entities that a view may see. Only these are tested, by Bevy's own test, so the visible sets are
//! the same.
//!
//! ```
//! use bevy_app::{App, TaskPoolPlugin};
//! use bevy_osp::{OspCulling, OspCullingPlugin};
//! # use bevy_asset::AssetPlugin;
//! # use bevy_camera::CameraPlugin;
//! # use bevy_mesh::MeshPlugin;
//! # use bevy_transform::TransformPlugin;
//!
//! let mut app = App::new();
//! // In a game: DefaultPlugins.
//! app.add_plugins((TaskPoolPlugin::default(), TransformPlugin, AssetPlugin::default(), MeshPlugin, CameraPlugin));
//! app.add_plugins(OspCullingPlugin::default());
//! app.update();
//! assert!(!app.world().resource::<OspCulling>().is_indexed(), "there is nothing to cull yet");
//! ```
//!
//! # Stages of a frame
//!
//! ```text
//! change ticks, removed components ──> index is updated ──> for each view: index finds ──> Bevy's test ──> ViewVisibility,
//! (moved, new and removed entities)    (OspCulling)         candidates                                     VisibleEntities
//! ```
//!
//! * An entity that has changed recently is *loose*: it is a candidate for every view until it has not changed for some
//!   frames. An entity that moves in every frame therefore causes no changes of the index.
//! * A plain pass over all entities is faster for few entities, many that move, or a view of most of the world. In
//!   these cases the system uses the plain pass. [`OspCullingSettings`] has the limits.
//! * An entity that cannot be culled by a finite box is a candidate for every view.
//!
//! # Hidden behind walls
//!
//! An entity with an [`Occluder`] hides the entities behind it, by the conservative occlusion culling of
//! [`osp::occlusion`]. Without such entities the visible sets are Bevy's own. [`OspHidden`] tests whether a sound, a
//! character or a trigger is hidden from a camera.

mod bounds;
mod changes;
mod check;
mod costs;
mod culling;
mod distinct;
mod entities;
mod hidden;
#[cfg(feature = "light")]
mod lights;
mod occluder;
mod occlusion;
mod plugin;
mod settings;

pub use culling::{OspCulling, OspCullingCounts};
pub use hidden::{CameraOccluders, OspHidden};
pub use occluder::{Occluder, OccluderError, OccluderSides};
pub use plugin::OspCullingPlugin;
pub use settings::OspCullingSettings;
