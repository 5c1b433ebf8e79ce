//! Chords of isotropic uniform lines, for every registered kind of shape. Let a convex body with
//! the surface area S and the volume V be inside another one with the surface area S'. Of the lines
//! that hit the outer body, the share S / S' hits the inner body, with the mean chord 4 V / S
//! (Cauchy, Crofton).

use crate::harness::*;
use zerkalo_kernel::primitive::{HalfSpace, ParallelogramForm};
use zerkalo_scene::shape::{Prism, Pyramid};

/// Returns the area of one face of a polyhedron. The corners on the face are sorted around their
/// mean.
fn face_area(face: &HalfSpace, corners: &[DVec3], size: f64) -> f64 {
    let near = |c: &&DVec3| (face.normal.dot(**c) - face.offset).abs() < 1e-12 * size;
    let mut on: Vec<DVec3> = corners.iter().filter(near).copied().collect();
    let middle = on.iter().sum::<DVec3>() / on.len() as f64;
    let u = (on[0] - middle).normalize();
    let v = face.normal.cross(u);
    let angle = |c: &DVec3| (*c - middle).dot(v).atan2((*c - middle).dot(u));
    on.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    let wedges = (0..on.len()).map(|i| (on[i] - middle).cross(on[(i + 1) % on.len()] - middle));
    0.5 * wedges.sum::<DVec3>().length()
}

/// Returns the surface area of the image of the unit sphere under `m`: the integral of |cofactor(m)
/// n| over all directions n.
fn ellipsoid_surface(m: DMat3) -> f64 {
    let cofactor = m.inverse().transpose() * m.determinant().abs();
    let (rows, columns) = (2000, 400);
    let mut sum = 0.0;
    for row in 0..rows {
        let z = (f64::from(row) + 0.5) / f64::from(rows) * 2.0 - 1.0;
        let r = (1.0 - z * z).sqrt();
        for column in 0..columns {
            let (sin, cos) = (f64::from(column) / f64::from(columns) * TAU).sin_cos();
            sum += (cofactor * DVec3::new(r * cos, r * sin, z)).length();
        }
    }
    sum * 4.0 * PI / f64::from(rows * columns)
}

/// Returns surface area and volume of the image under `m` of a tapered cylinder with height 1 and
/// the radii 1 and `top`.
fn tapered(m: DMat3, top: f64) -> (f64, f64) {
    let volume = m.determinant().abs() * PI * (1.0 + top + top * top) / 3.0;
    let disc = PI * m.x_axis.cross(m.y_axis).length();
    // Side: u is the angle, z runs along the axis.
    let (rings, steps) = (400, 2000);
    let mut side = 0.0;
    for ring in 0..rings {
        let r = 1.0 + (top - 1.0) * (f64::from(ring) + 0.5) / f64::from(rings);
        for step in 0..steps {
            let (sin, cos) = (f64::from(step) / f64::from(steps) * TAU).sin_cos();
            let around = m * DVec3::new(-sin, cos, 0.0) * r;
            let along = m * DVec3::new((top - 1.0) * cos, (top - 1.0) * sin, 1.0);
            side += around.cross(along).length();
        }
    }
    side *= TAU / f64::from(rings * steps);
    (disc * (1.0 + top * top) + side, volume)
}

/// Returns surface area (both sides of flat shapes) and volume; `None` if the form is infinite or
/// not convex.
fn surface_and_volume(form: &Form) -> Option<(f64, f64)> {
    match form {
        Form::Sphere(SphereForm { radius: r, .. }) => {
            Some((4.0 * PI * r * r, 4.0 / 3.0 * PI * r.powi(3)))
        }
        Form::Ellipsoid(EllipsoidForm { scene_from_unit: m }) => {
            let volume = 4.0 / 3.0 * PI * m.matrix3.determinant().abs();
            Some((ellipsoid_surface(m.matrix3), volume))
        }
        Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, corners }) => {
            let inside = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let size = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
            let mut sums = (0.0, 0.0);
            for face in faces {
                let area = face_area(face, corners, size);
                sums.0 += area;
                sums.1 += area * (face.offset - face.normal.dot(inside)) / 3.0;
            }
            Some(sums)
        }
        Form::ConicalFrustum(ConicalFrustumForm { scene_from_unit: m, top_radius: top }) => {
            Some(tapered(m.matrix3, *top))
        }
        // Not convex: `compound.rs` checks their chords.
        Form::Csg(_) => None,
        // Not convex in general.
        Form::Mesh(_) => None,
        Form::Parallelogram(ParallelogramForm { u, v, .. }) => {
            Some((2.0 * u.cross(*v).length(), 0.0))
        }
        Form::Plane(_) => None,
        // Not convex: `tests/geometry/torus.rs` checks them.
        Form::Torus(_) => None,
    }
}

