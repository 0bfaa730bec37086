//! A stream whose bytes arrive while it is uploaded, from a network for instance.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bytes that have arrived and are not uploaded yet.
#[derive(Debug, Default)]
struct Queue {
    pieces: VecDeque<Vec<u8>>,
    /// Bytes of the first piece that are taken.
    taken_of_first: usize,
    /// Bytes taken so far.
    taken: u64,
    waiting: u64,
    ended: bool,
}

/// The end of a stream at which its bytes arrive.
///
/// Dropping it says that there are no more. Nothing here waits: whoever receives the bytes should hold
/// back while many of them wait.
#[derive(Debug)]
pub struct StreamFeed {
    queue: Arc<Mutex<Queue>>,
}

/// The other end.
#[derive(Clone)]
pub(crate) struct Arriving {
    queue: Arc<Mutex<Queue>>,
}

/// What a reader of a stream finds.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// Bytes, at least one.
    Bytes,
    /// Nothing yet.
    Nothing,
    /// Nothing, for ever.
    End,
    /// The bytes asked for were taken before.
    Taken,
}

pub(crate) fn channel() -> (StreamFeed, Arriving) {
    let queue = Arc::new(Mutex::new(Queue::default()));
    (StreamFeed { queue: Arc::clone(&queue) }, Arriving { queue })
}

fn lock(queue: &Mutex<Queue>) -> MutexGuard<'_, Queue> {
    // Whole between any two statements that can panic, so a poisoned lock does no harm.
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}

impl StreamFeed {
    /// Adds the next bytes of the stream. Those behind its last block are ignored.
    pub fn push(&self, bytes: impl Into<Vec<u8>>) {
        let bytes = bytes.into();
        if !bytes.is_empty() {
            let mut queue = lock(&self.queue);
            queue.waiting += bytes.len() as u64;
            queue.pieces.push_back(bytes);
        }
    }

    /// Bytes that wait in main memory for their upload.
    #[must_use]
    pub fn waiting_bytes(&self) -> u64 {
        lock(&self.queue).waiting
    }
}

impl Drop for StreamFeed {
    fn drop(&mut self) {
        lock(&self.queue).ended = true;
    }
}

impl Arriving {
    /// What a reader finds that has read `position` bytes.
    pub(crate) fn find(&self, position: u64) -> Found {
        let queue = lock(&self.queue);
        if position != queue.taken {
            Found::Taken
        } else if queue.waiting > 0 {
            Found::Bytes
        } else if queue.ended {
            Found::End
        } else {
            Found::Nothing
        }
    }

    /// Takes at most `most` bytes.
    pub(crate) fn take(&self, most: u64) -> Vec<u8> {
        let mut queue = lock(&self.queue);
        let length = queue.waiting.min(most);
        let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(usize::MAX));
        while (bytes.len() as u64) < length
            && let Some(piece) = queue.pieces.pop_front()
        {
            let rest = &piece[queue.taken_of_first..];
            let wanted = usize::try_from(length).unwrap_or(usize::MAX) - bytes.len();
            if rest.len() > wanted {
                bytes.extend_from_slice(&rest[..wanted]);
                queue.taken_of_first += wanted;
                queue.pieces.push_front(piece);
            } else {
                bytes.extend_from_slice(rest);
                queue.taken_of_first = 0;
            }
        }
        queue.waiting -= bytes.len() as u64;
        queue.taken += bytes.len() as u64;
        bytes
    }
}

impl fmt::Debug for Arriving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let queue = lock(&self.queue);
        write!(f, "{} bytes taken, {} waiting", queue.taken, queue.waiting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_out_in_order_in_other_pieces() {
        let bytes: Vec<u8> = (0..=250).collect();
        let (feed, arriving) = channel();
        bytes.chunks(60).for_each(|piece| feed.push(piece));
        let mut taken = Vec::new();
        for most in [1, 59, 60, 7, 100, 1000] {
            assert_eq!(arriving.find(taken.len() as u64), Found::Bytes);
            taken.extend(arriving.take(most));
            assert_eq!(feed.waiting_bytes(), (bytes.len() - taken.len()) as u64);
        }
        assert_eq!(taken, bytes);
        assert!(arriving.take(5).is_empty());
    }

    #[test]
    fn a_reader_knows_what_to_expect() {
        let (feed, arriving) = channel();
        feed.push([]);
        assert_eq!(arriving.find(0), Found::Nothing);
        feed.push([1, 2]);
        arriving.take(1);
        assert_eq!(arriving.find(0), Found::Taken);
        drop(feed);
        assert_eq!(arriving.find(1), Found::Bytes);
        arriving.take(1);
        assert_eq!(arriving.find(2), Found::End);
    }
}
