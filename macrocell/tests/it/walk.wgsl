// Every ray's active blocks: the cell in which it enters each of them and the parameter there.
#import macrocell_skip

const BLOCKS: u32 = 64u;

struct Visits {
    inverse: vec3<f32>, // division is not exact in WGSL: the twin takes the inverse from here
    count: u32,
    blocks: array<vec2<u32>, BLOCKS>, // cell x + 2^10 y + 2^20 z; bits of t
}

struct WalkParams {
    grid: MacrocellGrid,
    rays: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: WalkParams;
@group(0) @binding(1) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> rays: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> visits: array<Visits>;

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= params.rays) {
        return;
    }
    let ray = dda_ray(rays[2u * id.x].xyz, rays[2u * id.x + 1u].xyz);
    let grid = macrocell_active(params.grid);
    let box = DdaBox(4 * grid.first_block, grid.last_cell);
    var count = 0u;
    if (all(box.low <= box.high) && dda_meets(ray, box)) {
        let entry = dda_entry(ray, box);
        let cell = dda_cell_after(ray, entry, box, dda_first_cells(ray, box));
        var place = MacrocellPlace(entry, cell >> vec3<u32>(2u));
        while (count < BLOCKS) {
            place = macrocell_advance(grid, ray, place);
            if (!macrocell_inside(grid, place.block)) {
                break;
            }
            let cell = vec3<u32>(macrocell_first_cell(grid, ray, place));
            let packed_cell = cell.x | (cell.y << 10u) | (cell.z << 20u);
            visits[id.x].blocks[count] = vec2<u32>(packed_cell, bitcast<u32>(place.event.t));
            count++;
            place = macrocell_leave(grid, ray, place);
        }
    }
    visits[id.x].inverse = ray.inverse;
    visits[id.x].count = count;
}
