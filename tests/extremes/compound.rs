//! Compound solids: volumes, parity of surfaces along a line, laws of set operations.

use crate::harness::*;
use zerkalo_kernel::primitive::{CsgSolid, CsgTree as Tree, TorusForm};

pub fn ball(x: f64, y: f64, z: f64, radius: f64) -> Form {
    Form::Sphere(SphereForm { center: DVec3::new(x, y, z), radius })
}

pub fn block(center: [f64; 3], size: [f64; 3]) -> Form {
    Cuboid { center, size }.form()
}

pub fn torus(ring: f64, tube: f64) -> Form {
    TorusForm { scene_from_torus: DAffine3::IDENTITY, ring, tube }.into()
}

fn joined(join: fn(Vec<Tree>) -> Tree, parts: Vec<Form>) -> Form {
    let tree = join((0..parts.len()).map(Tree::Part).collect());
    CsgSolid::new(parts, tree).unwrap().into()
}

pub fn union(parts: Vec<Form>) -> Form {
    joined(Tree::Union, parts)
}

pub fn intersection(parts: Vec<Form>) -> Form {
    joined(Tree::Intersection, parts)
}

pub fn difference(parts: Vec<Form>) -> Form {
    joined(Tree::Difference, parts)
}

pub fn geometry<L: SimdFloat>(form: &Form) -> Aggregate<L> {
    Aggregate::new(std::slice::from_ref(form))
}

/// Returns a line in a random direction through a random point near the origin. The line starts 6
/// units before this point.
fn line(numbers: &mut Numbers) -> Line {
    let d = numbers.direction();
    (numbers.in_cube(1.5) - d * 6.0, d)
}

pub fn lines(seed: u64, count: usize) -> Vec<Line> {
    let mut numbers = Numbers::new(seed);
    (0..count).map(|_| line(&mut numbers)).collect()
}

/// Returns all hits along each line. They are found one after another: each ray starts at the
/// previous hit.
fn surfaces<L: SimdFloat>(geometry: &Aggregate<L>, lines: &[Line]) -> Vec<Vec<LineHit>> {
    let mut out = vec![Vec::new(); lines.len()];
    let mut open: Vec<(usize, f64)> = (0..lines.len()).map(|i| (i, 0.0)).collect();
    while !open.is_empty() {
        let starts: Vec<Line> =
            open.iter().map(|(i, t)| (lines[*i].0 + lines[*i].1 * *t, lines[*i].1)).collect();
        let mut next = Vec::new();
        for ((i, t), hit) in open.iter().zip(closest(geometry, &starts)) {
            let Some(hit) = hit else { continue };
            let t = t + hit.t;
            out[*i].push(LineHit { t, ..hit });
            // The next ray starts past the surface by more than the rounding error of the hit, even
            // at grazing incidence.
            let cosine = hit.normal.dot(lines[*i].1).abs().max(1e-7);
            next.push((*i, t + 64.0 * L::EPSILON * 8.0 / cosine));
            assert!(out[*i].len() < 200, "{:?} has no end", lines[*i]);
        }
        open = next;
    }
    out
}

/// Returns the length of a line inside a solid, from the hits of the line. Checks that the line
/// enters and leaves the solid alternately at these hits.
fn chord(name: &str, line: &Line, hits: &[LineHit]) -> f64 {
    let context = || format!("{name}: {line:?} {hits:?}");
    assert!(hits.len().is_multiple_of(2), "odd: {}", context());
    for (i, hit) in hits.iter().enumerate() {
        let cosine = hit.normal.dot(line.1);
        assert!(if i % 2 == 0 { cosine < 0.0 } else { cosine > 0.0 }, "{}", context());
    }
    hits.chunks(2).map(|pair| pair[1].t - pair[0].t).sum()
}

pub fn chords<L: SimdFloat>(name: &str, form: &Form, lines: &[Line]) -> Vec<f64> {
    let all = surfaces(&geometry::<L>(form), lines);
    lines.iter().zip(all).map(|(line, hits)| chord(name, line, &hits)).collect()
}

