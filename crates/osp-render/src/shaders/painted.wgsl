// The paint of brushes; follows polygon.wgsl. As in Tilt Brush, where the brushes come from, colours, light and fog are
// sRGB numbers without conversion.

struct Material {
    // rgb: reflectance at normal incidence. w: gloss, 0 to 1.
    f0: vec4<f32>,
    // x: alpha below which nothing is drawn. y: strength of emitted light, an exponent. z: anisotropy of the texture.
    numbers: vec4<f32>,
    // x: lighting and flags. y: effect. z: layer of the texture. w: layer of the normal map.
    kinds: vec4<u32>,
}

struct Surroundings {
    // Colours of the sky straight down and straight up, and its up direction. sky_low.w: 1 for stars, 2 for stars and
    // the Milky Way. sky_up.w: number of the scenery, 0 for none.
    sky_low: vec4<f32>,
    sky_high: vec4<f32>,
    sky_up: vec4<f32>,
    floor: vec4<f32>,
    // w: density per metre of depth.
    fog: vec4<f32>,
    // w: strength of reflections.
    ambient: vec4<f32>,
    // Directions in which the two lights shine, and their colours. light_directions[0].w: 1 if surfaces reflect lamps.
    // light_directions[1].w: 1 if the second light and the ambient light are added as sRGB numbers.
    light_directions: array<vec4<f32>, 2>,
    lights: array<vec4<f32>, 2>,
    // x: seconds. y: depth at which shadows have faded out, 0 if they do not fade.
    moment: vec4<f32>,
    // A quaternion.
    room_from_world: vec4<f32>,
}

@group(2) @binding(0) var<uniform> materials: array<Material, 160>;
@group(2) @binding(1) var<uniform> surroundings: Surroundings;
@group(2) @binding(2) var textures: texture_2d_array<f32>;
@group(2) @binding(3) var repeating: sampler;
@group(2) @binding(4) var clamping: sampler;
// A second binding of `textures` for the second sampler: in OpenGL a texture has one sampler.
@group(2) @binding(5) var clamped_textures: texture_2d_array<f32>;

const UV_LIMIT: f32 = 8.0;
const NO_TEXTURE: u32 = 0xffffffffu;
// Flags of a polygon.
const TURNED_TO_EYE: u32 = 0x10000u;
const IS_SMOOTH: u32 = 0x20000u;
// Kinds of lighting, and flags of a material.
const LAMBERT: u32 = 1u;
const SPECULAR: u32 = 2u;
const ONE_SIDED: u32 = 4u;
const IS_CLAMPED: u32 = 8u;

struct Painted {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) color: vec4<f32>,
    // Texture coordinates, alpha.
    @location(1) texture: vec3<f32>,
    @location(2) normal: vec3<f32>,
    // xyz: position relative to the eye. w: depth along the view.
    @location(3) from_eye: vec4<f32>,
    // x: material. y: style. z: 1 if the eye is on the side to which the normals point.
    @location(4) @interpolate(flat, either) kinds: vec3<u32>,
}

// Position of a corner relative to the eye. A square that faces the eye has the centre and size of the stored square.
fn painted_point(polygon: Polygon, corner: u32) -> vec3<f32> {
    if (polygon.corners[2].w & TURNED_TO_EYE) == 0u {
        return point_of(polygon, corner);
    }
    let a = point_of(polygon, 0u);
    let c = point_of(polygon, 2u);
    let middle = (a + c) * 0.5;
    // Half an edge is the diagonal divided by the root of 8.
    let half = length(c - a) * 0.35355339;
    let right = normalize(cross(scaled(middle), view.up_in_world.xyz));
    let up = normalize(cross(right, scaled(middle)));
    let roll = bitcast<f32>(polygon.normals.x);
    let turn = vec2(cos(roll), sin(roll));
    let x = select(-half, half, corner == 1u || corner == 2u);
    let y = select(-half, half, corner >= 2u);
    return middle + right * (x * turn.x - y * turn.y) + up * (x * turn.y + y * turn.x) + drift_of(polygon);
}

