/* A wall before small boxes: what it hides, by every method; then it is glass, moves, goes and comes under another id. */
#include "test.h"

#include <string.h>

enum { BEHIND = 144, FRAMES = 4 };

/* Square, looking along -z, near 0.01, far 100. */
static const float AHEAD[32] = {
    1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.0001f, -1, 0, 0, -0.010001f, 0,
    /* Looking along +z. */
    -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1.0001f, 1, 0, 0, -0.010001f, 0};

/* 1: all lies along -z, as drawn here; -1: along +z, and x stays, as left-handed engines have it. */
static float hand = 1;

static void to_hand(float *xyz, int count) {
    for (int i = 0; i < count; i++) {
        xyz[3 * i + 2] *= hand;
    }
}

static OspBox box_of_hand(OspBox bounds) {
    if (hand < 0) {
        float near = -bounds.min[2];
        bounds.min[2] = -bounds.max[2];
        bounds.max[2] = near;
    }
    return bounds;
}

static const float WALL[12] = {-1.9f, -1.9f, -2, 1.9f, -1.9f, -2, 1.9f, 1.9f, -2, -1.9f, 1.9f, -2};
static const uint32_t CORNERS[6] = {0, 1, 2, 0, 2, 3};

static OspScene *scene;
static uint32_t visible[512];
static size_t count;
static OspFrame frame;

static void frames(int how_many, size_t views, int is_committed) {
    if (is_committed) {
        EXPECT_OK(osp_scene_commit(scene));
    }
    float matrices[32];
    memcpy(matrices, AHEAD, sizeof matrices);
    for (int i = 8; i < 12; i++) {
        matrices[i] *= hand;
        matrices[16 + i] *= hand;
    }
    for (int i = 0; i < how_many; i++) {
        EXPECT_OK(osp_scene_frame(scene, matrices, views, OSP_DEPTH_ZERO_TO_ONE, &frame));
    }
    EXPECT_OK(osp_scene_visible(scene, 0, visible, 512, &count));
    EXPECT(views > 1 || frame.visible == count);
}

static int is_visible(uint32_t id) {
    for (size_t i = 0; i < count; i++) {
        if (visible[i] == id) {
            return 1;
        }
    }
    return 0;
}

/* One of the wall's two triangles, so much higher up. */
static void move_triangle(uint32_t id, int which, float up) {
    float corners[9];
    for (int k = 0; k < 3; k++) {
        const float *corner = WALL + 3 * CORNERS[3 * which + k];
        corners[3 * k] = corner[0];
        corners[3 * k + 1] = corner[1] + up;
        corners[3 * k + 2] = corner[2];
    }
    to_hand(corners, 3);
    EXPECT_OK(osp_scene_update_triangle(scene, id, corners));
}

