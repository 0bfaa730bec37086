// Writing the pictures. The importing text declares the textures and what `shading` needs.
#import shading

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
