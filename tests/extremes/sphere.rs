//! Spheres seen from afar, from inside, as ground, and at the limb.

use crate::harness::*;
use zerkalo_scene::camera::CompiledCamera;

/// Unevaluated sum of two doubles, with about 106 bits (Dekker 1971, Knuth).
#[derive(Clone, Copy)]
struct Dd(f64, f64);

impl Dd {
    fn sum(a: f64, b: f64) -> Self {
        let s = a + b;
        let c = s - a;
        Self(s, (a - (s - c)) + (b - c))
    }
    fn product(a: f64, b: f64) -> Self {
        let p = a * b;
        Self(p, a.mul_add(b, -p))
    }
    fn plus(self, o: Self) -> Self {
        let s = Self::sum(self.0, o.0);
        Self::sum(s.0, s.1 + self.1 + o.1)
    }
    fn minus(self, o: Self) -> Self {
        self.plus(Self(-o.0, -o.1))
    }
    fn times(self, o: Self) -> Self {
        let p = Self::product(self.0, o.0);
        Self::sum(p.0, p.1 + self.0 * o.1 + self.1 * o.0)
    }
    fn over(self, o: Self) -> Self {
        let q = self.0 / o.0;
        let rest = self.minus(o.times(Self(q, 0.0)));
        Self::sum(q, rest.0 / o.0)
    }
}

fn dot(a: [Dd; 3], b: [Dd; 3]) -> Dd {
    a[0].times(b[0]).plus(a[1].times(b[1])).plus(a[2].times(b[2]))
}

/// Returns two values, computed with twice the digits of double precision: the distance of the line
/// from the sphere's centre minus the radius, which is positive for a miss, and the nearer hit
/// point relative to the centre. The hit point is not finite for a miss.
fn exact((origin, d): Line, center: DVec3, radius: f64) -> (f64, DVec3) {
    let f: [Dd; 3] = std::array::from_fn(|i| Dd::sum(origin[i], -center[i]));
    let d: [Dd; 3] = std::array::from_fn(|i| Dd(d[i], 0.0));
    let steps = dot(f, d).over(dot(d, d));
    let across: [Dd; 3] = std::array::from_fn(|i| f[i].minus(d[i].times(steps)));
    let across2 = dot(across, across);
    let rest = Dd::product(radius, radius).minus(across2).0;
    let back = rest.sqrt() / dot(d, d).0.sqrt();
    let point = std::array::from_fn(|i| across[i].0 - d[i].0 * back);
    (across2.0.sqrt() - radius, DVec3::from_array(point))
}

/// Checks rays that start at the distance `far` from a unit sphere. They are aimed at points within
/// 0.7 of its centre and at points near its limb. Returns the largest distance of a hit point from
/// the surface.
fn check_far<L: SimdFloat>(far: f64, seed: u64) -> f64 {
    let mut worst = 0f64;
    let mut numbers = Numbers::new(seed);
    let rounded = |v: DVec3| if L::EPSILON > 1e-10 { v.as_vec3().as_dvec3() } else { v };
    // The direction of the ray is rounded to the type's precision. The rounding grows with the
    // distance.
    let tolerance = 4.0 * L::EPSILON * far.max(1.0);
    for _ in 0..20 {
        let center = rounded(numbers.in_cube(1.0));
        let form = Form::Sphere(SphereForm { center, radius: 1.0 });
        let geometry = Aggregate::<L>::new(&[form]);
        let lines: Vec<Line> = (0..5000)
            .map(|i| {
                let eye = rounded(numbers.direction() * far);
                let toward = (center - eye).normalize();
                let (u, v) = toward.any_orthonormal_pair();
                let (sin, cos) = (2.0 * PI * numbers.unit()).sin_cos();
                let reach = if i % 2 == 0 {
                    0.7 * numbers.unit().sqrt()
                } else {
                    1.0 + tolerance * numbers.between(-20.0, 20.0)
                };
                let target = center + (u * cos + v * sin) * reach;
                (eye, rounded((target - eye).normalize()))
            })
            .collect();
        for (i, (line, hit)) in lines.iter().zip(closest(&geometry, &lines)).enumerate() {
            let (beyond, true_point) = exact(*line, center, 1.0);
            let context = format!("{}, far {far}, seed {seed}: {line:?}", L::NAME);
            if beyond.abs() > tolerance {
                assert_eq!(hit.is_some(), beyond < 0.0, "{context}: {beyond} beyond the limb");
            }
            let Some(hit) = hit else { continue };
            let from_center = hit.point - center;
            let off = (from_center.length() - 1.0).abs();
            assert!(off <= 8.0 * L::EPSILON, "{context}: {off} off the surface");
            worst = worst.max(off);
            if i % 2 == 0 {
                // Within 0.7 of the radius the surface is inclined by at most 45 degrees.
                let wrong = (from_center - true_point).length();
                assert!(wrong <= 4.0 * tolerance, "{context}: {wrong} from the true point");
            }
        }
    }
    worst
}

