// Draws a level of a depth pyramid in shades of grey on a part of a window; near is light. Every level is drawn as
// large as the picture, with a square for each texel.

struct Level {
    first: u32,
    width: u32,
    height: u32,
    // 1 if the window's format encodes linear values as sRGB.
    encodes: u32,
}

@group(0) @binding(0) var<storage, read> pyramid: array<f32>;
@group(0) @binding(1) var<uniform> level: Level;

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let size = vec2(level.width, level.height);
    let at = min(vec2<u32>(in.uv * vec2<f32>(size)), size - 1u);
    // Reversed depth: 1 at the near plane, 0 without a polygon. The root spreads far depths.
    let depth = pyramid[level.first + at.y * level.width + at.x];
    let grey = vec3(pow(clamp(depth, 0.0, 1.0), 0.2));
    let shown = select(grey, vec3(0.05, 0.07, 0.16), depth <= 0.0);
    return vec4(select(shown, pow(shown, vec3(2.2)), level.encodes == 1u), 1.0);
}
