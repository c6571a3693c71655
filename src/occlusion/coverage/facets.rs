//! Converts occluders to facets: projects their corners, cuts them at the near plane, turns them
//! counterclockwise and links neighbours.

use glam::{DVec2, DVec3};

use super::{
    super::{ShadowVolume, raster::Raster},
    facet::{FACET_SIDES, Facet, Outline, Pushed, SHARED, plane_in_pixels},
    picture::Picture,
    surfaces::{EdgeCode, SIDES, Surfaces},
    table::NONE,
};
use crate::{polygon::PolygonId, view::ViewWindow};

/// A corner relative to the eye, in the axes of the view, and its position in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    corner: u32,
    /// Coordinates to the right, up and forward, relative to the eye, metres.
    pub(super) eye: DVec3,
    at: [i32; 2],
    /// Reciprocal depth; 0 if the corner lies nearer than the near plane, or its position in the picture is too
    /// imprecise.
    pub(super) nearness: f64,
}

/// The facets of a frame. Their memory is used again in the next frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Facets {
    pub(super) seen: Vec<Seen>,
    /// For each corner of the surfaces, its index in `seen`. It is valid only if that entry has the corner's
    /// number.
    pub(super) seen_of: Vec<u32>,
    /// For each polygon, the index of its facet. It is valid only if that facet has the polygon's number.
    facet_of: Vec<u32>,
    /// A facet for each polygon, then the second facets of polygons that the near plane cuts into two.
    pub(super) facets: Vec<Facet>,
    pub(super) taken: usize,
    /// Number of facets with area before triangles were joined to quads.
    drawn: usize,
    picture: Option<Picture>,
}

impl Facets {
    /// Makes room for surfaces of `polygons` polygons, of which a frame fills `taken`.
    pub(super) fn reserve(&mut self, polygons: usize, taken: usize) {
        let corners = SIDES * taken;
        self.seen.reserve(corners);
        // The near plane may cut each into two.
        self.facets.reserve(2 * taken);
        self.seen_of.resize(self.seen_of.len().max(2 * polygons), 0);
        self.facet_of.resize(self.facet_of.len().max(polygons), 0);
    }

    /// The picture of the last frame, if there was one.
    pub(super) fn picture(&self) -> Option<&Picture> {
        self.picture.as_ref()
    }

    /// The facets of the last frame.
    pub(super) fn all(&self) -> &[Facet] {
        &self.facets
    }

    /// Number of polygons, or parts of polygons, with area in the picture.
    pub(super) fn drawn(&self) -> usize {
        self.drawn
    }

    /// Number of facets with area.
    pub(super) fn with_area(&self) -> usize {
        self.facets.iter().filter(|facet| facet.len > 0).count()
    }

    /// The first facet of each polygon.
    pub(super) fn taken(&self) -> &[Facet] {
        &self.facets[..self.taken]
    }

    /// Replaces the facets by those of `polygons`, and converts their corners to the axes of the view. Returns the mean
    /// distance of the corners from the eye, metres. A distance is the sum of the absolute coordinates.
    pub(super) fn take(
        &mut self,
        surfaces: &Surfaces,
        polygons: impl Iterator<Item = PolygonId>,
        raster: &Raster,
    ) -> f64 {
        self.seen.clear();
        self.facets.clear();
        self.seen_of.resize(self.seen_of.len().max(surfaces.corner_end()), 0);
        self.facet_of.resize(self.facet_of.len().max(surfaces.face_end()), 0);
        for id in polygons {
            let corners = surfaces.corners_of(id);
            if corners.is_empty() {
                continue;
            }
            for &corner in corners {
                if self.seen(corner).is_none() {
                    let eye = raster.in_axes(surfaces.position(corner).as_dvec3() - raster.eye_in_world);
                    self.add_seen(Seen { corner, eye, at: [0; 2], nearness: 0.0 });
                }
            }
            self.facet_of[id.index()] = self.facets.len() as u32;
            self.facets.push(Facet { polygon: id.0, ..Facet::NONE });
        }
        self.taken = self.facets.len();
        let sum: f64 = self.seen.iter().map(|seen| seen.eye.abs().element_sum()).sum();
        sum / self.seen.len().max(1) as f64
    }

