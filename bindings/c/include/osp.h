/* osp: finds what cameras see of objects that come, move and go in every frame. Made by cbindgen from bindings/c/src: do not edit.
 *
 * A frame: osp_culler_set and osp_culler_remove with what has changed, osp_culler_cull with the cameras, osp_culler_visible for each.
 *
 * Answers. A function answers OSP_STATUS_OK, or a status that says why nothing has changed; osp_last_error has the words. A fault
 * inside of osp is answered, too; only if the system has no memory left the program ends. Where there is room for fewer values than
 * were found, the first are in the list, the status is OSP_STATUS_BUFFER_TOO_SMALL, and *count is how many there are.
 *
 * Lifetimes. A handle (OspCuller) lives from osp_culler_new to osp_culler_free. osp keeps no pointer of the caller's after a
 * call, and gives out none but handles and messages. Keys are the caller's: any 64 bits. A message has one place in each thread, as
 * long as the thread lives; the next failure there overwrites it.
 *
 * What cannot be checked: a pointer that is not NULL points to as much memory as the function says, which nobody else writes during
 * the call; a handle is one that osp_culler_new gave and that was not freed. Whatever else is wrong is answered by a status.
 *
 * Threads. Any thread may call, with any handle. Functions that take a const handle may run at once with the same handle; a function
 * that takes another one changes the culler: if it meets another call with that handle, one of the two answers OSP_STATUS_BUSY and
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
 * Objects that there can be at once, and of a batch.
 */
#define OSP_MAX_OBJECTS 134217728

/**
 * Cameras of a frame, at most.
 */
#define OSP_MAX_CAMERAS 64

/**
 * The layers of a camera that sees all.
 */
#define OSP_ALL_LAYERS UINT32_MAX

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
     * The answer has more than there is room for: the first of it are in the list. How many there are is in *count.
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
     * A count is larger than memory, or than what there can be (OSP_MAX_OBJECTS, OSP_MAX_CAMERAS).
     */
    OSP_STATUS_TOO_MANY = 4,
    /**
     * A matrix has NaN or an infinite number in it, or no inverse.
     */
    OSP_STATUS_INVALID_CAMERA = 5,
    /**
     * A corner is not finite, a quad is not flat and convex, an index names no vertex, or nothing has an area.
     */
    OSP_STATUS_INVALID_OCCLUDER = 6,
    /**
     * Another argument is out of its range.
     */
    OSP_STATUS_INVALID_ARGUMENT = 7,
    /**
     * No object has this key.
     */
    OSP_STATUS_UNKNOWN_KEY = 8,
    /**
     * Another thread is changing this culler, or, if this call would change it, is using it.
     */
    OSP_STATUS_BUSY = 9,
    /**
     * An earlier call that changed this culler has failed inside of osp: only free it.
     */
    OSP_STATUS_POISONED = 10,
    /**
     * A fault inside of osp, which should be reported; it is also written to standard error.
     */
    OSP_STATUS_INTERNAL = 11,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspStatus OspStatus;
#else
typedef int32_t OspStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Range of depths of a matrix in clip space, after the division by w.
 */
enum OspDepth
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * 0 at the near plane, 1 at the far one: Vulkan, Direct3D, Metal, WebGPU.
     */
    OSP_DEPTH_ZERO_TO_ONE = 0,
    /**
     * 1 at the near plane, 0 at the far one or at infinity: reversed depth.
     */
    OSP_DEPTH_ONE_TO_ZERO = 1,
    /**
     * -1 at the near plane, 1 at the far one: OpenGL, and Unity's Camera.projectionMatrix.
     */
    OSP_DEPTH_MINUS_ONE_TO_ONE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspDepth OspDepth;
#else
typedef int32_t OspDepth;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Why an object, or its occluder, is left out.
 */
enum OspRefusal
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Its box has NaN or an infinite number in it, or min > max: the object is left out until it has another one.
     */
    OSP_REFUSAL_BOUNDS = 0,
    /**
     * There are OSP_MAX_OBJECTS keys already.
     */
    OSP_REFUSAL_KEY = 1,
    /**
     * All occluders together have too many polygons: the object has none.
     */
    OSP_REFUSAL_OCCLUDER = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum OspRefusal OspRefusal;
#else
typedef int32_t OspRefusal;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A culler of objects, each known by a key of the caller's, 64 bits, and a box. Objects come, move and go at any time.
 */
typedef struct OspCuller OspCuller;

/**
 * A camera or a light: osp_camera_f32 and osp_camera_f64 fill it in.
 */
