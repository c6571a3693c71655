// Effects of single brushes, each named after its brush; follows painted.wgsl.

const BLOOM: u32 = 1u;
const SOFT: u32 = 2u;
const SMOKE: u32 = 3u;
const SNOW: u32 = 4u;
const STARS: u32 = 5u;
const EMBERS: u32 = 6u;
const BUBBLES: u32 = 7u;
const DOTS: u32 = 8u;
const FIRE: u32 = 9u;
const STREAMERS: u32 = 10u;
const RAINBOW: u32 = 11u;
const WAVEFORM: u32 = 12u;
const CHROMATIC_WAVE: u32 = 13u;
const NEON_PULSE: u32 = 14u;
const COMET: u32 = 15u;
const PLASMA: u32 = 16u;
const ELECTRICITY: u32 = 17u;
const HYPER_GRID: u32 = 18u;
const DIAMOND_HULL: u32 = 19u;
const TOON: u32 = 20u;
const HYPERCOLOR: u32 = 21u;
const LIGHT_WIRE: u32 = 22u;
const PETAL: u32 = 23u;
const DISCO: u32 = 24u;
const WIGGLY_GRAPHITE: u32 = 25u;

const PI: f32 = 3.14159265;

fn seconds() -> f32 {
    return surroundings.moment.x;
}

// A pseudo-random number from 0 to 1 for each `n`.
fn scattered(n: f32) -> f32 {
    return fract(sin(n * 12.9898) * 43758.547);
}

// Smooth noise along a line, 0 to 1.
fn noise(x: f32) -> f32 {
    let cell = floor(x);
    let part = smoothstep(0.0, 1.0, x - cell);
    return mix(scattered(cell), scattered(cell + 1.0), part);
}

// Offset of a particle by its animation, metres.
fn drift(material: Material, alpha: f32, at: vec3<f32>) -> vec3<f32> {
    switch material.kinds.y {
        case SNOW: {
            let part = fract(0.2 * seconds() + alpha);
            return vec3(0.0, -0.3 * (part - 0.5), 0.0);
        }
        case EMBERS: {
            let part = fract(0.6 * seconds() + 10.0 * alpha);
            let phase = 5.0 * part + 100.0 * alpha + seconds();
            let sway = 0.03 * vec3(sin(phase - 10.0 * at.z), 0.0, -cos(phase + 10.0 * at.x));
            return vec3(0.2 * part, 0.6 * part * (0.5 + fract(100.0 * alpha)), 0.0) + sway;
        }
        default: { return vec3(0.0); }
    }
}

// Offset of an animated texture.
fn texture_shift(material: Material) -> vec2<f32> {
    if material.kinds.y == WIGGLY_GRAPHITE {
        // The texture jumps twelve times a second.
        return vec2(fract(1.1 * floor(12.0 * seconds())), 0.0);
    }
    return vec2(0.0);
}

// Converts a colour and its alpha to emitted light.
fn bloom(color: vec4<f32>, gain: f32) -> vec4<f32> {
    let own = max(color.rgb, vec3(0.05 * length(color.rgb)));
    let steep = pow(vec4(own, color.a), vec4(2.2));
    return vec4(steep.rgb * 2.0 * exp(10.0 * gain), steep.a);
}

// Colours that move along a stroke, 0 to 4.
fn hypercolor(in: Painted, place: Place) -> vec3<f32> {
    let phase = vec3(2.0, 3.3, 4.66) * place.texture.r + vec3(1.0, 2.0, 0.5) * seconds() - in.texture.x;
    return 2.0 * (sin(phase) + 1.0);
}

// Whether a position along a wire lies on a bulb.
struct Bulb {
    is_lit: bool,
    // 0 on the black ring where the bulb begins, 1 elsewhere.
    outside_ring: f32,
}

fn bulb_at(u: f32) -> Bulb {
    let height = sin(PI * fract(2.0 * u));
    return Bulb(height < 0.1, select(1.0, 0.0, abs(height - 0.1) < 0.01));
}

