//! For each direction from a light, the few things of a tree that stand there: shadow rays ask these
//! instead of the tree (Haines and Greenberg 1986, *The Light Buffer: A Shadow-Testing Accelerator*).

use super::path::first_tag;
use crate::lanes::{Lanes, Mask, Real, V3};
use crate::shape::{Ball, Geometry, Ray, Selection, Towards, ViewCone};
use glam::{DVec2, DVec3};
use std::ops::Range;
use std::sync::LazyLock;

/// The chart of directions has `2^LEVELS` cells to a side.
const LEVELS: u32 = 6;
const SIDE: usize = 1 << LEVELS;

/// So many things are kept for a cell, the nearest to the light.
const FEW: usize = 16;

/// Rays in single precision stray by a few times 2^-24 of the largest coordinate; this is more.
const STRAY: f64 = 1e-5;

/// No item's number.
const NONE: u32 = u32::MAX;

/// What stands in the way of one light.
pub(super) struct LightBuffer<S> {
    chart: Chart<S>,
    /// The largest coordinate of the things and the light: from farther off, rays stray too far.
    scale: S,
    /// Row by row.
    cells: Vec<Cell<S>>,
    /// Of one cell after the other, those nearer to the light first.
    things: Vec<Thing<S>>,
}

/// Where a point is seen from a light.
enum Chart<S> {
    /// From a point: directions on an octahedron, unfolded to a square.
    Around,
    /// From far away: coordinates along two axes, from 0 to 1 where there are things.
    Along { axes: [[S; 3]; 2], low: [S; 2], scale: [S; 2] },
}

#[derive(Clone, Copy)]
struct Cell<S> {
    first: u32,
    end: u32,
    /// Up to this depth all things are known.
    until: S,
}

/// A thing of the geometry's tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shader {
    /// Around it.
    pub ball: Ball,
    /// The number of the item whose surface it does not shade, because that is its own; `None`: it may
    /// shade itself.
    pub own: Option<u32>,
}

#[derive(Clone, Copy)]
struct Thing<S> {
    /// Number in the geometry's tree.
    number: u32,
    /// As in [`Shader`]; [`NONE`] stands for `None`.
    own: u32,
    /// The depth that it begins at.
    near: S,
}

