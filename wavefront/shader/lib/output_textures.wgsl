// The pictures that a kernel writes, those that are asked for, behind its other bindings.
@group(0) @binding(COLOR_BINDING) var color_out: texture_storage_2d<rgba8unorm, write>;
#ifdef OUTPUT_DEPTH
@group(0) @binding(DEPTH_BINDING) var depth_out: texture_storage_2d<r32float, write>;
#endif
#ifdef OUTPUT_NORMAL
@group(0) @binding(NORMAL_BINDING) var normal_out: texture_storage_2d<rgba16float, write>;
#endif
#ifdef OUTPUT_STATUS
@group(0) @binding(STATUS_BINDING) var status_out: texture_storage_2d<r32uint, write>;
#endif
