//! The functions of `OspCuller`.

use osp::{Culler, Occluder, OccluderError};

use crate::{
    border::{Answer, Out, OutList, border, free, give, list, numbers, object, value},
    camera::OspCamera,
    handle::Guarded,
    status::{Failure, OspStatus, Outcome},
    types::{
        self, OSP_MAX_CAMERAS, OSP_MAX_OBJECTS, OspBox, OspHit, OspRefusal, OspRefused, OspSeen, ray, sphere,
    },
};

/// A culler of objects. Each object has a 64-bit key from the caller, and a box. Objects can be added, moved and
/// removed at any time.
#[expect(missing_debug_implementations, reason = "C sees its name only")]
pub struct OspCuller(Guarded<Culler<u64>>);

const MOST: usize = OSP_MAX_OBJECTS as usize;

/// # Safety
/// See [`object`].
unsafe fn culler<'a>(culler: *const OspCuller) -> Outcome<&'a Guarded<Culler<u64>>> {
    // SAFETY: the caller guarantees this.
    unsafe { object(culler, "culler") }.map(|culler| &culler.0)
}

/// Makes a culler without objects. It needs no size of the world and no capacity. *culler gets the handle, or NULL if
/// the call fails. Free the handle with osp_culler_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_new(culler: *mut *mut OspCuller) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let out = unsafe { Out::new(culler, "culler") }?;
        out.set(std::ptr::null_mut());
        give(OspCuller(Guarded::new(Culler::new())), &out);
        Ok(())
    })
}

/// Frees a culler with all its objects. The handle may be NULL. No other call may use the handle at the same time or
/// afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_free(culler: *mut OspCuller) -> OspStatus {
    // SAFETY: the caller guarantees this, as the header requires.
    border(|| unsafe { free(culler, "culler") })
}

/// Inserts objects, or moves objects that exist: count keys, and a box for each key. A box should be tight around all
/// drawn parts of its object. A box with NaN, an infinite number or min > max is refused, and osp_culler_refused lists
/// it. Its object is skipped until it gets a valid box. If a key is given twice, the last box counts. An object that
/// moves loses its occluder, unless the new box contains the old one. keys and boxes may be NULL if count is 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_set(
    culler: *mut OspCuller,
    keys: *const u64,
    boxes: *const OspBox,
    count: usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, keys, boxes) = unsafe {
            (self::culler(culler)?, list(keys, count, MOST, "keys")?, list(boxes, count, MOST, "boxes")?)
        };
        let mut culler = culler.change()?;
        keys.iter().zip(&boxes).for_each(|(&key, bounds)| culler.set(key, bounds.corners()));
        Ok(())
    })
}

/// Removes objects, with their occluders and layers. Ignores keys without an object.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_remove(
    culler: *mut OspCuller,
    keys: *const u64,
    count: usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, keys) = unsafe { (self::culler(culler)?, list(keys, count, MOST, "keys")?) };
        let mut culler = culler.change()?;
        keys.iter().for_each(|&key| culler.remove(key));
        Ok(())
    })
}

/// Removes everything.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_clear(culler: *mut OspCuller) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        *unsafe { self::culler(culler) }?.change()? = Culler::new();
        Ok(())
    })
}

/// Sets the layers of objects: for each key, a mask with a bit for each layer. A camera sees an object if both have a
/// layer in common. The default is the first layer, mask 1. An object on no layer is invisible to all cameras.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_set_layers(
    culler: *mut OspCuller,
    keys: *const u64,
    layers: *const u32,
    count: usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, keys, layers) = unsafe {
            (self::culler(culler)?, list(keys, count, MOST, "keys")?, list(layers, count, MOST, "layers")?)
        };
        let mut culler = culler.change()?;
        keys.iter().zip(&layers).for_each(|(&key, &layers)| culler.set_layers(key, layers));
        Ok(())
    })
}

/// # Safety
/// See [`object`].
unsafe fn set_occluder(
    culler: *mut OspCuller,
    key: u64,
    occluder: Result<Occluder, OccluderError>,
) -> Outcome<()> {
    let occluder =
        occluder.map_err(|why| Failure::new(OspStatus::InvalidOccluder, format!("occluder: {why}")))?;
    // SAFETY: the caller guarantees this.
    unsafe { self::culler(culler) }?.change()?.set_occluder(key, occluder);
    Ok(())
}

