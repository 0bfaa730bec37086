// The parts of decoding a fixed-rate block of 4x4x4 f32: reading its bit planes from an array of
// 32-bit words, undoing the transform of four values, making a sample of an integer.
// The importing text supplies the array: fn zfp_word(index: u32) -> u32, with at least two words
// behind the last block.

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

// The coefficients of the four samples x + 4y + 16z, z = 0 .. 3, of line x + 4y, a byte each. zfp orders
// coefficients by total sequency, then by energy.
const ZFP_COEFFICIENTS = array<u32, 16>(
    0x13090300u, 0x1e0f0501u, 0x2a180c07u, 0x34271b11u,
    0x1f100402u, 0x25160a06u, 0x3121140bu, 0x3a2e231au,
    0x2b170d08u, 0x3220150eu, 0x382c2219u, 0x3d362d26u,
    0x33281c12u, 0x392f241du, 0x3c373029u, 0x3f3e3b35u,
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

// Reads a group bit and, where it is 1, the run behind it; false where the plane ends.
fn zfp_read_group(reader: ptr<function, ZfpReader>) -> bool {
    let bits = zfp_peek(reader);
    if (bits & 1u) == 0u {
        zfp_skip(reader, 1u);
        return false;
    }
    let limit = min((*reader).budget - 1u, 63u - (*reader).significant);
    let zeros = min(countTrailingZeros(bits >> 1u), limit);
    if zeros > 30u {
        // The run goes on beyond the 31 bits in sight.
        zfp_skip(reader, 1u);
        zfp_skip_to_one(reader);
        return true;
    }
    (*reader).significant += zeros;
    zfp_skip(reader, zeros + select(1u, 2u, zeros < limit));
    return true;
}

// Reads one bit plane: bit i of the 64 belongs to coefficient i.
fn zfp_read_plane(reader: ptr<function, ZfpReader>) -> vec2<u32> {
    let verbatim = min((*reader).significant, (*reader).budget);
    let low_count = min(verbatim, 32u);
    var plane = vec2<u32>(zfp_read(reader, low_count), 0u);
    if verbatim > low_count {
        plane.y = zfp_read(reader, verbatim - low_count);
    }
    while (*reader).budget > 0u && (*reader).significant < 64u {
        if !zfp_read_group(reader) {
            break;
        }
        let one = 1u << ((*reader).significant & 31u);
        let is_low = (*reader).significant < 32u;
        plane |= vec2<u32>(select(0u, one, is_low), select(one, 0u, is_low));
        (*reader).significant += 1u;
    }
    return plane;
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
