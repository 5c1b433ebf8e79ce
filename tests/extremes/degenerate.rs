//! Rays that start inside solids or on faces, or run in planes of faces or along axes.

use crate::harness::*;

/// Returns `true` if `form` is a convex solid. Compounds and meshes have tests of their own.
fn is_solid(form: &Form) -> bool {
    form.is_solid() && form.is_convex()
}

/// Returns a point well inside a convex solid.
fn inside(numbers: &mut Numbers, form: &Form) -> DVec3 {
    match form {
        Form::Sphere(SphereForm { center, radius }) => {
            *center + numbers.direction() * (0.99 * radius * numbers.unit().cbrt())
        }
        Form::Ellipsoid(EllipsoidForm { scene_from_unit }) => {
            scene_from_unit.transform_point3(numbers.direction() * (0.99 * numbers.unit().cbrt()))
        }
        Form::ConicalFrustum(ConicalFrustumForm { scene_from_unit, top_radius: top }) => {
            let z = numbers.between(0.01, 0.99);
            let r = 0.99 * (1.0 + (top - 1.0) * z) * numbers.unit().sqrt();
            let (sin, cos) = numbers.between(0.0, std::f64::consts::TAU).sin_cos();
            scene_from_unit.transform_point3(DVec3::new(r * cos, r * sin, z))
        }
        Form::ConvexPolyhedron(ConvexPolyhedronForm { corners, .. }) => {
            let weights: Vec<f64> =
                corners.iter().map(|_| 1e-3 - (1.0 - numbers.unit()).ln()).collect();
            let sum: f64 = weights.iter().sum();
            corners.iter().zip(&weights).map(|(c, w)| *c * (w / sum)).sum()
        }
        _ => unreachable!("not a convex solid"),
    }
}

fn check_inside<L: SimdFloat>(name: &str, form: &Form, seed: u64, rays: usize) {
    let geometry = Aggregate::<L>::new(std::slice::from_ref(form));
    let mut numbers = Numbers::new(seed);
    // Number of rays traced together. It is small because the allocator returns large blocks of
    // memory to the system after each use, which takes time.
    const BLOCK: usize = 500;
    assert_eq!(rays % BLOCK, 0);
    for _ in 0..rays / BLOCK {
        let lines: Vec<Line> =
            (0..BLOCK).map(|_| (inside(&mut numbers, form), numbers.direction())).collect();
        check_rays_from_inside(name, form, &geometry, &lines);
    }
}

fn check_rays_from_inside<L: SimdFloat>(
    name: &str,
    form: &Form,
    geometry: &Aggregate<L>,
    lines: &[Line],
) {
    let (_, radius) = bounding_sphere(form).unwrap();
    let hits = closest(geometry, lines);
    let mut onward = Vec::new();
    for (line, hit) in lines.iter().zip(&hits) {
        let hit = hit.unwrap_or_else(|| panic!("{name}, {}: lost {line:?}", L::NAME));
        assert!(hit.normal.dot(line.1) > 0.0, "{name}, {}: {line:?} {hit:?}", L::NAME);
        // Rays that start behind the exit hit nothing. Reversed rays from there hit the exit first.
        onward.push((line.0 + line.1 * (hit.t + 1e-3 * radius), line.1));
    }
    for (line, hit) in onward.iter().zip(closest(geometry, &onward)) {
        assert!(hit.is_none(), "{name}, {}: behind the exit {line:?} hits {hit:?}", L::NAME);
    }
    assert!(occluded(geometry, &onward, L::MAX).iter().all(|b| !b), "{name}, {}", L::NAME);
    assert!(occluded(geometry, lines, L::MAX).iter().all(|b| *b), "{name}, {}", L::NAME);
    let back: Vec<Line> = onward.iter().map(|(o, d)| (*o, -*d)).collect();
    for ((line, first), exit) in back.iter().zip(closest(geometry, &back)).zip(&hits) {
        let (Some(first), Some(exit)) = (first, exit) else {
            panic!("{name}, {}: lost {line:?}", L::NAME)
        };
        // The hit point moves along the surface by the rounding error divided by the cosine.
        let rounding = 64.0 * L::EPSILON * (radius + line.0.length());
        let apart = (first.point - exit.point).length();
        let grazing = exit.normal.dot(line.1).abs();
        assert!(apart <= rounding / grazing, "{name}, {}: {line:?} {apart}", L::NAME);
    }
}

