// What was visible in the last frame and is in view in this one: its numbers in any order, for a pass without colours.

struct Span {
    // Handles from here …
    first: u32,
    // … to here.
    end: u32,
    first_sum: u32,
    // Where in the list the page begins.
    base: u32,
    // Where in `args` the page's draw calls are: the one of this shader, then that of the colours.
    args: u32,
    first_polygon: u32,
}

struct Handle {
    block: u32,
    mask: u32,
    place: u32,
}

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<storage, read> handles: array<Handle>;
@group(0) @binding(2) var<storage, read> remembered: array<u32>;
@group(0) @binding(3) var<storage, read_write> recalled: array<u32>;
@group(0) @binding(4) var<storage, read_write> args: array<atomic<u32>>;

const LANES: u32 = 256u;

var<workgroup> count: atomic<u32>;
var<workgroup> first: u32;

@compute @workgroup_size(LANES)
fn recall(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = span.first + group.x * LANES + lane;
    var bits = 0u;
    var block = 0u;
    if at < span.end {
        let handle = handles[at];
        block = handle.block;
        bits = handle.mask & remembered[block];
    }
    let own = atomicAdd(&count, countOneBits(bits));
    workgroupBarrier();
    if lane == 0u {
        first = atomicAdd(&args[span.args], atomicLoad(&count) * 6u) / 6u;
    }
    workgroupBarrier();
    var to = span.base + first + own;
    while bits != 0u {
        recalled[to] = block * 16u + firstTrailingBit(bits);
        bits &= bits - 1u;
        to += 1u;
    }
}
