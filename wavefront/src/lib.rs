//! Rays that walk a block-compressed volume, watertight dual-cell intersection, shading and outputs.
