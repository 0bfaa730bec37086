// The list of the active rays, in the order of their numbers, from one bit per ray: active rays per
// group of 256 words, then the list. One invocation per word of 32 bits. With FOVEATION, rays that the sampling
// mask does not have are not listed, but they stay active.
#import frame
#import indirect
#import scan_group

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> sums: array<u32>;
#ifdef LIST_FILL
// Arguments of a dispatch over the listed rays, and of LIST_SUM.
@group(0) @binding(3) var<storage, read_write> args: array<u32>;
#else
// Arguments of LIST_FILL.
@group(0) @binding(3) var<storage, read_write> fill_args: array<u32>;
#endif
#ifdef FOVEATION
@group(0) @binding(4) var<storage, read> sampling_mask: array<u32>;
#endif

fn list_groups() -> u32 {
    return indirect_div_ceil(frame.ray_numbers / 32u, SCAN_LANES);
}

// Bits of the active rays in a word.
fn list_word(word: u32) -> u32 {
    if (word >= frame.ray_numbers / 32u) {
        return 0u;
    }
    return atomicLoad(&rays[frame_active_word(frame, word * 32u)]);
}

// Those among a word's active rays that may be listed.
fn list_allowed(word: u32, active_bits: u32) -> u32 {
#ifdef FOVEATION
    if (active_bits != 0u && atomicLoad(&rays[RAYS_MASKED]) != 0u) {
        return active_bits & sampling_mask[word];
    }
#endif
    return active_bits;
}

#ifdef LIST_FILL
var<workgroup> was_listed: u32;

fn write_args(active_count: u32, allowed: u32) {
    let was_active = atomicLoad(&rays[RAYS_ACTIVE]);
    let listed = min(allowed, frame.list_capacity);
    atomicStore(&rays[RAYS_ACTIVE], active_count);
    atomicStore(&rays[RAYS_LISTED], listed);
    atomicAdd(&rays[RAYS_LISTS], 1u);
    atomicMax(&rays[RAYS_MOST_CELLS], atomicExchange(&rays[RAYS_CELLS], 0u));
    // Rays that this round's list did not have have not been looked at, and those that the new one does not have
    // may never have been: their whole way is open.
    let across = length(vec3<f32>(frame.grid.last_cell + vec3<i32>(1)));
    let is_any_unlisted = was_active > was_listed || active_count > listed;
    let unlisted = select(0u, bitcast<u32>(across), is_any_unlisted);
    atomicStore(&rays[RAYS_OPEN], max(atomicExchange(&rays[RAYS_OPEN_NOW], 0u), unlisted));
    let walk = indirect_fold((listed + 63u) / 64u);
    args[0] = walk.x;
    args[1] = walk.y;
    args[2] = walk.z;
    // Nothing changes any more when no ray is active.
    let again = indirect_fold(select(0u, list_groups(), active_count > 0u));
    args[4] = again.x;
    args[5] = again.y;
    args[6] = again.z;
#ifdef FOVEATION
    // And in this pass, when none is listed.
    let sum = indirect_fold(select(0u, list_groups(), listed > 0u));
    args[8] = sum.x;
    args[9] = sum.y;
    args[10] = sum.z;
#endif
}

@compute @workgroup_size(SCAN_LANES)
fn main(
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    // With an empty list it stays as it is, whatever the arguments of this dispatch still say. Group 0 may
    // write the word already: if it finds no ray to list, there is nothing to list either.
    if (lane == 0u) {
        was_listed = atomicLoad(&rays[RAYS_LISTED]);
    }
    if (workgroupUniformLoad(&was_listed) == 0u) {
        return;
    }
    let group = indirect_linear_group(group_id, groups);
    // Group 0, which has nothing before it, sums up everything.
    let end = select(group, list_groups() + frame_zero(atomicLoad(&rays[RAYS_HITS])), group == 0u);
    var part = 0u;
#ifdef FOVEATION
    var active_part = 0u;
    for (var i = lane; i < end; i += SCAN_LANES) {
        part += sums[i] >> 16u;
        active_part += sums[i] & 0xffffu;
    }
    let summed = scan_group(lane, part).total;
    var active_count = 0u;
    if (group == 0u) {
        active_count = scan_group(lane, active_part).total;
    }
#else
    for (var i = lane; i < end; i += SCAN_LANES) {
        part += sums[i];
    }
    let summed = scan_group(lane, part).total;
    let active_count = summed;
#endif
    if (group == 0u && lane == 0u) {
        write_args(active_count, summed);
    }
    let word = group * SCAN_LANES + lane;
    var bits = list_allowed(word, list_word(word));
    var at = select(summed, 0u, group == 0u) + scan_group(lane, countOneBits(bits)).before;
    let capacity = frame.list_capacity + frame_zero(summed);
    while (bits != 0u && at < capacity) {
        let number = word * 32u + countTrailingZeros(bits);
        atomicStore(&rays[frame_list_word(frame, at)], number);
        bits &= bits - 1u;
        at++;
    }
}
#else
// What a group's sum counts of a word: rays that may be listed; with FOVEATION, at most 8192 active rays of a group
// below them.
fn list_counts(word: u32) -> u32 {
    let active_bits = list_word(word);
    let allowed = countOneBits(list_allowed(word, active_bits));
#ifdef FOVEATION
    return countOneBits(active_bits) | (allowed << 16u);
#else
    return allowed;
#endif
}

@compute @workgroup_size(SCAN_LANES)
fn main(
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let group = indirect_linear_group(group_id, groups);
    let sum = scan_group(lane, list_counts(group * SCAN_LANES + lane));
    if (lane == 0u && group < list_groups()) {
        sums[group] = sum.total;
    }
    if (lane == 0u && group == 0u) {
        let again = indirect_fold(list_groups());
        fill_args[0] = again.x;
        fill_args[1] = again.y;
        fill_args[2] = again.z;
    }
}
#endif
