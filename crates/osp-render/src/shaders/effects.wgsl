// What single brushes do; follows painted.wgsl. Each effect is named after its brush.

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

// One number out of another, 0 to 1.
fn scattered(n: f32) -> f32 {
    return fract(sin(n * 12.9898) * 43758.547);
}

// Smooth noise along a line, 0 to 1.
fn noise(x: f32) -> f32 {
    let cell = floor(x);
    let part = smoothstep(0.0, 1.0, x - cell);
    return mix(scattered(cell), scattered(cell + 1.0), part);
}

// How far a particle has gone by itself, metres.
fn drift(material: Material, alpha: f32) -> vec3<f32> {
    switch material.kinds.y {
        case SNOW: {
            let part = fract(0.2 * seconds() + alpha);
            return vec3(0.0, -0.3 * (part - 0.5), 0.0);
        }
        case EMBERS: {
            let part = fract(0.6 * seconds() + 10.0 * alpha);
            let sway = 0.03 * sin(vec3(3.0, 5.0, 4.0) * part + 40.0 * alpha);
            return vec3(0.2 * part, 0.6 * part * (0.5 + fract(100.0 * alpha)), 0.0) + sway;
        }
        default: { return vec3(0.0); }
    }
}

// How far a texture has moved by itself.
fn texture_shift(material: Material) -> vec2<f32> {
    if material.kinds.y == WIGGLY_GRAPHITE {
        // Twelve times a second.
        return vec2(fract(1.1 * floor(12.0 * seconds())), 0.0);
    }
    return vec2(0.0);
}

// A colour and alpha as a source of light.
fn bloom(color: vec4<f32>, gain: f32) -> vec4<f32> {
    let own = max(color.rgb, vec3(0.05 * length(color.rgb)));
    let steep = pow(vec4(own, color.a), vec4(2.2));
    return vec4(steep.rgb * 2.0 * exp(10.0 * gain), steep.a);
}

// Colours that wander along a stroke, 0 to 4.
fn hypercolor(in: Painted, place: Place) -> vec3<f32> {
    let phase = vec3(2.0, 3.3, 4.66) * place.texture.r + vec3(1.0, 2.0, 0.5) * seconds() - in.texture.x;
    return 2.0 * (sin(phase) + 1.0);
}

// What is mirrored straight on.
fn f0_of(material: Material, in: Painted, place: Place) -> vec3<f32> {
    switch material.kinds.y {
        // The mirror of a disco ball has the colour of the paint, this one its own.
        case DISCO: { return material.f0.rgb * in.color.rgb; }
        case HYPERCOLOR: { return material.f0.rgb * hypercolor(in, place); }
        default: { return material.f0.rgb; }
    }
}

// The colour that light falls on.
fn albedo_of(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let color = in.color.rgb * place.texture.rgb;
    switch material.kinds.y {
        case HYPERCOLOR: { return in.color.rgb * hypercolor(in, place); }
        case LIGHT_WIRE: { return in.color.rgb * 0.2; }
        case PETAL: {
            let root_to_tip = saturate(in.texture.x);
            return in.color.rgb * mix(0.6, 1.0, root_to_tip) * select(0.5 * root_to_tip, 1.0, place.is_front);
        }
        default: { return color; }
    }
}

// Light that a surface gives by itself.
fn glow_of(material: Material, in: Painted, place: Place) -> vec3<f32> {
    switch material.kinds.y {
        case TOON: {
            // The black outline that the program draws around it, here on its rim.
            let is_rim = dot(place.normal, place.to_eye) < 0.35;
            return select(vec3(0.2 * place.normal.y), -in.color.rgb, is_rim);
        }
        case DISCO: {
            // Facets that lie level blaze.
            return in.color.rgb * 200.0 * pow(abs(place.normal.y), 100.0);
        }
        case LIGHT_WIRE: {
            let part = fract(2.0 * in.texture.x);
            if sin(PI * part) >= 0.15 {
                return vec3(0.0);
            }
            let number = round(2.0 * in.texture.x);
            let is_lit = (number + floor(3.0 * seconds())) % 7.0 == 0.0;
            let turn = number % 3.0;
            let tint = vec3(f32(turn == 0.0), f32(turn == 1.0), f32(turn == 2.0));
            return select(vec3(0.0), bloom(vec4(in.color.rgb * (0.2 + tint), 1.0), 0.35).rgb, is_lit);
        }
        default: { return vec3(0.0); }
    }
}

fn streamers(in: Painted, place: Place, material: Material) -> vec3<f32> {
    let row = floor(in.texture.y * 5.0);
    let part = fract(in.texture.y * 5.0);
    let pace = 1.0 + 0.5 * (scattered(row + 7.0) * 2.0 - 1.0);
    let uv = vec2(in.texture.x + scattered(row) - pace * seconds(), part);
    let texel = texture_of(material, material.kinds.z, uv, place.gradients);
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
    return in.color.rgb * color * line * pulse * factor * factor * in.texture.z;
}

// A thin line across which the light falls off.
fn line_at(v: f32, at: f32, sharp: f32) -> f32 {
    return pow(saturate(1.0 - sharp * abs(v - at)), 2.0);
}

