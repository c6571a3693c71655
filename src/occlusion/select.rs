use glam::{DVec3, Vec3};

use super::{
    OccluderPool, ShadowVolume,
    patch::MAX_PATCH,
    sketches::{RoughWindow, Sketch},
};
use crate::{polygon::Geometry, view::ViewWindow};

/// An occluder is skipped if one of this number of better occluders hides it wholly. With a larger number, fewer useless
/// occluders are selected, with more tests.
const COVERED_BY_FIRST: usize = 8;

/// Number of shadows reserved for each measured candidate. Nearly all candidates have one; some are divided into their
/// polygons. If the room is used up, fewer candidates are measured.
const SHADOWS_EACH: usize = 4;

/// Largest number of shadows of one candidate: two for each polygon.
const MOST_SHADOWS: usize = 2 * MAX_PATCH;

/// The score of an occluder. It affects the number of hidden polygons found, never soundness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Score {
    /// The solid angle of the occluder's part in the window.
    #[default]
    SolidAngle,
    /// Equation (1) of the paper alone: `A |N . V| / D^2`, with the area `A`, the normal `N`, the viewing direction `V` and
    /// the distance `D`.
    Paper,
}

impl Score {
    /// Both scores.
    pub const ALL: [Self; 2] = [Self::SolidAngle, Self::Paper];

    /// The name on the command line.
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
    /// Score by which occluders are selected.
    pub score: Score,
    /// Largest number of occluders of a frame.
    pub occluders: usize,
    /// Number of candidates that are measured exactly after the rough selection, as a multiple of `occluders`.
    /// [`Score::Paper`] measures none.
    pub measured: usize,
    /// The selection stops at the first occluder that fills less than this fraction of the window. [`Score::Paper`] does
    /// not stop.
    pub least_share: f64,
}

impl Default for SelectConfig {
    /// 64 occluders from 128 measured candidates; each fills at least a thousandth of the window.
    fn default() -> Self {
        Self { score: Score::SolidAngle, occluders: 64, measured: 2, least_share: 1.0e-3 }
    }
}

/// Counts of a selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SelectCounts {
    /// Number of candidates in the pool.
    pub candidates: u32,
    /// Number of candidates near the window that are not too small by the rough score.
    pub seen: u32,
    /// Number of candidates measured exactly.
    pub measured: u32,
    /// Number of candidates not measured again, because they were useless a few frames ago.
    pub known: u32,
    /// Number of candidates skipped because a better candidate hides them.
    pub covered: u32,
    /// Number of selected occluders.
    pub chosen: u32,
}

/// Selects the occluders of a frame.
///
/// # The score
/// Equation (1) of "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree", after S. Coorg, S.
/// Teller, "Real-Time Occlusion Culling for Models with Large Occluders", 1997: area times the cosine between normal and
/// view, over the squared distance. It approximates the solid angle, and sorts the pool roughly. The best candidates are
/// then measured exactly: the solid angle of their part in the window (see [`ShadowVolume::solid_angle_in`]).
///
/// # Differences from the paper
/// The sign of the cosine is dropped, because drawn polygons have two sides and the sign would exclude half of them. With
/// [`Score::Paper`] the order is that of equation (1) alone, with the viewing direction as `V`.
#[derive(Clone, Debug)]
pub struct Selector {
    config: SelectConfig,
    rough: Vec<(f32, u32)>,
    shadows: Vec<ShadowVolume>,
    /// For each shadow, the index of its candidate in `histories`.
    places: Vec<usize>,
    measured: Vec<(f64, u32)>,
    chosen: Vec<ShadowVolume>,
    histories: Vec<CandidateHistory>,
}

impl Selector {
    /// A selector with its memory allocated, except some bytes for each candidate of its pools.
    pub fn new(config: SelectConfig) -> Self {
        let shadows = SHADOWS_EACH * config.measured * config.occluders + MOST_SHADOWS;
        Self {
            config,
            rough: Vec::new(),
            shadows: Vec::with_capacity(shadows),
            places: Vec::with_capacity(shadows),
            measured: Vec::with_capacity(shadows),
            chosen: Vec::with_capacity(config.occluders),
            histories: Vec::new(),
        }
    }

