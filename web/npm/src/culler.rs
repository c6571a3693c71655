//! The culler behind the class `Culler`.

use osp::{
    Camera, Depth, Occluder, OccluderError,
    glam::{DVec3, Vec3},
    math::Ray,
};
use wasm_bindgen::prelude::*;

use crate::{
    refusal::{Outcome, refused},
    room::{self, resize},
};

/// Memory that is requested per object before a batch is applied. If this is too small, the module may run out of
/// memory in the middle of a batch, which ends the program. If it is too large, the module keeps more memory than
/// necessary.
const CHANGE_BYTES: usize = 400;

/// The lists of all objects may be moved to longer ones, with this many bytes for each object.
const LIST_BYTES: usize = 160;

/// Largest number of bytes per object in the result for a camera.
const SEEN_BYTES: usize = 12;

/// Memory for a polygon of an occluder.
const POLYGON_BYTES: usize = 1024;

/// Number of options of a camera beside its matrix: its depth, whether occluders hide, its layers.
const OPTIONS: usize = 3;

/// A culler of objects. JavaScript writes arguments into the culler's memory and reads the results there.
#[wasm_bindgen]
pub struct Culler {
    culler: osp::Culler<u64>,
    keys: Vec<u64>,
    /// Boxes, or corners.
    floats: Vec<f32>,
    /// Layers, indices, or the options of cameras.
    words: Vec<u32>,
    /// Matrices, or arguments of a query.
    doubles: Vec<f64>,
    /// Keys of the last result.
    found: Vec<u64>,
    /// For each of these keys a number; or a box; or a ray.
    measured: Vec<f32>,
    /// Number of changes since the last commit.
    pending: usize,
    /// [`room::asked`] at the last request for memory by this culler, and the number of changes for which there was
    /// memory then.
    asked: u64,
    room: usize,
}

impl std::fmt::Debug for Culler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.culler.fmt(f)
    }
}

