use glam::{DVec3, Vec3};

use super::{OccluderPool, ShadowVolume, patch::MAX_PATCH, pool::Sketch};
use crate::{polygon::Geometry, view::ViewWindow};

/// An occluder inside one of this many better ones is left out. More: fewer useless occluders, more tests.
const COVERED_BY_FIRST: usize = 8;

/// Room for so many shadows for each candidate that is measured: nearly all have one, some fall apart into their
/// polygons. Where it runs out, fewer candidates are measured.
const SHADOWS_EACH: usize = 4;

/// Most shadows of one candidate: two for each polygon.
const MOST_SHADOWS: usize = 2 * MAX_PATCH;

/// What makes an occluder a good one. It changes what is found to be hidden, never what may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Score {
    /// The solid angle of what the window shows of it.
    #[default]
    SolidAngle,
    /// The paper's equation (1) and nothing else: `A |N . V| / D^2`, with the area `A`, the normal `N`, the viewing direction
    /// `V` and the distance `D`.
    Paper,
}

impl Score {
    /// Both.
    pub const ALL: [Self; 2] = [Self::SolidAngle, Self::Paper];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::SolidAngle => "solid-angle",
            Self::Paper => "paper",
        }
    }
}

/// Settings of [`Selector`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelectConfig {
    /// What makes an occluder a good one.
    pub score: Score,
    /// Most occluders of a frame.
    pub occluders: usize,
    /// How many times as many candidates are measured exactly, after a rough choice; none by [`Score::Paper`].
    pub measured: usize,
    /// Choosing stops at occluders that fill less than this part of the window; not by [`Score::Paper`].
    pub least_share: f64,
}

impl Default for SelectConfig {
    /// 64 occluders out of 128, each at least a thousandth of the window.
    fn default() -> Self {
        Self { score: Score::SolidAngle, occluders: 64, measured: 2, least_share: 1.0e-3 }
    }
}

/// How an occluder was, or was not, chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SelectCounts {
    /// Candidates in the pool.
    pub candidates: u32,
    /// Of these, near the window and not too small by the rough score.
    pub seen: u32,
    /// Of these, measured exactly.
    pub measured: u32,
    /// Of these, left out because a better one hides them.
    pub covered: u32,
    /// Occluders chosen.
    pub chosen: u32,
}

/// Chooses the occluders of a frame.
///
/// # The score
/// Equation (1) of "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree", after S. Coorg,
/// S. Teller, "Real-Time Occlusion Culling for Models with Large Occluders", 1997: area times the cosine between normal
/// and view, over the squared distance; about a solid angle. It sorts the pool roughly. The best are then measured:
/// the solid angle of what the window shows of them (see [`ShadowVolume::solid_angle_in`]).
///
/// # Differences from the paper
/// The cosine's sign is dropped: drawn polygons have two sides, and with the sign half of them would be lost. By
/// [`Score::Paper`] the order is that of equation (1) alone, with the viewing direction as `V`.
#[derive(Clone, Debug)]
pub struct Selector {
    config: SelectConfig,
    rough: Vec<(f32, u32)>,
    shadows: Vec<ShadowVolume>,
    measured: Vec<(f64, u32)>,
    chosen: Vec<ShadowVolume>,
}

impl Selector {
    /// A selector; takes its memory now, but for a few bytes for each candidate of the pools that it is used with.
    pub fn new(config: SelectConfig) -> Self {
        let shadows = SHADOWS_EACH * config.measured * config.occluders + MOST_SHADOWS;
        Self {
            config,
            rough: Vec::new(),
            shadows: Vec::with_capacity(shadows),
            measured: Vec::with_capacity(shadows),
            chosen: Vec::with_capacity(config.occluders),
        }
    }

    /// Makes room for pools of this many candidates.
    pub fn reserve(&mut self, candidates: usize) {
        self.rough.reserve(candidates.saturating_sub(self.rough.len()));
    }

    /// The occluders of the last [`Selector::select`], best first.
    pub fn chosen(&self) -> &[ShadowVolume] {
        &self.chosen
    }

