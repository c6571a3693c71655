/* osp: finds the objects that cameras see, while objects are added, moved and removed in every frame. cbindgen makes this file from
 * bindings/c/src: do not edit it.
 *
 * A frame: call osp_culler_set and osp_culler_remove for the changes, osp_culler_cull with the cameras, and osp_culler_visible for each.
 *
 * Status. A function returns OSP_STATUS_OK, or the reason for which nothing has changed; osp_last_error describes it in words. An
 * error inside osp also gives a status; only if the system runs out of memory, the program ends. If there is room for fewer values
 * than were found, the list has the first of them, the status is OSP_STATUS_BUFFER_TOO_SMALL, and *count is the number of all.
 *
 * Lifetimes. A handle (OspCuller) lives from osp_culler_new to osp_culler_free. osp keeps no pointer from the caller after a call,
 * and returns only handles and messages. The caller chooses the keys: any 64 bits. Each thread has one place for a message, as long
 * as the thread lives; the next failure in the thread overwrites it.
 *
 * Some things cannot be checked, so the caller must guarantee them. A pointer that is not NULL points to as much memory as the
 * function requires, which nobody else writes during the call. A handle came from osp_culler_new and has not been freed. All other
 * errors give a status.
 *
 * Threads. Any thread may use any handle. Functions with a const handle may run at the same time with the same handle. A function with
 * a handle that is not const changes the culler. If it meets another call with this handle, one of the two returns OSP_STATUS_BUSY and
 * has done nothing. Nobody waits. Only osp_culler_free must never meet another call. Messages are kept for each thread.
 *
 * Space. World space, right-handed or left-handed, in metres. Another unit of a similar size is also possible (two points that are
 * closer than 1e-7 may count as one in the search for occluders).
 */

#ifndef OSP_H
#define OSP_H

#include <stddef.h>
#include <stdint.h>


/**
 * Largest number of objects at once, and in a batch.
 */
#define OSP_MAX_OBJECTS 134217728

/**
 * Largest number of cameras of a frame.
 */
#define OSP_MAX_CAMERAS 64

/**
 * The layers of a camera that sees all layers.
 */
#define OSP_ALL_LAYERS UINT32_MAX

/**
 * Largest number of bytes of a message, including its zero byte. Longer messages are cut off.
 */
#define OSP_MESSAGE_BYTES 1024

/**
 * The version of this header: major * 65536 + minor * 256 + patch.
 */
#define OSP_VERSION 256

/**
 * The status that a function returns: OSP_STATUS_OK, or the reason for which it has changed nothing. osp_last_error
 * describes it in words.
 */
enum OspStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Success.
     */
    OSP_STATUS_OK = 0,
    /**
     * There are more results than there is room for. The list has the first of them. *count is the number of all.
     */
    OSP_STATUS_BUFFER_TOO_SMALL = 1,
    /**
     * A pointer is NULL where that is not allowed.
     */
    OSP_STATUS_NULL_POINTER = 2,
    /**
     * A pointer is not aligned for its type.
     */
    OSP_STATUS_MISALIGNED_POINTER = 3,
    /**
     * A count is larger than memory, or larger than allowed (OSP_MAX_OBJECTS, OSP_MAX_CAMERAS).
     */
    OSP_STATUS_TOO_MANY = 4,
    /**
     * A matrix contains NaN or an infinite number, or has no inverse.
     */
    OSP_STATUS_INVALID_CAMERA = 5,
    /**
     * A corner is not finite, a quad is not flat and convex, an index has no vertex, or the whole occluder has no
     * area.
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
     * Another thread is changing this culler, or is reading it while this call would change it.
     */
    OSP_STATUS_BUSY = 9,
    /**
     * An earlier call that changed this culler has failed inside osp. The culler can only be freed.
     */
    OSP_STATUS_POISONED = 10,
    /**
     * An error inside osp, which should be reported. It is also written to standard error.
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
 * The reason for which an object, or its occluder, is left out.
 */
enum OspRefusal
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The box contains NaN or an infinite number, or min > max. The object is left out until it gets another box.
     */
    OSP_REFUSAL_BOUNDS = 0,
    /**
     * There are OSP_MAX_OBJECTS keys already.
     */
    OSP_REFUSAL_KEY = 1,
    /**
     * All occluders together have too many polygons. The object has no occluder.
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
 * A culler of objects. Each object has a 64-bit key from the caller, and a box. Objects can be added, moved and
 * removed at any time.
 */
typedef struct OspCuller OspCuller;

/**
 * A camera or a light. osp_camera_f32 and osp_camera_f64 fill it in.
 */
