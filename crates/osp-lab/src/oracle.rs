//! The reference: the polygons that are truly visible. It is slow, exact up to sampling, and independent of every
//! culler.
//!
//! A polygon that owns a pixel of an id buffer is visible. At any resolution, polygons smaller than a pixel fall
//! between the samples. So rays are cast at each polygon without a pixel: to points close to its corners, along its
//! edges and in its middle. If no opaque polygon blocks one of these rays, the polygon is visible.

use glam::DVec3;

use osp::{
    math::clip_convex,
    occlusion::raster::Raster,
    polygon::{ConvexPolygon, PolygonId},
    view::ViewWindow,
};

/// A ray that misses a triangle by at most this angle, as a sine, counts as a hit, so that neighbours have no crack.
const BORDER_SINE: f64 = 1.0e-10;

/// Least relative difference of the distances at which a nearer surface blocks a ray.
const NEARER: f64 = 1.0e-10;

/// Width and height of a bin, pixels.
const BIN: usize = 32;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OracleConfig {
    pub width: usize,
    pub height: usize,
}

impl Default for OracleConfig {
    /// 2,560 x 1,440.
    fn default() -> Self {
        Self { width: 2560, height: 1440 }
    }
}

/// A polygon that may be in view.
#[derive(Clone, Copy, Debug)]
pub struct Subject {
    pub id: PolygonId,
    /// The polygon, world space. More than three corners are a fan around the first corner.
    pub polygon: ConvexPolygon,
    /// The part of the polygon that hides polygons behind it, in its plane.
    pub occluder: Option<ConvexPolygon>,
}

/// Whether a polygon is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// A part of the polygon is visible.
    Visible,
    /// The polygon is fully hidden, though a part of it is in the window.
    Hidden,
    /// The polygon is not in the window, or is seen exactly edge-on.
    Outside,
}

/// A triangle relative to the eye, clipped at the near plane.
struct Facet {
    subject: u32,
    /// Whether the triangle hides polygons behind it.
    is_opaque: bool,
    /// Inward unit normals of the side planes through the eye.
    sides: [DVec3; 4],
    side_count: usize,
    corners: [DVec3; 4],
    /// The triangle's plane: `normal . x = distance`.
    normal: DVec3,
    distance: f64,
}

impl Facet {
    fn new(subject: u32, is_opaque: bool, triangle: [DVec3; 3], window: &ViewWindow) -> Option<Self> {
        let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).try_normalize()?;
        let far = triangle.iter().map(|v| v.length()).fold(0.0, f64::max);
        let distance = normal.dot(triangle[0]);
        let (normal, distance) = if distance < 0.0 { (-normal, -distance) } else { (normal, distance) };
        // A NaN fails the comparison, too.
        let has_a_face = distance > 1.0e-12 * far && far.is_finite();
        if !has_a_face {
            return None;
        }
        let (mut corners, mut count) = ([DVec3::ZERO; 4], 0);
        let near = window.near_m().max(1.0e-9 * far);
        clip_convex(
            &triangle,
            |p| window.forward().dot(p) - near,
            |p| {
                corners[count] = p;
                count += 1;
            },
        );
        if count < 3 {
            return None;
        }
        let middle = corners[..count].iter().fold(DVec3::ZERO, |sum, v| sum + *v);
        if corners[0].cross(corners[1]).dot(middle) < 0.0 {
            corners[..count].reverse();
        }
        let mut sides = [DVec3::ZERO; 4];
        for i in 0..count {
            let (from, to) = (corners[i], corners[(i + 1) % count]);
            sides[i] = from.cross(to - from).normalize_or_zero();
        }
        Some(Self { subject, is_opaque, sides, side_count: count, corners, normal, distance })
    }

    /// The distance at which a ray from the eye along a unit direction hits the triangle.
    fn meet(&self, direction: DVec3) -> Option<f64> {
        let inside = self.sides[..self.side_count].iter().all(|side| side.dot(direction) >= -BORDER_SINE);
        let along = self.normal.dot(direction);
        (inside && along > 0.0).then(|| self.distance / along)
    }
}

/// The visible polygons of one view.
pub struct Oracle {
    window: ViewWindow,
    raster: Raster,
    width: usize,
    height: usize,
    facets: Vec<Facet>,
    /// For each subject, the range of its triangles in `facets`.
    facets_of: Vec<std::ops::Range<u32>>,
    ids: Vec<PolygonId>,
    /// For each pixel, the nearest opaque facet.
    owner: Vec<u32>,
    /// For each pixel, the reciprocal of the distance of its owner along the view.
    depth: Vec<f64>,
    /// For each bin, the range of its opaque facets in `binned`.
    bins: Vec<std::ops::Range<u32>>,
    binned: Vec<u32>,
    sight: Vec<Sight>,
}