fn random_solid(numbers: &mut Numbers) -> Form {
    let place = numbers.in_cube(0.8);
    let size = numbers.between(0.3, 1.2);
    let form = match numbers.below(6) {
        0 => return Form::Sphere(SphereForm { center: place, radius: size }),
        1 => block([0.0; 3], [1.3, 0.9, 1.1]),
        2 => Form::conical_frustum(DAffine3::IDENTITY, numbers.between(0.0, 2.0)),
        3 => ball(0.0, 0.0, 0.0, 1.0),
        4 => torus(1.0, 0.4),
        _ => Form::conical_frustum(DAffine3::IDENTITY, [0.0, 1.0][numbers.below(2)]),
    };
    let turn = DQuat::from_axis_angle(numbers.direction(), numbers.between(0.0, 3.0));
    let scale = size * DVec3::new(1.0, numbers.between(0.5, 1.5), numbers.between(0.5, 1.5));
    form.transformed(&DAffine3::from_scale_rotation_translation(scale, turn, place))
}

/// Returns a random tree of set operations with at most `depth` levels. Some parts occur twice, so
/// that faces coincide.
fn random_tree(numbers: &mut Numbers, depth: usize, parts: &mut Vec<Form>) -> Tree {
    if depth == 0 || numbers.below(6) == 0 {
        let part = match numbers.below(4) {
            0 if !parts.is_empty() => parts[numbers.below(parts.len())].clone(),
            _ => random_solid(numbers),
        };
        parts.push(part);
        return Tree::Part(parts.len() - 1);
    }
    let count = 2 + usize::from(numbers.below(4) == 0);
    let list = (0..count).map(|_| random_tree(numbers, depth - 1, parts)).collect();
    match numbers.below(3) {
        0 => Tree::Union(list),
        1 => Tree::Intersection(list),
        _ => Tree::Difference(list),
    }
}

fn contains(part: &Form, p: DVec3) -> bool {
    match part {
        Form::Sphere(SphereForm { center, radius }) => p.distance(*center) <= *radius,
        Form::Ellipsoid(EllipsoidForm { scene_from_unit }) => {
            scene_from_unit.inverse().transform_point3(p).length() <= 1.0
        }
        Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, .. }) => {
            faces.iter().all(|f| f.normal.dot(p) <= f.offset)
        }
        Form::ConicalFrustum(ConicalFrustumForm { scene_from_unit, top_radius: top }) => {
            let q = scene_from_unit.inverse().transform_point3(p);
            (0.0..=1.0).contains(&q.z) && q.truncate().length() <= 1.0 + (top - 1.0) * q.z
        }
        Form::Plane(PlaneForm { normal, offset }) => normal.dot(p) <= *offset,
        Form::Torus(TorusForm { scene_from_torus, ring, tube }) => {
            let q = scene_from_torus.inverse().transform_point3(p);
            (q.x.hypot(q.z) - ring).hypot(q.y) <= *tube
        }
        _ => unreachable!("no solid"),
    }
}

fn tree_contains(tree: &Tree, parts: &[Form], p: DVec3) -> bool {
    let inside = |t: &Tree| tree_contains(t, parts, p);
    match tree {
        Tree::Part(i) => contains(&parts[*i], p),
        Tree::Union(list) => list.iter().any(inside),
        Tree::Intersection(list) => list.iter().all(inside),
        Tree::Difference(list) => inside(&list[0]) && !list[1..].iter().any(inside),
    }
}

/// Checks random trees of set operations with at most 8 levels. Rays must enter and leave the solid
/// alternately. A point between two hits must be inside or outside of the solid, as the set
/// operations on the parts say. Fifty thousand rays are traced in each precision.
#[test]
fn extreme_08_parity() {
    check_parity(500);
}

#[test]
#[ignore = "a million rays each: cargo test --release --test engine extremes:: -- --ignored"]
fn extreme_08_parity_at_length() {
    check_parity(10_000);
}

