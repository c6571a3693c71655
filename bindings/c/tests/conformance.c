/* Runs the cases of bindings/conformance.txt on an OspCuller. */
#include "test.h"

#include <math.h>
#include <string.h>

enum { MOST_ANSWER = 4096, LINE = 16384 };

static OspCuller *culler;
static uint64_t answer[MOST_ANSWER];
static size_t answered;
static float matrix[16];
/* The first object that the last ray entered, and the number of entered objects. */
static OspHit hit;
static size_t hits;
static int line_number;

/* Turns an id of the file into a key that needs all 64 bits. */
static uint64_t key_of(char **text) {
    char *end;
    unsigned long id = strtoul(*text, &end, 10);
    EXPECT(end != *text);
    *text = end;
    return ~(uint64_t)id;
}

static void floats(char **text, float *numbers, int count) {
    for (int i = 0; i < count; i++) {
        char *end;
        numbers[i] = strtof(*text, &end);
        EXPECT(end != *text);
        *text = end;
    }
}

static void put(uint64_t key, const float *numbers) {
    OspBox bounds, there;
    memcpy(&bounds, numbers, sizeof bounds);
    EXPECT_OK(osp_culler_set(culler, &key, &bounds, 1));
    EXPECT_OK(osp_culler_box(culler, key, &there));
    EXPECT(memcmp(&there, &bounds, sizeof there) == 0);
}

/* Orders keys from the largest to the smallest, which is the order of the file's ids. */
static int descending(const void *a, const void *b) {
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x < y) - (x > y);
}

static void sort(uint64_t *keys, size_t count) {
    qsort(keys, count, sizeof *keys, descending);
    for (size_t i = 1; i < count; i++) {
        EXPECT(keys[i - 1] != keys[i]);
    }
}

/* Checks the contents of the last view, with each range of depths and with 64-bit numbers. */
static void look(int hide) {
    float opengl[16];
    double doubles[16];
    OspCamera cameras[4];
    OspSeen seen[4];
    for (int i = 0; i < 16; i++) {
        doubles[i] = matrix[i];
        opengl[i] = i % 4 == 2 ? 2 * matrix[i] - matrix[i + 1] : matrix[i];
    }
    EXPECT_OK(osp_camera_f32(matrix, OSP_DEPTH_ZERO_TO_ONE, &cameras[0]));
    EXPECT_OK(osp_camera_f32(matrix, OSP_DEPTH_ONE_TO_ZERO, &cameras[1]));
    EXPECT_OK(osp_camera_f32(opengl, OSP_DEPTH_MINUS_ONE_TO_ONE, &cameras[2]));
    EXPECT_OK(osp_camera_f64(doubles, OSP_DEPTH_ZERO_TO_ONE, &cameras[3]));
    for (int i = 0; i < 4; i++) {
        cameras[i].hide_by_occluders = hide;
    }
    EXPECT_OK(osp_culler_cull(culler, cameras, 4, seen));
    for (size_t i = 0; i < 4; i++) {
        static uint64_t keys[MOST_ANSWER];
        size_t count;
        EXPECT_OK(osp_culler_visible(culler, i, keys, MOST_ANSWER, &count));
        EXPECT(count == seen[i].visible && (hide || seen[i].hidden == 0));
        sort(keys, count);
        if (i == 0) {
            memcpy(answer, keys, count * sizeof *keys);
            answered = count;
        }
        EXPECT(count == answered && memcmp(keys, answer, count * sizeof *keys) == 0);
    }
    if (answered > 1) {
        uint64_t keys[2] = {77, 77};
        size_t needed;
        EXPECT(osp_culler_visible(culler, 0, keys, 1, &needed) == OSP_STATUS_BUFFER_TOO_SMALL);
        EXPECT(needed == answered && keys[0] != 77 && keys[1] == 77);
    }
}

static void in_box(const float *numbers) {
    OspBox bounds;
    memcpy(&bounds, numbers, sizeof bounds);
    EXPECT_OK(osp_culler_in_box(culler, &bounds, answer, MOST_ANSWER, &answered));
    sort(answer, answered);
}

