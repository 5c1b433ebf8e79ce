//! Meshes: time to build the tree, memory, and rays per second of processor time on one core: camera
//! rays (eight neighbouring pixels) and rays between random points, together and apart.
//!
//! `cargo bench --bench mesh`. It prints one table; times are those of the thread, not of the clock, where
//! the system tells them, so that a busy machine disturbs little.

use std::hint::black_box;
use std::time::Instant;
use zerkalo::asset::{Mesh, TriangleMesh};
use zerkalo::lanes::{Double, Lanes, Mask, Real, Single, V3};
use zerkalo::shape::{Ray, facets};

/// Rays of each measurement.
const RAYS: usize = 1 << 17;

/// A bumpy ball of about `2 x rings x sides` triangles.
fn ball(rings: usize, sides: usize) -> TriangleMesh {
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
        uvs: None,
        colors: Vec::new(),
        color_of: Vec::new(),
        bounds: [[-1.2; 3], [1.2; 3]],
        notes: Vec::new(),
    }
}

/// Seconds of processor time of this thread, or of the clock.
fn seconds(start: Instant) -> f64 {
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = times.and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// Random numbers from 0 to 1 (xorshift: Marsaglia 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A point on the sphere of radius `r`.
    fn point(&mut self, r: f64) -> [f64; 3] {
        let (z, around) = (2.0 * self.next() - 1.0, std::f64::consts::TAU * self.next());
        let across = (1.0 - z * z).sqrt();
        [r * across * around.cos(), r * across * around.sin(), r * z]
    }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|x| x / length)
}

fn towards(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    unit(std::array::from_fn(|i| b[i] - a[i]))
}

/// A packet from one ray per lane: origin and direction.
fn packet<L: Lanes>(mut ray: impl FnMut(usize) -> ([f64; 3], [f64; 3])) -> Ray<L> {
    let rays: Vec<_> = (0..L::WIDTH).map(&mut ray).collect();
    let vector = |v: [f64; 3]| v.map(L::Scalar::of);
    Ray {
        origin: V3::from_fn(|i| vector(rays[i].0)),
        direction: V3::from_fn(|i| vector(rays[i].1)),
    }
}

/// Camera rays, a strip of neighbouring pixels in each packet.
fn camera<L: Lanes>() -> Vec<Ray<L>> {
    let side = (RAYS as f64).sqrt() as usize / L::WIDTH * L::WIDTH;
    let eye = [0.0, 0.0, 3.5];
    let pixel = |i: usize| 2.2 * (i as f64 / side as f64) - 1.1;
    (0..side * side / L::WIDTH)
        .map(|k| {
            let (x, y) = (k * L::WIDTH % side, k * L::WIDTH / side);
            packet(|i| (eye, towards(eye, [pixel(x + i), pixel(y), 0.0])))
        })
        .collect()
}

/// Rays whose directions differ by at most `spread` in a packet; above 1: by anything.
fn scattered<L: Lanes>(spread: f64) -> Vec<Ray<L>> {
    let mut random = Random(88_172_645_463_325_252);
    (0..RAYS / L::WIDTH)
        .map(|_| {
            let mut ends = (random.point(1.6), random.point(0.9));
            packet(|_| {
                if spread > 1.0 {
                    ends = (random.point(1.6), random.point(0.9));
                    return (ends.0, towards(ends.0, ends.1));
                }
                let (d, turn) = (towards(ends.0, ends.1), random.point(0.5 * spread));
                (ends.0, unit(std::array::from_fn(|i| d[i] + turn[i])))
            })
        })
        .collect()
}

/// Millions of rays per second; `how`: together, apart, or as the packet itself suggests.
fn speed<L: Lanes>(mesh: &Mesh, rays: &[Ray<L>], how: Option<bool>) -> f64 {
    let limit = L::of(L::MAX);
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let clock = Instant::now();
        let begin = seconds(clock);
        let hits: u32 = rays
            .iter()
            .map(|ray| match how {
                None => facets::closest(mesh, ray, limit),
                Some(together) => facets::closest_by(mesh, ray, limit, together),
            })
            .map(|found| found.t.lt(limit).bits().count_ones())
            .sum();
        black_box(hits);
        best = best.min(seconds(clock) - begin);
    }
    (rays.len() * L::WIDTH) as f64 / best / 1e6
}

fn table<L: Lanes>(mesh: &Mesh) {
    let (near, far) = (camera::<L>(), scattered::<L>(9.0));
    println!(
        "  {}: camera {:.2}, random {:.2} million rays/s",
        L::NAME,
        speed(mesh, &near, None),
        speed(mesh, &far, None)
    );
    print!("  {}, together or apart:", L::NAME);
    for spread in [0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 9.0] {
        let rays = scattered::<L>(spread);
        let [together, apart] = [true, false].map(|how| speed(mesh, &rays, Some(how)));
        print!("  {spread}: {together:.2} {apart:.2}");
    }
    println!();
}

fn main() {
    for (rings, sides) in [(16, 34), (132, 266), (500, 1001)] {
        let triangles = ball(rings, sides);
        let clock = Instant::now();
        let begin = seconds(clock);
        let mesh = Mesh::new(triangles);
        let count = mesh.mesh().triangles.len();
        println!(
            "{count} triangles: tree in {:.3} s, {:.1} bytes a triangle, depth {}",
            seconds(clock) - begin,
            mesh.bytes() as f64 / count as f64,
            mesh.boxes().depth()
        );
        table::<Single>(&mesh);
        table::<Double>(&mesh);
    }
}
