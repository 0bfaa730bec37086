//! Uniforms have the layout that the shaders declare.

use std::mem::offset_of;

use bytemuck::Zeroable;
use gpu_testkit::layout::{check_struct, struct_size};

use crate::kernels::{self, InfillParams, ScatterParams};

/// Name, offset and size of every member.
macro_rules! members {
    ($type:ty { $($field:ident),* $(,)? }) => {{
        let zero = <$type>::zeroed();
        [$((stringify!($field), offset_of!($type, $field) as u32, size_of_val(&zero.$field) as u32)),*]
    }};
}

#[test]
fn uniforms_have_the_declared_layout() {
    let text = kernels::scatter(false).wgsl.source;
    let params = members!(InfillParams {
        size,
        tiles,
        levels,
        padded,
        coarse_per_page,
        crisp,
        diagonal,
        none,
        complete,
        pad0,
    });
    check_struct(&text, "InfillParams", &params).unwrap();
    assert_eq!(struct_size(&text, "InfillParams"), Ok(size_of::<InfillParams>() as u32));
    let scatter = members!(ScatterParams { column, row, w, depth });
    check_struct(&text, "ScatterParams", &scatter).unwrap();
    assert_eq!(struct_size(&text, "ScatterParams"), Ok(size_of::<ScatterParams>() as u32));
    let mut wrong = scatter;
    wrong[2].1 += 4;
    assert!(check_struct(&text, "ScatterParams", &wrong).is_err());
}
