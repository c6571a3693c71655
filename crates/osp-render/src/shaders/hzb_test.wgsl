// Finds the polygons that lie behind the depths of the pyramid. A polygon counts as hidden only if each of its samples
// fails the depth test of the pass with colours, however the rasteriser rounds: see `bound_of` and
// `is_triangle_hidden`.

struct View {
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
}

struct Polygon {
    corners: array<vec4<u32>, 4>,
    uv: vec4<u32>,
    normals: vec4<u32>,
}

@group(0) @binding(0) var<uniform> span: Span;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<uniform> view: View;
@group(0) @binding(3) var<storage, read> handles: array<Handle>;
// A mask for each cluster, two words.
@group(0) @binding(4) var<storage, read_write> remembered: array<atomic<u32>>;
// Each cluster mask, without hidden polygons, two words.
@group(0) @binding(5) var<storage, read_write> kept: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read> pyramid: array<f32>;
// The number of candidates of each chunk, then the candidates of the current chunk: the polygons that the coarse test
// has not proven hidden. A candidate is 64 times the index of its cluster mask in the span, plus the polygon's index in
// its cluster.
@group(0) @binding(7) var<storage, read_write> candidates: array<atomic<u32>>;
@group(0) @binding(8) var samples: texture_depth_multisampled_2d;
@group(1) @binding(0) var<storage, read> chunk: array<Polygon>;
@group(2) @binding(0) var<storage, read_write> list: array<u32>;
@group(2) @binding(1) var<storage, read_write> counters: array<atomic<u32>>;

const NOTHING: u32 = 0xffffffffu;
// Greatest number of texels that a polygon's rectangle covers in the coarse test, each way.
const COARSE_TEXELS: i32 = 4;
// Greatest number of texels that a triangle's rectangle covers on the level where its test begins, each way.
const FINE_TEXELS: i32 = 8;
// Largest number of texels of all levels on which an invocation tests a triangle. A triangle that needs more is drawn.
const MOST_STEPS: u32 = 1024u;
// The same limit for an invocation that shares a candidate with others.
const MOST_STEPS_OF_SHARE: u32 = 256u;
// Number of invocations that share the texels of a candidate.
const LANES_OF_CANDIDATE: u32 = 16u;

// Greatest difference between the rasteriser's positions of corners and the positions computed here. u is 2^-24, half a
// unit in the last place. S is the sum of the absolute values of the products of a coordinate. n is the distance of a
// corner from the picture's middle, in half pictures.
//
// - The rasteriser snaps corners to a grid of 1/256 pixel or finer: SNAP.
// - This shader and the vertex shader may round the same sums of four products in different orders: they differ by 8 u
//   S. A quotient of two sums then differs by 8 u (S_x + n S_w) / w, plus 5 u n by the division. The conversion to
//   pixels rounds by 6 u n more, twice. The total is below 19 u (S_x + n S_w) / w of the picture's side, because S_x is
//   at least n w, and S_w at least w: `spread`.
// - A driver may clip a triangle at the picture's border, or at some distance from it, into pieces with new corners. A
//   piece may be arbitrarily thin. Rounding and snapping may move its corners by as much as its width, so its depth
//   gradient has no bound. On a piece 0.1 pixels wide, lavapipe drew a sample nearer by the triangle's change of depth
//   over 0.08 pixels. So a triangle that may be clipped is never proven hidden. It is not clipped if its corners, with
//   all rounding, lie in the picture and between the near and the far plane.
// - Depth may be wrong by 13 u (S_z + depth S_w) / w at a corner, and by u or two where it is interpolated, if it is
//   constant over the picture's width. `uneven` below covers its change over the triangle.
const SNAP: f32 = 1.0 / 256.0;
// 32 u.
const ROUNDING: f32 = 1.0 / 524288.0;
// A triangle whose corners may be wrong by this number of pixels or more is drawn: one corner is close to the eye's
// plane.
const MOST_CORNER_ERROR: f32 = 2.0;

// A corner on the picture.
struct Corner {
    // x, y: pixels. z: depth.
    at: vec3<f32>,
    w: f32,
    spread: f32,
    depth_error: f32,
}

fn on_picture(point: vec3<f32>) -> Corner {
    let m = view.clip_from_eye;
    let clip = m * vec4(point, 1.0);
    let p = abs(point);
    let sum = abs(m[0]) * p.x + abs(m[1]) * p.y + abs(m[2]) * p.z + abs(m[3]);
    let ndc = clip.xyz / clip.w;
    let beside = max(abs(ndc.x), abs(ndc.y));
    let size = vec2(f32(params.width), f32(params.height));
    return Corner(
        vec3((ndc.xy * vec2(0.5, -0.5) + 0.5) * size, ndc.z),
        clip.w,
        (max(sum.x, sum.y) + beside * sum.w) / clip.w,
        (sum.z + abs(ndc.z) * sum.w) / clip.w,
    );
}

