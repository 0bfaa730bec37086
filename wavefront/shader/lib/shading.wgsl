// Shading of a surface. The importing text declares
//   var<uniform> shading: ShadingParams;

struct ShadingParams {
    background: vec4<f32>,
    unfinished: vec4<f32>,
    base_color: vec3<f32>,
    ambient: f32,
    light: vec3<f32>,      // unit vector to the light, world space
    headlight: u32,        // 1: the light is at the viewer
    diffuse: f32,
    specular: f32,
    shininess: f32,
    start_columns: u32,    // of pixels that a frame's start gives the background's colour: none if they have it
    normal_x: vec3<f32>,   // columns of world_from_index's inverse transpose, up to a positive factor
    pad1: u32,
    normal_y: vec3<f32>,
    pad2: u32,
    normal_z: vec3<f32>,
    pad3: u32,
    world_x: vec3<f32>,    // columns of world_from_index's linear part, up to a positive factor
    pad4: u32,
    world_y: vec3<f32>,
    pad5: u32,
    world_z: vec3<f32>,
    pad6: u32,
}

fn shading_safe_normalize(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let size = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (size < 1.0e-37) {
        return fallback;
    }
    return normalize(v / size);
}

// World-space unit vector to the viewer, from a ray's index-space direction.
fn shading_to_viewer(direction: vec3<f32>) -> vec3<f32> {
    let along = direction.x * shading.world_x + direction.y * shading.world_y
        + direction.z * shading.world_z;
    return -shading_safe_normalize(along, vec3<f32>(0.0, 0.0, 1.0));
}

// Unit normal in world space that faces the viewer, from the index-space gradient; a zero gradient
// gives the direction to the viewer.
fn shading_normal(gradient: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    let size = max(abs(gradient.x), max(abs(gradient.y), abs(gradient.z)));
    if (size < 1.0e-37) {
        return to_viewer;
    }
    let g = gradient / size;
    let normal = shading_safe_normalize(
        g.x * shading.normal_x + g.y * shading.normal_y + g.z * shading.normal_z, to_viewer);
    return select(normal, -normal, dot(normal, to_viewer) < 0.0);
}

// Blinn-Phong (J. Blinn, Models of light reflection for computer synthesized pictures, 1977).
fn shading_color(normal: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    let to_light = select(shading.light, to_viewer, shading.headlight != 0u);
    let halfway = shading_safe_normalize(to_light + to_viewer, to_viewer);
    let lambert = max(dot(normal, to_light), 0.0);
    let gloss = max(dot(normal, halfway), 1.0e-6);
    let highlight = select(0.0, shading.specular * pow(gloss, shading.shininess), lambert > 0.0);
    return shading.base_color * (shading.ambient + shading.diffuse * lambert) + vec3<f32>(highlight);
}