// Offset of a polygon by its animation, limited so that the polygon stays in its box.
fn drift_of(polygon: Polygon) -> vec3<f32> {
    let most = bitcast<f32>(polygon.corners[3].w);
    if !(most > 0.0) {
        return vec3(0.0);
    }
    let alpha = f32(polygon.corners[1].w & 0xffu) / 255.0;
    let at = bitcast<vec3<f32>>(polygon.corners[0].xyz);
    return clamp(drift(materials[polygon.corners[2].w & 0xffffu], alpha, at), vec3(-most), vec3(most));
}

// Whether the eye is on the side of the polygon that its normals point to.
fn is_front_seen(polygon: Polygon) -> bool {
    let flags = polygon.corners[2].w;
    if (flags & TURNED_TO_EYE) != 0u {
        return true;
    }
    let normal = flat_normal(polygon);
    let is_towards = dot(normal, scaled(point_of(polygon, 0u) + point_of(polygon, 2u))) <= 0.0;
    let own = unpack_normal(polygon.normals.x) + unpack_normal(polygon.normals.y)
        + unpack_normal(polygon.normals.z) + unpack_normal(polygon.normals.w);
    return is_towards == ((flags & IS_SMOOTH) == 0u || dot(normal, own) >= 0.0);
}

// Decodes an octahedral normal.
fn unpack_normal(word: u32) -> vec3<f32> {
    let o = unpack2x16snorm(word);
    let z = 1.0 - abs(o.x) - abs(o.y);
    let back = max(-z, 0.0);
    return normalize(vec3(o + select(vec2(back), vec2(-back), o >= vec2(0.0)), z));
}

@vertex
fn vertex_painted(@builtin(vertex_index) index: u32, @builtin(instance_index) style: u32) -> Painted {
    var out: Painted;
    let id = polygon_at(index / 4u);
    if id == NOTHING {
        out.position = NOWHERE;
        return out;
    }
    let polygon = fetch(id);
    let corner = index % 4u;
    let point = painted_point(polygon, corner);
    let flags = polygon.corners[2].w;
    out.position = view.clip_from_eye * vec4(point, 1.0);
    out.color = unpack4x8unorm(polygon.corners[0].w);
    let alpha = f32((polygon.corners[1].w >> (8u * corner)) & 0xffu) / 255.0;
    out.texture = vec3(unpack2x16snorm(polygon.uv[corner]) * UV_LIMIT, alpha);
    if (flags & TURNED_TO_EYE) != 0u {
        out.normal = -normalize(scaled(point));
    } else if (flags & IS_SMOOTH) != 0u {
        out.normal = unpack_normal(polygon.normals[corner]);
    } else {
        out.normal = flat_normal(polygon);
    }
    out.from_eye = vec4(point, out.position.w);
    out.kinds = vec3(flags & 0xffffu, style, select(0u, 1u, is_front_seen(polygon)));
    return out;
}

struct Cut {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) texture: vec3<f32>,
    @location(1) @interpolate(flat, either) material: u32,
}

// For passes without colours, which draw only listed polygons.
@vertex
fn vertex_cut(@builtin(vertex_index) index: u32) -> Cut {
    let polygon = fetch(draw_list[index / 4u]);
    let corner = index % 4u;
    let alpha = f32((polygon.corners[1].w >> (8u * corner)) & 0xffu) / 255.0;
    var out: Cut;
    out.position = view.clip_from_eye * vec4(painted_point(polygon, corner), 1.0);
    out.texture = vec3(unpack2x16snorm(polygon.uv[corner]) * UV_LIMIT, alpha);
    out.material = polygon.corners[2].w & 0xffffu;
    return out;
}

struct Gradients {
    x: vec2<f32>,
    y: vec2<f32>,
}

// A texture that is seen from the side is the mean of up to `material.numbers.z` samples along its far direction.
fn texture_of(material: Material, layer: u32, uv: vec2<f32>, gradients: Gradients) -> vec4<f32> {
    if layer == NO_TEXTURE {
        return vec4(1.0);
    }
    let lengths = vec2(length(gradients.x), length(gradients.y));
    let is_far = lengths.y > lengths.x;
    let far = select(gradients.x, gradients.y, is_far);
    let near = select(gradients.y, gradients.x, is_far);
    let ratio = max(lengths.x, lengths.y) / max(min(lengths.x, lengths.y), 1.0e-9);
    let count = clamp(ceil(ratio), 1.0, material.numbers.z);
    var sum = vec4(0.0);
    for (var i = 0; i < i32(count); i++) {
        let at = uv + far * ((f32(i) + 0.5) / count - 0.5);
        if (material.kinds.x & IS_CLAMPED) != 0u {
            sum += textureSampleGrad(clamped_textures, clamping, at, layer, far / count, near);
        } else {
            sum += textureSampleGrad(textures, repeating, at, layer, far / count, near);
        }
    }
    return sum / count;
}

