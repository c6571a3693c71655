/* osp: culls what a view cannot see, for scenes that change in every frame. Made by cbindgen from bindings/c/src: do not edit.
 *
 * Answers. A function answers OSP_STATUS_OK, or a status that says why nothing has changed; osp_last_error has the words. A fault
 * inside of osp is answered, too; only if the system has no memory left the program ends.
 *
 * Lifetimes. A handle (OspIndex, OspScene) lives from osp_..._new to osp_..._free. osp keeps no pointer of the caller's after a
 * call, and gives out none but handles and messages. An id lives from insert to remove; afterwards it may be given again. A message
 * has one place in each thread, as long as the thread lives; the next failure there overwrites it.
 *
 * What cannot be checked: a pointer that is not NULL points to as much memory as the function says, which nobody else writes during
 * the call; a handle is one that osp_..._new gave and that was not freed. Whatever else is wrong is answered by a status.
 *
 * Threads. Any thread may call, with any handle. Functions that take a const handle may run at once with the same handle; a function
 * that takes another one changes the object: if it meets another call with that handle, one of the two answers OSP_STATUS_BUSY and
 * has done nothing. Nobody waits. Only free must not meet any other call. Messages are kept for each thread.
 *
 * Space. World space, right-handed or left-handed, in metres; another unit of a like size does as well (two points that are closer
 * than 1e-7 may count as one where osp looks for occluders).
 */

#ifndef OSP_H
#define OSP_H

#include <stddef.h>
#include <stdint.h>


/**
 * Boxes of an index, or boxes and triangles of a scene, that there can be at once; ids are below it.
 */
#define OSP_MAX_IDS 134217728

/**
 * The id of nothing.
 */
#define OSP_NO_ID UINT32_MAX

/**
 * Views of a frame, at most.
 */
#define OSP_MAX_VIEWS 64

/**
 * Bytes of a message at most, its zero byte included; what is longer is cut off.
 */
#define OSP_MESSAGE_BYTES 1024

/**
 * The version of this header: major * 65536 + minor * 256 + patch.
 */
#define OSP_VERSION 256

/**
 * What a function answers: OSP_STATUS_OK, or why it has changed nothing. osp_last_error says it in words.
 */
enum OspStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Done.
     */
    OSP_STATUS_OK = 0,
    /**
     * The answer has more ids than the buffer; nothing is in it. How many there are is in *count.
     */
    OSP_STATUS_BUFFER_TOO_SMALL = 1,
    /**
     * A pointer is NULL that must not be.
     */
    OSP_STATUS_NULL_POINTER = 2,
    /**
     * A pointer is not aligned for what it points to.
     */
    OSP_STATUS_MISALIGNED_POINTER = 3,
    /**
     * A count is larger than memory, or than the ids that there are (OSP_MAX_IDS).
     */
    OSP_STATUS_TOO_MANY = 4,
    /**
     * A box has NaN or an infinite number in it, or min > max; or, in a scene, a coordinate beyond 1e15.
     */
    OSP_STATUS_INVALID_BOX = 5,
    /**
     * A corner has NaN in it or a coordinate beyond 1e15, or an index names no vertex.
     */
    OSP_STATUS_INVALID_TRIANGLE = 6,
    /**
     * No box or triangle has this id, or it is of the other kind.
     */
    OSP_STATUS_UNKNOWN_ID = 7,
    /**
     * A matrix or plane has NaN or an infinite number in it, or the matrix has no inverse or is no view that the function takes.
     */
    OSP_STATUS_INVALID_VIEW = 8,
    /**
     * Another argument is out of its range.
     */
    OSP_STATUS_INVALID_ARGUMENT = 9,
    /**
     * There are changes since the last commit (or frame): commit, then ask.
     */
    OSP_STATUS_NOT_COMMITTED = 10,
    /**
     * Another thread is changing this object, or, if this call would change it, is using it.
     */
    OSP_STATUS_BUSY = 11,
    /**
     * An earlier call that changed this object has failed inside of osp: only free it.
     */
    OSP_STATUS_POISONED = 12,
    /**
     * A fault inside of osp, which should be reported; it is also written to standard error.
     */
    OSP_STATUS_INTERNAL = 13,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspStatus OspStatus;
#else
typedef int32_t OspStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Which depths a matrix gives to what is drawn, after the division by w.
 */
