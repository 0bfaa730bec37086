//! A budgeted cache of decoded blocks on the GPU: slots, directory, de-duplicated requests, eviction by age, guaranteed progress.
