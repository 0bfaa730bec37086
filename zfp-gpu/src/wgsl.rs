//! WGSL that other crates import.

use gpu_primitives::wgsl::{Constant, Module};

/// The parts of decoding a block: the struct `ZfpPage` of a payload page's parameters,
/// `zfp_locate(page, block in page) -> (word, bit)`, reading planes, `zfp_invert_lift`,
/// `zfp_value(integer, scale) -> f32`.
///
/// The importing text supplies `fn zfp_word(index: u32) -> u32`, usually a load from
/// [`Payload::page_words`](crate::Payload::page_words).
pub const BLOCK: Module =
    Module { name: "zfp_block", source: include_str!("../shader/lib/zfp_block.wgsl") };

/// Decodes 32 blocks by a workgroup of 64 invocations; imports [`BLOCK`].
pub const GROUP: Module =
    Module { name: "zfp_group", source: include_str!("../shader/lib/zfp_group.wgsl") };

/// Writes rows of samples into slots.
pub const STORE: Module =
    Module { name: "zfp_store", source: include_str!("../shader/lib/zfp_store.wgsl") };

/// Constants that fit [`STORE`] to a number of slot pages.
#[must_use]
pub fn slot_page_constants(pages: u32) -> [(&'static str, Constant); 3] {
    [
        ("ZFP_SLOT_PAGES_2", Constant::Bool(pages >= 2)),
        ("ZFP_SLOT_PAGES_3", Constant::Bool(pages >= 3)),
        ("ZFP_SLOT_PAGES_4", Constant::Bool(pages >= 4)),
    ]
}
