//! Light buffer: for each direction from a light, a list of the primitives that can occlude the
//! light. Shadow rays test the few primitives of a list instead of traversing the BVH (Haines and
//! Greenberg 1986, *The Light Buffer: A Shadow-Testing Accelerator*).

use crate::culling::light_projection::{LightProjection, ProjectedBounds};
use glam::DVec3;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, next_distinct};
use zerkalo_kernel::primitive::{
    Aggregate, BoundingSphere, F32_RAY_ERROR, LightTarget, PrimitiveSet,
};
use zerkalo_scene::value::{ascending, total_order};

/// Largest number of occluders in the list of a cell. If more primitives overlap the cell, the list
/// has the primitives closest to the light.
const MAX_PER_CELL: u32 = 16;

/// Value of [`Entry::exempt_primitive`] for a primitive against which all shadow rays are tested.
const NO_PRIMITIVE: u32 = u32::MAX;

/// Lists of the primitives that can occlude one light. Each list belongs to a *cell*: a square of a
/// grid over the projection from the light, which stands for a range of directions.
pub(crate) struct LightBuffer<S> {
    projection: LightProjection<S>,
    /// Number of rows and of columns of cells on each face of the projection.
    side: usize,
    /// Largest absolute coordinate of the occluders and the light. Rays whose origin has a larger
    /// coordinate traverse the BVH, because their rounding errors exceed the margin of the
    /// occluders' bounds.
    max_coordinate: S,
    /// Cells of all faces, face by face and row by row.
    cells: Vec<Cell<S>>,
    /// Occluders of all cells, cell after cell. The occluders of a cell are in ascending order of
    /// [`Entry::near`].
    entries: Vec<Entry<S>>,
}

#[derive(Clone, Copy)]
struct Cell<S> {
    /// Range of the cell's occluders in [`LightBuffer::entries`].
    first: u32,
    end: u32,
    /// Depth (see [`Entry::near`]) up to which the cell's list is complete. Shadow rays that start
    /// at greater depths traverse the BVH.
    complete_to: S,
}

/// Possible occluder of a light: a primitive of the BVH.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Occluder {
    pub ball: BoundingSphere,
    /// Id of the primitive if shadow rays that start on its outside cannot hit it again. `None` if
    /// they can.
    pub exempt_primitive: Option<u32>,
}

/// Possible occluder in the list of a cell.
#[derive(Clone, Copy)]
struct Entry<S> {
    /// Index of the primitive in [`Aggregate::in_bvh`].
    number: u32,
    /// Value of [`Occluder::exempt_primitive`]; [`NO_PRIMITIVE`] stands for `None`.
    exempt_primitive: u32,
    /// Smallest depth of the primitive's bounding sphere. The depth of a point is its distance from
    /// a point light. For a directional light it is the coordinate along the direction in which the
    /// light travels.
    near: S,
}

/// Primitives on which rays start.
pub(crate) struct RayStart<L: SimdFloat> {
    /// Id of the primitive in each lane.
    pub primitive: L,
    /// Lanes that start on the outside of their primitive.
    pub outside: L::Mask,
}

