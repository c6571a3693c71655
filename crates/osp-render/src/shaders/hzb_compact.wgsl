// Lists the polygons that are not hidden, in drawing order. `count` counts the polygons of each group of cluster masks,
// `scan` computes prefix sums of these counts, and `scatter` writes the polygons to their positions.

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<storage, read> handles: array<Handle>;
// Each cluster mask, without hidden polygons.
@group(0) @binding(2) var<storage, read> kept: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;
@group(0) @binding(4) var<storage, read_write> list: array<u32>;
@group(0) @binding(5) var<storage, read_write> args: array<atomic<u32>>;

const LANES: u32 = 256u;

var<workgroup> total: atomic<u32>;
var<workgroup> summed: array<u32, LANES>;

fn kept_at(at: u32) -> vec2<u32> {
    if at < span.end {
        return kept[at];
    }
    return vec2(0u);
}

fn polygons_of(mask: vec2<u32>) -> u32 {
    return countOneBits(mask.x) + countOneBits(mask.y);
}

// The sum of the numbers of this invocation and all invocations before it.
fn sum_up_to(lane: u32, number: u32) -> u32 {
    summed[lane] = number;
    workgroupBarrier();
    for (var step = 1u; step < LANES; step *= 2u) {
        var before = 0u;
        if lane >= step {
            before = summed[lane - step];
        }
        workgroupBarrier();
        summed[lane] += before;
        workgroupBarrier();
    }
    return summed[lane];
}

@compute @workgroup_size(LANES)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    atomicAdd(&total, polygons_of(kept_at(span.first + group.x * LANES + lane)));
    workgroupBarrier();
    if lane == 0u {
        sums[span.first_sum + group.x] = atomicLoad(&total);
    }
}

// Replaces each group's count by the sum of the counts before it. One workgroup for each page.
@compute @workgroup_size(LANES)
fn scan(@builtin(local_invocation_index) lane: u32) {
    let groups = (span.end - span.first + LANES - 1u) / LANES;
    var before = 0u;
    for (var first = 0u; first < groups; first += LANES) {
        let at = first + lane;
        var own = 0u;
        if at < groups {
            own = sums[span.first_sum + at];
        }
        let up_to = sum_up_to(lane, own);
        if at < groups {
            sums[span.first_sum + at] = before + up_to - own;
        }
        before += summed[LANES - 1u];
        workgroupBarrier();
    }
    if lane == 0u {
        atomicAdd(&args[2], before);
        for (var draw = 0u; draw < span.draws; draw++) {
            let polygons = min(before - min(before, draw * span.draw_len), span.draw_len);
            atomicStore(&args[span.args + 1u + (span.draws + draw) * 5u], polygons * 6u);
        }
    }
}

@compute @workgroup_size(LANES)
fn scatter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = span.first + group.x * LANES + lane;
    let own = kept_at(at);
    let up_to = sum_up_to(lane, polygons_of(own));
    if at >= span.end {
        return;
    }
    let to = span.base + sums[span.first_sum + group.x] + up_to - polygons_of(own);
    let first = handles[at].cluster * 64u;
    list_bits(to, first, own.x);
    list_bits(to + countOneBits(own.x), first + 32u, own.y);
}
