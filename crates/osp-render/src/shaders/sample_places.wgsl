// Measures the positions of the samples in a pixel. `grow` draws a depth that grows to the right, or down, over a
// picture of 2 x 2 pixels; `read` reads the depth of each sample.

@group(0) @binding(0) var depth: texture_depth_multisampled_2d;
@group(0) @binding(1) var<storage, read_write> depths: array<f32, 16>;

@vertex
fn grow(@builtin(vertex_index) index: u32, @builtin(instance_index) axis: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers the picture; `at` is 0 to 1 over it, right and down.
    let at = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    let depth = select(at.y, at.x, axis == 0u) * 0.5;
    return vec4(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, depth, 1.0);
}

@compute @workgroup_size(2, 2)
fn read(@builtin(local_invocation_id) pixel: vec3<u32>, @builtin(local_invocation_index) number: u32) {
    for (var i = 0u; i < 4u; i++) {
        depths[number * 4u + i] = textureLoad(depth, pixel.xy, i);
    }
}
