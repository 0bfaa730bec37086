//! Writes the composed text of every kernel of the crate to a folder, for tools that read WGSL:
//! `cargo run -p macrocell --example write_shaders -- FOLDER`.

use macrocell::{Activate, Ranges};

fn main() -> std::io::Result<()> {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).unwrap_or_default());
    for source in [
        Ranges::source(),
        Activate::source(),
        Activate::third_level_source(),
        Activate::active_box_source(),
    ] {
        std::fs::write(folder.join(format!("{}.wgsl", source.label)), source.wgsl.source)?;
    }
    Ok(())
}