const NO_FACET: u32 = u32::MAX;

impl std::fmt::Debug for Oracle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Oracle").field("subjects", &self.ids.len()).finish_non_exhaustive()
    }
}

impl Oracle {
    /// Determines which of these polygons are visible. O(pixels covered + polygons) time; tens of bytes per pixel.
    pub fn new(
        window: &ViewWindow,
        subjects: impl IntoIterator<Item = Subject>,
        config: OracleConfig,
    ) -> Self {
        let (width, height) = (config.width.clamp(1, 1 << 14), config.height.clamp(1, 1 << 14));
        let mut oracle = Self {
            window: *window,
            raster: Raster::new(window, width as f64, height as f64),
            width,
            height,
            facets: Vec::new(),
            facets_of: Vec::new(),
            ids: Vec::new(),
            owner: vec![NO_FACET; width * height],
            depth: vec![0.0; width * height],
            bins: Vec::new(),
            binned: Vec::new(),
            sight: Vec::new(),
        };
        for subject in subjects {
            let start = oracle.facets.len() as u32;
            let number = oracle.ids.len() as u32;
            let is_all_opaque = subject.occluder == Some(subject.polygon);
            let parts =
                [(Some(subject.polygon), is_all_opaque), (subject.occluder.filter(|_| !is_all_opaque), true)];
            for (polygon, is_opaque) in parts {
                let Some(polygon) = polygon else { continue };
                for pair in polygon.vertices()[1..].windows(2) {
                    let triangle = [polygon.vertices()[0], pair[0], pair[1]].map(|p| window.from_eye(p));
                    oracle.facets.extend(Facet::new(number, is_opaque, triangle, window));
                }
            }
            oracle.facets_of.push(start..oracle.facets.len() as u32);
            oracle.ids.push(subject.id);
        }
        oracle.sight = vec![Sight::Outside; oracle.ids.len()];
        oracle.draw();
        oracle.sort_into_bins();
        oracle.classify_remaining();
        oracle
    }

