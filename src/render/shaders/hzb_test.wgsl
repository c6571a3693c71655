// Which polygons lie behind what the pyramid holds. A polygon is hidden only if each of its samples fails the depth test
// of the pass with colours, whatever the rasteriser rounds: see `bound_of` and `is_triangle_hidden`.

struct Span {
    // Handles (or places in the list of transparent polygons) from here …
    first: u32,
    // … to here.
    end: u32,
    first_sum: u32,
    base: u32,
    args: u32,
    // The first polygon of the chunk.
    first_polygon: u32,
}

struct Params {
    // First texel, width, height of each level.
    levels: array<vec4<u32>, 16>,
    width: u32,
    height: u32,
    level_count: u32,
    // Polygons that are tested together: 16, 4 or 1.
    group: u32,
    // 0: by their corners; 1: by the box around them; 2: by their farthest corner, which is wrong.
    bound: u32,
    // Whether the polygons of a group that is not hidden are tested one by one.
    is_fine: u32,
}

struct View {
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
}

struct Handle {
    block: u32,
    mask: u32,
    place: u32,
}

struct Polygon {
    corners: array<vec4<u32>, 4>,
}

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<uniform> view: View;
@group(0) @binding(3) var<storage, read> handles: array<Handle>;
@group(0) @binding(4) var<storage, read_write> remembered: array<u32>;
@group(0) @binding(5) var<storage, read_write> kept: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read> pyramid: array<f32>;
@group(0) @binding(7) var<storage, read_write> list: array<u32>;
@group(0) @binding(8) var<storage, read_write> counters: array<atomic<u32>>;
@group(1) @binding(0) var<storage, read> chunk: array<Polygon>;

const NOTHING: u32 = 0xffffffffu;
// Texels that a group's rectangle covers at most, each way …
const GROUP_TEXELS: i32 = 4;
// … and a triangle's.
const FINE_TEXELS: i32 = 8;

const BY_BOX: u32 = 1u;
const BY_FARTHEST: u32 = 2u;

// Pixels that a corner may be beside where it is computed to be: corners are snapped to a grid (1/256 pixel or finer),
// and computed with rounding (a few units in the last place).
const SNAP: f32 = 1.0 / 256.0;
const ROUNDING: f32 = 1.0 / 1048576.0;
// Part of a depth that interpolation may be off by.
const DEPTH_ROUNDING: f32 = 4.0e-6;
// Beyond it nothing is decided, pixels.
const FARTHEST: f32 = 1.0e6;

// A corner on the picture: pixels, depth; w is 0 if it is not clearly before the eye.
fn on_picture(point: vec3<f32>) -> vec4<f32> {
    let clip = view.clip_from_eye * vec4(point, 1.0);
    if !(clip.w > 0.0 && clip.z < clip.w * 0.9999) {
        return vec4(0.0);
    }
    let size = vec2(f32(params.width), f32(params.height));
    let pixel = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * size;
    if !(abs(pixel.x) < FARTHEST && abs(pixel.y) < FARTHEST) {
        return vec4(0.0);
    }
    return vec4(pixel, clip.z / clip.w, 1.0);
}

// How far a corner may be from where it is said to be, pixels.
fn play(low: vec2<f32>, high: vec2<f32>) -> f32 {
    let size = max(vec2(f32(params.width), f32(params.height)), max(abs(low), abs(high)));
    return SNAP + max(size.x, size.y) * ROUNDING;
}

fn corner(polygon: Polygon, i: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(polygon.corners[i].xyz) - view.eye_in_world.xyz;
}

