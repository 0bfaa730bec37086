//! Pairs to group.

/// How the slots of consecutive pairs follow each other.
#[derive(Clone, Copy)]
pub enum Order {
    /// One pair per ray of a square picture, row by row; 8 x 8 rays meet the same block.
    Screen,
    /// No order.
    Random,
}

impl Order {
    pub const ALL: [Order; 2] = [Order::Screen, Order::Random];

    pub fn name(self) -> &'static str {
        match self {
            Order::Screen => "screen",
            Order::Random => "random",
        }
    }
}

/// The slot of every pair, and its number as its value.
pub struct Pairs {
    pub keys: Vec<u32>,
    pub values: Vec<u32>,
    /// A power of two.
    pub slots: u32,
}

impl Pairs {
    /// `pairs` and `slots` are powers of two, `pairs` of an even exponent.
    pub fn new(pairs: u32, slots: u32, order: Order) -> Self {
        let side = pairs.isqrt();
        let slot = |pair: u32| match order {
            Order::Screen => {
                let (x, y) = (pair % side, pair / side);
                // Neighbouring blocks lie in slots far apart; odd, so no two share one needlessly.
                (x / 8 + side / 8 * (y / 8)).wrapping_mul(2_654_435_761) % slots
            }
            Order::Random => hash(pair) % slots,
        };
        Self { keys: (0..pairs).map(slot).collect(), values: (0..pairs).collect(), slots }
    }
}

/// Mixes all bits: xor-shifts and multiplications by odd numbers.
fn hash(number: u32) -> u32 {
    let mut h = number.wrapping_add(0x9E37_79B9);
    h = (h ^ (h >> 16)).wrapping_mul(0x21F0_AAAD);
    h = (h ^ (h >> 15)).wrapping_mul(0x735A_2D97);
    h ^ (h >> 15)
}