/// Counts and sums of lines, of their hits and of their chords.
#[derive(Default)]
struct Tally {
    lines: f64,
    hits: f64,
    chord: f64,
    chord2: f64,
    /// Number of lines whose hits from both ends contradict each other.
    inconsistent: usize,
}

impl Tally {
    /// Adds lines, each given by its middle and direction. Each is traced from both of its ends, at
    /// distance `far` from the middle. If `flat` is `true`, the normals at the hits are not
    /// checked.
    fn add<L: SimdFloat>(&mut self, geometry: &Aggregate<L>, lines: &[Line], far: f64, flat: bool) {
        let ends = |sign: f64| -> Vec<Line> {
            lines.iter().map(|(p, d)| (*p - *d * (sign * far), *d * sign)).collect()
        };
        let (forward, backward) = (closest(geometry, &ends(1.0)), closest(geometry, &ends(-1.0)));
        self.lines += lines.len() as f64;
        for ((line, a), b) in lines.iter().zip(forward).zip(backward) {
            let (Some(a), Some(b)) = (a, b) else {
                self.inconsistent += usize::from(a.is_some() || b.is_some());
                continue;
            };
            let chord = 2.0 * far - a.t - b.t;
            self.hits += 1.0;
            self.chord += chord;
            self.chord2 += chord * chord;
            if !flat {
                let proper = chord >= -16.0 * L::EPSILON * far
                    && a.normal.dot(line.1) < 0.0
                    && b.normal.dot(line.1) > 0.0;
                self.inconsistent += usize::from(!proper);
            }
        }
    }

    /// Checks that the fraction of hits among the lines is `share`, and that the mean chord is
    /// `mean_chord`. Returns the larger of the two deviations, each in standard deviations.
    fn check(&self, name: &str, share: f64, mean_chord: f64) -> f64 {
        let found = self.hits / self.lines;
        let sigma = (share * (1.0 - share) / self.lines).sqrt();
        let share_deviation = (found - share) / sigma;
        let z = share_deviation;
        assert!(z.abs() < 4.0, "{name}: share {found}, expected {share}: {z} sigma");
        let mean = self.chord / self.hits;
        let variance = self.chord2 / self.hits - mean * mean;
        let z = (mean - mean_chord) / (variance / self.hits).sqrt().max(1e-14);
        assert!(z.abs() < 4.0, "{name}: chord {mean}, expected {mean_chord}: {z} sigma");
        z.abs().max(share_deviation.abs())
    }
}

/// Returns a random line through a ball, with a uniform direction, and through a uniform point of
/// the disc that contains the centre and is perpendicular to the direction.
fn through_ball(numbers: &mut Numbers, center: DVec3, radius: f64) -> Line {
    let d = numbers.direction();
    let (u, v) = d.any_orthonormal_pair();
    let (sin, cos) = (TAU * numbers.unit()).sin_cos();
    (center + (u * cos + v * sin) * (radius * numbers.unit().sqrt()), d)
}

