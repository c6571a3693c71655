/* Shared parts of the tests. */
#ifndef OSP_TEST_H
#define OSP_TEST_H

#include "osp.h"

#include <stdio.h>
#include <stdlib.h>

#define EXPECT(condition)                                                                                  \
    do {                                                                                                   \
        if (!(condition)) {                                                                                \
            fprintf(stderr, "%s:%d: expected %s; the last message is \"%s\"\n", __FILE__, __LINE__,        \
                    #condition, osp_last_error());                                                         \
            exit(1);                                                                                       \
        }                                                                                                  \
    } while (0)

#define EXPECT_OK(call) EXPECT((call) == OSP_STATUS_OK)

/* Runs the cases on a culler. Returns the number of compared results. */
int run_conformance(const char *path);
/* Tests wrong arguments of every function. */
void run_errors(void);
/* Tests random arguments, good and bad, from a seed. */
void run_fuzz(unsigned calls);
/* Tests the objects that a wall hides, for two eyes and on layers, with changes between frames. */
void run_occlusion(void);
/* Tests several threads with one handle. */
void run_threads(void);

#endif