enum OspDepth
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * From 0 to 1 or, reversed, from 1 to 0: Vulkan, Direct3D, Metal, WebGPU.
     */
    OSP_DEPTH_ZERO_TO_ONE = 0,
    /**
     * From -1 to 1, in either direction: OpenGL, and Unity's Camera.projectionMatrix.
     */
    OSP_DEPTH_MINUS_ONE_TO_ONE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspDepth OspDepth;
#else
typedef int32_t OspDepth;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How a scene finds what is hidden.
 */
enum OspOcclusion
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Not at all: frustum culling alone.
     */
    OSP_OCCLUSION_NONE = 0,
    /**
     * A tree of the shadow volumes of the largest occluders of each frame: for walls and other large polygons.
     */
    OSP_OCCLUSION_MSVBSP = 1,
    /**
     * A depth buffer of the largest occluders of each frame.
     */
    OSP_OCCLUSION_DEPTH = 2,
    /**
     * A depth buffer of what was visible in the last frame: for many small triangles.
     */
    OSP_OCCLUSION_DEPTH_LAST = 3,
    /**
     * In each frame whichever of none, MSVBSP and DEPTH_LAST takes the least time.
     */
    OSP_OCCLUSION_AUTO = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspOcclusion OspOcclusion;
#else
typedef int32_t OspOcclusion;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How a ray is asked.
 */
enum OspRayMode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * What is hit first; of several at the same place that with the lowest id.
     */
    OSP_RAY_MODE_NEAREST = 0,
    /**
     * Anything that is hit: cheaper, for "is there something".
     */
    OSP_RAY_MODE_ANY = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspRayMode OspRayMode;
#else
typedef int32_t OspRayMode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * An index of boxes: inserts, moves and removes them at any time without being rebuilt, and finds those that a view may see.
 */
typedef struct OspIndex OspIndex;

/**
 * A scene of boxes and triangles. Opaque triangles hide what is behind them; boxes stand for meshes and hide nothing.
 */
typedef struct OspScene OspScene;

/**
 * What an index should expect: hints. Boxes outside of the cube and beyond the capacity are kept and found as well.
 */
typedef struct {
    /**
     * Centre of a cube around most of what will come, x y z.
     */
    float root_center[3];
    /**
     * Its edge length, more than 0.
     */
    float root_size;
    /**
     * Boxes to reserve memory for now, so that hardly a frame has to: about 70 bytes each in an index, 105 in a scene; 1.4 MB
     * are taken in any case. At most OSP_MAX_IDS.
     */
    uint32_t capacity;
} OspIndexConfig;

/**
 * A box: its smallest and largest corner, x y z, world space. It may be flat, or a point.
 */
typedef struct {
    /**
     * Smallest corner, x y z; finite.
     */
    float min[3];
    /**
     * Largest corner, x y z; finite, on no axis less than min.
     */
    float max[3];
} OspBox;

/**
 * What is hit by a ray.
 */
typedef struct {
    /**
     * What is hit, OSP_NO_ID for nothing.
     */
    uint32_t id;
    /**
     * Where, in units of the direction's length from the origin; 0 for nothing.
     */
    float t;
} OspHit;

/**
 * What a scene should expect, and how it culls.
 */
typedef struct {
    /**
     * Hints for the index of the scene.
     */
    OspIndexConfig index;
    /**
     * One of OspOcclusion.
     */
    int32_t occlusion;
    /**
     * What it costs to draw one box or triangle, nanoseconds; more than 0. 10 for the triangles of a stroke; what a mesh costs
     * where boxes stand for meshes (10000, say). From 400 on each of them is tested for itself; at 10, only groups of 40 and more.
     */
    float draw_ns;
} OspSceneConfig;

/**
 * What a frame has found, for all its views together.
 */
typedef struct {
    /**
     * Boxes and triangles of the scene.
     */
    uint64_t count;
    /**
     * Of these, in the frustum, hidden or not.
     */
    uint64_t in_view;
    /**
     * Of these, to be drawn: osp_scene_visible lists them.
     */
    uint64_t visible;
    /**
     * Occluders that hid the others.
     */
    uint64_t occluders;
    /**
     * To follow the changes, nanoseconds.
     */
    uint64_t insert_ns;
    /**
     * To cull by the frustum, nanoseconds.
     */
    uint64_t cull_ns;
    /**
     * To find what is hidden, nanoseconds.
     */
    uint64_t occlusion_ns;
} OspFrame;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The message of the last call on this thread that did not answer OSP_STATUS_OK; empty if there was none, never NULL. It ends with a
 * zero byte and is plain ASCII, OSP_MESSAGE_BYTES at most. The pointer is the same for every call on one thread and is valid until
 * the thread ends; the next failure on this thread writes its message into the same place. Copy what has to stay.
 */
