//! Division of polygons into triangles by ear clipping (Meisters 1975, *Polygons have ears*). An
//! ear is a corner whose triangle, with the corners beside it, lies inside the polygon.

use glam::{DVec2, DVec3};

/// Largest number of comparisons of a corner with an ear, per corner of the polygon. It bounds the
/// time in proportion to the length of the file. Polygons of up to this many corners never need
/// more.
const TESTS_PER_CORNER: usize = 2000;

/// Largest number of corners of a polygon that is divided. It bounds the memory.
pub const MAX_CORNERS: usize = 1 << 20;

/// Triangles of a polygon, as indices of its corners.
pub struct Division {
    pub triangles: Vec<[usize; 3]>,
    /// `false` if the triangles may cover more or less than the polygon, because its outline
    /// crosses itself or needs too many comparisons.
    pub is_exact: bool,
}

/// Divides a polygon of any shape in a plane, in either sense of rotation. Its outline may touch
/// itself, as it does where a cut leads to a hole. Returns `None` for a convex polygon: its
/// triangles are a fan around the first corner.
pub fn divide(corners: &[DVec3]) -> Option<Division> {
    let mut outline = Outline::new(corners)?;
    if (0..corners.len()).all(|i| outline.turn(i) >= 0.0) {
        return None;
    }
    let mut division = Division { triangles: Vec::new(), is_exact: true };
    let mut corner = 0;
    for left in (3..=corners.len()).rev() {
        let mut find = |is_wanted: &mut dyn FnMut(&mut Outline, usize) -> bool| {
            (0..left).any(|_| {
                corner = outline.next[corner];
                is_wanted(&mut outline, corner)
            })
        };
        // Without ears, a corner between sides on one line is cut off: its triangle has no area.
        let is_exact = find(&mut Outline::is_ear) || find(&mut |o, i| o.turn(i) == 0.0);
        if !is_exact {
            division.is_exact = false;
            find(&mut |outline, i| outline.turn(i) > 0.0);
        }
        let (before, after) = (outline.previous[corner], outline.next[corner]);
        division.triangles.push([before, corner, after]);
        (outline.next[before], outline.previous[after]) = (after, before);
        outline.is_cut[corner] = true;
        corner = outline.previous[before];
        if outline.tests == 0 {
            let rest = std::iter::successors(Some(after), |i| Some(outline.next[*i]));
            let rest: Vec<_> = rest.take(left - 1).collect();
            division.triangles.extend(rest[1..].windows(2).map(|w| [rest[0], w[0], w[1]]));
            division.is_exact = left == 3;
            break;
        }
    }
    Some(division)
}

/// Outline of a polygon, projected along a coordinate axis so that it is counter-clockwise, from
/// which ears are cut.
struct Outline {
    points: Vec<DVec2>,
    /// Corners before and after each corner, without those that were cut off.
    previous: Vec<usize>,
    next: Vec<usize>,
    is_cut: Vec<bool>,
    /// Corners that were not convex at first, in the order of x.
    reflex: Vec<usize>,
    /// Number of comparisons that are still allowed.
    tests: usize,
}

impl Outline {
    /// Projects a polygon; `None` if it has no area.
    fn new(corners: &[DVec3]) -> Option<Self> {
        let count = corners.len();
        let first = *corners.first()?;
        let after = |i: usize| (i + 1) % count;
        // Newell's sum: twice the area, as a vector.
        let normal: DVec3 =
            (0..count).map(|i| (corners[i] - first).cross(corners[after(i)] - first)).sum();
        let size = normal.abs().to_array();
        let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
        if size[axis].is_nan() || size[axis] <= 0.0 {
            return None;
        }
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (u, v) = if normal[axis] > 0.0 { (u, v) } else { (v, u) };
        let mut outline = Self {
            points: corners.iter().map(|c| DVec2::new(c[u] - first[u], c[v] - first[v])).collect(),
            previous: (0..count).map(|i| (i + count - 1) % count).collect(),
            next: (0..count).map(after).collect(),
            is_cut: vec![false; count],
            reflex: Vec::new(),
            tests: count.saturating_mul(TESTS_PER_CORNER),
        };
        outline.reflex = (0..count).filter(|i| outline.turn(*i) <= 0.0).collect();
        outline.reflex.sort_by(|a, b| outline.points[*a].x.total_cmp(&outline.points[*b].x));
        Some(outline)
    }