impl<S: Float> LightBuffer<S> {
    /// Creates the light buffer of a light. Returns `None` if at least half of `occluders` are left
    /// out of most cells that they overlap, so that too many shadow rays would traverse the BVH.
    pub fn new(target: &LightTarget, occluders: &[Occluder]) -> Option<Self> {
        let light = match target {
            LightTarget::Ball(light) => light.center,
            LightTarget::Direction(_) => DVec3::ZERO,
        };
        let coordinates =
            occluders.iter().map(|s| s.ball.center.abs().max_element() + s.ball.radius);
        let max_coordinate = coordinates.fold(light.abs().max_element(), f64::max);
        // Bounding spheres relative to the light, with a margin for rounding errors of rays.
        let relative_to_light = |s: &Occluder| BoundingSphere {
            center: s.ball.center - light,
            radius: s.ball.radius + F32_RAY_ERROR * max_coordinate,
        };
        let balls: Vec<BoundingSphere> = occluders.iter().map(relative_to_light).collect();
        let near_depth = |ball: &BoundingSphere| match target {
            LightTarget::Ball(_) => ball.center.length() - ball.radius,
            LightTarget::Direction(direction) => -ball.center.dot(*direction) - ball.radius,
        };
        let near: Vec<f64> = balls.iter().map(near_depth).collect();
        let order = ascending(near.iter().copied().map(total_order).collect());
        let ProjectedBounds { projection, rects, side } = ProjectedBounds::new(target, &balls);
        // Until all entries are placed, `end` is the number of a cell's entries.
        let empty = Cell { first: 0, end: 0, complete_to: S::from_f64(f64::INFINITY) };
        let mut cells = vec![empty; projection.faces() * side * side];
        let mut placed: Vec<(usize, Entry<S>)> = Vec::new();
        let mut overflowed = 0;
        for number in order {
            let near = S::from_f64(near[number]);
            let exempt_primitive = occluders[number].exempt_primitive.unwrap_or(NO_PRIMITIVE);
            // Number of cells that hold the occluder, minus the number of cells that are too full
            // for it.
            let mut balance = 0;
            for index in rects[number].iter().flat_map(|rect| rect.cells(side)) {
                let cell = &mut cells[index];
                if cell.end < MAX_PER_CELL {
                    placed.push((index, Entry { number: number as u32, exempt_primitive, near }));
                    cell.end += 1;
                    balance += 1;
                } else {
                    cell.complete_to =
                        if near < cell.complete_to { near } else { cell.complete_to };
                    balance -= 1;
                }
            }
            overflowed += usize::from(balance < 0);
            if 2 * overflowed >= occluders.len() {
                return None;
            }
        }
        // The sort is stable, so that the entries of a cell stay sorted by depth.
        placed.sort_by_key(|(cell, _)| *cell);
        let mut end = 0;
        for cell in &mut cells {
            (cell.first, cell.end) = (end, end + cell.end);
            end = cell.end;
        }
        let entries = placed.into_iter().map(|(_, entry)| entry).collect();
        let max_coordinate = S::from_f64(max_coordinate);
        Some(Self { projection, side, max_coordinate, cells, entries })
    }