fn corner(polygon: Polygon, i: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(polygon.corners[i].xyz) - view.eye_in_world.xyz;
}

// A polygon on the picture.
struct Placed {
    // x, y: pixels. z: depth.
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    d: vec3<f32>,
    // Greatest error of a corner, pixels; negative if there is no bound.
    corner_error: f32,
    // Greatest amount by which a depth may be nearer than stated here.
    depth_error: f32,
}

fn placed(polygon: Polygon) -> Placed {
    let a = on_picture(corner(polygon, 0u));
    let b = on_picture(corner(polygon, 1u));
    let c = on_picture(corner(polygon, 2u));
    let d = on_picture(corner(polygon, 3u));
    let least_w = min(min(a.w, b.w), min(c.w, d.w));
    let spread = max(max(a.spread, b.spread), max(c.spread, d.spread));
    let size = vec2(f32(params.width), f32(params.height));
    let corner_error = SNAP + max(size.x, size.y) * ROUNDING * spread;
    let depth_error = ROUNDING * max(max(a.depth_error, b.depth_error), max(c.depth_error, d.depth_error));
    let low = min(min(a.at, b.at), min(c.at, d.at));
    let high = max(max(a.at, b.at), max(c.at, d.at));
    // False if a coordinate is NaN.
    let is_low_inside = all(low >= vec3(corner_error, corner_error, depth_error));
    let is_whole = is_low_inside && all(high <= vec3(size - corner_error, 1.0 - depth_error));
    let is_known = least_w > 0.0 && corner_error < MOST_CORNER_ERROR && is_whole && !is_turned_to_eye(polygon);
    return Placed(a.at, b.at, c.at, d.at, select(-1.0, corner_error, is_known), depth_error);
}

// Greatest change of depth over a triangle per pixel, summed over both axes, if each corner moves by up to `by` pixels.
// Negative if the triangle may be so thin that there is no bound.
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

// Squares that face the eye are drawn away from their stored corners: they have no bound.
fn is_turned_to_eye(polygon: Polygon) -> bool {
    return (polygon.corners[2].w & 0x10000u) != 0u;
}

fn is_same(a: vec4<u32>, b: vec4<u32>) -> bool {
    return all(a.xyz == b.xyz);
}

struct Bound {
    // Rectangle around the polygon, pixels.
    low: vec2<f32>,
    high: vec2<f32>,
    // Nearest depth that any sample of the polygon can have.
    nearest: f32,
    // 0 if there is no bound.
    is_known: u32,
}

// A coordinate beyond every picture, pixels.
const FARTHEST: f32 = 1.0e6;

fn unknown() -> Bound {
    return Bound(vec2(FARTHEST), vec2(-FARTHEST), 0.0, 0u);
}

// Depth is linear on the picture, so no sample within a triangle is nearer than its nearest corner. A sample may lie
// outside by the distance that rounding and snapping move the corners. There, depth continues with the same steepness.
fn bound_of(polygon: Polygon) -> Bound {
    let p = placed(polygon);
    if p.corner_error < 0.0 {
        return unknown();
    }
    let low = min(min(p.a.xy, p.b.xy), min(p.c.xy, p.d.xy));
    let high = max(max(p.a.xy, p.b.xy), max(p.c.xy, p.d.xy));
    var steep = steepness(p.a, p.b, p.c, p.corner_error);
    if has_two_triangles(polygon) {
        let other = steepness(p.a, p.c, p.d, p.corner_error);
        steep = select(max(steep, other), -1.0, min(steep, other) < 0.0);
    }
    if steep < 0.0 {
        return unknown();
    }
    var nearest = max(max(p.a.z, p.b.z), max(p.c.z, p.d.z)) + p.depth_error;
    if params.is_wrong == 1u {
        nearest = min(min(p.a.z, p.b.z), min(p.c.z, p.d.z)) * 0.8;
    }
    return Bound(low - 2.0 * p.corner_error, high + 2.0 * p.corner_error, nearest + steep * 2.0 * p.corner_error, 1u);
}

// First and last pixel that a rectangle may touch. The first is beyond the last if the rectangle lies outside of the
// picture.
fn pixels(low: vec2<f32>, high: vec2<f32>) -> vec4<i32> {
    let last = vec2<i32>(i32(params.width), i32(params.height)) - 1;
    return vec4(max(vec2<i32>(floor(low)), vec2(0)), min(vec2<i32>(floor(high)), last));
}