impl<S: Real> LightBuffer<S> {
    /// Of the things of a tree; `None`: most cells would hold too many.
    pub fn new(towards: &Towards, shaders: &[Shader]) -> Option<Self> {
        let reach = |ball: &Ball| ball.center.abs().max_element() + ball.radius;
        let light = match towards {
            Towards::Point(light) => light.abs().max_element(),
            Towards::Direction(_) => 0.0,
        };
        let scale = shaders.iter().map(|s| reach(&s.ball)).fold(light, f64::max);
        let grown = |b: &Ball| Ball { radius: b.radius + STRAY * scale, ..*b };
        let balls: Vec<Ball> = shaders.iter().map(|s| grown(&s.ball)).collect();
        let mut order: Vec<(f64, u32)> =
            (0..).zip(&balls).map(|(number, ball)| (near(towards, ball), number)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (chart, spans) = match towards {
            Towards::Point(_) => (Chart::Around, None),
            Towards::Direction(direction) => {
                let (chart, spans) = flat(*direction, &balls);
                (chart, Some(spans))
            }
        };
        let mut entries: Vec<(usize, Thing<S>)> = Vec::new();
        let mut counts = [0; SIDE * SIDE];
        let mut until = [S::of(f64::INFINITY); SIDE * SIDE];
        let mut left_out = 0;
        for (near, number) in order {
            let (near, own) = (S::of(near), shaders[number as usize].own.unwrap_or(NONE));
            let mut add = |cell: usize| {
                if counts[cell] < FEW {
                    counts[cell] += 1;
                    entries.push((cell, Thing { number, own, near }));
                } else {
                    until[cell] = if until[cell] < near { until[cell] } else { near };
                    left_out += 1;
                }
            };
            match (towards, &spans) {
                (Towards::Point(light), _) => {
                    let Ball { center, radius } = balls[number as usize];
                    around(1, [0, 0], &Ball { center: center - light, radius }, &mut add);
                }
                (_, Some(spans)) => {
                    let [columns, rows] = spans[number as usize].clone();
                    rows.for_each(|row| columns.clone().for_each(|x| add(row * SIDE + x)));
                }
                _ => unreachable!("a direction has spans"),
            }
            if left_out > entries.len() + SIDE * SIDE {
                return None;
            }
        }
        // A stable sort keeps the order of depths.
        entries.sort_by_key(|(cell, _)| *cell);
        let mut first = 0;
        let cell = |(count, until): (&usize, &S)| {
            let end = first + *count as u32;
            let cell = Cell { first, end, until: *until };
            first = end;
            cell
        };
        let cells = counts.iter().zip(&until).map(cell).collect();
        let things = entries.into_iter().map(|(_, thing)| thing).collect();
        Some(Self { chart, scale: S::of(scale), cells, things })
    }

    /// [`Geometry::blocked`] for rays to this light, which end after `limit`. `on`: tags of the items whose
    /// outsides the rays begin on.
    #[inline(never)]
    pub fn blocked<L: Lanes<Scalar = S>>(
        &self,
        geometry: &Geometry<L>,
        (ray, on): (&Ray<L>, L),
        limit: L,
        wanted: L::Mask,
        by: &Selection,
    ) -> L::Mask {
        let mut blocked = geometry.blocked_by_listed(ray, limit, wanted, by);
        let mut beyond = wanted.and_not(blocked) & ray.origin.max_abs().gt(L::splat(self.scale));
        let mut left = wanted.and_not(blocked | beyond);
        let (cell, depth) = self.chart.place(ray, limit);
        // The item that all begin on.
        let own = match first_tag(on, wanted) {
            Some((own, all)) if wanted.and_not(all).none() => Some(own),
            _ => None,
        };
        while left.any() {
            let number = cell.lane(left.bits().trailing_zeros() as usize);
            let here = L::splat(number);
            let here = left & cell.le(here) & cell.ge(here);
            left = left.and_not(here);
            let Cell { first, end, until } = self.cells[number.to_f64() as usize];
            let farthest = L::select(here, depth, L::of(-L::MAX)).extremes().1;
            beyond = beyond | (here & depth.gt(L::splat(until)));
            for thing in &self.things[first as usize..end as usize] {
                if thing.near > farthest {
                    break;
                }
                if own == Some(thing.own) {
                    continue;
                }
                let open = wanted.and_not(blocked);
                let new = geometry.blocked_by_one(thing.number, ray, limit, open);
                blocked = blocked | (new & open);
                if here.and_not(blocked).none() {
                    break;
                }
            }
            left = left.and_not(blocked);
        }
        beyond = beyond.and_not(blocked);
        if beyond.any() {
            blocked = blocked | (geometry.blocked(ray, limit, beyond, by) & beyond);
        }
        blocked
    }
}

impl<S: Real> Chart<S> {
    /// In which cell rays to the light begin, and at which depth.
    #[inline(always)]
    fn place<L: Lanes<Scalar = S>>(&self, ray: &Ray<L>, limit: L) -> (L, L) {
        let half = L::of(0.5);
        let (u, v, depth) = match self {
            Self::Around => {
                let d = -ray.direction;
                let scale = L::one() / (d.x.abs() + d.y.abs() + d.z.abs());
                let (u, v) = (d.x * scale, d.y * scale);
                let folded = |a: L, b: L| (L::one() - b.abs()).copysign(a);
                let below = d.z.lt(L::zero());
                let choose = |a: L, b: L| L::select(below, folded(a, b), a).mul_add(half, half);
                (choose(u, v), choose(v, u), limit)
            }
            Self::Along { axes, low, scale } => {
                let along = |i: usize| {
                    let a = ray.origin.dot(V3::splat(axes[i]));
                    (a - L::splat(low[i])) * L::splat(scale[i])
                };
                (along(0), along(1), -ray.origin.dot(ray.direction))
            }
        };
        // A number below 2^22 plus this has no fraction bits left in single precision; in double one
        // below 2^51.
        let rounder = L::of(1.5 / L::EPSILON);
        let side = L::of(SIDE as f64);
        let cell = |x: L| {
            let x = x.mul_add(side, -half).max(L::zero()).min(L::of((SIDE - 1) as f64));
            (x + rounder) - rounder
        };
        (cell(v).mul_add(side, cell(u)), depth)
    }
}

/// The depth that a ball begins at, seen from the light: of a point the distance, of a direction the way
/// from the plane through the origin.
fn near(towards: &Towards, ball: &Ball) -> f64 {
    let middle = match towards {
        Towards::Point(light) => ball.center.distance(*light),
        Towards::Direction(direction) => -ball.center.dot(*direction),
    };
    middle - ball.radius
}

/// A point of the unfolded octahedron, both coordinates from -1 to 1, as a direction.
fn unfolded(u: f64, v: f64) -> DVec3 {
    let z = 1.0 - u.abs() - v.abs();
    let folded = |a: f64, b: f64| (1.0 - b.abs()).copysign(a);
    let (x, y) = if z < 0.0 { (folded(u, v), folded(v, u)) } else { (u, v) };
    DVec3::new(x, y, z).normalize()
}

/// What is seen through each square of the quadtree over the octahedron: level by level from the four
/// quarters on, row by row. Squares consist of triangles of the octahedron's faces, so that a cone around
/// their corners holds them.
static SQUARES: LazyLock<Vec<Vec<ViewCone>>> = LazyLock::new(|| {
    let square = |side: usize, i: usize| {
        let at = |k: usize| 2.0 * k as f64 / side as f64 - 1.0;
        let corner = |x: usize, y: usize| unfolded(at(i % side + x), at(i / side + y));
        ViewCone::around(DVec3::ZERO, &[corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)])
    };
    let level = |level: u32| {
        let side = 1 << level;
        (0..side * side).map(|i| square(side, i)).collect()
    };
    (1..=LEVELS).map(level).collect()
});