#[test]
fn extreme_01_sphere_far_away() {
    let mut worst = 0f64;
    for (i, far) in [1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9].into_iter().enumerate() {
        worst = worst.max(check_far::<Double>(far, 10 + i as u64));
    }
    report(1, "double", &format!("hits right, {worst:.0e} r off at most"));
    // Single precision is tested up to the distance at which its rounding is a thousandth of the
    // radius. `auto` selects double precision at smaller distances already.
    let mut worst = 0f64;
    for (i, far) in [1e2, 1e3, 8192.0].into_iter().enumerate() {
        worst = worst.max(check_far::<Single>(far, 30 + i as u64));
    }
    report(
        1,
        "single",
        &format!("up to 8192: hits right, {worst:.0e} r off at most; beyond {LEFT_TO_DOUBLE}"),
    );
}

#[test]
fn extreme_02_sphere_as_ground() {
    let (radius, height) = (1e9, 1.7);
    let text = |light: &str| {
        format!(
            "[film]\nsize = [64, 480]\n[camera]\neye = [0.0, {height}, 0.0]\n\
             direction = [0.0, 0.0, -1.0]\n[[light]]\ndirectional = {{ direction = {light} }}\n\
             [[object]]\nshape.sphere = {{ center = [0.0, {}, 0.0], radius = {radius} }}\n",
            -radius
        )
    };
    // The horizon is below the horizontal by the angle acos(r / (r + h)), whose tangent is sqrt(h
    // (2 r + h)) / r.
    let dip = (height * (2.0 * radius + height)).sqrt() / radius;
    let plane_height = 2.0 * 20f64.to_radians().tan();
    let row = 240.0 + dip / plane_height * 480.0;
    let ground = Aggregate::<Double>::new(&[Form::Sphere(SphereForm {
        center: DVec3::new(0.0, -radius, 0.0) + DVec3::Y * radius,
        radius,
    })]);
    let eye = DVec3::Y * (radius + height);
    let hits_ground = |row: f64| {
        let d = DVec3::new(0.0, (240.0 - row) / 480.0 * plane_height, -1.0).normalize();
        closest(&ground, &[(eye, d)])[0].is_some()
    };
    let (mut above, mut below) = (230.0, 250.0);
    assert!(!hits_ground(above) && hits_ground(below));
    while below - above > 1e-9 {
        let middle = 0.5 * (above + below);
        if hits_ground(middle) { below = middle } else { above = middle }
    }
    assert!((below - row).abs() < 0.01, "horizon in row {below}, expected {row}");

    for light in ["[0.0, -1.0, 0.0]", "[0.3, -0.2, 0.1]", "[1.0, -0.001, 0.0]"] {
        let scene = parsed(&text(light));
        // `auto` selects double precision, because single precision rounds coordinates of such a
        // ground to about 100 units.
        let auto = AnyWorld::compile(&scene, &Options::default());
        assert!(matches!(auto, AnyWorld::Double(_)));
        let traced = Traced::new(&scene, Precision::Double);
        let view = CompiledCamera::new(&scene.camera, scene.film.size, DVec3::ZERO);
        let pixels: Vec<(u32, u32)> =
            (242..480).flat_map(|y| (0..64).map(move |x| (x, y))).collect();
        let lines: Vec<Line> = pixels
            .iter()
            .map(|at| {
                let Ray { origin: o, direction: d } =
                    view.rays(Vec3::<f64>::splat(view.pixel_corner_direction(*at)), (0.5, 0.5));
                (DVec3::new(o.x, o.y, o.z), DVec3::new(d.x, d.y, d.z))
            })
            .collect();
        let dark = traced.radiance(&lines).iter().filter(|l| l[0] <= 0.0).count();
        assert_eq!(dark, 0, "light {light}: dark points on bare ground");
    }
    report(2, "double", &format!("horizon {:.0e} px off, no dark point", (below - row).abs()));
    report(2, "single", LEFT_TO_DOUBLE);
}

