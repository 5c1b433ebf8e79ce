//! Images and mesh of the shipped scenes with textures. These functions generate them.

use crate::harness::*;
use png::{BitDepth, ColorType};

/// Returns a pseudo-random number from 0 to 1 for a pair of integers.
fn hashed(x: i64, y: i64) -> f64 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    f64::from(h ^ (h >> 15)) / f64::from(u32::MAX)
}

/// Returns smooth noise from 0 to 1 that repeats after `period` cells.
fn noise(x: f64, y: f64, period: [i64; 2]) -> f64 {
    let at = |i: f64, j: f64| {
        hashed((i as i64).rem_euclid(period[0]), (j as i64).rem_euclid(period[1]) + 1000)
    };
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (i, j) = (x.floor(), y.floor());
    let (fx, fy) = (ease(x - i), ease(y - j));
    let mix = |a: f64, b: f64, f: f64| a + f * (b - a);
    let below = mix(at(i, j), at(i + 1.0, j), fx);
    mix(below, mix(at(i, j + 1.0), at(i + 1.0, j + 1.0), fx), fy)
}

fn code(x: f64) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Returns a tileable image of four boards with grain along u.
fn wood() -> RgbImage {
    const SIDE: u32 = 192;
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let (u, v) = (f64::from(x) / f64::from(SIDE), f64::from(y) / f64::from(SIDE));
        let board = (4.0 * v).floor() as i64;
        let across = 4.0 * v - board as f64;
        // Every board has its own pattern and ends at its own place.
        let along = (u + hashed(board, 7)).fract();
        let wave = noise(3.0 * along, 2.0 * across + 9.0 * board as f64, [3, 1 << 20]);
        let ring = (across * 5.0 + 2.6 * wave + 3.0 * hashed(board, 3)).fract();
        let fibre = noise(24.0 * along, 40.0 * v, [24, 40]);
        let tone = 0.72 - 0.22 * ring * ring - 0.10 * fibre + 0.14 * (hashed(board, 5) - 0.5);
        let gap = across < 0.03 || along < 0.006;
        let tone = if gap { 0.45 * tone } else { tone };
        // Few tones keep the file small.
        let tone = (tone * 48.0).round() / 48.0;
        [code(1.12 * tone), code(0.78 * tone), code(0.47 * tone)]
    })
}

/// Returns two values for a point of a tileable brick wall: the height of the surface above the
/// mortar, from 0 to 1, and the number of the brick. The wall has eight rows of four bricks; each
/// second row is offset by half a brick.
fn brick(u: f64, v: f64) -> (f64, i64) {
    let row = (8.0 * v).floor();
    let shifted = 4.0 * u + 0.5 * row.rem_euclid(2.0);
    let column = shifted.floor().rem_euclid(4.0);
    let (x, y) = (shifted.fract(), 8.0 * v - row);
    // Distance to the nearest edge, in heights of a row.
    let edge = (2.0 * x.min(1.0 - x)).min(y.min(1.0 - y));
    let rise = ((edge - 0.05) / 0.13).clamp(0.0, 1.0);
    let rough = noise(64.0 * u, 64.0 * v, [64, 64]) + noise(24.0 * u, 24.0 * v, [24, 24]);
    let round = rise * rise * (3.0 - 2.0 * rise);
    (round * 0.8 + 0.1 * rough, (row * 4.0 + column) as i64)
}

fn brick_heights() -> PngImage {
    const SIDE: u32 = 256;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
    let level = |x, y| code((brick(at(x), at(y)).0 * 64.0).round() / 64.0);
    PngImage {
        width: SIDE,
        height: SIDE,
        color: ColorType::Grayscale,
        depth: BitDepth::Eight,
        levels: (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| level(x, y))).collect(),
    }
}

fn bricks() -> RgbImage {
    const SIDE: u32 = 128;
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let at = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
        let (height, number) = brick(at(x), at(y));
        if height < 0.35 {
            return [196, 188, 176];
        }
        let tone = 0.8 + 0.35 * (hashed(number, 11) - 0.5);
        [code(0.78 * tone), code(0.40 * tone), code(0.29 * tone)]
    })
}

