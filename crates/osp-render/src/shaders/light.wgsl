// Light at half resolution. The four samples of a pixel of light lie in the four pixels of the picture that it covers.

@group(0) @binding(0) var scene_depth: texture_depth_multisampled_2d;
@group(1) @binding(0) var light: texture_multisampled_2d<f32>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    // Number of the sample whose depth is written.
    @location(0) @interpolate(flat, either) number: u32,
}

// One triangle that covers the target.
@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) number: u32) -> Corner {
    let uv = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), number);
}

struct Depth {
    @builtin(frag_depth) depth: f32,
    @builtin(sample_mask) mask: u32,
}

// The sample of the picture's pixel that is nearest to each sample of light.
const NEAREST: array<i32, 4> = array(1, 3, 0, 2);

@fragment
fn depth(in: Corner) -> Depth {
    let last = textureDimensions(scene_depth) - 1u;
    let at = vec2<u32>(in.position.xy) * 2u + vec2(in.number & 1u, in.number >> 1u);
    var nearest = NEAREST;
    return Depth(textureLoad(scene_depth, min(at, last), nearest[in.number]), 1u << in.number);
}

@fragment
fn compose(in: Corner) -> @location(0) vec4<f32> {
    let at = vec2<u32>(in.position.xy);
    let number = (at.x & 1u) + 2u * (at.y & 1u);
    return vec4(textureLoad(light, at / 2u, i32(number)).rgb, 0.0);
}
