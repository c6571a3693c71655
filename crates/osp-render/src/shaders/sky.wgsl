// The sky and the scenery behind all polygons; follows shadow.wgsl.

struct Sky {
    @builtin(position) position: vec4<f32>,
    @location(0) direction: vec3<f32>,
}

// A triangle that covers the picture, at the greatest distance.
@vertex
fn vertex_sky(@builtin(vertex_index) index: u32) -> Sky {
    let at = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    let direction = view.corners[0].xyz + view.corners[1].xyz * at.x + view.corners[2].xyz * (1.0 - at.y);
    return Sky(vec4(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, 0.0, 1.0), direction);
}

// Linear interpolation at `x` between four points; `at` ascends.
fn interpolated(x: f32, at: vec4<f32>, values: vec4<f32>) -> f32 {
    let parts = saturate((vec3(x) - at.xyz) / (at.yzw - at.xyz));
    return values.x + dot(parts, values.yzw - values.xyz);
}

// Depth along the view of a point at this distance in this direction.
fn depth_along(direction: vec3<f32>, distance: f32) -> f32 {
    let middle = view.corners[0].xyz + 0.5 * (view.corners[1].xyz + view.corners[2].xyz);
    return distance * dot(direction, normalize(middle));
}

// Vector from the eye along `direction`, which goes down, to the horizontal plane at `height`.
fn down_to(direction: vec3<f32>, height: f32) -> vec3<f32> {
    return direction * (max(view.eye_in_world.y - height, 0.0) / max(-direction.y, 1.0e-4));
}

// Half the side of a square slab with cut corners. Its top has height 0, and it stands on a floor.
const SLAB_M: f32 = 1.5;
const SLAB_CORNER_M: f32 = 2.77;
const FLOOR_M: f32 = -0.025;
// Half the width of a groove of the slab. A groove is drawn at least a pixel wide.
const GROOVE_M: f32 = 0.006;
const INSET_M: f32 = 1.26;

fn is_on_slab(at: vec2<f32>) -> bool {
    return max(abs(at.x), abs(at.y)) < SLAB_M && abs(at.x) + abs(at.y) < SLAB_CORNER_M;
}

// Baked light of lamps on the floor of the environment Standard, by the distance from the floor's middle.
fn standard_bake(radius: f32) -> f32 {
    if radius < 2.0 {
        return interpolated(radius, vec4(1.3, 1.5, 1.7, 2.0), vec4(0.19, 0.22, 0.27, 0.33));
    }
    if radius < 5.0 {
        return interpolated(radius, vec4(2.0, 2.5, 3.0, 5.0), vec4(0.33, 0.34, 0.29, 0.235));
    }
    if radius < 20.0 {
        return interpolated(radius, vec4(5.0, 8.0, 12.0, 20.0), vec4(0.235, 0.155, 0.084, 0.027));
    }
    return interpolated(radius, vec4(20.0, 30.0, 39.0, 40.2), vec4(0.027, 0.016, 0.004, 0.0));
}

// The ground of Standard: a slab in a pool of light, on a floor that fades into the fog.
fn floor_color(direction: vec3<f32>) -> vec3<f32> {
    let up = vec3(0.0, 1.0, 0.0);
    let to_slab = down_to(direction, 0.0);
    let at = view.eye_in_world.xz + to_slab.xz;
    if is_on_slab(at) {
        let radius = length(at);
        let pool = select(
            interpolated(radius, vec4(0.75, 1.125, 1.5, 2.0), vec4(0.48, 0.368, 0.32, 0.32)),
            interpolated(radius, vec4(0.0, 0.2, 0.375, 0.75), vec4(0.741, 0.72, 0.65, 0.48)),
            radius < 0.75,
        );
        let distance = length(to_slab);
        // Thin lines must not flicker.
        let pixel = 0.003 * distance / max(-direction.y, 0.05);
        let groove = saturate(1.0 + (GROOVE_M - min(abs(at.x), abs(at.y))) / pixel) * min(2.0 * GROOVE_M / pixel, 1.0);
        let inset = max(max(abs(at.x), abs(at.y)), (abs(at.x) + abs(at.y)) * 0.7071 - 0.43);
        let outside = saturate(0.5 + (inset - INSET_M) / pixel);
        let shade = (1.0 - 0.25 * groove) * mix(1.0, 0.8, outside);
        let color = mix(vec3(2.75, 2.6, 2.27), vec3(2.95, 2.6, 2.2), saturate(1.0 - radius));
        let albedo = surroundings.floor.rgb * color * pool * shade;
        return fogged(albedo * light_on(up, first_light_at(to_slab, up)), depth_along(direction, distance));
    }
    let from_eye = down_to(direction, FLOOR_M);
    let place = view.eye_in_world.xz + from_eye.xz;
    // The slab darkens the floor close to its sides.
    let radius = max(max(abs(place.x), abs(place.y)), 0.94 * length(place));
    let albedo = surroundings.floor.rgb * vec3(2.07, 1.99, 1.68) * standard_bake(radius);
    return fogged(albedo * light_on(up, first_light_at(from_eye, up)), depth_along(direction, length(from_eye)));
}

