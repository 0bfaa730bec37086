//! Writes the composed text of every kernel of the crate, with all outputs and pages of slots, to a
//! folder, for tools that read WGSL: `cargo run -p wavefront --all-features --example write_shaders -- FOLDER`.

use wavefront::{Outputs, Previews, Rays, RunAhead, SampleLayout};

fn main() -> std::io::Result<()> {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).unwrap_or_default());
    let outputs = Outputs { depth: true, normal: true, status: true };
    let mut sources = Vec::new();
    for (name, samples) in
        [("cached", SampleLayout::cached(3)), ("resident", SampleLayout::resident(4))]
    {
        sources.extend(Rays::sources(outputs, samples).map(|source| (name, source)));
        let foveated = Rays::foveation_sources(samples);
        sources.extend(foveated.map(|source| ("foveated", source)));
        sources.extend(Previews::sources(outputs, samples).map(|source| ("preview", source)));
        sources.extend(RunAhead::sources(samples).into_iter().map(|source| (name, source)));
    }
    #[cfg(feature = "block-sorted")]
    sources.extend(wavefront::BlockSorted::sources(3).map(|source| ("cached", source)));
    for (name, source) in sources {
        let file = format!("{}.{name}.wgsl", source.label);
        std::fs::write(folder.join(file), source.wgsl.source)?;
    }
    std::fs::write(folder.join("wavefront.draw.wgsl"), include_str!("../shader/draw.wgsl"))
}
