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

/// A culler of objects, each known by a key of the caller's, 64 bits, and a box. Objects come, move and go at any time.
#[expect(missing_debug_implementations, reason = "C sees its name only")]
pub struct OspCuller(Guarded<Culler<u64>>);

const MOST: usize = OSP_MAX_OBJECTS as usize;

/// # Safety
/// See [`object`].
unsafe fn culler<'a>(culler: *const OspCuller) -> Outcome<&'a Guarded<Culler<u64>>> {
    // SAFETY: the caller guarantees this.
    unsafe { object(culler, "culler") }.map(|culler| &culler.0)
}

/// Makes a culler without objects. It needs no size of the world and no capacity. *culler is the handle, to be freed by
/// osp_culler_free; it is NULL if the call fails.
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

/// Frees a culler and all that is in it. The handle may be NULL; afterwards it must not be used, and no other call may be running
/// with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_free(culler: *mut OspCuller) -> OspStatus {
    // SAFETY: the caller guarantees this, as the header requires.
    border(|| unsafe { free(culler, "culler") })
}

/// Inserts objects, or moves those that are there: a key and a box each, the tight box of all that is drawn of the object. A box with
/// NaN, an infinite number or min > max leaves its object out until it has another one; osp_culler_refused names it. Of a key that is
/// there twice the last box holds. An object that moves loses its occluder, unless the new box holds the one before. keys and boxes
/// may be NULL if count is 0.
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

/// Takes objects out, with their occluders and layers. A key without an object is left alone.
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

/// Takes everything out.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_clear(culler: *mut OspCuller) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        *unsafe { self::culler(culler) }?.change()? = Culler::new();
        Ok(())
    })
}

/// Puts objects on layers, a bit each: a camera sees an object if both share one. Objects are on the first layer, the mask 1, unless
/// they are put elsewhere; on none, no camera sees them.
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

/// Gives an object a flat, convex quad that hides what is behind it, in place of the occluder that it had: corners are x y z of its four
/// corners in order around it, either way; world space, metres.
///
/// An occluder is opaque and hides from both sides. It is drawn itself, or lies inside of what is drawn. It stays where it is until the
/// object moves or goes. A key without a box may have one: a stand-in, which hides and is never listed. A few large occluders hide
/// more in less time than many small ones.
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

/// osp_culler_set_occluder_quad with the six sides of a box: the stand-in for a house.
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

/// osp_culler_set_occluder_quad with a mesh: vertices are x y z of vertex_count points; indices are three places in it for each of
/// triangle_count triangles. Triangles without area are left out.
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
        // SAFETY: the caller guarantees this, as the header requires. Three numbers are aligned as one is.
        let (vertices, triangles) = unsafe {
            let vertices = list::<[f32; 3]>(vertices.cast(), vertex_count, 3 * MOST, "vertices")?;
            (vertices, list::<[u32; 3]>(indices.cast(), triangle_count, MOST, "indices")?)
        };
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { set_occluder(culler, key, Occluder::mesh(&vertices, triangles.as_flattened())) }
    })
}

/// Takes an object's occluder away; nothing happens if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_remove_occluder(culler: *mut OspCuller, key: u64) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { self::culler(culler) }?.change()?.remove_occluder(key);
        Ok(())
    })
}

/// Makes all changes known to osp_culler_in_box, osp_culler_in_sphere, osp_culler_on_ray and osp_culler_nearest. osp_culler_cull does it, too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_commit(culler: *mut OspCuller) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        unsafe { self::culler(culler) }?.change()?.commit();
        Ok(())
    })
}

/// Objects in the culler: those with a box that was not refused.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_culler_count(culler: *const OspCuller, count: *mut usize) -> OspStatus {
    border(|| {
        // SAFETY: the caller guarantees this, as the header requires.
        let (culler, count) = unsafe { (self::culler(culler)?, Out::new(count, "count")?) };
        count.set(culler.read()?.len());
        Ok(())
    })
}

/// The box of an object, as it was set last.
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

/// Finds what each camera sees: whatever of an object may be on its screen and, for a camera with hide_by_occluders, not behind the
/// occluders. Nothing that can be seen is left out. All cameras are culled in one walk: two eyes, a camera and its lights, the sides
/// of a cube; at most OSP_MAX_CAMERAS. seen gets an OspSeen for each camera; it may be NULL. osp_culler_visible then lists the keys.
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

/// What a camera of the last osp_culler_cull sees, counted from 0: keys gets the keys of the objects to draw, each once, in no particular
/// order; *count is how many there are. What was removed since then is not among them. After an osp_culler_commit of changes there is
/// no camera.
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

/// Tells of each box whether nothing of it can be on a camera's screen: it is out of view, or behind the occluders if the camera has
/// hide_by_occluders. The boxes are in no culler: of a sound, a character, a trigger. hidden gets 1 or 0 for each. A box that is empty
/// or not finite is not hidden. Makes all changes known, as osp_culler_cull does; what that has found stays if there are none.
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

/// What was refused between the last two calls of osp_culler_cull, and why; of very much the beginning.
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

/// Finds the objects whose boxes share a point with a box; touching counts. The answer is as that of osp_culler_visible.
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

/// Finds the objects whose boxes share a point with a ball: center is x y z, radius metres. The answer is as that of osp_culler_visible.
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

/// Finds the objects whose boxes a ray enters at t <= t_max, the nearest first. origin and direction are x y z; t is in lengths of the
/// direction; t_max may be infinite. hits gets the first of them, as many as there is room for; *count is how many there are. Room for
/// one is enough for the nearest box; to pick an object by its mesh, test one after the other until t is beyond the nearest hit.
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

/// Finds the objects whose boxes are nearest to a point, x y z: hits gets as many as there is room for, if there are so many, the nearest
/// first, with their distances as t, metres, 0 from inside; *count is how many it got.
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