    /// The entry of a corner in `seen`, if it has one.
    #[inline(always)]
    fn seen(&self, corner: u32) -> Option<&Seen> {
        self.seen.get(self.seen_of[corner as usize] as usize).filter(|seen| seen.corner == corner)
    }

    #[inline(always)]
    fn add_seen(&mut self, seen: Seen) {
        self.seen_of[seen.corner as usize] = self.seen.len() as u32;
        self.seen.push(seen);
    }

    /// A corner relative to the eye, and its position and reciprocal depth in the last picture. The result is stored if
    /// there is room.
    #[inline(always)]
    pub(super) fn see(
        &mut self,
        surfaces: &Surfaces,
        corner: u32,
        picture: &Picture,
    ) -> (DVec3, ([i32; 2], f64)) {
        if let Some(Seen { eye, at, nearness, .. }) = self.seen(corner) {
            return (*eye, (*at, *nearness));
        }
        let Picture { raster, .. } = picture;
        let eye = raster.in_axes(surfaces.position(corner).as_dvec3() - raster.eye_in_world);
        let (at, nearness) = picture.project(eye);
        if self.seen.len() < self.seen.capacity() {
            self.add_seen(Seen { corner, eye, at, nearness });
        }
        (eye, (at, nearness))
    }

    /// The lowest and highest tangents of all corners; `None` if a corner is nearer than `near_m`.
    pub(super) fn tangents(&self, near_m: f64) -> Option<[DVec2; 2]> {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for Seen { eye, .. } in &self.seen {
            if eye.z < near_m {
                return None;
            }
            let at = eye.truncate() / eye.z;
            (low, high) = (low.min(at), high.max(at));
        }
        Some([low, high])
    }

    /// Projects all facets to a picture and links neighbours.
    pub(super) fn project(&mut self, surfaces: &Surfaces, picture: Picture) {
        self.picture = Some(picture);
        for seen in &mut self.seen {
            (seen.at, seen.nearness) = picture.project(seen.eye);
        }
        for i in 0..self.taken {
            let id = PolygonId(self.facets[i].polygon);
            self.set_up(i, surfaces.corners_of(id), id.0 * SIDES as u32, &picture);
        }
        for i in 0..self.facets.len() {
            self.find_mates(i, surfaces);
        }
        self.drawn = self.with_area();
        self.join_triangles(surfaces, &picture.raster);
    }

    /// Sets the outline and plane of a facet. Leaves the facet without corners if the polygon has no area in
    /// the picture.
    #[inline(always)]
    fn set_up(&mut self, facet: usize, corners: &[u32], first_edge: EdgeCode, picture: &Picture) {
        let mut places = [0; SIDES];
        let mut eyes = [DVec3::ZERO; SIDES];
        let (mut is_whole, mut is_drawn) = (true, false);
        for (i, &corner) in corners.iter().enumerate() {
            places[i] = self.seen_of[corner as usize];
            let seen = &self.seen[places[i] as usize];
            eyes[i] = seen.eye;
            is_whole &= seen.nearness > 0.0;
            is_drawn |= seen.eye.z >= picture.near;
        }
        let (places, eyes) = (&places[..corners.len()], &eyes[..corners.len()]);
        if is_whole {
            let mut outline = Outline::default();
            for (i, &place) in places.iter().enumerate() {
                let seen = &self.seen[place as usize];
                outline.push(seen.at, seen.nearness, first_edge + i as u32);
            }
            self.finish(facet, &outline, eyes, picture);
        } else if is_drawn {
            let edge = |i: u32| first_edge + i;
            match (places, eyes) {
                (&[a, b, c, d], &[at_a, at_b, at_c, at_d]) => {
                    // At the near plane, a bent polygon has a defined border only as two triangles.
                    let half = self.facets.len();
                    self.facets[facet].half = half as u32;
                    self.facets.push(Facet { polygon: self.facets[facet].polygon, ..Facet::NONE });
                    self.set_up_cut(
                        facet,
                        [a, b, c],
                        [edge(0), edge(1), SHARED],
                        [at_a, at_b, at_c],
                        picture,
                    );
                    self.set_up_cut(half, [a, c, d], [SHARED, edge(2), edge(3)], [at_a, at_c, at_d], picture);
                    self.join_parts(facet, half);
                }
                (&[a, b, c], &[at_a, at_b, at_c]) => {
                    self.set_up_cut(
                        facet,
                        [a, b, c],
                        [edge(0), edge(1), edge(2)],
                        [at_a, at_b, at_c],
                        picture,
                    );
                }
                _ => {}
            }
        }
    }

