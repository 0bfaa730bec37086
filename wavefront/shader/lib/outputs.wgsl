// Writing the pictures. The importing text declares what `shading` needs.
#import output_textures
#import shading

const STATUS_BACKGROUND: u32 = 0u;
const STATUS_HIT: u32 = 1u;

// Of an unfinished pixel, as the start of a frame makes them all: depth and normal are those of the background already.
fn outputs_write_background(pixel: vec2<u32>) {
    textureStore(color_out, pixel, shading.background);
    outputs_write_background_status(pixel);
}

fn outputs_write_background_status(pixel: vec2<u32>) {
#ifdef OUTPUT_STATUS
    textureStore(status_out, pixel, vec4<u32>(STATUS_BACKGROUND));
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