typedef struct {
    /**
     * Matrix from world to clip space, in column-major order; x and y are from -w to w in view. The projection may be
     * perspective or parallel, on-axis or off-axis, mirrored, y up or down. Its near plane may be oblique, and it
     * needs no far plane. The numbers are taken as exact, even for an eye far from the origin.
     */
    double clip_from_world[16];
    /**
     * One of OspDepth. For a perspective projection, the near and the far end may be exchanged.
     */
    int32_t depth;
    /**
     * If this is not 0, objects behind occluders are left out. It has no effect for a parallel projection, an oblique
     * near plane or a sheared screen.
     */
    int32_t hide_by_occluders;
    /**
     * Layers that the camera sees, one bit each.
     */
    uint32_t layers;
} OspCamera;

/**
 * A box by its smallest and largest corner, x y z, in world space, metres. It may be flat, or a point.
 */
typedef struct {
    /**
     * Smallest corner, x y z; finite.
     */
    float min[3];
    /**
     * Largest corner, x y z; finite, and on no axis less than min.
     */
    float max[3];
} OspBox;

/**
 * Numbers of objects that a camera sees.
 */
typedef struct {
    /**
     * Number of objects to draw, which osp_culler_visible lists.
     */
    size_t visible;
    /**
     * Number of objects in view that occluders hide.
     */
    size_t hidden;
} OspSeen;

/**
 * An object or occluder that was left out, with the reason.
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
 * An object whose box a ray enters, or that is near a point.
 */
typedef struct {
    /**
     * The object's key.
     */
    uint64_t key;
    /**
     * For a ray, the place of the hit in lengths of the ray's direction from its origin. For a point, the distance in
     * metres. 0 from inside.
     */
    float t;
} OspHit;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Makes a camera from a matrix of sixteen numbers from world to clip space, in column-major order, and one of
 * OspDepth. The camera sees all layers and ignores occluders; set hide_by_occluders and layers to change that.
 */
OspStatus osp_camera_f32(const float *clip_from_world, int32_t depth, OspCamera *camera);

/**
 * The same as osp_camera_f32, with a matrix of 64-bit numbers: for an eye that is far from the origin.
 */
OspStatus osp_camera_f64(const double *clip_from_world, int32_t depth, OspCamera *camera);

/**
 * Computes the ray through a point of the screen. x and y are from -1 to 1 in the directions of the matrix. origin
 * gets x y z of the ray's point on the near plane. direction gets x y z of its direction, of length 1. Both are in
 * world space, metres.
 */
OspStatus osp_camera_ray(const OspCamera *camera, float x, float y, float *origin, float *direction);

/**
 * Returns the message of the last call on this thread that did not return OSP_STATUS_OK. It is empty if there was
 * none, and never NULL. It ends with a zero byte and is plain ASCII of at most OSP_MESSAGE_BYTES. The pointer is the
 * same for every call on one thread and is valid until the thread ends. The next failure on this thread writes its
 * message into the same place, so copy a message that you need later.
 */
const char *osp_last_error(void);

/**
 * Returns the version of the loaded library: major * 65536 + minor * 256 + patch. Compare it with OSP_VERSION, the
 * version of the header. While the major number is 0, the minor numbers must be equal.
 */
uint32_t osp_version(void);

/**
 * Makes a culler without objects. It needs no size of the world and no capacity. *culler is the handle, which must be
 * freed with osp_culler_free. It is NULL if the call fails.
 */
OspStatus osp_culler_new(OspCuller **culler);

/**
 * Frees a culler with all its objects. The handle may be NULL. No other call may use the handle at the same time or
 * afterwards.
 */
OspStatus osp_culler_free(OspCuller *culler);

/**
 * Inserts objects, or moves those that exist. Each has a key and a box: the tight box of all drawn parts of the
 * object. A box with NaN, an infinite number or min > max leaves its object out until it gets another box;
 * osp_culler_refused lists it. If a key is given twice, the last box counts. An object that moves loses its occluder,
 * unless the new box contains the old one. keys and boxes may be NULL if count is 0.
 */
OspStatus osp_culler_set(OspCuller *culler, const uint64_t *keys, const OspBox *boxes, size_t count);

/**
 * Removes objects, with their occluders and layers. Ignores keys without an object.
 */
OspStatus osp_culler_remove(OspCuller *culler, const uint64_t *keys, size_t count);

/**
 * Removes everything.
 */
OspStatus osp_culler_clear(OspCuller *culler);

/**
 * Puts objects on layers, one bit each. A camera sees an object if they have a layer in common. By default, objects
 * are on the first layer, with the mask 1. An object on no layer is invisible to all cameras.
 */
OspStatus osp_culler_set_layers(OspCuller *culler, const uint64_t *keys, const uint32_t *layers, size_t count);

/**
 * Gives an object a flat, convex quad that hides things behind it. It replaces the object's previous occluder. corners
 * has x y z of its four corners in order around it, in either direction; world space, metres.
 *
 * An occluder is opaque and hides the things behind it, seen from either side. It must be drawn itself, or lie inside
 * drawn things. It stays in place until the object moves or is removed. A key without a box may have an occluder: a
 * stand-in, which hides and is never listed. A few large occluders hide more in less time than many small ones.
 */
