//! The order in which a picture's rays are numbered.

/// Pixels on the edge of a tile.
const TILE: u32 = 8;

/// Squares of at most 4x4 tiles, so that little of them lies outside the picture.
const MOST_LEVEL: u32 = 2;

/// Rays are numbered along Morton curves (G. M. Morton, A computer oriented geodetic data base, 1966)
/// over squares of tiles, square by square in rows: neighbours on the screen meet the same blocks.
/// Numbers whose pixel lies outside the picture have no ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayOrder {
    level: u32,
    columns: u32,
    rows: u32,
}

impl RayOrder {
    /// Order for a picture of `size` pixels.
    pub fn new(size: [u32; 2]) -> Self {
        let tiles = size[0].min(size[1]).div_ceil(TILE).max(1);
        let level = tiles.next_power_of_two().ilog2().min(MOST_LEVEL);
        let edge = TILE << level;
        Self { level, columns: size[0].div_ceil(edge), rows: size[1].div_ceil(edge) }
    }

    /// The order of a frame's uniform.
    pub(crate) fn of(level: u32, columns: u32, numbers: u32) -> Self {
        Self { level, columns, rows: (numbers >> (2 * (TILE.ilog2() + level))) / columns.max(1) }
    }

    /// The order of every `step`-th pixel's ray in both directions, in which ray n is this order's ray `n * step^2`.
    /// `None` unless `step` is a power of two and the squares have as many tiles on an edge.
    #[must_use]
    pub fn preview(&self, step: u32) -> Option<Self> {
        let level = self.level.checked_sub(step.checked_ilog2()?)?;
        step.is_power_of_two().then_some(Self { level, ..*self })
    }

    /// Numbers in all, a multiple of 64.
    pub fn numbers(&self) -> u64 {
        (u64::from(self.columns) * u64::from(self.rows)) << self.bits()
    }

    /// Edge of a square as a power of two of tiles.
    pub(crate) fn level(&self) -> u32 {
        self.level
    }

    /// Squares in a row.
    pub(crate) fn columns(&self) -> u32 {
        self.columns
    }

    /// Bits of a number that count inside a square.
    fn bits(&self) -> u32 {
        2 * (TILE.ilog2() + self.level)
    }

    /// The pixel of a number, which may lie outside the picture: twin of `frame_pixel`.
    pub fn pixel(&self, number: u32) -> [u32; 2] {
        let square = number >> self.bits();
        let code = number & ((1 << self.bits()) - 1);
        let edge = TILE << self.level;
        let corner = [square % self.columns, square / self.columns].map(|s| s * edge);
        [corner[0] + even_bits(code), corner[1] + even_bits(code >> 1)]
    }

    /// The number of a pixel: twin of `frame_number`.
    pub fn number(&self, pixel: [u32; 2]) -> u32 {
        let shift = TILE.ilog2() + self.level;
        let [column, row] = pixel.map(|p| p >> shift);
        let inside = pixel.map(|p| p & ((1 << shift) - 1));
        ((row * self.columns + column) << self.bits())
            | spread_bits(inside[0])
            | spread_bits(inside[1]) << 1
    }
}

/// Bits 0, 2, 4, .. of the code, put together.
fn even_bits(code: u32) -> u32 {
    (0..16).map(|bit| (code >> (2 * bit) & 1) << bit).sum()
}

/// The bits of a number below 2^16, with a zero after each.
fn spread_bits(number: u32) -> u32 {
    (0..16).map(|bit| (number >> bit & 1) << (2 * bit)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_one_number() {
        for size in [[1, 1], [1, 70], [200, 3], [64, 64], [129, 75], [333, 57]] {
            let order = RayOrder::new(size);
            let mut seen = vec![0; (size[0] * size[1]) as usize];
            for number in 0..order.numbers() {
                let [x, y] = order.pixel(number as u32);
                assert_eq!(order.number([x, y]), number as u32, "{size:?}");
                if x < size[0] && y < size[1] {
                    seen[(x + size[0] * y) as usize] += 1;
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{size:?}");
        }
    }

    #[test]
    fn a_preview_has_every_pixel_of_a_lattice_in_the_same_order() {
        for size in [[200, 133], [64, 64], [129, 75], [18, 40]] {
            let order = RayOrder::new(size);
            for step in [1, 2, 4] {
                let Some(preview) = order.preview(step) else {
                    assert!(order.level() < step.ilog2(), "{size:?}, {step}");
                    continue;
                };
                let inside = |p: [u32; 2]| p[0] * step < size[0] && p[1] * step < size[1];
                let mut seen = 0;
                for number in 0..preview.numbers() as u32 {
                    let pixel = preview.pixel(number);
                    assert_eq!(order.number(pixel.map(|p| p * step)), number * step * step);
                    assert_eq!(preview.number(pixel), number);
                    seen += u32::from(inside(pixel));
                }
                assert_eq!(seen, size[0].div_ceil(step) * size[1].div_ceil(step), "{size:?}");
            }
            assert!(order.preview(3).is_none() && order.preview(0).is_none());
            assert!(order.preview(8).is_none());
        }
    }

    #[test]
    fn little_lies_outside_common_pictures() {
        for (size, most) in [([640, 368], 1.05), ([1280, 720], 1.03), ([1920, 1088], 1.001)] {
            let share = RayOrder::new(size).numbers() as f64 / f64::from(size[0] * size[1]);
            assert!(share <= most, "{size:?}: {share}");
        }
        assert_eq!(RayOrder::new([8192, 1]).numbers(), 64 * 1024);
    }

    #[test]
    fn tiles_hold_together() {
        let order = RayOrder::new([640, 368]);
        for tile in 0..order.numbers() as u32 / 64 {
            let corner = order.pixel(64 * tile).map(|p| p / TILE);
            assert!((0..64).all(|i| order.pixel(64 * tile + i).map(|p| p / TILE) == corner));
        }
    }
}
