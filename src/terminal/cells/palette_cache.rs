//! Which of a few colours looks most like another, remembered.

use crate::terminal::cells::oklab::Oklab;
use std::sync::atomic::{AtomicU16, Ordering};

/// Bits of each channel that are distinguished. Taking a colour to them moves it by at most 2 codes.
const BITS: usize = 6;

/// Colours to choose from.
pub struct PaletteCache {
    looks: Vec<Oklab>,
    /// For each of the 2^18 boxes of sRGB the number of the nearest choice, plus 1; 0: not looked for
    /// yet.
    known: Vec<AtomicU16>,
}

impl PaletteCache {
    /// From colours that look like this; 65,535 at most, and one at least.
    pub fn new(looks: Vec<Oklab>) -> Self {
        Self { looks, known: (0..1 << (3 * BITS)).map(|_| AtomicU16::new(0)).collect() }
    }

    /// How choice `index` looks.
    pub fn look(&self, index: usize) -> Oklab {
        self.looks[index]
    }

    /// The number of the choice that looks most like `rgb`, which is taken to 6 bits a channel.
    pub fn nearest(&self, rgb: [u8; 3]) -> usize {
        let coarse = rgb.map(|c| usize::from(c) >> (8 - BITS));
        let known = &self.known[(coarse[0] << (2 * BITS)) | (coarse[1] << BITS) | coarse[2]];
        // Threads that meet here find the same answer.
        match known.load(Ordering::Relaxed) {
            0 => {
                // Boxes are spread over the whole range, so that black and white stay what they are.
                let found = self.search(Oklab::of(coarse.map(|c| ((c * 255 + 31) / 63) as u8)));
                known.store(found as u16 + 1, Ordering::Relaxed);
                found
            }
            found => usize::from(found) - 1,
        }
    }

    /// The number of the choice that looks most like `wanted`.
    pub fn search(&self, wanted: Oklab) -> usize {
        let mut best = (f32::INFINITY, 0);
        for (index, look) in self.looks.iter().enumerate() {
            let distance = wanted.distance_squared(*look);
            if distance < best.0 {
                best = (distance, index);
            }
        }
        best.1
    }
}
