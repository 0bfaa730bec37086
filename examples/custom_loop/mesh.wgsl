// A lit mesh of the host application, in a camera that it shares with the isosurface.

struct Params {
    clip_from_world: mat4x4<f32>,
    eye: vec4<f32>,
    color: vec4<f32>, // linear
}

@group(0) @binding(0) var<uniform> params: Params;

// Whether the colour target stores what it is given, instead of encoding it to sRGB itself.
override encode: bool = false;

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

@vertex
fn mesh_vertex(@location(0) world: vec3<f32>, @location(1) normal: vec3<f32>) -> Vertex {
    return Vertex(params.clip_from_world * vec4<f32>(world, 1.0), world, normal);
}

@fragment
fn mesh_fragment(vertex: Vertex) -> @location(0) vec4<f32> {
    let to_eye = normalize(params.eye.xyz - vertex.world);
    let facing = abs(dot(normalize(vertex.normal), to_eye)); // both sides, light from the viewer
    let linear = params.color.rgb * (0.1 + 0.9 * facing);
    if (!encode) {
        return vec4<f32>(linear, 1.0);
    }
    let low = linear * 12.92;
    let high = 1.055 * pow(linear, vec3<f32>(1.0 / 2.4)) - 0.055;
    return vec4<f32>(select(high, low, linear <= vec3<f32>(0.0031308)), 1.0);
}
