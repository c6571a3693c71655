// Uses the header in C++, with a handle that frees its culler.
#include "osp.h"

#include <cstdio>
#include <memory>
#include <vector>

namespace {
struct Free {
    void operator()(OspCuller *culler) const { osp_culler_free(culler); }
};

std::unique_ptr<OspCuller, Free> make() {
    OspCuller *culler = nullptr;
    osp_culler_new(&culler);
    return std::unique_ptr<OspCuller, Free>(culler);
}
} // namespace

int main() {
    const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    auto culler = make();
    std::vector<OspBox> boxes = {{{0, 0, 0}, {1, 1, 1}}, {{5, 5, 5}, {6, 6, 6}}};
    std::vector<uint64_t> keys = {70, 80};
    std::size_t count = 0;
    OspCamera camera = {};
    OspStatus status = osp_culler_set(culler.get(), keys.data(), boxes.data(), boxes.size());
    if (status == OSP_STATUS_OK) {
        status = osp_camera_f32(identity, OSP_DEPTH_ZERO_TO_ONE, &camera);
    }
    if (status == OSP_STATUS_OK) {
        status = osp_culler_cull(culler.get(), &camera, 1, nullptr);
    }
    if (status == OSP_STATUS_OK) {
        status = osp_culler_visible(culler.get(), 0, keys.data(), keys.size(), &count);
    }
    if (status != OSP_STATUS_OK || count != 1 || keys[0] != 70) {
        std::fprintf(stderr, "expected the box 70 alone, found %zu boxes: %s\n", count, osp_last_error());
        return 1;
    }
    std::puts("one box of two in view, in C++ with the static library");
    return 0;
}
