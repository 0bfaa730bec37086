//! Writes the composed text of every kernel of the crate to a folder, for tools that read WGSL:
//! `cargo run -p infill --example write_shaders -- FOLDER`.

use infill::{Guide, Infill, InfillPlan, Sources};
use macrocell::MacrocellPlan;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).unwrap_or_default());
    let limits = wgpu::Limits::default();
    let ranges = MacrocellPlan::new([48, 16, 16], &limits)?;
    let plan = InfillPlan::new([40, 30], Sources::default(), true, &ranges, &limits)?;
    let mut sources: Vec<_> =
        Guide::source(&plan).map(|source| ("full", source)).into_iter().collect();
    sources.extend(Infill::sources(&plan).into_iter().map(|source| ("full", source)));
    let halved = plan.halved().ok_or("a picture that is too small")?;
    sources.extend(Infill::sources(&halved).into_iter().map(|source| ("half", source)));
    for (name, source) in sources {
        let file = format!("{}.{name}.wgsl", source.label);
        std::fs::write(folder.join(file), source.wgsl.source)?;
    }
    Ok(())
}
