/* Wrong arguments: every one is answered by its status, and changes nothing. */
#include "test.h"

#include <math.h>
#include <string.h>

static const float IDENTITY[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

#define REFUSED(status, call)                                                                              \
    do {                                                                                                   \
        EXPECT((call) == OSP_STATUS_##status);                                                             \
        EXPECT(osp_last_error()[0] != 0);                                                                  \
    } while (0)

/* A pointer that is one byte beside where it should be. */
#define BESIDE(type, pointer) ((type)(void *)((char *)(pointer) + 1))

static void errors_of_index(void) {
    OspIndex *index = (OspIndex *)&index;
    const OspBox good = {{0, 0, 0}, {1, 1, 1}};
    OspBox bounds = good, boxes[3] = {good, good, good};
    uint32_t id = 7, ids[4] = {7, 7, 7, 7};
    size_t count = 7;
    OspHit hit;
    float numbers[32] = {0};

    REFUSED(NULL_POINTER, osp_index_new(NULL, NULL));
    REFUSED(MISALIGNED_POINTER, osp_index_new(NULL, BESIDE(OspIndex **, ids)));
    REFUSED(MISALIGNED_POINTER, osp_index_new(BESIDE(OspIndexConfig *, boxes), &index));
    EXPECT(index == NULL);
    OspIndexConfig configs[] = {{{0, 0, 0}, 0, 0},   {{0, 0, 0}, -1, 0},        {{0, 0, 0}, NAN, 0}, {{0, 0, 0}, INFINITY, 0},
                                {{NAN, 0, 0}, 1, 0}, {{0, INFINITY, 0}, 1, 0}, {{0, 0, 0}, 1, OSP_MAX_IDS + 1}, {{0, 0, 0}, 1, UINT32_MAX}};
    for (size_t i = 0; i < sizeof configs / sizeof *configs; i++) {
        index = (OspIndex *)&index;
        REFUSED(INVALID_ARGUMENT, osp_index_new(&configs[i], &index));
        EXPECT(index == NULL);
    }
    EXPECT_OK(osp_index_free(NULL));
    EXPECT_OK(osp_index_new(NULL, &index));
    REFUSED(MISALIGNED_POINTER, osp_index_free(BESIDE(OspIndex *, index)));

    /* Nothing of a list with one bad box is inserted. */
    float bad[] = {NAN, INFINITY, -INFINITY, 2};
    for (int i = 0; i < 4; i++) {
        boxes[1] = good;
        boxes[1].min[i % 3] = bad[i];
        REFUSED(INVALID_BOX, osp_index_insert(index, boxes, 3, ids));
        EXPECT(strstr(osp_last_error(), "box 1"));
        EXPECT_OK(osp_index_count(index, &count));
        EXPECT(count == 0 && ids[0] == 7 && ids[2] == 7);
    }
    boxes[1] = good;
    REFUSED(NULL_POINTER, osp_index_insert(NULL, boxes, 3, ids));
    REFUSED(MISALIGNED_POINTER, osp_index_insert(BESIDE(OspIndex *, index), boxes, 3, ids));
    REFUSED(NULL_POINTER, osp_index_insert(index, NULL, 3, ids));
    REFUSED(NULL_POINTER, osp_index_insert(index, boxes, 3, NULL));
    REFUSED(MISALIGNED_POINTER, osp_index_insert(index, BESIDE(OspBox *, boxes), 2, ids));
    REFUSED(MISALIGNED_POINTER, osp_index_insert(index, boxes, 3, BESIDE(uint32_t *, ids)));
    /* Sums and products of counts that overflow. */
    size_t counts[] = {SIZE_MAX, SIZE_MAX / 2, SIZE_MAX / 24, SIZE_MAX / 24 + 1, SIZE_MAX / 8 + 1, (size_t)OSP_MAX_IDS + 1};
    for (int i = 0; i < 6; i++) {
        REFUSED(TOO_MANY, osp_index_insert(index, boxes, counts[i], ids));
        REFUSED(TOO_MANY, osp_index_update(index, ids, boxes, counts[i]));
        if (i < 2) {
            REFUSED(TOO_MANY, osp_index_frustum(index, IDENTITY, 0, ids, counts[i], &count));
        }
    }
    EXPECT_OK(osp_index_insert(index, NULL, 0, NULL));
    EXPECT_OK(osp_index_update(index, NULL, NULL, 0));
    EXPECT_OK(osp_index_insert(index, boxes, 3, ids));

    /* Ids that nothing has. */
    uint32_t wrong[] = {3, 4, 100, OSP_MAX_IDS - 1, OSP_MAX_IDS, OSP_NO_ID};
    for (int i = 0; i < 6; i++) {
        uint32_t pair[2] = {ids[0], wrong[i]};
        boxes[0].max[0] = 9;
        REFUSED(UNKNOWN_ID, osp_index_remove(index, wrong[i]));
        REFUSED(UNKNOWN_ID, osp_index_update(index, pair, boxes, 2));
        REFUSED(UNKNOWN_ID, osp_index_box(index, wrong[i], &bounds));
        EXPECT_OK(osp_index_box(index, ids[0], &bounds));
        EXPECT(bounds.max[0] == 1);
    }
    boxes[1].max[1] = NAN;
    REFUSED(INVALID_BOX, osp_index_update(index, ids, boxes, 2));
    EXPECT_OK(osp_index_box(index, ids[0], &bounds));
    EXPECT(bounds.max[0] == 1);

    /* Questions before the commit. */
    REFUSED(NOT_COMMITTED, osp_index_frustum(index, IDENTITY, 0, ids, 4, &count));
    REFUSED(NOT_COMMITTED, osp_index_box_query(index, &good, ids, 4, &count));
    REFUSED(NOT_COMMITTED, osp_index_sphere_query(index, numbers, 1, ids, 4, &count));
    float along[3] = {1, 0, 0};
    REFUSED(NOT_COMMITTED, osp_index_ray(index, numbers, along, 1, 0, &hit));
    EXPECT_OK(osp_index_commit(index));

    /* Views. */
    float matrix[16];
    float wrongs[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 48; i++) {
        memcpy(matrix, IDENTITY, sizeof matrix);
        matrix[i % 16] = wrongs[i / 16];
        count = 7;
        REFUSED(INVALID_VIEW, osp_index_frustum(index, matrix, 0, ids, 4, &count));
        EXPECT(count == 0);
    }
    memset(matrix, 0, sizeof matrix);
    REFUSED(INVALID_VIEW, osp_index_frustum(index, matrix, 1, ids, 4, &count));
    int32_t depths[] = {-1, 2, INT32_MAX, INT32_MIN};
    for (int i = 0; i < 4; i++) {
        REFUSED(INVALID_ARGUMENT, osp_index_frustum(index, IDENTITY, depths[i], ids, 4, &count));
        REFUSED(INVALID_ARGUMENT, osp_index_ray(index, numbers, along, 1, depths[i], &hit));
    }
    REFUSED(NULL_POINTER, osp_index_frustum(index, NULL, 0, ids, 4, &count));
    REFUSED(NULL_POINTER, osp_index_frustum(index, IDENTITY, 0, NULL, 4, &count));
    REFUSED(NULL_POINTER, osp_index_frustum(index, IDENTITY, 0, ids, 4, NULL));
    REFUSED(MISALIGNED_POINTER, osp_index_frustum(index, BESIDE(const float *, numbers), 0, ids, 4, &count));
    REFUSED(MISALIGNED_POINTER, osp_index_frustum(index, IDENTITY, 0, BESIDE(uint32_t *, ids), 3, &count));
    REFUSED(MISALIGNED_POINTER, osp_index_frustum(index, IDENTITY, 0, ids, 4, BESIDE(size_t *, numbers)));
    EXPECT(osp_index_frustum(index, IDENTITY, 0, NULL, 0, &count) == OSP_STATUS_BUFFER_TOO_SMALL && count == 3);
    REFUSED(NULL_POINTER, osp_index_frustum_of_planes(index, NULL, ids, 4, &count));
    numbers[23] = NAN;
    REFUSED(INVALID_VIEW, osp_index_frustum_of_planes(index, numbers, ids, 4, &count));
    numbers[23] = 0;
    /* Planes without a normal have everything inside. */
    EXPECT_OK(osp_index_frustum_of_planes(index, numbers, ids, 4, &count));
    EXPECT(count == 3);

    /* Boxes, balls and rays. */
    OspBox empty = {{1, 1, 1}, {0, 2, 2}};
    REFUSED(INVALID_BOX, osp_index_box_query(index, &empty, ids, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_index_sphere_query(index, numbers, -1, ids, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_index_sphere_query(index, numbers, NAN, ids, 4, &count));
    float nowhere[3] = {0, NAN, 0};
    REFUSED(INVALID_ARGUMENT, osp_index_sphere_query(index, nowhere, 1, ids, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_index_ray(index, nowhere, along, 1, 0, &hit));
    REFUSED(INVALID_ARGUMENT, osp_index_ray(index, numbers, nowhere, 1, 0, &hit));
    REFUSED(INVALID_ARGUMENT, osp_index_ray(index, numbers, numbers, 1, 0, &hit));
    REFUSED(INVALID_ARGUMENT, osp_index_ray(index, numbers, along, NAN, 0, &hit));
    REFUSED(INVALID_ARGUMENT, osp_index_ray(index, numbers, along, -1, 0, &hit));
    REFUSED(NULL_POINTER, osp_index_ray(index, numbers, along, 1, 0, NULL));
    EXPECT_OK(osp_index_ray(index, numbers, along, INFINITY, 0, &hit));
    EXPECT(hit.id != OSP_NO_ID && hit.t == 0);

    /* The answer may lie where the question lay. */
    union {
        float matrix[16];
        uint32_t ids[16];
    } both;
    memcpy(both.matrix, IDENTITY, sizeof both.matrix);
    EXPECT_OK(osp_index_frustum(index, both.matrix, 0, both.ids, 16, &count));
    EXPECT(count == 3 && both.ids[0] == 0 && both.ids[2] == 2);

    /* A number that was given up is given again; all at once, and nothing is left. */
    EXPECT_OK(osp_index_remove(index, 1));
    REFUSED(UNKNOWN_ID, osp_index_remove(index, 1));
    EXPECT_OK(osp_index_insert(index, &good, 1, &id));
    EXPECT(id == 1);
    size_t bytes;
    EXPECT_OK(osp_index_memory(index, &bytes));
    EXPECT(bytes > 0);
    REFUSED(NOT_COMMITTED, osp_index_box_query(index, &good, ids, 4, &count));
    EXPECT_OK(osp_index_commit(index));
    EXPECT_OK(osp_index_update(index, &id, &good, 1));
    REFUSED(NOT_COMMITTED, osp_index_box_query(index, &good, ids, 4, &count));
    EXPECT_OK(osp_index_commit(index));
    EXPECT_OK(osp_index_box_query(index, &good, ids, 4, &count));
    EXPECT(count == 3);
    EXPECT_OK(osp_index_remove(index, 0));
    REFUSED(NOT_COMMITTED, osp_index_box_query(index, &good, ids, 4, &count));
    EXPECT_OK(osp_index_commit(index));
    EXPECT_OK(osp_index_clear(index));
    REFUSED(NOT_COMMITTED, osp_index_box_query(index, &good, ids, 4, &count));
    EXPECT_OK(osp_index_commit(index));
    EXPECT_OK(osp_index_frustum(index, IDENTITY, 0, NULL, 0, &count));
    EXPECT(count == 0);
    REFUSED(UNKNOWN_ID, osp_index_remove(index, 1));
    EXPECT_OK(osp_index_free(index));
}

static void errors_of_scene(void) {
    OspScene *scene = NULL;
    OspFrame frame;
    const OspBox good = {{-1, -1, -6}, {1, 1, -5}};
    const float corners[9] = {-1, -1, -3, 1, -1, -3, 0, 1, -3};
    const float perspective[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.001001f, -1, 0, 0, -0.1001001f, 0};
    uint32_t ids[4], box, triangle;
    size_t count;
    OspHit hit;
    OspSceneConfig config = {{{0, 0, 0}, 8, 16}, OSP_OCCLUSION_MSVBSP, 1000};

    REFUSED(NULL_POINTER, osp_scene_new(&config, NULL));
    int32_t methods[] = {-1, 5, INT32_MAX, INT32_MIN};
    for (int i = 0; i < 4; i++) {
        config.occlusion = methods[i];
        REFUSED(INVALID_ARGUMENT, osp_scene_new(&config, &scene));
    }
    config.occlusion = OSP_OCCLUSION_MSVBSP;
    float costs[] = {0, -1, NAN, INFINITY};
    for (int i = 0; i < 4; i++) {
        config.draw_ns = costs[i];
        REFUSED(INVALID_ARGUMENT, osp_scene_new(&config, &scene));
    }
    config.draw_ns = 1000;
    config.index.root_size = NAN;
    REFUSED(INVALID_ARGUMENT, osp_scene_new(&config, &scene));
    EXPECT(scene == NULL);
    EXPECT_OK(osp_scene_new(NULL, &scene));
    EXPECT_OK(osp_scene_free(scene));
    EXPECT_OK(osp_scene_free(NULL));
    config.index.root_size = 8;
    EXPECT_OK(osp_scene_new(&config, &scene));

    REFUSED(INVALID_ARGUMENT, osp_scene_visible(scene, 0, ids, 4, &count));
    REFUSED(NOT_COMMITTED, osp_scene_frustum(scene, perspective, 0, ids, 4, &count));
    EXPECT_OK(osp_scene_insert_boxes(scene, &good, 1, &box));
    EXPECT_OK(osp_scene_insert_triangles(scene, corners, 3, NULL, 1, 1, &triangle));
    EXPECT_OK(osp_scene_insert_boxes(scene, NULL, 0, NULL));
    EXPECT_OK(osp_scene_insert_triangles(scene, NULL, 0, NULL, 0, 1, NULL));
    REFUSED(NOT_COMMITTED, osp_scene_ray(scene, corners, corners, 1, 0, &hit));

    /* Triangles. */
    uint32_t indices[3] = {0, 1, 3};
    float bad[9];
    REFUSED(INVALID_TRIANGLE, osp_scene_insert_triangles(scene, corners, 3, indices, 1, 1, ids));
    EXPECT(strstr(osp_last_error(), "found 3"));
    indices[2] = UINT32_MAX;
    REFUSED(INVALID_TRIANGLE, osp_scene_insert_triangles(scene, corners, 3, indices, 1, 1, ids));
    REFUSED(INVALID_TRIANGLE, osp_scene_insert_triangles(scene, corners, 3, NULL, 2, 1, ids));
    REFUSED(INVALID_TRIANGLE, osp_scene_insert_triangles(scene, NULL, 0, NULL, 1, 1, ids));
    REFUSED(NULL_POINTER, osp_scene_insert_triangles(scene, NULL, 3, NULL, 1, 1, ids));
    REFUSED(NULL_POINTER, osp_scene_insert_triangles(scene, corners, 3, NULL, 1, 1, NULL));
    REFUSED(MISALIGNED_POINTER, osp_scene_insert_triangles(scene, corners, 3, BESIDE(uint32_t *, ids), 1, 1, ids));
    size_t counts[] = {SIZE_MAX, SIZE_MAX / 3, SIZE_MAX / 3 + 1, SIZE_MAX / 12, SIZE_MAX / 12 + 1, SIZE_MAX / 36 + 1};
    for (int i = 0; i < 6; i++) {
        REFUSED(TOO_MANY, osp_scene_insert_triangles(scene, corners, counts[i], NULL, 1, 1, ids));
        REFUSED(TOO_MANY, osp_scene_insert_triangles(scene, corners, 3, NULL, counts[i], 1, ids));
        REFUSED(TOO_MANY, osp_scene_insert_triangles(scene, corners, 3, indices, counts[i], 1, ids));
        REFUSED(TOO_MANY, osp_scene_insert_boxes(scene, &good, counts[i], ids));
    }
    float wrongs[] = {NAN, INFINITY, 1.1e15f};
    for (int i = 0; i < 27; i++) {
        memcpy(bad, corners, sizeof bad);
        bad[i % 9] = wrongs[i / 9];
        REFUSED(INVALID_TRIANGLE, osp_scene_insert_triangles(scene, bad, 3, NULL, 1, 1, ids));
        REFUSED(INVALID_TRIANGLE, osp_scene_update_triangle(scene, triangle, bad));
    }
    OspBox far_away = {{0, 0, 0}, {1, 1, 2e15f}};
    REFUSED(INVALID_BOX, osp_scene_insert_boxes(scene, &far_away, 1, ids));
    REFUSED(INVALID_BOX, osp_scene_update_box(scene, box, &far_away));
    /* Ids of the other kind, or of nothing. */
    REFUSED(UNKNOWN_ID, osp_scene_update_box(scene, triangle, &good));
    REFUSED(UNKNOWN_ID, osp_scene_update_triangle(scene, box, corners));
    REFUSED(UNKNOWN_ID, osp_scene_update_triangle(scene, 2, corners));
    REFUSED(UNKNOWN_ID, osp_scene_remove(scene, OSP_NO_ID));
    EXPECT_OK(osp_scene_count(scene, &count));
    EXPECT(count == 2);

    /* Views. */
    EXPECT_OK(osp_scene_commit(scene));
    REFUSED(INVALID_ARGUMENT, osp_scene_visible(scene, 0, ids, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_scene_frame(scene, perspective, 0, 0, &frame));
    REFUSED(INVALID_ARGUMENT, osp_scene_frame(scene, perspective, OSP_MAX_VIEWS + 1, 0, &frame));
    REFUSED(INVALID_ARGUMENT, osp_scene_frame(scene, perspective, SIZE_MAX, 0, &frame));
    REFUSED(INVALID_ARGUMENT, osp_scene_frame(scene, perspective, 1, 2, &frame));
    REFUSED(INVALID_VIEW, osp_scene_frame(scene, IDENTITY, 1, 0, &frame));
    REFUSED(NULL_POINTER, osp_scene_frame(scene, NULL, 1, 0, &frame));
    REFUSED(MISALIGNED_POINTER, osp_scene_frame(scene, perspective, 1, 0, BESIDE(OspFrame *, bad)));
    EXPECT_OK(osp_scene_frame(scene, perspective, 1, 0, &frame));
    EXPECT(frame.count == 2 && frame.in_view == 2);
    EXPECT(osp_scene_visible(scene, 0, NULL, 0, &count) == OSP_STATUS_BUFFER_TOO_SMALL && count == frame.visible);
    REFUSED(INVALID_ARGUMENT, osp_scene_visible(scene, 1, ids, 4, &count));
    REFUSED(INVALID_ARGUMENT, osp_scene_visible(scene, UINT32_MAX, ids, 4, &count));
    EXPECT_OK(osp_scene_remove(scene, box));
    REFUSED(NOT_COMMITTED, osp_scene_box_query(scene, &good, ids, 4, &count));
    EXPECT_OK(osp_scene_commit(scene));
    EXPECT_OK(osp_scene_box_query(scene, &good, ids, 4, &count));
    EXPECT(count == 0);
    EXPECT_OK(osp_scene_free(scene));
}

/* What the header says of OspIndexConfig.capacity. */
static void memory_for_a_million(void) {
    OspSceneConfig config = {{{0, 0, 0}, 100, 1000000}, OSP_OCCLUSION_NONE, 10};
    OspIndex *index;
    OspScene *scene;
    size_t empty, bytes;
    EXPECT_OK(osp_index_new(NULL, &index));
    EXPECT_OK(osp_index_memory(index, &empty));
    EXPECT(empty > 1000000 && empty < 2000000);
    EXPECT_OK(osp_index_free(index));
    EXPECT_OK(osp_index_new(&config.index, &index));
    EXPECT_OK(osp_index_memory(index, &bytes));
    EXPECT(bytes > 65000000 && bytes < 75000000);
    EXPECT_OK(osp_index_free(index));
    EXPECT_OK(osp_scene_new(&config, &scene));
    EXPECT_OK(osp_scene_memory(scene, &bytes));
    EXPECT(bytes > 95000000 && bytes < 115000000);
    EXPECT_OK(osp_scene_free(scene));
}

/* What osp_last_error gave before a call may be read after it: C does not say which argument of printf is computed first. */
static void a_message_that_was_asked_for_before_the_call(void) {
    const char *message = osp_last_error();
    const char *words[] = {"scene", "index"};
    for (int i = 0; i < 4; i++) {
        OspStatus status = i % 2 ? osp_index_remove(NULL, 0) : osp_scene_new(NULL, NULL);
        EXPECT(status == OSP_STATUS_NULL_POINTER);
        EXPECT(message == osp_last_error());
        EXPECT(strncmp(message, words[i % 2], strlen(words[i % 2])) == 0);
    }
    /* What is in order leaves it as it is. */
    EXPECT_OK(osp_index_free(NULL));
    EXPECT(message == osp_last_error() && strncmp(message, "index", 5) == 0);
}

void run_errors(void) {
    memory_for_a_million();
    a_message_that_was_asked_for_before_the_call();
    errors_of_index();
    errors_of_scene();
}
