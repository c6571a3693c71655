// The header in C++, with a handle that frees itself.
#include "osp.h"

#include <cstdio>
#include <memory>
#include <vector>

namespace {
struct Free {
    void operator()(OspIndex *index) const { osp_index_free(index); }
};

std::unique_ptr<OspIndex, Free> make() {
    OspIndex *index = nullptr;
    osp_index_new(nullptr, &index);
    return std::unique_ptr<OspIndex, Free>(index);
}
} // namespace

int main() {
    const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    auto index = make();
    std::vector<OspBox> boxes = {{{0, 0, 0}, {1, 1, 1}}, {{5, 5, 5}, {6, 6, 6}}};
    std::vector<uint32_t> ids(boxes.size());
    std::size_t count = 0;
    OspStatus status = osp_index_insert(index.get(), boxes.data(), boxes.size(), ids.data());
    if (status == OSP_STATUS_OK) {
        status = osp_index_commit(index.get());
    }
    if (status == OSP_STATUS_OK) {
        status = osp_index_frustum(index.get(), identity, OSP_DEPTH_ZERO_TO_ONE, ids.data(), ids.size(), &count);
    }
    if (status != OSP_STATUS_OK || count != 1 || ids[0] != 0) {
        std::fprintf(stderr, "expected box 0 alone, found %zu boxes: %s\n", count, osp_last_error());
        return 1;
    }
    std::puts("one box of two in view, in C++ with the static library");
    return 0;
}
