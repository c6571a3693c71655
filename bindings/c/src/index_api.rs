//! The functions of `OspIndex`.

use crate::{
    border::{Answer, Out, OutList, border, free, give, list, numbers, object, value},
    handle::Guarded,
    index::{AskedRay, Index},
    status::{OspStatus, Outcome},
    types::{OSP_MAX_IDS, OspBox, OspHit, OspIndexConfig, sphere},
    views,
};

/// An index of boxes: inserts, moves and removes them at any time without being rebuilt, and finds those that a view may see.
#[expect(missing_debug_implementations, reason = "C sees its name only")]
pub struct OspIndex(Guarded<Index>);

/// # Safety
/// See [`object`].
unsafe fn index<'a>(index: *const OspIndex) -> Outcome<&'a Guarded<Index>> {
    // SAFETY: the caller's part.
    unsafe { object(index, "index") }.map(|index| &index.0)
}

fn checked(boxes: &[OspBox]) -> Outcome<Vec<osp::math::Aabb>> {
    boxes.iter().enumerate().map(|(at, bounds)| bounds.checked(at)).collect()
}

/// Makes an empty index. config may be NULL: then a cube of 4 m around (0, 1.5, 0) and little memory. *index is the handle, to
/// be freed by osp_index_free; it is NULL if the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_new(
    config: *const OspIndexConfig,
    index: *mut *mut OspIndex,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let out = unsafe { Out::new(index, "index") }?;
        out.set(std::ptr::null_mut());
        // SAFETY: the header asks it of the caller.
        let config = (!config.is_null()).then(|| unsafe { value(config, "config") }).transpose()?;
        give(OspIndex(Guarded::new(Index::new(config)?)), &out);
        Ok(())
    })
}

/// Frees an index and all that is in it. The handle may be NULL; afterwards it must not be used, and no other call may be running
/// with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_free(index: *mut OspIndex) -> OspStatus {
    // SAFETY: the header asks it of the caller.
    border(|| unsafe { free(index, "index") })
}

/// Inserts boxes: all of them, or none if the call fails. ids gets count ids, in the order of the boxes; an id stays with its box
/// until osp_index_remove, and may then be given to another one. boxes and ids may be NULL if count is 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_insert(
    index: *mut OspIndex,
    boxes: *const OspBox,
    count: usize,
    ids: *mut u32,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (index, boxes, ids) = unsafe {
            let ids = OutList::new(ids, count, "ids")?;
            (self::index(index)?, list(boxes, count, OSP_MAX_IDS as usize, "boxes")?, ids)
        };
        ids.write(index.change()?.insert(&checked(&boxes)?)?.into_iter());
        Ok(())
    })
}

/// Gives boxes that are there new places: all of them, or none if the call fails. If an id is there twice, its last box holds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_update(
    index: *mut OspIndex,
    ids: *const u32,
    boxes: *const OspBox,
    count: usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (index, ids, boxes) = unsafe {
            let most = OSP_MAX_IDS as usize;
            (self::index(index)?, list(ids, count, most, "ids")?, list(boxes, count, most, "boxes")?)
        };
        index.change()?.update(&ids, &checked(&boxes)?)
    })
}

/// Takes a box out.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_remove(index: *mut OspIndex, id: u32) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        unsafe { self::index(index) }?.change()?.remove(id)
    })
}

/// Takes everything out; keeps the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_clear(index: *mut OspIndex) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        unsafe { self::index(index) }?.change()?.clear();
        Ok(())
    })
}

/// Ends a batch of changes: call it once a frame, after the changes and before the queries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_commit(index: *mut OspIndex) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        unsafe { self::index(index) }?.change()?.commit();
        Ok(())
    })
}

/// Boxes in the index.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_count(index: *const OspIndex, count: *mut usize) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (index, count) = unsafe { (self::index(index)?, Out::new(count, "count")?) };
        count.set(index.read()?.count());
        Ok(())
    })
}

/// Memory that the index holds, bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_memory(index: *const OspIndex, bytes: *mut usize) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (index, bytes) = unsafe { (self::index(index)?, Out::new(bytes, "bytes")?) };
        bytes.set(index.read()?.bytes());
        Ok(())
    })
}

/// The box with an id, as it was given last.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_box(index: *const OspIndex, id: u32, bounds: *mut OspBox) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (index, out) = unsafe { (self::index(index)?, Out::new(bounds, "bounds")?) };
        let bounds = index.read()?.bounds(id)?;
        out.set(OspBox { min: bounds.min.to_array(), max: bounds.max.to_array() });
        Ok(())
    })
}

/// Finds the boxes that a view may see: those that lie wholly behind none of its six planes.
///
/// clip_from_world are sixteen numbers, column after column; x and y from -w to w, depth as OspDepth says, forward, reversed or
/// without end, perspective or parallel, y up or down, left-handed or right-handed. Nothing that the matrix shows is left out.
/// ids gets the ids, ascending, if there is room for all of them; *count is how many there are in either case.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_frustum(
    index: *const OspIndex,
    clip_from_world: *const f32,
    depth: i32,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, index, matrix) = unsafe {
            let answer = Answer::new(ids, room, count)?;
            (answer, self::index(index)?, numbers(clip_from_world, "clip_from_world")?)
        };
        index.read()?.frustum(&views::frustum(matrix, depth)?, &answer)
    })
}

/// osp_index_frustum for six planes, four numbers a b c d each: a box is left out if a x + b y + c z + d < 0 holds in all of it,
/// for one of them. Computed in 32 bits, in this order: planes have to lie a little outside of what must not be lost.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_frustum_of_planes(
    index: *const OspIndex,
    planes: *const f32,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, index, planes) =
            unsafe { (Answer::new(ids, room, count)?, self::index(index)?, numbers(planes, "planes")?) };
        index.read()?.frustum(&views::frustum_of_planes(planes)?, &answer)
    })
}

/// Finds the boxes that share a point with a box; touching counts. The answer is as that of osp_index_frustum.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_box_query(
    index: *const OspIndex,
    bounds: *const OspBox,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, index, bounds) =
            unsafe { (Answer::new(ids, room, count)?, self::index(index)?, value(bounds, "bounds")?) };
        index.read()?.box_query(&bounds.checked(0)?, &answer)
    })
}

/// Finds the boxes that share a point with a ball: center is x y z. The answer is as that of osp_index_frustum.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_sphere_query(
    index: *const OspIndex,
    center: *const f32,
    radius: f32,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, index, center) =
            unsafe { (Answer::new(ids, room, count)?, self::index(index)?, numbers(center, "center")?) };
        index.read()?.sphere_query(&sphere(center, radius)?, &answer)
    })
}

/// Finds a box that a ray enters at t <= t_max, and where: 0 if it begins inside. origin and direction are x y z; t is in units of
/// the direction's length. mode is one of OspRayMode; t_max may be infinite.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_index_ray(
    index: *const OspIndex,
    origin: *const f32,
    direction: *const f32,
    t_max: f32,
    mode: i32,
    hit: *mut OspHit,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (hit, index, origin, direction) = unsafe {
            let out = Out::new(hit, "hit")?;
            (out, self::index(index)?, numbers(origin, "origin")?, numbers(direction, "direction")?)
        };
        hit.set(OspHit::from(None));
        hit.set(index.read()?.ray(&AskedRay::new(origin, direction, t_max, mode)?)?);
        Ok(())
    })
}