// Reflectance at normal incidence.
fn f0_of(material: Material, in: Painted, place: Place) -> vec3<f32> {
    switch material.kinds.y {
        // A disco ball reflects in the colour of its paint.
        case DISCO: { return material.f0.rgb * in.color.rgb; }
        case HYPERCOLOR: { return material.f0.rgb * hypercolor(in, place); }
        case LIGHT_WIRE: {
            let bulb = bulb_at(in.texture.x);
            return vec3(select(0.3, 0.15, bulb.is_lit) * bulb.outside_ring);
        }
        default: { return material.f0.rgb; }
    }
}

// Diffuse albedo.
fn albedo_of(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let color = in.color.rgb * place.texture.rgb;
    switch material.kinds.y {
        case HYPERCOLOR: { return in.color.rgb * hypercolor(in, place); }
        case LIGHT_WIRE: {
            let bulb = bulb_at(in.texture.x);
            return in.color.rgb * select(0.2 * bulb.outside_ring, 0.0, bulb.is_lit);
        }
        // A disco ball has only reflections.
        case DISCO: { return vec3(0.0); }
        case PETAL: {
            let root_to_tip = saturate(in.texture.x);
            return in.color.rgb * mix(0.6, 1.0, root_to_tip) * select(0.5 * root_to_tip, 1.0, place.is_front);
        }
        default: { return color; }
    }
}

// The normal by which a facet of a disco ball reflects. Like the shader of Tilt Brush, this function treats the
// facet's normal in the room, whose z points forward, as a tangent-space normal.
fn disco_normal(facet: vec3<f32>, normal: vec3<f32>, gradients: Gradients, dx: vec3<f32>, dy: vec3<f32>) -> vec3<f32> {
    let f = in_room(facet);
    let of_plane = vec3(0.0, 0.0, 1.0) + f.z * vec3(f.xy, -f.z);
    return in_world(normalize(of_plane), normal, gradients, dx, dy);
}

// Light that a surface emits.
fn glow_of(material: Material, in: Painted, place: Place) -> vec3<f32> {
    switch material.kinds.y {
        case TOON: {
            // Tilt Brush draws a black outline around the stroke. Here the stroke's rim is black instead.
            return select(vec3(0.2 * place.normal.y), -in.color.rgb, place.is_rim);
        }
        case DISCO: {
            // Horizontal facets are very bright.
            return in.color.rgb * 200.0 * pow(abs(place.facet.y), 100.0);
        }
        case LIGHT_WIRE: {
            if !bulb_at(in.texture.x).is_lit {
                return vec3(0.0);
            }
            let number = 2.0 * in.texture.x + 0.5;
            // Light runs along the wire: one bulb of seven is on, and its neighbours glow a little.
            let on = 1.0 - saturate(1.5 * abs(number % 7.0 - (3.0 * seconds()) % 7.0));
            let tints = array(vec3(0.2, 0.2, 1.0), vec3(1.0, 0.2, 0.2), vec3(0.2, 1.0, 0.2));
            return bloom(vec4(in.color.rgb * tints[u32(number) % 3u] * on, 1.0), material.numbers.y).rgb;
        }
        default: { return vec3(0.0); }
    }
}

fn streamers(in: Painted, place: Place, material: Material) -> vec3<f32> {
    let t = seconds();
    let row = floor(in.texture.y * 5.0);
    let random = fract(abs(sin(182.4456 * row) * 43758.5453));
    let pace = 0.5 + 0.3 * random;
    let u = in.texture.x + 200.0 * random;
    let wave = sin(10.0 * u + 10.0 * t) - sin(23.0 * u + 6.0 * t);
    let y = in.texture.y * 5.0 + 0.05 * wave;
    let part = fract(y);
    let uv = vec2(u * pace - t * (0.5 + fract(1.618034 * row)), part);
    // Changes of the texture coordinates by `u`: along the texture, and across.
    let slope = vec2(pace, 0.05 * (10.0 * cos(10.0 * u + 10.0 * t) - 23.0 * cos(23.0 * u + 6.0 * t)));
    let x = place.gradients.x;
    let d = place.gradients.y;
    let gradients = Gradients(x.x * slope + vec2(0.0, 5.0 * x.y), d.x * slope + vec2(0.0, 5.0 * d.y));
    let texel = texture_of(material, material.kinds.z, uv, gradients);
    let rim = part * part * (1.0 - part) * (1.0 - part);
    let q = (texel + 55.0 * texel * texel) * rim;
    let c = vec4(in.color.rgb, in.texture.z) * q * exp(5.0 * material.numbers.y);
    return c.rgb * c.a;
}

