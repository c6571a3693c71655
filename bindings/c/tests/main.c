/* The tests of the C library: main FILE, where FILE is bindings/conformance.txt. */
#include "test.h"

int main(int count, char **arguments) {
    if (count != 2) {
        fprintf(stderr, "usage: %s conformance.txt\n", arguments[0]);
        return 2;
    }
    EXPECT(osp_version() == OSP_VERSION);
    EXPECT(osp_last_error()[0] == 0);
    int answers = run_conformance(arguments[1]);
    EXPECT(answers > 150);
    run_errors();
    run_occlusion();
    run_threads();
    run_fuzz(20000);
    printf("%d answers as expected; wrong arguments, occlusion, threads and random calls passed\n", answers);
    return 0;
}
