//! For each direction from a light, the few things of a tree that stand there: shadow rays ask these
//! instead of the tree (Haines and Greenberg 1986, *The Light Buffer: A Shadow-Testing Accelerator*).

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat};
use crate::primitive::{Aggregate, BoundingSphere, F32_RAY_ERROR, LightTarget, PrimitiveSet};
use crate::world::culling::light_projection::{LightProjection, ProjectedBounds};
use crate::world::integrator::opaque::next_distinct;

/// So many things are kept for a cell, the nearest to the light.
const MAX_PER_CELL: usize = 16;

/// No item's number.
const NONE: u32 = u32::MAX;

/// What stands in the way of one light.
pub(crate) struct LightBuffer<S> {
    projection: LightProjection<S>,
    /// Cells in a row of the chart, and rows.
    side: usize,
    /// The largest coordinate of the things and the light: from farther off, rays stray too far.
    scale: S,
    /// Row by row, face by face.
    cells: Vec<Cell<S>>,
    /// Of one cell after the other, those nearer to the light first.
    entries: Vec<Entry<S>>,
}

#[derive(Clone, Copy)]
struct Cell<S> {
    first: u32,
    end: u32,
    /// Up to this depth all things are known.
    complete_to: S,
}

/// A thing of the geometry's tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Occluder {
    /// Around it.
    pub ball: BoundingSphere,
    /// The number of the item whose surface it does not shade, because that is its own; `None`: it may
    /// shade itself.
    pub own: Option<u32>,
}

#[derive(Clone, Copy)]
struct Entry<S> {
    /// Number in the geometry's tree.
    number: u32,
    /// As in [`Occluder`]; [`NONE`] stands for `None`.
    own: u32,
    /// The depth that it begins at: the distance from a point, the way along a direction from the plane
    /// through the origin.
    near: S,
}

