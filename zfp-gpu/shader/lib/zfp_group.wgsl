// Decodes up to 32 blocks by a workgroup of 64 invocations, in two phases through workgroup memory.
// First one invocation per block reads its bit planes, which is serial by the format. Then eight
// invocations per block gather coefficients from the planes, a line of four samples along z at a
// time, undo the transform and give rows of four samples along x, so that writes are coalesced.
//
//   zfp_group_read(block, ..) or zfp_group_leave_out(block) for every block, workgroupBarrier(),
//   zfp_group_invert(lane) by all invocations, then zfp_group_row(block, row).
#import zfp_block

const ZFP_GROUP_BLOCKS: u32 = 32u;
const ZFP_GROUP_LANES: u32 = 64u;

// Blocks that the group transforms at a time, eight invocations each.
const ZFP_GROUP_AT_ONCE: u32 = 8u;

// First the planes: half h of plane p of block b at 32 * (2p + h) + b, so that the invocations of
// the first phase write to neighbouring words. Then the integers of block b from 64 * b on.
var<workgroup> zfp_words: array<u32, 2048>;
// Biased exponent and, from bit 8 on, the number of planes read; 0 for a block of zeros.
var<workgroup> zfp_headers: array<u32, ZFP_GROUP_BLOCKS>;

// Reads a block's planes; by one invocation.
fn zfp_group_read(block: u32, start: vec2<u32>, bits_per_block: u32) {
    var reader = zfp_reader(start, bits_per_block);
    let exponent = zfp_read_exponent(&reader);
    if exponent <= ZFP_ZERO_EXPONENT {
        zfp_headers[block] = 0u;
        return;
    }
    var planes = 0u;
    while reader.budget > 0u && planes < ZFP_PLANES {
        let plane = zfp_read_plane(&reader);
        zfp_words[64u * planes + block] = plane.x;
        zfp_words[64u * planes + 32u + block] = plane.y;
        planes += 1u;
    }
    zfp_headers[block] = exponent | (planes << 8u);
}

// Says that there is no such block: it counts as zeros.
fn zfp_group_leave_out(block: u32) {
    zfp_headers[block] = 0u;
}

// Two lines of four samples along z.
struct ZfpLines {
    a: vec4<i32>,
    b: vec4<i32>,
}

// The samples whose negabinary digits are in the planes, transformed: lines `line` and `line` + 8 of a block.
fn zfp_group_gather(block: u32, line: u32) -> ZfpLines {
    let bytes = vec4<u32>(0u, 8u, 16u, 24u);
    let coefficients_a = (vec4<u32>(ZFP_COEFFICIENTS[line]) >> bytes) & vec4<u32>(63u);
    let coefficients_b = (vec4<u32>(ZFP_COEFFICIENTS[line + 8u]) >> bytes) & vec4<u32>(63u);
    let upper_a = coefficients_a >= vec4<u32>(32u);
    let upper_b = coefficients_b >= vec4<u32>(32u);
    let shift_a = coefficients_a & vec4<u32>(31u);
    let shift_b = coefficients_b & vec4<u32>(31u);
    let planes = zfp_headers[block] >> 8u;
    var a = vec4<u32>(0u);
    var b = vec4<u32>(0u);
    for (var plane = 0u; plane < planes; plane++) {
        let low = vec4<u32>(zfp_words[64u * plane + block]);
        let high = vec4<u32>(zfp_words[64u * plane + 32u + block]);
        // The planes come from the highest digit down.
        a = (a << vec4<u32>(1u)) | ((select(low, high, upper_a) >> shift_a) & vec4<u32>(1u));
        b = (b << vec4<u32>(1u)) | ((select(low, high, upper_b) >> shift_b) & vec4<u32>(1u));
    }
    // A shift by 32 would be a shift by 0; blocks that are not zero have a plane.
    let rest = vec4<u32>(32u - max(planes, 1u));
    return ZfpLines(zfp_group_signed(a << rest), zfp_group_signed(b << rest));
}

fn zfp_group_signed(digits: vec4<u32>) -> vec4<i32> {
    let flip = vec4<u32>(ZFP_NEGABINARY);
    return bitcast<vec4<i32>>((digits ^ flip) - flip);
}

fn zfp_group_word(block: u32, start: u32, stride: u32) -> vec4<i32> {
    let at = 64u * block + start;
    return bitcast<vec4<i32>>(vec4<u32>(
        zfp_words[at], zfp_words[at + stride], zfp_words[at + 2u * stride], zfp_words[at + 3u * stride]));
}

fn zfp_group_store(block: u32, start: u32, stride: u32, line: vec4<i32>) {
    let words = bitcast<vec4<u32>>(line);
    let at = 64u * block + start;
    zfp_words[at] = words.x;
    zfp_words[at + stride] = words.y;
    zfp_words[at + 2u * stride] = words.z;
    zfp_words[at + 3u * stride] = words.w;
}

// Undoes the transform along z and y; to be called by all invocations.
fn zfp_group_invert(lane: u32) {
    let line = lane & 7u;
    // All planes are gathered before the first integer overwrites them.
    var lines: array<vec4<i32>, 8>;
    for (var turn = 0u; turn < 4u; turn++) {
        let block = turn * ZFP_GROUP_AT_ONCE + (lane >> 3u);
        if zfp_headers[block] != 0u {
            let gathered = zfp_group_gather(block, line);
            lines[2u * turn] = zfp_invert_lift(gathered.a);
            lines[2u * turn + 1u] = zfp_invert_lift(gathered.b);
        }
    }
    workgroupBarrier();
    for (var turn = 0u; turn < 4u; turn++) {
        let block = turn * ZFP_GROUP_AT_ONCE + (lane >> 3u);
        zfp_group_store(block, line, 16u, lines[2u * turn]);
        zfp_group_store(block, line + 8u, 16u, lines[2u * turn + 1u]);
    }
    workgroupBarrier();
    for (var turn = 0u; turn < 4u; turn++) {
        let block = turn * ZFP_GROUP_AT_ONCE + (lane >> 3u);
        let start = (line & 3u) + 16u * (line >> 2u);
        zfp_group_store(block, start, 4u, zfp_invert_lift(zfp_group_word(block, start, 4u)));
        zfp_group_store(
            block, start + 32u, 4u, zfp_invert_lift(zfp_group_word(block, start + 32u, 4u)));
    }
    workgroupBarrier();
}

// Row y + 4z of a block: its four samples along x.
fn zfp_group_row(block: u32, row: u32) -> vec4<f32> {
    let integers = zfp_invert_lift(zfp_group_word(block, 4u * row, 1u));
    let header = zfp_headers[block];
    if header == 0u {
        return vec4<f32>(0.0);
    }
    let scale = zfp_scale(header & 255u);
    return vec4<f32>(
        zfp_value(integers.x, scale), zfp_value(integers.y, scale),
        zfp_value(integers.z, scale), zfp_value(integers.w, scale));
}