// How fast depth changes over a triangle at most, by pixel along both axes together, for any place of its corners within
// `by` pixels; negative if the triangle may be so thin that there is no bound.
fn steepness(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, by: f32) -> f32 {
    let ab = b - a;
    let ac = c - a;
    let across = abs(ab.xy) + 2.0 * by;
    let along = abs(ac.xy) + 2.0 * by;
    let area = abs(ab.x * ac.y - ab.y * ac.x) - 2.0 * by * (across.x + across.y + along.x + along.y);
    if !(area > 0.0) {
        return -1.0;
    }
    return (abs(ab.z) * (along.x + along.y) + abs(ac.z) * (across.x + across.y)) / area;
}

fn is_same(a: vec4<u32>, b: vec4<u32>) -> bool {
    return all(a.xyz == b.xyz);
}

struct Bound {
    // The rectangle around it, pixels.
    low: vec2<f32>,
    high: vec2<f32>,
    // The nearest depth that any sample of it can have.
    nearest: f32,
    // 0 if nothing can be said.
    is_known: u32,
}

fn nothing() -> Bound {
    return Bound(vec2(FARTHEST), vec2(-FARTHEST), 0.0, 1u);
}

fn unknown() -> Bound {
    return Bound(vec2(FARTHEST), vec2(-FARTHEST), 0.0, 0u);
}

fn both(a: Bound, b: Bound) -> Bound {
    return Bound(min(a.low, b.low), max(a.high, b.high), max(a.nearest, b.nearest), min(a.is_known, b.is_known));
}

// Depth is linear on the picture, so no sample within a triangle is nearer than its nearest corner. A sample may lie
// outside of it by as much as the corners are moved by snapping: there depth goes on as steep as it is.
fn bound_of(polygon: Polygon) -> Bound {
    let a = on_picture(corner(polygon, 0u));
    let b = on_picture(corner(polygon, 1u));
    let c = on_picture(corner(polygon, 2u));
    let d = on_picture(corner(polygon, 3u));
    if a.w * b.w * c.w * d.w == 0.0 {
        return unknown();
    }
    let low = min(min(a.xy, b.xy), min(c.xy, d.xy));
    let high = max(max(a.xy, b.xy), max(c.xy, d.xy));
    let by = play(low, high);
    var steep = steepness(a.xyz, b.xyz, c.xyz, by);
    if !is_same(polygon.corners[2], polygon.corners[3]) {
        let other = steepness(a.xyz, c.xyz, d.xyz, by);
        steep = select(max(steep, other), -1.0, min(steep, other) < 0.0);
    }
    if steep < 0.0 {
        return unknown();
    }
    var nearest = max(max(a.z, b.z), max(c.z, d.z));
    if params.bound == BY_FARTHEST {
        nearest = min(min(a.z, b.z), min(c.z, d.z)) * 0.8;
    }
    return Bound(low - 2.0 * by, high + 2.0 * by, nearest + steep * 2.0 * by, 1u);
}

// Pixels from the first to the last that a rectangle may touch; the first is beyond the last if it lies outside.
fn pixels(low: vec2<f32>, high: vec2<f32>) -> vec4<i32> {
    let last = vec2<i32>(i32(params.width), i32(params.height)) - 1;
    return vec4(max(vec2<i32>(floor(low)), vec2(0)), min(vec2<i32>(floor(high)), last));
}

// The finest level on which a rectangle of pixels covers so many texels at most, each way.
fn level_for(rect: vec4<i32>, most: i32) -> u32 {
    var level = 0u;
    loop {
        let texels = (rect.zw >> vec2(level)) - (rect.xy >> vec2(level));
        if max(texels.x, texels.y) < most || level + 1u >= params.level_count {
            return level;
        }
        level += 1u;
    }
    return level;
}

fn rounded_up(depth: f32) -> f32 {
    return depth + abs(depth) * DEPTH_ROUNDING;
}

fn is_bound_hidden(bound: Bound) -> bool {
    if bound.is_known == 0u {
        return false;
    }
    let rect = pixels(bound.low, bound.high);
    let level = level_for(rect, GROUP_TEXELS);
    let texels = params.levels[level];
    let first = rect.xy >> vec2(level);
    let last = rect.zw >> vec2(level);
    let nearest = rounded_up(bound.nearest);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            if !(nearest < pyramid[texels.x + u32(y) * texels.y + u32(x)]) {
                return false;
            }
        }
    }
    return true;
}

