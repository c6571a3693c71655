// Lists the polygons in view that were visible in the last frame, in any order, for a pass without colours.

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<storage, read> handles: array<Handle>;
@group(0) @binding(2) var<storage, read> remembered: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> list: array<u32>;
@group(0) @binding(4) var<storage, read_write> args: array<atomic<u32>>;

const LANES: u32 = 256u;

var<workgroup> count: atomic<u32>;
var<workgroup> first: u32;

@compute @workgroup_size(LANES)
fn recall(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = span.first + group.x * LANES + lane;
    var mask = vec2(0u);
    var cluster = 0u;
    if at < span.end {
        let handle = handles[at];
        cluster = handle.cluster;
        mask = vec2(handle.low, handle.high) & remembered[cluster];
    }
    let own = atomicAdd(&count, countOneBits(mask.x) + countOneBits(mask.y));
    workgroupBarrier();
    if lane == 0u {
        let polygons = atomicLoad(&count);
        first = atomicAdd(&args[span.args], polygons);
        atomicAdd(&args[1], polygons);
        add_to_draws(first, first + polygons);
    }
    workgroupBarrier();
    let to = span.base + first + own;
    list_bits(to, cluster * 64u, mask.x);
    list_bits(to + countOneBits(mask.x), cluster * 64u + 32u, mask.y);
}

// Adds the polygons at these positions of the page to the page's draw calls.
fn add_to_draws(begin: u32, end: u32) {
    var at = begin;
    while at < end {
        let draw = at / span.draw_len;
        let next = min((draw + 1u) * span.draw_len, end);
        atomicAdd(&args[span.args + 1u + draw * 5u], (next - at) * 6u);
        at = next;
    }
}
