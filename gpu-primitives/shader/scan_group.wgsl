// Sums over the 256 invocations of a workgroup.

const SCAN_LANES: u32 = 256u;

struct ScanGroup {
    // Sum of the values of the lanes before this one.
    before: u32,
    // Sum of all values.
    total: u32,
}

var<workgroup> scan_sums: array<u32, SCAN_LANES>;

// To be called by all 256 invocations; lane is local_invocation_index.
fn scan_group(lane: u32, value: u32) -> ScanGroup {
    var sum = value;
    scan_sums[lane] = sum;
    workgroupBarrier();
    for (var reach = 1u; reach < SCAN_LANES; reach = reach * 2u) {
        if (lane >= reach) {
            sum += scan_sums[lane - reach];
        }
        workgroupBarrier();
        scan_sums[lane] = sum;
        workgroupBarrier();
    }
    let total = scan_sums[SCAN_LANES - 1u];
    // So that the next call does not overwrite the total early.
    workgroupBarrier();
    return ScanGroup(sum - value, total);
}