// Twice the area that the edge from `p` to `q` and the corner of a rectangle span, for the corner where it is largest.
fn most_inside(p: vec2<f32>, q: vec2<f32>, low: vec2<f32>, high: vec2<f32>, side: f32) -> f32 {
    let along = (q - p) * side;
    let y = select(low.y, high.y, along.x > 0.0);
    let x = select(high.x, low.x, along.y > 0.0);
    return along.x * (y - p.y) - along.y * (x - p.x);
}

// A triangle against the texels that it touches, each with the nearest depth that the triangle can have there: its plane's
// over the texel, and never more than that of its nearest corner.
fn is_triangle_hidden(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> bool {
    let low = min(min(a.xy, b.xy), c.xy);
    let high = max(max(a.xy, b.xy), c.xy);
    let by = play(low, high);
    let steep = steepness(a, b, c, by);
    if steep < 0.0 {
        return false;
    }
    let ab = b - a;
    let ac = c - a;
    let area = ab.x * ac.y - ab.y * ac.x;
    let side = select(-1.0, 1.0, area > 0.0);
    let slope = vec2(ab.z * ac.y - ac.z * ab.y, ac.z * ab.x - ab.z * ac.x) / area;
    let extent = max(high.x - low.x, high.y - low.y);
    // What the rounding of `slope` makes over the triangle.
    let uneven = extent * (1.0e-6 + 4.0e-7 * extent * extent / abs(area));
    let more = steep * (2.0 * by + uneven);
    let nearest = max(max(a.z, b.z), c.z) + steep * 2.0 * by;
    // What moving the corners makes of the areas below.
    let beside = by * (4.0 * extent + 8.0 * by) + extent * extent * 4.0e-7;
    let outside = -vec3(
        beside + by * (abs(ab.x) + abs(ab.y)),
        beside + by * (abs(c.x - b.x) + abs(c.y - b.y)),
        beside + by * (abs(ac.x) + abs(ac.y)),
    );

    let rect = pixels(low - 2.0 * by, high + 2.0 * by);
    let level = level_for(rect, FINE_TEXELS);
    let texels = params.levels[level];
    let first = rect.xy >> vec2(level);
    let last = rect.zw >> vec2(level);
    let size = f32(1u << level);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            // Samples of the triangle are no farther out than its rectangle.
            let from_ = max(vec2(f32(x), f32(y)) * size, low - 2.0 * by);
            let to = min(vec2(f32(x + 1), f32(y + 1)) * size, high + 2.0 * by);
            let inside = vec3(
                most_inside(a.xy, b.xy, from_, to, side),
                most_inside(b.xy, c.xy, from_, to, side),
                most_inside(c.xy, a.xy, from_, to, side),
            );
            if any(inside < outside) {
                continue;
            }
            let steps = max(slope * (from_ - a.xy), slope * (to - a.xy));
            let depth = rounded_up(min(a.z + steps.x + steps.y + more, nearest));
            if !(depth < pyramid[texels.x + u32(y) * texels.y + u32(x)]) {
                return false;
            }
        }
    }
    return true;
}

fn is_polygon_hidden(polygon: Polygon) -> bool {
    let a = on_picture(corner(polygon, 0u));
    let b = on_picture(corner(polygon, 1u));
    let c = on_picture(corner(polygon, 2u));
    let d = on_picture(corner(polygon, 3u));
    if a.w * b.w * c.w * d.w == 0.0 || !is_triangle_hidden(a.xyz, b.xyz, c.xyz) {
        return false;
    }
    return is_same(polygon.corners[2], polygon.corners[3]) || is_triangle_hidden(a.xyz, c.xyz, d.xyz);
}

