/* osp: finds the objects that cameras see, while objects are added, moved and removed in every frame. cbindgen makes this file from
 * bindings/c/src: do not edit it.
 *
 * A frame: call osp_culler_set and osp_culler_remove for the changes, osp_culler_cull with the cameras, and osp_culler_visible for each.
 *
 * Status. A function returns OSP_STATUS_OK, or the reason why it has changed nothing; osp_last_error describes the reason. A fault
 * inside osp also returns a status. The program ends only if the system runs out of memory. If a list has room for fewer values than
 * were found, it gets the first values, the status is OSP_STATUS_BUFFER_TOO_SMALL, and *count is the number of all values.
 *
 * Lifetimes. A handle (OspCuller) lives from osp_culler_new to osp_culler_free. osp keeps no pointer from the caller after a call.
 * The only pointers that it returns are handles and messages. The caller chooses the keys: any 64 bits. Each thread has one message,
 * which lives as long as the thread; the next failure in the thread overwrites it.
 *
 * Some things cannot be checked, so the caller must guarantee them. A pointer that is not NULL points to as much memory as the
 * function requires, which no other thread writes during the call. A handle came from osp_culler_new and has not been freed. All
 * other errors return a status.
 *
 * Threads. Any thread may use any handle. Functions with a const handle may run at the same time with the same handle. A function
 * with a handle that is not const changes the culler. If it runs at the same time as another call with this handle, one of the two
 * calls returns OSP_STATUS_BUSY without effect. No call blocks. osp_culler_free must never run at the same time as another call.
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
 * The status that a function returns: OSP_STATUS_OK, or the reason why the function has changed nothing.
 * osp_last_error describes the reason.
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
     * There are more results than room. The list has the first results, and *count is the number of all results.
     */
    OSP_STATUS_BUFFER_TOO_SMALL = 1,
    /**
     * A pointer is NULL, but must not be NULL.
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
     * A fault inside osp, which should be reported. The message is also written to standard error.
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
     * 0 at the near plane, 1 at the far plane: Vulkan, Direct3D, Metal, WebGPU.
     */
    OSP_DEPTH_ZERO_TO_ONE = 0,
    /**
     * 1 at the near plane, 0 at the far plane or at infinity: reversed depth.
     */
    OSP_DEPTH_ONE_TO_ZERO = 1,
    /**
     * -1 at the near plane, 1 at the far plane: OpenGL, and Unity's Camera.projectionMatrix.
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
 * The reason why an object, or its occluder, was refused.
 */
enum OspRefusal
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The box contains NaN or an infinite number, or min > max. The object is skipped until it gets a valid box.
     */
    OSP_REFUSAL_BOUNDS = 0,
    /**
     * There are OSP_MAX_OBJECTS keys already.
     */
    OSP_REFUSAL_KEY = 1,
    /**
     * All occluders together would have too many polygons. The object gets no occluder.
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
     * needs no far plane. The numbers count as exact, even for an eye far from the origin.
     */
    double clip_from_world[16];
    /**
     * One of OspDepth. For a perspective projection, a wrong direction of depth has no effect.
     */
    int32_t depth;
    /**
     * If this is not 0, the results omit objects behind occluders. This has no effect for a parallel projection, an
     * oblique near plane or a sheared screen.
     */
    int32_t hide_by_occluders;
    /**
     * Mask of the layers that the camera sees, with a bit for each layer.
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
 * An object whose box or occluder was refused, with the reason.
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
     * For a ray, the distance from its origin to the box, in lengths of the ray's direction. For a point, the distance
     * from the box in metres. 0 if the origin or the point is inside.
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
 * Does the same as osp_camera_f32 for a matrix of 64-bit numbers. Use it for an eye far from the origin.
 */
OspStatus osp_camera_f64(const double *clip_from_world, int32_t depth, OspCamera *camera);

/**
 * Computes the ray through a point of the screen. x and y are from -1 to 1 in the directions of the matrix. origin
 * gets x y z of the ray's point on the near plane. direction gets x y z of its direction, of length 1. Both are in
 * world space, metres.
 */
OspStatus osp_camera_ray(const OspCamera *camera, float x, float y, float *origin, float *direction);

/**
 * Returns the message of the last call on this thread that did not return OSP_STATUS_OK. Without such a call it is
 * empty, and it is never NULL. It is plain ASCII, ends with a zero byte, and has at most OSP_MESSAGE_BYTES bytes.
 * Every call on one thread returns the same pointer, which is valid until the thread ends. The next failure on this
 * thread overwrites the message, so copy a message that you need later.
 */