// Numbers of sceneries, in `surroundings.sky_up.w`. Number 1 is Standard, with the floor above.
const PEDESTAL: f32 = 2.0;
const DRESS_FORM: f32 = 3.0;
const NIGHT_SKY: f32 = 4.0;
const SPACE: f32 = 5.0;
// Position along z of the column and of the bust, metres.
const PROP_Z_M: f32 = -0.5;

// Colour of the ground in this direction, for sceneries 2 to 4. The slab is brightest in its middle.
fn ground_color(direction: vec3<f32>, place: f32) -> vec3<f32> {
    let distance = max(view.eye_in_world.y, 0.0) / max(-direction.y, 1.0e-4);
    let from_eye = direction * distance;
    let at = view.eye_in_world.xz + from_eye.xz;
    let radius = length(at);
    let corner = abs(at.x) + abs(at.y);
    let is_on_slab = max(abs(at.x), abs(at.y)) < 1.5 && corner < 2.77;
    let pool = exp(-radius * radius / 0.65);
    var albedo = 0.0;
    if place == PEDESTAL {
        let shadow = smoothstep(0.33, 0.4, max(abs(at.x), abs(at.y - PROP_Z_M)));
        let slab = 0.41 * (0.3 + 0.4 * pool) * mix(0.4, 1.0, shadow);
        albedo = select(interpolated(radius, vec4(1.5, 2.0, 2.5, 3.0), vec4(0.064, 0.087, 0.092, 0.091)), slab, is_on_slab);
    } else if place == DRESS_FORM {
        let shadow = smoothstep(0.12, 0.2, length(vec2(at.x, at.y - PROP_Z_M)));
        let slab = 0.42 * (0.29 + 0.38 * pool) * mix(0.4, 1.0, shadow);
        albedo = select(interpolated(radius, vec4(1.5, 2.0, 2.5, 3.0), vec4(0.074, 0.105, 0.111, 0.108)), slab, is_on_slab);
    } else {
        let slab = 0.17 * (0.3 + 0.4 * pool);
        let near = interpolated(radius, vec4(1.5, 2.0, 3.0, 5.0), vec4(0.047, 0.075, 0.0685, 0.06));
        let beyond = interpolated(radius, vec4(5.0, 8.0, 12.0, 20.0), vec4(0.06, 0.051, 0.0375, 0.0254));
        let ground = select(beyond, near, radius < 5.0);
        albedo = select(ground, slab, is_on_slab);
    }
    let light = light_on(vec3(0.0, 1.0, 0.0), first_light_at(from_eye, vec3(0.0, 1.0, 0.0)));
    return fogged(albedo * light, depth_along(direction, distance));
}

// Height and distance of a hill every ten degrees, metres, from the left (-x) over the front (-z).
const HILLS: array<vec2<f32>, 36> = array(
    vec2(5.8, 96.0), vec2(3.9, 83.0), vec2(3.9, 81.0), vec2(3.0, 73.0), vec2(7.0, 92.0), vec2(3.8, 74.0),
    vec2(2.5, 76.0), vec2(4.4, 88.0), vec2(5.3, 84.0), vec2(5.4, 85.0), vec2(3.4, 69.0), vec2(3.2, 74.0),
    vec2(6.4, 83.0), vec2(6.6, 83.0), vec2(2.3, 80.0), vec2(3.8, 74.0), vec2(3.4, 93.0), vec2(5.8, 91.0),
    vec2(5.8, 91.0), vec2(2.3, 82.0), vec2(3.5, 74.0), vec2(5.9, 89.0), vec2(5.9, 89.0), vec2(3.8, 72.0),
    vec2(3.5, 74.0), vec2(5.3, 88.0), vec2(7.4, 87.0), vec2(7.4, 87.0), vec2(3.3, 63.0), vec2(3.9, 74.0),
    vec2(4.3, 92.0), vec2(5.8, 85.0), vec2(5.6, 91.0), vec2(6.1, 91.0), vec2(2.3, 75.0), vec2(5.3, 95.0),
);