/// Returns a test image of 8 by 8 squares that show their position. Red grows with u, green with v,
/// and an arrow in every second square points up.
fn sheet() -> RgbImage {
    const SIDE: u32 = 256;
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let (u, v) = (f64::from(x) + 0.5, f64::from(SIDE - 1 - y) + 0.5);
        let square = f64::from(SIDE) / 8.0;
        let (i, j) = ((u / square).floor(), (v / square).floor());
        let (a, b) = (u / square - i - 0.5, v / square - j - 0.5);
        let arrow = b.abs() < 0.3 && a.abs() < if b > 0.0 { 0.3 - b } else { 0.08 };
        let line = a.abs() > 0.47 || b.abs() > 0.47;
        if line {
            return [250, 250, 245];
        }
        let odd = (i + j).rem_euclid(2.0) == 1.0;
        if odd && arrow {
            return [250, 250, 245];
        }
        let dim = if odd { 0.75 } else { 1.0 };
        let [r, g] = [i, j].map(|k| 0.25 + 0.7 * k / 7.0);
        [code(r * dim), code(g * dim), code((1.15 - 0.5 * r - 0.5 * g) * dim)]
    })
}

/// Returns a vase as binary PLY: a profile curve rotated about the y axis. The texture coordinate u
/// runs once around the axis, and v along the profile.
fn vase() -> Vec<u8> {
    const AROUND: usize = 48;
    const ALONG: usize = 40;
    let outline = |t: f64| {
        let radius = 0.30 + 0.22 * (TAU * (0.62 * t + 0.97)).sin() + 0.10 * (1.0 - t).powi(6);
        (radius.max(0.02), 1.5 * t)
    };
    let columns = AROUND + 1;
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment A vase with texture coordinates.\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float s\nproperty float t\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        columns * (ALONG + 1),
        AROUND * ALONG
    )
    .into_bytes();
    let decimals = |x: f64| ((x * 1e5).round() / 1e5) as f32;
    for j in 0..=ALONG {
        let t = j as f64 / ALONG as f64;
        let (radius, y) = outline(t);
        for i in 0..columns {
            let u = i as f64 / AROUND as f64;
            let (sin, cos) = (TAU * (u - 0.5)).sin_cos();
            for x in [radius * sin, y, radius * cos, u, t] {
                out.extend(decimals(x).to_le_bytes());
            }
        }
    }
    for j in 0..ALONG {
        for i in 0..AROUND {
            let at = |i: usize, j: usize| (j * columns + i) as i32;
            out.push(4);
            for corner in [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] {
                out.extend(corner.to_le_bytes());
            }
        }
    }
    out
}

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("ZERKALO_ROOT")).join("scenes").join(name)
}

/// Checks that the shipped texture files have the generated pixels. The bytes of the files are not
/// compared, because the compression may change. A level may differ by one, because sines differ
/// between machines in the last digit.
#[test]
fn texture_files_match_generators() {
    let bless = std::env::var_os("ZERKALO_BLESS").is_some();
    let images = [
        ("wood.png", PngImage::from(&wood())),
        ("bricks.png", PngImage::from(&bricks())),
        ("brick-heights.png", brick_heights()),
        ("sheet.png", PngImage::from(&sheet())),
    ];
    for (name, made) in images {
        let path = shipped("textures").join(name);
        if bless {
            made.save(&path);
        }
        let stored = PngImage::open(&path).unwrap();
        assert_eq!((stored.color, stored.depth), (made.color, made.depth), "{name}");
        let (a, b) = (stored.levels, made.levels);
        assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1), "{name}");
        let bytes = fs::metadata(&path).unwrap().len();
        assert!(bytes < 60_000, "{name}: {bytes} bytes");
    }
    let path = shipped("meshes/vase.ply");
    if bless {
        fs::write(&path, vase()).unwrap();
    }
    assert!(fs::read(&path).unwrap() == vase(), "vase.ply");
}

#[test]
fn vase_faces_outwards_and_has_coordinates() {
    let mesh = Assets::default().mesh(&shipped("meshes/vase.ply")).unwrap();
    let mesh = &mesh.mesh;
    let uvs = mesh.uvs.as_ref().unwrap();
    assert!(uvs.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
    let corner = |i: &u32| DVec3::from(mesh.positions[*i as usize].map(f64::from));
    for t in &mesh.triangles {
        let [a, b, c] = [0, 1, 2].map(|k| corner(&t[k]));
        let middle = (a + b + c) / 3.0;
        let outward = DVec3::new(middle.x, 0.0, middle.z);
        assert!((b - a).cross(c - a).dot(outward) > 0.0, "{middle}");
    }
}
