// Draws the boxes of occlusion queries, enlarged by `MORE` pixels. At every sample that a polygon in the box covers, a
// face of the box covers the polygon. A box close to the eye is drawn over the whole picture at the nearest depth, so
// that its query counts samples.

struct View {
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
}

struct Pixel {
    // Width and height of a pixel at distance 1 along the view.
    size: vec2<f32>,
    // The longer side of the picture, pixels.
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

// Enlargement of a box to each side, pixels. It exceeds the relative error of a polygon's corner and an edge of its
// box: 1/128 pixel by snapping, and twice `MOST_CORNER_ERROR` by rounding.
const MORE: f32 = 1.5;
// Further enlargement, as a part of the distance from the eye. It exceeds the rounding when the eye is subtracted from
// a corner.
const FROM_EYE: f32 = 1.0e-5;
// A box is drawn as a box only if each corner is beyond the near plane by a thousandth of its distance. Rounding is
// below one part in 10,000 (`hzb_test.wgsl`). If the near plane cut a box, faces in front of its polygons would be
// missing. Behind the eye w is negative and z is not: the condition is false for such a corner, and for NaN.
const BEYOND_NEAR: f32 = 0.999;
// Rounding error of a corner as in `hzb_test.wgsl`, as a fraction of the picture's side, and its limit here, pixels.
// Polygons in a box are no farther outside the picture than the box's corners.
const ROUNDING: f32 = 1.0 / 524288.0;
const MOST_CORNER_ERROR: f32 = 0.7;

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
    is_clear = is_clear && pixel.side * ROUNDING * max(spread, cut) < MOST_CORNER_ERROR;
    // Faces of a cube, two triangles each. A corner's number has the bits x, y, z.
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
        // Every face covers the whole picture.
        let at = select(vec2(-1.0), vec2(1.0), vec2((corners[index % 6u] & 1u) != 0u, (corners[index % 6u] & 2u) != 0u));
        return vec4(at, 1.0, 1.0);
    }
    return corner(low, high, i);
}