    /// Makes room for pools of `candidates` candidates.
    pub fn reserve(&mut self, candidates: usize) {
        self.rough.reserve(candidates.saturating_sub(self.rough.len()));
        self.histories.reserve(candidates.saturating_sub(self.histories.len()));
    }

    /// The occluders of the last [`Selector::select`], the best first.
    pub fn chosen(&self) -> &[ShadowVolume] {
        &self.chosen
    }

    /// Selects occluders for a window. `pool` must have received all changes of `geometry`. Takes O(pool) for the rough
    /// selection and O(occluders) for the exact one.
    pub fn select(
        &mut self,
        pool: &OccluderPool,
        geometry: &dyn Geometry,
        window: &ViewWindow,
    ) -> SelectCounts {
        let mut counts = SelectCounts { candidates: pool.len() as u32, ..SelectCounts::default() };
        let least_sr = self.config.least_share * window.solid_angle_sr();
        let rough = rough_window(window, least_sr as f32);
        let most = match self.config.score {
            Score::SolidAngle => {
                self.rough.clear();
                pool.score(&rough, &mut self.rough);
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
        // The candidates are sorted by slot from here on, so that nothing depends on the order of the partial sort.
        self.rough.sort_unstable_by_key(|&(_, slot)| slot);
        self.shadows.clear();
        self.places.clear();
        for i in 0..self.rough.len() {
            let slot = self.rough[i].1;
            if self.shadows.len() + MOST_SHADOWS > self.shadows.capacity() {
                break;
            }
            let (sketch, place) = (pool.sketch(slot), slot as usize);
            if !self.is_due(place, &sketch, &rough) {
                counts.known += 1;
                continue;
            }
            counts.measured += 1;
            pool.push_shadows(slot, geometry, window, &mut self.shadows);
            self.places.resize(self.shadows.len(), place);
            // The candidate rests for some frames unless it is selected below.
            self.note(place, sketch, &rough);
        }
        self.measured.clear();
        self.measured.extend(
            self.shadows.iter().enumerate().map(|(i, shadow)| (shadow.solid_angle_in(window), i as u32)),
        );
        self.measured.retain(|(solid_angle, _)| *solid_angle >= least_sr);
        self.measured.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.chosen.clear();
        for &(_, i) in &self.measured {
            let shadow = &self.shadows[i as usize];
            let is_full = self.chosen.len() >= self.config.occluders;
            if !is_full && self.chosen.iter().take(COVERED_BY_FIRST).any(|better| covers(better, shadow)) {
                counts.covered += 1;
                continue;
            }
            // A candidate left out because the list is full may be selected next time, so it does not rest.
            let history = &mut self.histories[self.places[i as usize]];
            (history.left, history.length) = (0, 0);
            if !is_full {
                self.chosen.push(*shadow);
            }
        }
        counts.chosen = self.chosen.len() as u32;
        counts
    }

    /// Drops the state of earlier frames, so that the next selection measures every candidate.
    pub fn forget(&mut self) {
        self.histories.clear();
    }

    /// Selects the scored candidates in their order, without measuring them.
    fn choose_in_order(&mut self, pool: &OccluderPool, geometry: &dyn Geometry, window: &ViewWindow) {
        self.chosen.clear();
        for &(_, slot) in &self.rough {
            self.shadows.clear();
            pool.push_shadows(slot, geometry, window, &mut self.shadows);
            let room = self.config.occluders - self.chosen.len();
            self.chosen.extend(self.shadows.iter().take(room));
        }
    }

    fn score_by_equation(&mut self, pool: &OccluderPool, window: &ViewWindow) {
        let RoughWindow { eye, sides, forward, near_m, .. } = rough_window(window, 0.0);
        self.rough.clear();
        for (slot, sketch) in pool.sketches() {
            let to = sketch.center - eye;
            let score = sketch.area_vector.dot(forward).abs() / to.length_squared();
            let reach = -sketch.radius_m;
            let outside = sides.iter().any(|side| side.dot(to) < reach) || forward.dot(to) - near_m < reach;
            // The comparison also excludes NaN, and free slots, whose area is zero.
            if score > 0.0 && !outside {
                self.rough.push((score, slot));
            }
        }
    }

    /// Whether a candidate may be measured now. `false` if a few frames ago it was too small or hidden behind a better
    /// candidate, and it looks the same from this window.
    fn is_due(&mut self, place: usize, sketch: &Sketch, window: &RoughWindow) -> bool {
        let Some(history) = self.histories.get_mut(place) else { return true };
        if history.left == 0 {
            return true;
        }
        history.left -= 1;
        let nearest_m = (sketch.center - window.eye).length() - sketch.radius_m;
        let moved_m = (window.eye - history.eye).length();
        let is_same = history.sketch == *sketch
            && moved_m <= MOST_MOVED * nearest_m
            && window.forward.dot(history.forward) >= MOST_TURNED_COSINE;
        if !is_same {
            history.left = 0;
        }
        !is_same
    }

    /// Records that a candidate was measured. The candidate is not measured again for a while, unless it is selected.
    fn note(&mut self, place: usize, sketch: Sketch, window: &RoughWindow) {
        if self.histories.len() <= place {
            self.histories.resize(place + 1, CandidateHistory::NOTHING);
        }
        let history = &mut self.histories[place];
        let length = if history.sketch == sketch { (history.length * 2).clamp(1, LONGEST_REST) } else { 1 };
        *history =
            CandidateHistory { sketch, eye: window.eye, forward: window.forward, left: length, length };
    }
}

/// A useless candidate is not measured again for one frame, then for two, four, up to this number.
const LONGEST_REST: u8 = 16;

/// The candidate is measured earlier if the eye has moved by this fraction of its distance from the candidate.
const MOST_MOVED: f32 = 0.02;

/// The candidate is measured earlier if the view has turned by more than the angle with this cosine, one degree.
const MOST_TURNED_COSINE: f32 = 0.999_85;

/// The state of a candidate from earlier frames.
#[derive(Clone, Copy, Debug)]
struct CandidateHistory {
    /// The candidate, the eye and the direction of view at the last measurement.
    sketch: Sketch,
    eye: Vec3,
    forward: Vec3,
    /// Number of frames left of its rest, and the length of the rest.
    left: u8,
    length: u8,
}

impl CandidateHistory {
    const NOTHING: Self =
        Self { sketch: Sketch::FREE, eye: Vec3::ZERO, forward: Vec3::ZERO, left: 0, length: 0 };
}

fn rough_window(window: &ViewWindow, least_sr: f32) -> RoughWindow {
    let corners = window.corners();
    let side = |i: usize| corners[i].cross(corners[(i + 1) % 4]).normalize_or_zero().as_vec3();
    // The rough score of a near, large polygon may be wrong by more than a half, but not by three quarters. The comparison
    // of squares needs no root.
    let least = 0.25 * least_sr;
    RoughWindow {
        eye: window.eye_in_world().as_vec3(),
        sides: std::array::from_fn(side),
        forward: window.forward().as_vec3(),
        near_m: window.near_m() as f32,
        least_squared: least * least,
        // A margin for polygons that are not quite flat.
        least_bound: 0.8 * least_sr,
    }
}

/// Whether all of an occluder lies in the shadow of a better one, so that it hides nothing more.
fn covers(better: &ShadowVolume, other: &ShadowVolume) -> bool {
    let corners = other.corners();
    let beyond = |normal: DVec3, distance: f64| corners.iter().all(|v| normal.dot(*v) >= distance);
    beyond(better.cap_normal(), better.cap_distance_m())
        && better.sides().iter().all(|side| beyond(*side, 0.0))
}
