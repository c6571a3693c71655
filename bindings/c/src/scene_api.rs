//! The functions of `OspScene`.

use osp::{glam::Vec3, view::View};

use crate::{
    border::{Answer, Out, OutList, border, free, give, list, numbers, object, value},
    handle::Guarded,
    index::AskedRay,
    scene::{Scene, box_of, corners_of},
    status::{Failure, OspStatus, Outcome},
    things::Thing,
    types::{OSP_MAX_IDS, OSP_MAX_VIEWS, OspBox, OspFrame, OspHit, OspSceneConfig},
    views,
};

/// A scene of boxes and triangles. Opaque triangles hide what is behind them; boxes stand for meshes and hide nothing.
#[expect(missing_debug_implementations, reason = "C sees its name only")]
pub struct OspScene(Guarded<Scene>);

const MOST: usize = OSP_MAX_IDS as usize;

/// # Safety
/// See [`object`].
unsafe fn scene<'a>(scene: *const OspScene) -> Outcome<&'a Guarded<Scene>> {
    // SAFETY: the caller's part.
    unsafe { object(scene, "scene") }.map(|scene| &scene.0)
}

/// Makes an empty scene. config may be NULL: then OSP_OCCLUSION_AUTO for triangles that are drawn in 10 ns each. *scene is the
/// handle, to be freed by osp_scene_free; it is NULL if the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_new(
    config: *const OspSceneConfig,
    scene: *mut *mut OspScene,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let out = unsafe { Out::new(scene, "scene") }?;
        out.set(std::ptr::null_mut());
        // SAFETY: the header asks it of the caller.
        let config = (!config.is_null()).then(|| unsafe { value(config, "config") }).transpose()?;
        give(OspScene(Guarded::new(Scene::new(config)?)), &out);
        Ok(())
    })
}

/// Frees a scene and all that is in it. The handle may be NULL; afterwards it must not be used, and no other call may be running
/// with it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_free(scene: *mut OspScene) -> OspStatus {
    // SAFETY: the header asks it of the caller.
    border(|| unsafe { free(scene, "scene") })
}

/// Inserts boxes, which hide nothing: all of them, or none if the call fails. ids gets count ids, as with osp_index_insert.
/// Coordinates are at most 1e15 in a scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_insert_boxes(
    scene: *mut OspScene,
    boxes: *const OspBox,
    count: usize,
    ids: *mut u32,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (scene, boxes, ids) = unsafe {
            (self::scene(scene)?, list(boxes, count, MOST, "boxes")?, OutList::new(ids, count, "ids")?)
        };
        let things =
            boxes.iter().enumerate().map(|(at, bounds)| box_of(bounds, at)).collect::<Outcome<_>>()?;
        ids.write(scene.change()?.insert(things)?.into_iter());
        Ok(())
    })
}

/// Inserts triangles: all of them, or none if the call fails. ids gets an id for each, triangle_count in all.
///
/// vertices are x y z of vertex_count points; indices are three places in it for each triangle. If indices is NULL, the triangles
/// are vertices 0 1 2, 3 4 5 and so on, and there have to be as many. If is_opaque is not 0, they hide what is behind them: they
/// are drawn from both sides, without holes and without transparency. Triangles that are not drawn may be inserted, too, to stand
/// for what a mesh hides, if they lie inside of what is drawn.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_insert_triangles(
    scene: *mut OspScene,
    vertices: *const f32,
    vertex_count: usize,
    indices: *const u32,
    triangle_count: usize,
    is_opaque: i32,
    ids: *mut u32,
) -> OspStatus {
    border(|| {
        let too_many = |what: &str, count: usize| {
            Failure::new(OspStatus::TooMany, format!("{what}: {count} are more than {OSP_MAX_IDS}"))
        };
        if triangle_count > MOST {
            return Err(too_many("triangle_count", triangle_count));
        }
        let numbers = vertex_count.checked_mul(3).ok_or_else(|| too_many("vertex_count", vertex_count))?;
        // SAFETY: the header asks it of the caller.
        let (scene, vertices, indices, ids) = unsafe {
            (
                self::scene(scene)?,
                list(vertices, numbers, 9 * MOST, "vertices")?,
                if indices.is_null() {
                    None
                } else {
                    Some(list(indices, 3 * triangle_count, 3 * MOST, "indices")?)
                },
                OutList::new(ids, triangle_count, "ids")?,
            )
        };
        let vertex = |triangle: usize, at: usize| {
            let at = indices.as_ref().map_or(at, |indices| indices[at] as usize);
            let xyz = vertices.as_chunks::<3>().0.get(at).copied().map(Vec3::from);
            xyz.ok_or_else(|| {
                let message =
                    format!("triangle {triangle}: expected a vertex below {vertex_count}, found {at}");
                Failure::new(OspStatus::InvalidTriangle, message)
            })
        };
        let triangle = |i: usize| {
            let corners = [vertex(i, 3 * i)?, vertex(i, 3 * i + 1)?, vertex(i, 3 * i + 2)?];
            Ok(Thing::Triangle { corners: corners_of(corners, i)?, is_opaque: is_opaque != 0 })
        };
        let things = (0..triangle_count).map(triangle).collect::<Outcome<_>>()?;
        ids.write(scene.change()?.insert(things)?.into_iter());
        Ok(())
    })
}

