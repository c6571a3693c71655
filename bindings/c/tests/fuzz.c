/* Random calls: with any numbers, each call returns a status, the counts agree, and there is no internal error. */
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

/* Number of calls that returned each status. */
static unsigned answered[OSP_STATUS_UNKNOWN_KEY + 1];

static OspStatus sane(OspStatus status) {
    EXPECT(status >= OSP_STATUS_OK && status <= OSP_STATUS_UNKNOWN_KEY);
    answered[status]++;
    return status;
}

/* The keys of objects with a box. */
static uint64_t used[MOST];
static size_t in_use;

/* Half of the keys are large. */
static uint64_t any_key(void) {
    uint64_t number = below(MOST);
    return number % 2 ? number * 0x9E3779B97F4A7C15u : number;
}

static size_t place_of(uint64_t key) {
    size_t at = 0;
    while (at < in_use && used[at] != key) {
        at++;
    }
    return at;
}

static int is_valid(const OspBox *bounds) {
    for (int i = 0; i < 3; i++) {
        if (!isfinite(bounds->min[i]) || !isfinite(bounds->max[i]) || bounds->min[i] > bounds->max[i]) {
            return 0;
        }
    }
    return 1;
}

static void follow(uint64_t key, int is_there) {
    size_t at = place_of(key);
    if (is_there && at == in_use) {
        used[in_use++] = key;
    } else if (!is_there && at < in_use) {
        used[at] = used[--in_use];
    }
}

static void check_answer(const uint64_t *keys, size_t count, size_t room) {
    EXPECT(count <= in_use);
    for (size_t i = 0; i < count && i < room; i++) {
        EXPECT(place_of(keys[i]) < in_use);
        for (size_t k = 0; k < i; k++) {
            EXPECT(keys[k] != keys[i]);
        }
    }
}

static void frame(OspCuller *culler, uint64_t *keys, size_t room) {
    OspCamera cameras[3];
    OspSeen seen[3];
    OspRefused refused[MOST];
    size_t views = below(4), count;
    for (size_t i = 0; i < 3; i++) {
        float matrix[16];
        any_matrix(matrix);
        if (sane(osp_camera_f32(matrix, (int32_t)below(60) % 4, &cameras[i])) != OSP_STATUS_OK) {
            return;
        }
        cameras[i].hide_by_occluders = (int32_t)below(2);
        cameras[i].layers = below(4) ? OSP_ALL_LAYERS : below(8);
    }
    EXPECT_OK(osp_culler_cull(culler, cameras, views, below(2) ? seen : NULL));
    EXPECT_OK(osp_culler_cull(culler, cameras, views, seen));
    for (size_t i = 0; i < 3; i++) {
        OspStatus status = sane(osp_culler_visible(culler, i, keys, room, &count));
        EXPECT((status == OSP_STATUS_INVALID_ARGUMENT) == (i >= views));
        EXPECT(i >= views || (count == seen[i].visible && count + seen[i].hidden <= in_use));
        check_answer(keys, count, room);
    }
    EXPECT_OK(osp_culler_refused(culler, refused, MOST, &count));
    EXPECT(count == 0);
    OspBox boxes[8];
    uint8_t hidden[8];
    for (int i = 0; i < 8; i++) {
        boxes[i] = any_box();
    }
    EXPECT_OK(osp_culler_are_hidden(culler, cameras, boxes, 8, hidden));
    for (int i = 0; i < 8; i++) {
        EXPECT(hidden[i] == 0 || (hidden[i] == 1 && is_valid(&boxes[i])));
    }
}

static void call(OspCuller *culler) {
    OspBox boxes[8];
    OspHit hits[8];
    uint64_t keys[MOST];
    uint32_t words[9];
    float floats[36];
    size_t count = 0, room = below(3) ? MOST : below(10), some = below(8);
    for (size_t i = 0; i < 8; i++) {
        boxes[i] = any_box();
        keys[i] = any_key();
    }
    for (size_t i = 0; i < 9; i++) {
        words[i] = below(40) ? below(12) : below(14);
    }
    numbers(floats, 36);
    switch (below(12)) {
    case 0:
    case 1:
    case 2:
        EXPECT_OK(osp_culler_set(culler, keys, boxes, some));
        for (size_t i = 0; i < some; i++) {
            follow(keys[i], is_valid(&boxes[i]));
        }
        break;
    case 3:
        EXPECT_OK(osp_culler_remove(culler, keys, some));
        for (size_t i = 0; i < some; i++) {
            follow(keys[i], 0);
        }
        break;
    case 4:
        EXPECT_OK(osp_culler_set_layers(culler, keys, words, some));
        break;
    case 5:
        /* This is rarely flat by chance. */
        for (int i = 0; i < 4 && below(8); i++) {
            floats[3 * i] = i % 3 ? 4.0f : -4.0f;
            floats[3 * i + 1] = i > 1 ? 4.0f : -4.0f;
            floats[3 * i + 2] = floats[12];
        }
        sane(osp_culler_set_occluder_quad(culler, keys[0], floats));
        sane(osp_culler_set_occluder_box(culler, keys[1], boxes));
        break;
    case 6:
        sane(osp_culler_set_occluder_mesh(culler, keys[0], floats, 12, words, 3));
        EXPECT_OK(osp_culler_remove_occluder(culler, keys[1]));
        break;
    case 7:
        sane(osp_culler_in_box(culler, boxes, keys, room, &count));
        check_answer(keys, count, room);
        break;
    case 8:
        sane(osp_culler_in_sphere(culler, floats, floats[3], keys, room, &count));
        check_answer(keys, count, room);
        break;
    case 9:
        if (sane(osp_culler_on_ray(culler, floats, floats + 3, fabsf(floats[6]), hits, some, &count)) == OSP_STATUS_OK) {
            for (size_t i = 1; i < count && i < some; i++) {
                EXPECT(hits[i - 1].t <= hits[i].t && place_of(hits[i].key) < in_use);
            }
        }
        if (sane(osp_culler_nearest(culler, floats, hits, some, &count)) == OSP_STATUS_OK) {
            EXPECT(count <= some && count <= in_use);
            for (size_t i = 1; i < count; i++) {
                EXPECT(hits[i - 1].t <= hits[i].t && place_of(hits[i].key) < in_use);
            }
        }
        break;
    case 10:
        if (sane(osp_culler_box(culler, keys[0], boxes)) == OSP_STATUS_OK) {
            EXPECT(place_of(keys[0]) < in_use && is_valid(boxes));
        }
        EXPECT_OK(osp_culler_commit(culler));
        EXPECT_OK(osp_culler_count(culler, &count));
        EXPECT(count == in_use);
        break;
    default:
        frame(culler, keys, room);
    }
}

void run_fuzz(unsigned calls) {
    for (int life = 0; life < 10; life++) {
        OspCuller *culler;
        in_use = 0;
        EXPECT_OK(osp_culler_new(&culler));
        for (unsigned i = 0; i < calls / 10; i++) {
            call(culler);
        }
        EXPECT_OK(osp_culler_free(culler));
    }
    /* Every status occurred, except those for wrong pointers and counts, which errors.c tests. */
    for (int status = OSP_STATUS_OK; status <= OSP_STATUS_UNKNOWN_KEY; status++) {
        int is_of_pointers = status >= OSP_STATUS_NULL_POINTER && status <= OSP_STATUS_TOO_MANY;
        EXPECT(is_of_pointers ? answered[status] == 0 : answered[status] > calls / 1000);
    }
    EXPECT(answered[OSP_STATUS_OK] > calls / 3);
}
