// The boxes of occlusion queries, grown by a pixel: whatever sample a polygon inside covers, a face of its box covers in
// front of it. A box that comes near the eye becomes the whole picture, as near as can be: its query counts something.

struct View {
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
}

struct Pixel {
    // Width and height of a pixel at distance 1 along the view.
    size: vec2<f32>,
    nothing: vec2<f32>,
}

struct Box {
    low: vec4<f32>,
    high: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> pixel: Pixel;
@group(0) @binding(2) var<storage, read> boxes: array<Box>;

// How many pixels a box grows to each side.
const MORE: f32 = 1.5;

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
    let more = farthest * max(pixel.size.x, pixel.size.y) * MORE + max(length(low), length(high)) * 1.0e-5;
    low -= more;
    high += more;
    var is_clear = true;
    for (var i = 0u; i < 8u; i++) {
        let c = corner(low, high, i);
        is_clear = is_clear && c.z < c.w * 0.999;
    }
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