static void in_sphere(const float *numbers) {
    EXPECT_OK(osp_culler_in_sphere(culler, numbers, numbers[3], answer, MOST_ANSWER, &answered));
    sort(answer, answered);
}

static void on_ray(const float *numbers) {
    static OspHit all[MOST_ANSWER];
    size_t count;
    EXPECT_OK(osp_culler_on_ray(culler, numbers, numbers + 3, numbers[6], &hit, 1, &hits));
    EXPECT_OK(osp_culler_on_ray(culler, numbers, numbers + 3, numbers[6], all, MOST_ANSWER, &count));
    EXPECT(count == hits && (count == 0 || (all[0].key == hit.key && all[0].t == hit.t)));
    for (size_t i = 1; i < count; i++) {
        EXPECT(all[i - 1].t <= all[i].t && all[i].t <= numbers[6]);
    }
}

static void compare_keys(char *rest) {
    for (size_t i = 0; i < answered; i++) {
        EXPECT(key_of(&rest) == answer[i]);
    }
    EXPECT(rest[strspn(rest, " \r\n")] == 0);
}

static void compare_hit(char *rest) {
    if (strncmp(rest, " none", 5) == 0) {
        EXPECT(hits == 0);
        return;
    }
    float t;
    EXPECT(hits > 0 && key_of(&rest) == hit.key);
    floats(&rest, &t, 1);
    EXPECT(fabsf(t - hit.t) <= 1e-4f * t);
}

static int step(char *line) {
    float numbers[12];
    uint64_t key;
    size_t length = strcspn(line, " \r\n");
    char *rest = line + length;
#define IS(word) (length == strlen(word) && strncmp(line, word, length) == 0)
    if (length == 0 || line[0] == '#') {
        return 0;
    } else if (IS("case")) {
        EXPECT_OK(osp_culler_free(culler));
        EXPECT_OK(osp_culler_new(&culler));
    } else if (IS("box")) {
        key = key_of(&rest);
        floats(&rest, numbers, 6);
        put(key, numbers);
    } else if (IS("remove")) {
        key = key_of(&rest);
        EXPECT_OK(osp_culler_remove(culler, &key, 1));
    } else if (IS("quad")) {
        key = key_of(&rest);
        floats(&rest, numbers, 12);
        EXPECT_OK(osp_culler_set_occluder_quad(culler, key, numbers));
    } else if (IS("view")) {
        floats(&rest, matrix, 16);
    } else if (IS("boxquery") || IS("sphere") || IS("ray")) {
        EXPECT_OK(osp_culler_commit(culler));
        floats(&rest, numbers, IS("boxquery") ? 6 : IS("sphere") ? 4 : 7);
        (IS("boxquery") ? in_box : IS("sphere") ? in_sphere : on_ray)(numbers);
    } else if (IS("visible") || IS("unhidden")) {
        look(IS("unhidden"));
        compare_keys(rest);
        return 1;
    } else if (IS("found")) {
        compare_keys(rest);
        return 1;
    } else if (IS("hit")) {
        compare_hit(rest);
        return 1;
    } else {
        fprintf(stderr, "line %d: no step begins with %.*s\n", line_number, (int)length, line);
        exit(1);
    }
#undef IS
    return 0;
}

static void say_line(void) {
    if (line_number > 0) {
        fprintf(stderr, "it was at line %d of the cases\n", line_number);
    }
}

int run_conformance(const char *path) {
    static char line[LINE];
    FILE *file = fopen(path, "r");
    if (!file) {
        perror(path);
        exit(1);
    }
    atexit(say_line);
    int answers = 0;
    while (fgets(line, LINE, file)) {
        line_number++;
        EXPECT(strchr(line, '\n'));
        answers += step(line);
    }
    fclose(file);
    line_number = 0;
    EXPECT_OK(osp_culler_free(culler));
    return answers;
}