fn rainbow(in: Painted, gain: f32) -> vec3<f32> {
    let y = saturate(in.texture.y) * 5.0;
    let part = fract(y);
    let line = pow(saturate(5.0 * part * (1.0 - part)), 50.0);
    let row = (floor(y) + floor(fract(0.4 * seconds()) * 5.0)) % 5.0;
    var color = vec3(0.4, 0.0, 1.2);
    if row < 0.5 {
        color = vec3(1.0, 0.0, 0.0);
    } else if row < 1.5 {
        color = vec3(0.7, 0.3, 0.0);
    } else if row < 2.5 {
        color = vec3(0.0, 1.0, 0.0);
    } else if row < 3.5 {
        color = vec3(0.0, 0.2, 1.0);
    }
    let pulse = pow((sin(row + 2.0 * seconds()) + 1.0) * 0.5, 5.0);
    let factor = exp(3.0 * gain);
    return in.color.rgb * color * line * pulse * factor * factor;
}

// Mean brightness, over a pixel of width `pixel`, at the distance `off` from a line. The line's brightness falls to 0
// at `half_width`.
fn line_of(off: f32, half_width: f32, pixel: f32) -> f32 {
    let ends = (vec2(off) + vec2(-0.5, 0.5) * max(pixel, 1.0e-3 * half_width)) / half_width;
    let inside = clamp(ends, vec2(-1.0), vec2(1.0));
    let sums = select(1.0 - 0.5 * (1.0 - inside) * (1.0 - inside), 0.5 * (1.0 + inside) * (1.0 + inside), inside < vec2(0.0));
    return (sums.y - sums.x) / max(ends.y - ends.x, 1.0e-6);
}

// Change over a pixel of the distance, in `v`, from a wave with this slope in `u`.
fn width_of_pixel(gradients: Gradients, slope: f32) -> f32 {
    return length(vec2(gradients.x.y - slope * gradients.x.x, gradients.y.y - slope * gradients.y.x));
}

// The number of waves of red, green and blue is in proportion to these components of the stroke's colour.
fn waveform(in: Painted, place: Place, gain: f32) -> vec3<f32> {
    let u = in.texture.x;
    let envelope = sin(PI * saturate(u));
    let phase = (100.0 * u - vec3(90.0, 120.0, 150.0) * seconds()) * in.color.rgb;
    let off = in.texture.y - 0.5 - 0.15 * dot(sin(phase), vec3(1.0)) * envelope;
    let slope = 15.0 * dot(cos(phase), in.color.rgb) * envelope;
    let line = line_of(off, 1.0 / (20.0 + 40.0 * (1.0 - envelope)), width_of_pixel(place.gradients, slope));
    let c = bloom(vec4(in.color.rgb, in.texture.z), gain);
    return c.rgb * c.a * envelope * line;
}

fn chromatic_wave(in: Painted, place: Place, gain: f32) -> vec3<f32> {
    let u = in.texture.x;
    let phase = (100.0 * u - vec3(60.0, 90.0, 120.0) * seconds()) * in.color.rgb;
    let off = vec3(fract(in.texture.y + 4.0 * u) - 0.5) + 0.15 * sin(phase);
    let slope = -4.0 - 15.0 * cos(phase) * in.color.rgb;
    let lines = vec3(
        line_of(off.x, 0.025, width_of_pixel(place.gradients, slope.x)),
        line_of(off.y, 0.025, width_of_pixel(place.gradients, slope.y)),
        line_of(off.z, 0.025, width_of_pixel(place.gradients, slope.z)),
    );
    return bloom(vec4(in.color.rgb, 1.0), gain).rgb * lines;
}