/// Calls `add` for the cells through which a ball may be seen from the origin: of four squares of a level,
/// the first at `column` and `row`.
fn around(level: u32, [column, row]: [usize; 2], ball: &Ball, add: &mut impl FnMut(usize)) {
    let side = 1 << level;
    for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| (column + x, row + y)) {
        let square = y * side + x;
        if !SQUARES[level as usize - 1][square].meets(ball) {
            continue;
        }
        if level == LEVELS {
            add(square);
        } else {
            around(level + 1, [2 * x, 2 * y], ball, add);
        }
    }
}

/// The cells of a ball: columns and rows.
type Spans = [Range<usize>; 2];

/// A chart across `direction`, and which of its cells each ball covers.
fn flat<S: Real>(direction: DVec3, balls: &[Ball]) -> (Chart<S>, Vec<Spans>) {
    let (a, b) = direction.any_orthonormal_pair();
    let at = |p: DVec3| DVec2::new(p.dot(a), p.dot(b));
    let reach = |ball: &Ball| DVec2::splat(ball.radius);
    let ends = |ball: &Ball| (at(ball.center) - reach(ball), at(ball.center) + reach(ball));
    let low = balls.iter().map(|b| ends(b).0).fold(DVec2::INFINITY, DVec2::min);
    let high = balls.iter().map(|b| ends(b).1).fold(DVec2::NEG_INFINITY, DVec2::max);
    let scale = (high - low).recip();
    let cell = |x: f64| ((x * SIDE as f64).max(0.0) as usize).min(SIDE - 1);
    let span = |ball: &Ball| {
        let (first, last) = ends(ball);
        let (first, last) = ((first - low) * scale, (last - low) * scale);
        [cell(first.x)..cell(last.x) + 1, cell(first.y)..cell(last.y) + 1]
    };
    let reals = |v: DVec2| v.to_array().map(S::of);
    let chart = Chart::Along {
        axes: [a, b].map(|axis| axis.to_array().map(S::of)),
        low: reals(low),
        scale: reals(scale),
    };
    (chart, balls.iter().map(span).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Single};
    use crate::shape::Form;

    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 40) as f64 / 16_777_216.0
        }

        fn point(&mut self, half: f64) -> DVec3 {
            DVec3::from([0; 3].map(|_| half * (2.0 * self.unit() - 1.0)))
        }
    }

    fn balls(random: &mut Random, count: usize, radius: f64) -> Vec<Ball> {
        let ball = |_| Ball { center: random.point(5.0), radius: radius * random.unit() };
        (0..count).map(ball).collect()
    }

    fn shaders(balls: &[Ball]) -> Vec<Shader> {
        balls.iter().map(|ball| Shader { ball: *ball, own: None }).collect()
    }

    /// Asks for shadows at random points and compares with the tree; how many were blocked.
    fn compare<L: Lanes>(towards: &Towards, balls: &[Ball], random: &mut Random) -> usize {
        let form = |b: &Ball| Form::Sphere { center: b.center, radius: b.radius };
        let forms: Vec<Form> = balls.iter().map(form).collect();
        let geometry = Geometry::<L>::with_tree(&forms, true);
        let Some(buffer) = LightBuffer::<L::Scalar>::new(towards, &shaders(balls)) else {
            panic!("no buffer for {} balls", balls.len());
        };
        let mut count = 0;
        for round in 0..2000 {
            // Close together, apart, and far off.
            let (middle, apart) = (random.point(7.0), [0.01, 1.0, 10.0, 1e4][round % 4]);
            let points: Vec<DVec3> = (0..L::WIDTH).map(|_| middle + random.point(apart)).collect();
            let axis = |a: usize| L::from_fn(|i| L::Scalar::of(points[i][a]));
            let origin = V3::new(axis(0), axis(1), axis(2));
            let (direction, limit) = match towards {
                Towards::Direction(d) => (V3::of(d.to_array()), L::of(L::MAX)),
                Towards::Point(light) => {
                    let to = V3::of(light.to_array()) - origin;
                    let distance = to.length2().sqrt();
                    (to * (L::one() / distance), distance)
                }
            };
            let ray = Ray { origin, direction };
            let wanted = axis(0).gt(L::of(middle.x - 0.3 * apart));
            let expected = geometry.blocked(&ray, limit, wanted, geometry.all()) & wanted;
            let found = buffer.blocked(&geometry, (&ray, L::tag(0)), limit, wanted, geometry.all())
                & wanted;
            assert_eq!(found.bits(), expected.bits(), "{towards:?}, round {round}: {points:?}");
            count += found.bits().count_ones() as usize;
        }
        count
    }

    #[test]
    fn shadows_are_those_of_the_tree() {
        let mut random = Random(1);
        let lights = [
            Towards::Point(DVec3::new(1.0, 2.0, -0.5)),
            Towards::Point(DVec3::new(0.0, 9.0, 0.0)),
            Towards::Direction(DVec3::new(0.2, -0.9, 0.4).normalize()),
            Towards::Direction(DVec3::Z),
        ];
        for towards in &lights {
            // The last kind fills cells so that the tree has to be asked, too.
            for (count, radius) in [(3, 8.0), (100, 0.5), (400, 0.3), (60, 1.5)] {
                let balls = balls(&mut random, count, radius);
                let blocked = compare::<Single>(towards, &balls, &mut random);
                assert!(blocked > 100, "{towards:?}, {count} balls: {blocked} blocked");
                compare::<Double>(towards, &balls, &mut random);
                compare::<f32>(towards, &balls, &mut random);
            }
        }
    }

    /// A direction lies in the cone of the square that the chart puts it in.
    #[test]
    fn the_chart_and_its_squares_agree() {
        let mut random = Random(2);
        let chart = Chart::<f64>::Around;
        for _ in 0..10_000 {
            let to = random.point(1.0).normalize();
            let ray = Ray { origin: V3::<f64>::zero(), direction: V3::of((-to).to_array()) };
            let (cell, depth) = chart.place(&ray, 3.0);
            assert!(depth == 3.0 && cell == cell.round() && cell < (SIDE * SIDE) as f64);
            let square = &SQUARES[LEVELS as usize - 1][cell as usize];
            assert!(square.meets(&Ball { center: to, radius: 1e-9 }), "{to}: {cell}");
        }
    }

    #[test]
    fn few_things_are_asked() {
        let mut random = Random(3);
        let light = Towards::Point(DVec3::ZERO);
        let few = LightBuffer::<f32>::new(&light, &shaders(&balls(&mut random, 400, 0.3))).unwrap();
        let mean = few.things.len() as f64 / (SIDE * SIDE) as f64;
        assert!(mean < 4.0, "{mean} in a cell");
        let many = balls(&mut random, 4000, 3.0);
        assert!(LightBuffer::<f32>::new(&light, &shaders(&many)).is_none());
    }
}