const char *osp_last_error(void);

/**
 * The version of the library that is loaded: major * 65536 + minor * 256 + patch. Compare it with OSP_VERSION, that of the
 * header: while the major number is 0, the minor numbers have to be equal.
 */
uint32_t osp_version(void);

/**
 * Makes an empty index. config may be NULL: then a cube of 4 m around (0, 1.5, 0) and little memory. *index is the handle, to
 * be freed by osp_index_free; it is NULL if the call fails.
 */
OspStatus osp_index_new(const OspIndexConfig *config,
                        OspIndex **index);

/**
 * Frees an index and all that is in it. The handle may be NULL; afterwards it must not be used, and no other call may be running
 * with it.
 */
OspStatus osp_index_free(OspIndex *index);

/**
 * Inserts boxes: all of them, or none if the call fails. ids gets count ids, in the order of the boxes; an id stays with its box
 * until osp_index_remove, and may then be given to another one. boxes and ids may be NULL if count is 0.
 */
OspStatus osp_index_insert(OspIndex *index,
                           const OspBox *boxes,
                           size_t count,
                           uint32_t *ids);

/**
 * Gives boxes that are there new places: all of them, or none if the call fails. If an id is there twice, its last box holds.
 */
OspStatus osp_index_update(OspIndex *index,
                           const uint32_t *ids,
                           const OspBox *boxes,
                           size_t count);

/**
 * Takes a box out.
 */
OspStatus osp_index_remove(OspIndex *index, uint32_t id);

/**
 * Takes everything out; keeps the memory.
 */
OspStatus osp_index_clear(OspIndex *index);

/**
 * Ends a batch of changes: call it once a frame, after the changes and before the queries.
 */
OspStatus osp_index_commit(OspIndex *index);

/**
 * Boxes in the index.
 */
OspStatus osp_index_count(const OspIndex *index, size_t *count);

/**
 * Memory that the index holds, bytes.
 */
OspStatus osp_index_memory(const OspIndex *index, size_t *bytes);

/**
 * The box with an id, as it was given last.
 */
OspStatus osp_index_box(const OspIndex *index, uint32_t id, OspBox *bounds);

/**
 * Finds the boxes that a view may see: those that lie wholly behind none of its six planes.
 *
 * clip_from_world are sixteen numbers, column after column; x and y from -w to w, depth as OspDepth says, forward, reversed or
 * without end, perspective or parallel, y up or down, left-handed or right-handed. Nothing that the matrix shows is left out.
 * ids gets the ids, ascending, if there is room for all of them; *count is how many there are in either case.
 */
OspStatus osp_index_frustum(const OspIndex *index,
                            const float *clip_from_world,
                            int32_t depth,
                            uint32_t *ids,
                            size_t room,
                            size_t *count);

/**
 * osp_index_frustum for six planes, four numbers a b c d each: a box is left out if a x + b y + c z + d < 0 holds in all of it,
 * for one of them. Computed in 32 bits, in this order: planes have to lie a little outside of what must not be lost.
 */
OspStatus osp_index_frustum_of_planes(const OspIndex *index,
                                      const float *planes,
                                      uint32_t *ids,
                                      size_t room,
                                      size_t *count);

/**
 * Finds the boxes that share a point with a box; touching counts. The answer is as that of osp_index_frustum.
 */
OspStatus osp_index_box_query(const OspIndex *index, const OspBox *bounds, uint32_t *ids, size_t room, size_t *count);

/**
 * Finds the boxes that share a point with a ball: center is x y z. The answer is as that of osp_index_frustum.
 */
OspStatus osp_index_sphere_query(const OspIndex *index,
                                 const float *center,
                                 float radius,
                                 uint32_t *ids,
                                 size_t room,
                                 size_t *count);

/**
 * Finds a box that a ray enters at t <= t_max, and where: 0 if it begins inside. origin and direction are x y z; t is in units of
 * the direction's length. mode is one of OspRayMode; t_max may be infinite.
 */
OspStatus osp_index_ray(const OspIndex *index,
                        const float *origin,
                        const float *direction,
                        float t_max,
                        int32_t mode,
                        OspHit *hit);

