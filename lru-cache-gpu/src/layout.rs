//! Words of the cache's state and directory, as in `shader/lib/lru_state.wgsl` and
//! `lru_directory.wgsl`.

pub(crate) const REQUEST_COUNT: usize = 0;
pub(crate) const CLOCK: usize = 1;
pub(crate) const HAND: usize = 2;
pub(crate) const FRAME_CLOCK: usize = 3;
pub(crate) const PREVIOUS_FRAME_CLOCK: usize = 4;
pub(crate) const SPARED_FRAMES: usize = 5;
pub(crate) const JOB_COUNT: usize = 6;
pub(crate) const LEADER_COUNT: usize = 7;
pub(crate) const REQUESTED_TOTAL: usize = 8;
pub(crate) const DECODED_TOTAL: usize = 9;
pub(crate) const EVICTED_TOTAL: usize = 10;
pub(crate) const DEFERRED_TOTAL: usize = 11;
pub(crate) const USED_TOTAL: usize = 12;
pub(crate) const SWEPT: usize = 13;
pub(crate) const NEXT_FREE: usize = 14;
pub(crate) const LEADER: usize = 16;
pub(crate) const HEADER: usize = 25;

pub(crate) const LEADER_CAPACITY: usize = 8;
pub(crate) const PROBES: u32 = 32;

pub(crate) const BLOCK: usize = 0;
pub(crate) const NEXT: usize = 1;
pub(crate) const ENTRY_WORDS: usize = 2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Service;

    // The words are constants in WGSL, not members of a struct, so their text is compared.
    #[test]
    fn the_words_are_those_of_the_shaders() {
        let text = Service::sources().map(|source| source.wgsl.source).concat();
        let says = |name: &str, value: usize| {
            let line = format!("const LRU_{name}: u32 = {value}u;");
            assert!(text.contains(&line), "{line}");
        };
        macro_rules! all_say {
            ($($name:ident),* $(,)?) => { $(says(stringify!($name), $name);)* };
        }
        all_say!(
            REQUEST_COUNT,
            CLOCK,
            HAND,
            FRAME_CLOCK,
            PREVIOUS_FRAME_CLOCK,
            SPARED_FRAMES,
            JOB_COUNT,
            LEADER_COUNT,
            REQUESTED_TOTAL,
            DECODED_TOTAL,
            EVICTED_TOTAL,
            DEFERRED_TOTAL,
            USED_TOTAL,
            SWEPT,
            NEXT_FREE,
            LEADER,
            HEADER,
            LEADER_CAPACITY,
            BLOCK,
            NEXT,
            ENTRY_WORDS,
        );
        says("PROBES", PROBES as usize);
    }
}
