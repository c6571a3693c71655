/* Random calls: whatever the numbers are, each call is answered, books add up, and there is no fault inside. */
#include "test.h"

#include <math.h>
#include <string.h>

enum { MOST = 300 };

static uint64_t state = 2026;

/* SplitMix64 (Steele, Lea, Flood, 2014). */
static uint64_t next(void) {
    uint64_t z = (state += 0x9E3779B97F4A7C15u);
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

static uint32_t below(uint32_t n) {
    return (uint32_t)(next() % n);
}

static float number(void) {
    static const float odd[] = {NAN, INFINITY, -INFINITY, 3.4e38f, -3.4e38f, 1e-45f, -1e-38f, 1e15f, -1e15f, 1e19f, -0.0f, 1e-20f};
    uint32_t kind = below(400);
    float plain = (float)(int32_t)(below(2001) - 1000) * 0.01f;
    if (kind < 2) {
        return odd[below(12)];
    }
    if (kind < 6) {
        return plain * 1e13f;
    }
    return kind < 60 ? roundf(plain) : plain;
}

static void numbers(float *to, int count) {
    for (int i = 0; i < count; i++) {
        to[i] = number();
    }
}

static OspBox any_box(void) {
    float a[3], b[3];
    OspBox bounds;
    numbers(a, 3);
    numbers(b, 3);
    for (int i = 0; i < 3; i++) {
        bounds.min[i] = below(50) ? fminf(a[i], b[i]) : a[i];
        bounds.max[i] = below(50) ? fmaxf(a[i], b[i]) : b[i];
    }
    return bounds;
}

static void any_matrix(float *matrix) {
    if (below(8) == 0) {
        numbers(matrix, 16);
        return;
    }
    float near = 0.05f, far = 50, x = (float)(1 + below(8)) * 0.5f, slope = far / (near - far);
    float perspective[16] = {x, 0, 0, 0, 0, 1, 0, 0, 0, 0, slope, -1, 0, 0, near * slope, 0};
    float turn = (float)below(628) * 0.01f, c = cosf(turn), s = sinf(turn), eye[3];
    numbers(eye, 3);
    float view[16] = {c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, eye[0], eye[1], eye[2], 1};
    for (int column = 0; column < 4; column++) {
        for (int row = 0; row < 4; row++) {
            float sum = 0;
            for (int i = 0; i < 4; i++) {
                sum += perspective[4 * i + row] * view[4 * column + i];
            }
            matrix[4 * column + row] = sum;
        }
    }
}

/* How often each status was answered. */
static unsigned answered[OSP_STATUS_NOT_COMMITTED + 1];

static OspStatus sane(OspStatus status) {
    EXPECT(status >= OSP_STATUS_OK && status <= OSP_STATUS_NOT_COMMITTED);
    answered[status]++;
    return status;
}

/* Ids that are in use. */
static uint32_t used[MOST];
static size_t in_use;

static uint32_t any_id(void) {
    return in_use && below(20) ? used[below((uint32_t)in_use)] : below(2 * MOST);
}

static void forget(uint32_t id, OspStatus status) {
    int found = 0;
    for (size_t i = 0; i < in_use; i++) {
        if (used[i] == id) {
            used[i] = used[--in_use];
            found = 1;
            break;
        }
    }
    EXPECT(found == (status == OSP_STATUS_OK));
}

static void check_answer(const uint32_t *ids, size_t count, OspStatus status) {
    EXPECT(count <= in_use);
    for (size_t i = 0; status == OSP_STATUS_OK && i < count; i++) {
        int is_used = 0;
        for (size_t k = 0; k < in_use; k++) {
            is_used |= used[k] == ids[i];
        }
        EXPECT(is_used && (i == 0 || ids[i - 1] < ids[i]));
    }
}

static void call_index(OspIndex *index) {
    OspBox boxes[8];
    uint32_t ids[MOST];
    float floats[24];
    size_t count = 0, room = below(3) ? MOST : below(10), some = below(8);
    OspHit hit;
    OspStatus status;
    for (size_t i = 0; i < 8; i++) {
        boxes[i] = any_box();
        ids[i] = any_id();
    }
    numbers(floats, 24);
    switch (below(10)) {
    case 0:
    case 1:
        if (in_use + some <= MOST && sane(osp_index_insert(index, boxes, some, ids)) == OSP_STATUS_OK) {
            memcpy(used + in_use, ids, some * sizeof *ids);
            in_use += some;
        }
        break;
    case 2:
        sane(osp_index_update(index, ids, boxes, some));
        break;
    case 3:
        forget(ids[0], sane(osp_index_remove(index, ids[0])));
        break;
    case 4:
        any_matrix(floats);
        status = sane(osp_index_frustum(index, floats, (int32_t)below(3), ids, room, &count));
        check_answer(ids, count, status);
        break;
    case 5:
        status = sane(osp_index_frustum_of_planes(index, floats, ids, room, &count));
        check_answer(ids, count, status);
        break;
    case 6:
        status = sane(osp_index_box_query(index, boxes, ids, room, &count));
        check_answer(ids, count, status);
        break;
    case 7:
        status = sane(osp_index_sphere_query(index, floats, floats[3], ids, room, &count));
        check_answer(ids, count, status);
        break;
    case 8:
        sane(osp_index_ray(index, floats, floats + 3, fabsf(floats[6]), (int32_t)below(3), &hit));
        break;
    default:
        EXPECT_OK(osp_index_commit(index));
        EXPECT_OK(osp_index_count(index, &count));
        EXPECT(count == in_use);
    }
}

static void call_scene(OspScene *scene) {
    OspBox bounds = any_box();
    uint32_t id = any_id(), ids[MOST], indices[9];
    float floats[36];
    size_t count = 0, room = below(3) ? MOST : below(10);
    OspFrame frame;
    OspHit hit;
    OspStatus status;
    numbers(floats, 36);
    for (int i = 0; i < 9; i++) {
        indices[i] = below(40) ? below(12) : below(14);
    }
    switch (below(11)) {
    case 0:
    case 1:
        if (in_use < MOST && sane(osp_scene_insert_boxes(scene, &bounds, 1, ids)) == OSP_STATUS_OK) {
            used[in_use++] = ids[0];
        }
        break;
    case 2:
    case 3:
        if (in_use + 3 <= MOST
            && sane(osp_scene_insert_triangles(scene, floats, 12, below(2) ? indices : NULL, 3, (int32_t)below(2), ids))
                   == OSP_STATUS_OK) {
            memcpy(used + in_use, ids, 3 * sizeof *ids);
            in_use += 3;
        }
        break;
    case 4:
        sane(osp_scene_update_box(scene, id, &bounds));
        sane(osp_scene_update_triangle(scene, id, floats));
        break;
    case 5:
        forget(id, sane(osp_scene_remove(scene, id)));
        break;
    case 6:
        any_matrix(floats);
        status = sane(osp_scene_frustum(scene, floats, (int32_t)below(3), ids, room, &count));
        check_answer(ids, count, status);
        break;
    case 7:
        status = sane(osp_scene_box_query(scene, &bounds, ids, room, &count));
        check_answer(ids, count, status);
        break;
    case 8:
        sane(osp_scene_ray(scene, floats, floats + 3, fabsf(floats[6]), (int32_t)below(3), &hit));
        break;
    case 9:
        EXPECT_OK(osp_scene_commit(scene));
        EXPECT_OK(osp_scene_count(scene, &count));
        EXPECT(count == in_use);
        break;
    default:
        any_matrix(floats);
        any_matrix(floats + 16);
        if (sane(osp_scene_frame(scene, floats, 1 + below(2), (int32_t)below(2), &frame)) == OSP_STATUS_OK) {
            EXPECT(frame.count == in_use && frame.visible <= frame.in_view && frame.in_view <= 2 * in_use);
            status = sane(osp_scene_visible(scene, 0, ids, room, &count));
            check_answer(ids, count, status);
        }
    }
}

void run_fuzz(unsigned calls) {
    for (int life = 0; life < 10; life++) {
        OspIndex *index;
        OspScene *scene;
        OspIndexConfig config = {{0, 0, 0}, life % 2 ? 1e-3f : 20, below(1000)};
        in_use = 0;
        EXPECT_OK(osp_index_new(&config, &index));
        for (unsigned i = 0; i < calls / 20; i++) {
            call_index(index);
        }
        EXPECT_OK(osp_index_free(index));
        OspSceneConfig of_scene = {config, life % 5, life % 2 ? 10.0f : 10000.0f};
        in_use = 0;
        EXPECT_OK(osp_scene_new(&of_scene, &scene));
        for (unsigned i = 0; i < calls / 20; i++) {
            call_scene(scene);
        }
        EXPECT_OK(osp_scene_free(scene));
    }
    /* No kind of answer is left out; pointers and counts are wrong in errors.c only. */
    for (int status = OSP_STATUS_OK; status <= OSP_STATUS_NOT_COMMITTED; status++) {
        int is_of_pointers = status >= OSP_STATUS_NULL_POINTER && status <= OSP_STATUS_TOO_MANY;
        EXPECT(is_of_pointers ? answered[status] == 0 : answered[status] > calls / 1000);
    }
    EXPECT(answered[OSP_STATUS_OK] > calls / 3);
}
