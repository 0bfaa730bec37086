//! Writes the composed text of every kernel of the crate, with all outputs and pages of slots, to a
//! folder, for tools that read WGSL: `cargo run -p wavefront --all-features --example write_shaders -- FOLDER`.

use wavefront::{Outputs, Rays, RunAhead};

fn main() -> std::io::Result<()> {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).unwrap_or_default());
    let outputs = Outputs { depth: true, normal: true, status: true };
    let pages = 3;
    let mut sources = Rays::sources(outputs, pages).to_vec();
    sources.push(RunAhead::source(pages));
    #[cfg(feature = "block-sorted")]
    sources.extend(wavefront::BlockSorted::sources(pages));
    for source in sources {
        std::fs::write(folder.join(format!("{}.wgsl", source.label)), source.wgsl.source)?;
    }
    std::fs::write(folder.join("wavefront.draw.wgsl"), include_str!("../shader/draw.wgsl"))
}