#[wasm_bindgen]
impl Culler {
    /// Creates a culler without objects.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Outcome<Self> {
        if !room::is_left(0) {
            return refused("there is no memory left for a culler");
        }
        Ok(Self {
            culler: osp::Culler::new(),
            keys: Vec::new(),
            floats: Vec::new(),
            words: Vec::new(),
            doubles: Vec::new(),
            found: Vec::new(),
            measured: Vec::new(),
            pending: 0,
            asked: 0,
            room: 0,
        })
    }

    /// Makes room for this many keys, and numbers of each type.
    pub fn room(&mut self, keys: usize, floats: usize, words: usize, doubles: usize) -> Outcome<()> {
        resize(&mut self.keys, keys, 0)?;
        resize(&mut self.floats, floats, 0.0)?;
        resize(&mut self.words, words, 0)?;
        resize(&mut self.doubles, doubles, 0.0)
    }

    /// Address for keys, 64 bits each.
    pub fn keys_at(&self) -> usize {
        self.keys.as_ptr().expose_provenance()
    }

    /// Address for numbers of single precision.
    pub fn floats_at(&self) -> usize {
        self.floats.as_ptr().expose_provenance()
    }

    /// Address for whole numbers.
    pub fn words_at(&self) -> usize {
        self.words.as_ptr().expose_provenance()
    }

    /// Address for numbers of double precision.
    pub fn doubles_at(&self) -> usize {
        self.doubles.as_ptr().expose_provenance()
    }

    /// Address of the keys of the last result.
    pub fn found_at(&self) -> usize {
        self.found.as_ptr().expose_provenance()
    }

    /// Address of the numbers of the last result.
    pub fn measured_at(&self) -> usize {
        self.measured.as_ptr().expose_provenance()
    }

    /// Number of objects in the culler.
    pub fn count(&self) -> usize {
        self.culler.len()
    }

    /// Sets the boxes of objects, from the keys and boxes in memory.
    pub fn set(&mut self) -> Outcome<()> {
        self.make_room(self.keys.len())?;
        let corners = self.floats.as_chunks::<3>().0.as_chunks::<2>().0;
        self.keys.iter().zip(corners).for_each(|(&key, bounds)| self.culler.set(key, *bounds));
        Ok(())
    }

    /// Removes the objects with the keys in memory.
    pub fn remove(&mut self) -> Outcome<()> {
        self.make_room(self.keys.len())?;
        self.keys.iter().for_each(|&key| self.culler.remove(key));
        Ok(())
    }

    /// Removes everything.
    pub fn clear(&mut self) {
        self.culler = osp::Culler::new();
        self.pending = 0;
    }

    /// Puts the objects with the keys in memory on the layers in memory.
    pub fn set_layers(&mut self) -> Outcome<()> {
        self.make_room(self.keys.len())?;
        self.keys.iter().zip(&self.words).for_each(|(&key, &layers)| self.culler.set_layers(key, layers));
        Ok(())
    }

    /// Gives the object with the key in memory an occluder with the corners in memory: two of a box, four of a quad;
    /// or, with indices, those of a mesh.
    pub fn set_occluder(&mut self) -> Outcome<()> {
        let polygons = 6 + self.words.len() / 3;
        if !room::is_left(polygons.saturating_mul(POLYGON_BYTES) + 2 * size_of_val(&*self.floats)) {
            return refused(&format!("there is no memory left for an occluder of {polygons} polygons"));
        }
        self.make_room(1)?;
        let corners = self.floats.as_chunks::<3>().0;
        let occluder = match *corners {
            _ if !self.words.is_empty() => Occluder::mesh(corners, &self.words),
            [min, max] => Occluder::cuboid([min, max]),
            [a, b, c, d] => Occluder::quad([a, b, c, d]),
            _ => Err(OccluderError::NotFlatAndConvex),
        };
        match occluder {
            Ok(occluder) => self.culler.set_occluder(self.keys[0], occluder),
            Err(why) => return refused(&format!("occluder: {why}")),
        }
        Ok(())
    }

    /// Removes the occluder of the object with the key in memory.
    pub fn remove_occluder(&mut self) {
        self.culler.remove_occluder(self.keys[0]);
    }

    /// Applies all changes, so that queries use them.
    pub fn commit(&mut self) -> Outcome<()> {
        self.check_pending()?;
        self.culler.commit();
        (self.pending, self.room) = (0, 0);
        Ok(())
    }

    /// Culls for the cameras in memory.
    pub fn cull(&mut self) -> Outcome<()> {
        let options = self.words.as_chunks::<OPTIONS>().0;
        let cameras = self.doubles.as_chunks::<16>().0.iter().zip(options).enumerate();
        let camera = |(at, (matrix, options))| {
            camera(matrix, options).or_else(|why| refused(&format!("cameras[{at}], {why}")))
        };
        let cameras = cameras.map(camera).collect::<Outcome<Vec<_>>>()?;
        let objects = self.culler.len() + self.pending;
        let seen = objects.saturating_mul(cameras.len() * SEEN_BYTES);
        if !room::is_left(self.change_bytes(self.pending).saturating_add(seen)) {
            return refused(
                "there is no memory left for the changes since the last commit, and for what the cameras see",
            );
        }
        self.culler.cull(&cameras);
        (self.pending, self.room) = (0, 0);
        Ok(())
    }

    /// Finds the objects that a camera of the last cull sees. Returns their number.
    pub fn see(&mut self, camera: usize) -> Outcome<usize> {
        let frame = self.culler.frame();
        let Some(seen) = frame.get(camera) else { return Ok(0) };
        Self::answer(&mut self.found, seen.len(), seen.iter())
    }

    /// Finds the objects that some camera of the last cull sees, each once. Returns their number.
    pub fn see_any(&mut self) -> Outcome<usize> {
        let frame = self.culler.frame();
        let keys = frame.iter().enumerate().flat_map(|(at, seen)| {
            let frame = &frame;
            seen.iter().filter(move |key| !(0..at).any(|before| frame[before].contains(*key)))
        });
        Self::answer(&mut self.found, frame.iter().map(|seen| seen.len()).sum(), keys)
    }

    /// Returns the number of objects that occluders hide from a camera of the last cull.
    pub fn hidden(&self, camera: usize) -> usize {
        self.culler.frame().get(camera).map_or(0, |seen| seen.hidden())
    }

    /// Tests whether the camera in memory sees each of the boxes in memory. The found keys are 1 for a hidden box and 0
    /// for another. Returns the number of boxes.
    pub fn are_hidden(&mut self) -> Outcome<usize> {
        let matrix = std::array::from_fn(|i| self.doubles[i]);
        let options = std::array::from_fn(|i| self.words[i]);
        let camera = camera(&matrix, &options).or_else(|why| refused(&why))?;
        self.check_pending()?;
        let boxes = self.floats.as_chunks::<3>().0.as_chunks::<2>().0;
        if !room::is_left(self.change_bytes(self.pending).saturating_add(4 * size_of_val(boxes))) {
            return refused(&format!("there is no memory left for {} boxes", boxes.len()));
        }
        let hidden = self.culler.are_hidden(&camera, boxes);
        (self.pending, self.room) = (0, 0);
        Self::answer(&mut self.found, hidden.len(), hidden.into_iter().map(u64::from))
    }

    /// Finds the refusals between the last two culls. Returns their number.
    pub fn refused(&mut self) -> Outcome<usize> {
        Self::answer(
            &mut self.found,
            self.culler.refused().count(),
            self.culler.refused().map(|(key, _)| key),
        )
    }

    /// Returns the reason of one of these refusals.
    pub fn why(&self, at: usize) -> Option<String> {
        self.culler.refused().nth(at).map(|(_, why)| why.to_string())
    }

    /// Whether an object has the key in memory. Then the six measured numbers are its box.
    pub fn bounds(&mut self) -> bool {
        let Some(bounds) = self.culler.bounds(self.keys[0]) else { return false };
        self.measure(bounds.as_flattened().iter().copied());
        true
    }

    /// Finds the objects that have a point in common with the box from the first three numbers to the next three.
    /// Returns their number.
    pub fn in_box(&mut self) -> Outcome<usize> {
        let (min, max) = (self.point(0), self.point(3));
        let bounds = [min.map(round_down), max.map(round_up)];
        if !min.iter().zip(&max).all(|(min, max)| min <= max)
            || !bounds.as_flattened().iter().all(|v| v.is_finite())
        {
            return refused("box: expected finite numbers and min <= max");
        }
        self.check_answer()?;
        Self::answer(&mut self.found, 0, self.culler.in_box(bounds))
    }

    /// Finds the objects that have a point in common with the ball around the first three numbers, with the radius
    /// after them. Returns their number.
    pub fn in_sphere(&mut self) -> Outcome<usize> {
        let (center, radius) = (DVec3::from_array(self.point(0)), self.doubles[3]);
        let near = center.as_vec3();
        // This ball has single precision, and contains the exact one.
        let around = round_up(radius + (center - near.as_dvec3()).length());
        if !(radius >= 0.0 && around.is_finite() && near.is_finite()) {
            return refused("sphere: expected a finite center, and a finite radius from 0 on");
        }
        self.check_answer()?;
        Self::answer(&mut self.found, 0, self.culler.in_sphere(near, around))
    }

    /// Finds the objects that a ray enters, the nearest first. The ray starts at the first three numbers, has the next
    /// three as its direction, and is as long as the number after them. Returns the number of objects. The measured
    /// numbers are the places of the entries.
    pub fn on_ray(&mut self) -> Outcome<usize> {
        let [origin, along] = [0, 3].map(|from| DVec3::from_array(self.point(from)).as_vec3());
        let t_max = self.doubles[6] as f32;
        if !(origin.is_finite() && along.is_finite() && along != Vec3::ZERO) {
            return refused("ray: expected a finite origin, and a finite direction other than 0, 0, 0");
        }
        if t_max.is_nan() || t_max < 0.0 {
            return refused("tMax: expected a number from 0 on");
        }
        self.check_answer()?;
        let hits: Vec<_> = self.culler.on_ray(Ray::new(origin, along), t_max).collect();
        self.measure(hits.iter().map(|(_, t)| *t));
        Self::answer(&mut self.found, hits.len(), hits.into_iter().map(|(key, _)| key))
    }

    /// Finds the objects nearest to the point of the first three numbers, the nearest first. Returns their number. The
    /// measured numbers are their distances.
    pub fn nearest(&mut self, count: f64) -> Outcome<usize> {
        let point = DVec3::from_array(self.point(0)).as_vec3();
        if !point.is_finite() {
            return refused("point: expected finite numbers");
        }
        if count.is_nan() || count < 0.0 {
            return refused(&format!("count: expected a number from 0 on, found {count}"));
        }
        self.check_answer()?;
        let near: Vec<_> = self.culler.nearest(point, count as usize).collect();
        self.measure(near.iter().map(|(_, distance_m)| *distance_m));
        Self::answer(&mut self.found, near.len(), near.into_iter().map(|(key, _)| key))
    }

    /// Computes the ray through a point of the screen of the camera in memory. The measured numbers are its origin and
    /// its direction.
    pub fn screen_ray(&mut self, x: f32, y: f32) -> Outcome<()> {
        let matrix = std::array::from_fn(|i| self.doubles[i]);
        let options = std::array::from_fn(|i| self.words[i]);
        let ray = camera(&matrix, &options).or_else(|why| refused(&why))?.ray(x, y);
        self.measure(ray.origin.to_array().into_iter().chain(ray.direction.to_array()));
        Ok(())
    }
}

