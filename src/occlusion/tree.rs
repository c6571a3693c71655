//! The tree that all shadow-volume methods share, and its queries. The methods differ only in how they build it.
//!
//! A *cap* is the plane that ends a shadow volume at its occluder: only what lies behind the cap is in shadow.

mod parts;

use glam::DVec3;

use super::{QUERY_SLACK, ShadowVolume, Tested, Verdict};
use crate::{
    index::simd::Backend,
    math::{Aabb, Sphere},
};

/// Largest number of splitting planes of a tree for `occluders` occluders.
pub fn node_budget(occluders: usize) -> usize {
    (occluders * 32).clamp(512, 16_384)
}

/// Largest depth of the tree; a cell that would lie deeper is not divided further. It bounds the stack of a query.
pub const MAX_DEPTH: u32 = 256;

/// A child of a node: another node, an unoccluded leaf, or a leaf in shadow with the caps of its occluders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    /// The unoccluded leaf.
    pub(super) const UNOCCLUDED: Self = Self(Self::LEAF | NO_CAP);

    pub(super) fn node(i: u32) -> Self {
        Self(i)
    }

    /// A leaf that lies inside the side planes of all occluders in this list of caps.
    pub fn leaf(caps: Caps) -> Self {
        Self(Self::LEAF | caps.0)
    }

    /// Returns the index of the child node, or as `Err` the list of caps, if the child is a leaf.
    ///
    /// # Errors
    /// The child is a leaf.
    pub fn read(self) -> Result<u32, Caps> {
        if self.0 & Self::LEAF == 0 { Ok(self.0) } else { Err(Caps(self.0 & !Self::LEAF)) }
    }
}

const NO_CAP: u32 = Child::LEAF - 1;

/// A list of caps, the newest first. Lists share their tails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Caps(u32);

impl Caps {
    /// The empty list.
    pub const NONE: Self = Self(NO_CAP);
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Cap {
    pub(super) normal: DVec3,
    pub(super) distance_m: f64,
    pub(super) next: Caps,
}

/// The cell of a culler in which a tested box lies. Tests of boxes inside that box may begin at this cell. It is valid
/// until the culler is built again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell(Option<Child>);

impl Cell {
    /// The cell that contains all boxes.
    pub const ALL: Self = Self(None);
}

/// A splitting plane through the eye.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// The plane's normal; the front is where `normal . x >= 0`.
    pub normal: DVec3,
    /// The child in front of the plane.
    pub front: Child,
    /// The child behind the plane.
    pub back: Child,
}

/// The side of its parent's plane on which a child lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// In front of the plane.
    Front,
    /// Behind the plane.
    Back,
}

/// The position of a child: at the top, or below a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// At the top.
    Top,
    /// Below the node with this number.
    Below(u32, Side),
}

/// The rule by which a volume inside all side planes of a leaf is hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CapRule {
    /// The volume is hidden if it lies beyond one cap of the list, because each cap belongs to an occluder that covers the
    /// whole cell.
    Any,
    /// The volume is hidden if it lies beyond all caps of the list, because their occluders cover the cell only together.
    All,
    /// The volume is always hidden. This is wrong for volumes in front of their occluder.
    Ignore,
}

/// A binary space partition by planes through the eye.
#[derive(Clone, Debug)]
pub struct ShadowTree {
    eye_in_world: DVec3,
    top: Child,
    nodes: Vec<Node>,
    caps: Vec<Cap>,
    rule: CapRule,
    depth: u32,
    backend: Backend,
}

impl ShadowTree {
    /// A tree without shadows, with room for `nodes` nodes and `caps` caps.
    pub fn new(nodes: usize, caps: usize, rule: CapRule) -> Self {
        Self {
            eye_in_world: DVec3::ZERO,
            top: Child::UNOCCLUDED,
            nodes: Vec::with_capacity(nodes),
            caps: Vec::with_capacity(caps),
            rule,
            depth: 0,
            backend: Backend::detect(),
        }
    }