// Margin above the cutoff in the pass without colours. Despite rounding, this pass then writes no depth of a texel that
// the pass with colours discards.
const SURELY: f32 = 0.02;

@fragment
fn fragment_cut(in: Cut) {
    let gradients = Gradients(dpdx(in.texture.xy), dpdy(in.texture.xy));
    let material = materials[in.material];
    let cutoff = material.numbers.x;
    if cutoff > 0.0 {
        let uv = in.texture.xy + texture_shift(material);
        if in.texture.z * texture_of(material, material.kinds.z, uv, gradients).a < cutoff + SURELY {
            discard;
        }
    }
}

// Light that falls on a matte surface. `share` is the fraction of the first light that reaches the surface.
fn light_on(normal: vec3<f32>, share: f32) -> vec3<f32> {
    let first = surroundings.lights[0].rgb * max(dot(normal, -surroundings.light_directions[0].xyz), 0.0) * share;
    let y = dot(normal, -surroundings.light_directions[1].xyz);
    // Tilt Brush stores the second light as spherical harmonics.
    let second = 0.0882 + 0.4706 * y + 0.4412 * y * y;
    let ambient = surroundings.ambient.rgb;
    let color = surroundings.lights[1].rgb;
    if surroundings.light_directions[1].w == 1.0 {
        return first + ambient + color * max(second, 0.0);
    }
    // It adds them to the ambient light as linear numbers, although it adds all other light as sRGB numbers.
    let sum = linear_from_srgb(ambient) + linear_from_srgb(color) * second;
    return first + srgb_from_linear(max(sum, vec3(0.0)));
}

// Rotates a direction from world space to the space of the room.
fn in_room(way: vec3<f32>) -> vec3<f32> {
    let q = surroundings.room_from_world;
    return way + 2.0 * cross(q.xyz, cross(q.xyz, way) + q.w * way);
}

// A lamp that surfaces reflect: its direction in the room, and its light as that of a point.
struct Lamp {
    direction: vec3<f32>,
    light: vec3<f32>,
    // The square of its width, in the unit of a squared roughness.
    width: f32,
}

const LAMPS: array<Lamp, 2> = array(
    Lamp(vec3(-0.615, 0.707, -0.348), vec3(1.45, 1.16, 0.95), 0.02),
    Lamp(vec3(0.0, 0.508, 0.862), vec3(2.4, 2.4, 2.94), 0.03),
);

// Light that a surface of this roughness reflects from the direction `ray`: a dark room with two lamps, or one even
// light.
fn mirrored_room(ray: vec3<f32>, roughness: f32) -> vec3<f32> {
    if surroundings.light_directions[0].w == 0.0 {
        return vec3(0.06);
    }
    let up = ray.y;
    var sum = vec3(mix(mix(0.048, 0.093, saturate(-up)), 0.002, smoothstep(-0.1, 0.6, up)));
    for (var i = 0; i < 2; i++) {
        let lamp = LAMPS[i];
        // A GGX lobe around the reflected direction. Roughness and the size of the lamp widen it.
        let wide = min(roughness * roughness + lamp.width, 1.0);
        let across = 0.5 + 0.5 * dot(ray, lamp.direction);
        let d = across * (wide - 1.0) + 1.0;
        sum += lamp.light * (wide / (4.0 * PI * d * d));
    }
    return sum;
}