/// Checks 100 random trees of set operations, with `rays` rays from outside and `rays` rays from
/// random points for each.
fn check_parity(rays: usize) {
    let (mut seen, mut odd, mut line_count) = (0, 0, 0);
    for seed in 0..100 {
        let mut numbers = Numbers::new(800 + seed);
        let mut parts = Vec::new();
        let tree = random_tree(&mut numbers, 1 + (seed as usize) % 8, &mut parts);
        let form: Form = CsgSolid::new(parts.clone(), tree.clone()).unwrap().into();
        if form.bounds().is_none() {
            continue;
        }
        let double = geometry::<Double>(&form);
        let lines: Vec<Line> = (0..rays).map(|_| line(&mut numbers)).collect();
        let all = surfaces(&double, &lines);
        let single = surfaces(&geometry::<Single>(&form), &lines);
        odd += lines.iter().zip(&single).filter(|(line, hits)| !alternates(line, hits)).count();
        line_count += lines.len();
        let name = format!("tree {seed}");
        for (line, hits) in lines.iter().zip(&all) {
            chord(&name, line, hits);
            seen += hits.len();
            let mut ends = vec![0.0];
            ends.extend(hits.iter().map(|m| m.t));
            ends.push(ends[ends.len() - 1] + 1.0);
            for (n, gap) in ends.windows(2).enumerate() {
                if gap[1] - gap[0] < 1e-6 {
                    continue;
                }
                let t = gap[0] + numbers.between(0.01, 0.99) * (gap[1] - gap[0]);
                let inside = tree_contains(&tree, &parts, line.0 + line.1 * t);
                // Slivers of the solid that are thinner than the tie tolerance are lost. A random
                // point is almost never in such a sliver.
                assert_eq!(inside, n % 2 == 1, "{name}: {line:?} at {t} of {ends:?}");
            }
        }
        // Rays that start inside the solid, in its cavities or outside of it. If the first hit is
        // on the inner side of a surface, the origin is inside.
        let starts: Vec<Line> =
            (0..rays).map(|_| (numbers.in_cube(1.5), numbers.direction())).collect();
        for (line, hit) in starts.iter().zip(closest(&double, &starts)) {
            let inside = tree_contains(&tree, &parts, line.0);
            let context = || format!("{name}: {line:?} {hit:?}");
            match hit {
                Some(hit) => assert_eq!(hit.normal.dot(line.1) > 0.0, inside, "{}", context()),
                None => assert!(!inside, "{}", context()),
            }
        }
    }
    assert!(seen > 30 * rays, "{seen} surfaces");
    // Single precision loses parts of the solid that are thinner than 2e-5. About the share 2e-5 of
    // the lines here hits such a part.
    assert!(
        odd * 10_000 <= line_count,
        "single precision: {odd} of {line_count} lines out of turn"
    );
    report(8, "double", &format!("0 of {line_count} lines out of turn"));
    report(8, "single", &format!("{odd} of {line_count} lines out of turn"));
}

/// Returns `true` if the ray `line` enters and leaves a solid alternately at the hits `hits`.
fn alternates(line: &Line, hits: &[LineHit]) -> bool {
    let right_side = |(i, m): (usize, &LineHit)| (m.normal.dot(line.1) < 0.0) == (i % 2 == 0);
    hits.len().is_multiple_of(2) && hits.iter().enumerate().all(right_side)
}

/// Returns the number of lines on which the surfaces of two forms differ in single precision. They
/// differ if their numbers of hits are unequal, or if the distances t of two hits differ by more
/// than 1e-5 t, divided by the cosine of the angle of incidence.
fn differing(a: &Form, b: &Form, lines: &[Line]) -> usize {
    let (a, b) = (geometry::<Single>(a), geometry::<Single>(b));
    let apart = |line: &Line, a: &LineHit, b: &LineHit| {
        (a.t - b.t).abs() > 1e-5 * a.t / a.normal.dot(line.1).abs()
    };
    let both = surfaces(&a, lines).into_iter().zip(surfaces(&b, lines));
    let differs = |(line, (a, b)): &(&Line, (Vec<LineHit>, Vec<LineHit>))| {
        a.len() != b.len() || a.iter().zip(b).any(|(a, b)| apart(line, a, b))
    };
    lines.iter().zip(both).filter(differs).count()
}