// A pulse of light on a tube of dark glass. Both sides are visible, and each adds fog.
fn neon_pulse(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let x = fract(abs(in.texture.x - 0.75 * seconds()));
    let ring = saturate(pow(10.0 * saturate(0.2 - x), 5.0));
    let view_cosine = select(0.0, saturate(dot(place.normal, place.to_eye)), place.is_front);
    let light = bloom(vec4(in.color.rgb, 1.0), material.numbers.y).rgb * ring * pow(view_cosine, 5.0);
    let glass = highlight(material, material.f0.rgb, place.normal, place.to_eye, 1.0);
    return fogged(light + glass, in.from_eye.w);
}

fn comet(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let t = seconds();
    let u = in.texture.x;
    let v = in.texture.y;
    let layer = material.kinds.z;
    let a = textureSampleGrad(textures, repeating, vec2(u - t, v - t), layer, place.gradients.x, place.gradients.y).r;
    let b = textureSampleGrad(textures, repeating, vec2(u - 1.5 * t, v), layer, place.gradients.x, place.gradients.y).g;
    let c = textureSampleGrad(textures, repeating, vec2(u - 0.5 * t, v), layer, place.gradients.x, place.gradients.y).b;
    let hot = (1.0 - u) * (a + b + c) / 3.0;
    let head = max(1.0 - 5.0 * u, 0.0);
    return in.color.rgb * smoothstep(0.3, 1.1, 3.0 * (hot * hot + 0.125) + head);
}

fn plasma(in: Painted) -> vec3<f32> {
    var sum = 0.0;
    for (var i = 0; i < 3; i++) {
        let n = f32(i);
        let at = 0.5 + 0.35 * (noise(in.texture.x * (6.0 + 3.0 * n) + (3.0 + n) * seconds() + 17.0 * n) - 0.5);
        sum += 0.03 / (0.01 + abs(in.texture.y - at));
    }
    let rim = saturate(4.0 * in.texture.y * (1.0 - in.texture.y));
    return in.color.rgb * in.texture.z * sum * rim * rim * 0.6;
}

// Reflectance of a soap film for red, green and blue light, by interference of the reflections at its two surfaces.
// `view_cosine` is the cosine of the angle of incidence; `thickness` is in nanometres.
fn film(view_cosine: f32, thickness: f32) -> vec3<f32> {
    let index = 1.3;
    let inside = sqrt(1.0 - (1.0 - view_cosine * view_cosine) / (index * index));
    // Fresnel coefficients of the two polarisations.
    let upright = (view_cosine - index * inside) / (view_cosine + index * inside);
    let level = (index * view_cosine - inside) / (index * view_cosine + inside);
    let r = vec2(upright * upright, level * level);
    let phase = cos(4.0 * PI * index * thickness * inside / vec3(650.0, 510.0, 475.0));
    let across = (1.0 - r.x) * (1.0 - r.x) / (1.0 + r.x * r.x - 2.0 * r.x * phase);
    let along = (1.0 - r.y) * (1.0 - r.y) / (1.0 + r.y * r.y - 2.0 * r.y * phase);
    return 1.0 - 0.5 * (across + along);
}

// Both sides are visible; the inner side is lit like the outer one.
fn diamond_hull(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let outwards = select(-place.normal, place.normal, place.is_front);
    let view_cosine = clamp(abs(dot(outwards, place.to_eye)), 1.0e-3, 1.0);
    var rim = 1.0 - view_cosine;
    rim *= 1.0 - pow(rim, 5.0);
    // At grazing angles the edges are very bright.
    rim = mix(rim, 150.0, saturate(1.0 - 10.0 * view_cosine));
    let place_on_film = vec2(rim + outwards.x + 0.015 * seconds(), rim + outwards.y);
    let grain = 0.63 + 0.06 * (noise(11.0 * place_on_film.x + 3.0) + noise(9.0 * place_on_film.y) - 1.0);
    let colors = clamp(film(view_cosine, mix(250.0, 400.0, grain)), vec3(0.0), vec3(1.0));
    let shine = rim * colors * (0.5 * in.color.rgb + 0.25);
    let f0 = in.color.rgb * colors;
    let albedo = 0.2 * in.color.rgb * (1.0 - max(f0.r, max(f0.g, f0.b)));
    let share = first_light_at(in.from_eye.xyz, outwards);
    return shine + albedo * light_on(outwards, share) + highlight(material, f0, outwards, place.to_eye, share);
}