#[test]
fn extreme_04_camera_inside() {
    check_all_inside(25_000);
}

fn check_all_inside(rays: usize) {
    let solids = forms().iter().filter(|f| is_solid(&f.1)).count();
    for (i, (name, form)) in forms().into_iter().enumerate() {
        if is_solid(&form) {
            check_inside::<Double>(&name, &form, 40 + i as u64, rays);
            check_inside::<Single>(&name, &form, 140 + i as u64, rays);
        }
    }
    assert!(every_kind().iter().any(|k| is_solid(&k.1)));
    report(4, "both", &format!("0 wrong of {rays} rays in each of {solids} solids"));
}

/// Returns the distances at which a line enters and leaves the closed box from -1 to 1. Returns
/// `None` if it misses. Coordinates are exact integers, scaled by `UNIT`. A distance in lengths of
/// `d` is a fraction `(numerator, denominator)` with a positive denominator.
fn slabs(origin: [i64; 3], d: [i64; 3]) -> Option<[(i64, i64); 2]> {
    let less = |a: (i64, i64), b: (i64, i64)| a.0 * b.1 < b.0 * a.1;
    let mut ends: Option<[(i64, i64); 2]> = None;
    for i in 0..3 {
        if d[i] == 0 {
            if origin[i].abs() > UNIT {
                return None;
            }
            continue;
        }
        let s = d[i].signum();
        let pair =
            [((-UNIT * s - origin[i]) * s, d[i].abs()), ((UNIT * s - origin[i]) * s, d[i].abs())];
        ends = Some(match ends {
            None => pair,
            Some([enter, leave]) => [
                if less(enter, pair[0]) { pair[0] } else { enter },
                if less(pair[1], leave) { pair[1] } else { leave },
            ],
        });
    }
    ends.filter(|[enter, leave]| !less(*leave, *enter))
}

/// Number of lattice steps in half a side of the box. Rays start at the points of this lattice.
const UNIT: i64 = 2;

fn check_lattice<L: SimdFloat>() -> [usize; 3] {
    let form = Cuboid { center: [0.0; 3], size: [2.0; 3] }.form();
    let geometry = Aggregate::<L>::new(&[form]);
    let mut counts = [0; 3];
    let places: Vec<i64> = (-3 * UNIT..=3 * UNIT).collect();
    for n in 0..13 * 13 * 13 {
        let origin = [places[n % 13], places[n / 13 % 13], places[n / 169]];
        let mut directions = Vec::new();
        for k in 0..27 * 8 {
            let mut d = [k % 3, k / 3 % 3, k / 9 % 3].map(|x| x as i64 - 1);
            let zeros = [k / 27 % 2, k / 54 % 2, k / 108].map(|b| if b == 0 { 0.0 } else { -0.0 });
            // Directions with unequal components are included.
            d[0] *= 1 + (n % 3) as i64;
            d[2] *= 1 + (n % 4) as i64;
            if d == [0; 3] {
                continue;
            }
            let real = DVec3::from_array(std::array::from_fn(|i| {
                if d[i] == 0 { zeros[i] } else { d[i] as f64 }
            }));
            directions.push((d, real));
        }
        let start = DVec3::from(origin.map(|x| x as f64 / UNIT as f64));
        let lines: Vec<Line> = directions.iter().map(|(_, d)| (start, *d / d.length())).collect();
        let occlusion = occluded(&geometry, &lines, 100.0);
        for (i, hit) in closest(&geometry, &lines).into_iter().enumerate() {
            let ((d, real), line, occluded) = (directions[i], lines[i], occlusion[i]);
            let length = real.length();
            let context = || format!("{}: {line:?}: {hit:?}", L::NAME);
            assert_eq!(hit.is_some(), occluded, "{}", context());
            let t = |f: (i64, i64)| f.0 as f64 / (f.1 * UNIT) as f64 * length;
            let truth = slabs(origin, d).map(|ends| ends.map(t));
            if let Some(hit) = hit {
                assert!(hit.t.is_finite() && hit.point.is_finite(), "{}", context());
                let Some([enter, leave]) = truth else { panic!("no box there: {}", context()) };
                let near = |x: f64| (hit.t - x).abs() <= 8.0 * L::EPSILON * (1.0 + x.abs());
                assert!(near(enter) || near(leave), "{}, not {enter} or {leave}", context());
            }
            let Some([enter, leave]) = truth else {
                counts[0] += 1;
                continue;
            };
            // A line in the plane of a face or through an edge only touches the box. Both a hit and
            // a miss are right.
            let in_face = (0..3).any(|i| d[i] == 0 && origin[i].abs() == UNIT);
            if in_face || leave - enter < 1e-9 {
                counts[1] += 1;
                continue;
            }
            counts[2] += 1;
            // Rays whose origin is on a face may count as starting on either side of it.
            let expected = if enter.abs() < 1e-9 || leave.abs() < 1e-9 {
                continue;
            } else if enter > 0.0 {
                Some(enter)
            } else {
                Some(leave).filter(|t| *t > 0.0)
            };
            match (hit, expected) {
                (None, None) => {}
                (Some(m), Some(t)) => {
                    assert!(
                        (m.t - t).abs() <= 8.0 * L::EPSILON * (1.0 + t),
                        "{} not {t}",
                        context()
                    );
                }
                _ => panic!("expected {expected:?}: {}", context()),
            }
        }
    }
    let ray_count = counts.iter().sum::<usize>();
    report(6, precision::<L>(), &format!("0 wrong of {ray_count} rays"));
    counts
}

