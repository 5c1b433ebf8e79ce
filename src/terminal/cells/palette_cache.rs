//! Palette with a cache of searches for the nearest colour.

use crate::terminal::cells::oklab::Oklab;
use std::sync::atomic::{AtomicU16, Ordering};

/// Number of bits per channel of a cache key. Rounding to 6 bits changes a colour by at most 2 of
/// 255 levels.
const BITS: usize = 6;

/// Palette with a cache: it stores the nearest palette colour of each sRGB colour, rounded to 6
/// bits per channel.
pub struct PaletteCache {
    colors: Vec<Oklab>,
    /// Index plus 1 of the nearest palette colour, for each of the 2^18 rounded sRGB colours. 0
    /// means that it was not searched yet.
    known: Vec<AtomicU16>,
}

impl PaletteCache {
    /// Creates a palette of 1 to 65,535 colours.
    pub fn new(colors: Vec<Oklab>) -> Self {
        Self { colors, known: (0..1 << (3 * BITS)).map(|_| AtomicU16::new(0)).collect() }
    }

    /// Returns the palette colour `index`.
    pub fn color(&self, index: usize) -> Oklab {
        self.colors[index]
    }

    /// Returns the index of the palette colour nearest to `rgb`. `rgb` is rounded to 6 bits per
    /// channel.
    pub fn nearest(&self, rgb: [u8; 3]) -> usize {
        let coarse = rgb.map(|c| usize::from(c) >> (8 - BITS));
        let known = &self.known[(coarse[0] << (2 * BITS)) | (coarse[1] << BITS) | coarse[2]];
        // Threads that search the same box at the same time store the same index.
        match known.load(Ordering::Relaxed) {
            0 => {
                // The 64 steps of a channel are spread over 0..=255, so that black and white are
                // exact.
                let index = self.search(Oklab::of(coarse.map(|c| ((c * 255 + 31) / 63) as u8)));
                known.store(index as u16 + 1, Ordering::Relaxed);
                index
            }
            stored => usize::from(stored) - 1,
        }
    }

    /// Returns the index of the palette colour nearest to `target`.
    pub fn search(&self, target: Oklab) -> usize {
        let mut best = (f32::INFINITY, 0);
        for (index, look) in self.colors.iter().enumerate() {
            let distance = target.distance_squared(*look);
            if distance < best.0 {
                best = (distance, index);
            }
        }
        best.1
    }
}