    /// The polygons in the given order, each with its visibility.
    pub fn answers(&self) -> impl Iterator<Item = (PolygonId, Sight)> + '_ {
        self.ids.iter().copied().zip(self.sight.iter().copied())
    }

    /// The rows of pixels that a facet may touch.
    fn rows(&self, facet: &Facet) -> std::ops::Range<usize> {
        let ys = facet.corners[..facet.side_count].iter().map(|v| self.raster.project(*v).y);
        let (low, high) = ys.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        let end = self.height as f64;
        (low - 1.0).clamp(0.0, end) as usize..(high + 1.0).clamp(0.0, end) as usize
    }

    fn interval(&self, sides: &[[f64; 3]], y: f64) -> std::ops::Range<usize> {
        let (mut from, mut to) = (0.0f64, self.width as f64);
        for [a, b, c] in sides {
            let rest = b * y + c + BORDER_SINE;
            if *a > 0.0 {
                from = from.max((-rest / a - 0.5).ceil());
            } else if *a < 0.0 {
                to = to.min((-rest / a - 0.5).floor() + 1.0);
            } else if rest < 0.0 {
                return 0..0;
            }
        }
        // The cast saturates; a NaN becomes 0.
        from as usize..to.max(0.0) as usize
    }

    fn draw(&mut self) {
        // Opaque facets first. A transparent polygon owns no pixel, but is visible if no opaque polygon is nearer.
        for pass in [true, false] {
            for i in 0..self.facets.len() {
                let facet = &self.facets[i];
                let subject = facet.subject as usize;
                if facet.is_opaque != pass {
                    continue;
                }
                let mut sides = [[0.0; 3]; 4];
                for (side, normal) in sides.iter_mut().zip(facet.sides) {
                    *side = self.raster.in_pixels(normal);
                }
                let sides = &sides[..facet.side_count];
                let [dx, dy, d0] = self.raster.in_pixels(facet.normal).map(|v| v / facet.distance);
                for row in self.rows(facet) {
                    let y = row as f64 + 0.5;
                    for x in self.interval(sides, y) {
                        let depth = dx * (x as f64 + 0.5) + dy * y + d0;
                        let at = row * self.width + x;
                        if depth > self.depth[at] {
                            if pass {
                                self.depth[at] = depth;
                                self.owner[at] = i as u32;
                            } else {
                                self.sight[subject] = Sight::Visible;
                            }
                        }
                    }
                }
            }
        }
        for &facet in &self.owner {
            if facet != NO_FACET {
                self.sight[self.facets[facet as usize].subject as usize] = Sight::Visible;
            }
        }
    }

    /// The bins that a facet's projection may touch.
    fn bins_of(&self, facet: &Facet) -> (std::ops::RangeInclusive<usize>, std::ops::RangeInclusive<usize>) {
        let at = facet.corners[..facet.side_count].iter().map(|v| self.raster.project(*v));
        let (mut low, mut high) = (glam::DVec2::INFINITY, glam::DVec2::NEG_INFINITY);
        for p in at {
            low = low.min(p);
            high = high.max(p);
        }
        let bin = |v: f64, pixels: usize| v.clamp(0.0, pixels as f64 - 1.0) as usize / BIN;
        (
            bin(low.x - 1.0, self.width)..=bin(high.x + 1.0, self.width),
            bin(low.y - 1.0, self.height)..=bin(high.y + 1.0, self.height),
        )
    }

    fn sort_into_bins(&mut self) {
        let (columns, rows) = (self.width.div_ceil(BIN), self.height.div_ceil(BIN));
        let mut counts = vec![0u32; columns * rows + 1];
        for fill in [false, true] {
            if fill {
                let mut sum = 0;
                for count in &mut counts {
                    sum += std::mem::replace(count, sum);
                }
                self.binned = vec![0; sum as usize];
                self.bins = (0..columns * rows).map(|b| counts[b]..counts[b + 1]).collect();
            }
            for (i, facet) in self.facets.iter().enumerate() {
                if !facet.is_opaque {
                    continue;
                }
                let (xs, ys) = self.bins_of(facet);
                for y in ys {
                    for x in xs.clone() {
                        let count = &mut counts[y * columns + x];
                        if fill {
                            self.binned[*count as usize] = i as u32;
                        }
                        *count += 1;
                    }
                }
            }
        }
    }

    /// Casts rays at the polygons that own no pixel.
    fn classify_remaining(&mut self) {
        for subject in 0..self.ids.len() {
            if self.sight[subject] == Sight::Visible {
                continue;
            }
            let mut sight = Sight::Outside;
            for i in self.facets_of[subject].clone() {
                let facet = &self.facets[i as usize];
                let corners = &facet.corners[..facet.side_count];
                let middle = corners.iter().fold(DVec3::ZERO, |sum, v| sum + *v) / corners.len() as f64;
                let mut ask = |x: DVec3| {
                    if sight != Sight::Visible && self.is_in_window(x) {
                        sight =
                            if self.is_blocked(x, subject as u32) { Sight::Hidden } else { Sight::Visible };
                    }
                };
                ask(middle);
                for k in 0..corners.len() {
                    let edge = (corners[k] + corners[(k + 1) % corners.len()]) * 0.5;
                    for towards in [0.5, 0.9, 0.999] {
                        ask(middle.lerp(corners[k], towards));
                        ask(middle.lerp(edge, towards));
                    }
                }
            }
            self.sight[subject] = sight;
        }
    }

    fn is_in_window(&self, x: DVec3) -> bool {
        let corners = self.window.corners();
        self.window.forward().dot(x) > self.window.near_m()
            && (0..4).all(|i| corners[i].cross(corners[(i + 1) % 4]).dot(x) > 0.0)
    }

    /// Whether an opaque polygon other than `subject` lies between the eye and a point.
    pub fn is_blocked(&self, x: DVec3, subject: u32) -> bool {
        let distance = x.length();
        let direction = x / distance;
        let at = self.raster.project(x);
        let pixel = |v: f64, pixels: usize| v.clamp(0.0, pixels as f64 - 1.0) as usize;
        let (px, py) = (pixel(at.x, self.width), pixel(at.y, self.height));
        let stops = |facet: u32| {
            let facet = &self.facets[facet as usize];
            facet.subject != subject && facet.meet(direction).is_some_and(|t| t < distance * (1.0 - NEARER))
        };
        // The owner of the pixel is tested first, because it most likely blocks the ray.
        let owner = self.owner[py * self.width + px];
        if owner != NO_FACET && stops(owner) {
            return true;
        }
        let bin = py / BIN * self.width.div_ceil(BIN) + px / BIN;
        self.bins[bin].clone().any(|k| stops(self.binned[k as usize]))
    }
}
