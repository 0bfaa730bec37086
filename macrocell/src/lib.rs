//! Conservative value ranges in two bytes per block and 64-bit active masks per isovalue, with the traversal WGSL that ray casters import.
