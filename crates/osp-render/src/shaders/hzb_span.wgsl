// Parameters that the compute shaders of occlusion culling share; they follow span.rs and run.rs.

// The work of a dispatch.
struct Span {
    // First cluster mask, first position in the list of transparent polygons, or the level of the pyramid.
    first: u32,
    // End of the cluster masks or positions.
    end: u32,
    // For a page, index in `sums` of its first prefix sum. For a chunk, index in `candidates` of its first candidate.
    first_sum: u32,
    // Position in the list at which the page begins.
    base: u32,
    // For a page, index in `args` of its count; its draw calls for depth, then for colours, follow. For a chunk, index
    // of its count in `candidates`.
    args: u32,
    // The first polygon of the chunk.
    first_polygon: u32,
    // Number of draw calls of the page for depth, and the same number for colours.
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
    // 1 if bounds are too far away, which a test must detect.
    is_wrong: u32,
}

// Opaque polygons of a cluster, a bit each.
struct Handle {
    // The first polygon of the cluster has 64 times this number.
    cluster: u32,
    // The bits of the first 32 polygons.
    low: u32,
    // The bits of the last 32 polygons.
    high: u32,
}

