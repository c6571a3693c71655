/* Frame after frame in an engine: boxes come, move and go, and the view finds those to draw; then a wall hides what is behind. */
#include <osp.h>

#include <stdio.h>
#include <stdlib.h>

enum { COUNT = 100000 };

/* Every call can be refused, and says why. */
static void check(OspStatus status) {
    if (status != OSP_STATUS_OK) {
        fprintf(stderr, "osp: %s\n", osp_last_error());
        exit(1);
    }
}

/* 90 degrees, from the origin along -z; depth from 0 at 0.1 to 1 at 100. The engine has one of its own. */
static const float clip_from_world[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.001001f, -1, 0, 0, -0.1001001f, 0};

static OspBox cube(float x, float y, float z, float half) {
    return (OspBox){{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

/* The index alone. */
static void boxes(void) {
    OspBox *all = malloc(COUNT * sizeof *all);
    uint32_t *ids = malloc(COUNT * sizeof *ids), *visible = malloc(COUNT * sizeof *visible);
    if (!all || !ids || !visible) {
        exit(1);
    }
    for (int i = 0; i < COUNT; i++) {
        all[i] = cube((float)(i % 316) * 0.316f - 50, 0, (float)(i / 316) * 0.316f - 50, 0.05f);
    }
    OspIndexConfig config = {.root_center = {0, 0, 0}, .root_size = 100, .capacity = COUNT};
    OspIndex *index;
    check(osp_index_new(&config, &index));
    check(osp_index_insert(index, all, COUNT, ids));
    for (int frame = 0; frame < 3; frame++) {
        /* What has changed since the last frame. */
        all[frame] = cube(0, 0, -3 - (float)frame, 0.05f);
        check(osp_index_update(index, &ids[frame], &all[frame], 1));
        check(osp_index_remove(index, ids[COUNT - 1 - frame]));
        check(osp_index_commit(index));
        size_t count;
        check(osp_index_frustum(index, clip_from_world, OSP_DEPTH_ZERO_TO_ONE, visible, COUNT, &count));
        printf("frame %d: %zu boxes to draw\n", frame, count);
    }
    check(osp_index_free(index));
    free(visible);
    free(ids);
    free(all);
}

/* A scene: meshes, known by their boxes, and a wall of two opaque triangles. */
static void what_a_wall_hides(void) {
    static const float wall[] = {-3, -2, -5, 3, -2, -5, 3, 2, -5, -3, 2, -5};
    static const uint32_t corners[] = {0, 1, 2, 0, 2, 3};
    OspSceneConfig config = {{{0, 0, 0}, 64, 1024}, OSP_OCCLUSION_MSVBSP, 10000};
    OspScene *scene;
    uint32_t meshes[400], walls[2], visible[402];
    size_t count;
    OspFrame frame;
    check(osp_scene_new(&config, &scene));
    for (int i = 0; i < 400; i++) {
        OspBox mesh = cube((float)(i % 20) - 9.5f, (float)(i / 20) * 0.5f - 5, -9, 0.2f);
        check(osp_scene_insert_boxes(scene, &mesh, 1, &meshes[i]));
    }
    check(osp_scene_insert_triangles(scene, wall, 4, corners, 2, 1, walls));
    check(osp_scene_frame(scene, clip_from_world, 1, OSP_DEPTH_ZERO_TO_ONE, &frame));
    check(osp_scene_visible(scene, 0, visible, 402, &count));
    printf("%llu in view, %zu to draw, the wall hides the others\n", (unsigned long long)frame.in_view, count);
    check(osp_scene_free(scene));
    if (frame.in_view - count < 50) {
        exit(1);
    }
}

int main(void) {
    boxes();
    what_a_wall_hides();
    return 0;
}