// Finest level on which a rectangle of pixels covers at most `most` texels each way.
fn level_for(rect: vec4<i32>, most: i32) -> u32 {
    for (var level = 0u; level + 1u < params.level_count; level++) {
        let texels = (rect.zw >> vec2(level)) - (rect.xy >> vec2(level));
        if max(texels.x, texels.y) < most {
            return level;
        }
    }
    return params.level_count - 1u;
}

fn depth_at(level: u32, at: vec2<i32>) -> f32 {
    let texels = params.levels[level];
    return pyramid[texels.x + u32(at.y) * texels.y + u32(at.x)];
}

fn is_bound_hidden(bound: Bound) -> bool {
    if bound.is_known == 0u {
        return false;
    }
    let rect = pixels(bound.low, bound.high);
    let level = max(level_for(rect, COARSE_TEXELS), 1u);
    let first = rect.xy >> vec2(level);
    let last = rect.zw >> vec2(level);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            if !(bound.nearest < depth_at(level, vec2(x, y))) {
                return false;
            }
        }
    }
    return true;
}

// A triangle on the picture, with bounds of the rasteriser's errors.
struct Triangle {
    a: vec2<f32>,
    b: vec2<f32>,
    c: vec2<f32>,
    // Orientation: 1 or -1.
    side: f32,
    // Greatest distance of its samples outside of each edge, as twice an area, negative.
    outside: vec3<f32>,
    // Depth at `a`, and its change per pixel.
    depth: f32,
    slope: vec2<f32>,
    // Greatest amount by which a sample may be nearer than the plane.
    more: f32,
    // Nearest depth of all samples.
    nearest: f32,
}

// Twice the area that the edge from `p` to `q` spans with a corner of a rectangle, for the corner with the largest
// area.
fn most_inside(p: vec2<f32>, q: vec2<f32>, low: vec2<f32>, high: vec2<f32>, side: f32) -> f32 {
    let along = (q - p) * side;
    let y = select(low.y, high.y, along.x > 0.0);
    let x = select(high.x, low.x, along.y > 0.0);
    return along.x * (y - p.y) - along.y * (x - p.x);
}

// Whether a sample of the triangle may lie in a rectangle.
fn may_touch(t: Triangle, low: vec2<f32>, high: vec2<f32>) -> bool {
    let inside = vec3(
        most_inside(t.a, t.b, low, high, t.side),
        most_inside(t.b, t.c, low, high, t.side),
        most_inside(t.c, t.a, low, high, t.side),
    );
    return !any(inside < t.outside);
}

// Nearest depth that a sample of the triangle can have in a rectangle: the depth of its plane there, at most the depth
// of its nearest corner.
fn nearest_in(t: Triangle, low: vec2<f32>, high: vec2<f32>) -> f32 {
    let steps = max(t.slope * (low - t.a), t.slope * (high - t.a));
    return min(t.depth + steps.x + steps.y + t.more, t.nearest);
}

fn may_win(t: Triangle, at: vec2<f32>, depth: f32) -> bool {
    return may_touch(t, at, at) && !(nearest_in(t, at, at) < depth);
}

// Whether the triangle may win a sample of a pixel. The samples have their standard positions: see `samples.rs`.
fn may_win_any(t: Triangle, pixel: vec2<i32>) -> bool {
    // All samples are read together, because an invocation waits for each read.
    let depths = vec4(
        textureLoad(samples, pixel, 0),
        textureLoad(samples, pixel, 1),
        textureLoad(samples, pixel, 2),
        textureLoad(samples, pixel, 3),
    );
    let at = vec2<f32>(pixel);
    return may_win(t, at + vec2(0.375, 0.125), depths.x) || may_win(t, at + vec2(0.875, 0.375), depths.y)
        || may_win(t, at + vec2(0.125, 0.625), depths.z) || may_win(t, at + vec2(0.625, 0.875), depths.w);
}

// A triangle and the texels that its test begins with.
struct Task {
    t: Triangle,
    // Its samples lie within these bounds, pixels.
    low: vec2<f32>,
    high: vec2<f32>,
    // Its first and last pixel.
    rect: vec4<i32>,
    // The level of the texels that its test begins with.
    top: u32,
    // False if there is no bound, so that the triangle is never proven hidden.
    is_known: bool,
}

