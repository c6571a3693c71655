// Builds the depth pyramid. A texel of level 1 is the farthest depth of all samples of 2 x 2 pixels. A texel of each
// later level is the farthest of 2 x 2 texels of the level before, up to a single texel. Depth is reversed, so the
// farthest depth is the smallest number. Texel i of level L stands for the pixels from i * 2^L to (i + 1) * 2^L that
// lie in the picture. The size of a level is half the size of the level before, rounded up.

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var depth: texture_depth_multisampled_2d;
@group(0) @binding(3) var<storage, read_write> pyramid: array<f32>;

fn farthest(at: vec2<u32>) -> f32 {
    let two = min(textureLoad(depth, at, 0), textureLoad(depth, at, 1));
    return min(two, min(textureLoad(depth, at, 2), textureLoad(depth, at, 3)));
}

fn farthest_of_four(at: vec2<u32>) -> f32 {
    let low = at * 2u;
    // At the border the last column or row counts twice.
    let high = min(low + 1u, vec2(params.width, params.height) - 1u);
    let upper = min(farthest(low), farthest(vec2(high.x, low.y)));
    let lower = min(farthest(vec2(low.x, high.y)), farthest(high));
    return min(upper, lower);
}

// Computes level 1, and level 2 if there is one. An invocation computes four texels of level 1.
@compute @workgroup_size(8, 8)
fn base(@builtin(global_invocation_id) at: vec3<u32>) {
    let one = params.levels[1];
    if at.x * 2u >= one.y || at.y * 2u >= one.z {
        return;
    }
    let low = at.xy * 2u;
    let high = min(low + 1u, one.yz - 1u);
    let a = farthest_of_four(low);
    let b = farthest_of_four(vec2(high.x, low.y));
    let c = farthest_of_four(vec2(low.x, high.y));
    let d = farthest_of_four(high);
    pyramid[low.y * one.y + low.x] = a;
    pyramid[low.y * one.y + high.x] = b;
    pyramid[high.y * one.y + low.x] = c;
    pyramid[high.y * one.y + high.x] = d;
    if params.level_count > 2u {
        let two = params.levels[2];
        pyramid[two.x + at.y * two.y + at.x] = min(min(a, b), min(c, d));
    }
}

@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) at: vec3<u32>) {
    let to = params.levels[span.first];
    let below = params.levels[span.first - 1u];
    if at.x >= to.y || at.y >= to.z {
        return;
    }
    let low = at.xy * 2u;
    // At the border the last column or row counts twice.
    let high = min(low + 1u, below.yz - 1u);
    let upper = min(pyramid[below.x + low.y * below.y + low.x], pyramid[below.x + low.y * below.y + high.x]);
    let lower = min(pyramid[below.x + high.y * below.y + low.x], pyramid[below.x + high.y * below.y + high.x]);
    pyramid[to.x + at.y * to.y + at.x] = min(upper, lower);
}
