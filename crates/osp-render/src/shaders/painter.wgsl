// Draws parts of polygons for a painter. Follows polygon.wgsl. A part has the colour of its whole polygon.

@vertex
fn vertex_part(@location(0) from_eye: vec3<f32>, @location(1) id: u32) -> Corner {
    var out: Corner;
    out.position = view.clip_from_eye * vec4(from_eye, 1.0);
    out.color = color_of(fetch(id), view.styles[0]);
    return out;
}