    /// Removes all nodes and caps without freeing their memory.
    pub fn clear(&mut self, eye_in_world: DVec3) {
        self.eye_in_world = eye_in_world;
        self.top = Child::UNOCCLUDED;
        self.nodes.clear();
        self.caps.clear();
        self.depth = 0;
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Number of levels of nodes.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The node or leaf at the top.
    pub fn top(&self) -> Child {
        self.top
    }

    pub(super) fn backend(&self) -> Backend {
        self.backend
    }

    pub(super) fn eye_in_world(&self) -> DVec3 {
        self.eye_in_world
    }

    pub(super) fn rule(&self) -> CapRule {
        self.rule
    }

    pub(super) fn cap(&self, caps: Caps) -> &Cap {
        &self.caps[caps.0 as usize]
    }

    /// The first child that a test from this cell reads.
    pub(super) fn below(&self, cell: Cell) -> Child {
        cell.0.unwrap_or(self.top)
    }

    /// The node with this number.
    pub fn node(&self, i: u32) -> &Node {
        &self.nodes[i as usize]
    }

    /// Attaches a child at `link`.
    pub fn set(&mut self, link: Link, child: Child) {
        match link {
            Link::Top => self.top = child,
            Link::Below(i, Side::Front) => self.nodes[i as usize].front = child,
            Link::Below(i, Side::Back) => self.nodes[i as usize].back = child,
        }
    }

    /// Appends a node with unoccluded children and attaches it at `link`. `depth` is its level; the top has 1. Returns its
    /// number.
    pub fn push(&mut self, link: Link, normal: DVec3, depth: u32) -> u32 {
        let i = self.nodes.len() as u32;
        self.nodes.push(Node { normal, front: Child::UNOCCLUDED, back: Child::UNOCCLUDED });
        self.set(link, Child::node(i));
        self.depth = self.depth.max(depth);
        i
    }

    /// Whether the next [`ShadowTree::add_cap`] would allocate memory. One cap for each node and one for the top
    /// suffice, unless a build adds caps to cells that it does not divide.
    pub fn is_full_of_caps(&self) -> bool {
        self.caps.len() == self.caps.capacity()
    }

    /// Returns the list `caps` with the cap of one more occluder.
    pub fn add_cap(&mut self, caps: Caps, occluder: &ShadowVolume) -> Caps {
        let at = Caps(self.caps.len() as u32);
        self.caps.push(Cap {
            normal: occluder.cap_normal(),
            distance_m: occluder.cap_distance_m(),
            next: caps,
        });
        at
    }

    /// Tests a box, world space.
    pub fn test_box(&self, bounds: &Aabb) -> Tested {
        self.test(&EyeBox::new(bounds, self.eye_in_world))
    }

    /// Tests a sphere, world space.
    pub fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.test(&EyeSphere::new(sphere, self.eye_in_world))
    }

    /// Tests a box by its eight corners. A plane with corners on both sides ends the test.
    pub fn test_corners(&self, bounds: &Aabb) -> Tested {
        let volume = EyeBox::new(bounds, self.eye_in_world);
        let mut query = Query { volume: &volume, met_unoccluded: false, met_shadow: false, steps: 0 };
        let mut at = self.top;
        loop {
            let node = match at.read() {
                Ok(i) => &self.nodes[i as usize],
                Err(caps) => {
                    self.meet_leaf(caps, &mut query);
                    return query.answer();
                }
            };
            query.steps += 1;
            // The reach of a box is that of its eight corners.
            let (low, high) = volume.reach(node.normal);
            if low >= volume.slack() {
                at = node.front;
            } else if high <= -volume.slack() {
                at = node.back;
            } else {
                return Tested { verdict: Verdict::PartlyHidden, steps: query.steps };
            }
        }
    }

    /// Tests a box that lies in a box whose test ended with the cell `from`. Returns the verdict and the cell of this box.
    pub fn test_box_in(&self, bounds: &Aabb, from: Cell) -> (Tested, Cell) {
        let volume = EyeBox::new(bounds, self.eye_in_world);
        let mut query = Query { volume: &volume, met_unoccluded: false, met_shadow: false, steps: 0 };
        let mut at = self.below(from);
        // The cell shrinks as long as the whole box lies on one side of each plane.
        while let Ok(i) = at.read() {
            let node = &self.nodes[i as usize];
            let (low, high) = volume.reach(node.normal);
            if low >= volume.slack() {
                at = node.front;
            } else if high <= -volume.slack() {
                at = node.back;
            } else {
                break;
            }
            query.steps += 1;
        }
        self.descend(at, &mut query);
        (query.answer(), Cell(Some(at)))
    }

    fn test<V: Volume>(&self, volume: &V) -> Tested {
        let mut query = Query { volume, met_unoccluded: false, met_shadow: false, steps: 0 };
        self.descend(self.top, &mut query);
        query.answer()
    }

    /// Recurses only if the volume straddles a plane. [`MAX_DEPTH`] bounds the recursion.
    fn descend<V: Volume>(&self, mut at: Child, query: &mut Query<'_, V>) {
        loop {
            let node = match at.read() {
                Ok(i) => &self.nodes[i as usize],
                Err(caps) => return self.meet_leaf(caps, query),
            };
            query.steps += 1;
            let (low, high) = query.volume.reach(node.normal);
            let slack = query.volume.slack();
            // A NaN fails both comparisons and goes both ways.
            if low >= slack {
                at = node.front;
            } else if high <= -slack {
                at = node.back;
            } else {
                self.descend(node.front, query);
                if query.is_decided() {
                    return;
                }
                at = node.back;
            }
        }
    }