typedef struct {
    /**
     * From world to clip space, column after column; x and y from -w to w. Perspective or parallel, on-axis or off-axis, mirrored, y up
     * or down, with an oblique near plane, with a far plane or without. Taken as exact, however far from the origin the eye is.
     */
    double clip_from_world[16];
    /**
     * One of OspDepth. Of a perspective it may have the wrong direction.
     */
    int32_t depth;
    /**
     * Not 0: what occluders hide is left out. Without effect for a parallel projection, an oblique near plane and a sheared screen.
     */
    int32_t hide_by_occluders;
    /**
     * The camera sees objects on one of these layers, a bit each.
     */
    uint32_t layers;
} OspCamera;

/**
 * A box: its smallest and largest corner, x y z, world space, metres. It may be flat, or a point.
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
 * What a camera sees.
 */
typedef struct {
    /**
     * Objects to draw: osp_culler_visible lists them.
     */
    size_t visible;
    /**
     * Objects in view that occluders hide.
     */
    size_t hidden;
} OspSeen;

/**
 * What was left out, and why.
 */
typedef struct {
    /**
     * The key of the object.
     */
    uint64_t key;
    /**
     * One of OspRefusal.
     */
    int32_t why;
} OspRefused;

/**
 * An object whose box a ray enters, or that is near.
 */
typedef struct {
    /**
     * Its key.
     */
    uint64_t key;
    /**
     * Where, in lengths of the ray's direction from its origin, or how far away, metres; 0 from inside.
     */
    float t;
} OspHit;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The camera of a matrix of sixteen numbers from world to clip space, column after column, and one of OspDepth. It sees all layers,
 * and nothing is hidden: set hide_by_occluders and layers for another one.
 */
OspStatus osp_camera_f32(const float *clip_from_world,
                         int32_t depth,
                         OspCamera *camera);

/**
 * osp_camera_f32 of a matrix in 64 bits: for an eye that is far from the origin.
 */
OspStatus osp_camera_f64(const double *clip_from_world, int32_t depth, OspCamera *camera);

/**
 * The ray through a point of the screen, x and y from -1 to 1 as the matrix has them. origin gets x y z of its point on the near plane,
 * direction x y z of its direction, of the length 1: world space, metres.
 */
OspStatus osp_camera_ray(const OspCamera *camera,
                         float x,
                         float y,
                         float *origin,
                         float *direction);

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
 * Makes a culler without objects. It needs no size of the world and no capacity. *culler is the handle, to be freed by
 * osp_culler_free; it is NULL if the call fails.
 */
OspStatus osp_culler_new(OspCuller **culler);

/**
 * Frees a culler and all that is in it. The handle may be NULL; afterwards it must not be used, and no other call may be running
 * with it.
 */
OspStatus osp_culler_free(OspCuller *culler);

/**
 * Inserts objects, or moves those that are there: a key and a box each, the tight box of all that is drawn of the object. A box with
 * NaN, an infinite number or min > max leaves its object out until it has another one; osp_culler_refused names it. Of a key that is
 * there twice the last box holds. An object that moves loses its occluder, unless the new box holds the one before. keys and boxes
 * may be NULL if count is 0.
 */
OspStatus osp_culler_set(OspCuller *culler,
                         const uint64_t *keys,
                         const OspBox *boxes,
                         size_t count);

/**
 * Takes objects out, with their occluders and layers. A key without an object is left alone.
 */
OspStatus osp_culler_remove(OspCuller *culler, const uint64_t *keys, size_t count);

/**
 * Takes everything out.
 */
OspStatus osp_culler_clear(OspCuller *culler);

/**
 * Puts objects on layers, a bit each: a camera sees an object if both share one. Objects are on the first layer, the mask 1, unless
 * they are put elsewhere; on none, no camera sees them.
 */
OspStatus osp_culler_set_layers(OspCuller *culler,
                                const uint64_t *keys,
                                const uint32_t *layers,
                                size_t count);

/**
 * Gives an object a flat, convex quad that hides what is behind it, in place of the occluder that it had: corners are x y z of its four
 * corners in order around it, either way; world space, metres.
 *
 * An occluder is opaque and hides from both sides. It is drawn itself, or lies inside of what is drawn. It stays where it is until the
 * object moves or goes. A key without a box may have one: a stand-in, which hides and is never listed. A few large occluders hide
 * more in less time than many small ones.
 */
OspStatus osp_culler_set_occluder_quad(OspCuller *culler,
                                       uint64_t key,
                                       const float *corners);

/**
 * osp_culler_set_occluder_quad with the six sides of a box: the stand-in for a house.
 */
