/* A wall hides small boxes: for two eyes at once, on layers, left-handed or right-handed. Then the wall moves and is removed. */
#include "test.h"

#include <string.h>

enum { BEHIND = 144, ASIDE = BEHIND, WALL = 1000, STAND_IN = 1001 };

/* 1: everything lies along -z; -1: along +z with the same x, as in left-handed engines. */
static float hand = 1;
static OspCuller *culler;
static uint64_t visible[512];
static OspSeen seen[2];

static OspBox box_of_hand(OspBox bounds) {
    if (hand < 0) {
        float near = -bounds.min[2];
        bounds.min[2] = -bounds.max[2];
        bounds.max[2] = near;
    }
    return bounds;
}

static void set(uint64_t key, OspBox bounds) {
    bounds = box_of_hand(bounds);
    EXPECT_OK(osp_culler_set(culler, &key, &bounds, 1));
}

/* The eyes of a headset, 6 cm apart: square, near plane 0.01, no far plane, reversed depth. The second eye can ignore occluders. */
static void look(int hide_second, uint32_t layers) {
    OspCamera eyes[2];
    for (int i = 0; i < 2; i++) {
        float x = i ? -0.03f : 0.03f;
        const float matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -hand, x, 0, 0.01f, 0};
        EXPECT_OK(osp_camera_f32(matrix, OSP_DEPTH_ONE_TO_ZERO, &eyes[i]));
        eyes[i].hide_by_occluders = i == 0 || hide_second;
        eyes[i].layers = layers;
    }
    EXPECT_OK(osp_culler_cull(culler, eyes, 2, seen));
}

static int is_visible(size_t camera, uint64_t key) {
    size_t count;
    EXPECT_OK(osp_culler_visible(culler, camera, visible, 512, &count));
    EXPECT(count == seen[camera].visible);
    for (size_t i = 0; i < count; i++) {
        if (visible[i] == key) {
            return 1;
        }
    }
    return 0;
}

static void raise_wall(int as_mesh) {
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    float z = -2 * hand;
    const float corners[12] = {-1.9f, -1.9f, z, 1.9f, -1.9f, z, 1.9f, 1.9f, z, -1.9f, 1.9f, z};
    if (as_mesh) {
        EXPECT_OK(osp_culler_set_occluder_mesh(culler, WALL, corners, 4, indices, 2));
    } else {
        EXPECT_OK(osp_culler_set_occluder_quad(culler, WALL, corners));
    }
}

static void run(int as_mesh) {
    EXPECT_OK(osp_culler_new(&culler));
    for (int i = 0; i < BEHIND; i++) {
        float x = (float)(i % 12) * 0.2f - 1.2f, y = (float)(i / 12) * 0.2f - 1.2f;
        set((uint64_t)i, (OspBox){{x, y, -6}, {x + 0.1f, y + 0.1f, -5.9f}});
    }
    /* This box is outside the wall's shadow. */
    set(ASIDE, (OspBox){{5.8f, 0, -6}, {5.9f, 0.1f, -5.9f}});
    set(WALL, (OspBox){{-1.9f, -1.9f, -2}, {1.9f, 1.9f, -2}});
    look(1, OSP_ALL_LAYERS);
    EXPECT(seen[0].visible == BEHIND + 2 && seen[0].hidden == 0);
    raise_wall(as_mesh);
    look(0, OSP_ALL_LAYERS);
    EXPECT(seen[0].visible == 2 && seen[0].hidden == BEHIND);
    EXPECT(is_visible(0, WALL) && is_visible(0, ASIDE) && !is_visible(0, 7));
    EXPECT(seen[1].visible == BEHIND + 2 && is_visible(1, 7));
    look(1, OSP_ALL_LAYERS);
    EXPECT(seen[0].visible == 2 && seen[1].visible == 2);
    /* Boxes that are in no culler: behind the wall, beside it, out of view, and an invalid one. */
    OspBox boxes[4] = {
        box_of_hand((OspBox){{-1, -1, -6}, {1, 1, -5}}), box_of_hand((OspBox){{5.8f, 0, -6}, {5.9f, 1, -5.9f}}),
        box_of_hand((OspBox){{-1, -1, 5}, {1, 1, 6}}), {{1, 1, 1}, {0, 0, 0}}};
    uint8_t hidden[4] = {7, 7, 7, 7};
    OspCamera eye;
    const float matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -hand, 0, 0, 0.01f, 0};
    EXPECT_OK(osp_camera_f32(matrix, OSP_DEPTH_ONE_TO_ZERO, &eye));
    EXPECT_OK(osp_culler_are_hidden(culler, &eye, boxes, 4, hidden));
    EXPECT(hidden[0] == 0 && hidden[1] == 0 && hidden[2] == 1 && hidden[3] == 0);
    eye.hide_by_occluders = 1;
    EXPECT_OK(osp_culler_are_hidden(culler, &eye, boxes, 4, hidden));
    EXPECT(hidden[0] == 1 && hidden[1] == 0 && hidden[2] == 1 && hidden[3] == 0);
    /* The wall is on another layer: only a camera that sees the wall may omit the boxes behind it. */
    uint64_t wall = WALL;
    uint32_t second = 2;
    EXPECT_OK(osp_culler_set_layers(culler, &wall, &second, 1));
    look(1, 1);
    EXPECT(seen[0].visible == BEHIND + 1 && !is_visible(0, WALL));
    look(1, 3);
    EXPECT(seen[0].visible == 2);
    look(1, 4);
    EXPECT(seen[0].visible == 0 && seen[0].hidden == 0);
    /* The wall moves out of the way, and hides nothing until it has a new occluder. */
    set(WALL, (OspBox){{-1.9f, 50, -2}, {1.9f, 54, -2}});
    look(1, OSP_ALL_LAYERS);
    EXPECT(seen[0].visible == BEHIND + 1);
    /* The wall is removed. An occluder without a box replaces it, until it is removed, too. */
    EXPECT_OK(osp_culler_remove(culler, &wall, 1));
    OspBox house = box_of_hand((OspBox){{-1.9f, -1.9f, -3}, {1.9f, 1.9f, -2}});
    EXPECT_OK(osp_culler_set_occluder_box(culler, STAND_IN, &house));
    look(1, OSP_ALL_LAYERS);
    EXPECT(seen[0].visible == 1 && is_visible(0, ASIDE));
    EXPECT_OK(osp_culler_remove_occluder(culler, STAND_IN));
    look(1, OSP_ALL_LAYERS);
    EXPECT(seen[0].visible == BEHIND + 1 && seen[0].hidden == 0);
    EXPECT_OK(osp_culler_free(culler));
}

void run_occlusion(void) {
    for (int i = 0; i < 4; i++) {
        hand = i < 2 ? 1 : -1;
        run(i % 2);
    }
}