fn task_of(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, by: f32, depth_error: f32) -> Task {
    let low = min(min(a.xy, b.xy), c.xy);
    let high = max(max(a.xy, b.xy), c.xy);
    let steep = steepness(a, b, c, by);
    let ab = b - a;
    let ac = c - a;
    let area = ab.x * ac.y - ab.y * ac.x;
    let slope = vec2(ab.z * ac.y - ac.z * ab.y, ac.z * ab.x - ab.z * ac.x) / area;
    let extent = max(high.x - low.x, high.y - low.y);
    // Error by the rounding of `slope` over the triangle, as a distance in pixels.
    let uneven = extent * (1.0e-6 + 4.0e-7 * extent * extent / abs(area));
    // Change of the areas at the edges by errors of the corners.
    let beside = by * (4.0 * extent + 8.0 * by) + extent * extent * 4.0e-7;
    let outside = -vec3(
        beside + by * (abs(ab.x) + abs(ab.y)),
        beside + by * (abs(c.x - b.x) + abs(c.y - b.y)),
        beside + by * (abs(ac.x) + abs(ac.y)),
    );
    let more = steep * (2.0 * by + uneven) + depth_error;
    let nearest = max(max(a.z, b.z), c.z) + steep * 2.0 * by + depth_error;
    let side = select(-1.0, 1.0, area > 0.0);
    let rect = pixels(low - 2.0 * by, high + 2.0 * by);
    return Task(
        Triangle(a.xy, b.xy, c.xy, side, outside, a.z, slope, more, nearest),
        low - 2.0 * by,
        high + 2.0 * by,
        rect,
        level_for(rect, FINE_TEXELS),
        steep >= 0.0,
    );
}

// Tests the part of a triangle in one texel of the level where its test begins. If a texel does not prove it hidden,
// its four parts on the next finer level are tested in turn, down to single pixels and their samples. After the fourth
// part, the parent's neighbour follows: a tree traversal without a stack, whose state is level and position. The part
// is hidden if it is behind every texel or sample at which the traversal ends; together these cover it. A traversal of
// more than `steps` steps proves nothing.
fn is_part_hidden(task: Task, texel: vec2<i32>, steps: ptr<function, u32>) -> bool {
    let t = task.t;
    var level = task.top;
    var at = texel;
    while *steps > 0u {
        *steps -= 1u;
        let size = f32(1u << level);
        let texel_low = max(vec2<f32>(at) * size, task.low);
        let texel_high = min(vec2<f32>(at + 1) * size, task.high);
        // Parts of a texel may lie outside of the rectangle.
        let is_in = all(at >= (task.rect.xy >> vec2(level))) && all(at <= (task.rect.zw >> vec2(level)));
        if is_in && may_touch(t, texel_low, texel_high) {
            if level == 0u {
                if may_win_any(t, at) {
                    return false;
                }
            } else if !(nearest_in(t, texel_low, texel_high) < depth_at(level, at)) {
                level -= 1u;
                at *= 2;
                continue;
            }
        }
        // After the last of four parts, the parent is finished, too, and so on.
        let up = min(firstTrailingBit(~u32(at.x & at.y)), task.top - level);
        level += up;
        at = at >> vec2(up);
        if level == task.top {
            return true;
        }
        at = select(vec2(at.x - 1, at.y + 1), vec2(at.x + 1, at.y), (at.x & 1) == 0);
    }
    return false;
}

// Whether a triangle is hidden in those texels that lane number `lane` of `lanes` tests, in at most `most` steps.
fn is_triangle_hidden(task: Task, lane: u32, lanes: u32, most: u32) -> bool {
    if !task.is_known {
        return false;
    }
    var steps = most;
    let first = task.rect.xy >> vec2(task.top);
    let size = max((task.rect.zw >> vec2(task.top)) - first + 1, vec2(0));
    let count = u32(size.x * size.y);
    for (var i = lane; i < count; i += lanes) {
        if !is_part_hidden(task, first + vec2(i32(i) % size.x, i32(i) / size.x), &steps) {
            return false;
        }
    }
    return true;
}

fn has_two_triangles(polygon: Polygon) -> bool {
    return !is_same(polygon.corners[2], polygon.corners[3]);
}

fn is_polygon_hidden(polygon: Polygon, lane: u32, lanes: u32, most: u32) -> bool {
    let p = placed(polygon);
    if p.corner_error < 0.0 {
        return false;
    }
    let task = task_of(p.a, p.b, p.c, p.corner_error, p.depth_error);
    if !is_triangle_hidden(task, lane, lanes, most) {
        return false;
    }
    return !has_two_triangles(polygon)
        || is_triangle_hidden(task_of(p.a, p.c, p.d, p.corner_error, p.depth_error), lane, lanes, most);
}

