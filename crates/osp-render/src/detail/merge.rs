//! Merges neighbouring quads of a ribbon or tube along its strokes.

use glam::{Vec2, Vec3};

use crate::record::{FACING, PolygonRecord, SMOOTH};
use osp::math::Aabb;
use osp_session::{
    brush::{Draw, Effect, Lighting, UV_LIMIT},
    scene::Stroke,
};

/// The successor of a quad is searched among this number of following quads. One ring of a tube has fewer quads.
const REACH: usize = 24;
/// Normals or alphas that differ by at most one 8-bit step count as equal.
const STEP: f32 = 1.0 / 255.0;
/// Texture coordinates that differ by at most this, the rounding error, count as equal.
const UV_ROUNDING: f32 = 1.0e-3;
/// Smallest error of a flat-shaded merged quad, as a fraction of its length. Flat shading depends on the direction to
/// the eye, so such a quad must be small in the picture.
const FLAT_ERROR: f32 = 1.0 / 24.0;

/// The attributes of the corners that affect the picture of a stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Look {
    /// Whether texture coordinates and alpha affect the picture.
    has_texture: bool,
    has_normals: bool,
    /// Whether each polygon has a single normal.
    is_flat: bool,
}

impl Look {
    /// Returns the attributes for a stroke of opaque polygons; `None` if these are never merged.
    pub(super) fn of(stroke: &Stroke) -> Option<Self> {
        let Some(brush) = stroke.brush() else {
            return Some(Self { has_texture: false, has_normals: true, is_flat: true });
        };
        let is_opaque = matches!(brush.draw, Draw::Opaque | Draw::Cutout);
        let is_toon = brush.effect == Effect::Toon;
        (is_opaque && (is_toon || brush.effect == Effect::None)).then(|| Self {
            has_texture: brush.picture.is_some() || brush.draw == Draw::Cutout,
            has_normals: is_toon || brush.lighting != Lighting::Unlit,
            is_flat: false,
        })
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub(super) bit: u32,
    pub(super) stroke: usize,
    pub(super) look: Look,
    pub(super) record: PolygonRecord,
}

/// A quad that replaces several polygons of a cluster.
#[derive(Clone, Copy, Debug)]
pub(super) struct Merged {
    /// A bit for each replaced polygon.
    pub(super) mask: u64,
    /// Largest distance between a point of the polygons and the point of the quad with the same paint, metres.
    pub(super) error_m: f32,
    pub(super) record: PolygonRecord,
}

#[derive(Clone, Copy, Debug)]
struct Vertex {
    place: Vec3,
    normal: Vec3,
    uv: Vec2,
    alpha: f32,
    /// Index of the source, and number of its corner.
    from: (usize, usize),
}

/// Consecutive quads of a ribbon.
#[derive(Clone, Debug)]
struct Strip {
    /// The end points of each edge across the ribbon.
    rungs: Vec<[Vertex; 2]>,
    mask: u64,
    /// Largest distance, over the quads, between a quad's two triangles and its bilinear surface.
    fold_m: f32,
    /// Whether normals or alpha jump, so that linear interpolation does not reproduce them.
    leaps: bool,
    look: Look,
    stroke: usize,
    /// Index of the merged quad that replaces the strip, if there is one.
    node: Option<usize>,
}

/// Returns all quads that replace polygons of a cluster, and the bounds of these polygons. If two quads share polygons,
/// the earlier quad replaces all polygons of the later one.
pub(super) fn merge(sources: &[Source]) -> (Vec<Merged>, Aabb) {
    let mut merged = Vec::new();
    let mut strips = quads(sources, &mut merged);
    let mut is_next = vec![None; strips.len()];
    let mut has_before = vec![false; strips.len()];
    for (i, strip) in strips.iter().enumerate() {
        let after =
            (i + 1..strips.len().min(i + REACH)).find(|&k| !has_before[k] && strip.leads_to(&strips[k]));
        if let Some(k) = after {
            is_next[i] = Some(k);
            has_before[k] = true;
        }
    }
    let starts: Vec<usize> = (0..strips.len()).filter(|&i| !has_before[i]).collect();
    for start in starts {
        let mut chain: Vec<Strip> = std::iter::successors(Some(start), |&i| is_next[i])
            .map(|i| std::mem::replace(&mut strips[i], Strip::NONE))
            .collect();
        while chain.len() > 1 {
            chain = chain.chunks(2).map(|pair| join(pair, sources, &mut merged)).collect();
        }
    }
    merged.retain(|quad| quad.error_m.is_finite());
    merged.sort_by_key(|quad| std::cmp::Reverse(quad.mask.count_ones()));
    let all = merged.iter().fold(0, |all, quad| all | quad.mask);
    let corners = |source: &Source| Aabb::from_points(&[0, 1, 2, 3].map(|i| place(&source.record, i)));
    let within = sources.iter().filter(|source| all >> source.bit & 1 == 1);
    let bounds = within.fold(Aabb::EMPTY, |bounds, source| bounds.union(&corners(source)));
    (merged, bounds)
}

/// Joins the two strips of a pair, and adds the quad that replaces both to `merged`.
fn join(pair: &[Strip], sources: &[Source], merged: &mut Vec<Merged>) -> Strip {
    let [a, b] = pair else { return pair[0].clone() };
    let mut strip = a.followed_by(b);
    let error_m = strip.error_m();
    // A finer quad with the same error or more is never drawn.
    for part in [a, b].iter().filter_map(|part| part.node) {
        if merged[part].error_m >= error_m {
            merged[part].error_m = f32::INFINITY;
        }
    }
    strip.node = Some(merged.len());
    let corners = [strip.rungs[0][0], strip.rungs[0][1], strip.last()[1], strip.last()[0]];
    merged.push(Merged { mask: strip.mask, error_m, record: record(corners, sources) });
    strip
}

/// Returns each quad of a cluster as a strip. Two triangles that together are a quad become one quad, which is added to
/// `merged`.
fn quads(sources: &[Source], merged: &mut Vec<Merged>) -> Vec<Strip> {
    let mut strips = Vec::new();
    let mut at = 0;
    while let Some(source) = sources.get(at) {
        let own = vertices(sources, at);
        at += 1;
        if source.record.corners[2][3] & FACING != 0 || own.iter().any(|vertex| !vertex.place.is_finite()) {
            continue;
        }
        let is_facet = source.look.has_normals && source.record.corners[2][3] & SMOOTH == 0;
        let look = Look { is_flat: source.look.is_flat || is_facet, ..source.look };
        let (mask, stroke) = (1 << source.bit, source.stroke);
        let new = |rungs: Vec<[Vertex; 2]>, mask, leaps, node| {
            let fold_m = fold_m(&rungs[0], &rungs[1]);
            Strip { rungs, mask, fold_m, leaps, look, stroke, node }
        };
        if !is_triangle(&own) {
            let [a, b, c, d] = own;
            strips.push(new(vec![[a, b], [d, c]], mask, false, None));
            continue;
        }
        let Some(next) = sources.get(at).filter(|next| {
            next.bit == source.bit + 1
                && next.stroke == stroke
                && next.record.corners[2][3] == source.record.corners[2][3]
        }) else {
            continue;
        };
        let other = vertices(sources, at);
        let is_same = |i: usize, k: usize| same_corner(sources, own[i], other[k]);
        // A quad is cut along either diagonal. The merged quad is cut along its first and third corner.
        let (corners, cut) = if !is_triangle(&other) {
            continue;
        } else if is_same(0, 0) && is_same(2, 1) {
            let corners = [own[0], own[1], own[2], other[2]];
            (corners, corners)
        } else if is_same(1, 0) && is_same(2, 2) {
            let [a, b, c, d] = [own[0], own[1], other[1], own[2]];
            ([a, b, c, d], [b, c, d, a])
        } else {
            continue;
        };
        let mask = mask | 1 << next.bit;
        let normals = [&own, &other].map(|of| of[0].normal);
        let leaps = is_facet && normals[0].distance(normals[1]) > STEP;
        let longest_m =
            corners[0].place.distance(corners[2].place).max(corners[1].place.distance(corners[3].place));
        let error_m = if leaps { longest_m * 0.5 } else { 0.0 };
        let error_m = if look.is_flat { error_m.max(longest_m * FLAT_ERROR) } else { error_m };
        merged.push(Merged { mask, error_m, record: record(cut, sources) });
        let [a, b, c, d] = corners;
        strips.push(new(vec![[a, b], [d, c]], mask, leaps, Some(merged.len() - 1)));
        at += 1;
    }
    strips
}

impl Strip {
    const NONE: Self = Self {
        rungs: Vec::new(),
        mask: 0,
        fold_m: 0.0,
        leaps: false,
        look: Look { has_texture: false, has_normals: false, is_flat: false },
        stroke: 0,
        node: None,
    };

