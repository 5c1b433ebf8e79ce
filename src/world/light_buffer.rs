//! For each direction from a light, the few things of a tree that stand there: shadow rays ask these
//! instead of the tree (Haines and Greenberg 1986, *The Light Buffer: A Shadow-Testing Accelerator*).

use super::light_chart::{Chart, Charted};
use super::path::first_tag;
use crate::lanes::{Lanes, Mask, Real};
use crate::shape::{Ball, Geometry, Ray, Selection, Towards};

/// So many things are kept for a cell, the nearest to the light.
const FEW: usize = 16;

/// Rays in single precision stray by a few times 2^-24 of the largest coordinate; this is more.
const STRAY: f64 = 1e-5;

/// No item's number.
const NONE: u32 = u32::MAX;

/// What stands in the way of one light.
pub(super) struct LightBuffer<S> {
    chart: Chart<S>,
    /// Cells in a row of the chart, and rows.
    side: usize,
    /// The largest coordinate of the things and the light: from farther off, rays stray too far.
    scale: S,
    /// Row by row, face by face.
    cells: Vec<Cell<S>>,
    /// Of one cell after the other, those nearer to the light first.
    things: Vec<Thing<S>>,
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
    /// The depth that it begins at: the distance from a point, the way along a direction from the plane
    /// through the origin.
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
        // As the light sees them.
        let seen = |s: &Shader| {
            let center = match towards {
                Towards::Point(light) => s.ball.center - light,
                Towards::Direction(_) => s.ball.center,
            };
            Ball { center, radius: s.ball.radius + STRAY * scale }
        };
        let balls: Vec<Ball> = shaders.iter().map(seen).collect();
        let near = |ball: &Ball| match towards {
            Towards::Point(_) => ball.center.length() - ball.radius,
            Towards::Direction(direction) => -ball.center.dot(*direction) - ball.radius,
        };
        let mut order: Vec<(f64, u32)> = balls.iter().map(near).zip(0..).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));

        let Charted { chart, places, side } = Charted::new(towards, &balls);
        let count = chart.faces() * side * side;
        let (mut counts, mut until) = (vec![0; count], vec![S::of(f64::INFINITY); count]);
        let mut entries: Vec<(usize, Thing<S>)> = Vec::new();
        let mut left_out = 0;
        for (near, number) in order {
            let (near, own) = (S::of(near), shaders[number as usize].own.unwrap_or(NONE));
            for cell in places[number as usize].iter().flat_map(|place| place.cells(side)) {
                if counts[cell] < FEW {
                    counts[cell] += 1;
                    entries.push((cell, Thing { number, own, near }));
                } else {
                    until[cell] = if until[cell] < near { until[cell] } else { near };
                    left_out += 1;
                }
            }
            if left_out > entries.len() + count {
                return None;
            }
        }
        let mut end = 0;
        let cell = |(count, until): (&usize, &S)| {
            // Grows to its end when it is filled.
            let cell = Cell { first: end, end, until: *until };
            end += *count as u32;
            cell
        };
        let mut cells: Vec<Cell<S>> = counts.iter().zip(&until).map(cell).collect();
        let nothing = Thing { number: 0, own: NONE, near: S::default() };
        let mut things = vec![nothing; entries.len()];
        for (cell, thing) in entries {
            things[cells[cell].end as usize] = thing;
            cells[cell].end += 1;
        }
        Some(Self { chart, side, scale: S::of(scale), cells, things })
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
        let (cell, depth) = self.chart.place(ray, limit, self.side);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Single, V3};
    use crate::shape::Form;
    use glam::DVec3;

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

    #[test]
    fn few_things_are_asked() {
        let mut random = Random(3);
        let light = Towards::Point(DVec3::ZERO);
        let few = LightBuffer::<f32>::new(&light, &shaders(&balls(&mut random, 400, 0.3))).unwrap();
        let mean = few.things.len() as f64 / few.cells.len() as f64;
        assert!(mean < 4.0, "{mean} in a cell");
        let many = balls(&mut random, 4000, 3.0);
        assert!(LightBuffer::<f32>::new(&light, &shaders(&many)).is_none());
    }
}
