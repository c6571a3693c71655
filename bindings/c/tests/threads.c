/* Threads with one handle: queries run at the same time, a change runs alone, and no call waits. */
#include "test.h"

#include <pthread.h>
#include <string.h>

enum { BOXES = 500, CALLS = 300 };

static OspCuller *shared;

static void *ask(void *busy) {
    const OspBox everywhere = {{-9, -9, -9}, {9, 9, 9}};
    for (int i = 0; i < CALLS; i++) {
        uint64_t keys[BOXES];
        size_t count;
        OspStatus status = osp_culler_in_box(shared, &everywhere, keys, BOXES, &count);
        EXPECT(status == OSP_STATUS_OK ? count == BOXES : status == OSP_STATUS_BUSY && busy && count == 0);
    }
    /* Each thread has its own message. */
    EXPECT(osp_culler_remove(NULL, NULL, 0) == OSP_STATUS_NULL_POINTER);
    EXPECT(strstr(osp_last_error(), "culler"));
    return NULL;
}

static void *change(void *unused) {
    OspBox bounds = {{-0.1f, -0.1f, -5}, {0.1f, 0.1f, -4}};
    uint64_t key = 0;
    (void)unused;
    for (int i = 0; i < CALLS; i++) {
        OspStatus status = osp_culler_set(shared, &key, &bounds, 1);
        EXPECT(status == OSP_STATUS_OK || status == OSP_STATUS_BUSY);
        status = osp_culler_commit(shared);
        EXPECT(status == OSP_STATUS_OK || status == OSP_STATUS_BUSY);
    }
    return NULL;
}

static void at_once(void *(*first)(void *), void *busy) {
    pthread_t threads[3];
    EXPECT(pthread_create(&threads[0], NULL, first, busy) == 0);
    EXPECT(pthread_create(&threads[1], NULL, ask, busy) == 0);
    EXPECT(pthread_create(&threads[2], NULL, ask, busy) == 0);
    for (int i = 0; i < 3; i++) {
        EXPECT(pthread_join(threads[i], NULL) == 0);
    }
}

void run_threads(void) {
    OspBox boxes[BOXES];
    uint64_t keys[BOXES];
    int busy;
    for (int i = 0; i < BOXES; i++) {
        float x = (float)i * 0.001f;
        keys[i] = (uint64_t)i;
        boxes[i] = (OspBox){{x, 0, -5}, {x + 0.1f, 0.1f, -4}};
    }
    EXPECT_OK(osp_culler_new(&shared));
    EXPECT_OK(osp_culler_set(shared, keys, boxes, BOXES));
    EXPECT_OK(osp_culler_commit(shared));
    at_once(ask, NULL);
    at_once(change, &busy);
    EXPECT_OK(osp_culler_free(shared));
}
