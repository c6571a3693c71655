use super::{Aabb, Plane};

/// Position of a box relative to a frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Containment {
    /// Wholly behind at least one plane: not visible.
    Outside,
    /// Possibly visible: the planes do not decide.
    Intersects,
    /// Wholly inside every plane.
    Inside,
}

/// The planes that are still to be tested, a bit for each. If a box lies wholly inside a plane, this plane need not be
/// tested for the contents of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaneMask(u8);

impl PlaneMask {
    /// All six planes.
    pub const ALL: Self = Self(0b11_1111);
    /// No plane: all contents of the box are inside the frustum.
    pub const NONE: Self = Self(0);

    /// Whether no plane is left to test.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether plane `i` is still to be tested.
    pub fn contains(self, i: usize) -> bool {
        self.0 >> i & 1 == 1
    }

    /// The mask as bits, plane 0 in bit 0.
    pub fn bits(self) -> u8 {
        self.0
    }

    /// A mask from bits; bits above the sixth are ignored.
    pub fn from_bits(bits: u8) -> Self {
        Self(bits & Self::ALL.0)
    }
}

/// A view frustum: six planes whose normals point inwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    planes: [Plane; 6],
}

impl Frustum {
    /// A frustum from its planes, normals inwards, in any order.
    pub fn new(planes: [Plane; 6]) -> Self {
        Self { planes }
    }

    /// The frustum that contains every box. Every point lies on the inner side of a plane without a normal.
    pub fn everything() -> Self {
        Self::new([Plane { normal: glam::Vec3::ZERO, d: 0.0 }; 6])
    }

    /// The planes, normals inwards.
    pub fn planes(&self) -> &[Plane; 6] {
        &self.planes
    }

    /// Tests the position of a box. The test is conservative: a box outside the frustum that is not behind a single
    /// plane counts as [`Containment::Intersects`]. All box tests of the crate agree bit for bit (see [`crate::math`]).
    pub fn classify(&self, bounds: &Aabb) -> Containment {
        self.classify_masked(bounds, PlaneMask::ALL).0
    }

    /// [`Frustum::classify`] against `mask`; also the planes left for boxes inside, and the number of tested planes.
    #[doc(hidden)]
    pub fn classify_masked(&self, bounds: &Aabb, mask: PlaneMask) -> (Containment, PlaneMask, u32) {
        let mut left = mask.0;
        let mut tested = 0;
        for (i, plane) in self.planes.iter().enumerate() {
            if !mask.contains(i) {
                continue;
            }
            tested += 1;
            if plane.signed_distance(plane.positive_vertex(bounds)) < 0.0 {
                return (Containment::Outside, PlaneMask::NONE, tested);
            }
            if plane.signed_distance(plane.negative_vertex(bounds)) >= 0.0 {
                left &= !(1 << i);
            }
        }
        let outcome = if left == 0 { Containment::Inside } else { Containment::Intersects };
        (outcome, PlaneMask(left), tested)
    }

    /// Whether the box may be visible: it does not lie wholly behind any plane. The fingerprint of a frame covers
    /// exactly the boxes that may be visible.
    #[inline]
    pub fn may_see(&self, bounds: &Aabb) -> bool {
        // A distance of NaN is not negative, so undecided boxes count as visible.
        !self.planes.iter().any(|plane| plane.signed_distance(plane.positive_vertex(bounds)) < 0.0)
    }
}
