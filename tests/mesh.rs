//! Ray/mesh intersection: meshes must be watertight, and hits independent of packets and vector
//! width.

use crate::harness::*;
use zerkalo::asset::Mesh;
use zerkalo::primitive::triangle_mesh;

/// Returns a closed mesh of a ball around the origin, read from OBJ. The triangles at the poles can
/// be a thousand times as long as wide.
fn ball(rings: usize, sides: usize) -> Arc<Mesh> {
    let mut text = String::new();
    for ring in 0..=rings {
        let polar = std::f64::consts::PI * ring as f64 / rings as f64;
        let around_of = |side: usize| std::f64::consts::TAU * side as f64 / sides as f64;
        for around in (0..sides).map(around_of) {
            // Each pole is one point, repeated for every side.
            let across = if ring % rings == 0 { 0.0 } else { polar.sin() };
            let (x, z) = (across * around.cos(), across * around.sin());
            text += &format!("v {x} {} {z}\n", polar.cos());
        }
    }
    let index = |ring: usize, side: usize| ring * sides + side % sides + 1;
    for ring in 0..rings {
        for side in 0..sides {
            let [a, b] = [index(ring, side), index(ring, side + 1)];
            let [c, d] = [index(ring + 1, side), index(ring + 1, side + 1)];
            if ring > 0 {
                text += &format!("f {a} {b} {c}\n");
            }
            if ring + 1 < rings {
                text += &format!("f {b} {d} {c}\n");
            }
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ball.obj");
    std::fs::write(&path, text).unwrap();
    Assets::default().mesh(&path).unwrap()
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|x| x / length)
}

/// Checks that rays from inside a closed mesh towards its corners, edges and triangles all hit the
/// mesh, both in packets and as single rays.
fn check_watertight<L: SimdFloat>(mesh: &Mesh, rays: usize) {
    let mut random = Numbers::new(0x5EED);
    let triangles = &mesh.mesh().triangles;
    let corner = |i: u32| mesh.mesh().positions[i as usize].map(f64::from);
    let limit = L::from_f64(L::MAX);
    for packet in 0..rays / L::WIDTH {
        let origin: [f64; 3] = std::array::from_fn(|_| 0.5 * (random.unit() - 0.5));
        // Half of the packets have their rays close together.
        let near = random.below(triangles.len());
        let directions: Vec<[f64; 3]> = (0..L::WIDTH)
            .map(|_| {
                let one = if packet % 2 == 0 { near } else { random.below(triangles.len()) };
                let [a, b, c] = triangles[one].map(corner);
                let (f, g) = (random.unit(), random.unit());
                let to: [f64; 3] = match packet % 3 {
                    0 => a,
                    1 => std::array::from_fn(|i| a[i] + f * (b[i] - a[i])),
                    _ => std::array::from_fn(|i| a[i] + f * (b[i] - a[i]) + f * g * (c[i] - b[i])),
                };
                unit(std::array::from_fn(|i| to[i] - origin[i]))
            })
            .collect();
        let ray = Ray {
            origin: Vec3::<L>::of(origin),
            direction: Vec3::<L>::from_fn(|i| directions[i].map(L::Scalar::from_f64)),
        };
        let found = triangle_mesh::closest(mesh, &ray, limit);
        let blocked = triangle_mesh::occluded(mesh, &ray, limit);
        let both = [true, false].map(|how| triangle_mesh::closest_with(mesh, &ray, limit, how));
        for (i, direction) in directions.iter().enumerate() {
            let t = found.t.lane(i);
            assert!(t < limit.lane(i), "missed from {origin:?} to {direction:?}");
            assert!(blocked.lane(i), "not blocked from {origin:?} to {direction:?}");
            for other in &both {
                assert_eq!(other.t.lane(i), t, "{origin:?} {direction:?}");
                assert_eq!(other.triangle.id_lane(i), found.triangle.id_lane(i));
            }
            let at: [f64; 3] = std::array::from_fn(|k| origin[k] + t.to_f64() * direction[k]);
            let radius = at.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(radius < 1.0 + 1e-5 && radius > 0.9, "met at {at:?}");
        }
    }
}

/// Checks meshes with large triangles, small ones and slivers, with `factor` times 110,000 rays in
/// total.
fn check_watertight_meshes(factor: usize) {
    let coarse = ball(8, 12);
    check_watertight::<Single>(&coarse, factor * 25_000);
    check_watertight::<Double>(&coarse, factor * 4_000);
    check_watertight::<f32>(&coarse, factor * 2_000);
    let fine = ball(60, 120);
    check_watertight::<Single>(&fine, factor * 50_000);
    check_watertight::<Double>(&fine, factor * 4_000);
    check_watertight::<Single>(&ball(12, 4_000), factor * 25_000);
}

#[test]
fn closed_mesh_is_watertight() {
    check_watertight_meshes(1);
}

#[test]
#[ignore = "long: 1.3 million rays"]
fn closed_mesh_is_watertight_for_many_rays() {
    check_watertight_meshes(12);
}

#[test]
fn mesh_bvh_finds_same_hits_as_list() {
    let mesh = ball(12, 20);
    let mut random = Numbers::new(77);
    for _ in 0..2_000 {
        let origin: [f64; 3] = std::array::from_fn(|_| 4.0 * (random.unit() - 0.5));
        let direction = unit(std::array::from_fn(|_| random.unit() - 0.5));
        let ray = Ray { origin: Vec3::<f64>::of(origin), direction: Vec3::<f64>::of(direction) };
        let found = triangle_mesh::closest(&mesh, &ray, f64::MAX);
        // Möller-Trumbore intersection with every triangle.
        let mut best = f64::MAX;
        for t in &mesh.mesh().triangles {
            let p = t.map(|i| glam::DVec3::from(mesh.mesh().positions[i as usize].map(f64::from)));
            let (o, d) = (glam::DVec3::from(origin), glam::DVec3::from(direction));
            let (a, b) = (p[1] - p[0], p[2] - p[0]);
            let s = d.cross(b) / d.cross(b).dot(a);
            let u = s.dot(o - p[0]);
            let q = (o - p[0]).cross(a) / d.cross(b).dot(a);
            let v = q.dot(d);
            let t = q.dot(b);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 {
                best = best.min(t);
            }
        }
        let same = found.t == best || (found.t - best).abs() < 1e-9 * best;
        assert!(same, "{origin:?} {direction:?}: {} and {best}", found.t);
    }
}
