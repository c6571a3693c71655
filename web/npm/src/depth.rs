//! The depth buffer behind the class `DepthBuffer`.

use osp::{
    glam::Vec3,
    index::{Osp, SpatialIndex},
    math::{Aabb, Frustum},
    occlusion::{
        CullConfig, DepthBuffer, DepthConfig, MAX_SIDES, OcclusionCuller, ShadowVolume, Verdict,
        remove_hidden,
    },
    polygon::{ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
};
use wasm_bindgen::prelude::*;

use crate::{
    refusal::{Outcome, refused},
    room,
    scratch::Scratch,
    views::Camera,
};

/// Largest number of pixels across or down.
const MOST_PIXELS: f64 = 8192.0;

/// Largest number of bytes for a pixel: 96 for each 64 x 4 pixels.
const PIXEL_BYTES: f64 = 0.5;

/// Memory for an occluder while the buffer is filled, beside its shadow.
const OCCLUDER_BYTES: usize = 64;

/// A software depth buffer of the occluders that are nearest to the eye. JavaScript writes into its memory.
#[wasm_bindgen]
pub struct Depth {
    buffer: DepthBuffer,
    scratch: Scratch,
    corners: Vec<Vec3>,
    occluders: Vec<ShadowVolume>,
    /// The camera for which the buffer was built.
    camera: Option<Camera>,
}

impl std::fmt::Debug for Depth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Depth").field("camera", &self.camera).finish_non_exhaustive()
    }
}

#[wasm_bindgen]
impl Depth {
    /// Creates an empty buffer with this many pixels.
    #[wasm_bindgen(constructor)]
    pub fn new(width: f64, height: f64) -> Outcome<Self> {
        let is_taken = |pixels: f64| (1.0..=MOST_PIXELS).contains(&pixels);
        if !is_taken(width) || !is_taken(height) {
            return refused(&format!(
                "width, height: expected numbers from 1 to {MOST_PIXELS}, found {width} and {height}"
            ));
        }
        // The size is rounded up to whole tiles.
        if !room::is_left(((width + 64.0) * (height + 4.0) * PIXEL_BYTES) as usize) {
            return refused("there is no memory left for the depth buffer");
        }
        let (width, height) = (width as u32, height as u32);
        let buffer = DepthBuffer::new(DepthConfig { width, height });
        Ok(Self {
            buffer,
            scratch: Scratch::default(),
            corners: Vec::new(),
            occluders: Vec::new(),
            camera: None,
        })
    }

    /// Makes room for this many numbers of corners or boxes, and numbers of corners.
    pub fn room(&mut self, floats: usize, counts: usize) -> Outcome<()> {
        self.scratch.room(floats, counts)
    }

    /// Address for 24 numbers of 64 bits.
    pub fn numbers_at(&self) -> usize {
        self.scratch.numbers.as_ptr().expose_provenance()
    }

    /// Address for corners or boxes.
    pub fn boxes_at(&self) -> usize {
        self.scratch.boxes.as_ptr().expose_provenance()
    }

    /// Address for the number of corners of each polygon.
    pub fn ids_at(&self) -> usize {
        self.scratch.ids.as_ptr().expose_provenance()
    }

    /// Address of the last result.
    pub fn found_at(&self) -> usize {
        self.scratch.found.as_ptr().expose_provenance()
    }

    /// Fills the buffer with the convex polygons in memory, as seen by the matrix in memory. Returns the number of
    /// polygons that hide something. After a refusal the buffer is unchanged.
    pub fn build(&mut self, is_webgl: bool) -> Outcome<usize> {
        let camera = Camera::new(&self.scratch.numbers, is_webgl)?;
        let window = camera.window()?;
        let (corners, counts) = (self.scratch.boxes.as_chunks::<3>().0, &self.scratch.ids);
        if let Some(at) = corners.iter().position(|corner| !Vec3::from_array(*corner).is_finite()) {
            return refused(&format!("corner {at}: expected finite numbers, found {:?}", corners[at]));
        }
        if let Some(at) = counts.iter().position(|&count| !(3..MAX_SIDES as u32).contains(&count)) {
            let (most, found) = (MAX_SIDES - 1, counts[at]);
            return refused(&format!("polygon {at}: expected 3 to {most} corners, found {found}"));
        }
        let expected = counts.iter().map(|&count| u64::from(count)).sum::<u64>();
        if expected != corners.len() as u64 {
            let found = corners.len();
            return refused(&format!(
                "corners: expected {expected}, as many as the polygons have, found {found}"
            ));
        }
        // Each polygon may be split into triangles.
        let most = corners.len() - 2 * counts.len();
        self.occluders.clear();
        if self.occluders.try_reserve(most).is_err() || !room::is_left(most * OCCLUDER_BYTES) {
            return refused(&format!("there is no memory left for {} polygons", counts.len()));
        }
        let (mut from, mut used) = (0, 0);
        for &count in counts {
            let to = from + count as usize;
            self.corners.clear();
            self.corners.extend(corners[from..to].iter().map(|corner| Vec3::from_array(*corner)));
            let before = self.occluders.len();
            ShadowVolume::push_polygon(&self.corners, &window, &mut self.occluders);
            used += usize::from(self.occluders.len() > before);
            from = to;
        }
        self.buffer.build(&window, &self.occluders);
        self.camera = Some(camera);
        Ok(used)
    }

    /// Tests the boxes in memory. The result has 1 for each hidden box, 0 for the others. Returns the number of boxes.
    pub fn test(&mut self) -> Outcome<usize> {
        if self.camera.is_none() {
            return refused("the depth buffer is empty: call build first");
        }
        let count = self.scratch.box_count();
        self.scratch.found.clear();
        if self.scratch.found.try_reserve(count).is_err() {
            return refused(&format!("there is no memory left for {count} answers"));
        }
        for at in 0..count {
            let bounds = self.scratch.checked(at)?;
            let is_hidden = self.buffer.test_box(&bounds).verdict == Verdict::Hidden;
            self.scratch.found.push(u32::from(is_hidden));
        }
        Ok(count)
    }
}

impl Depth {
    /// Checks that the buffer was built for this camera. For another one its results would be wrong.
    pub(crate) fn check_built_for(&self, camera: &Camera) -> Outcome<()> {
        match &self.camera {
            Some(built) if built == camera => Ok(()),
            Some(_) => refused("occlusion: the depth buffer was built for another matrix or another depth"),
            None => refused("occlusion: the depth buffer is empty: call build first"),
        }
    }

    /// Lists the boxes that the frustum may see and the buffer does not hide.
    pub(crate) fn cull(&self, osp: &Osp, frustum: &Frustum, list: &mut Vec<PolygonId>) {
        let (mut in_view, mut drawn) = (VisibleBlocks::new(), VisibleBlocks::new());
        osp.frustum_cull_blocks(frustum, &mut in_view);
        let config = CullConfig::default();
        remove_hidden(&self.buffer, config, osp, &Boxes(osp), frustum, &in_view, None, &mut drawn);
        list.extend(drawn.ids());
    }
}

/// The boxes of an index. None of them hides anything itself.
struct Boxes<'a>(&'a Osp);

impl Geometry for Boxes<'_> {
    fn id_end(&self) -> usize {
        PolygonId::LIMIT as usize
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.0.bounds(id).is_some()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.0.bounds(id).unwrap_or(Aabb::EMPTY)
    }

    fn polygon(&self, _id: PolygonId) -> Option<ConvexPolygon> {
        None
    }

    fn may_occlude(&self, _id: PolygonId) -> bool {
        false
    }
}