#[test]
fn extreme_06_ray_in_a_face() {
    let counts = check_lattice::<Double>();
    assert_eq!(check_lattice::<Single>(), counts);
    assert!(counts.iter().all(|c| *c > 1000), "misses, touches, hits: {counts:?}");
}

fn check_finite<L: SimdFloat>(name: &str, form: &Form, seed: u64) {
    let geometry = Aggregate::<L>::new(std::slice::from_ref(form));
    let mut numbers = Numbers::new(seed);
    let (center, radius) = bounding_sphere(form).unwrap_or((DVec3::ZERO, f64::INFINITY));
    let lines: Vec<Line> = (0..2_000).map(|_| any_line(&mut numbers, form)).collect();
    for (n, (line, hit)) in lines.iter().zip(closest(&geometry, &lines)).enumerate() {
        let Some(hit) = hit else { continue };
        let context = || format!("{name}, {}, ray {n} of seed {seed}: {line:?} {hit:?}", L::NAME);
        assert!(hit.t.is_finite() && hit.t > 0.0, "{}", context());
        assert!((hit.normal.length() - 1.0).abs() < 8.0 * L::EPSILON, "{}", context());
        assert!((hit.point - center).length() <= 1.001 * radius, "{}", context());
    }
}

#[test]
fn extreme_06_degenerate_rays_at_every_kind() {
    for (i, (name, form)) in forms().into_iter().enumerate() {
        check_finite::<Double>(&name, &form, 600 + i as u64);
        check_finite::<Single>(&name, &form, 700 + i as u64);
    }
}

/// Checks rays along an axis that pass beside the bounding box of a shape. They must miss, whatever
/// the signs of the zeros in their direction.
#[test]
fn extreme_06_zeros_of_either_sign_beside_every_solid() {
    for (name, form) in every_kind() {
        let Some((low, high)) = form.bounds() else { continue };
        let size = high - low;
        let mut lines = Vec::new();
        let mut numbers = Numbers::new(61);
        for axis in 0..3 {
            for n in 0..2000 {
                let zero = |bit: i32| if n >> bit & 1 == 0 { 0.0 } else { -0.0 };
                let mut d = DVec3::new(zero(0), zero(1), zero(2));
                d[axis] = if n & 8 == 0 { 1.0 } else { -1.0 };
                // The ray passes beside the box, at most about 0.3 of the size of the box away from
                // it.
                let mut o = low + size * DVec3::new(numbers.unit(), numbers.unit(), numbers.unit());
                let beside = (axis + 1 + (n >> 4 & 1) as usize) % 3;
                let out = numbers.between(1e-3, 0.3) * (size[beside] + 0.1);
                o[beside] = if n & 32 == 0 { low[beside] - out } else { high[beside] + out };
                o[axis] -= d[axis] * 2.0 * (size[axis] + 1.0);
                lines.push((o, d));
            }
        }
        let double = closest(&Aggregate::<Double>::new(std::slice::from_ref(&form)), &lines);
        let single = closest(&Aggregate::<Single>::new(std::slice::from_ref(&form)), &lines);
        for (line, hit) in lines.iter().zip(double).chain(lines.iter().zip(single)) {
            assert!(hit.is_none(), "{name}: {line:?} passes beside, but hits {hit:?}");
        }
    }
}
