// Ray-block pairs of strategy BlockSorted. The importing text declares
//   var<storage, read_write> pairs: array<u32>;  (atomic or not)
// Pair i = s * n + k is the k-th next active block of the s-th active ray, n the speculation count.
// After `capacity` pairs the same buffer holds the numbers of the pairs grouped by slot.

const PAIRS_SPECULATION: u32 = 0u; // n
const PAIRS_COUNT: u32 = 1u;       // active rays * n
const PAIRS_CAPACITY: u32 = 2u;
const PAIRS_HEADER: u32 = 4u;

// Status of a pair in its two upper bits; the others hold the block, as in a ray's state.
const PAIR_WAITS: u32 = 0u;           // samples are missing
const PAIR_READY: u32 = 0x40000000u;  // all samples are resident, no hit found
const PAIR_HIT: u32 = 0x80000000u;    // the ray hits the surface in the block
const PAIR_NONE: u32 = 0xffffffffu;   // the ray has no such block
const PAIR_STATUS: u32 = 0xc0000000u;
const PAIR_BLOCK: u32 = 0x3fffffffu;
