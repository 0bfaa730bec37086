// Decodes the blocks of one payload page into slots of 64 f32, 32 (block, slot) jobs per workgroup.
// Jobs for blocks of other pages and for slots that do not exist are skipped.

#import indirect
#import zfp_group
#import zfp_store

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
@group(0) @binding(5) var<storage, read_write> zfp_slots_0: array<vec4<f32>>;
#ifdef ZFP_SLOT_PAGES_2
@group(0) @binding(6) var<storage, read_write> zfp_slots_1: array<vec4<f32>>;
#endif
#ifdef ZFP_SLOT_PAGES_3
@group(0) @binding(7) var<storage, read_write> zfp_slots_2: array<vec4<f32>>;
#endif
#ifdef ZFP_SLOT_PAGES_4
@group(0) @binding(8) var<storage, read_write> zfp_slots_3: array<vec4<f32>>;
#endif

fn zfp_word(index: u32) -> u32 {
    return payload[index];
}

// Slot of each of the group's jobs, or NO_SLOT.
var<workgroup> job_slots: array<u32, ZFP_GROUP_BLOCKS>;

// Whether any of the group's jobs belongs to this page.
var<workgroup> any_job: atomic<u32>;
var<workgroup> has_jobs: u32;

const NO_SLOT: u32 = 0xffffffffu;

// First phase: one invocation reads the planes of a job's block.
fn read_job(index: u32, lane: u32) {
    job_slots[lane] = NO_SLOT;
    zfp_group_leave_out(lane);
    if index >= min(job_count[params.count_word], arrayLength(&jobs)) {
        return;
    }
    let job = jobs[index];
    // Wraps far beyond the page's blocks for a block of an earlier page.
    let block = job.x - page.first_block;
    if block >= page.blocks || job.y >= params.slots {
        return;
    }
    job_slots[lane] = job.y;
    atomicStore(&any_job, 1u);
    zfp_group_read(lane, zfp_locate(page, block), page.bits_per_block);
}

@compute @workgroup_size(ZFP_GROUP_LANES)
fn decode(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        atomicStore(&any_job, 0u);
    }
    workgroupBarrier();
    if lane < ZFP_GROUP_BLOCKS {
        read_job(indirect_linear_group(group, groups) * ZFP_GROUP_BLOCKS + lane, lane);
    }
    workgroupBarrier();
    if lane == 0u {
        has_jobs = atomicLoad(&any_job);
    }
    // Where a volume has many pages, most groups have nothing to do in most of them.
    if workgroupUniformLoad(&has_jobs) == 0u {
        return;
    }
    zfp_group_invert(lane);
    for (var turn = 0u; turn < 4u; turn++) {
        let block = turn * ZFP_GROUP_AT_ONCE + (lane >> 3u);
        let row = lane & 7u;
        let slot = job_slots[block];
        if slot != NO_SLOT {
            let per_page = params.slots_per_page;
            zfp_store_row(slot, per_page, row, zfp_group_row(block, row));
            zfp_store_row(slot, per_page, row + 8u, zfp_group_row(block, row + 8u));
        }
    }
}