/// Sets a flat, convex quad as the occluder of an object, in place of the former occluder. corners has x y z of its
/// four corners, in clockwise or counter-clockwise order; world space, metres.
///
/// An occluder is opaque from both sides, and hides the objects behind it. The engine must draw the occluder itself, or
/// an opaque object around it. It stays in place until the object moves or is removed. A key without a box may have an
/// occluder. Such an occluder hides objects, and is never listed. A few large occluders hide more in less time than
/// many small ones.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_set_occluder_quad(
    culler: *mut OspCuller,
    key: u64,
    corners: *const f32,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let corners = unsafe { numbers::<[f32; 3], 4>(corners.cast(), "corners") }?;
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { set_occluder(culler, key, Occluder::quad(corners)) }
    })
}

/// Does the same as osp_culler_set_occluder_quad with the six sides of a box, such as a box inside a house.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_set_occluder_box(
    culler: *mut OspCuller,
    key: u64,
    bounds: *const OspBox,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let bounds = unsafe { value(bounds, "bounds") }?;
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { set_occluder(culler, key, Occluder::cuboid(bounds.corners())) }
    })
}

/// Does the same as osp_culler_set_occluder_quad with a mesh. vertices has x y z of vertex_count points. indices has
/// three vertex numbers for each of triangle_count triangles. Triangles without area are skipped.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_set_occluder_mesh(
    culler: *mut OspCuller,
    key: u64,
    vertices: *const f32,
    vertex_count: usize,
    indices: *const u32,
    triangle_count: usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires. Three numbers have the same alignment as one.
        let (vertices, triangles) = unsafe {
            let vertices = list::<[f32; 3]>(vertices.cast(), vertex_count, 3 * MOST, "vertices")?;
            (vertices, list::<[u32; 3]>(indices.cast(), triangle_count, MOST, "indices")?)
        };
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { set_occluder(culler, key, Occluder::mesh(&vertices, triangles.as_flattened())) }
    })
}

/// Removes an object's occluder. Has no effect if the object has no occluder.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_remove_occluder(culler: *mut OspCuller, key: u64) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { self::culler(culler) }?.change()?.remove_occluder(key);
        Ok(())
    })
}

/// Applies all changes, so that osp_culler_in_box, osp_culler_in_sphere, osp_culler_on_ray and osp_culler_nearest use
/// them. osp_culler_cull applies them, too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_commit(culler: *mut OspCuller) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { self::culler(culler) }?.change()?.commit();
        Ok(())
    })
}

/// Returns the number of objects in the culler with a valid box.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_count(culler: *const OspCuller, count: *mut usize) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, count) = unsafe { (self::culler(culler)?, Out::new(count, "count")?) };
        count.set(culler.read()?.len());
        Ok(())
    })
}

/// Returns the last valid box of an object.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_box(
    culler: *const OspCuller,
    key: u64,
    bounds: *mut OspBox,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, out) = unsafe { (self::culler(culler)?, Out::new(bounds, "bounds")?) };
        let Some([min, max]) = culler.read()?.bounds(key) else {
            return Err(Failure::new(OspStatus::UnknownKey, format!("key {key}: no object has it")));
        };
        out.set(OspBox { min, max });
        Ok(())
    })
}

/// Finds the objects that each camera sees. An object counts if a part of it may be on the camera's screen and, for a
/// camera with hide_by_occluders, not behind the occluders. The result contains every visible object. The cameras may
/// be two eyes, a camera and its lights, or the faces of a cube map: at most OSP_MAX_CAMERAS. seen gets an OspSeen for
/// each camera; it may be NULL. Afterwards osp_culler_visible lists the keys.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_cull(
    culler: *mut OspCuller,
    cameras: *const OspCamera,
    camera_count: usize,
    seen: *mut OspSeen,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, cameras, out) = unsafe {
            let room = if seen.is_null() { 0 } else { camera_count };
            let cameras = list(cameras, camera_count, OSP_MAX_CAMERAS as usize, "cameras")?;
            (self::culler(culler)?, cameras, OutList::new(seen, room, "seen")?)
        };
        let checked = |(i, camera): (usize, &OspCamera)| camera.checked(&format!("cameras[{i}]"));
        let cameras = cameras.iter().enumerate().map(checked).collect::<Outcome<Vec<_>>>()?;
        let mut culler = culler.change()?;
        let frame = culler.cull(&cameras);
        out.write(frame.iter().map(|seen| OspSeen { visible: seen.len(), hidden: seen.hidden() }));
        Ok(())
    })
}