    fn last(&self) -> &[Vertex; 2] {
        &self.rungs[self.rungs.len() - 1]
    }

    /// Whether `next` continues this strip: its first edge is this strip's last edge.
    fn leads_to(&self, next: &Self) -> bool {
        self.stroke == next.stroke
            && self.look == next.look
            && self.last().iter().zip(&next.rungs[0]).all(|(end, start)| {
                end.place == start.place
                    && (!self.look.has_texture || end.uv.distance(start.uv) <= UV_ROUNDING)
            })
    }

    fn followed_by(&self, next: &Self) -> Self {
        let mut strip = self.clone();
        strip.rungs.extend_from_slice(&next.rungs[1..]);
        strip.mask |= next.mask;
        strip.fold_m = strip.fold_m.max(next.fold_m);
        strip.leaps |= next.leaps;
        for (end, start) in self.last().iter().zip(&next.rungs[0]) {
            strip.leaps |= self.look.has_normals && end.normal.distance(start.normal) > STEP;
            strip.leaps |= self.look.has_texture && (end.alpha - start.alpha).abs() > STEP;
        }
        strip
    }

    /// Error if one quad replaces all quads of the strip, metres.
    fn error_m(&self) -> f32 {
        let (first, last) = (&self.rungs[0], self.last());
        let mut error_m = 0.0f32;
        let (mut longest_m, mut leaps) = (0.0f32, self.leaps);
        for side in 0..2 {
            let [from, to] = [first, last].map(|rung| rung[side]);
            let length_m = from.place.distance(to.place);
            longest_m = longest_m.max(length_m);
            for (rung, part) in self.rungs.iter().zip(self.parts(side)) {
                let vertex = rung[side];
                error_m = error_m.max(vertex.place.distance(from.place.lerp(to.place, part)));
                if self.look.has_texture {
                    let off = (vertex.uv - from.uv.lerp(to.uv, part)).abs();
                    let along = (to.uv - from.uv).abs().x;
                    let across = (first[1].uv - first[0].uv).abs().y;
                    let wide_m = first[0].place.distance(first[1].place);
                    error_m = error_m.max(shift(off.x, along) * length_m).max(shift(off.y, across) * wide_m);
                    leaps |= (vertex.alpha - from.alpha - (to.alpha - from.alpha) * part).abs() > STEP;
                }
                if self.look.has_normals {
                    let normal = from.normal.lerp(to.normal, part).normalize_or_zero();
                    leaps |= vertex.normal.distance(normal) > STEP;
                }
            }
        }
        error_m += self.fold_m + fold_m(first, last);
        leaps |= self.look.is_flat && first[0].normal.distance(last[0].normal) > STEP;
        // If attributes jump, the same paint may lie up to half the quad's length away.
        if leaps {
            error_m = error_m.max(longest_m * 0.5);
        }
        if self.look.is_flat {
            error_m = error_m.max(longest_m * FLAT_ERROR);
        }
        error_m
    }

