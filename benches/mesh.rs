//! Triangle meshes of three sizes: BVH build time, memory, and closest hits per second of processor
//! time on one core. The packets of camera rays cover small rectangles of pixels of a picture of
//! 1024 x 1024. Random rays connect two random points. The last part compares packet traversal with
//! single-ray traversal, for packets with less and less coherent directions.
//!
//! `cargo bench -p zerkalo-benches --bench mesh`; `-- --short` leaves out the last part.

#[path = "common/mod.rs"]
mod common;

use common::{Random, ball, in_turns, towards};
use std::hint::black_box;
use std::time::Instant;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Double, Float, Mask, SimdFloat, Single, Vec3};
use zerkalo_kernel::primitive::Mesh;
use zerkalo_kernel::primitive::mesh::intersection;

/// Number of random rays in each measurement.
const RAYS: usize = 1 << 19;

/// Width and height in pixels of the picture whose camera rays are traced.
const SIDE: usize = 1024;

/// Returns a packet of rays. `ray` returns origin and direction of the ray in the lane with the
/// given index.
fn packet<L: SimdFloat>(mut ray: impl FnMut(usize) -> ([f64; 3], [f64; 3])) -> Ray<L> {
    let rays: Vec<_> = (0..L::WIDTH).map(&mut ray).collect();
    let vector = |v: [f64; 3]| v.map(L::Scalar::from_f64);
    Ray {
        origin: Vec3::from_fn(|i| vector(rays[i].0)),
        direction: Vec3::from_fn(|i| vector(rays[i].1)),
    }
}

/// Returns camera rays in packets. The rays of a packet belong to a rectangle of pixels, two rows
/// high.
fn camera<L: SimdFloat>() -> Vec<Ray<L>> {
    let (eye, across) = ([0.0, 0.0, 3.5], L::WIDTH / 2);
    let pixel = |i: usize| 2.2 * (i as f64 / SIDE as f64) - 1.1;
    let corners = (0..SIDE / 2).flat_map(|y| (0..SIDE / across).map(move |x| (x, 2 * y)));
    let block = |(x, y): (usize, usize)| {
        packet(|i| {
            let (x, y) = (across * x + i % across, y + i / across);
            (eye, towards(eye, [pixel(x), pixel(y), 0.0]))
        })
    };
    corners.map(block).collect()
}

/// Returns `rays` random rays in packets. The rays of a packet have a common origin, and the
/// difference of any two of their unit directions has at most the length `spread`. If `spread` is
/// above 1, all rays are independent of each other.
fn scattered<L: SimdFloat>(spread: f64, rays: usize) -> Vec<Ray<L>> {
    let mut random = Random(7);
    (0..rays / L::WIDTH)
        .map(|_| {
            let mut ends = (random.point(1.6), random.point(0.9));
            packet(|_| {
                if spread > 1.0 {
                    ends = (random.point(1.6), random.point(0.9));
                    return (ends.0, towards(ends.0, ends.1));
                }
                let (d, offset) = (towards(ends.0, ends.1), random.point(0.5 * spread));
                (ends.0, towards([0.0; 3], std::array::from_fn(|i| d[i] + offset[i])))
            })
        })
        .collect()
}

/// Returns the number of rays, in millions, that are traced per second. `as_packet` selects packet
/// traversal (`true`) or single-ray traversal (`false`). If it is `None`, the program chooses
/// between them for each packet, by the coherence of its rays.
fn speed<L: SimdFloat>(mesh: &Mesh, rays: &[Ray<L>], as_packet: Option<bool>) -> f64 {
    let limit = L::from_f64(L::MAX);
    let seconds = in_turns(
        3,
        &mut [&mut || {
            let hits: u32 = rays
                .iter()
                .map(|ray| match as_packet {
                    None => intersection::closest(mesh, ray, limit),
                    Some(as_packet) => intersection::closest_with(mesh, ray, limit, as_packet),
                })
                .map(|hit| hit.t.lt(limit).bits().count_ones())
                .sum();
            black_box(hits);
        }],
    );
    (rays.len() * L::WIDTH) as f64 / seconds[0] / 1e6
}

fn rays<L: SimdFloat>(mesh: &Mesh) -> [f64; 2] {
    let camera = speed(mesh, &camera::<L>(), None);
    let random = speed(mesh, &scattered::<L>(9.0, RAYS), None);
    println!("  {}: camera {camera:.1}, random {random:.2} million rays/s", L::NAME);
    [camera, random]
}

fn packet_or_single<L: SimdFloat>(mesh: &Mesh) {
    print!("  {}, packet or single-ray traversal, by spread:", L::NAME);
    for spread in [0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 9.0] {
        let rays = scattered::<L>(spread, RAYS / 4);
        let [packet, single] = [true, false].map(|as_packet| speed(mesh, &rays, Some(as_packet)));
        print!("  {spread}: {packet:.2} {single:.2}");
    }
    println!();
}

fn main() {
    let short = std::env::args().any(|a| a == "--short");
    let mut single = Vec::new();
    for (rings, sides) in [(16, 34), (132, 266), (500, 1001)] {
        let triangles = ball(rings, sides);
        let clock = Instant::now();
        let begin = common::seconds(clock);
        let mesh = Mesh::new(triangles);
        let count = mesh.mesh.triangles.len();
        println!(
            "{count} triangles: BVH in {:.3} s, {:.1} bytes a triangle, depth {}",
            common::seconds(clock) - begin,
            mesh.bytes() as f64 / count as f64,
            mesh.boxes.depth
        );
        single.push(rays::<Single>(&mesh));
        rays::<Double>(&mesh);
        if !short {
            packet_or_single::<Single>(&mesh);
            packet_or_single::<Double>(&mesh);
        }
    }
    let ratio = |k: usize| single[0][k] / single[2][k];
    println!(
        "time per ray, most triangles over fewest: camera {:.2}, random {:.2}",
        ratio(0),
        ratio(1)
    );
}
