//! Constants of the `.tilt` format that its reader and its writer share.

/// The first bytes of a file.
pub(crate) const MAGIC: &[u8] = b"tilT";
/// The first word of `data.sketch`.
pub(crate) const SKETCH_MAGIC: u32 = 0xC576_A5CD;
/// Length of a unit of canvas or room space, metres.
pub(crate) const METERS_PER_UNIT: f32 = 0.1;

/// Bits of a stroke's mask. Each of the lower 16 bits adds one word. Each of the upper 16 bits adds a length and that
/// number of bytes.
pub(crate) mod stroke_mask {
    pub(crate) const FLAGS: u32 = 0;
    pub(crate) const SCALE: u32 = 1;
    pub(crate) const GROUP: u32 = 2;
    pub(crate) const SEED: u32 = 3;
    pub(crate) const LAYER: u32 = 4;
    /// The animation frame in Open Brush.
    pub(crate) const FRAME: u32 = 5;
    pub(crate) const FIRST_LONG: u32 = 16;
}

/// Bits of a control point's mask. Each bit adds one word.
pub(crate) mod point_mask {
    pub(crate) const PRESSURE: u32 = 0;
    pub(crate) const TIME_STAMP: u32 = 1;
    /// The mask of both bits.
    pub(crate) const KNOWN: u32 = 3;
}
