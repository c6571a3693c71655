// The depth pyramid: for each pixel the farthest depth of its samples, then for 2 x 2 texels the farthest of them, up to
// a single one. Depth is reversed, so the farthest is the least. Texel i of level L stands for the pixels from i * 2^L to
// (i + 1) * 2^L, as far as the picture goes: a level is half the one below, rounded up, whatever the size.

struct Span {
    // The level.
    first: u32,
    end: u32,
    first_sum: u32,
    base: u32,
    args: u32,
    first_polygon: u32,
}

struct Params {
    // First texel, width, height of each level.
    levels: array<vec4<u32>, 16>,
    width: u32,
    height: u32,
    level_count: u32,
    group: u32,
    bound: u32,
    is_fine: u32,
}

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var depth: texture_depth_multisampled_2d;
@group(0) @binding(3) var<storage, read_write> pyramid: array<f32>;

@compute @workgroup_size(8, 8)
fn base(@builtin(global_invocation_id) at: vec3<u32>) {
    if at.x >= params.width || at.y >= params.height {
        return;
    }
    let near = min(textureLoad(depth, at.xy, 0), textureLoad(depth, at.xy, 1));
    let far = min(near, min(textureLoad(depth, at.xy, 2), textureLoad(depth, at.xy, 3)));
    pyramid[at.y * params.width + at.x] = far;
}

@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) at: vec3<u32>) {
    let to = params.levels[span.first];
    let below = params.levels[span.first - 1u];
    if at.x >= to.y || at.y >= to.z {
        return;
    }
    let low = at.xy * 2u;
    // At the border the last column or row stands for two.
    let high = min(low + 1u, below.yz - 1u);
    let upper = min(pyramid[below.x + low.y * below.y + low.x], pyramid[below.x + low.y * below.y + high.x]);
    let lower = min(pyramid[below.x + high.y * below.y + low.x], pyramid[below.x + high.y * below.y + high.x]);
    pyramid[to.x + at.y * to.y + at.x] = min(upper, lower);
}
