// Removes cluster masks whose occlusion query counted no sample from the pass with colours.

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<storage, read> handles: array<Handle>;
// The query of each cluster mask, or NOTHING.
@group(0) @binding(2) var<storage, read> queries: array<u32>;
// Counted samples of each query, 64 bits.
@group(0) @binding(3) var<storage, read> results: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> remembered: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> kept: array<vec2<u32>>;

const NOTHING: u32 = 0xffffffffu;

@compute @workgroup_size(256)
fn apply(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let at = span.first + invocation.x;
    if at >= span.end {
        return;
    }
    let handle = handles[at];
    let query = queries[at];
    var mask = vec2(handle.low, handle.high);
    if query != NOTHING && all(results[query] == vec2(0u)) {
        mask = vec2(0u);
    }
    kept[at] = mask;
    remembered[handle.cluster] = mask;
}