/// Returns a random line through a box, from a uniform point of its surface, inwards with a cosine
/// distribution.
fn through_box(numbers: &mut Numbers, center: DVec3, half: DVec3) -> Line {
    let areas = [half.y * half.z, half.z * half.x, half.x * half.y];
    let mut pick = numbers.unit() * areas.iter().sum::<f64>();
    let axis = areas.iter().position(|a| {
        pick -= a;
        pick < 0.0
    });
    let axis = axis.unwrap_or(2);
    let sign = if numbers.bits() & 1 == 0 { 1.0 } else { -1.0 };
    let mut p = DVec3::new(
        numbers.between(-1.0, 1.0),
        numbers.between(-1.0, 1.0),
        numbers.between(-1.0, 1.0),
    );
    p[axis] = sign;
    let sin = numbers.unit().sqrt();
    let (a, b) = (TAU * numbers.unit()).sin_cos();
    let mut d = DVec3::ZERO;
    d[axis] = -sign * (1.0 - sin * sin).sqrt();
    d[(axis + 1) % 3] = sin * a;
    d[(axis + 2) % 3] = sin * b;
    (center + p * half, d.normalize())
}

/// Number of lines through each shape in the tests that always run.
const LINES: usize = 1 << 18;
/// Number of lines traced together. It is small because the allocator returns large blocks of
/// memory to the system after each use, which takes time.
const BLOCK: usize = 1 << 9;

fn tally<L: SimdFloat>(
    form: &Form,
    far: f64,
    seed: u64,
    lines: usize,
    mut line: impl FnMut(&mut Numbers) -> Line,
) -> Tally {
    let geometry = Aggregate::<L>::new(std::slice::from_ref(form));
    let flat = matches!(form, Form::Parallelogram(_));
    let mut numbers = Numbers::new(seed);
    let mut tally = Tally::default();
    for _ in 0..lines.div_ceil(BLOCK) {
        let block: Vec<Line> = (0..BLOCK).map(|_| line(&mut numbers)).collect();
        tally.add(&geometry, &block, far, flat);
    }
    tally
}

#[test]
fn extreme_07_cauchy() {
    check_cauchy(LINES);
}

#[test]
#[ignore = "a million lines: cargo test --release --test engine extremes:: -- --ignored"]
fn extreme_07_cauchy_at_length() {
    check_cauchy(4 * LINES);
}

/// Checks the laws of Cauchy and Crofton on all kinds of convex shapes: the share of lines that hit
/// a shape, and the mean length of chords.
fn check_cauchy(lines: usize) {
    let mut worst = [0f64; 2];
    let mut inconsistent = 0;
    for (i, (name, form)) in every_kind().into_iter().enumerate() {
        let (Some((center, radius)), Some((surface, volume))) =
            (bounding_sphere(&form), surface_and_volume(&form))
        else {
            continue;
        };
        let share = surface / (4.0 * PI * radius * radius);
        let chord = 4.0 * volume / surface;
        let double = tally::<Double>(&form, 2.0 * radius, 80 + i as u64, lines, |n| {
            through_ball(n, center, radius)
        });
        worst[0] = worst[0].max(double.check(name, share, chord));
        assert_eq!(double.inconsistent, 0, "{name}: both ends of a line must agree");
        let single = tally::<Single>(&form, 2.0 * radius, 180 + i as u64, lines, |n| {
            through_ball(n, center, radius)
        });
        worst[1] = worst[1].max(single.check(name, share, chord));
        inconsistent += single.inconsistent;
        // A line that passes an edge within rounding may hit from one end only, or have its hit
        // point on the adjacent face. The share of such lines is about the rounding error.
        let limit = 100.0 * f64::from(f32::EPSILON) * single.lines;
        assert!(
            single.inconsistent as f64 <= limit,
            "{name}: {} lines of {lines}",
            single.inconsistent
        );
    }
    report(7, "double", &format!("{:.1} sigma at most, 0 lines out of order", worst[0]));
    report(
        7,
        "single",
        &format!("{:.1} sigma at most, {inconsistent} lines out of order", worst[1]),
    );
}

#[test]
fn cauchy_for_ellipsoids_and_skewed_solids() {
    let map = glam::DAffine3::from_mat3_translation(
        DMat3::from_cols(
            DVec3::new(1.5, 0.2, -0.1),
            DVec3::new(0.3, 0.4, 0.2),
            DVec3::new(-0.5, 0.1, 0.8),
        ),
        DVec3::new(2.0, -1.0, 3.0),
    );
    for (i, (name, form)) in every_kind().into_iter().enumerate() {
        let form = form.transformed(&map);
        let (Some((low, high)), Some((surface, volume))) =
            (form.bounds(), surface_and_volume(&form))
        else {
            continue;
        };
        let half = 0.6 * (high - low);
        let outer = 8.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
        let found = tally::<Double>(&form, 4.0 * half.length(), 280 + i as u64, LINES / 2, |n| {
            through_box(n, 0.5 * (low + high), half)
        });
        found.check(name, surface / outer, 4.0 * volume / surface);
        assert_eq!(found.inconsistent, 0, "{name}");
    }
}