// The highlight of the first light, and reflections.
fn highlight(material: Material, f0: vec3<f32>, normal: vec3<f32>, to_eye: vec3<f32>, share: f32) -> vec3<f32> {
    let gloss = material.f0.w;
    let roughness = (1.0 - gloss) * (1.0 - gloss);
    let to_light = -surroundings.light_directions[0].xyz;
    let half = normalize(to_light + to_eye);
    let n_l = max(dot(normal, to_light), 0.0);
    let n_v = abs(dot(normal, to_eye));
    let n_h = max(dot(normal, half), 0.0);
    let l_h = max(dot(to_light, half), 0.0);
    let d = n_h * n_h * (roughness * roughness - 1.0) + 1.0;
    let distribution = roughness * roughness / (3.14159265 * d * d + 1.0e-7);
    let visibility = 0.5 / (n_l * (n_v * (1.0 - roughness) + roughness) + n_v * (n_l * (1.0 - roughness) + roughness) + 1.0e-5);
    let bright = sqrt(max(3.14159265 * visibility * distribution, 1.0e-4)) * n_l;
    let lit = share * bright * surroundings.lights[0].rgb * (f0 + (1.0 - f0) * pow(1.0 - l_h, 5.0));
    let most = saturate(gloss + max(f0.r, max(f0.g, f0.b)));
    let mirrored = mix(f0, vec3(most), pow(1.0 - n_v, 5.0)) * (1.0 - 0.28 * roughness * (1.0 - gloss));
    let seen = mirrored_room(in_room(reflect(-to_eye, normal)), roughness);
    return lit + surroundings.ambient.w * seen * mirrored;
}

fn lit(
    material: Material,
    albedo: vec3<f32>,
    f0: vec3<f32>,
    normal: vec3<f32>,
    to_eye: vec3<f32>,
    share: f32,
) -> vec3<f32> {
    let kind = material.kinds.x & 3u;
    if kind == LAMBERT {
        return albedo * light_on(normal, share);
    }
    if kind == SPECULAR {
        let most = min(max(f0.r, max(f0.g, f0.b)), 1.0);
        return albedo * (1.0 - most) * light_on(normal, share) + highlight(material, f0, normal, to_eye, share);
    }
    return albedo;
}

fn fogged(color: vec3<f32>, depth: f32) -> vec3<f32> {
    return mix(surroundings.fog.rgb, color, exp(-surroundings.fog.w * max(depth, 0.0)));
}

// The normal by the normal map, if the material has one.
fn relief(material: Material, in: Painted, normal: vec3<f32>, gradients: Gradients, dx: vec3<f32>, dy: vec3<f32>) -> vec3<f32> {
    if material.kinds.w == NO_TEXTURE {
        return normal;
    }
    let of_texture = texture_of(material, material.kinds.w, in.texture.xy, gradients).xyz * 2.0 - 1.0;
    return in_world(of_texture, normal, gradients, dx, dy);
}

fn styled(color: vec3<f32>, style: Style) -> vec3<f32> {
    return mix(color, style.tint.rgb, style.tint.a) * (1.0 + style.more.y);
}

// Properties of a fragment's surface.
struct Place {
    normal: vec3<f32>,
    to_eye: vec3<f32>,
    // Whether the eye is on the side to which the polygon's own normals point.
    is_front: bool,
    texture: vec4<f32>,
    gradients: Gradients,
    // For a disco ball, the triangle's normal on the visible side; otherwise the same as `normal`.
    facet: vec3<f32>,
    // For a toon, whether the fragment is on the outline.
    is_rim: bool,
}

// Converts a tangent-space normal to world space: `x` is along the texture, `y` across it, `z` out of the surface.
fn in_world(of_plane: vec3<f32>, normal: vec3<f32>, gradients: Gradients, dx: vec3<f32>, dy: vec3<f32>) -> vec3<f32> {
    // Pixels are counted downwards.
    let across = cross(normal, dy);
    let along = cross(dx, normal);
    let tangent = across * gradients.x.x + along * gradients.y.x;
    let bitangent = across * gradients.x.y + along * gradients.y.y;
    let lengths = vec2(dot(tangent, tangent), dot(bitangent, bitangent));
    if !(min(lengths.x, lengths.y) > 0.0) {
        return normal;
    }
    let slope = of_plane.xy * inverseSqrt(lengths);
    return normalize(tangent * slope.x + bitangent * slope.y + normal * max(of_plane.z, 0.05));
}

