//! The textures of brushes, generated, and where the cut-out ones are solid.

pub(crate) mod noise;
pub(crate) mod picture;
mod shapes;
pub(crate) mod solid;

pub use solid::solid_across;

/// Width and height of a texture, texels.
pub(crate) const SIDE: usize = 128;
