// Where the first light does not reach: depth as that light sees it, of all that throws a shadow; follows painted.wgsl.

struct Shade {
    // Clip space of the light from metres relative to the middle of what throws shadows.
    clip_from_middle: mat4x4<f32>,
    // w: whether anything throws a shadow.
    middle: vec4<f32>,
    // x: how far from a surface a shadow begins, metres. y: the size of a texel, metres.
    numbers: vec4<f32>,
}

@group(3) @binding(0) var<uniform> shade: Shade;
@group(3) @binding(1) var shadow_map: texture_depth_2d;
@group(3) @binding(2) var nearer: sampler_comparison;

// How much of the first light reaches a place, 0 to 1; the normal is that of the side that is seen.
fn first_light_at(from_eye: vec3<f32>, normal: vec3<f32>) -> f32 {
    if shade.middle.w == 0.0 {
        return 1.0;
    }
    let from_middle = from_eye + (view.eye_in_world.xyz - shade.middle.xyz);
    let towards = -surroundings.ways[0].xyz * shade.numbers.x + normal * (1.5 * shade.numbers.y);
    let at = shade.clip_from_middle * vec4(from_middle + towards, 1.0);
    let uv = vec2(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y);
    let share = textureSampleCompareLevel(shadow_map, nearer, uv, saturate(at.z));
    // What is beside the map is in the light.
    let is_inside = all(abs(at.xy) < vec2(1.0));
    return select(1.0, share, is_inside);
}

// From the light; the list holds what throws shadows.
@vertex
fn vertex_shadow(@builtin(vertex_index) index: u32) -> Cut {
    var out: Cut;
    let id = polygon_at(index / 4u);
    if id == NOTHING {
        out.position = NOWHERE;
        return out;
    }
    let polygon = fetch(id);
    let corner = index % 4u;
    let alpha = f32((polygon.corners[1].w >> (8u * corner)) & 0xffu) / 255.0;
    out.position = view.clip_from_eye * vec4(point_of(polygon, corner), 1.0);
    out.texture = vec3(unpack2x16snorm(polygon.uv[corner]) * UV_LIMIT, alpha);
    out.material = polygon.corners[2].w & 0xffffu;
    return out;
}

@fragment
fn fragment_shadow(in: Cut) {
    let gradients = Gradients(dpdx(in.texture.xy), dpdy(in.texture.xy));
    let material = materials[in.material];
    let texture = texture_of(material, material.kinds.z, in.texture.xy + texture_shift(material), gradients);
    if in.texture.z * texture.a < material.numbers.x {
        discard;
    }
}