impl<S: Float> LightBuffer<S> {
    /// Of the things of a tree; `None`: of half of them or more, most of the cells would have no room.
    pub fn new(towards: &LightTarget, occluders: &[Occluder]) -> Option<Self> {
        let reach = |ball: &BoundingSphere| ball.center.abs().max_element() + ball.radius;
        let light = match towards {
            LightTarget::Point(light) => light.abs().max_element(),
            LightTarget::Direction(_) => 0.0,
        };
        let scale = occluders.iter().map(|s| reach(&s.ball)).fold(light, f64::max);
        // As the light sees them.
        let seen = |s: &Occluder| {
            let center = match towards {
                LightTarget::Point(light) => s.ball.center - light,
                LightTarget::Direction(_) => s.ball.center,
            };
            BoundingSphere { center, radius: s.ball.radius + F32_RAY_ERROR * scale }
        };
        let balls: Vec<BoundingSphere> = occluders.iter().map(seen).collect();
        let begin = |ball: &BoundingSphere| match towards {
            LightTarget::Point(_) => ball.center.length() - ball.radius,
            LightTarget::Direction(direction) => -ball.center.dot(*direction) - ball.radius,
        };
        let mut order: Vec<(f64, u32)> = balls.iter().map(begin).zip(0..).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));

        let ProjectedBounds { projection, rects: places, side } =
            ProjectedBounds::new(towards, &balls);
        let count = projection.faces() * side * side;
        let (mut counts, mut complete_to) =
            (vec![0; count], vec![S::from_f64(f64::INFINITY); count]);
        let mut placed: Vec<(usize, Entry<S>)> = Vec::new();
        let mut overflowed = 0;
        for (near, number) in order {
            let (near, own) = (S::from_f64(near), occluders[number as usize].own.unwrap_or(NONE));
            let mut balance = 0;
            for cell in places[number as usize].iter().flat_map(|place| place.cells(side)) {
                if counts[cell] < MAX_PER_CELL {
                    counts[cell] += 1;
                    placed.push((cell, Entry { number, own, near }));
                    balance += 1;
                } else {
                    complete_to[cell] =
                        if complete_to[cell] < near { complete_to[cell] } else { near };
                    balance -= 1;
                }
            }
            overflowed += usize::from(balance < 0);
            if 2 * overflowed >= occluders.len() {
                return None;
            }
        }
        let mut end = 0;
        let cell = |(count, complete_to): (&usize, &S)| {
            // Grows to its end when it is filled.
            let cell = Cell { first: end, end, complete_to: *complete_to };
            end += *count as u32;
            cell
        };
        let mut cells: Vec<Cell<S>> = counts.iter().zip(&complete_to).map(cell).collect();
        let empty = Entry { number: 0, own: NONE, near: S::default() };
        let mut entries = vec![empty; placed.len()];
        for (cell, entry) in placed {
            entries[cells[cell].end as usize] = entry;
            cells[cell].end += 1;
        }
        Some(Self { projection, side, scale: S::from_f64(scale), cells, entries })
    }

    /// [`Aggregate::blocked`] for rays to this light, which end after `limit`. `on`: tags of the items that the
    /// rays begin on, and where that is on their outsides.
    #[inline(never)]
    pub fn occluded<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        ray: &Ray<L>,
        on: (L, L::Mask),
        limit: L,
        wanted: L::Mask,
        by: &PrimitiveSet,
    ) -> L::Mask {
        let mut blocked = geometry.occluded_linear(ray, limit, wanted, by);
        let mut beyond = wanted.and_not(blocked) & ray.origin.max_abs().gt(L::splat(self.scale));
        let mut left = wanted.and_not(blocked | beyond);
        let (cell, depth) = self.projection.lookup(ray, limit, self.side);
        // The item on whose outside all begin.
        let own = match next_distinct(on.0, wanted) {
            Some((own, all)) if wanted.and_not(all & on.1).none() => Some(own),
            _ => None,
        };
        while left.any() {
            let number = cell.lane(left.bits().trailing_zeros() as usize);
            let here = L::splat(number);
            let here = left & cell.le(here) & cell.ge(here);
            if here.none() {
                // No number: the chart could not tell.
                beyond = beyond | left;
                break;
            }
            left = left.and_not(here);
            let Cell { first, end, complete_to } = self.cells[number.to_f64() as usize];
            let farthest = L::select(here, depth, L::from_f64(-L::MAX)).min_max().1;
            beyond = beyond | (here & depth.gt(L::splat(complete_to)));
            for thing in &self.entries[first as usize..end as usize] {
                if thing.near > farthest {
                    break;
                }
                if own == Some(thing.own) {
                    continue;
                }
                let open = wanted.and_not(blocked);
                let new = geometry.occluded_by(thing.number, ray, limit, open);
                blocked = blocked | (new & open);
                if here.and_not(blocked).none() {
                    break;
                }
            }
            left = left.and_not(blocked);
        }
        beyond = beyond.and_not(blocked);
        if beyond.any() {
            blocked = blocked | (geometry.occluded(ray, limit, beyond, by) & beyond);
        }
        blocked
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Single, Vec3};
    use crate::primitive::{Form, SphereForm};
    use crate::world::culling::light_projection::tests::Random;
    use glam::DVec3;

    fn balls(random: &mut Random, count: usize, radius: f64) -> Vec<BoundingSphere> {
        let ball = |_| BoundingSphere { center: random.point(5.0), radius: radius * random.unit() };
        (0..count).map(ball).collect()
    }

    fn occluders(balls: &[BoundingSphere]) -> Vec<Occluder> {
        (0..).zip(balls).map(|(i, ball)| Occluder { ball: *ball, own: Some(i) }).collect()
    }

    /// Asks for shadows of rays from many places and compares with the tree; how many were blocked.
    fn compare<L: SimdFloat>(
        towards: &LightTarget,
        balls: &[BoundingSphere],
        random: &mut Random,
    ) -> usize {
        let form =
            |b: &BoundingSphere| Form::Sphere(SphereForm { center: b.center, radius: b.radius });
        let forms: Vec<Form> = balls.iter().map(form).collect();
        let geometry = Aggregate::<L>::with_tree(&forms, true);
        let Some(buffer) = LightBuffer::<L::Scalar>::new(towards, &occluders(balls)) else {
            panic!("no buffer for {} balls", balls.len());
        };
        let mut count = 0;
        for round in 0..3000 {
            // In the air, close together, apart, and far off; on the outside of one ball, or of two.
            let (middle, apart) = (random.point(7.0), [0.01, 1.0, 10.0, 1e4, 0.0, 0.0][round % 6]);
            let pair = [0; 2].map(|_| (random.unit() * balls.len() as f64) as usize);
            let ball_of = |lane: usize| if round % 6 == 4 { pair[0] } else { pair[lane % 2] };
            let normals: Vec<DVec3> =
                (0..L::WIDTH).map(|_| random.point(1.0).normalize()).collect();
            let point = |lane: usize| {
                let BoundingSphere { center, radius } = balls[ball_of(lane)];
                match round % 6 {
                    4 | 5 => center + normals[lane] * (radius + 1e-4),
                    _ => middle + normals[lane] * apart,
                }
            };
            let axis = |a: usize| L::from_fn(|i| L::Scalar::from_f64(point(i)[a]));
            let origin = Vec3::new(axis(0), axis(1), axis(2));
            let (direction, limit) = match towards {
                LightTarget::Direction(d) => (Vec3::of(d.to_array()), L::from_f64(L::MAX)),
                LightTarget::Point(light) => {
                    let to = Vec3::of(light.to_array()) - origin;
                    let distance = to.length_squared().sqrt();
                    (to * (L::one() / distance), distance)
                }
            };
            let ray = Ray { origin, direction };
            let normal = |a: usize| L::from_fn(|i| L::Scalar::from_f64(normals[i][a]));
            let facing = Vec3::new(normal(0), normal(1), normal(2)).dot(direction);
            let wanted = facing.gt(L::zero());
            let (first, second) = (L::from_id(ball_of(0) as u32), L::from_id(ball_of(1) as u32));
            let odd = L::from_fn(|i| L::Scalar::from_f64((i % 2) as f64)).gt(L::zero());
            let on = (L::select(odd, second, first), L::mask(round % 6 >= 4));
            let all = geometry.all();
            let expected = geometry.occluded(&ray, limit, wanted, all) & wanted;
            let found = buffer.occluded(&geometry, &ray, on, limit, wanted, all) & wanted;
            assert_eq!(found.bits(), expected.bits(), "{towards:?}, round {round}");
            count += found.bits().count_ones() as usize;
        }
        count
    }

    #[test]
    fn shadows_are_those_of_the_tree() {
        let mut random = Random(1);
        let lights = [
            LightTarget::Point(DVec3::new(1.0, 2.0, -0.5)),
            LightTarget::Point(DVec3::new(0.0, 19.0, 0.0)),
            LightTarget::Direction(DVec3::new(0.2, -0.9, 0.4).normalize()),
            LightTarget::Direction(DVec3::Z),
        ];
        for towards in &lights {
            for (count, radius) in [(3, 8.0), (100, 0.5), (400, 0.3), (60, 1.5)] {
                let balls = balls(&mut random, count, radius);
                let blocked = compare::<Single>(towards, &balls, &mut random);
                assert!(blocked > 100, "{towards:?}, {count} balls: {blocked} blocked");
                compare::<Double>(towards, &balls, &mut random);
                compare::<f32>(towards, &balls, &mut random);
            }
        }
    }

    /// Behind a crowd the tree has to be asked.
    #[test]
    fn what_has_no_room_is_found_in_the_tree() {
        let mut random = Random(4);
        let mut balls = balls(&mut random, 100, 0.5);
        let crowd =
            |_| BoundingSphere { center: random.point(0.3), radius: 0.05 + 0.2 * random.unit() };
        balls.extend((0..70).map(crowd));
        for towards in
            [LightTarget::Point(DVec3::new(0.0, 4.0, 4.0)), LightTarget::Direction(DVec3::X)]
        {
            let buffer = LightBuffer::<f32>::new(&towards, &occluders(&balls)).expect("a buffer");
            assert!(
                buffer.cells.iter().any(|cell| cell.complete_to < f32::INFINITY),
                "{towards:?}"
            );
            let mut random = Random(5);
            assert!(compare::<Single>(&towards, &balls, &mut random) > 100);
            compare::<Double>(&towards, &balls, &mut random);
        }
    }

    /// On the inside of a thing its other side is in the way.
    #[test]
    fn what_begins_inside_is_blocked_by_the_thing_itself() {
        let balls = [
            BoundingSphere { center: DVec3::ZERO, radius: 1.0 },
            BoundingSphere { center: DVec3::X * 5.0, radius: 1.0 },
        ];
        let forms = balls.map(|b| Form::Sphere(SphereForm { center: b.center, radius: b.radius }));
        let geometry = Aggregate::<Single>::with_tree(&forms, true);
        let towards = LightTarget::Point(DVec3::Y * 9.0);
        let buffer = LightBuffer::<f32>::new(&towards, &occluders(&balls)).expect("a buffer");
        let ray = Ray { origin: Vec3::<Single>::zero(), direction: Vec3::of([0.0, 1.0, 0.0]) };
        let ask = |outside| {
            let on = (Single::from_id(0), Single::mask(outside));
            let wanted = Single::mask(true);
            buffer.occluded(&geometry, &ray, on, Single::from_f64(9.0), wanted, geometry.all())
        };
        assert!(ask(false).all());
        // Who says that this is outside is believed.
        assert!(ask(true).none());
    }

    #[test]
    fn few_things_are_asked() {
        let mut random = Random(3);
        let light = LightTarget::Point(DVec3::ZERO);
        let few =
            LightBuffer::<f32>::new(&light, &occluders(&balls(&mut random, 400, 0.3))).unwrap();
        let mean = few.entries.len() as f64 / few.cells.len() as f64;
        assert!(mean < 4.0, "{mean} in a cell");
        let many = balls(&mut random, 4000, 3.0);
        assert!(LightBuffer::<f32>::new(&light, &occluders(&many)).is_none());
    }
}
