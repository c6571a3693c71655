//! What is known to be wrong and is being mended: a generator leaves such a case out while its switch is off. With the
//! environment variable `OSP_FUZZ_ALL` every switch is on.

use std::sync::LazyLock;

/// A fault that a generator steers around.
#[derive(Clone, Copy, Debug)]
pub struct Switch(bool);

impl Switch {
    /// Whether its cases are generated and judged.
    pub fn is_on(self) -> bool {
        static ALL: LazyLock<bool> = LazyLock::new(|| std::env::var_os("OSP_FUZZ_ALL").is_some());
        self.0 || *ALL
    }
}

/// Rays parallel to an axis, or so nearly that the reciprocal of their direction is infinite, also on the faces of boxes.
pub const AXIS_PARALLEL_RAYS: Switch = Switch(false);
/// Eyes up to 10 km from the origin.
pub const EYES_FAR_AWAY: Switch = Switch(false);
/// Slightly bent quads with corners exactly on the near plane.
pub const BENT_QUADS_AT_THE_NEAR_PLANE: Switch = Switch(false);
/// A `.pvs` with a single changed byte is refused, and one with bits for polygons that are not there.
pub const A_CHANGED_PVS_IS_REFUSED: Switch = Switch(false);
/// Memory while a packed `.pvs` is read that says it unpacks to very much.
pub const PVS_BOMBS: Switch = Switch(false);
/// Messages hold no control characters.
pub const NO_CONTROL_CHARACTERS: Switch = Switch(false);
/// Numbers of the command line for which nothing says how large they may be, or that they have to be numbers.
pub const NUMBERS_WITHOUT_LIMIT: Switch = Switch(false);