/// Checks that two forms have the same surfaces along all lines, to 1e-12 of the distance. Lines
/// with a grazing hit are left out. The tie tolerance, within which surfaces count as coincident,
/// is wide there.
fn same_surfaces(name: &str, a: &Form, b: &Form, lines: &[Line]) {
    let (a, b) = (geometry::<Double>(a), geometry::<Double>(b));
    for ((line, a), b) in lines.iter().zip(surfaces(&a, lines)).zip(surfaces(&b, lines)) {
        let flat = |m: &LineHit| m.normal.dot(line.1).abs() < 1e-5;
        if a.iter().chain(&b).any(flat) {
            continue;
        }
        assert_eq!(a.len(), b.len(), "{name}: {line:?}: {a:?} {b:?}");
        for (a, b) in a.iter().zip(&b) {
            assert!((a.t - b.t).abs() <= 1e-12 * a.t, "{name}: {line:?}: {a:?} {b:?}");
            assert!((a.normal - b.normal).length() < 1e-6, "{name}: {line:?}: {a:?} {b:?}");
        }
    }
}

#[test]
fn extreme_09_csg_algebra() {
    let mut most = 0;
    let lines = lines(9, 10_000);
    let mut numbers = Numbers::new(90);
    for n in 0..12 {
        let (a, b) = (random_solid(&mut numbers), random_solid(&mut numbers));
        let (a, b, c) = (|| a.clone(), || b.clone(), random_solid(&mut numbers));
        let named = |what: &str| format!("{what}, pair {n}");
        same_surfaces(&named("A or A = A"), &union(vec![a(), a()]), &a(), &lines);
        same_surfaces(&named("A and A = A"), &intersection(vec![a(), a()]), &a(), &lines);
        let nothing = geometry::<Double>(&difference(vec![a(), a()]));
        assert!(closest(&nothing, &lines).iter().all(Option::is_none), "A - A, pair {n}");
        assert!(occluded(&nothing, &lines, 100.0).iter().all(|b| !b), "A - A, pair {n}");
        // A - B = A and not B, where not B = everything - B.
        let all = block([0.0; 3], [20.0; 3]);
        let not_b = Tree::Difference(vec![Tree::Part(1), Tree::Part(2)]);
        let tree = Tree::Intersection(vec![Tree::Part(0), not_b]);
        let and_not: Form = CsgSolid::new(vec![a(), all, b()], tree).unwrap().into();
        same_surfaces(&named("A - B = A and not B"), &difference(vec![a(), b()]), &and_not, &lines);
        let single = [
            differing(&union(vec![a(), a()]), &a(), &lines),
            differing(&intersection(vec![a(), a()]), &a(), &lines),
            differing(&difference(vec![a(), b()]), &and_not, &lines),
        ];
        most = single.into_iter().fold(most, usize::max);
        let few = single.iter().all(|differ| differ * 10_000 <= lines.len());
        assert!(few, "single precision, pair {n}: {single:?} of {}", lines.len());
        let swapped = (union(vec![a(), b()]), union(vec![b(), a()]));
        same_surfaces(&named("A or B = B or A"), &swapped.0, &swapped.1, &lines);
        // (A - B) - C = A - (B or C)
        let tree = Tree::Difference(vec![
            Tree::Difference(vec![Tree::Part(0), Tree::Part(1)]),
            Tree::Part(2),
        ]);
        let steps: Form = CsgSolid::new(vec![a(), b(), c.clone()], tree).unwrap().into();
        let at_once = difference(vec![a(), b(), c]);
        same_surfaces(&named("(A - B) - C"), &steps, &at_once, &lines);
    }
    report(9, "double", "surfaces the same");
    report(9, "single", &format!("at most {most} of {} lines hit other surfaces", lines.len()));
}
