//! Helpers shared by benches: timing, random numbers, a bumpy ball of triangles.
#![allow(dead_code, reason = "each bench uses its part")]

use std::time::Instant;
use zerkalo_kernel::primitive::TriangleMesh;

/// Returns the processor time of this thread in seconds. Other programs on the machine affect it
/// less than the wall-clock time. On systems without `/proc/thread-self/schedstat`, returns the
/// wall-clock time since `start`.
pub fn seconds(start: Instant) -> f64 {
    // The kernel updates the counter of this thread when the thread yields.
    std::thread::yield_now();
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = times.and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// Runs each function of `candidates` `rounds` times, in turns. Returns the shortest time in
/// seconds of each function.
pub fn in_turns(rounds: usize, candidates: &mut [&mut dyn FnMut()]) -> Vec<f64> {
    let clock = Instant::now();
    let mut best = vec![f64::INFINITY; candidates.len()];
    for _ in 0..rounds {
        for (best, candidate) in best.iter_mut().zip(candidates.iter_mut()) {
            let begin = seconds(clock);
            candidate();
            *best = best.min(seconds(clock) - begin);
        }
    }
    best
}

/// Random number generator (SplitMix64).
pub struct Random(pub u64);

impl Random {
    /// Returns a uniform random number in [0, 1).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a random point, uniform on the sphere of radius `r` around the origin.
    pub fn point(&mut self, r: f64) -> [f64; 3] {
        let (z, around) = (2.0 * self.next() - 1.0, std::f64::consts::TAU * self.next());
        let across = (1.0 - z * z).sqrt();
        [r * across * around.cos(), r * across * around.sin(), r * z]
    }
}

/// Returns the unit vector from `a` to `b`.
pub fn towards(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let d: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    d.map(|x| x / length)
}

/// Returns the mesh of a bumpy ball, with about `2 x rings x sides` triangles.
pub fn ball(rings: usize, sides: usize) -> TriangleMesh {
    let mut positions = Vec::new();
    for ring in 0..=rings {
        let polar = std::f64::consts::PI * ring as f64 / rings as f64;
        for side in 0..sides {
            let around = std::f64::consts::TAU * side as f64 / sides as f64;
            let d = [polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin()];
            let bump = (9.0 * d[0]).sin() * (11.0 * d[1]).sin() * (10.0 * d[2]).sin();
            positions.push(d.map(|x| (x * (1.0 + 0.15 * bump)) as f32));
        }
    }
    let index = |ring: usize, side: usize| (ring * sides + side % sides) as u32;
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for side in 0..sides {
            let [a, b] = [index(ring, side), index(ring, side + 1)];
            let [c, d] = [index(ring + 1, side), index(ring + 1, side + 1)];
            if ring > 0 {
                triangles.push([a, b, c]);
            }
            if ring + 1 < rings {
                triangles.push([b, d, c]);
            }
        }
    }
    TriangleMesh {
        positions,
        center: [0.0; 3],
        triangles,
        normals: None,
        is_flat: false,
        uvs: None,
        colors: Vec::new(),
        color_of: Vec::new(),
        bounds: [[-1.2; 3], [1.2; 3]],
        notes: Vec::new(),
    }
}
