//! WGSL that other crates import.

use gpu_primitives::wgsl::Module;

/// Reads, transforms and converts one block: the struct `ZfpPage` of a payload page's parameters,
/// `zfp_locate(page, block in page) -> (word, bit)`, `zfp_decode_block(start, bits per block,
/// integers) -> scale` and `zfp_value(integer, scale) -> f32`, and their separate steps.
///
/// The importing text supplies `fn zfp_word(index: u32) -> u32`, usually a load from
/// [`Payload::page_words`](crate::Payload::page_words).
pub const BLOCK: Module =
    Module { name: "zfp_block", source: include_str!("../shader/lib/zfp_block.wgsl") };
