// What is seen where no polygon is; follows shadow.wgsl.

struct Sky {
    @builtin(position) position: vec4<f32>,
    @location(0) way: vec3<f32>,
}

// What is seen where nothing is, as far away as can be.
@vertex
fn vertex_sky(@builtin(vertex_index) index: u32) -> Sky {
    let at = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    let way = view.corners[0].xyz + view.corners[1].xyz * at.x + view.corners[2].xyz * (1.0 - at.y);
    return Sky(vec4(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, 0.0, 1.0), way);
}

// A floor at height 0 that a lamp lights up around the origin of the world, with the edges of a slab of three metres.
const POOL_M: f32 = 1.8;
const SLAB_M: f32 = 1.5;
const BEVEL_M: f32 = 0.25;
// Nearer than this, fog does not cover it.
const CLEAR_M: f32 = 10.0;

fn floor_color(way: vec3<f32>) -> vec3<f32> {
    let distance = max(view.eye_in_world.y, 0.0) / max(-way.y, 1.0e-4);
    let from_eye = way * distance;
    let at = view.eye_in_world.xz + from_eye.xz;
    let pool = pow(max(1.0 - length(at) / POOL_M, 0.0), 1.25);
    // Thin lines grow with the distance: they must not flicker.
    let pixel = 0.003 * distance / max(-way.y, 0.05);
    let cross = min(abs(at.x), abs(at.y));
    let slab = max(abs(at.x), abs(at.y));
    let groove = saturate(1.5 - cross / (0.015 + 0.5 * pixel)) * 0.03 / (0.03 + pixel);
    let bevel = saturate((slab - SLAB_M + BEVEL_M) / (0.03 + pixel)) * saturate((SLAB_M - slab) / (0.03 + pixel));
    let inside = step(slab, SLAB_M);
    let lamp = 1.0 + vec3(1.86, 1.6, 1.4) * pool * first_light_at(from_eye, vec3(0.0, 1.0, 0.0));
    let own = surroundings.floor.rgb * lamp * (1.0 - inside * (0.15 * groove + 0.12 * bevel));
    let clear = exp(-0.71 * surroundings.fog.w * max(distance - CLEAR_M, 0.0));
    return mix(surroundings.fog.rgb, own, clear);
}

@fragment
fn fragment_sky(in: Sky) -> @location(0) vec4<f32> {
    let way = normalize(in.way);
    if surroundings.sky_up.w > 0.0 && way.y < 0.0 {
        return vec4(floor_color(way), 1.0);
    }
    let high = 0.5 + 0.5 * dot(way, surroundings.sky_up.xyz);
    return vec4(mix(surroundings.sky_low.rgb, surroundings.sky_high.rgb, high), 1.0);
}
