//! What the target does with its bytes.

use zfp_gpu::StreamLayout;
use zfp_gpu::cpu::decode::decode_block;

/// A layout from the first bytes of the input, and the rest of it, for a payload: perhaps too short.
pub fn layout(bytes: &[u8]) -> Option<(StreamLayout, &[u8])> {
    let ([bits_low, bits_high, first_bit, x, y, z], rest) = bytes.split_first_chunk::<6>()?;
    let bits = u32::from(u16::from_le_bytes([*bits_low, *bits_high])) % 2200;
    let dims = [x, y, z].map(|n| u32::from(*n) % 17);
    Some((StreamLayout::new(dims, bits, u64::from(*first_bit)).ok()?, rest))
}

/// Decodes all blocks of a payload and the one that would come next; each depends on its own bits alone.
pub fn decode(bytes: &[u8]) {
    let Some((layout, payload)) = layout(bytes) else { return };
    let flipped: Vec<u8> = payload.iter().map(|byte| !byte).collect();
    for block in 0..=layout.block_count() {
        let samples = decode_block(payload, &layout, block);
        assert!(samples.iter().all(|sample| !sample.is_nan()), "block {block} of {layout:?}");
        let alone = with_block(&flipped, payload, &layout, block);
        let bits = |samples: [f32; 64]| samples.map(f32::to_bits);
        assert_eq!(bits(samples), bits(decode_block(&alone, &layout, block)), "block {block}");
    }
}

/// `others` with the bits of one block from `payload`.
pub fn with_block(others: &[u8], payload: &[u8], layout: &StreamLayout, block: u64) -> Vec<u8> {
    let mut bytes = others.to_vec();
    let first = layout.block_bit(block);
    for bit in first..first + u64::from(layout.bits_per_block) {
        let (byte, mask) = ((bit / 8) as usize, 1u8 << (bit % 8));
        if let (Some(target), Some(source)) = (bytes.get_mut(byte), payload.get(byte)) {
            *target = (*target & !mask) | (source & mask);
        }
    }
    bytes
}