/**
 * Makes an empty scene. config may be NULL: then OSP_OCCLUSION_AUTO for triangles that are drawn in 10 ns each. *scene is the
 * handle, to be freed by osp_scene_free; it is NULL if the call fails.
 */
OspStatus osp_scene_new(const OspSceneConfig *config,
                        OspScene **scene);

/**
 * Frees a scene and all that is in it. The handle may be NULL; afterwards it must not be used, and no other call may be running
 * with it.
 */
OspStatus osp_scene_free(OspScene *scene);

/**
 * Inserts boxes, which hide nothing: all of them, or none if the call fails. ids gets count ids, as with osp_index_insert.
 * Coordinates are at most 1e15 in a scene.
 */
OspStatus osp_scene_insert_boxes(OspScene *scene,
                                 const OspBox *boxes,
                                 size_t count,
                                 uint32_t *ids);

/**
 * Inserts triangles: all of them, or none if the call fails. ids gets an id for each, triangle_count in all.
 *
 * vertices are x y z of vertex_count points; indices are three places in it for each triangle. If indices is NULL, the triangles
 * are vertices 0 1 2, 3 4 5 and so on, and there have to be as many. If is_opaque is not 0, they hide what is behind them: they
 * are drawn from both sides, without holes and without transparency. Triangles that are not drawn may be inserted, too, to stand
 * for what a mesh hides, if they lie inside of what is drawn.
 */
OspStatus osp_scene_insert_triangles(OspScene *scene,
                                     const float *vertices,
                                     size_t vertex_count,
                                     const uint32_t *indices,
                                     size_t triangle_count,
                                     int32_t is_opaque,
                                     uint32_t *ids);

/**
 * Moves a box.
 */
OspStatus osp_scene_update_box(OspScene *scene, uint32_t id, const OspBox *bounds);

/**
 * Moves a triangle: corners are nine numbers, x y z of each. It stays as opaque as it was.
 */
OspStatus osp_scene_update_triangle(OspScene *scene, uint32_t id, const float *corners);

/**
 * Takes a box or a triangle out.
 */
OspStatus osp_scene_remove(OspScene *scene, uint32_t id);

/**
 * Boxes and triangles in the scene.
 */
OspStatus osp_scene_count(const OspScene *scene, size_t *count);

/**
 * Memory that the boxes, the triangles and their index hold, bytes; not that of finding what is hidden.
 */
OspStatus osp_scene_memory(const OspScene *scene, size_t *bytes);

/**
 * Takes the changes over without culling, for queries between frames. osp_scene_frame does the same.
 */
OspStatus osp_scene_commit(OspScene *scene);

/**
 * A frame: takes the changes over and culls each view by its frustum and by what is hidden. osp_scene_visible then tells what to
 * draw. The first frame (or osp_scene_commit) also looks for walls of small triangles among all that is there by then, for up to
 * 130 ms: so insert a level before it.
 *
 * clip_from_world are sixteen numbers for each view, as osp_index_frustum takes them, but perspectives only: for others there is
 * osp_scene_frustum. view_count is from 1 to OSP_MAX_VIEWS: two eyes, the screens of a room. frame may be NULL.
 */
OspStatus osp_scene_frame(OspScene *scene,
                          const float *clip_from_world,
                          size_t view_count,
                          int32_t depth,
                          OspFrame *frame);

/**
 * What to draw of a view of the last frame, counted from 0: ids gets the ids, ascending, if there is room for all of them; *count
 * is how many there are in either case. What was removed since then is still in it.
 */
OspStatus osp_scene_visible(const OspScene *scene,
                            uint32_t view,
                            uint32_t *ids,
                            size_t room,
                            size_t *count);

/**
 * osp_index_frustum for the boxes and triangles of a scene: any projection, hidden or not. For the views of shadows.
 */
OspStatus osp_scene_frustum(const OspScene *scene,
                            const float *clip_from_world,
                            int32_t depth,
                            uint32_t *ids,
                            size_t room,
                            size_t *count);

/**
 * Finds the boxes, and the triangles by their boxes, that share a point with a box.
 */
OspStatus osp_scene_box_query(const OspScene *scene, const OspBox *bounds, uint32_t *ids, size_t room, size_t *count);

/**
 * osp_index_ray for a scene: where the ray enters a box or meets a triangle itself, from either side.
 */
OspStatus osp_scene_ray(const OspScene *scene,
                        const float *origin,
                        const float *direction,
                        float t_max,
                        int32_t mode,
                        OspHit *hit);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OSP_H */
