// Writing the pictures. The importing text declares the textures and
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
    pad0: u32,
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

const STATUS_BACKGROUND: u32 = 0u;
const STATUS_HIT: u32 = 1u;
const STATUS_UNFINISHED: u32 = 2u;

// Depth of pixels without a hit: the largest f32, since shaders have no infinity.
const DEPTH_NONE: f32 = 3.4028234663852886e38;

fn outputs_write_empty(pixel: vec2<u32>, unfinished: bool) {
    textureStore(color_out, pixel, select(shading.background, shading.unfinished, unfinished));
#ifdef OUTPUT_DEPTH
    textureStore(depth_out, pixel, vec4<f32>(DEPTH_NONE));
#endif
#ifdef OUTPUT_NORMAL
    textureStore(normal_out, pixel, vec4<f32>(0.0));
#endif
#ifdef OUTPUT_STATUS
    textureStore(status_out, pixel, vec4<u32>(select(STATUS_BACKGROUND, STATUS_UNFINISHED, unfinished)));
#endif
}

fn outputs_write_hit(pixel: vec2<u32>, color: vec3<f32>, depth: f32, normal: vec3<f32>) {
    textureStore(color_out, pixel, vec4<f32>(color, 1.0));
#ifdef OUTPUT_DEPTH
    textureStore(depth_out, pixel, vec4<f32>(depth));
#endif
#ifdef OUTPUT_NORMAL
    textureStore(normal_out, pixel, vec4<f32>(normal, 0.0));
#endif
#ifdef OUTPUT_STATUS
    textureStore(status_out, pixel, vec4<u32>(STATUS_HIT));
#endif
}

fn outputs_safe_normalize(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let size = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (size < 1.0e-37) {
        return fallback;
    }
    return normalize(v / size);
}

// Unit normal in world space that faces the viewer, from the index-space gradient; a zero gradient
// gives the direction to the viewer.
fn outputs_normal(gradient: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    let size = max(abs(gradient.x), max(abs(gradient.y), abs(gradient.z)));
    if (size < 1.0e-37) {
        return to_viewer;
    }
    let g = gradient / size;
    let normal = outputs_safe_normalize(
        g.x * shading.normal_x + g.y * shading.normal_y + g.z * shading.normal_z, to_viewer);
    return select(normal, -normal, dot(normal, to_viewer) < 0.0);
}

// Blinn-Phong (J. Blinn, Models of light reflection for computer synthesized pictures, 1977).
fn outputs_shade(normal: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    let to_light = select(shading.light, to_viewer, shading.headlight != 0u);
    let halfway = outputs_safe_normalize(to_light + to_viewer, to_viewer);
    let lambert = max(dot(normal, to_light), 0.0);
    let gloss = max(dot(normal, halfway), 1.0e-6);
    let highlight = select(0.0, shading.specular * pow(gloss, shading.shininess), lambert > 0.0);
    return shading.base_color * (shading.ambient + shading.diffuse * lambert) + vec3<f32>(highlight);
}