    /// Returns twice the signed area of the triangle at a corner: above 0 if the corner is convex.
    fn turn(&self, corner: usize) -> f64 {
        let [a, b, c] = self.triangle(corner);
        (b - a).perp_dot(c - b)
    }

    fn triangle(&self, corner: usize) -> [DVec2; 3] {
        [self.previous[corner], corner, self.next[corner]].map(|i| self.points[i])
    }

    /// Returns `true` if the corner is convex and nothing of the outline lies in its triangle, or if
    /// the corner is the tip of a spike without area.
    fn is_ear(&mut self, corner: usize) -> bool {
        self.tests = self.tests.saturating_sub(1);
        let triangle = self.triangle(corner);
        let [a, b, c] = triangle;
        let turn = self.turn(corner);
        if turn.is_nan() || turn <= 0.0 {
            return turn == 0.0 && (a - b).dot(c - b) >= 0.0;
        }
        let (low, high) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        let start = self.reflex.partition_point(|i| self.points[*i].x < low);
        let inside = self.reflex[start..].iter().take_while(|i| self.points[**i].x <= high);
        let mut count = 0;
        let is_free = inside.inspect(|_| count += 1).all(|i| !self.is_in(*i, triangle));
        self.tests = self.tests.saturating_sub(count);
        is_free && self.tests > 0
    }