// The hill in this direction. rgb: its colour in fog. w: 1 if there is a hill, else 0.
fn hill(direction: vec3<f32>, place: f32) -> vec4<f32> {
    let turn = fract(atan2(-direction.z, -direction.x) / (2.0 * PI)) * 36.0;
    let steep = direction.y / max(length(direction.xz), 1.0e-4);
    let factor = select(0.56, 0.7, place == 1.0 || place == NIGHT_SKY);
    var hill_distance = 0.0;
    for (var i = 0; i < 2; i++) {
        let number = floor(turn) + f32(i);
        let one = HILLS[u32(number) % 36u];
        // A hill is 18 m wide at its foot and 4 m at its top, with straight slopes.
        let aside = abs(turn - number) * 0.1745 * one.y;
        let height = one.x * factor * saturate((9.0 - aside) / 7.0) - view.eye_in_world.y;
        hill_distance = select(hill_distance, one.y, height > one.y * steep);
    }
    let own = select(vec3(0.0), vec3(select(0.095, 0.022, place == NIGHT_SKY)), place > 1.0);
    let lit = own * light_on(vec3(0.0, 1.0, 0.0), 1.0);
    return vec4(fogged(lit, depth_along(direction, hill_distance)), select(0.0, 1.0, hill_distance > 0.0));
}

// Profile of a solid of revolution: heights and radii, metres.
alias Profile = array<vec2<f32>, 12>;
const COLUMN: Profile = Profile(
    vec2(0.058, 0.29), vec2(0.07, 0.28), vec2(0.11, 0.255), vec2(0.15, 0.225), vec2(0.19, 0.21), vec2(0.22, 0.203),
    vec2(0.79, 0.207), vec2(0.82, 0.21), vec2(0.86, 0.225), vec2(0.9, 0.25), vec2(0.93, 0.3), vec2(0.949, 0.307),
);
const PLINTH_HALF_M: f32 = 0.339;
// A tailor's bust on a stand. Its depth is `BUST_DEPTH` times its width.
const BUST: Profile = Profile(
    vec2(0.0, 0.19), vec2(0.02, 0.19), vec2(0.03, 0.02), vec2(1.12, 0.02), vec2(1.125, 0.15), vec2(1.2, 0.17),
    vec2(1.4, 0.125), vec2(1.62, 0.17), vec2(1.75, 0.185), vec2(1.83, 0.1), vec2(1.87, 0.055), vec2(1.97, 0.05),
);
const BUST_DEPTH: f32 = 0.62;

// First hit of a ray with a solid of revolution whose depth is `depth` times its width. xyz: normal. w: distance, 1.0e9
// without a hit.
fn turned_at(eye_there: vec3<f32>, along: vec3<f32>, profile: Profile, depth: f32) -> vec4<f32> {
    var points = profile;
    let eye = eye_there / vec3(1.0, 1.0, depth);
    let direction = along / vec3(1.0, 1.0, depth);
    var nearest = 1.0e9;
    var normal = vec3(0.0, 1.0, 0.0);
    for (var i = 0; i < 11; i++) {
        let low = points[i];
        let high = points[i + 1];
        let slope = (high.y - low.y) / (high.x - low.x);
        let radius = low.y + slope * (eye.y - low.x);
        let a = dot(direction.xz, direction.xz) - slope * slope * direction.y * direction.y;
        let b = dot(eye.xz, direction.xz) - radius * slope * direction.y;
        let c = dot(eye.xz, eye.xz) - radius * radius;
        let square = b * b - a * c;
        let distance = (-b - sqrt(max(square, 0.0))) / select(a, 1.0e-6, abs(a) < 1.0e-6);
        let at = eye + distance * direction;
        if square >= 0.0 && distance > 0.0 && distance < nearest && at.y >= low.x && at.y <= high.x {
            nearest = distance;
            normal = normalize(vec3(at.x, -slope * length(at.xz), at.z / depth));
        }
    }
    return vec4(normal, nearest);
}