const LANES: u32 = 64u;

var<workgroup> visible: array<atomic<u32>, 2>;
// Number of listed candidates, and the position of the first candidate in the chunk's list.
var<workgroup> listed: atomic<u32>;
var<workgroup> first_listed: u32;

// Lists this invocation's polygon for the fine test if `is_listed`. All invocations must call it.
fn list_candidate(number: u32, lane: u32, is_listed: bool) {
    var own = 0u;
    if is_listed {
        own = atomicAdd(&listed, 1u);
    }
    workgroupBarrier();
    if lane == 0u {
        first_listed = atomicAdd(&candidates[span.args], atomicLoad(&listed));
    }
    workgroupBarrier();
    if is_listed {
        atomicStore(&candidates[span.first_sum + first_listed + own], number * LANES + lane);
    }
}

// The coarse test, one invocation for each polygon of the cluster. A polygon that it does not prove hidden becomes a
// candidate, or counts as visible if it has no bound.
fn test_cluster(number: u32, lane: u32, is_kept: bool) {
    let at = span.first + number;
    let handle = handles[at];
    let is_on = ((select(handle.low, handle.high, lane >= 32u) >> (lane % 32u)) & 1u) == 1u;
    var is_listed = false;
    if is_on {
        let bound = bound_of(chunk[handle.cluster * LANES + lane - span.first_polygon]);
        is_listed = bound.is_known == 1u && !is_bound_hidden(bound);
        if bound.is_known == 0u {
            atomicOr(&visible[lane / 32u], 1u << (lane % 32u));
        }
    }
    workgroupBarrier();
    if lane < 2u {
        let mask = atomicLoad(&visible[lane]);
        atomicStore(&remembered[handle.cluster * 2u + lane], mask);
        if is_kept {
            atomicStore(&kept[at * 2u + lane], mask);
        }
    }
    list_candidate(number, lane, is_listed);
}

@compute @workgroup_size(LANES)
fn test(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    test_cluster(group.x, lane, true);
}

// The same as `test`, after all polygons in view have been drawn. The results are only for the next frame.
@compute @workgroup_size(LANES)
fn remember(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    test_cluster(group.x, lane, false);
}

struct Candidate {
    // Index of the candidate's cluster mask.
    at: u32,
    cluster: u32,
    // Index of the candidate in its cluster.
    lane: u32,
}

fn candidate(number: u32) -> Candidate {
    let word = atomicLoad(&candidates[span.first_sum + number]);
    let at = span.first + word / LANES;
    return Candidate(at, handles[at].cluster, word % LANES);
}

// The fine test. It has its own dispatch, because few polygons need it and each takes long.
fn refine_candidates(group: u32, groups: u32, lane: u32, is_kept: bool) {
    let count = atomicLoad(&candidates[span.args]);
    let of_group = LANES / LANES_OF_CANDIDATE;
    let share = lane % LANES_OF_CANDIDATE;
    for (var i = group * of_group + lane / LANES_OF_CANDIDATE; i < count; i += groups * of_group) {
        let c = candidate(i);
        let polygon = chunk[c.cluster * LANES + c.lane - span.first_polygon];
        if !is_polygon_hidden(polygon, share, LANES_OF_CANDIDATE, MOST_STEPS_OF_SHARE) {
            let bit = 1u << (c.lane % 32u);
            atomicOr(&remembered[c.cluster * 2u + c.lane / 32u], bit);
            if is_kept {
                atomicOr(&kept[c.at * 2u + c.lane / 32u], bit);
            }
        }
    }
}

@compute @workgroup_size(LANES)
fn refine(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    refine_candidates(group.x, groups.x, lane, true);
}

// The same as `refine`, after `remember`.
@compute @workgroup_size(LANES)
fn refine_remembered(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    refine_candidates(group.x, groups.x, lane, false);
}

// Tests transparent polygons one by one. A hidden polygon leaves NOTHING in the list.
@compute @workgroup_size(LANES)
fn test_transparent(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let at = span.first + invocation.x;
    if at >= span.end {
        return;
    }
    let id = list[at];
    // The polygon belongs to another chunk, or was already found hidden.
    if id < span.first_polygon || id - span.first_polygon >= arrayLength(&chunk) || id == NOTHING {
        return;
    }
    let polygon = chunk[id - span.first_polygon];
    if is_polygon_hidden(polygon, 0u, 1u, MOST_STEPS) || is_bound_hidden(bound_of(polygon)) {
        list[at] = NOTHING;
        atomicAdd(&counters[0], 1u);
    }
}
