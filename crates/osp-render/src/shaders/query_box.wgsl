// The boxes of occlusion queries, grown by a pixel: whatever sample a polygon inside covers, a face of its box covers in
// front of it. A box that comes near the eye becomes the whole picture, as near as can be: its query counts something.

struct View {
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
}

struct Pixel {
    // Width and height of a pixel at distance 1 along the view.
    size: vec2<f32>,
    // Of the picture the longer side, pixels.
    side: f32,
    nothing: f32,
}

struct Box {
    low: vec4<f32>,
    high: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> pixel: Pixel;
@group(0) @binding(2) var<storage, read> boxes: array<Box>;

// How many pixels a box grows to each side. What a corner of a polygon and an edge of its box are moved apart is less: by
// snapping 1/128 pixel, by rounding twice `MOST_PLAY`.
const MORE: f32 = 1.5;
// Besides, of the distance from the eye: more than what subtracting the eye from a corner rounds.
const FROM_EYE: f32 = 1.0e-5;
// A box is only drawn as such if it is beyond the near plane by a thousandth of its distance: rounding is below a part in
// 10,000 (`hzb_test.wgsl`), and what the near plane cuts off a box is missing in front of what is in it. Behind the eye w is
// negative and z is not, so that this holds for no corner there, nor for one that is no number.
const BEYOND_NEAR: f32 = 0.999;
// As in `hzb_test.wgsl`, of the picture's side what the rasteriser may make of corners far beside the picture, and most of
// that, pixels. What is in a box is no farther out.
const ROUNDING: f32 = 1.0 / 524288.0;
const MOST_PLAY: f32 = 0.7;

fn corner(low: vec3<f32>, high: vec3<f32>, i: u32) -> vec4<f32> {
    return view.clip_from_eye * vec4(select(low, high, vec3((i & 1u) != 0u, (i & 2u) != 0u, (i & 4u) != 0u)), 1.0);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) number: u32) -> @builtin(position) vec4<f32> {
    let eye = view.eye_in_world.xyz;
    var low = boxes[number].low.xyz - eye;
    var high = boxes[number].high.xyz - eye;
    var farthest = 0.0;
    for (var i = 0u; i < 8u; i++) {
        farthest = max(farthest, abs(corner(low, high, i).w));
    }
    let more = farthest * max(pixel.size.x, pixel.size.y) * MORE + max(length(low), length(high)) * FROM_EYE;
    low -= more;
    high += more;
    var is_clear = true;
    var spread = 0.0;
    var most = vec2(0.0);
    var least_w = 1.0e30;
    var beside = 1.0;
    let m = view.clip_from_eye;
    let p = max(abs(low), abs(high));
    let sum = abs(m[0]) * p.x + abs(m[1]) * p.y + abs(m[2]) * p.z + abs(m[3]);
    for (var i = 0u; i < 8u; i++) {
        let c = corner(low, high, i);
        is_clear = is_clear && c.z < c.w * BEYOND_NEAR;
        let across = max(abs(c.x), abs(c.y));
        least_w = min(least_w, c.w);
        most = max(most, vec2(across, c.w));
        beside = max(beside, across / c.w);
        spread = max(spread, (max(sum.x, sum.y) + across / c.w * sum.w) / c.w);
    }
    let cut = (most.x + beside * most.y) / least_w;
    is_clear = is_clear && pixel.side * ROUNDING * max(spread, cut) < MOST_PLAY;
    // Faces of a cube, two triangles each: corners as bits x, y, z.
    var corners = array<u32, 36>(
        0u, 2u, 1u, 1u, 2u, 3u,
        4u, 5u, 6u, 5u, 7u, 6u,
        0u, 1u, 4u, 1u, 5u, 4u,
        2u, 6u, 3u, 3u, 6u, 7u,
        0u, 4u, 2u, 2u, 4u, 6u,
        1u, 3u, 5u, 3u, 7u, 5u,
    );
    let i = corners[index];
    if !is_clear {
        // One face covers the picture, the others are the same.
        let at = select(vec2(-1.0), vec2(1.0), vec2((corners[index % 6u] & 1u) != 0u, (corners[index % 6u] & 2u) != 0u));
        return vec4(at, 1.0, 1.0);
    }
    return corner(low, high, i);
}
