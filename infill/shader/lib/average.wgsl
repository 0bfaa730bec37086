// Averages over finished pixels (S. Gortler et al., The lumigraph, 1996).

struct Average {
    weight: f32,       // share of what is known, at most 1
    coverage: f32,     // times the weight
    normal: vec3<f32>, // times coverage and weight
    t: f32,            // parameter along the ray, times coverage and weight
}

fn average_none() -> Average {
    return Average(0.0, 0.0, vec3<f32>(0.0), 0.0);
}

// The sum of `a` and `factor` times `b`.
fn average_plus(a: Average, b: Average, factor: f32) -> Average {
    return Average(
        a.weight + factor * b.weight,
        a.coverage + factor * b.coverage,
        a.normal + factor * b.normal,
        a.t + factor * b.t,
    );
}

// The sum of four texels as one of the next level.
fn average_limited(sum: Average) -> Average {
    return average_plus(average_none(), sum, select(1.0, 1.0 / sum.weight, sum.weight > 1.0));
}

fn average_pack(a: Average) -> vec4<u32> {
    return vec4<u32>(
        pack2x16float(vec2<f32>(a.weight, a.coverage)),
        pack2x16float(a.normal.xy),
        pack2x16float(vec2<f32>(a.normal.z, 0.0)),
        bitcast<u32>(a.t),
    );
}

fn average_unpack(words: vec4<u32>) -> Average {
    let first = unpack2x16float(words.x);
    let normal = vec3<f32>(unpack2x16float(words.y), unpack2x16float(words.z).x);
    return Average(first.x, first.y, normal, bitcast<f32>(words.w));
}
