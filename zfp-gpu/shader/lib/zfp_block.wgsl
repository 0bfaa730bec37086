// Decodes one fixed-rate block of 4x4x4 f32 from an array of 32-bit words.
// The importing text supplies the array: fn zfp_word(index: u32) -> u32, with at least two words
// behind the last block. Reading a block, transforming it and converting its values are separate.

// Where the blocks of one payload page lie.
struct ZfpPage {
    first_block: u32,
    blocks: u32,
    bits_per_block: u32,
    // Bit of word 0 at which the first block starts, below 32.
    first_bit: u32,
}

// Position inside a block: 64 bits from the current word on, the bits left to the block, and the
// number of coefficients found significant so far.
struct ZfpReader {
    low: u32,
    high: u32,
    next: u32,
    bit: u32,
    budget: u32,
    significant: u32,
}

const ZFP_PLANES: u32 = 32u;
// Larger than the largest biased exponent of a block that decodes as zeros: below, the scale would
// be subnormal, and GPUs flush subnormal numbers.
const ZFP_ZERO_EXPONENT: u32 = 30u;
const ZFP_NEGABINARY: u32 = 0xaaaaaaaau;

// Position of coefficient i, as x + 4y + 16z: by total sequency, then by energy.
const ZFP_PERMUTATION = array<u32, 64>(
    0u, 1u, 4u, 16u, 20u, 17u, 5u, 2u, 8u, 32u, 21u, 6u, 18u, 24u, 9u, 33u,
    36u, 3u, 12u, 48u, 22u, 25u, 37u, 40u, 34u, 10u, 7u, 19u, 28u, 13u, 49u, 52u,
    41u, 38u, 26u, 23u, 29u, 53u, 11u, 35u, 44u, 14u, 50u, 56u, 42u, 27u, 39u, 45u,
    30u, 54u, 57u, 60u, 51u, 15u, 43u, 46u, 58u, 61u, 55u, 31u, 62u, 59u, 47u, 63u,
);

// Word and bit at which a block of the page starts; block counts from the page's first. Bit
// addresses beyond 32 bits never occur: 32 blocks take exactly bits_per_block words.
fn zfp_locate(page: ZfpPage, block: u32) -> vec2<u32> {
    let bits = (block & 31u) * page.bits_per_block + page.first_bit;
    return vec2<u32>((block >> 5u) * page.bits_per_block + (bits >> 5u), bits & 31u);
}

fn zfp_reader(start: vec2<u32>, bits_per_block: u32) -> ZfpReader {
    let low = zfp_word(start.x);
    let high = zfp_word(start.x + 1u);
    return ZfpReader(low, high, start.x + 2u, start.y, bits_per_block, 0u);
}

// The next 32 bits, whether or not they belong to the block. A shift by 32 would be a shift by 0:
// the high word is shifted in two steps.
fn zfp_peek(reader: ptr<function, ZfpReader>) -> u32 {
    let bit = (*reader).bit;
    return ((*reader).low >> bit) | (((*reader).high << 1u) << (31u - bit));
}

// Consumes count <= 32 bits of the budget.
fn zfp_skip(reader: ptr<function, ZfpReader>, count: u32) {
    (*reader).budget -= count;
    (*reader).bit += count;
    if (*reader).bit >= 32u {
        (*reader).bit -= 32u;
        (*reader).low = (*reader).high;
        (*reader).high = zfp_word((*reader).next);
        (*reader).next += 1u;
    }
}

// The lowest count <= 32 bits set.
fn zfp_low_mask(count: u32) -> u32 {
    return select((1u << (count & 31u)) - 1u, 0xffffffffu, count >= 32u);
}

// Reads count <= 32 bits.
fn zfp_read(reader: ptr<function, ZfpReader>, count: u32) -> u32 {
    let bits = zfp_peek(reader) & zfp_low_mask(count);
    zfp_skip(reader, count);
    return bits;
}

// Reads the header: the biased exponent of a block, 0 for a block of zeros.
fn zfp_read_exponent(reader: ptr<function, ZfpReader>) -> u32 {
    if zfp_read(reader, 1u) == 0u {
        return 0u;
    }
    return zfp_read(reader, 8u);
}

// Scans a unary run up to its one bit, to the end of the budget, or to the last coefficient, whose
// one bit is implied.
fn zfp_skip_to_one(reader: ptr<function, ZfpReader>) {
    while (*reader).budget > 0u && (*reader).significant < 63u {
        let limit = min(min((*reader).budget, 63u - (*reader).significant), 32u);
        let zeros = min(countTrailingZeros(zfp_peek(reader)), limit);
        (*reader).significant += zeros;
        if zeros < limit {
            zfp_skip(reader, zeros + 1u);
            return;
        }
        zfp_skip(reader, zeros);
    }
}

