// Draws a finished picture, sRGB values, on a part of a window. The pipeline selects the channels that are written,
// such as one eye of an anaglyph.

@group(0) @binding(0) var picture: texture_2d<f32>;

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3(0.0031308));
}

fn texel(uv: vec2<f32>) -> vec3<f32> {
    let size = textureDimensions(picture);
    let at = min(vec2<u32>(uv * vec2<f32>(size)), size - 1u);
    return textureLoad(picture, at, 0).rgb;
}

// For windows whose format stores values unchanged.
@fragment
fn pass_on(in: Corner) -> @location(0) vec4<f32> {
    return vec4(texel(in.uv), 1.0);
}

// For windows whose format encodes linear values as sRGB.
@fragment
fn decode(in: Corner) -> @location(0) vec4<f32> {
    return vec4(linear_from_srgb(texel(in.uv)), 1.0);
}

// The linear colour with less saturation.
fn grey(in: Corner) -> vec3<f32> {
    // Half of the saturation is kept: through coloured glasses, one eye would miss pure colours.
    let c = linear_from_srgb(texel(in.uv));
    return mix(vec3(dot(c, vec3(0.2126, 0.7152, 0.0722))), c, 0.5);
}

@fragment
fn pass_on_one_eye(in: Corner) -> @location(0) vec4<f32> {
    return vec4(srgb_from_linear(grey(in)), 1.0);
}

@fragment
fn decode_one_eye(in: Corner) -> @location(0) vec4<f32> {
    return vec4(grey(in), 1.0);
}