const char *osp_last_error(void);

/**
 * Returns the version of the loaded library: major * 65536 + minor * 256 + patch. Compare it with OSP_VERSION, the
 * version of the header. While the major number is 0, the minor numbers must be equal.
 */
uint32_t osp_version(void);

/**
 * Makes a culler without objects. It needs no size of the world and no capacity. *culler gets the handle, or NULL if
 * the call fails. Free the handle with osp_culler_free.
 */
OspStatus osp_culler_new(OspCuller **culler);

/**
 * Frees a culler with all its objects. The handle may be NULL. No other call may use the handle at the same time or
 * afterwards.
 */
OspStatus osp_culler_free(OspCuller *culler);

/**
 * Inserts objects, or moves objects that exist: count keys, and a box for each key. A box should be tight around all
 * drawn parts of its object. A box with NaN, an infinite number or min > max is refused, and osp_culler_refused lists
 * it. Its object is skipped until it gets a valid box. If a key is given twice, the last box counts. An object that
 * moves loses its occluder, unless the new box contains the old one. keys and boxes may be NULL if count is 0.
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
 * Sets the layers of objects: for each key, a mask with a bit for each layer. A camera sees an object if both have a
 * layer in common. The default is the first layer, mask 1. An object on no layer is invisible to all cameras.
 */
OspStatus osp_culler_set_layers(OspCuller *culler, const uint64_t *keys, const uint32_t *layers, size_t count);

/**
 * Sets a flat, convex quad as the occluder of an object, in place of the former occluder. corners has x y z of its
 * four corners, in clockwise or counter-clockwise order; world space, metres.
 *
 * An occluder is opaque from both sides, and hides the objects behind it. The engine must draw the occluder itself, or
 * an opaque object around it. It stays in place until the object moves or is removed. A key without a box may have an
 * occluder. Such an occluder hides objects, and is never listed. A few large occluders hide more in less time than
 * many small ones.
 */
OspStatus osp_culler_set_occluder_quad(OspCuller *culler, uint64_t key, const float *corners);

/**
 * Does the same as osp_culler_set_occluder_quad with the six sides of a box, such as a box inside a house.
 */
OspStatus osp_culler_set_occluder_box(OspCuller *culler, uint64_t key, const OspBox *bounds);

/**
 * Does the same as osp_culler_set_occluder_quad with a mesh. vertices has x y z of vertex_count points. indices has
 * three vertex numbers for each of triangle_count triangles. Triangles without area are skipped.
 */
OspStatus osp_culler_set_occluder_mesh(OspCuller *culler,
                                       uint64_t key,
                                       const float *vertices,
                                       size_t vertex_count,
                                       const uint32_t *indices,
                                       size_t triangle_count);

/**
 * Removes an object's occluder. Has no effect if the object has no occluder.
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
 * Returns the last valid box of an object.
 */
OspStatus osp_culler_box(const OspCuller *culler, uint64_t key, OspBox *bounds);

/**
 * Finds the objects that each camera sees. An object counts if a part of it may be on the camera's screen and, for a
 * camera with hide_by_occluders, not behind the occluders. The result contains every visible object. The cameras may
 * be two eyes, a camera and its lights, or the faces of a cube map: at most OSP_MAX_CAMERAS. seen gets an OspSeen for
 * each camera; it may be NULL. Afterwards osp_culler_visible lists the keys.
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
 * The boxes need not belong to objects of the culler: they may surround sounds, characters or triggers. hidden gets 1
 * or 0 for each box. A box that is empty or infinite, or has a NaN, is not hidden. Applies all changes, as
 * osp_culler_cull does. Without changes, the results of the last osp_culler_cull stay valid.
 */
OspStatus osp_culler_are_hidden(OspCuller *culler,
                                const OspCamera *camera,
                                const OspBox *boxes,
                                size_t count,
                                uint8_t *hidden);

/**
 * Lists the boxes and occluders that were refused between the last two calls of osp_culler_cull, and the reasons. Only
 * the first 4096 are listed.
 */
OspStatus osp_culler_refused(const OspCuller *culler, OspRefused *refused, size_t room, size_t *count);

/**
 * Finds the objects whose boxes have a point in common with a box; touching counts. The result has the form of
 * osp_culler_visible.
 */
OspStatus osp_culler_in_box(const OspCuller *culler, const OspBox *bounds, uint64_t *keys, size_t room, size_t *count);

/**
 * Finds the objects whose boxes have a point in common with a sphere: center is x y z, radius is in metres. The result
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
