// The candidates of a hole. The importing text declares `params`, `rays` and
//   var<storage, read> candidates: array<u32>;     with NETWORK
//   var<storage, read> history_keys: array<u32>;   with HISTORY
#import infill_params
#import history

// Of neighbours, coarse field, its thin variant and history: `guesses`, the words of the first three.
fn sources_candidates(guesses: vec3<u32>, pixel: vec2<u32>, ray: DdaRay, number: u32) -> array<Candidate, 4> {
    var history = CANDIDATE_NONE;
#ifdef HISTORY
    let key = history_keys[infill_pixel_index(params, pixel)];
    if (key != 0u) {
        history = history_candidate(ray, key, infill_t_low(ray, number));
    }
#endif
    return array<Candidate, 4>(
        candidate_unpack(guesses.x),
        candidate_unpack(guesses.y),
        candidate_unpack(guesses.z),
        candidate_unpack(history),
    );
}

#ifdef NETWORK
// As guess.wgsl has left them.
fn sources_guesses(pixel: vec2<u32>) -> vec3<u32> {
    let first = 3u * infill_pixel_index(params, pixel);
    return vec3<u32>(candidates[first], candidates[first + 1u], candidates[first + 2u]);
}
#endif