/* The changes are taken over by the frame, or before it. */
static void run(int32_t method, int is_committed) {
    OspSceneConfig config = {{{0, 0, 0}, 16, 1024}, method, 100000};
    OspBox boxes[BEHIND + 1];
    uint32_t behind[BEHIND + 1], wall[2], again[2];
    int hides = method != OSP_OCCLUSION_NONE && method != OSP_OCCLUSION_AUTO;
    for (int i = 0; i < BEHIND; i++) {
        float x = (float)(i % 12) * 0.2f - 1.2f, y = (float)(i / 12) * 0.2f - 1.2f;
        boxes[i] = box_of_hand((OspBox){{x, y, -6}, {x + 0.1f, y + 0.1f, -5.9f}});
    }
    /* Beside the wall's shadow. */
    boxes[BEHIND] = box_of_hand((OspBox){{5.8f, 0, -6}, {5.9f, 0.1f, -5.9f}});
    float wall_of_hand[12];
    memcpy(wall_of_hand, WALL, sizeof wall_of_hand);
    to_hand(wall_of_hand, 4);
    EXPECT_OK(osp_scene_new(&config, &scene));
    EXPECT_OK(osp_scene_insert_boxes(scene, boxes, BEHIND + 1, behind));
    /* Glass. */
    EXPECT_OK(osp_scene_insert_triangles(scene, wall_of_hand, 4, CORNERS, 2, 0, wall));
    frames(FRAMES, 1, is_committed);
    EXPECT(count == BEHIND + 3);
    /* Bricks, under the same ids. */
    EXPECT_OK(osp_scene_remove(scene, wall[0]));
    EXPECT_OK(osp_scene_remove(scene, wall[1]));
    EXPECT_OK(osp_scene_insert_triangles(scene, wall_of_hand, 4, CORNERS, 2, 1, again));
    EXPECT(again[0] == wall[1] && again[1] == wall[0]);
    frames(FRAMES, 1, is_committed);
    EXPECT(is_visible(wall[0]) && is_visible(wall[1]) && is_visible(behind[BEHIND]));
    EXPECT(!hides || (count == 3 && frame.in_view == BEHIND + 3 && frame.occluders > 0));
    /* Each of two views is culled for itself. */
    frames(FRAMES, 2, is_committed);
    EXPECT(!hides || count == 3);
    EXPECT_OK(osp_scene_visible(scene, 1, visible, 512, &count));
    EXPECT(count == 0);
    /* A ray meets the wall itself, beside it nothing. */
    float eye[3] = {0, 0, 0}, ahead[3] = {0.5f, 0.25f, -1}, beside[3] = {1, 0.25f, -1};
    to_hand(ahead, 1);
    to_hand(beside, 1);
    OspHit hit;
    EXPECT_OK(osp_scene_ray(scene, eye, ahead, 10, OSP_RAY_MODE_NEAREST, &hit));
    EXPECT((hit.id == wall[0] || hit.id == wall[1]) && hit.t > 1.99f && hit.t < 2.01f);
    EXPECT_OK(osp_scene_ray(scene, eye, beside, 5, OSP_RAY_MODE_ANY, &hit));
    EXPECT(hit.id == OSP_NO_ID);
    /* It is moved out of the way: all is seen in the same frame. */
    for (int i = 0; i < 2; i++) {
        move_triangle(wall[i], i, 50);
    }
    frames(1, 1, is_committed);
    EXPECT(count == BEHIND + 1);
    /* Back, still opaque; then it goes, and a box comes under one of its ids. */
    for (int i = 0; i < 2; i++) {
        move_triangle(wall[i], i, 0);
    }
    frames(FRAMES, 1, is_committed);
    EXPECT(!hides || count == 3);
    EXPECT_OK(osp_scene_remove(scene, wall[0]));
    EXPECT_OK(osp_scene_remove(scene, wall[1]));
    EXPECT_OK(osp_scene_insert_boxes(scene, boxes, 1, again));
    EXPECT(again[0] == wall[1]);
    frames(1, 1, is_committed);
    EXPECT(count == BEHIND + 2 && is_visible(wall[1]));
    EXPECT_OK(osp_scene_free(scene));
}

/* Boxes close together behind the wall: how many are left where drawing one takes so long. */
static size_t left_of(int boxes, float draw_ns) {
    OspSceneConfig config = {{{0, 0, 0}, 16, 1024}, OSP_OCCLUSION_MSVBSP, draw_ns};
    OspBox cluster[BEHIND];
    uint32_t ids[BEHIND], wall[2];
    for (int i = 0; i < boxes; i++) {
        float x = 0.1f + 0.001f * (float)i;
        cluster[i] = (OspBox){{x, 0.1f, -6}, {x + 0.1f, 0.2f, -5.9f}};
    }
    hand = 1;
    EXPECT_OK(osp_scene_new(&config, &scene));
    EXPECT_OK(osp_scene_insert_boxes(scene, cluster, (size_t)boxes, ids));
    EXPECT_OK(osp_scene_insert_triangles(scene, WALL, 4, CORNERS, 2, 1, wall));
    frames(FRAMES, 1, 1);
    EXPECT_OK(osp_scene_free(scene));
    return count - 2;
}

/* What the header says of OspSceneConfig.draw_ns. */
static void what_is_tested(void) {
    EXPECT(left_of(1, 400) == 0);
    EXPECT(left_of(1, 399) == 1);
    EXPECT(left_of(39, 10) == 39);
    EXPECT(left_of(BEHIND, 10) < BEHIND);
}

void run_occlusion(void) {
    what_is_tested();
    for (int32_t method = OSP_OCCLUSION_NONE; method <= OSP_OCCLUSION_AUTO; method++) {
        for (int i = 0; i < 4; i++) {
            hand = i < 2 ? 1 : -1;
            run(method, i % 2);
        }
    }
}
