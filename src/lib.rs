//! Exact isosurfaces of ZFP-compressed volumes, rendered progressively.
