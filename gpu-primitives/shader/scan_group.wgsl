// Sums over the 256 invocations of a workgroup.

const SCAN_LANES: u32 = 256u;

struct ScanGroup {
    // Sum of the values of the lanes before this one.
    before: u32,
    // Sum of all values.
    total: u32,
}

// Rows of as many lanes as there are rows: one invocation goes along each.
const SCAN_ROWS: u32 = 16u;

var<workgroup> scan_sums: array<u32, SCAN_LANES>;
var<workgroup> scan_rows: array<u32, SCAN_ROWS>;

// To be called by all 256 invocations; lane is local_invocation_index.
fn scan_group(lane: u32, value: u32) -> ScanGroup {
    scan_sums[lane] = value;
    workgroupBarrier();
    if (lane < SCAN_ROWS) {
        var sum = 0u;
        for (var i = SCAN_ROWS * lane; i < SCAN_ROWS * (lane + 1u); i++) {
            let own = scan_sums[i];
            scan_sums[i] = sum;
            sum += own;
        }
        scan_rows[lane] = sum;
    }
    workgroupBarrier();
    var before = scan_sums[lane];
    var total = 0u;
    for (var row = 0u; row < SCAN_ROWS; row++) {
        before += select(0u, scan_rows[row], row < lane / SCAN_ROWS);
        total += scan_rows[row];
    }
    // So that the next call does not overwrite the sums early.
    workgroupBarrier();
    return ScanGroup(before, total);
}
