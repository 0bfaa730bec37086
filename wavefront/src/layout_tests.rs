//! Uniforms have the layout that the shaders declare.

use std::mem::offset_of;

use bytemuck::Zeroable;
use gpu_testkit::layout::{check_struct, struct_size};
use lru_cache_gpu::LruParams;

use crate::draw::DrawParams;
use crate::foveation::SamplingParams;
use crate::frame::{FrameParams, GridParams};
use crate::outputs::ShadingParams;
use crate::preview::UpscaleParams;
use crate::{Outputs, Previews, Rays, SampleLayout};

/// Name, offset and size of every member.
macro_rules! members {
    ($type:ty { $($field:ident),* $(,)? }) => {{
        let zero = <$type>::zeroed();
        [$((stringify!($field), offset_of!($type, $field) as u32, size_of_val(&zero.$field) as u32)),*]
    }};
}

fn start_source() -> String {
    let [start, ..] =
        Rays::sources(Outputs { depth: true, normal: true, status: true }, SampleLayout::cached(1));
    start.wgsl.source
}

#[test]
fn frame_uniforms_have_the_declared_layout() {
    let source = start_source();
    let frame = members!(FrameParams {
        origin,
        isovalue,
        origin_dx,
        width,
        origin_dy,
        height,
        direction,
        start_depth,
        direction_dx,
        look_ahead,
        direction_dy,
        ray_numbers,
        ray_level,
        ray_columns,
        list_capacity,
        first_misses,
        shift_y,
        shift_z,
        shift_misses,
        most_cells,
        middle,
        step,
        preview_level,
        volume_low,
        volume_end,
        grid,
        lru,
    });
    check_struct(&source, "FrameParams", &frame).unwrap();
    let grid = members!(GridParams {
        blocks,
        coarse_count,
        coarse,
        has_third_level,
        third,
        active_box,
        last_cell,
        pad0,
        first_block,
        pad1,
    });
    check_struct(&source, "MacrocellGrid", &grid).unwrap();
    let lru = members!(LruParams { slots, slots_per_page, request_capacity, heads });
    check_struct(&source, "LruParams", &lru).unwrap();
    assert_eq!(struct_size(&source, "FrameParams"), Ok(size_of::<FrameParams>() as u32));
    let mut wrong = frame;
    wrong[1].1 += 4;
    assert!(check_struct(&source, "FrameParams", &wrong).is_err());
}

#[test]
fn the_shading_uniform_has_the_declared_layout() {
    let source = start_source();
    let members = members!(ShadingParams {
        background,
        unfinished,
        base_color,
        ambient,
        light,
        headlight,
        diffuse,
        specular,
        shininess,
        start_columns,
        normal_x,
        pad1,
        normal_y,
        pad2,
        normal_z,
        pad3,
        world_x,
        pad4,
        world_y,
        pad5,
        world_z,
        pad6,
    });
    check_struct(&source, "ShadingParams", &members).unwrap();
    assert_eq!(struct_size(&source, "ShadingParams"), Ok(size_of::<ShadingParams>() as u32));
}

#[test]
fn the_sampling_uniform_has_the_declared_layout() {
    let [mask, ..] = Rays::foveation_sources(SampleLayout::cached(1));
    let source = mask.wgsl.source;
    let members = members!(SamplingParams {
        gaze,
        share_per_pixel,
        falloff,
        base_density,
        slice,
        draws,
        lattice_level,
        pad0,
    });
    check_struct(&source, "SamplingParams", &members).unwrap();
    let bytes = size_of::<SamplingParams>() as u32;
    assert_eq!(struct_size(&source, "SamplingParams"), Ok(bytes));
}

#[test]
fn the_upscale_uniform_has_the_declared_layout() {
    let [upscale, _] = Previews::sources(Outputs::default(), SampleLayout::cached(1));
    let source = upscale.wgsl.source;
    let members = members!(UpscaleParams { size, step, crisp });
    check_struct(&source, "UpscaleParams", &members).unwrap();
    let bytes = size_of::<UpscaleParams>() as u32;
    assert_eq!(struct_size(&source, "UpscaleParams"), Ok(bytes));
}

#[test]
fn the_draw_uniform_has_the_declared_layout() {
    let source = include_str!("../shader/draw.wgsl");
    let rows = offset_of!(DrawParams, rows) as u32;
    let pad = offset_of!(DrawParams, pad) as u32;
    let [none, linear] = members!(DrawParams { depth_none, linear_color });
    let members = [
        ("z0", rows, 16),
        ("z1", rows + 16, 16),
        ("w0", rows + 32, 16),
        ("w1", rows + 48, 16),
        none,
        linear,
        ("pad0", pad, 4),
        ("pad1", pad + 4, 4),
    ];
    check_struct(source, "DrawParams", &members).unwrap();
    assert_eq!(struct_size(source, "DrawParams"), Ok(size_of::<DrawParams>() as u32));
}