/// Returns the smallest `f32` that is not less.
fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    if f64::from(nearest) < v { nearest.next_up() } else { nearest }
}

/// Returns the largest `f32` that is not greater.
fn round_down(v: f64) -> f32 {
    -round_up(-v)
}

/// Creates a camera from its sixteen numbers and its options.
fn camera(matrix: &[f64; 16], [depth, hides, layers]: &[u32; OPTIONS]) -> Result<Camera, String> {
    let depth = match depth {
        0 => Depth::ZeroToOne,
        1 => Depth::OneToZero,
        _ => Depth::MinusOneToOne,
    };
    let camera = Camera::from_matrix(*matrix, depth)
        .map_err(|why| why.to_string().replacen("clip_from_world", "clipFromWorld", 1))?;
    let camera = camera.on_layers(*layers);
    Ok(if *hides == 0 { camera } else { camera.hide_by_occluders() })
}

impl Culler {
    fn point(&self, from: usize) -> [f64; 3] {
        std::array::from_fn(|i| self.doubles[from + i])
    }

    fn measure(&mut self, numbers: impl Iterator<Item = f32>) {
        self.measured.clear();
        self.measured.extend(numbers);
    }

    /// Replaces the result. `about` is the approximate number of keys, to reserve room.
    fn answer(found: &mut Vec<u64>, about: usize, keys: impl Iterator<Item = u64>) -> Outcome<usize> {
        found.clear();
        if found.capacity() < about {
            room::note_taken();
        }
        if found.try_reserve(about).is_err() {
            return refused(&format!("there is no memory left for an answer of {about} keys"));
        }
        found.extend(keys);
        Ok(found.len())
    }

