//! Twin of the geometry and shading of `shader/lib/outputs.wgsl`.

use crate::ShadingParams;

/// Scalar product.
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn combine(columns: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| v[0] * columns[0][i] + v[1] * columns[1][i] + v[2] * columns[2][i])
}

/// The unit vector along `v`; `fallback` where `v` is too small for a direction.
pub fn safe_normalize(v: [f32; 3], fallback: [f32; 3]) -> [f32; 3] {
    let size = v.iter().fold(0.0_f32, |most, c| most.max(c.abs()));
    if size < 1.0e-37 {
        return fallback;
    }
    let scaled = v.map(|c| c / size);
    let length = dot(scaled, scaled).sqrt();
    scaled.map(|c| c / length)
}

/// World-space unit vector to the viewer, from a ray's index-space direction.
pub fn to_viewer(shading: &ShadingParams, direction: [f32; 3]) -> [f32; 3] {
    let columns = [shading.world_x, shading.world_y, shading.world_z];
    safe_normalize(combine(columns, direction), [0.0, 0.0, 1.0]).map(|c| -c)
}

/// Unit normal in world space that faces the viewer, from the index-space gradient; a zero gradient gives
/// the direction to the viewer.
pub fn normal(shading: &ShadingParams, gradient: [f32; 3], to_viewer: [f32; 3]) -> [f32; 3] {
    let size = gradient.iter().fold(0.0_f32, |most, c| most.max(c.abs()));
    if size < 1.0e-37 {
        return to_viewer;
    }
    let columns = [shading.normal_x, shading.normal_y, shading.normal_z];
    let normal = safe_normalize(combine(columns, gradient.map(|g| g / size)), to_viewer);
    if dot(normal, to_viewer) < 0.0 { normal.map(|c| -c) } else { normal }
}

/// Colour of a surface with this unit normal.
pub fn shade(shading: &ShadingParams, normal: [f32; 3], to_viewer: [f32; 3]) -> [f32; 3] {
    let to_light = if shading.headlight != 0 { to_viewer } else { shading.light };
    let halfway: [f32; 3] = std::array::from_fn(|i| to_light[i] + to_viewer[i]);
    let halfway = safe_normalize(halfway, to_viewer);
    let lambert = dot(normal, to_light).max(0.0);
    let gloss = dot(normal, halfway).max(1.0e-6);
    let highlight =
        if lambert > 0.0 { shading.specular * gloss.powf(shading.shininess) } else { 0.0 };
    shading.base_color.map(|c| c * (shading.ambient + shading.diffuse * lambert) + highlight)
}