    /// Returns `true` if a corner that was not cut off lies in a triangle, or if it lies at one of
    /// its corners, where the outline touches itself, and a side leads from there into the
    /// triangle.
    fn is_in(&self, corner: usize, triangle: [DVec2; 3]) -> bool {
        let p = self.points[corner];
        let sides = [0, 1, 2].map(|k| (triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]));
        let is_in = match sides.into_iter().find(|(at, ..)| *at == p) {
            Some((_, after, before)) => {
                [self.previous[corner], self.next[corner]].into_iter().any(|i| {
                    let side = self.points[i] - p;
                    (after - p).perp_dot(side) > 0.0 && side.perp_dot(before - p) > 0.0
                })
            }
            None => sides.into_iter().all(|(from, to, _)| (to - from).perp_dot(p - from) >= 0.0),
        };
        is_in && !self.is_cut[corner]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the sum of the areas of the triangles, and the area of the outline.
    fn areas(corners: &[DVec3], triangles: &[[usize; 3]]) -> [f64; 2] {
        let of = |i: usize, k: usize| corners[i].cross(corners[k]);
        let outline: DVec3 = (0..corners.len()).map(|i| of(i, (i + 1) % corners.len())).sum();
        let area = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| corners[i]);
            0.5 * (b - a).cross(c - a).length()
        };
        [triangles.iter().map(area).sum(), 0.5 * outline.length()]
    }

    fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect()
    }

    /// Star with alternating radii.
    fn star(points: usize) -> Vec<[f64; 2]> {
        let corner = |i: usize| {
            let (sin, cos) = (std::f64::consts::PI * i as f64 / points as f64).sin_cos();
            [cos, sin].map(|x| x * if i.is_multiple_of(2) { 1.0 } else { 0.3 })
        };
        (0..2 * points).map(corner).collect()
    }

    /// Strip of width 0.4 along a spiral.
    fn spiral(steps: usize) -> Vec<[f64; 2]> {
        let at = |i: usize, shift: f64| {
            let angle = 0.5 * i as f64;
            let (sin, cos) = angle.sin_cos();
            [cos, sin].map(|x| x * (1.0 + 0.2 * angle + shift))
        };
        (0..steps).map(|i| at(i, 0.0)).chain((0..steps).rev().map(|i| at(i, 0.4))).collect()
    }

    /// Comb with teeth, and corners in the middle of straight sides.
    fn comb(teeth: usize) -> Vec<[f64; 2]> {
        let tooth = |i: usize| {
            let x = 2.0 * i as f64;
            [[x, 1.0], [x, 3.0], [x + 1.0, 3.0], [x + 1.0, 1.0]]
        };
        let right = 2.0 * teeth as f64;
        let base = [[right, 1.0], [right, 0.0], [right - 0.5, 0.0], [0.0, 0.0], [0.0, 0.5]];
        (0..teeth).flat_map(tooth).chain(base).collect()
    }

    /// Returns the points with the coordinates in `text`.
    fn points(text: &str) -> Vec<[f64; 2]> {
        let numbers: Vec<f64> = text.split(' ').map(|number| number.parse().unwrap()).collect();
        numbers.as_chunks().0.to_vec()
    }

    const KEYHOLE: &str = "0 0 4 0 4 4 0 4 0 0 1 1 1 3 3 3 3 1 1 1";

    /// Square with two holes that are reached by cuts from the same corner.
    const TWO_HOLES: &str = "0 0 1 .5 .5 1 1 1 1 .5 0 0 9 0 9 9 7 5 5 5 5 7 7 5 9 9 0 9";

    #[test]
    fn concave_polygons_keep_their_area_in_every_order_and_plane() {
        let shapes = [
            ("dart", points("0 0 2 1 0 2 .6 1")),
            ("u", points("0 0 3 0 3 2 2 2 2 1 1 1 1 2 0 2")),
            ("star", star(5)),
            ("large star", star(70)),
            ("spiral", spiral(60)),
            ("comb", comb(9)),
            ("keyhole", points(KEYHOLE)),
            ("two holes", points(TWO_HOLES)),
            ("doubled corners", points("0 0 0 0 2 1 2 1 0 2 .6 1")),
        ];
        // Planes: three axes, an oblique one, and one far from the origin.
        let planes = [
            [DVec3::X, DVec3::Y, DVec3::ZERO],
            [DVec3::Y, DVec3::Z, DVec3::ZERO],
            [DVec3::Z, DVec3::X, DVec3::ZERO],
            [DVec3::new(0.6, 0.8, 0.1), DVec3::new(-0.3, 0.2, 0.9), DVec3::ZERO],
            [DVec3::X, DVec3::Z, DVec3::new(1e6, -2e6, 3e6)],
        ];
        for (name, shape) in &shapes {
            for (plane, [u, v, origin]) in planes.iter().enumerate() {
                for turn in (0..shape.len()).step_by(shape.len().div_ceil(40)) {
                    for reversed in [false, true] {
                        let mut corners: Vec<DVec3> =
                            shape.iter().map(|[x, y]| *origin + *u * *x + *v * *y).collect();
                        corners.rotate_left(turn);
                        if reversed {
                            corners.reverse();
                        }
                        let case = format!("{name}, plane {plane}, from {turn}, {reversed}");
                        let division = divide(&corners).expect(&case);
                        assert!(division.is_exact, "{case}");
                        assert_eq!(division.triangles.len(), corners.len() - 2, "{case}");
                        corners.iter_mut().for_each(|c| *c -= *origin);
                        let [sum, whole] = areas(&corners, &division.triangles);
                        assert!((sum - whole).abs() < 1e-6 * whole, "{case}: {sum} of {whole}");
                    }
                }
            }
        }
    }

    #[test]
    fn nearly_planar_polygons_are_covered() {
        let bent = |scale: f64| -> Vec<DVec3> {
            let point = |(i, p): (usize, [f64; 2])| DVec3::new(p[0], p[1], scale * (i % 3) as f64);
            comb(9).into_iter().enumerate().map(point).collect()
        };
        for scale in [1e-9, 1e-3, 0.05] {
            let division = divide(&bent(scale)).unwrap();
            assert!(division.is_exact, "{scale}");
            let [sum, whole] = areas(&bent(0.0), &division.triangles);
            assert!((sum - whole).abs() < 1e-9, "{scale}: {sum} of {whole}");
        }
    }

    #[test]
    fn convex_polygons_are_fans_and_faulty_ones_end() {
        let circle: Vec<_> = star(50).into_iter().step_by(2).collect();
        for convex in [circle, points("0 0 1 0 2 0 2 1 0 1")] {
            assert!(divide(&flat(&convex)).is_none());
        }
        for flat in [&[][..], &[DVec3::ZERO], &[DVec3::ZERO, DVec3::X, DVec3::X * 2.0]] {
            assert!(divide(flat).is_none(), "no area");
        }
        let bow_tie = flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.5]]);
        assert!(!divide(&bow_tie).unwrap().is_exact);
        for odd in [f64::NAN, f64::INFINITY, 1e300] {
            let mut corners = flat(&star(5));
            corners[3].x = odd;
            let division = divide(&corners);
            assert!(division.is_none_or(|d| d.triangles.len() == 8), "{odd}");
        }
        // Corners in random places would need 10^10 comparisons.
        let mut state = 1u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8)
        };
        let points: Vec<_> = (0..4_000).map(|_| [random(), random()]).collect();
        assert!(!divide(&flat(&points)).unwrap().is_exact);
    }
}
