// Counts how often samples were written: the alpha of each sample is its count. Each workgroup has its own sums.

@group(0) @binding(0) var samples: texture_multisampled_2d<f32>;
// x: writes. y: samples that were written at least once.
@group(0) @binding(1) var<storage, read_write> sums: array<vec2<u32>>;

var<workgroup> writes: atomic<u32>;
var<workgroup> covered: atomic<u32>;

@compute @workgroup_size(8, 8)
fn add_up(
    @builtin(global_invocation_id) pixel: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    if all(pixel.xy < textureDimensions(samples)) {
        for (var i = 0; i < i32(textureNumSamples(samples)); i++) {
            let count = u32(round(textureLoad(samples, vec2<i32>(pixel.xy), i).a));
            atomicAdd(&writes, count);
            atomicAdd(&covered, min(count, 1u));
        }
    }
    workgroupBarrier();
    if lane == 0u {
        sums[group.y * groups.x + group.x] = vec2(atomicLoad(&writes), atomicLoad(&covered));
    }
}
