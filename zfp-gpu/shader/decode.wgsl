// Decodes the blocks of one payload page into slots of 64 f32, one invocation per (block, slot)
// job. Jobs for blocks of other pages and for slots that do not exist are skipped.

#import indirect
#import zfp_block

struct DecodeParams {
    slots_per_page: u32,
    slots: u32,
    // Word of job_count that holds the number of jobs.
    count_word: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> page: ZfpPage;
@group(0) @binding(1) var<uniform> params: DecodeParams;
@group(0) @binding(2) var<storage, read> payload: array<u32>;
@group(0) @binding(3) var<storage, read> jobs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read> job_count: array<u32>;
// A slot is 16 rows of four samples along x.
@group(0) @binding(5) var<storage, read_write> cache_0: array<vec4<f32>>;
#ifdef CACHE_PAGES_2
@group(0) @binding(6) var<storage, read_write> cache_1: array<vec4<f32>>;
#endif
#ifdef CACHE_PAGES_3
@group(0) @binding(7) var<storage, read_write> cache_2: array<vec4<f32>>;
#endif

fn zfp_word(index: u32) -> u32 {
    return payload[index];
}

fn store_row(cache_page: u32, index: u32, row: vec4<f32>) {
    switch cache_page {
#ifdef CACHE_PAGES_2
        case 1u: {
            cache_1[index] = row;
        }
#endif
#ifdef CACHE_PAGES_3
        case 2u: {
            cache_2[index] = row;
        }
#endif
        default: {
            cache_0[index] = row;
        }
    }
}

@compute @workgroup_size(JOBS_PER_GROUP)
fn decode(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * JOBS_PER_GROUP + lane;
    if index >= min(job_count[params.count_word], arrayLength(&jobs)) {
        return;
    }
    let job = jobs[index];
    // Wraps far beyond the page's blocks for a block of an earlier page.
    let block = job.x - page.first_block;
    let slot = job.y;
    if block >= page.blocks || slot >= params.slots {
        return;
    }
    var integers: array<i32, 64>;
    let scale = zfp_decode_block(zfp_locate(page, block), page.bits_per_block, &integers);
    let cache_page = slot / params.slots_per_page;
    let first_row = (slot - cache_page * params.slots_per_page) * 16u;
    for (var row = 0u; row < 16u; row++) {
        let values = vec4<f32>(
            zfp_value(integers[4u * row], scale),
            zfp_value(integers[4u * row + 1u], scale),
            zfp_value(integers[4u * row + 2u], scale),
            zfp_value(integers[4u * row + 3u], scale),
        );
        store_row(cache_page, first_row + row, values);
    }
}
