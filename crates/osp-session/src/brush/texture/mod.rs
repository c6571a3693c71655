//! The generated textures of brushes, and their opaque texels.

pub mod noise;
pub mod picture;
mod shapes;
pub mod solid;

pub use solid::solid_across;

/// Width and height of a texture, texels.
pub const SIDE: usize = 128;