    fn meet_leaf<V: Volume>(&self, caps: Caps, query: &mut Query<'_, V>) {
        if caps == Caps::NONE {
            query.met_unoccluded = true;
            return;
        }
        let slack = query.volume.slack();
        let (mut beyond_one, mut beyond_all) = (false, true);
        let (mut in_front_of_one, mut in_front_of_all) = (false, true);
        let mut at = caps;
        while at != Caps::NONE {
            let cap = &self.caps[at.0 as usize];
            query.steps += 1;
            let (low, high) = query.volume.reach(cap.normal);
            let beyond = low - cap.distance_m >= slack;
            let in_front = high - cap.distance_m <= 0.0;
            beyond_one |= beyond;
            beyond_all &= beyond;
            in_front_of_one |= in_front;
            in_front_of_all &= in_front;
            if self.rule == CapRule::Any && beyond {
                break;
            }
            at = cap.next;
        }
        let (shadow, lit) = match self.rule {
            CapRule::Any => (beyond_one, in_front_of_all),
            CapRule::All => (beyond_all, in_front_of_one),
            CapRule::Ignore => (true, false),
        };
        query.met_shadow |= shadow || !lit;
        query.met_unoccluded |= lit || !shadow;
    }
}

struct Query<'a, V> {
    volume: &'a V,
    met_unoccluded: bool,
    met_shadow: bool,
    steps: u32,
}

impl<V> Query<'_, V> {
    fn is_decided(&self) -> bool {
        self.met_unoccluded && self.met_shadow
    }

    fn answer(&self) -> Tested {
        let verdict = match (self.met_shadow, self.met_unoccluded) {
            (true, false) => Verdict::Hidden,
            (false, true) => Verdict::Unoccluded,
            _ => Verdict::PartlyHidden,
        };
        Tested { verdict, steps: self.steps }
    }
}

/// A tested volume, with the eye as the origin.
pub trait Volume {
    /// The volume's smallest and largest signed distance from the plane through the eye with this unit normal.
    fn reach(&self, normal: DVec3) -> (f64, f64);
    /// Distance behind a plane, metres, from which on the volume counts as beyond the plane.
    fn slack(&self) -> f64;
    /// Upper bound of the volume's coordinates relative to the eye, metres.
    fn size(&self) -> f64 {
        self.slack() / QUERY_SLACK
    }
}

/// A box with the eye as the origin.
#[derive(Clone, Copy, Debug)]
pub struct EyeBox {
    center: DVec3,
    half: DVec3,
    slack: f64,
}

impl EyeBox {
    /// The box as seen from this eye.
    pub fn new(bounds: &Aabb, eye_in_world: DVec3) -> Self {
        let low = bounds.min.as_dvec3() - eye_in_world;
        let high = bounds.max.as_dvec3() - eye_in_world;
        let (center, half) = ((low + high) * 0.5, ((high - low) * 0.5).abs());
        let size = center.abs() + half;
        Self { center, half, slack: QUERY_SLACK * (size.x + size.y + size.z) }
    }
}

impl Volume for EyeBox {
    #[inline]
    fn reach(&self, normal: DVec3) -> (f64, f64) {
        let d = normal.dot(self.center);
        let e = normal.abs().dot(self.half);
        (d - e, d + e)
    }

    #[inline]
    fn slack(&self) -> f64 {
        self.slack
    }
}

/// A sphere with the eye as the origin.
#[derive(Clone, Copy, Debug)]
pub struct EyeSphere {
    center: DVec3,
    radius: f64,
    slack: f64,
}

impl EyeSphere {
    /// The sphere as seen from this eye.
    pub fn new(sphere: &Sphere, eye_in_world: DVec3) -> Self {
        let center = sphere.center.as_dvec3() - eye_in_world;
        let radius = f64::from(sphere.radius_m).abs();
        let size = center.abs();
        Self { center, radius, slack: QUERY_SLACK * (size.x + size.y + size.z + radius) }
    }
}

impl Volume for EyeSphere {
    #[inline]
    fn reach(&self, normal: DVec3) -> (f64, f64) {
        let d = normal.dot(self.center);
        (d - self.radius, d + self.radius)
    }

    #[inline]
    fn slack(&self) -> f64 {
        self.slack
    }
}
