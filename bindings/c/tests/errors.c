/* Tests that every wrong argument returns its status and changes nothing. */
#include "test.h"

#include <math.h>
#include <string.h>

static const float AHEAD[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0.1f, 0};
static const OspBox GOOD = {{0, 0, -6}, {1, 1, -5}};

#define REFUSED(status, call)                                                                              \
    do {                                                                                                   \
        EXPECT((call) == OSP_STATUS_##status);                                                             \
        EXPECT(osp_last_error()[0] != 0);                                                                  \
    } while (0)

/* A pointer that is one byte off. */
#define BESIDE(type, pointer) ((type)(void *)((char *)(pointer) + 1))

static void errors_of_cameras(void) {
    float matrix[16], origin[3], direction[3];
    double doubles[16];
    OspCamera camera;
    float wrongs[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 48; i++) {
        memcpy(matrix, AHEAD, sizeof matrix);
        matrix[i % 16] = wrongs[i / 16];
        REFUSED(INVALID_CAMERA, osp_camera_f32(matrix, 0, &camera));
        for (int k = 0; k < 16; k++) {
            doubles[k] = matrix[k];
        }
        REFUSED(INVALID_CAMERA, osp_camera_f64(doubles, 0, &camera));
    }
    EXPECT(strstr(osp_last_error(), "column 3, row 3"));
    memset(matrix, 0, sizeof matrix);
    REFUSED(INVALID_CAMERA, osp_camera_f32(matrix, 1, &camera));
    int32_t depths[] = {-1, 3, INT32_MAX, INT32_MIN};
    for (int i = 0; i < 4; i++) {
        REFUSED(INVALID_ARGUMENT, osp_camera_f32(AHEAD, depths[i], &camera));
    }
    REFUSED(NULL_POINTER, osp_camera_f32(NULL, 0, &camera));
    REFUSED(NULL_POINTER, osp_camera_f32(AHEAD, 0, NULL));
    REFUSED(NULL_POINTER, osp_camera_f64(NULL, 0, &camera));
    REFUSED(NULL_POINTER, osp_camera_f64(doubles, 0, NULL));
    REFUSED(MISALIGNED_POINTER, osp_camera_f32(BESIDE(float *, matrix), 0, &camera));
    EXPECT_OK(osp_camera_f32(AHEAD, OSP_DEPTH_ONE_TO_ZERO, &camera));
    EXPECT(camera.layers == OSP_ALL_LAYERS && camera.hide_by_occluders == 0);
    REFUSED(NULL_POINTER, osp_camera_ray(NULL, 0, 0, origin, direction));
    REFUSED(NULL_POINTER, osp_camera_ray(&camera, 0, 0, NULL, direction));
    REFUSED(NULL_POINTER, osp_camera_ray(&camera, 0, 0, origin, NULL));
    EXPECT_OK(osp_camera_ray(&camera, 0, 0, origin, direction));
    EXPECT(fabsf(origin[2] + 0.1f) < 1e-6f && direction[2] == -1);
    camera.depth = 7;
    REFUSED(INVALID_ARGUMENT, osp_camera_ray(&camera, 0, 0, origin, direction));
}

static void errors_of_changes(OspCuller *culler) {
    OspBox boxes[3] = {GOOD, GOOD, GOOD}, bounds;
    uint64_t keys[4] = {5, 6, UINT64_MAX, 0};
    uint32_t layers[3] = {1, 1, 1};
    size_t count;
    REFUSED(NULL_POINTER, osp_culler_set(NULL, keys, boxes, 3));
    REFUSED(MISALIGNED_POINTER, osp_culler_set(BESIDE(OspCuller *, culler), keys, boxes, 3));
    REFUSED(NULL_POINTER, osp_culler_set(culler, NULL, boxes, 3));
    REFUSED(NULL_POINTER, osp_culler_set(culler, keys, NULL, 3));
    REFUSED(MISALIGNED_POINTER, osp_culler_set(culler, BESIDE(uint64_t *, keys), boxes, 3));
    REFUSED(MISALIGNED_POINTER, osp_culler_set(culler, keys, BESIDE(OspBox *, boxes), 2));
    /* Sums and products of counts that overflow. */
    size_t counts[] = {SIZE_MAX, SIZE_MAX / 2, SIZE_MAX / 24, SIZE_MAX / 24 + 1, SIZE_MAX / 8 + 1, (size_t)OSP_MAX_OBJECTS + 1};
    for (int i = 0; i < 6; i++) {
        REFUSED(TOO_MANY, osp_culler_set(culler, keys, boxes, counts[i]));
        REFUSED(TOO_MANY, osp_culler_remove(culler, keys, counts[i]));
        REFUSED(TOO_MANY, osp_culler_set_layers(culler, keys, layers, counts[i]));
    }
    REFUSED(NULL_POINTER, osp_culler_remove(culler, NULL, 1));
    REFUSED(NULL_POINTER, osp_culler_remove(NULL, keys, 1));
    REFUSED(NULL_POINTER, osp_culler_set_layers(culler, NULL, layers, 1));
    REFUSED(NULL_POINTER, osp_culler_set_layers(culler, keys, NULL, 1));
    REFUSED(NULL_POINTER, osp_culler_clear(NULL));
    REFUSED(NULL_POINTER, osp_culler_commit(NULL));
    REFUSED(NULL_POINTER, osp_culler_count(culler, NULL));
    EXPECT_OK(osp_culler_count(culler, &count));
    EXPECT(count == 0);
    EXPECT_OK(osp_culler_set(culler, NULL, NULL, 0));
    EXPECT_OK(osp_culler_remove(culler, NULL, 0));
    EXPECT_OK(osp_culler_set_layers(culler, NULL, NULL, 0));
    EXPECT_OK(osp_culler_set(culler, keys, boxes, 3));
    EXPECT_OK(osp_culler_count(culler, &count));
    EXPECT(count == 3);
    REFUSED(UNKNOWN_KEY, osp_culler_box(culler, 7, &bounds));
    REFUSED(NULL_POINTER, osp_culler_box(culler, 5, NULL));
    EXPECT_OK(osp_culler_remove(culler, &keys[3], 1));
    EXPECT_OK(osp_culler_remove_occluder(culler, 77));
    REFUSED(NULL_POINTER, osp_culler_remove_occluder(NULL, 77));
}

static void errors_of_occluders(OspCuller *culler) {
    const float square[12] = {-1, -1, -2, 1, -1, -2, 1, 1, -2, -1, 1, -2};
    float bad[12];
    float wrongs[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 36; i++) {
        memcpy(bad, square, sizeof bad);
        bad[i % 12] = wrongs[i / 12];
        REFUSED(INVALID_OCCLUDER, osp_culler_set_occluder_quad(culler, 5, bad));
    }
    EXPECT(strstr(osp_last_error(), "corner 3"));
    memcpy(bad, square, sizeof bad);
    bad[2] = -3;
    REFUSED(INVALID_OCCLUDER, osp_culler_set_occluder_quad(culler, 5, bad));
    REFUSED(NULL_POINTER, osp_culler_set_occluder_quad(culler, 5, NULL));
    REFUSED(NULL_POINTER, osp_culler_set_occluder_quad(NULL, 5, square));
    OspBox flat = {{0, 0, 0}, {0, 0, 1}}, turned = {{1, 1, 1}, {0, 2, 2}};
    REFUSED(INVALID_OCCLUDER, osp_culler_set_occluder_box(culler, 5, &flat));
    REFUSED(INVALID_OCCLUDER, osp_culler_set_occluder_box(culler, 5, &turned));
    REFUSED(NULL_POINTER, osp_culler_set_occluder_box(culler, 5, NULL));
    uint32_t indices[6] = {0, 1, 2, 0, 2, 4};
    REFUSED(INVALID_OCCLUDER, osp_culler_set_occluder_mesh(culler, 5, square, 4, indices, 2));
    EXPECT(strstr(osp_last_error(), "indices[5]: expected less than 4, found 4"));
    REFUSED(INVALID_OCCLUDER, osp_culler_set_occluder_mesh(culler, 5, square, 4, NULL, 0));
    REFUSED(NULL_POINTER, osp_culler_set_occluder_mesh(culler, 5, NULL, 4, indices, 1));
    REFUSED(NULL_POINTER, osp_culler_set_occluder_mesh(culler, 5, square, 4, NULL, 1));
    size_t counts[] = {SIZE_MAX, SIZE_MAX / 3, SIZE_MAX / 3 + 1, SIZE_MAX / 12, SIZE_MAX / 12 + 1};
    for (int i = 0; i < 5; i++) {
        REFUSED(TOO_MANY, osp_culler_set_occluder_mesh(culler, 5, square, counts[i], indices, 1));
        REFUSED(TOO_MANY, osp_culler_set_occluder_mesh(culler, 5, square, 4, indices, counts[i]));
    }
    indices[5] = 3;
    EXPECT_OK(osp_culler_set_occluder_mesh(culler, 5, square, 4, indices, 2));
    EXPECT_OK(osp_culler_remove_occluder(culler, 5));
}

static void errors_of_frames(OspCuller *culler) {
    OspCamera cameras[2];
    OspSeen seen[2];
    uint64_t keys[4] = {7, 7, 7, 7};
    size_t count = 7;
    EXPECT_OK(osp_camera_f32(AHEAD, OSP_DEPTH_ONE_TO_ZERO, &cameras[0]));
    cameras[1] = cameras[0];
    REFUSED(INVALID_ARGUMENT, osp_culler_visible(culler, 0, keys, 4, &count));
    EXPECT(count == 0);
    REFUSED(NULL_POINTER, osp_culler_cull(NULL, cameras, 1, seen));
    REFUSED(NULL_POINTER, osp_culler_cull(culler, NULL, 1, seen));
    REFUSED(MISALIGNED_POINTER, osp_culler_cull(culler, cameras, 1, BESIDE(OspSeen *, keys)));
    REFUSED(TOO_MANY, osp_culler_cull(culler, cameras, OSP_MAX_CAMERAS + 1, NULL));
    REFUSED(TOO_MANY, osp_culler_cull(culler, cameras, SIZE_MAX, NULL));
    cameras[1].clip_from_world[5] = NAN;
    REFUSED(INVALID_CAMERA, osp_culler_cull(culler, cameras, 2, seen));
    EXPECT(strstr(osp_last_error(), "cameras[1]"));
    cameras[1] = cameras[0];
    cameras[1].depth = -1;
    REFUSED(INVALID_ARGUMENT, osp_culler_cull(culler, cameras, 2, seen));
    cameras[1].depth = 0;
    EXPECT_OK(osp_culler_cull(culler, cameras, 2, NULL));
    EXPECT_OK(osp_culler_cull(culler, cameras, 2, seen));
    EXPECT(seen[0].visible == 3 && seen[1].visible == 3 && seen[1].hidden == 0);
    uint8_t hidden[2] = {7, 7};
    OspBox boxes[2] = {GOOD, GOOD};
    REFUSED(NULL_POINTER, osp_culler_are_hidden(NULL, cameras, boxes, 2, hidden));
    REFUSED(NULL_POINTER, osp_culler_are_hidden(culler, NULL, boxes, 2, hidden));
    REFUSED(NULL_POINTER, osp_culler_are_hidden(culler, cameras, NULL, 2, hidden));
    REFUSED(NULL_POINTER, osp_culler_are_hidden(culler, cameras, boxes, 2, NULL));
    REFUSED(TOO_MANY, osp_culler_are_hidden(culler, cameras, boxes, SIZE_MAX, hidden));
    EXPECT_OK(osp_culler_are_hidden(culler, cameras, NULL, 0, NULL));
    EXPECT(hidden[0] == 7);
    REFUSED(NULL_POINTER, osp_culler_visible(culler, 0, NULL, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_visible(culler, 0, keys, 4, NULL));
    REFUSED(MISALIGNED_POINTER, osp_culler_visible(culler, 0, BESIDE(uint64_t *, keys), 3, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_visible(culler, 2, keys, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_visible(culler, SIZE_MAX, keys, 4, &count));
    EXPECT(osp_culler_visible(culler, 1, NULL, 0, &count) == OSP_STATUS_BUFFER_TOO_SMALL && count == 3);
    /* Removed objects are not listed; after committed changes there is no camera. */
    uint64_t gone = 6;
    EXPECT_OK(osp_culler_remove(culler, &gone, 1));
    EXPECT_OK(osp_culler_visible(culler, 1, keys, 4, &count));
    EXPECT(count == 2 && keys[0] != 6 && keys[1] != 6);
    EXPECT_OK(osp_culler_commit(culler));
    REFUSED(INVALID_ARGUMENT, osp_culler_visible(culler, 0, keys, 4, &count));
    EXPECT_OK(osp_culler_cull(culler, NULL, 0, NULL));
}

static void errors_of_queries(OspCuller *culler) {
    const float zero[3] = {0, 0, 0}, along[3] = {0.1f, 0.1f, -1}, nowhere[3] = {0, NAN, 0};
    uint64_t keys[4];
    size_t count;
    OspHit hits[4];
    OspBox empty = {{1, 1, 1}, {0, 2, 2}};
    REFUSED(INVALID_ARGUMENT, osp_culler_in_box(culler, &empty, keys, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_in_box(culler, NULL, keys, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_in_sphere(culler, zero, -1, keys, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_in_sphere(culler, zero, NAN, keys, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_in_sphere(culler, nowhere, 1, keys, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_in_sphere(culler, NULL, 1, keys, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_on_ray(culler, nowhere, along, 1, hits, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_on_ray(culler, zero, nowhere, 1, hits, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_on_ray(culler, zero, zero, 1, hits, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_on_ray(culler, zero, along, NAN, hits, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_culler_on_ray(culler, zero, along, -1, hits, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_on_ray(culler, zero, along, 1, NULL, 4, &count));
    EXPECT_OK(osp_culler_on_ray(culler, zero, along, INFINITY, hits, 1, &count));
    EXPECT(count == 2 && fabsf(hits[0].t - 5) < 1e-4f);
    EXPECT_OK(osp_culler_on_ray(culler, zero, along, INFINITY, NULL, 0, &count));
    EXPECT(count == 2);
    REFUSED(INVALID_ARGUMENT, osp_culler_nearest(culler, nowhere, hits, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_nearest(culler, NULL, hits, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_nearest(culler, zero, NULL, 4, &count));
    EXPECT_OK(osp_culler_nearest(culler, zero, hits, 4, &count));
    EXPECT(count == 2 && hits[0].t == 5 && hits[1].t == 5 && hits[0].key != hits[1].key);
    EXPECT_OK(osp_culler_nearest(culler, zero, hits, 1, &count));
    EXPECT(count == 1);
    EXPECT_OK(osp_culler_nearest(culler, zero, NULL, 0, &count));
    EXPECT(count == 0);
}

/* An invalid box excludes its own object, but no other object. */
static void refusals(OspCuller *culler) {
    const float bad[] = {NAN, INFINITY, -INFINITY, 2};
    uint64_t keys[3] = {100, 101, 102};
    OspRefused refused[4];
    size_t count;
    REFUSED(NULL_POINTER, osp_culler_refused(culler, NULL, 4, &count));
    REFUSED(NULL_POINTER, osp_culler_refused(culler, refused, 4, NULL));
    for (int i = 0; i < 4; i++) {
        OspBox boxes[3] = {GOOD, GOOD, GOOD};
        boxes[1].min[i % 3] = bad[i];
        EXPECT_OK(osp_culler_clear(culler));
        EXPECT_OK(osp_culler_set(culler, keys, boxes, 3));
        EXPECT_OK(osp_culler_cull(culler, NULL, 0, NULL));
        EXPECT_OK(osp_culler_refused(culler, refused, 4, &count));
        EXPECT(count == 1 && refused[0].key == 101 && refused[0].why == OSP_REFUSAL_BOUNDS);
        EXPECT(osp_culler_refused(culler, NULL, 0, &count) == OSP_STATUS_BUFFER_TOO_SMALL && count == 1);
        EXPECT_OK(osp_culler_count(culler, &count));
        EXPECT(count == 2);
        EXPECT_OK(osp_culler_cull(culler, NULL, 0, NULL));
        EXPECT_OK(osp_culler_refused(culler, refused, 4, &count));
        EXPECT(count == 0);
    }
}

/* The pointer from osp_last_error before a call may be read after it: C does not define the order of printf's arguments. */
static void a_message_that_was_asked_for_before_the_call(void) {
    const char *message = osp_last_error();
    const char *words[] = {"culler", "clip_from_world"};
    OspCamera camera;
    for (int i = 0; i < 4; i++) {
        OspStatus status = i % 2 ? osp_camera_f32(NULL, 0, &camera) : osp_culler_new(NULL);
        EXPECT(status == OSP_STATUS_NULL_POINTER);
        EXPECT(message == osp_last_error());
        EXPECT(strncmp(message, words[i % 2], strlen(words[i % 2])) == 0);
    }
    /* A successful call leaves the message unchanged. */
    EXPECT_OK(osp_culler_free(NULL));
    EXPECT(message == osp_last_error() && strncmp(message, "clip", 4) == 0);
}

void run_errors(void) {
    OspCuller *culler = (OspCuller *)&culler;
    uint32_t words[4];
    a_message_that_was_asked_for_before_the_call();
    errors_of_cameras();
    REFUSED(MISALIGNED_POINTER, osp_culler_new(BESIDE(OspCuller **, words)));
    EXPECT_OK(osp_culler_new(&culler));
    REFUSED(MISALIGNED_POINTER, osp_culler_free(BESIDE(OspCuller *, culler)));
    errors_of_changes(culler);
    errors_of_occluders(culler);
    errors_of_frames(culler);
    errors_of_queries(culler);
    refusals(culler);
    EXPECT_OK(osp_culler_free(culler));
}