/// Moves a box.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_update_box(
    scene: *mut OspScene,
    id: u32,
    bounds: *const OspBox,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (scene, bounds) = unsafe { (self::scene(scene)?, value(bounds, "bounds")?) };
        scene.change()?.update(id, box_of(&bounds, 0)?)
    })
}

/// Moves a triangle: corners are nine numbers, x y z of each. It stays as opaque as it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_update_triangle(
    scene: *mut OspScene,
    id: u32,
    corners: *const f32,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (scene, corners) = unsafe { (self::scene(scene)?, numbers::<9>(corners, "corners")?) };
        let corner = |i: usize| Vec3::new(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
        scene.change()?.update_triangle(id, corners_of([corner(0), corner(1), corner(2)], 0)?)
    })
}

/// Takes a box or a triangle out.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_remove(scene: *mut OspScene, id: u32) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        unsafe { self::scene(scene) }?.change()?.remove(id)
    })
}

/// Boxes and triangles in the scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_count(scene: *const OspScene, count: *mut usize) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (scene, count) = unsafe { (self::scene(scene)?, Out::new(count, "count")?) };
        count.set(scene.read()?.count());
        Ok(())
    })
}

/// Memory that the boxes, the triangles and their index hold, bytes; not that of finding what is hidden.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_memory(scene: *const OspScene, bytes: *mut usize) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (scene, bytes) = unsafe { (self::scene(scene)?, Out::new(bytes, "bytes")?) };
        bytes.set(scene.read()?.bytes());
        Ok(())
    })
}

/// Takes the changes over without culling, for queries between frames. osp_scene_frame does the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_commit(scene: *mut OspScene) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        unsafe { self::scene(scene) }?.change()?.commit();
        Ok(())
    })
}

/// A frame: takes the changes over and culls each view by its frustum and by what is hidden. osp_scene_visible then tells what to
/// draw. The first frame (or osp_scene_commit) also looks for walls of small triangles among all that is there by then, for up to
/// 130 ms: so insert a level before it.
///
/// clip_from_world are sixteen numbers for each view, as osp_index_frustum takes them, but perspectives only: for others there is
/// osp_scene_frustum. view_count is from 1 to OSP_MAX_VIEWS: two eyes, the screens of a room. frame may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_frame(
    scene: *mut OspScene,
    clip_from_world: *const f32,
    view_count: usize,
    depth: i32,
    frame: *mut OspFrame,
) -> OspStatus {
    border(|| {
        let most = OSP_MAX_VIEWS as usize;
        if view_count == 0 || view_count > most {
            let message = format!("view_count: expected 1 to {most}, found {view_count}");
            return Err(Failure::new(OspStatus::InvalidArgument, message));
        }
        // SAFETY: the header asks it of the caller.
        let (scene, matrices, out) = unsafe {
            let out = if frame.is_null() { None } else { Some(Out::new(frame, "frame")?) };
            (self::scene(scene)?, list(clip_from_world, 16 * view_count, 16 * most, "clip_from_world")?, out)
        };
        let matrices = matrices.as_chunks::<16>().0;
        let views =
            matrices.iter().map(|matrix| views::view(*matrix, depth)).collect::<Outcome<Vec<View>>>()?;
        let frame = scene.change()?.frame(&views);
        if let Some(out) = out {
            out.set(frame);
        }
        Ok(())
    })
}

/// What to draw of a view of the last frame, counted from 0: ids gets the ids, ascending, if there is room for all of them; *count
/// is how many there are in either case. What was removed since then is still in it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_visible(
    scene: *const OspScene,
    view: u32,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, scene) = unsafe { (Answer::new(ids, room, count)?, self::scene(scene)?) };
        scene.read()?.visible(view, &answer)
    })
}

/// osp_index_frustum for the boxes and triangles of a scene: any projection, hidden or not. For the views of shadows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_frustum(
    scene: *const OspScene,
    clip_from_world: *const f32,
    depth: i32,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, scene, matrix) = unsafe {
            let answer = Answer::new(ids, room, count)?;
            (answer, self::scene(scene)?, numbers(clip_from_world, "clip_from_world")?)
        };
        scene.read()?.frustum(&views::frustum(matrix, depth)?, &answer)
    })
}

/// Finds the boxes, and the triangles by their boxes, that share a point with a box.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_box_query(
    scene: *const OspScene,
    bounds: *const OspBox,
    ids: *mut u32,
    room: usize,
    count: *mut usize,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (answer, scene, bounds) =
            unsafe { (Answer::new(ids, room, count)?, self::scene(scene)?, value(bounds, "bounds")?) };
        scene.read()?.box_query(&bounds.checked(0)?, &answer)
    })
}

/// osp_index_ray for a scene: where the ray enters a box or meets a triangle itself, from either side.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn osp_scene_ray(
    scene: *const OspScene,
    origin: *const f32,
    direction: *const f32,
    t_max: f32,
    mode: i32,
    hit: *mut OspHit,
) -> OspStatus {
    border(|| {
        // SAFETY: the header asks it of the caller.
        let (hit, scene, origin, direction) = unsafe {
            let out = Out::new(hit, "hit")?;
            (out, self::scene(scene)?, numbers(origin, "origin")?, numbers(direction, "direction")?)
        };
        hit.set(OspHit::from(None));
        hit.set(scene.read()?.ray(&AskedRay::new(origin, direction, t_max, mode)?)?);
        Ok(())
    })
}
