//! The 256 colours of xterm: 16 that users choose, a cube of 216, 24 greys.

use super::oklab::Oklab;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU8, Ordering};

/// Codes along each edge of the cube.
const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
/// Where the cube begins: the colours before it look different from user to user.
const FIRST: u8 = 16;
/// Where the greys begin.
const GREYS: u8 = 232;

/// The 16 colours of xterm, which other terminals vary.
const ANSI: [[u8; 3]; 16] = [
    [0, 0, 0],
    [205, 0, 0],
    [0, 205, 0],
    [205, 205, 0],
    [0, 0, 238],
    [205, 0, 205],
    [0, 205, 205],
    [229, 229, 229],
    [127, 127, 127],
    [255, 0, 0],
    [0, 255, 0],
    [255, 255, 0],
    [92, 92, 255],
    [255, 0, 255],
    [0, 255, 255],
    [255, 255, 255],
];

/// sRGB of a colour of the table.
pub fn rgb(index: u8) -> [u8; 3] {
    match index {
        ..FIRST => ANSI[usize::from(index)],
        GREYS.. => [8 + 10 * (index - GREYS); 3],
        _ => {
            let i = index - FIRST;
            [i / 36, i / 6 % 6, i % 6].map(|step| LEVELS[usize::from(step)])
        }
    }
}

/// The colours from [`FIRST`] on.
static PALETTE: LazyLock<Vec<Oklab>> =
    LazyLock::new(|| (FIRST..=255).map(|index| Oklab::of(rgb(index))).collect());

/// Bits of each channel that the table of nearest colours distinguishes.
const BITS: usize = 6;

/// The nearest colour of each of the 2^18 boxes; 0: not looked for yet.
static NEAREST: LazyLock<Vec<AtomicU8>> =
    LazyLock::new(|| (0..1 << (3 * BITS)).map(|_| AtomicU8::new(0)).collect());

/// The colour of cube and greys that looks most like `rgb`, which is taken to 6 bits a channel. (That
/// moves it by at most 2 codes; two neighbours in the table are 10 and more apart.)
pub fn nearest(rgb: [u8; 3]) -> u8 {
    let coarse = rgb.map(|c| usize::from(c) >> (8 - BITS));
    let known = &NEAREST[(coarse[0] << (2 * BITS)) | (coarse[1] << BITS) | coarse[2]];
    // Threads that meet here find the same answer.
    match known.load(Ordering::Relaxed) {
        0 => {
            // Black and white stay what they are: boxes spread over the whole range.
            let center = coarse.map(|c| ((c * 255 + 31) / 63) as u8);
            let found = search(Oklab::of(center));
            known.store(found, Ordering::Relaxed);
            found
        }
        found => found,
    }
}

fn search(wanted: Oklab) -> u8 {
    let mut best = (f32::INFINITY, FIRST);
    for (index, color) in (FIRST..=255).zip(PALETTE.iter()) {
        let distance = wanted.distance_squared(*color);
        if distance < best.0 {
            best = (distance, index);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_xterms() {
        assert_eq!(rgb(16), [0, 0, 0]);
        assert_eq!(rgb(21), [0, 0, 255]);
        assert_eq!(rgb(67), [95, 135, 175]);
        assert_eq!(rgb(231), [255, 255, 255]);
        assert_eq!(rgb(232), [8, 8, 8]);
        assert_eq!(rgb(255), [238, 238, 238]);
    }

    #[test]
    fn colours_of_the_table_are_their_own_nearest() {
        for index in FIRST..=255 {
            assert_eq!(nearest(rgb(index)), index);
        }
    }

    /// Against the whole table at full precision: never visibly worse.
    #[test]
    fn the_nearest_is_near() {
        let mut exact_hits = 0;
        let mut state = 1u32;
        for _ in 0..4000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let [r, g, b, _] = state.to_be_bytes();
            let wanted = Oklab::of([r, g, b]);
            let [found, best] = [nearest([r, g, b]), search(wanted)];
            let distance = |index| Oklab::of(rgb(index)).distance(wanted);
            assert!(distance(found) < distance(best) + 0.02, "{:?}", [r, g, b]);
            exact_hits += u32::from(found == best);
        }
        assert!(exact_hits > 3600, "{exact_hits} of 4000");
    }
}
