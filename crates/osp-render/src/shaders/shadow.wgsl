// Shadow map of the first light: depth of all shadow casters in the light's clip space. Follows painted.wgsl.

struct Shade {
    // Transforms positions relative to the middle of the shadow casters, metres, to clip space of the light.
    clip_from_middle: mat4x4<f32>,
    // xyz: middle of the shadow casters, world space. w: whether there are any.
    middle: vec4<f32>,
    // x: distance from a surface at which its shadow begins, metres. y: size of a texel, metres.
    numbers: vec4<f32>,
}

@group(3) @binding(0) var<uniform> shade: Shade;
@group(3) @binding(1) var shadow_map: texture_depth_2d;
@group(3) @binding(2) var nearer: sampler_comparison;

// Fraction of the first light that reaches a point, 0 to 1. `normal` is the normal of the visible side.
fn first_light_at(from_eye: vec3<f32>, normal: vec3<f32>) -> f32 {
    if shade.middle.w == 0.0 {
        return 1.0;
    }
    let from_middle = from_eye + (view.eye_in_world.xyz - shade.middle.xyz);
    let towards = -surroundings.light_directions[0].xyz * shade.numbers.x + normal * (1.5 * shade.numbers.y);
    let at = shade.clip_from_middle * vec4(from_middle + towards, 1.0);
    let uv = vec2(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y);
    let share = textureSampleCompareLevel(shadow_map, nearer, uv, saturate(at.z));
    // Points outside the map are lit.
    let is_inside = all(abs(at.xy) < vec2(1.0));
    // As in Unity, where the brushes come from, shadows begin to fade at three quarters of the depth of their end.
    let end = surroundings.moment.y;
    let depth = (view.clip_from_eye * vec4(from_eye, 1.0)).w;
    let fade = select(0.0, saturate(3.889 * depth / max(end, 1.0e-6) - 2.889), end > 0.0);
    return saturate(select(1.0, share, is_inside) + fade);
}

// The view is that of the light; the draw list has the shadow casters.
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