/// Checks rays from the origin through random points of a square in the plane z = -1, around the
/// projection of the sphere. Let c be the centre of the sphere, r its radius and D its distance.
/// The share of rays that hit is pi r^2 sqrt(D^2 - r^2) / (c_z^2 - r^2)^(3/2), divided by the area
/// of the square. A ray in the direction v must hit if (v.c)^2 >= (D^2 - r^2) v^2, and otherwise
/// miss. Returns the measured share, divided by the expected one.
fn check_silhouette(center: DVec3, radius: f64, rays: usize, seed: u64) -> f64 {
    let geometry = Aggregate::<Double>::new(&[Form::Sphere(SphereForm { center, radius })]);
    let distance = center.length();
    let image = DVec3::new(center.x, center.y, 0.0) / -center.z;
    let near = (center.z * center.z - radius * radius).sqrt();
    let half = 1.5 * radius * distance / (near * near) + 0.1 * radius;
    let mut numbers = Numbers::new(seed);
    let lines: Vec<Line> = (0..rays)
        .map(|_| {
            let (x, y) = (numbers.between(-half, half), numbers.between(-half, half));
            let d = DVec3::new(image.x + x, image.y + y, -1.0);
            (DVec3::ZERO, d.normalize())
        })
        .collect();
    let mut hits = 0;
    for (line, hit) in lines.iter().zip(closest(&geometry, &lines)) {
        hits += usize::from(hit.is_some());
        let (beyond, _) = exact(*line, center, radius);
        if beyond.abs() > 8.0 * f64::EPSILON * distance {
            assert_eq!(hit.is_some(), beyond < 0.0, "{line:?}: {beyond} beyond the limb");
        }
    }
    let area = PI * radius * radius * (distance * distance - radius * radius).sqrt() / near.powi(3);
    let share = area / (4.0 * half * half);
    let found = hits as f64 / rays as f64;
    let z = (found - share) / (share * (1.0 - share) / rays as f64).sqrt();
    assert!(
        z.abs() < 4.0,
        "centre {center}, radius {radius}: share {found} not {share}, {z} sigma"
    );
    found / share
}

#[test]
fn extreme_03_tiny_sphere() {
    let center = DVec3::new(0.3, -0.2, -1.0).normalize();
    let ratio = check_silhouette(center, 1e-6, 1_000_000, 3);
    assert!((ratio - 1.0).abs() < 0.01, "silhouette {ratio} of the true one");
    report(3, "double", &format!("{:+.2} %", 100.0 * (ratio - 1.0)));
    report(3, "single", LEFT_TO_DOUBLE);
}

#[test]
fn closed_form_10_silhouettes() {
    for (i, (center, radius)) in [
        (DVec3::new(0.0, 0.0, -5.0), 1.0),
        (DVec3::new(2.0, 1.0, -3.0), 1.0),
        (DVec3::new(-1.0, 4.0, -6.0), 2.5),
        (DVec3::new(0.1, 0.0, -1.0), 0.9),
    ]
    .into_iter()
    .enumerate()
    {
        check_silhouette(center, radius, 200_000, 10 + i as u64);
    }
}

/// Returns the longest chord that rounding can give a tangent of the unit sphere. Rounding moves a
/// line that starts at the distance 8 sideways, by up to 4 x 8 times the rounding error. The
/// returned chord is that of a line at this depth below the surface.
fn longest_touch<L: SimdFloat>() -> f64 {
    2.0 * (2.0 * 32.0 * L::EPSILON).sqrt()
}

/// Checks tangents: each misses, or has a chord no longer than rounding explains.
fn check_tangents<L: SimdFloat>() {
    let mut numbers = Numbers::new(5);
    let (limit, mut longest) = (longest_touch::<L>(), 0f64);
    let geometry =
        Aggregate::<L>::new(&[Form::Sphere(SphereForm { center: DVec3::ZERO, radius: 1.0 })]);
    let signs = |bits: u64| {
        DVec3::new(
            if bits & 1 == 0 { 1.0 } else { -1.0 },
            if bits & 2 == 0 { 1.0 } else { -1.0 },
            if bits & 4 == 0 { 0.0 } else { -0.0 },
        )
    };
    for n in 0..20_000 {
        let (touching, d, ahead) = if n % 2 == 0 {
            // These tangents are exact: they are parallel to one axis and touch the sphere on
            // another axis.
            let s = signs(numbers.bits());
            let (a, b) = (numbers.below(3), 1 + numbers.below(2));
            let (mut o, mut d) = (DVec3::splat(s.z), DVec3::splat(s.z));
            o[a] = s.x;
            d[(a + b) % 3] = s.y;
            (o, d, [0.0, 2.0, 100.0][numbers.below(3)])
        } else {
            let p = numbers.direction();
            let d = p.cross(numbers.direction()).normalize();
            (p, d, numbers.between(0.0, 3.0))
        };
        let line = (touching - d * ahead, d);
        let ends = closest(&geometry, &[line, (touching + d * 8.0, -d)]);
        for hit in ends.iter().flatten() {
            assert!(hit.t.is_finite() && hit.t >= 0.0, "{line:?}: {hit:?}");
            assert!(hit.point.is_finite() && hit.normal.is_finite(), "{line:?}: {hit:?}");
        }
        if let [Some(near), Some(back)] = ends[..] {
            let chord = ahead + 8.0 - near.t - back.t;
            assert!(chord.abs() <= limit, "{line:?}: chord {chord}");
            longest = longest.max(chord);
        }
    }
    report(5, precision::<L>(), &format!("sphere: chords up to {longest:.0e}"));
}

#[test]
fn extreme_05_tangent_to_a_sphere() {
    assert!(longest_touch::<Double>() < 1e-6);
    check_tangents::<Double>();
    // The limit is 5.5e-3 in single precision.
    check_tangents::<Single>();
}
