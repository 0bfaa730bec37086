//! Writes the composed text of every kernel of the crate to a folder, for tools that read WGSL:
//! `cargo run -p infill --example write_shaders -- FOLDER`.

use infill::{Guide, Infill, InfillPlan, Sources};
use macrocell::MacrocellPlan;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).unwrap_or_default());
    let limits = wgpu::Limits::default();
    let ranges = MacrocellPlan::new([48, 16, 16], &limits)?;
    let plan = InfillPlan::new([40, 30], Sources::default(), true, &ranges, &limits)?;
    for source in Infill::sources(&plan).into_iter().chain(Guide::source(&plan)) {
        std::fs::write(folder.join(format!("{}.wgsl", source.label)), source.wgsl.source)?;
    }
    Ok(())
}