    /// Refuses a query whose result may find no room.
    fn check_answer(&self) -> Outcome<()> {
        if room::is_left(self.culler.len().saturating_mul(3 * size_of::<(u64, f32)>())) {
            return Ok(());
        }
        refused("there is no memory left for an answer")
    }

    /// Refuses changes for which there is no memory.
    fn make_room(&mut self, more: usize) -> Outcome<()> {
        let needed = self.pending + more;
        if self.asked != room::asked() || needed > self.room {
            // The steps are larger, so that single objects do not request memory each time.
            let steps = [needed.max(self.room + self.room / 2), needed];
            let Some(room) = steps.into_iter().find(|&changes| self.is_left(changes)) else {
                return refused(&format!("there is no memory left for {more} more changes"));
            };
            self.room = room;
        }
        self.pending = needed;
        Ok(())
    }

    /// Refuses to commit if others have taken the memory since the changes were made.
    fn check_pending(&mut self) -> Outcome<()> {
        if self.pending == 0 || self.asked == room::asked() || self.is_left(self.pending) {
            return Ok(());
        }
        refused("there is no memory left for the changes since the last commit")
    }

    fn is_left(&mut self, changes: usize) -> bool {
        let is_sure = self.asked == room::asked();
        let is_left = room::is_left(self.change_bytes(changes));
        // A request that fails takes nothing, so there is still room for the changes before.
        if is_left || is_sure {
            self.asked = room::asked();
        }
        is_left
    }

    /// Returns the largest number of bytes that the changes may take until they are committed.
    fn change_bytes(&self, changes: usize) -> usize {
        let lists = if changes > 0 { (self.culler.len() + changes).saturating_mul(LIST_BYTES) } else { 0 };
        changes.saturating_mul(CHANGE_BYTES).saturating_add(lists)
    }
}