    /// Sets up a facet from the part of a triangle beyond the near plane.
    fn set_up_cut(
        &mut self,
        facet: usize,
        places: [u32; 3],
        edges: [EdgeCode; 3],
        eyes: [DVec3; 3],
        picture: &Picture,
    ) {
        let mut outline = Outline::default();
        if self.cut(places, edges, picture, &mut outline) {
            self.finish(facet, &outline, &eyes, picture);
        }
    }

    #[inline(always)]
    fn finish(&mut self, facet: usize, outline: &Outline, eyes: &[DVec3], picture: &Picture) {
        let facet = &mut self.facets[facet];
        facet.set_outline(outline);
        if facet.len > 0 {
            facet.set_plane(eyes, &picture.raster, Pushed::Back);
        }
    }

    /// Links the two parts of a polygon as neighbours if they lie on different sides of the edge between
    /// them.
    fn join_parts(&mut self, first: usize, second: usize) {
        let (a, b) = (&self.facets[first], &self.facets[second]);
        if let (Some(i), Some(k)) = (a.shared(), b.shared())
            && a.is_turned == b.is_turned
        {
            self.facets[first].mates[i] = second as u32;
            self.facets[second].mates[k] = first as u32;
        }
    }

    /// Adds the part of a triangle beyond the near plane to `outline`. Returns `false` if a corner is too
    /// imprecise.
    fn cut(&self, places: [u32; 3], edges: [EdgeCode; 3], picture: &Picture, outline: &mut Outline) -> bool {
        for (i, edge) in edges.into_iter().enumerate() {
            let (from, to) = (places[i], places[(i + 1) % 3]);
            let (a, b) = (&self.seen[from as usize], &self.seen[to as usize]);
            let [a_in, b_in] = [a, b].map(|seen| seen.eye.z >= picture.near);
            if a_in {
                if a.nearness == 0.0 {
                    return false;
                }
                outline.push(a.at, a.nearness, edge);
            }
            if a_in != b_in {
                // Both polygons of the edge compute the corner from the same end, so the results are equal.
                let (low, high) = if from < to { (a.eye, b.eye) } else { (b.eye, a.eye) };
                let along = (picture.near - low.z) / (high.z - low.z);
                let mut eye = low + (high - low) * along;
                eye.z = picture.near;
                let size = low.abs().element_sum() + high.abs().element_sum();
                let (at, nearness) = picture.project(eye);
                let is_known = nearness > 0.0 && size <= picture.most_tangent * picture.near;
                if !is_known {
                    return false;
                }
                outline.push(at, nearness, if a_in { NONE } else { edge });
            }
        }
        true
    }