OspStatus osp_culler_set_occluder_box(OspCuller *culler, uint64_t key, const OspBox *bounds);

/**
 * osp_culler_set_occluder_quad with a mesh: vertices are x y z of vertex_count points; indices are three places in it for each of
 * triangle_count triangles. Triangles without area are left out.
 */
OspStatus osp_culler_set_occluder_mesh(OspCuller *culler,
                                       uint64_t key,
                                       const float *vertices,
                                       size_t vertex_count,
                                       const uint32_t *indices,
                                       size_t triangle_count);

/**
 * Takes an object's occluder away; nothing happens if there is none.
 */
OspStatus osp_culler_remove_occluder(OspCuller *culler, uint64_t key);

/**
 * Makes all changes known to osp_culler_in_box, osp_culler_in_sphere, osp_culler_on_ray and osp_culler_nearest. osp_culler_cull does it, too.
 */
OspStatus osp_culler_commit(OspCuller *culler);

/**
 * Objects in the culler: those with a box that was not refused.
 */
OspStatus osp_culler_count(const OspCuller *culler, size_t *count);

/**
 * The box of an object, as it was set last.
 */
OspStatus osp_culler_box(const OspCuller *culler, uint64_t key, OspBox *bounds);

/**
 * Finds what each camera sees: whatever of an object may be on its screen and, for a camera with hide_by_occluders, not behind the
 * occluders. Nothing that can be seen is left out. All cameras are culled in one walk: two eyes, a camera and its lights, the sides
 * of a cube; at most OSP_MAX_CAMERAS. seen gets an OspSeen for each camera; it may be NULL. osp_culler_visible then lists the keys.
 */
OspStatus osp_culler_cull(OspCuller *culler,
                          const OspCamera *cameras,
                          size_t camera_count,
                          OspSeen *seen);

/**
 * What a camera of the last osp_culler_cull sees, counted from 0: keys gets the keys of the objects to draw, each once, in no particular
 * order; *count is how many there are. What was removed since then is not among them. After an osp_culler_commit of changes there is
 * no camera.
 */
OspStatus osp_culler_visible(const OspCuller *culler,
                             size_t camera,
                             uint64_t *keys,
                             size_t room,
                             size_t *count);

/**
 * Tells of each box whether nothing of it can be on a camera's screen: it is out of view, or behind the occluders if the camera has
 * hide_by_occluders. The boxes are in no culler: of a sound, a character, a trigger. hidden gets 1 or 0 for each. A box that is empty
 * or not finite is not hidden. Makes all changes known, as osp_culler_cull does; what that has found stays if there are none.
 */
OspStatus osp_culler_are_hidden(OspCuller *culler,
                                const OspCamera *camera,
                                const OspBox *boxes,
                                size_t count,
                                uint8_t *hidden);

/**
 * What was refused between the last two calls of osp_culler_cull, and why; of very much the beginning.
 */
OspStatus osp_culler_refused(const OspCuller *culler, OspRefused *refused, size_t room, size_t *count);

/**
 * Finds the objects whose boxes share a point with a box; touching counts. The answer is as that of osp_culler_visible.
 */
OspStatus osp_culler_in_box(const OspCuller *culler, const OspBox *bounds, uint64_t *keys, size_t room, size_t *count);

/**
 * Finds the objects whose boxes share a point with a ball: center is x y z, radius metres. The answer is as that of osp_culler_visible.
 */
OspStatus osp_culler_in_sphere(const OspCuller *culler,
                               const float *center,
                               float radius,
                               uint64_t *keys,
                               size_t room,
                               size_t *count);

/**
 * Finds the objects whose boxes a ray enters at t <= t_max, the nearest first. origin and direction are x y z; t is in lengths of the
 * direction; t_max may be infinite. hits gets the first of them, as many as there is room for; *count is how many there are. Room for
 * one is enough for the nearest box; to pick an object by its mesh, test one after the other until t is beyond the nearest hit.
 */
OspStatus osp_culler_on_ray(const OspCuller *culler,
                            const float *origin,
                            const float *direction,
                            float t_max,
                            OspHit *hits,
                            size_t room,
                            size_t *count);

/**
 * Finds the objects whose boxes are nearest to a point, x y z: hits gets as many as there is room for, if there are so many, the nearest
 * first, with their distances as t, metres, 0 from inside; *count is how many it got.
 */
OspStatus osp_culler_nearest(const OspCuller *culler,
                             const float *point,
                             OspHit *hits,
                             size_t room,
                             size_t *count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OSP_H */
