/* Threads with one handle: questions run at once; a change meets nobody, and nobody waits. */
#include "test.h"

#include <pthread.h>
#include <string.h>

enum { BOXES = 500, CALLS = 300 };

static OspIndex *shared;
static const float AHEAD[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.0001f, -1, 0, 0, -0.010001f, 0};

static void *ask(void *busy) {
    for (int i = 0; i < CALLS; i++) {
        uint32_t ids[BOXES];
        size_t count;
        OspStatus status = osp_index_frustum(shared, AHEAD, 0, ids, BOXES, &count);
        int is_refused = status == OSP_STATUS_BUSY || status == OSP_STATUS_NOT_COMMITTED;
        EXPECT(status == OSP_STATUS_OK ? count == BOXES : is_refused && busy && count == 0);
    }
    /* Each thread has a message of its own. */
    EXPECT(osp_index_remove(NULL, 0) == OSP_STATUS_NULL_POINTER);
    EXPECT(strstr(osp_last_error(), "index"));
    return NULL;
}

static void *change(void *unused) {
    OspBox bounds = {{-0.1f, -0.1f, -5}, {0.1f, 0.1f, -4}};
    uint32_t id = 0;
    (void)unused;
    for (int i = 0; i < CALLS; i++) {
        OspStatus status = osp_index_update(shared, &id, &bounds, 1);
        EXPECT(status == OSP_STATUS_OK || status == OSP_STATUS_BUSY);
        status = osp_index_commit(shared);
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
    uint32_t ids[BOXES];
    int busy;
    for (int i = 0; i < BOXES; i++) {
        float x = (float)i * 0.001f;
        boxes[i] = (OspBox){{x, 0, -5}, {x + 0.1f, 0.1f, -4}};
    }
    EXPECT_OK(osp_index_new(NULL, &shared));
    EXPECT_OK(osp_index_insert(shared, boxes, BOXES, ids));
    EXPECT_OK(osp_index_commit(shared));
    at_once(ask, NULL);
    at_once(change, &busy);
    EXPECT_OK(osp_index_free(shared));
}