    /// Returns the lanes of `active` whose ray is occluded, as [`Aggregate::occluded`] does.
    /// `candidates` are the possible occluders.
    ///
    /// The rays are passed by reference, because with a copy of them the render of the scene
    /// `reflecting-tracks` takes 7 % longer.
    #[inline(never)]
    pub fn occluded<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        ray: &Ray<L>,
        start: RayStart<L>,
        t_max: L,
        active: L::Mask,
        candidates: &PrimitiveSet,
    ) -> L::Mask {
        let mut occluded = geometry.occluded_linear(ray, t_max, active, candidates);
        let out_of_bounds = ray.origin.max_abs().gt(L::splat(self.max_coordinate));
        // Lanes that have to traverse the BVH.
        let mut use_bvh = active.and_not(occluded) & out_of_bounds;
        let mut remaining = active.and_not(occluded | use_bvh);
        let (cell, depth) = self.projection.lookup(ray, t_max, self.side);
        // Primitive on whose outside all rays start, if there is a single one.
        let common_start = match next_distinct(start.primitive, active) {
            Some((primitive, lanes)) if active.and_not(lanes & start.outside).none() => {
                Some(primitive)
            }
            _ => None,
        };
        while remaining.any() {
            let number = cell.lane(remaining.bits().trailing_zeros() as usize);
            let first_cell = L::splat(number);
            let in_cell = remaining & cell.le(first_cell) & cell.ge(first_cell);
            if in_cell.none() {
                // A cell index of NaN means that the projection has no cell for the ray.
                use_bvh = use_bvh | remaining;
                break;
            }
            remaining = remaining.and_not(in_cell);
            let Cell { first, end, complete_to } = self.cells[number.to_f64() as usize];
            let max_depth = L::select(in_cell, depth, L::from_f64(-L::MAX)).min_max().1;
            use_bvh = use_bvh | (in_cell & depth.gt(L::splat(complete_to)));
            for entry in &self.entries[first as usize..end as usize] {
                if entry.near > max_depth {
                    break;
                }
                if common_start == Some(entry.exempt_primitive) {
                    continue;
                }
                let unoccluded = active.and_not(occluded);
                let hits = geometry.occluded_by(entry.number, ray, t_max, unoccluded);
                occluded = occluded | (hits & unoccluded);
                if in_cell.and_not(occluded).none() {
                    break;
                }
            }
            remaining = remaining.and_not(occluded);
        }
        use_bvh = use_bvh.and_not(occluded);
        if use_bvh.any() {
            occluded = occluded | (geometry.occluded(ray, t_max, use_bvh, candidates) & use_bvh);
        }
        occluded
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::culling::light_projection::tests::Random;
    use zerkalo_kernel::lanes::{Double, Single, Vec3};
    use zerkalo_kernel::primitive::{Form, SphereForm};

    fn balls(random: &mut Random, count: usize, radius: f64) -> Vec<BoundingSphere> {
        let ball = |_| BoundingSphere { center: random.point(5.0), radius: radius * random.unit() };
        (0..count).map(ball).collect()
    }

    fn occluders(balls: &[BoundingSphere]) -> Vec<Occluder> {
        (0..)
            .zip(balls)
            .map(|(i, ball)| Occluder { ball: *ball, exempt_primitive: Some(i) })
            .collect()
    }

    /// Checks that the light buffer of `target` and the BVH find the same shadows for rays from
    /// many points. Returns the number of occluded rays.
    fn compare<L: SimdFloat>(
        target: &LightTarget,
        balls: &[BoundingSphere],
        random: &mut Random,
    ) -> usize {
        let form =
            |b: &BoundingSphere| Form::Sphere(SphereForm { center: b.center, radius: b.radius });
        let forms: Vec<Form> = balls.iter().map(form).collect();
        let geometry = Aggregate::<L>::with_bvh(&forms, true);
        let Some(buffer) = LightBuffer::<L::Scalar>::new(target, &occluders(balls)) else {
            panic!("no buffer for {} balls", balls.len());
        };
        let mut count = 0;
        for round in 0..1200 {
            // Groups of start points. In the first four rounds out of six they are on a sphere with
            // a radius from 0.01 to 10,000 around a random point. In the fifth they are on the
            // outside of one ball, in the sixth on the outside of two balls.
            let (middle, spread) = (random.point(7.0), [0.01, 1.0, 10.0, 1e4, 0.0, 0.0][round % 6]);
            let pair = [0; 2].map(|_| (random.unit() * balls.len() as f64) as usize);
            let ball_of = |lane: usize| if round % 6 == 4 { pair[0] } else { pair[lane % 2] };
            let normals: Vec<DVec3> =
                (0..L::WIDTH).map(|_| random.point(1.0).normalize()).collect();
            let point = |lane: usize| {
                let BoundingSphere { center, radius } = balls[ball_of(lane)];
                match round % 6 {
                    4 | 5 => center + normals[lane] * (radius + 1e-4),
                    _ => middle + normals[lane] * spread,
                }
            };
            let axis = |a: usize| L::from_fn(|i| L::Scalar::from_f64(point(i)[a]));
            let origin = Vec3::new(axis(0), axis(1), axis(2));
            let (direction, t_max) = match target {
                LightTarget::Direction(d) => (Vec3::of(d.to_array()), L::from_f64(L::MAX)),
                LightTarget::Ball(light) => {
                    let to = Vec3::of(light.center.to_array()) - origin;
                    let distance = to.length_squared().sqrt();
                    (to * (L::one() / distance), distance)
                }
            };
            let ray = Ray { origin, direction };
            let normal = |a: usize| L::from_fn(|i| L::Scalar::from_f64(normals[i][a]));
            let facing = Vec3::new(normal(0), normal(1), normal(2)).dot(direction);
            let active = facing.gt(L::zero());
            let (first_primitive, second_primitive) =
                (L::from_id(ball_of(0) as u32), L::from_id(ball_of(1) as u32));
            let odd = L::from_fn(|i| L::Scalar::from_f64((i % 2) as f64)).gt(L::zero());
            let (start_primitive, starts_outside) =
                (L::select(odd, second_primitive, first_primitive), L::mask(round % 6 >= 4));
            let all = geometry.all();
            let expected = geometry.occluded(&ray, t_max, active, all) & active;
            let start = RayStart { primitive: start_primitive, outside: starts_outside };
            let found = buffer.occluded(&geometry, &ray, start, t_max, active, all) & active;
            assert_eq!(found.bits(), expected.bits(), "{target:?}, round {round}");
            count += found.bits().count_ones() as usize;
        }
        count
    }

    #[test]
    fn light_buffer_shadows_equal_bvh_shadows() {
        let mut random = Random(1);
        let lights = [
            LightTarget::point(DVec3::new(1.0, 2.0, -0.5)),
            LightTarget::point(DVec3::new(0.0, 19.0, 0.0)),
            LightTarget::Direction(DVec3::new(0.2, -0.9, 0.4).normalize()),
            LightTarget::Direction(DVec3::Z),
        ];
        for target in &lights {
            for (count, radius) in [(3, 8.0), (100, 0.5), (400, 0.3), (60, 1.5)] {
                let balls = balls(&mut random, count, radius);
                let occluded = compare::<Single>(target, &balls, &mut random);
                assert!(occluded > 100, "{target:?}, {count} balls: {occluded} occluded");
                compare::<Double>(target, &balls, &mut random);
            }
        }
    }

    /// Checks the shadows of a light buffer with cells whose list of occluders is full. Rays that
    /// start beyond the distance from the light up to which such a list is complete must traverse
    /// the BVH.
    #[test]
    fn light_buffer_falls_back_to_bvh_behind_full_cells() {
        let mut random = Random(4);
        let mut balls = balls(&mut random, 100, 0.5);
        let cluster_ball =
            |_| BoundingSphere { center: random.point(0.3), radius: 0.05 + 0.2 * random.unit() };
        balls.extend((0..70).map(cluster_ball));
        for target in
            [LightTarget::point(DVec3::new(0.0, 4.0, 4.0)), LightTarget::Direction(DVec3::X)]
        {
            let buffer = LightBuffer::<f32>::new(&target, &occluders(&balls)).expect("a buffer");
            assert!(buffer.cells.iter().any(|cell| cell.complete_to < f32::INFINITY), "{target:?}");
            let mut random = Random(5);
            assert!(compare::<Single>(&target, &balls, &mut random) > 100);
            compare::<Double>(&target, &balls, &mut random);
        }
    }

    /// Checks that the far side of a ball occludes light from points inside the ball.
    #[test]
    fn shadow_ray_from_inside_is_occluded_by_its_own_primitive() {
        let balls = [
            BoundingSphere { center: DVec3::ZERO, radius: 1.0 },
            BoundingSphere { center: DVec3::X * 5.0, radius: 1.0 },
        ];
        let forms = balls.map(|b| Form::Sphere(SphereForm { center: b.center, radius: b.radius }));
        let geometry = Aggregate::<Single>::with_bvh(&forms, true);
        let target = LightTarget::point(DVec3::Y * 9.0);
        let buffer = LightBuffer::<f32>::new(&target, &occluders(&balls)).expect("a buffer");
        let ray = Ray { origin: Vec3::<Single>::zero(), direction: Vec3::of([0.0, 1.0, 0.0]) };
        let occluded = |outside| {
            let start = RayStart { primitive: Single::from_id(0), outside: Single::mask(outside) };
            let (t_max, active) = (Single::from_f64(9.0), Single::mask(true));
            buffer.occluded(&geometry, &ray, start, t_max, active, geometry.all())
        };
        assert!(occluded(false).all());
        // A ray with `starts_outside` is not tested against its own primitive, even if it starts
        // inside.
        assert!(occluded(true).none());
    }

    #[test]
    fn light_buffer_cells_have_few_entries() {
        let mut random = Random(3);
        let light = LightTarget::point(DVec3::ZERO);
        let buffer =
            LightBuffer::<f32>::new(&light, &occluders(&balls(&mut random, 400, 0.3))).unwrap();
        let mean = buffer.entries.len() as f64 / buffer.cells.len() as f64;
        assert!(mean < 4.0, "{mean} entries per cell");
        let too_large = balls(&mut random, 4000, 3.0);
        assert!(LightBuffer::<f32>::new(&light, &occluders(&too_large)).is_none());
    }
}
