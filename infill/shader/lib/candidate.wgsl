// What one source says about one unfinished pixel, in a word: soft distance behind the nearest possible hit,
// coverage, normal on the octahedron (Q. Meyer et al., On floating-point normal vectors, 2010).

const CANDIDATE_HALF_DISTANCE: f32 = 8.0; // voxels
const CANDIDATE_NONE: u32 = 0x80u;        // a soft distance that no distance has

struct Candidate {
    valid: bool,
    coverage: f32,
    normal: vec3<f32>,  // unit, world space, towards the viewer; 0 without coverage
    soft_distance: f32, // 0 without coverage
}

fn candidate_soft_distance(distance: f32) -> f32 {
    return distance / (CANDIDATE_HALF_DISTANCE + abs(distance));
}

fn candidate_sign(v: vec2<f32>) -> vec2<f32> {
    return select(vec2<f32>(-1.0), vec2<f32>(1.0), v >= vec2<f32>(0.0));
}

fn candidate_octahedron(n: vec3<f32>) -> vec2<f32> {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return select((vec2<f32>(1.0) - abs(p.yx)) * candidate_sign(p), p, n.z >= 0.0);
}

// A unit normal in the upper half of a word.
fn candidate_pack_normal(normal: vec3<f32>) -> u32 {
    return pack4x8snorm(vec4<f32>(0.0, 0.0, candidate_octahedron(normal)));
}

fn candidate_unpack_normal(word: u32) -> vec3<f32> {
    let p = unpack4x8snorm(word).zw;
    let z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3<f32>(p - candidate_sign(p) * max(-z, 0.0), z));
}

fn candidate_pack(coverage: f32, normal: vec3<f32>, distance: f32) -> u32 {
    let covered = pack4x8unorm(vec4<f32>(0.0, coverage, 0.0, 0.0));
    let soft = pack4x8snorm(vec4<f32>(candidate_soft_distance(distance), 0.0, 0.0, 0.0));
    return soft | covered | select(0u, candidate_pack_normal(normal), covered != 0u);
}

fn candidate_unpack(word: u32) -> Candidate {
    let valid = (word & 255u) != CANDIDATE_NONE;
    let coverage = select(0.0, unpack4x8unorm(word).y, valid);
    if (coverage == 0.0) {
        return Candidate(valid, 0.0, vec3<f32>(0.0), 0.0);
    }
    return Candidate(valid, coverage, candidate_unpack_normal(word), unpack4x8snorm(word).x);
}

fn candidate_facing(candidate: Candidate, to_viewer: vec3<f32>) -> f32 {
    return clamp(dot(candidate.normal, to_viewer), 0.0, 1.0);
}

// Coverage, coverage times N.V.
fn candidate_pair(candidate: Candidate, to_viewer: vec3<f32>) -> vec2<f32> {
    return candidate.coverage * vec2<f32>(1.0, candidate_facing(candidate, to_viewer));
}
