// How many blocks ahead every active ray goes in this round: as many as fill the pairs, 64 at most
// (Dyken et al. 2024, section IV). One invocation.
#import frame
#import pairs

struct SpeculateParams {
    capacity: u32,  // pairs in all
    most: u32,      // 64, or 1 without speculation
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: SpeculateParams;
@group(0) @binding(1) var<storage, read_write> rays: array<u32>;
@group(0) @binding(2) var<storage, read_write> pairs: array<u32>;

@compute @workgroup_size(1)
fn main() {
    let rays_active = rays[RAYS_LISTED];
    let speculation = clamp(params.capacity / max(rays_active, 1u), 1u, params.most);
    pairs[PAIRS_SPECULATION] = speculation;
    pairs[PAIRS_COUNT] = rays_active * speculation;
    pairs[PAIRS_CAPACITY] = params.capacity;
}