const LANES: u32 = 64u;

var<workgroup> bounds: array<Bound, LANES>;
var<workgroup> lows: array<vec3<f32>, LANES>;
var<workgroup> highs: array<vec3<f32>, LANES>;
var<workgroup> are_hidden: array<u32, LANES>;
var<workgroup> visible: array<atomic<u32>, 4>;

// The box around the polygons of a group, from the lane on: all of its corners on the picture.
fn bound_of_box(lane: u32, of_corners: Bound) -> Bound {
    var low = lows[lane];
    var high = highs[lane];
    for (var i = lane + 1u; i < lane + params.group; i++) {
        low = min(low, lows[i]);
        high = max(high, highs[i]);
    }
    // What the corners themselves need for rounding is in their own bound.
    var bound = of_corners;
    for (var i = 0u; i < 8u; i++) {
        let at = select(low, high, vec3((i & 1u) != 0u, (i & 2u) != 0u, (i & 4u) != 0u));
        let p = on_picture(at);
        if p.w == 0.0 {
            return unknown();
        }
        bound = both(bound, Bound(p.xy, p.xy, p.z, 1u));
    }
    return bound;
}

// One lane for a polygon, sixteen for a handle.
@compute @workgroup_size(LANES)
fn test(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = span.first + group.x * 4u + lane / 16u;
    let bit = lane % 16u;
    var handle: Handle;
    if at < span.end {
        handle = handles[at];
    }
    let is_on = (handle.mask >> bit & 1u) == 1u;
    var polygon: Polygon;
    bounds[lane] = nothing();
    lows[lane] = vec3(1.0e30);
    highs[lane] = vec3(-1.0e30);
    if is_on {
        polygon = chunk[handle.block * 16u + bit - span.first_polygon];
        bounds[lane] = bound_of(polygon);
        if params.bound == BY_BOX {
            let a = corner(polygon, 0u);
            let b = corner(polygon, 1u);
            let c = corner(polygon, 2u);
            let d = corner(polygon, 3u);
            lows[lane] = min(min(a, b), min(c, d));
            highs[lane] = max(max(a, b), max(c, d));
        }
    }
    workgroupBarrier();
    let leader = lane - lane % params.group;
    if lane == leader {
        var bound = bounds[lane];
        for (var i = lane + 1u; i < lane + params.group; i++) {
            bound = both(bound, bounds[i]);
        }
        // A group of which nothing is in view has an empty rectangle.
        if params.bound == BY_BOX && bound.is_known == 1u && bound.low.x <= bound.high.x {
            bound = bound_of_box(lane, bound);
        }
        are_hidden[lane] = u32(is_bound_hidden(bound));
    }
    workgroupBarrier();
    var is_hidden = are_hidden[leader] == 1u;
    if is_on && !is_hidden && params.is_fine == 1u {
        is_hidden = is_polygon_hidden(polygon);
    }
    if is_on && !is_hidden {
        atomicOr(&visible[lane / 16u], 1u << bit);
    }
    workgroupBarrier();
    if bit == 0u && at < span.end {
        let mask = atomicLoad(&visible[lane / 16u]);
        kept[handle.place] = vec2(handle.block, mask);
        remembered[handle.block] = mask;
    }
}

// Transparent polygons: one by one, and one that is hidden leaves a gap in the list.
@compute @workgroup_size(LANES)
fn test_transparent(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let at = span.first + invocation.x;
    if at >= span.end {
        return;
    }
    let id = list[at];
    // Another chunk's, or gone already.
    if id < span.first_polygon || id - span.first_polygon >= arrayLength(&chunk) || id == NOTHING {
        return;
    }
    let polygon = chunk[id - span.first_polygon];
    if is_polygon_hidden(polygon) || is_bound_hidden(bound_of(polygon)) {
        list[at] = NOTHING;
        atomicAdd(&counters[0], 1u);
    }
}