// Reads one bit plane: bit i of the 64 belongs to coefficient i.
fn zfp_read_plane(reader: ptr<function, ZfpReader>) -> vec2<u32> {
    let verbatim = min((*reader).significant, (*reader).budget);
    let low_count = min(verbatim, 32u);
    var plane = vec2<u32>(0u, 0u);
    plane.x = zfp_read(reader, low_count);
    plane.y = zfp_read(reader, verbatim - low_count);
    while (*reader).budget > 0u && (*reader).significant < 64u {
        if zfp_read(reader, 1u) == 0u {
            break;
        }
        zfp_skip_to_one(reader);
        let one = 1u << ((*reader).significant & 31u);
        let is_low = (*reader).significant < 32u;
        plane |= vec2<u32>(select(0u, one, is_low), select(one, 0u, is_low));
        (*reader).significant += 1u;
    }
    return plane;
}

// Sets the given digit of the coefficients first, first + 1, .. whose bit is set in half.
fn zfp_scatter(digits: ptr<function, array<i32, 64>>, half: u32, first: u32, digit: i32) {
    var rest = half;
    while rest != 0u {
        let position = ZFP_PERMUTATION[first + countTrailingZeros(rest)];
        (*digits)[position] |= digit;
        rest &= rest - 1u;
    }
}

// Signed value of 32 negabinary digits.
fn zfp_signed(digits: u32) -> i32 {
    return bitcast<i32>((digits ^ ZFP_NEGABINARY) - ZFP_NEGABINARY);
}

// Undoes the transform of four values.
fn zfp_invert_lift(v: vec4<i32>) -> vec4<i32> {
    var a = v.x;
    var b = v.y;
    var c = v.z;
    var d = v.w;
    b += d >> 1u;
    d -= b >> 1u;
    b += d;
    d = (d << 1u) - b;
    c += a;
    a = (a << 1u) - c;
    b += c;
    c = (c << 1u) - b;
    d += a;
    a = (a << 1u) - d;
    return vec4<i32>(a, b, c, d);
}

fn zfp_invert_line(integers: ptr<function, array<i32, 64>>, start: u32, stride: u32) {
    let i = vec4<u32>(start, start + stride, start + 2u * stride, start + 3u * stride);
    let v = vec4<i32>((*integers)[i.x], (*integers)[i.y], (*integers)[i.z], (*integers)[i.w]);
    let lifted = zfp_invert_lift(v);
    (*integers)[i.x] = lifted.x;
    (*integers)[i.y] = lifted.y;
    (*integers)[i.z] = lifted.z;
    (*integers)[i.w] = lifted.w;
}

// Undoes the decorrelating transform along z, then y, then x.
fn zfp_invert_transform(integers: ptr<function, array<i32, 64>>) {
    for (var line = 0u; line < 16u; line++) {
        zfp_invert_line(integers, line, 16u);
    }
    for (var line = 0u; line < 16u; line++) {
        zfp_invert_line(integers, (line & 3u) + 16u * (line >> 2u), 4u);
    }
    for (var line = 0u; line < 16u; line++) {
        zfp_invert_line(integers, 4u * line, 1u);
    }
}

// Reads the block at start into integers at their positions (x + 4y + 16z) and returns the scale
// that zfp_value multiplies them with; 0 for a block of zeros, whose integers are 0.
fn zfp_decode_block(
    start: vec2<u32>,
    bits_per_block: u32,
    integers: ptr<function, array<i32, 64>>,
) -> f32 {
    for (var i = 0u; i < 64u; i++) {
        (*integers)[i] = 0;
    }
    var reader = zfp_reader(start, bits_per_block);
    let exponent = zfp_read_exponent(&reader);
    if exponent <= ZFP_ZERO_EXPONENT {
        return 0.0;
    }
    var plane_bit = ZFP_PLANES;
    while reader.budget > 0u && plane_bit > 0u {
        plane_bit -= 1u;
        let plane = zfp_read_plane(&reader);
        let digit = bitcast<i32>(1u << plane_bit);
        zfp_scatter(integers, plane.x, 0u, digit);
        zfp_scatter(integers, plane.y, 32u, digit);
    }
    for (var i = 0u; i < 64u; i++) {
        (*integers)[i] = zfp_signed(bitcast<u32>((*integers)[i]));
    }
    zfp_invert_transform(integers);
    return zfp_scale(exponent);
}

// 2^(exponent - 127 - 30) for a biased block exponent above ZFP_ZERO_EXPONENT.
fn zfp_scale(exponent: u32) -> f32 {
    return bitcast<f32>((exponent - ZFP_ZERO_EXPONENT) << 23u);
}

// Sample from its integer. The integer is rounded to the 24 bits of an f32, ties to even, before
// it is converted, because WGSL leaves the rounding of conversions open; the product is exact.
fn zfp_value(integer: i32, scale: f32) -> f32 {
    let magnitude = select(bitcast<u32>(integer), 0u - bitcast<u32>(integer), integer < 0);
    let zeros = countLeadingZeros(magnitude);
    let excess = select(0u, 8u - zeros, zeros < 8u);
    let half = (1u << excess) >> 1u;
    let odd = (magnitude >> excess) & 1u;
    let bias = select(0u, half - 1u + odd, excess > 0u);
    let value = f32(((magnitude + bias) >> excess) << excess) * scale;
    return select(value, -value, integer < 0);
}