fn waveform(in: Painted, gain: f32) -> vec3<f32> {
    let u = in.texture.x;
    let v = in.texture.y;
    let envelope = sin(PI * saturate(u));
    let t = seconds();
    let wave = vec3(
        sin(100.0 * u - 90.0 * t) + sin(60.0 * u - 50.0 * t),
        sin(90.0 * u - 80.0 * t) + sin(50.0 * u - 40.0 * t),
        sin(80.0 * u - 70.0 * t) + sin(40.0 * u - 30.0 * t),
    );
    let at = 0.5 + 0.05 * wave * envelope;
    let sharp = 20.0 + 40.0 * (1.0 - envelope);
    let lines = vec3(line_at(v, at.x, sharp), line_at(v, at.y, sharp), line_at(v, at.z, sharp));
    return bloom(vec4(in.color.rgb, 1.0), gain).rgb * lines * envelope;
}

fn chromatic_wave(in: Painted, gain: f32) -> vec3<f32> {
    let u = in.texture.x;
    let v = fract(in.texture.y + 3.0 * u);
    let t = seconds();
    let at = 0.5 - 0.15 * vec3(
        sin(30.0 * u - 20.0 * t),
        sin(25.0 * u - 16.0 * t + 1.0),
        sin(20.0 * u - 12.0 * t + 2.0),
    );
    let lines = step(abs(vec3(v) - at), vec3(0.0125));
    return bloom(vec4(in.color.rgb, 1.0), gain).rgb * lines;
}

fn neon_pulse(material: Material, in: Painted, place: Place) -> vec3<f32> {
    if !place.is_front {
        return vec3(0.0);
    }
    let x = fract(abs(in.texture.x - 0.75 * seconds()));
    let ring = saturate(pow(10.0 * saturate(0.2 - x), 5.0));
    let straight = saturate(dot(place.normal, place.to_eye));
    let light = bloom(vec4(in.color.rgb, 1.0), material.numbers.y).rgb * ring * pow(straight, 5.0);
    return light + highlight(material, material.f0.rgb, place.normal, place.to_eye, 1.0);
}

fn comet(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let t = seconds();
    let u = in.texture.x;
    let v = in.texture.y;
    let layer = material.kinds.z;
    let a = texture_of(material, layer, vec2(u - t, v - t), place.gradients).r;
    let b = texture_of(material, layer, vec2(u - 1.5 * t, v), place.gradients).g;
    let c = texture_of(material, layer, vec2(u - 0.5 * t, v), place.gradients).b;
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

// How much a film of soap, this thick, mirrors of three colours of light, red, green and blue (nanometres all): light from
// its two sides meets in or out of step.
fn film(straight: f32, thickness: f32) -> vec3<f32> {
    let index = 1.3;
    let inside = sqrt(1.0 - (1.0 - straight * straight) / (index * index));
    // Fresnel, for the two ways that light swings.
    let upright = (straight - index * inside) / (straight + index * inside);
    let level = (index * straight - inside) / (index * straight + inside);
    let r = vec2(upright * upright, level * level);
    let phase = cos(4.0 * PI * index * thickness * inside / vec3(650.0, 510.0, 475.0));
    let across = (1.0 - r.x) * (1.0 - r.x) / (1.0 + r.x * r.x - 2.0 * r.x * phase);
    let along = (1.0 - r.y) * (1.0 - r.y) / (1.0 + r.y * r.y - 2.0 * r.y * phase);
    return 1.0 - 0.5 * (across + along);
}

// Both sides are seen, and lit as if they were the outer one.
fn diamond_hull(material: Material, in: Painted, place: Place) -> vec3<f32> {
    let outwards = select(-place.normal, place.normal, place.is_front);
    let straight = clamp(abs(dot(outwards, place.to_eye)), 1.0e-3, 1.0);
    var rim = 1.0 - straight;
    rim *= 1.0 - pow(rim, 5.0);
    // At grazing angles light runs along the edges.
    rim = mix(rim, 150.0, saturate(1.0 - 10.0 * straight));
    let place_on_film = vec2(rim + outwards.x + 0.015 * seconds(), rim + outwards.y);
    let grain = 0.5 + 0.35 * (noise(11.0 * place_on_film.x + 3.0) + noise(9.0 * place_on_film.y) - 0.75);
    let colors = clamp(film(straight, mix(250.0, 400.0, grain)), vec3(0.0), vec3(1.0));
    let shine = rim * colors * (0.5 * in.color.rgb + 0.25);
    let f0 = in.color.rgb * colors;
    let albedo = 0.2 * in.color.rgb * (1.0 - max(f0.r, max(f0.g, f0.b)));
    let share = first_light_at(in.from_eye.xyz, outwards);
    return shine + albedo * light_on(outwards, share) + highlight(material, f0, outwards, place.to_eye, share);
}

// What is added to what is behind.
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
            return rgb * texel.rgb * texel.a * 800.0 * blaze;
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
            let flicker = texture_of(material, material.kinds.z, in.texture.xy - vec2(t, 0.0), place.gradients).a;
            let moved = texture_of(material, material.kinds.z, in.texture.xy - 0.1 * flicker, place.gradients);
            let c = bloom(vec4(rgb, own), gain) * moved;
            return c.rgb * c.a;
        }
        case STREAMERS: { return streamers(in, place, material); }
        case RAINBOW: { return rainbow(in, gain); }
        case WAVEFORM: { return waveform(in, gain); }
        case CHROMATIC_WAVE: { return chromatic_wave(in, gain); }
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
