//! Writes the composed text of every kernel of the crate to a folder, for tools that read WGSL:
//! `cargo run -p gpu-primitives --example write_shaders -- FOLDER`.

use gpu_primitives::{compact::Compact, indirect::IndirectArgs, scan::Scan, sort::Sort};

fn main() -> std::io::Result<()> {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).unwrap_or_default());
    let mut sources = vec![IndirectArgs::source()];
    sources.extend(Scan::sources());
    sources.extend(Compact::sources());
    sources.extend(Sort::sources());
    for source in sources {
        std::fs::write(folder.join(format!("{}.wgsl", source.label)), source.wgsl.source)?;
    }
    Ok(())
}
