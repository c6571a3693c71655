// Parameters that the compute shaders of occlusion culling share; they follow span.rs and run.rs.

// The work of a dispatch.
struct Span {
    // First handle, first place in the list of transparent polygons, or the level of the pyramid.
    first: u32,
    // End of the handles or places.
    end: u32,
    // Place in `sums` at which the page begins, or in `candidates` at which a chunk's list begins.
    first_sum: u32,
    // Place in the list at which the page begins.
    base: u32,
    // Place in `args` of the page's count, then of its draw calls for depth, then for colours. For a chunk, place of
    // its count in `candidates`.
    args: u32,
    // The first polygon of the chunk.
    first_polygon: u32,
    // Draw calls of the page for depth, and as many for colours.
    draws: u32,
    // Largest number of polygons of a draw call.
    draw_len: u32,
}

struct Params {
    // First texel, width, height of each level; level 0 is the picture and not in the buffer.
    levels: array<vec4<u32>, 16>,
    width: u32,
    height: u32,
    level_count: u32,
    // Number of polygons that are tested together: 16, 4 or 1.
    group: u32,
    // Bound of a group. 0: its corners; 1: its bounding box; 2: its farthest corner, which is wrong on purpose.
    bound: u32,
    // Whether the polygons of a group that is not hidden are tested one by one.
    is_fine: u32,
}

// Opaque polygons of a cluster, a bit each.
struct Handle {
    // The first polygon of the cluster has 64 times this number.
    cluster: u32,
    // The bits of the first 32 polygons.
    low: u32,
    // The bits of the others.
    high: u32,
}