    /// The parameter of each rung along one side, from 0 to 1. It follows the texture if there is one, else the length.
    fn parts(&self, side: usize) -> Vec<f32> {
        let of = |rung: &[Vertex; 2]| rung[side];
        let (first, last) = (of(&self.rungs[0]), of(self.last()));
        let along = last.uv.x - first.uv.x;
        if self.look.has_texture && along.abs() > UV_ROUNDING {
            return self.rungs.iter().map(|rung| (of(rung).uv.x - first.uv.x) / along).collect();
        }
        let mut at_m = vec![0.0];
        for pair in self.rungs.windows(2) {
            at_m.push(at_m[at_m.len() - 1] + of(&pair[0]).place.distance(of(&pair[1]).place));
        }
        let all_m = at_m[at_m.len() - 1].max(f32::MIN_POSITIVE);
        at_m.iter().map(|at_m| at_m / all_m).collect()
    }
}

/// The shift of a texture as a fraction of its range; 0 within the rounding error.
fn shift(off: f32, of: f32) -> f32 {
    if off <= UV_ROUNDING { 0.0 } else { off / of.max(UV_ROUNDING) }
}

fn fold_m([a, b]: &[Vertex; 2], [d, c]: &[Vertex; 2]) -> f32 {
    ((a.place - b.place) + (c.place - d.place)).length() * 0.25
}

pub(super) fn place(record: &PolygonRecord, corner: usize) -> Vec3 {
    let [x, y, z, _] = record.corners[corner].map(f32::from_bits);
    Vec3::new(x, y, z)
}

fn is_triangle(corners: &[Vertex; 4]) -> bool {
    corners[2].place == corners[3].place
}

/// Whether two corners have the same position, texture coordinates, normal and alpha.
fn same_corner(sources: &[Source], a: Vertex, b: Vertex) -> bool {
    let words = |of: Vertex| {
        let (record, corner) = (&sources[of.from.0].record, of.from.1);
        (record.uv[corner], record.normals[corner], record.corners[1][3] >> (8 * corner) & 0xff)
    };
    a.place == b.place && words(a) == words(b)
}

fn vertices(sources: &[Source], at: usize) -> [Vertex; 4] {
    let record = &sources[at].record;
    let halves = |word: u32| [word as u16, (word >> 16) as u16].map(|half| f32::from(half as i16) / 32767.0);
    let places = [0, 1, 2, 3].map(|corner| place(record, corner));
    let flat = (places[2] - places[0]).cross(places[3] - places[1]).normalize_or_zero();
    [0, 1, 2, 3].map(|corner| {
        let [x, y] = halves(record.normals[corner]);
        let z = 1.0 - x.abs() - y.abs();
        let back = (-z).max(0.0);
        let smooth = Vec3::new(x - back.copysign(x), y - back.copysign(y), z).normalize_or_zero();
        Vertex {
            place: places[corner],
            normal: if record.corners[2][3] & SMOOTH == 0 { flat } else { smooth },
            uv: Vec2::from(halves(record.uv[corner])) * UV_LIMIT,
            alpha: (record.corners[1][3] >> (8 * corner) & 0xff) as f32 / 255.0,
            from: (at, corner),
        }
    })
}

fn record(corners: [Vertex; 4], sources: &[Source]) -> PolygonRecord {
    let mut record = sources[corners[0].from.0].record;
    let mut alpha = 0;
    for (i, (at, corner)) in corners.map(|vertex| vertex.from).into_iter().enumerate() {
        let of = &sources[at].record;
        record.corners[i][..3].copy_from_slice(&of.corners[corner][..3]);
        record.uv[i] = of.uv[corner];
        record.normals[i] = of.normals[corner];
        alpha |= (of.corners[1][3] >> (8 * corner) & 0xff) << (8 * i);
    }
    record.corners[1][3] = alpha;
    record
}