// First hit of a ray from the eye with the bust. xyz: normal. w: distance, negative without a hit.
fn bust_at(direction: vec3<f32>) -> vec4<f32> {
    let found = turned_at(view.eye_in_world.xyz - vec3(0.0, 0.0, PROP_Z_M), direction, BUST, BUST_DEPTH);
    return vec4(found.xyz, select(-1.0, found.w, found.w < 1.0e9));
}

// The same as `bust_at`, for the pedestal.
fn pedestal_at(direction: vec3<f32>) -> vec4<f32> {
    let eye = view.eye_in_world.xyz - vec3(0.0, 0.0, PROP_Z_M);
    let column = turned_at(eye, direction, COLUMN, 1.0);
    var nearest = column.w;
    var normal = column.xyz;
    // The flat tops of the column and of the plinth, and the plinth's sides.
    let tops = (vec2(0.949, 0.058) - eye.y) / min(direction.y, -1.0e-6);
    let on_column = eye.xz + tops.x * direction.xz;
    if direction.y < 0.0 && tops.x > 0.0 && tops.x < nearest && length(on_column) < 0.307 {
        nearest = tops.x;
        normal = vec3(0.0, 1.0, 0.0);
    }
    let on_plinth = abs(eye.xz + tops.y * direction.xz);
    if direction.y < 0.0 && tops.y > 0.0 && tops.y < nearest && max(on_plinth.x, on_plinth.y) < PLINTH_HALF_M {
        nearest = tops.y;
        normal = vec3(0.0, 1.0, 0.0);
    }
    let side = select(vec2(-1.0), vec2(1.0), eye.xz >= vec2(0.0));
    let sides = (side * PLINTH_HALF_M - eye.xz) / select(direction.xz, vec2(1.0e-6), abs(direction.xz) < vec2(1.0e-6));
    let on_x = eye + sides.x * direction;
    if sides.x > 0.0 && sides.x < nearest && abs(on_x.z) < PLINTH_HALF_M && on_x.y > 0.0 && on_x.y < 0.058 {
        nearest = sides.x;
        normal = vec3(side.x, 0.0, 0.0);
    }
    let on_z = eye + sides.y * direction;
    if sides.y > 0.0 && sides.y < nearest && abs(on_z.x) < PLINTH_HALF_M && on_z.y > 0.0 && on_z.y < 0.058 {
        nearest = sides.y;
        normal = vec3(0.0, 0.0, side.y);
    }
    return vec4(normal, select(-1.0, nearest, nearest < 1.0e9));
}

fn prop_color(direction: vec3<f32>, found: vec4<f32>, albedo: f32) -> vec3<f32> {
    let share = first_light_at(direction * found.w, found.xyz);
    return fogged(albedo * light_on(found.xyz, share), depth_along(direction, found.w));
}

// The moon of Space, a grey sphere in front of the origin.
const MOON_M: vec3<f32> = vec3(0.0, 1.3, -0.5);
const MOON_RADIUS_M: f32 = 0.182;

fn moon_at(direction: vec3<f32>) -> f32 {
    let from_moon = view.eye_in_world.xyz - MOON_M;
    let along = dot(from_moon, direction);
    let square = along * along - dot(from_moon, from_moon) + MOON_RADIUS_M * MOON_RADIUS_M;
    return select(-1.0, -along - sqrt(max(square, 0.0)), square > 0.0);
}

fn moon_color(direction: vec3<f32>, distance: f32) -> vec3<f32> {
    let normal = normalize(view.eye_in_world.xyz + direction * distance - MOON_M);
    return 0.35 * light_on(normal, first_light_at(direction * distance, normal));
}

// Two pseudo-random numbers from 0 to 1 for a cell of the sky.
fn scattered_in(cell: vec2<f32>) -> vec2<f32> {
    let n = dot(cell, vec2(127.1, 311.7));
    return vec2(scattered(n), scattered(n + 57.3));
}

