// Whether the picture is complete enough to be filled: the arguments of what looks for holes, or no workgroup.
#import infill_params
#import frame

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> rays: array<u32>;
@group(0) @binding(2) var<storage, read> active_args: array<u32>; // from word 4 on
@group(0) @binding(3) var<storage, read_write> gate: array<u32>;

@compute @workgroup_size(1)
fn main() {
    let entered = rays[RAYS_ENTERED];
    let finished = entered - min(rays[RAYS_ACTIVE], entered);
    let open = f32(finished) >= params.complete * f32(entered);
    gate[0] = select(0u, active_args[4], open);
    gate[1] = active_args[5];
    gate[2] = active_args[6];
}
