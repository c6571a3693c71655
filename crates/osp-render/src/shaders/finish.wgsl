// Makes the finished picture from the drawn colours, which may exceed 1: bright light spreads (bloom), then values are
// clamped to 1.
//
// Bloom is the sum of four octaves: small pictures of fixed heights, each downscaled from the octave before and
// blurred. Bloom therefore spreads over the same part of the picture at every picture size.

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(1) @binding(0) var octave_0: texture_2d<f32>;
@group(1) @binding(1) var octave_1: texture_2d<f32>;
@group(1) @binding(2) var octave_2: texture_2d<f32>;
@group(1) @binding(3) var octave_3: texture_2d<f32>;
@group(2) @binding(0) var samples: texture_multisampled_2d<f32>;

// Greatest brightness of a colour.
const MOST: f32 = 30001.0;
// Fraction of the light that spreads.
const SPREAD: f32 = 0.0513;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    // Width and height of the target, pixels, 16 bits each. In the last pass: 1 for sketches of early versions, else 0.
    @location(1) @interpolate(flat, either) size: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) size: u32) -> Corner {
    // One triangle that covers the picture.
    let uv = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), uv, size);
}

fn cut(c: vec3<f32>) -> vec3<f32> {
    return clamp(c, vec3(0.0), vec3(MOST));
}

// Mean of the source over a pixel of the target.
@fragment
fn shrink(in: Corner) -> @location(0) vec4<f32> {
    let pixel = 1.0 / vec2(f32(in.size & 0xffffu), f32(in.size >> 16u));
    // A filtered sample is the mean of two by two texels.
    let texels = vec2<f32>(textureDimensions(source)) * pixel;
    let steps = vec2<i32>(ceil(texels * 0.5));
    var sum = vec3(0.0);
    for (var y = 0; y < steps.y; y++) {
        for (var x = 0; x < steps.x; x++) {
            let at = (vec2(f32(x), f32(y)) + 0.5) / vec2<f32>(steps) - 0.5;
            sum += cut(textureSampleLevel(source, smooth_sampler, in.uv + at * pixel, 0.0).rgb);
        }
    }
    return vec4(sum / f32(steps.x * steps.y), 1.0);
}

// A Gaussian filter with a sigma of 1.6 pixels over nine pixels in a row.
fn blur(at: vec2<i32>, step: vec2<i32>) -> vec4<f32> {
    let last = vec2<i32>(textureDimensions(source)) - 1;
    var sum = vec3(0.0);
    var weights = 0.0;
    for (var i = -4; i <= 4; i++) {
        let weight = exp(f32(i * i) / (-2.0 * 1.6 * 1.6));
        sum += weight * textureLoad(source, clamp(at + step * i, vec2(0), last), 0).rgb;
        weights += weight;
    }
    return vec4(sum / weights, 1.0);
}

@fragment
fn blur_across(in: Corner) -> @location(0) vec4<f32> {
    return blur(vec2<i32>(in.position.xy), vec2(1, 0));
}

@fragment
fn blur_down(in: Corner) -> @location(0) vec4<f32> {
    return blur(vec2<i32>(in.position.xy), vec2(0, 1));
}

// The picture without bloom.
@fragment
fn cut_off(in: Corner) -> @location(0) vec4<f32> {
    return vec4(saturate(textureLoad(source, vec2<i32>(in.position.xy), 0).rgb), 1.0);
}

fn with_octaves(c: vec3<f32>, in: Corner) -> vec4<f32> {
    // The full bloom has six octaves, from half of the picture's size on. Each of the four pictures here has the weights of
    // those octaves that spread about as far.
    let parts = select(0.34 * vec4(0.5, 0.6, 0.6, 0.45), vec4(0.5, 0.273, 0.285, 0.183), in.size == 1u);
    let octaves = parts.x * textureSampleLevel(octave_0, smooth_sampler, in.uv, 0.0).rgb
        + parts.y * textureSampleLevel(octave_1, smooth_sampler, in.uv, 0.0).rgb
        + parts.z * textureSampleLevel(octave_2, smooth_sampler, in.uv, 0.0).rgb
        + parts.w * textureSampleLevel(octave_3, smooth_sampler, in.uv, 0.0).rgb;
    return vec4(saturate(mix(c, octaves, SPREAD)), 1.0);
}

// Greatest brightness of one of `count` samples of a pixel. In Tilt Brush, where the brushes come from, a bright stroke
// makes a pixel white as soon as it covers one sample. Early versions had only one sample a pixel, so their strokes are
// thinner: here a pixel is as white as it is covered.
fn most_of_sample(count: f32, in: Corner) -> vec3<f32> {
    return vec3(select(count, 1.0, in.size == 1u) / (1.0 - SPREAD));
}

// The picture with bloom.
@fragment
fn spread(in: Corner) -> @location(0) vec4<f32> {
    var sum = vec3(0.0);
    let count = i32(textureNumSamples(samples));
    let most = most_of_sample(f32(count), in);
    for (var i = 0; i < count; i++) {
        sum += min(cut(textureLoad(samples, vec2<i32>(in.position.xy), i).rgb), most);
    }
    return with_octaves(sum / f32(count), in);
}

// `spread` for adapters that cannot read samples: it uses the mean of a pixel's samples, so edges of bright light are
// jagged.
@fragment
fn spread_mean(in: Corner) -> @location(0) vec4<f32> {
    return with_octaves(cut(textureLoad(source, vec2<i32>(in.position.xy), 0).rgb), in);
}
