//! Pictures made smaller.

use crate::terminal::cells::{code, linear};

/// `pixels` of `from` columns and rows as `to` of them, which are not more: each is the mean of what it
/// covers, in linear light.
pub fn shrunk(pixels: &[[u8; 3]], from: [usize; 2], to: [usize; 2]) -> Vec<[u8; 3]> {
    if from == to || pixels.is_empty() {
        return pixels.to_vec();
    }
    let (columns, rows) = (covers(from[0], to[0]), covers(from[1], to[1]));
    let mut shrunk = Vec::with_capacity(to[0] * to[1]);
    let mut line = vec![[0.0f32; 3]; to[0]];
    for (top, heights) in &rows {
        line.fill([0.0; 3]);
        for (y, height) in (*top..).zip(heights) {
            let row = &pixels[y * from[0]..][..from[0]];
            for (sum, (left, widths)) in line.iter_mut().zip(&columns) {
                for (pixel, width) in row[*left..].iter().zip(widths) {
                    let light = linear(*pixel);
                    (0..3).for_each(|c| sum[c] += height * width * light[c]);
                }
            }
        }
        shrunk.extend(line.iter().map(|sum| sum.map(code)));
    }
    shrunk
}

/// For each of `to` cells the first of `from` pixels below it, and the shares of those.
fn covers(from: usize, to: usize) -> Vec<(usize, Vec<f32>)> {
    let size = from as f64 / to as f64;
    let cover = |cell: usize| {
        let (begin, end) = (cell as f64 * size, ((cell + 1) as f64 * size).min(from as f64));
        let first = (begin as usize).min(from - 1);
        let last = (end.ceil() as usize).clamp(first + 1, from);
        let share = |at: usize| (end.min((at + 1) as f64) - begin.max(at as f64)).max(0.0) / size;
        (first, (first..last).map(|at| share(at) as f32).collect())
    };
    (0..to).map(cover).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_light() {
        let checkers = [[0; 3], [255; 3], [255; 3], [0; 3]];
        // Half of the light has code 188, not 128.
        assert_eq!(shrunk(&checkers, [2, 2], [1, 1]), [[188; 3]]);
        assert_eq!(shrunk(&checkers, [2, 2], [2, 2]), checkers);
        assert_eq!(shrunk(&[], [0, 0], [0, 0]), [[0u8; 3]; 0]);
    }

    #[test]
    fn what_is_even_stays_even_and_shares_add_up() {
        for (from, to) in [(7, 3), (640, 417), (1000, 999), (5, 1), (9, 9)] {
            let all = vec![[3, 99, 250]; from * 2];
            assert!(shrunk(&all, [from, 2], [to, 1]).iter().all(|p| *p == [3, 99, 250]), "{from}");
            let mut given = vec![0.0; from];
            for (first, shares) in covers(from, to) {
                assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                for (at, share) in (first..).zip(shares) {
                    given[at] += share * from as f32 / to as f32;
                }
            }
            assert!(given.iter().all(|g| (g - 1.0).abs() < 1e-4), "{from} {to} {given:?}");
        }
    }
}