// Light that an additive polygon adds to the background.
fn emitted(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let rgb = in.color.rgb;
    let own = in.texture.z;
    let texel = place.texture;
    let gain = material.numbers.y;
    let t = seconds();
    switch material.kinds.y {
        case BLOOM: {
            let c = bloom(vec4(rgb, own), gain) * texel;
            return c.rgb * c.a;
        }
        case SMOKE: { return rgb * texel.rgb * texel.a; }
        case SNOW: {
            let part = fract(0.2 * t + own);
            let fading = pow(1.0 - abs(2.0 * part - 1.0), 3.0);
            return 4.0 * rgb * texel.rgb * texel.a * fading;
        }
        case STARS: {
            let blaze = pow(abs(sin(5.3 * t + 2.0 * PI * own)), 20.0);
            // Smaller gradients select a sharper mip level. A star is up to 800 times as bright as white, so even the
            // faintest rim would be white.
            let gradients = Gradients(0.3 * place.gradients.x, 0.3 * place.gradients.y);
            let sharp = texture_of(material, material.kinds.z, in.texture.xy, gradients).a;
            return rgb * sharp * 800.0 * blaze;
        }
        case EMBERS: {
            let part = fract(0.6 * t + 10.0 * own);
            var c = rgb * (1.0 + 200.0 * pow(1.0 - part, 10.0) + 50.0 * pow(abs(sin(3.0 * t + 10.0 * own)), 30.0));
            c *= rgb * 5.0 * (1.0 - part) * (1.0 - part);
            return 2.0 * c * texel.rgb * 2.0 * own * texel.a;
        }
        case BUBBLES: { return rgb * texel.rgb + texel.a; }
        case DOTS: {
            let c = 0.4 * rgb * texel.rgb;
            return c + c * (0.4 * own * texel.a) * 300.0;
        }
        case FIRE: {
            let flicker = textureSampleGrad(textures, repeating, in.texture.xy - vec2(t, 0.0), material.kinds.z, place.gradients.x, place.gradients.y).a;
            let moved = texture_of(material, material.kinds.z, in.texture.xy - 0.1 * flicker, place.gradients);
            // The darkest wisps of the flames are cut off.
            let wisps = vec4(select(vec3(0.0), moved.rgb, moved.rgb >= vec3(0.01)), moved.a);
            let c = bloom(vec4(rgb, own), gain) * wisps;
            return c.rgb * c.a;
        }
        case STREAMERS: { return streamers(in, place, material); }
        case RAINBOW: { return rainbow(in, gain); }
        case WAVEFORM: { return waveform(in, place, gain); }
        case CHROMATIC_WAVE: { return chromatic_wave(in, place, gain); }
        case NEON_PULSE: { return neon_pulse(material, in, place); }
        case COMET: { return comet(material, in, place); }
        case PLASMA: { return plasma(in); }
        case ELECTRICITY: {
            let factor = select(1.0, 9.0, abs(in.texture.y - 0.5) < 0.1);
            return bloom(vec4(rgb, 1.0), gain).rgb * factor;
        }
        case HYPER_GRID: { return 2.0 * rgb * texel.rgb * texel.a; }
        case DIAMOND_HULL: { return diamond_hull(material, in, place); }
        default: {
            if material.numbers.x > 0.0 {
                return select(vec3(0.0), rgb * texel.rgb, own * texel.a >= material.numbers.x);
            }
            if gain > 0.0 {
                let c = bloom(vec4(rgb, own), gain) * texel;
                return c.rgb * c.a;
            }
            return rgb * texel.rgb * (own * texel.a);
        }
    }
}
