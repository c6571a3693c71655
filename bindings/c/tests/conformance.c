/* Runs the cases of bindings/conformance.txt on an OspIndex and, in the same way, on an OspScene of boxes. */
#include "test.h"

#include <math.h>
#include <string.h>

enum { MOST_IDS = 100000, MOST_ANSWER = 4096, LINE = 16384 };

static OspIndex *index_of_case;
static OspScene *scene_of_case;
/* By id of the file: the id of the index and of the scene plus 1, or 0. */
static uint32_t in_index[MOST_IDS], in_scene[MOST_IDS];
/* By id of the index and of the scene. */
static uint32_t of_index[MOST_IDS], of_scene[MOST_IDS];
static uint32_t answer[MOST_ANSWER];
static size_t answered;
static OspHit hit;
static int line_number;

static void begin(void) {
    EXPECT_OK(osp_index_free(index_of_case));
    EXPECT_OK(osp_scene_free(scene_of_case));
    EXPECT_OK(osp_index_new(NULL, &index_of_case));
    OspSceneConfig config = {{{0, 0, 0}, 16, 64}, OSP_OCCLUSION_NONE, 10};
    EXPECT_OK(osp_scene_new(&config, &scene_of_case));
    memset(in_index, 0, sizeof in_index);
    memset(in_scene, 0, sizeof in_scene);
}

static void floats(char **text, float *numbers, int count) {
    for (int i = 0; i < count; i++) {
        char *end;
        numbers[i] = strtof(*text, &end);
        EXPECT(end != *text);
        *text = end;
    }
}

static uint32_t id_of(char **text) {
    char *end;
    unsigned long id = strtoul(*text, &end, 10);
    EXPECT(end != *text && id < MOST_IDS);
    *text = end;
    return (uint32_t)id;
}

static void put(uint32_t id, const float *numbers) {
    OspBox bounds, there;
    memcpy(&bounds, numbers, sizeof bounds);
    /* A scene takes coordinates up to 1e15. */
    int for_scene = fabsf(bounds.max[0]) <= 1e15f;
    if (in_index[id]) {
        uint32_t own = in_index[id] - 1;
        EXPECT_OK(osp_index_update(index_of_case, &own, &bounds, 1));
        if (for_scene) {
            EXPECT_OK(osp_scene_update_box(scene_of_case, in_scene[id] - 1, &bounds));
        }
    } else {
        uint32_t own;
        EXPECT_OK(osp_index_insert(index_of_case, &bounds, 1, &own));
        EXPECT(own < MOST_IDS);
        in_index[id] = own + 1;
        of_index[own] = id;
        OspStatus status = osp_scene_insert_boxes(scene_of_case, &bounds, 1, &own);
        EXPECT(status == (for_scene ? OSP_STATUS_OK : OSP_STATUS_INVALID_BOX));
        if (for_scene) {
            in_scene[id] = own + 1;
            of_scene[own] = id;
        }
    }
    EXPECT_OK(osp_index_box(index_of_case, in_index[id] - 1, &there));
    EXPECT(memcmp(&there, &bounds, sizeof there) == 0);
}

static void take_out(uint32_t id) {
    EXPECT(in_index[id]);
    EXPECT_OK(osp_index_remove(index_of_case, in_index[id] - 1));
    EXPECT_OK(osp_scene_remove(scene_of_case, in_scene[id] - 1));
    in_index[id] = in_scene[id] = 0;
}

