//! Occluder meshes, drawn by batches.

mod contour;
mod draw;
mod prepare;
mod registry;
mod stage;

pub(crate) use prepare::OccluderMesh;
pub(crate) use registry::{Columns, Meshes, UNMOVED, moved};
pub(crate) use stage::{MeshBuffer, MeshCounts};
