// What coarse field and history say about holes. The importing text declares `frame`, `params`, `rays` and
//   var<storage, read> guesses: array<vec2<u32>>;    of quads, with COARSE_FIELD
//   var<storage, read> history_keys: array<u32>;     with HISTORY
#import quads
#import history

// Of coarse field and its thin variant: their words.
fn sources_coarse(quad: vec2<u32>) -> vec2<u32> {
#ifdef COARSE_FIELD
    return guesses[quad_index(quad)];
#else
    return vec2<u32>(CANDIDATE_NONE);
#endif
}

// Of the previous frame's hits the nearest one at a pixel: its key, 0 without one.
fn sources_key(pixel: vec2<u32>) -> u32 {
#ifdef HISTORY
    return history_keys[infill_pixel_index(params, pixel)];
#else
    return 0u;
#endif
}

// Of history: the word for a key on a hole's ray.
fn sources_history(key: u32, ray: DdaRay, number: u32) -> u32 {
#ifdef HISTORY
    if (key != 0u) {
        return history_candidate(ray, key, infill_t_low(ray, number));
    }
#endif
    return CANDIDATE_NONE;
}