// Widest outline of a toon, as a part of the picture's height.
const OUTLINE: f32 = 0.0025;

// Whether a point of a round surface is on the outline: nearer to the surface's silhouette than the width of the
// outline. `view_cosine` is the cosine of the angle between the normal and the direction to the eye.
fn is_outline(in: Painted, view_cosine: f32) -> bool {
    let clip = view.clip_from_eye * vec4(in.from_eye.xyz, 1.0);
    let pixels = OUTLINE * 2.0 / abs(dpdy(clip.y / clip.w));
    // On the flat sides of a tube, `view_cosine` grows with the distance from the rim.
    let change = length(vec2(dpdx(view_cosine), dpdy(view_cosine)));
    return abs(view_cosine) < min(pixels * change, 0.35);
}

fn place_of(in: Painted) -> Place {
    let gradients = Gradients(dpdx(in.texture.xy), dpdy(in.texture.xy));
    let dx = dpdx(in.from_eye.xyz);
    let dy = dpdy(in.from_eye.xyz);
    let material = materials[in.kinds.x];
    let to_eye = -normalize(scaled(in.from_eye.xyz));
    let outwards = normalize(in.normal);
    let is_front = in.kinds.z == 1u;
    let normal = select(-outwards, outwards, is_front);
    let texture = texture_of(material, material.kinds.z, in.texture.xy + texture_shift(material), gradients);
    let is_rim = is_outline(in, dot(normal, to_eye)) && material.kinds.y == TOON;
    if material.kinds.y == DISCO {
        let across = cross(dx, dy);
        let facet = across * (inverseSqrt(max(dot(across, across), 1.0e-30)) * select(-1.0, 1.0, dot(across, normal) >= 0.0));
        return Place(disco_normal(facet, normal, gradients, dx, dy), to_eye, is_front, texture, gradients, facet, false);
    }
    return Place(relief(material, in, normal, gradients, dx, dy), to_eye, is_front, texture, gradients, normal, is_rim);
}

// Colour of a polygon that is not additive.
fn surface_color(in: Painted, place: Place) -> vec3<f32> {
    let material = materials[in.kinds.x];
    let style = view.styles[in.kinds.y];
    if in.kinds.x == 0u {
        return plain_color(in.color.rgb, style, place.normal, place.to_eye);
    }
    let albedo = albedo_of(material, in, place);
    let outwards = select(-1.0, 1.0, place.is_front) * normalize(in.normal);
    // No shadow falls on these brushes.
    let is_bare = material.kinds.y == DISCO || material.kinds.y == LIGHT_WIRE;
    let share = select(first_light_at(in.from_eye.xyz, outwards), 1.0, is_bare);
    let light = lit(material, albedo, f0_of(material, in, place), place.normal, place.to_eye, share);
    let color = styled(light + glow_of(material, in, place), style);
    return fogged(color, in.from_eye.w);
}

@fragment
fn fragment_solid(in: Painted) -> @location(0) vec4<f32> {
    let place = place_of(in);
    let cutoff = materials[in.kinds.x].numbers.x;
    if cutoff > 0.0 && in.texture.z * place.texture.a < cutoff {
        discard;
    }
    return vec4(surface_color(in, place), 1.0);
}

@fragment
fn fragment_transparent(in: Painted) -> @location(0) vec4<f32> {
    let place = place_of(in);
    let cutoff = materials[in.kinds.x].numbers.x;
    let alpha = in.texture.z * place.texture.a;
    if cutoff > 0.0 && alpha < cutoff {
        discard;
    }
    let own = select(alpha, in.color.a, in.kinds.x == 0u);
    return vec4(surface_color(in, place), own * view.styles[in.kinds.y].more.x);
}

@fragment
fn fragment_additive(in: Painted) -> @location(0) vec4<f32> {
    let place = place_of(in);
    let material = materials[in.kinds.x];
    let style = view.styles[in.kinds.y];
    if (material.kinds.x & ONE_SIDED) != 0u && !place.is_front {
        return vec4(0.0);
    }
    let color = emitted(material, in, place);
    // Without this limit, values could become infinite or NaN in the picture's half floats.
    return vec4(clamp(styled(color, style) * style.more.x, vec3(0.0), vec3(30001.0)), 0.0);
}