OspStatus osp_culler_set_occluder_quad(OspCuller *culler, uint64_t key, const float *corners);

/**
 * The same as osp_culler_set_occluder_quad, with the six sides of a box: for example a stand-in for a house.
 */
OspStatus osp_culler_set_occluder_box(OspCuller *culler, uint64_t key, const OspBox *bounds);

/**
 * The same as osp_culler_set_occluder_quad, with a mesh. vertices has x y z of vertex_count points. indices has three
 * numbers of vertices for each of triangle_count triangles. Triangles without area are left out.
 */
OspStatus osp_culler_set_occluder_mesh(OspCuller *culler,
                                       uint64_t key,
                                       const float *vertices,
                                       size_t vertex_count,
                                       const uint32_t *indices,
                                       size_t triangle_count);

/**
 * Removes an object's occluder. Nothing happens if there is none.
 */
OspStatus osp_culler_remove_occluder(OspCuller *culler, uint64_t key);

/**
 * Applies all changes, so that osp_culler_in_box, osp_culler_in_sphere, osp_culler_on_ray and osp_culler_nearest use
 * them. osp_culler_cull applies them, too.
 */
OspStatus osp_culler_commit(OspCuller *culler);

/**
 * Returns the number of objects in the culler with a valid box.
 */
OspStatus osp_culler_count(const OspCuller *culler, size_t *count);

/**
 * Returns the box that was last set for an object.
 */
OspStatus osp_culler_box(const OspCuller *culler, uint64_t key, OspBox *bounds);

/**
 * Finds the objects that each camera sees. An object counts if a part of it may be on the camera's screen and, for a
 * camera with hide_by_occluders, not behind the occluders. No visible object is left out. All cameras are culled in
 * one pass: two eyes, a camera and its lights, the sides of a cube. There may be at most OSP_MAX_CAMERAS. seen gets an
 * OspSeen for each camera; it may be NULL. osp_culler_visible then lists the keys.
 */
OspStatus osp_culler_cull(OspCuller *culler, const OspCamera *cameras, size_t camera_count, OspSeen *seen);

/**
 * Lists the objects that a camera of the last osp_culler_cull sees; cameras count from 0. keys gets the keys of the
 * objects to draw, each once, in no particular order. *count gets their number. Objects that were removed since then
 * are not included. An osp_culler_commit that applies changes discards the results of osp_culler_cull.
 */
OspStatus osp_culler_visible(const OspCuller *culler, size_t camera, uint64_t *keys, size_t room, size_t *count);

/**
 * Finds for each box whether it is completely off a camera's screen or, with hide_by_occluders, behind the occluders.
 * The boxes do not belong to a culler: they may be those of a sound, a character, a trigger. hidden gets 1 or 0 for
 * each. An empty or infinite box, or one with NaN, is not hidden. Applies all changes, like osp_culler_cull. Without
 * changes, the results of the last osp_culler_cull stay.
 */
OspStatus osp_culler_are_hidden(OspCuller *culler,
                                const OspCamera *camera,
                                const OspBox *boxes,
                                size_t count,
                                uint8_t *hidden);

/**
 * Lists the boxes and occluders that were refused between the last two calls of osp_culler_cull, and the reasons. A
 * very long list is cut off.
 */
OspStatus osp_culler_refused(const OspCuller *culler, OspRefused *refused, size_t room, size_t *count);

/**
 * Finds the objects whose boxes have a point in common with a box; touching counts. The result has the form of
 * osp_culler_visible.
 */
OspStatus osp_culler_in_box(const OspCuller *culler, const OspBox *bounds, uint64_t *keys, size_t room, size_t *count);

/**
 * Finds the objects whose boxes have a point in common with a ball: center is x y z, radius is in metres. The result
 * has the form of osp_culler_visible.
 */
OspStatus osp_culler_in_sphere(const OspCuller *culler,
                               const float *center,
                               float radius,
                               uint64_t *keys,
                               size_t room,
                               size_t *count);

/**
 * Finds the objects whose boxes a ray enters at t <= t_max, the nearest first. origin and direction are x y z. t
 * counts in lengths of the direction; t_max may be infinite. hits gets the first results, at most room of them. *count
 * gets the number of all results. room may be 1 if only the nearest box is needed. To pick an object by its mesh, test
 * the objects in this order until t is beyond the nearest hit.
 */
OspStatus osp_culler_on_ray(const OspCuller *culler,
                            const float *origin,
                            const float *direction,
                            float t_max,
                            OspHit *hits,
                            size_t room,
                            size_t *count);

/**
 * Finds the objects whose boxes are nearest to a point, x y z. hits gets these objects, at most room of them, the
 * nearest first. The t of a hit is the distance of the box, metres; 0 if the point is inside. *count gets the number
 * of hits.
 */
OspStatus osp_culler_nearest(const OspCuller *culler, const float *point, OspHit *hits, size_t room, size_t *count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* OSP_H */
