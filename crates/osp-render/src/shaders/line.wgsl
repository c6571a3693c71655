// Lines and transparent faces in world space that are not part of the model: grid, boxes, shadow volumes, cursors.

struct Lines {
    clip_from_eye: mat4x4<f32>,
    eye_in_world: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: Lines;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
}

@vertex
fn vertex(@location(0) point: vec3<f32>, @location(1) color: vec4<f32>) -> Corner {
    var out: Corner;
    out.position = view.clip_from_eye * vec4(point - view.eye_in_world.xyz, 1.0);
    out.color = color;
    return out;
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    return in.color;
}