    /// Links each edge of a facet to a neighbour: a facet at the same edge that has no neighbour there yet.
    #[inline(always)]
    fn find_mates(&mut self, i: usize, surfaces: &Surfaces) {
        for side in 0..usize::from(self.facets[i].len) {
            let facet = &self.facets[i];
            let edge = facet.edges[side];
            if edge >= SHARED || facet.mates[side] != NONE {
                continue;
            }
            let end = surfaces.directed(edge)[usize::from(!facet.is_turned)];
            for other_edge in surfaces.mates(edge) {
                if let Some((place, k)) = self.free_side(other_edge, facet.polygon, end, surfaces) {
                    self.facets[place as usize].mates[k] = i as u32;
                    self.facets[i].mates[side] = place;
                    break;
                }
            }
        }
    }

    /// Finds the facet that has the edge `edge` of another polygon, and the number of this side. The side must begin at
    /// corner `start` and have no neighbour yet.
    #[inline(always)]
    fn free_side(&self, edge: EdgeCode, but: u32, start: u32, surfaces: &Surfaces) -> Option<(u32, usize)> {
        let polygon = edge / SIDES as u32;
        let first = self.facet_of[polygon as usize];
        let half =
            self.facets.get(first as usize).filter(|first| first.polygon == polygon && polygon != but)?.half;
        [first, half].into_iter().find_map(|place| {
            let facet = self.facets.get(place as usize)?;
            let sides = &facet.edges[..usize::from(facet.len)];
            // Neighbours pass the edge in opposite directions.
            let side = sides.iter().position(|&side| side == edge)?;
            let is_free =
                facet.mates[side] == NONE && surfaces.directed(edge)[usize::from(facet.is_turned)] == start;
            is_free.then_some((place, side))
        })
    }

    /// Replaces the facets by the outlines of shadows, without neighbours.
    pub(super) fn take_shadows(&mut self, shadows: &[ShadowVolume], window: &ViewWindow, raster: &Raster) {
        self.facets.clear();
        self.taken = 0;
        let corners = || shadows.iter().flat_map(ShadowVolume::corners);
        let sum: f64 = corners().map(|corner| corner.abs().element_sum()).sum();
        let picture = Picture::new(window, raster, sum / corners().count().max(1) as f64);
        self.picture = Some(picture);
        for shadow in shadows {
            let corners = shadow.corners();
            // The near plane cuts a shadow. A corner on this plane moves along its ray to the picture's nearest depth.
            let eyes = corners.iter().map(|corner| {
                let eye = raster.in_axes(*corner);
                if eye.z > 0.0 && eye.z < picture.near {
                    eye * (1.0 + 1.0e-15) * (picture.near / eye.z)
                } else {
                    eye
                }
            });
            let mut seen = [([0; 2], 0.0); super::super::MAX_SIDES];
            let mut is_seen = true;
            for (seen, eye) in seen.iter_mut().zip(eyes) {
                *seen = picture.project(eye);
                is_seen &= seen.1 > 0.0;
            }
            if !is_seen {
                continue;
            }
            let normal = raster.in_axes(shadow.cap_normal());
            let plane = plane_in_pixels(normal, shadow.cap_distance_m(), raster);
            // A shadow has at most eight corners, so two facets suffice.
            let first = self.facets.len();
            let (near_part, far_part) = (0..corners.len().min(FACET_SIDES), FACET_SIDES - 1..corners.len());
            let parts = [Some(near_part), (corners.len() > FACET_SIDES).then_some(far_part)];
            for (part, range) in parts.into_iter().enumerate() {
                let Some(range) = range else { continue };
                let mut outline = Outline::default();
                if part == 1 {
                    outline.push(seen[0].0, seen[0].1, SHARED);
                }
                for (at, nearness) in &seen[range] {
                    outline.push(*at, *nearness, NONE);
                }
                if part == 0 && corners.len() > FACET_SIDES {
                    outline.edges[FACET_SIDES - 1] = SHARED;
                }
                let mut facet = Facet { polygon: NONE, ..Facet::NONE };
                facet.set_outline(&outline);
                (facet.plane, facet.has_plane) = (plane, true);
                self.facets.push(facet);
            }
            if self.facets.len() > first + 1 {
                self.join_parts(first, first + 1);
            }
        }
        self.drawn = self.with_area();
    }
}