// About one star per square degree. A star is a tenth of a degree wide, or a pixel if that is larger.
fn stars_at(direction: vec3<f32>, pixel: f32) -> vec3<f32> {
    let height = asin(clamp(direction.y, -1.0, 1.0)) * 57.2958;
    let row = floor(height);
    // Number of cells of a row: the length of the circle at this height, degrees.
    let count = max(round(360.0 * cos((row + 0.5) / 57.2958)), 1.0);
    let turn = fract(atan2(direction.z, direction.x) / (2.0 * PI)) * count;
    let cell = vec2(floor(turn), row);
    let random = scattered_in(cell);
    let other = scattered_in(cell + vec2(1000.0, 0.0));
    let size = max(0.05, 0.5 * pixel * 57.2958);
    let off = length(vec2(turn, height) - cell - 0.2 - 0.6 * random) / size;
    let bright = pow(other.x, 3.0) * (0.05 * 0.05) / (size * size) * saturate(1.5 - off);
    let tint = mix(vec3(1.0, 0.85, 0.7), vec3(0.75, 0.85, 1.0), other.y);
    return min(bright * 1.5, 1.0) * tint;
}

// A cloud of the Milky Way. `x` is its position on a panorama, 0 to 1 from the left. `height` above the horizon and
// `size` are in degrees.
fn cloud(direction: vec3<f32>, x: f32, height: f32, size: f32, color: vec3<f32>) -> vec3<f32> {
    let angles = vec2((0.5 - x) * 2.0 * PI, height / 57.2958);
    let middle = vec3(cos(angles.x) * cos(angles.y), sin(angles.y), -sin(angles.x) * cos(angles.y));
    let off = acos(clamp(dot(direction, middle), -1.0, 1.0)) * 57.2958 / size;
    return color * exp(-off * off);
}

fn milky_way(direction: vec3<f32>) -> vec3<f32> {
    return cloud(direction, 0.105, 50.0, 4.0, vec3(0.25, 0.28, 0.31))
        + cloud(direction, 0.15, 42.0, 2.0, vec3(0.08, 0.1, 0.2))
        + cloud(direction, 0.22, 41.0, 2.5, vec3(0.2, 0.17, 0.25))
        + cloud(direction, 0.26, 39.0, 4.0, vec3(0.12, 0.03, 0.03))
        + cloud(direction, 0.52, 40.0, 3.0, vec3(0.25, 0.15, 0.06))
        + cloud(direction, 0.66, 41.0, 5.0, vec3(0.08, 0.02, 0.02))
        + cloud(direction, 0.97, 40.0, 2.0, vec3(0.08, 0.1, 0.2))
        + cloud(direction, 0.87, 24.0, 9.0, vec3(0.04, 0.045, 0.055));
}

@fragment
fn fragment_sky(in: Sky) -> @location(0) vec4<f32> {
    let direction = normalize(in.direction);
    let pixel = length(fwidth(direction));
    let place = surroundings.sky_up.w;
    if place == PEDESTAL {
        let found = pedestal_at(direction);
        if found.w > 0.0 {
            // The albedo is that of concrete.
            return vec4(prop_color(direction, found, 0.31), 1.0);
        }
    }
    if place == DRESS_FORM {
        let found = bust_at(direction);
        if found.w > 0.0 {
            // The albedo is that of linen.
            return vec4(prop_color(direction, found, 0.42), 1.0);
        }
    }
    if place == 1.0 && direction.y < 0.0 {
        return vec4(floor_color(direction), 1.0);
    }
    if place > 1.0 && place < SPACE && direction.y < 0.0 {
        return vec4(ground_color(direction, place), 1.0);
    }
    if place > 0.0 && place < SPACE {
        let found = hill(direction, place);
        if found.w > 0.0 {
            return vec4(found.rgb, 1.0);
        }
    }
    if place == SPACE {
        let distance = moon_at(direction);
        if distance > 0.0 {
            return vec4(moon_color(direction, distance), 1.0);
        }
    }
    let high = 0.5 + 0.5 * dot(direction, surroundings.sky_up.xyz);
    var color = mix(surroundings.sky_low.rgb, surroundings.sky_high.rgb, high);
    // With the Milky Way, stars are only above the horizon. Without it, they are all around, with additional fainter
    // ones.
    if surroundings.sky_low.w == 1.0 {
        color += stars_at(direction, pixel) + 0.7 * stars_at(direction.zxy, pixel);
    }
    if surroundings.sky_low.w == 2.0 && direction.y > 0.05 {
        color += stars_at(direction, pixel);
    }
    if surroundings.sky_low.w == 2.0 {
        color += milky_way(direction);
    }
    return vec4(color, 1.0);
}
