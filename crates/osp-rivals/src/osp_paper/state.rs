use glam::Vec3;

/// The orientation of the plane that splits a node (the paper's state variable, Fig. 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// The YZ plane: x is constant.
    X,
    /// The XZ plane.
    Y,
    /// The XY plane.
    Z,
}

impl State {
    /// The state at a depth: X at the root, then Y, Z and X again.
    pub(super) fn at_depth(depth: u32) -> Self {
        [Self::X, Self::Y, Self::Z][(depth % 3) as usize]
    }

    pub(super) fn axis(self) -> usize {
        self as usize
    }

    pub(super) fn normal(self) -> Vec3 {
        [Vec3::X, Vec3::Y, Vec3::Z][self.axis()]
    }
}
