/* The frames of an engine: objects are added, moved and removed. Two eyes and a light find the objects to draw. A wall hides the objects behind it. */
#include <osp.h>

#include <stdio.h>
#include <stdlib.h>

enum { COUNT = 100000, WALL = 1000000 };

/* Every call returns a status. osp_last_error describes a failure. */
static void check(OspStatus status) {
    if (status != OSP_STATUS_OK) {
        fprintf(stderr, "osp: %s\n", osp_last_error());
        exit(1);
    }
}

static OspBox cube(float x, float y, float z, float half) {
    return (OspBox){{x - half, y - half, z - half}, {x + half, y + half, z + half}};
}

/* An eye of a headset: 90 degrees, along -z; reversed depth, near plane at 0.1, no far plane. An engine has its own matrices. */
static OspCamera eye(float x) {
    const float clip_from_world[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, -x, 0, 0.1f, 0};
    OspCamera camera;
    check(osp_camera_f32(clip_from_world, OSP_DEPTH_ONE_TO_ZERO, &camera));
    camera.hide_by_occluders = 1;
    return camera;
}

/* A light from above: parallel, 20 m wide, from y = 10 to y = -10. */
static OspCamera light(void) {
    const float clip_from_world[16] = {0.1f, 0, 0, 0, 0, 0, -0.05f, 0, 0, 0.1f, 0, 0, 0, 0, 0.5f, 1};
    OspCamera camera;
    check(osp_camera_f32(clip_from_world, OSP_DEPTH_ZERO_TO_ONE, &camera));
    return camera;
}

/* The object under a point of the screen. Here the box is the object, so the first hit is the result. */
static void pick(const OspCuller *culler, const OspCamera *camera) {
    float origin[3], direction[3];
    OspHit hit;
    size_t count;
    check(osp_camera_ray(camera, 0.05f, -0.1f, origin, direction));
    check(osp_culler_on_ray(culler, origin, direction, 1000, &hit, 1, &count));
    if (count > 0) {
        printf("under the cursor: %llu, %.2f m away; %zu boxes on the ray\n", (unsigned long long)hit.key, hit.t, count);
    }
}

int main(void) {
    OspBox *boxes = malloc(COUNT * sizeof *boxes);
    uint64_t *keys = malloc((COUNT + 1) * sizeof *keys), wall = WALL;
    OspCuller *culler;
    OspCamera cameras[3] = {eye(-0.03f), eye(0.03f), light()};
    OspSeen seen[3];
    if (!boxes || !keys) {
        return 1;
    }
    for (int i = 0; i < COUNT; i++) {
        keys[i] = (uint64_t)i;
        boxes[i] = cube((float)(i % 316) * 0.316f - 50, -1, (float)(i / 316) * 0.316f - 50, 0.05f);
    }
    check(osp_culler_new(&culler));
    check(osp_culler_set(culler, keys, boxes, COUNT));
    const float corners[12] = {-2, -2, -4, 2, -2, -4, 2, 2, -4, -2, 2, -4};
    OspBox around = {{-2, -2, -4}, {2, 2, -4}};
    check(osp_culler_set(culler, &wall, &around, 1));
    check(osp_culler_set_occluder_quad(culler, wall, corners));
    for (int frame = 0; frame < 3; frame++) {
        /* The changes since the last frame. */
        uint64_t moved = (uint64_t)frame, gone = (uint64_t)(COUNT - 1 - frame);
        OspBox there = cube(0, 0, -3 - (float)frame, 0.05f);
        check(osp_culler_set(culler, &moved, &there, 1));
        check(osp_culler_remove(culler, &gone, 1));
        check(osp_culler_cull(culler, cameras, 3, seen));
        size_t count;
        for (size_t camera = 0; camera < 3; camera++) {
            check(osp_culler_visible(culler, camera, keys, COUNT + 1, &count));
            printf("frame %d, camera %zu: %zu to draw, %zu hidden\n", frame, camera, count, seen[camera].hidden);
        }
    }
    pick(culler, &cameras[0]);
    check(osp_culler_free(culler));
    free(keys);
    free(boxes);
    return seen[0].hidden > 1000 && seen[2].hidden == 0 ? 0 : 1;
}
