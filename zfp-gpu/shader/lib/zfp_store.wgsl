// Writes samples into slots of 64 f32, rows of four along x, over up to four pages of slots. The
// importing text declares zfp_slots_0 and, with the constants ZFP_SLOT_PAGES_2 to _4, zfp_slots_1 to
// zfp_slots_3, each
//   var<storage, read_write> zfp_slots_0: array<vec4<f32>>;

fn zfp_store_row(slot: u32, slots_per_page: u32, row: u32, samples: vec4<f32>) {
    let slot_page = slot / slots_per_page;
    let index = (slot - slot_page * slots_per_page) * 16u + row;
    switch slot_page {
#ifdef ZFP_SLOT_PAGES_2
        case 1u: {
            zfp_slots_1[index] = samples;
        }
#endif
#ifdef ZFP_SLOT_PAGES_3
        case 2u: {
            zfp_slots_2[index] = samples;
        }
#endif
#ifdef ZFP_SLOT_PAGES_4
        case 3u: {
            zfp_slots_3[index] = samples;
        }
#endif
        default: {
            zfp_slots_0[index] = samples;
        }
    }
}