static int ascending(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* The scene has found the same as the index, but for what only an index takes. */
static void compare_with_scene(uint32_t *found, size_t count) {
    for (size_t i = 0; i < count; i++) {
        found[i] = of_scene[found[i]];
    }
    qsort(found, count, sizeof *found, ascending);
    size_t at = 0;
    for (size_t i = 0; i < answered; i++) {
        if (in_scene[answer[i]]) {
            EXPECT(at < count && found[at] == answer[i]);
            at++;
        }
    }
    EXPECT(at == count);
}

static void names_of_file(void) {
    for (size_t i = 0; i < answered; i++) {
        EXPECT(i == 0 || answer[i - 1] < answer[i]);
    }
    for (size_t i = 0; i < answered; i++) {
        answer[i] = of_index[answer[i]];
    }
    qsort(answer, answered, sizeof *answer, ascending);
}

static void commit(void) {
    EXPECT_OK(osp_index_commit(index_of_case));
    EXPECT_OK(osp_scene_commit(scene_of_case));
}

static void view(const float *matrix) {
    static uint32_t found[MOST_ANSWER];
    size_t count, needed;
    commit();
    EXPECT_OK(osp_index_frustum(index_of_case, matrix, OSP_DEPTH_ZERO_TO_ONE, answer, MOST_ANSWER, &answered));
    if (answered > 0) {
        uint32_t untouched = 77;
        OspStatus status =
            osp_index_frustum(index_of_case, matrix, OSP_DEPTH_ZERO_TO_ONE, &untouched, answered > 1, &needed);
        EXPECT(needed == answered && (answered == 1 || (status == OSP_STATUS_BUFFER_TOO_SMALL && untouched == 77)));
    }
    /* The same view as OpenGL has it. */
    float opengl[16];
    memcpy(opengl, matrix, sizeof opengl);
    for (int column = 0; column < 4; column++) {
        opengl[4 * column + 2] = 2 * matrix[4 * column + 2] - matrix[4 * column + 3];
    }
    EXPECT_OK(osp_index_frustum(index_of_case, opengl, OSP_DEPTH_MINUS_ONE_TO_ONE, found, MOST_ANSWER, &count));
    EXPECT(count == answered && memcmp(found, answer, count * sizeof *found) == 0);
    names_of_file();
    EXPECT_OK(osp_scene_frustum(scene_of_case, matrix, OSP_DEPTH_ZERO_TO_ONE, found, MOST_ANSWER, &count));
    compare_with_scene(found, count);
    /* A frame is for perspectives. */
    if (matrix[3] != 0 || matrix[7] != 0 || matrix[11] != 0) {
        OspFrame frame;
        EXPECT_OK(osp_scene_frame(scene_of_case, matrix, 1, OSP_DEPTH_ZERO_TO_ONE, &frame));
        EXPECT_OK(osp_scene_visible(scene_of_case, 0, found, MOST_ANSWER, &count));
        EXPECT(frame.visible == count && frame.in_view == count);
        compare_with_scene(found, count);
    } else {
        EXPECT(osp_scene_frame(scene_of_case, matrix, 1, OSP_DEPTH_ZERO_TO_ONE, NULL) == OSP_STATUS_INVALID_VIEW);
    }
}

static void box_query(const float *numbers) {
    static uint32_t found[MOST_ANSWER];
    size_t count;
    OspBox bounds;
    memcpy(&bounds, numbers, sizeof bounds);
    commit();
    EXPECT_OK(osp_index_box_query(index_of_case, &bounds, answer, MOST_ANSWER, &answered));
    names_of_file();
    EXPECT_OK(osp_scene_box_query(scene_of_case, &bounds, found, MOST_ANSWER, &count));
    compare_with_scene(found, count);
}

static void sphere(const float *numbers) {
    commit();
    EXPECT_OK(osp_index_sphere_query(index_of_case, numbers, numbers[3], answer, MOST_ANSWER, &answered));
    names_of_file();
}

static void ray(const float *numbers) {
    OspHit any, of;
    commit();
    EXPECT_OK(osp_index_ray(index_of_case, numbers, numbers + 3, numbers[6], OSP_RAY_MODE_NEAREST, &hit));
    EXPECT_OK(osp_index_ray(index_of_case, numbers, numbers + 3, numbers[6], OSP_RAY_MODE_ANY, &any));
    EXPECT((any.id == OSP_NO_ID) == (hit.id == OSP_NO_ID));
    EXPECT_OK(osp_scene_ray(scene_of_case, numbers, numbers + 3, numbers[6], OSP_RAY_MODE_NEAREST, &of));
    EXPECT((of.id == OSP_NO_ID) == (hit.id == OSP_NO_ID) && of.t == hit.t);
    if (hit.id != OSP_NO_ID) {
        hit.id = of_index[hit.id];
        EXPECT(of_scene[of.id] == hit.id);
    }
}

static void compare_ids(char *rest) {
    for (size_t i = 0; i < answered; i++) {
        EXPECT(id_of(&rest) == answer[i]);
    }
    EXPECT(rest[strspn(rest, " \r\n")] == 0);
}

static void compare_hit(char *rest) {
    if (strncmp(rest, " none", 5) == 0) {
        EXPECT(hit.id == OSP_NO_ID && hit.t == 0);
        return;
    }
    float t;
    EXPECT(id_of(&rest) == hit.id);
    floats(&rest, &t, 1);
    EXPECT(fabsf(t - hit.t) <= 1e-4f * t);
}

static int step(char *line) {
    float numbers[16];
    size_t length = strcspn(line, " \r\n");
    char *rest = line + length;
#define IS(word) (length == strlen(word) && strncmp(line, word, length) == 0)
    if (length == 0 || line[0] == '#') {
        return 0;
    } else if (IS("case")) {
        begin();
    } else if (IS("box")) {
        uint32_t id = id_of(&rest);
        floats(&rest, numbers, 6);
        put(id, numbers);
    } else if (IS("remove")) {
        take_out(id_of(&rest));
    } else if (IS("view")) {
        floats(&rest, numbers, 16);
        view(numbers);
    } else if (IS("boxquery")) {
        floats(&rest, numbers, 6);
        box_query(numbers);
    } else if (IS("sphere")) {
        floats(&rest, numbers, 4);
        sphere(numbers);
    } else if (IS("ray")) {
        floats(&rest, numbers, 7);
        ray(numbers);
    } else if (IS("visible") || IS("found")) {
        compare_ids(rest);
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
    EXPECT_OK(osp_index_free(index_of_case));
    EXPECT_OK(osp_scene_free(scene_of_case));
    return answers;
}
