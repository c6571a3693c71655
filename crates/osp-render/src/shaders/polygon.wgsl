// Polygons by vertex pulling: four vertices a polygon. The draw list has the polygon's number, and a chunk has its
// corners. World space, metres; clip space with reversed depth. Colours are written as sRGB values.

// Polygons of a chunk.
override CHUNK_LEN: u32 = 131072u;
const CHUNKS_A_PAGE: u32 = 7u;

struct Style {
    // Tint: red, green, blue, and its weight against the polygon's own colour.
    tint: vec4<f32>,
    // x: factor of the opacity. y: added brightness.
    more: vec4<f32>,
}

struct View {
    // Transforms positions relative to the eye, which stay precise far from the world's origin.
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
    styles: array<Style, 8>,
    // Direction that is up on the picture.
    up_in_world: vec4<f32>,
    // Direction from the eye to the lower left corner of the picture, and from there to the lower right and upper left
    // corner.
    corners: array<vec4<f32>, 3>,
    // x: the position of polygon 0. Each later position stands for the next polygon number. From position x on, the
    // draw list has one bit for each polygon.
    all_from: vec4<u32>,
}

struct Polygon {
    // Corner positions as float bits. In the fourth words: the colour; the corners' alpha, a byte each; material and
    // flags; the range of animation, metres.
    corners: array<vec4<u32>, 4>,
    // Texture coordinates, two signed 16-bit numbers a corner, in parts of UV_LIMIT.
    uv: vec4<u32>,
    // Octahedral normals in the same format. For a square that faces the eye, the first word is its roll, as float
    // bits.
    normals: vec4<u32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> draw_list: array<u32>;
@group(1) @binding(0) var<storage, read> chunk_0: array<Polygon>;
@group(1) @binding(1) var<storage, read> chunk_1: array<Polygon>;
@group(1) @binding(2) var<storage, read> chunk_2: array<Polygon>;
@group(1) @binding(3) var<storage, read> chunk_3: array<Polygon>;
@group(1) @binding(4) var<storage, read> chunk_4: array<Polygon>;
@group(1) @binding(5) var<storage, read> chunk_5: array<Polygon>;
@group(1) @binding(6) var<storage, read> chunk_6: array<Polygon>;

// Number of the polygon that a position draws, or NOTHING.
fn polygon_at(place: u32) -> u32 {
    if place < view.all_from.x {
        return draw_list[place];
    }
    let id = place - view.all_from.x;
    let bits = draw_list[view.all_from.x + id / 32u];
    return select(NOTHING, id, ((bits >> (id % 32u)) & 1u) == 1u);
}

// Marks a skipped polygon in the draw list.
const NOTHING: u32 = 0xffffffffu;
// Position of all corners of a skipped polygon, outside of the picture.
const NOWHERE: vec4<f32> = vec4<f32>(2.0, 2.0, 0.5, 1.0);

struct Corner {
    // Invariant, because depth that one entry point writes is compared with depth of another.
    @invariant @builtin(position) position: vec4<f32>,
    // The same for all fragments of a polygon.
    @location(0) @interpolate(flat, either) color: vec4<f32>,
}

fn fetch(id: u32) -> Polygon {
    let slot = id % CHUNK_LEN;
    switch (id / CHUNK_LEN) % CHUNKS_A_PAGE {
        case 0u: { return chunk_0[slot]; }
        case 1u: { return chunk_1[slot]; }
        case 2u: { return chunk_2[slot]; }
        case 3u: { return chunk_3[slot]; }
        case 4u: { return chunk_4[slot]; }
        case 5u: { return chunk_5[slot]; }
        default: { return chunk_6[slot]; }
    }
}

// One corner of a polygon, relative to the eye, for passes that read nothing else.
fn fetch_point(id: u32, corner: u32) -> vec3<f32> {
    let slot = id % CHUNK_LEN;
    var words: vec4<u32>;
    switch (id / CHUNK_LEN) % CHUNKS_A_PAGE {
        case 0u: { words = chunk_0[slot].corners[corner]; }
        case 1u: { words = chunk_1[slot].corners[corner]; }
        case 2u: { words = chunk_2[slot].corners[corner]; }
        case 3u: { words = chunk_3[slot].corners[corner]; }
        case 4u: { words = chunk_4[slot].corners[corner]; }
        case 5u: { words = chunk_5[slot].corners[corner]; }
        default: { words = chunk_6[slot].corners[corner]; }
    }
    return bitcast<vec3<f32>>(words.xyz) - view.eye_in_world.xyz;
}

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3(0.0031308));
}

// A vector divided by its largest component, so that products neither overflow nor vanish.
fn scaled(v: vec3<f32>) -> vec3<f32> {
    return v / max(max(abs(v.x), max(abs(v.y), abs(v.z))), 1.0e-30);
}

// Brightness by sky and ground, one lamp, and a light at the eye. From every eye position, a surface shows its slope.
fn brightness(normal: vec3<f32>, to_eye: vec3<f32>) -> f32 {
    let lamp = vec3(0.36, 0.80, 0.48);
    return 0.28 + 0.20 * (0.5 + 0.5 * normal.y) + 0.37 * max(dot(normal, lamp), 0.0) + 0.23 * dot(normal, to_eye);
}

// Colour of a polygon in plain colours; lighting is linear.
fn plain_color(own: vec3<f32>, style: Style, normal: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    var color = linear_from_srgb(own);
    if style.tint.a > 0.0 {
        color = mix(color, linear_from_srgb(style.tint.rgb), style.tint.a);
    }
    return srgb_from_linear(color * (brightness(normal, to_eye) + style.more.y));
}

// Position of a corner relative to the eye.
fn point_of(polygon: Polygon, corner: u32) -> vec3<f32> {
    let low = select(polygon.corners[0].xyz, polygon.corners[1].xyz, corner == 1u);
    let high = select(polygon.corners[2].xyz, polygon.corners[3].xyz, corner == 3u);
    return bitcast<vec3<f32>>(select(low, high, corner >= 2u)) - view.eye_in_world.xyz;
}

// Normal of the side from which the corners are counter-clockwise.
fn flat_normal(polygon: Polygon) -> vec3<f32> {
    let ac = point_of(polygon, 2u) - point_of(polygon, 0u);
    let bd = point_of(polygon, 3u) - point_of(polygon, 1u);
    return normalize(cross(scaled(ac), scaled(bd)));
}

// Lit colour of the visible side.
fn color_of(polygon: Polygon, style: Style) -> vec4<f32> {
    var normal = flat_normal(polygon);
    let to_eye = -normalize(scaled(point_of(polygon, 0u) + point_of(polygon, 2u)));
    normal = select(-normal, normal, dot(normal, to_eye) >= 0.0);
    let own = unpack4x8unorm(polygon.corners[0].w);
    return vec4(plain_color(own.rgb, style, normal, to_eye), own.a * style.more.x);
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) style_index: u32) -> Corner {
    var out: Corner;
    let id = polygon_at(index / 4u);
    if id == NOTHING {
        out.position = NOWHERE;
        return out;
    }
    let polygon = fetch(id);
    out.position = view.clip_from_eye * vec4(point_of(polygon, index % 4u), 1.0);
    out.color = color_of(polygon, view.styles[style_index]);
    return out;
}

// For passes without colours, which draw only listed polygons.
@vertex
fn vertex_depth(@builtin(vertex_index) index: u32) -> @invariant @builtin(position) vec4<f32> {
    return view.clip_from_eye * vec4(fetch_point(draw_list[index / 4u], index % 4u), 1.0);
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    return in.color;
}