/// Lists the objects that a camera of the last osp_culler_cull sees; cameras count from 0. keys gets the keys of the
/// objects to draw, each once, in no particular order. *count gets their number. Objects that were removed since then
/// are not included. An osp_culler_commit that applies changes discards the results of osp_culler_cull.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_visible(
    culler: *const OspCuller,
    camera: usize,
    keys: *mut u64,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (answer, culler) = unsafe { (Answer::new(keys, room, count, "keys")?, self::culler(culler)?) };
        let culler = culler.read()?;
        let frame = culler.frame();
        let Some(seen) = frame.get(camera) else {
            let message =
                format!("camera: expected one of the {} of the last frame, found {camera}", frame.len());
            return Err(Failure::new(OspStatus::InvalidArgument, message));
        };
        answer.write(seen.iter())
    })
}

/// Finds for each box whether it is completely off a camera's screen or, with hide_by_occluders, behind the occluders.
/// The boxes need not belong to objects of the culler: they may surround sounds, characters or triggers. hidden gets 1
/// or 0 for each box. A box that is empty or infinite, or has a NaN, is not hidden. Applies all changes, as
/// osp_culler_cull does. Without changes, the results of the last osp_culler_cull stay valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_are_hidden(
    culler: *mut OspCuller,
    camera: *const OspCamera,
    boxes: *const OspBox,
    count: usize,
    hidden: *mut u8,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, camera, boxes, out) = unsafe {
            let out = OutList::new(hidden, count, "hidden")?;
            (self::culler(culler)?, value(camera, "camera")?, list(boxes, count, MOST, "boxes")?, out)
        };
        let camera = camera.checked("camera")?;
        let boxes: Vec<_> = boxes.iter().map(OspBox::corners).collect();
        out.write(culler.change()?.are_hidden(&camera, &boxes).into_iter().map(u8::from));
        Ok(())
    })
}

/// Lists the boxes and occluders that were refused between the last two calls of osp_culler_cull, and the reasons. Only
/// the first 4096 are listed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_refused(
    culler: *const OspCuller,
    refused: *mut OspRefused,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (answer, culler) =
            unsafe { (Answer::new(refused, room, count, "refused")?, self::culler(culler)?) };
        answer.write(
            culler.read()?.refused().map(|(key, why)| OspRefused { key, why: OspRefusal::from(why) as i32 }),
        )
    })
}

/// Finds the objects whose boxes have a point in common with a box; touching counts. The result has the form of
/// osp_culler_visible.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_in_box(
    culler: *const OspCuller,
    bounds: *const OspBox,
    keys: *mut u64,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (answer, culler, bounds) = unsafe {
            (Answer::new(keys, room, count, "keys")?, self::culler(culler)?, value(bounds, "bounds")?)
        };
        answer.write(culler.read()?.in_box(bounds.checked()?))
    })
}

/// Finds the objects whose boxes have a point in common with a sphere: center is x y z, radius is in metres. The result
/// has the form of osp_culler_visible.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_in_sphere(
    culler: *const OspCuller,
    center: *const f32,
    radius: f32,
    keys: *mut u64,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (answer, culler, center) = unsafe {
            (Answer::new(keys, room, count, "keys")?, self::culler(culler)?, numbers(center, "center")?)
        };
        let ball = sphere(center, radius)?;
        answer.write(culler.read()?.in_sphere(ball.center, ball.radius_m))
    })
}

/// Finds the objects whose boxes a ray enters at t <= t_max, the nearest first. origin and direction are x y z. t
/// counts in lengths of the direction; t_max may be infinite. hits gets the first results, at most room of them. *count
/// gets the number of all results. room may be 1 if only the nearest box is needed. To pick an object by its mesh, test
/// the objects in this order until t is beyond the nearest hit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_on_ray(
    culler: *const OspCuller,
    origin: *const f32,
    direction: *const f32,
    t_max: f32,
    hits: *mut OspHit,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (answer, culler, origin, direction) = unsafe {
            let answer = Answer::new(hits, room, count, "hits")?;
            (answer, self::culler(culler)?, numbers(origin, "origin")?, numbers(direction, "direction")?)
        };
        let ray = ray(origin, direction, t_max)?;
        answer.write_first(culler.read()?.on_ray(ray, t_max).map(|(key, t)| OspHit { key, t }));
        Ok(())
    })
}

/// Finds the objects whose boxes are nearest to a point, x y z. hits gets these objects, at most room of them, the
/// nearest first. The t of a hit is the distance of the box, metres; 0 if the point is inside. *count gets the number
/// of hits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_nearest(
    culler: *const OspCuller,
    point: *const f32,
    hits: *mut OspHit,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (answer, culler, point) = unsafe {
            (Answer::new(hits, room, count, "hits")?, self::culler(culler)?, numbers(point, "point")?)
        };
        let point = types::point(point, "point")?;
        answer.write(culler.read()?.nearest(point, room).map(|(key, t)| OspHit { key, t }))
    })
}