    /// Chooses for a window, from a pool that has followed this geometry. Costs O(pool), and the exact part O(occluders).
    pub fn select(
        &mut self,
        pool: &OccluderPool,
        geometry: &dyn Geometry,
        window: &ViewWindow,
    ) -> SelectCounts {
        let mut counts = SelectCounts { candidates: pool.len() as u32, ..SelectCounts::default() };
        let least_sr = self.config.least_share * window.solid_angle_sr();
        let most = match self.config.score {
            Score::SolidAngle => {
                self.score_roughly(pool, window, least_sr as f32);
                self.config.occluders * self.config.measured
            }
            Score::Paper => {
                self.score_by_equation(pool, window);
                self.config.occluders
            }
        };
        counts.seen = self.rough.len() as u32;
        let descending = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if self.rough.len() > most && most > 0 {
            self.rough.select_nth_unstable_by(most - 1, descending);
            self.rough.truncate(most);
        }
        if self.config.score == Score::Paper {
            self.rough.truncate(most);
            self.rough.sort_unstable_by(descending);
            self.choose_in_order(pool, geometry, window);
            counts.measured = self.rough.len() as u32;
            counts.chosen = self.chosen.len() as u32;
            return counts;
        }
        // By slot from here on, so that nothing depends on how the partial sort left them.
        self.rough.sort_unstable_by_key(|&(_, slot)| slot);
        counts.measured = self.rough.len() as u32;
        self.shadows.clear();
        for &(_, slot) in &self.rough {
            if self.shadows.len() + MOST_SHADOWS > self.shadows.capacity() {
                break;
            }
            pool.patch(slot).push_shadows(geometry, window, &mut self.shadows);
        }
        self.measured.clear();
        self.measured.extend(
            self.shadows.iter().enumerate().map(|(i, shadow)| (shadow.solid_angle_in(window), i as u32)),
        );
        self.measured.retain(|(solid_angle, _)| *solid_angle >= least_sr);
        self.measured.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.chosen.clear();
        for &(_, i) in &self.measured {
            if self.chosen.len() >= self.config.occluders {
                break;
            }
            let shadow = &self.shadows[i as usize];
            if self.chosen.iter().take(COVERED_BY_FIRST).any(|better| covers(better, shadow)) {
                counts.covered += 1;
            } else {
                self.chosen.push(*shadow);
            }
        }
        counts.chosen = self.chosen.len() as u32;
        counts
    }

    /// Takes the occluders that were scored as they come.
    fn choose_in_order(&mut self, pool: &OccluderPool, geometry: &dyn Geometry, window: &ViewWindow) {
        self.chosen.clear();
        for &(_, slot) in &self.rough {
            self.shadows.clear();
            pool.patch(slot).push_shadows(geometry, window, &mut self.shadows);
            let room = self.config.occluders - self.chosen.len();
            self.chosen.extend(self.shadows.iter().take(room));
        }
    }

    fn score_by_equation(&mut self, pool: &OccluderPool, window: &ViewWindow) {
        let gaze = window.forward().as_vec3();
        self.score(pool, window, |sketch, to| {
            let score = sketch.area_vector.dot(gaze).abs() / to.length_squared();
            // Also leaves out free slots, whose area is zero, and what is not a number.
            (score > 0.0).then_some(score)
        });
    }

    fn score_roughly(&mut self, pool: &OccluderPool, window: &ViewWindow, least_sr: f32) {
        // The rough score of a near, large polygon may be off by more than one half; a quarter is not. Its square needs no root.
        let least_squared = (0.25 * least_sr) * (0.25 * least_sr);
        self.score(pool, window, |sketch, to| {
            let distance_squared = to.length_squared();
            let facing = sketch.area_vector.dot(to);
            let mut score = facing * facing / (distance_squared * distance_squared * distance_squared);
            // If the eye is inside the bounding sphere, the occluder may fill any part of the window.
            if distance_squared <= sketch.radius_m * sketch.radius_m && sketch.area_vector != Vec3::ZERO {
                score = f32::MAX;
            }
            // Also leaves out free slots, whose area is zero, and what is not a number.
            (score >= least_squared && score > 0.0).then_some(score)
        });
    }

    /// Scores the candidates whose bounding sphere reaches into the window; `score` gets the direction from the eye, too.
    fn score(
        &mut self,
        pool: &OccluderPool,
        window: &ViewWindow,
        score: impl Fn(&Sketch, Vec3) -> Option<f32>,
    ) {
        let eye = window.eye_in_world().as_vec3();
        let corners = window.corners();
        let sides: [Vec3; 4] =
            std::array::from_fn(|i| corners[i].cross(corners[(i + 1) % 4]).normalize_or_zero().as_vec3());
        let (forward, near) = (window.forward().as_vec3(), window.near_m() as f32);
        self.rough.clear();
        for (slot, sketch) in pool.sketches().iter().enumerate() {
            let to = sketch.center - eye;
            let Some(score) = score(sketch, to) else { continue };
            let reach = -sketch.radius_m;
            let outside = sides.iter().any(|side| side.dot(to) < reach) || forward.dot(to) - near < reach;
            if !outside {
                self.rough.push((score, slot as u32));
            }
        }
    }
}

/// Whether all of an occluder is in the shadow of another: it hides nothing that the other does not.
fn covers(better: &ShadowVolume, other: &ShadowVolume) -> bool {
    let corners = other.corners();
    let beyond = |normal: DVec3, distance: f64| corners.iter().all(|v| normal.dot(*v) >= distance);
    beyond(better.cap_normal(), better.cap_distance_m())
        && better.sides().iter().all(|side| beyond(*side, 0.0))
}