#[test]
fn infinite_plane_is_hit_by_one_half_of_every_line() {
    let mut planes = 0;
    for (name, form) in every_kind() {
        let Form::Plane(PlaneForm { normal, offset }) = form else { continue };
        planes += 1;
        let geometry = Aggregate::<Double>::new(std::slice::from_ref(&form));
        let mut numbers = Numbers::new(8);
        for _ in 0..50_000 {
            let (p, d) = (numbers.in_cube(10.0), numbers.direction());
            let ends = closest(&geometry, &[(p, d), (p, -d)]);
            let t = (offset - normal.dot(p)) / normal.dot(d);
            let (hit, miss) = if t > 0.0 { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
            assert!(miss.is_none(), "{name}: {p} {d}");
            let hit = hit.unwrap_or_else(|| panic!("{name}: {p} {d}"));
            assert!((hit.t - t.abs()).abs() <= 1e-14 * t.abs(), "{name}: {} {t}", hit.t);
        }
    }
    let bounded = every_kind().iter().filter(|k| k.1.bounds().is_some()).count();
    assert_eq!(bounded + planes, every_kind().len(), "every kind has a law");
}

/// Returns boxes, prisms and pyramids, some of whose edges are a million times as short as others.
fn slivers() -> Vec<(&'static str, Form)> {
    let thin = 1e-6;
    let corner = [-0.5, -0.5, 0.5];
    let pyramid = |side, apex_height, height| {
        Pyramid { corner, side, apex_height, height, rotation: 17.0 }.form()
    };
    vec![
        ("plate", Cuboid { center: [0.1, 0.2, 0.3], size: [1.0, thin, 0.7] }.form()),
        ("needle", Cuboid { center: [0.1, 0.2, 0.3], size: [thin, 1.0, thin] }.form()),
        ("blade", Cuboid { center: [0.1, 0.2, 0.3], size: [thin, 1.0, 1e-3] }.form()),
        ("tall prism", Prism { corner, side: thin, height: 1.0, rotation: 0.0 }.form()),
        ("flat prism", Prism { corner, side: 1.0, height: thin, rotation: 31.0 }.form()),
        ("tall pyramid", pyramid(thin, 1.0, 1.0)),
        ("flat pyramid", pyramid(1.0, thin, thin)),
        ("pyramid with a tiny top", pyramid(1.0, 1.0, 1.0 - thin)),
        ("pyramid cut near its base", pyramid(1.0, 1.0, thin)),
    ]
}

#[test]
fn extreme_13_slivers() {
    check_slivers(LINES);
}

#[test]
#[ignore = "a million lines: cargo test --release --test engine extremes:: -- --ignored"]
fn extreme_13_slivers_at_length() {
    check_slivers(4 * LINES);
}

fn check_slivers(lines: usize) {
    let mut worst = 0f64;
    for (i, (name, form)) in slivers().into_iter().enumerate() {
        let (low, high) = form.bounds().unwrap();
        let (surface, volume) = surface_and_volume(&form).unwrap();
        let half = 0.55 * (high - low);
        let outer = 8.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
        let found = tally::<Double>(&form, 4.0, 1300 + i as u64, lines, |n| {
            through_box(n, 0.5 * (low + high), half)
        });
        worst = worst.max(found.check(name, surface / outer, 4.0 * volume / surface));
        // All lines enter and leave consistently. Hit points are rounded by 1e-16 times the
        // distance of 4 units, which is about 1e-9 of the thin side.
        assert_eq!(
            found.inconsistent, 0,
            "{name}: {} of {} lines",
            found.inconsistent, found.lines
        );
    }
    report(13, "double", &format!("{worst:.1} sigma at most, 0 lines out of order"));
    report(13, "single", LEFT_TO_DOUBLE);
}
