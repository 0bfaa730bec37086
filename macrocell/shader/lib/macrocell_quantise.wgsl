// Monotone 8-bit quantisation inside a coarse cell's range. Range codes and isovalues go through the
// same non-decreasing function, so min < iso <= max implies code(min) <= code(iso) <= code(max):
// the test on codes is conservative without any rounding analysis. The step is a power of two,
// hence the only rounding is that of one subtraction.

// Power of two s with (high - low) * s < 256; values within the WebGPU-safe range |v| <= 2^124.
fn macrocell_scale(low: f32, high: f32) -> f32 {
    let exponent = max((bitcast<u32>(high - low) >> 23u) & 255u, 8u);
    return bitcast<f32>((261u - exponent) << 23u);
}

fn macrocell_code(value: f32, low: f32, scale: f32) -> u32 {
    return u32(clamp(floor((value - low) * scale), 0.0, 255.0));
}
