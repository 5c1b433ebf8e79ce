//! Choice of emitters by importance, in scenes with many of them.
//!
//! Emitters of one light group, and those of all groups with several lights, form a binary tree:
//! consecutive ones in the order of a Morton curve.
//! The scene is divided into cells. Each cell has a list of *clusters*, which are subtrees that
//! together contain every emitter once, and a table of *slots*, whose number is a power of two. A
//! cluster has slots in proportion to its importance for the cell: its power, its distance, and the
//! directions that it emits into (Conty Estevez and Kulla 2018, *Importance Sampling of Many Lights
//! with Adaptive Tree Splitting*). Every cluster has at least one slot.
//!
//! A random number chooses a slot. Its fraction chooses an emitter of the cluster in proportion to
//! power, and what is left of it a point of the emitter. So Sobol points stay stratified over the
//! emitters and their surfaces. A path chooses at each surface once from each of several equal
//! parts (*ways*) of the slots.
//!
//! Powers are those of the lights without the light weights of their groups. Probabilities therefore
//! do not depend on light weights.

use glam::DVec3;
use std::collections::BinaryHeap;
use std::ops::Range;
use zerkalo_kernel::bvh::{Ray, morton_code};
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, Vec3, array_from_fn};
use zerkalo_kernel::primitive::BoundingSphere;
use zerkalo_scene::value::sort_by_number;

/// Smallest number of emitters in a scene for which paths choose.
pub(crate) const MIN_EMITTERS: usize = 16;

/// Largest number of choices at a surface from the emitters of a tree.
pub(crate) const MAX_WAYS: usize = 2;

/// Largest number of emitters of a tree that are all asked where a highlight or a reflection
/// may show any one of them.
const MAX_ASKED: usize = 128;

/// Largest number of clusters in a cell.
const MAX_CLUSTERS: usize = 128;

/// Smallest number of slots per cluster.
const SLOTS_PER_CLUSTER: usize = 4;

/// Largest number of cells.
const MAX_CELLS: usize = 128;

/// Square of the smallest distance at which importance still grows, relative to the radii of cell
/// and cluster. The mean of 1 / distance^2 over a cube is that at this fraction of the radius of the
/// sphere around it.
const NEAR: f64 = 0.17;

/// Smallest factor of importance for receivers that are turned away: the normals of a cell differ
/// from the direction that it faces.
const MIN_RECEIVED: f64 = 0.1;

/// Emitter as its importance is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterBounds {
    pub ball: BoundingSphere,
    /// Normal of the only side that emits light; `None` if light goes into all directions.
    pub normal: Option<DVec3>,
    /// Power relative to the emitters of its tree; greater than 0 and finite.
    pub power: f64,
}

/// Directions that the surfaces of a cell may face, in the order of their tables.
const NORMALS: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];

/// Surfaces inside a sphere whose normals are closest to `facing`; `None` for any normals.
struct Receivers {
    ball: BoundingSphere,
    facing: Option<DVec3>,
}

/// Subtree: the emitters `first..end` in the order of the Morton curve.
#[derive(Debug)]
struct Node {
    first: u32,
    end: u32,
    /// Number of the first of two consecutive nodes; `None` for a single emitter.
    children: Option<u32>,
    bounds: EmitterBounds,
    /// Cosine of the largest angle between an emitter's normal and that of the bounds.
    cos_spread: f64,
}

/// First emitter and first slot of a cluster. The next cluster's are the ends.
#[derive(Clone, Copy, Debug)]
struct Cluster<S> {
    emitter: u32,
    slot: S,
}

/// Cells: equal cubes that fill a box.
#[derive(Debug)]
struct Grid<S> {
    low: [S; 3],
    per_unit: S,
    size: [u32; 3],
}

/// Emitters of a tree, of which paths choose a few at each surface.
#[derive(Debug)]
pub(crate) struct EmitterChoice<S> {
    grid: Grid<S>,
    nodes: Vec<Node>,
    /// Numbers of the emitters in the order of the Morton curve.
    emitters: Vec<u32>,
    /// Sum of the powers of all emitters before each one, in the same order, and of all.
    sums: Vec<f64>,
    /// Number of choices at each surface.
    pub ways: usize,
    /// `true` if rays see all emitters.
    pub all_visible: bool,
    /// `true` if samples are multiplied by the emission of some emitters.
    pub colored: bool,
    slots: usize,
    /// Cluster of each slot of each cell.
    cluster_of: Vec<u16>,
    /// Clusters of each cell, and their end.
    clusters: Vec<Cluster<S>>,
    clusters_per_cell: usize,
}

/// Cells of the surfaces in the lanes of a packet.
pub(crate) struct Cells {
    /// Cells of surfaces that face as those do.
    pub facing: [u32; MAX_WIDTH],
    /// Cells of surfaces that face any direction.
    pub all: [u32; MAX_WIDTH],
}

/// Emitters that the lanes of a packet have chosen.
pub(crate) struct Chosen<L> {
    pub emitters: [u32; MAX_WIDTH],
    /// Places of the emitters in the order of the Morton curve.
    pub places: [u32; MAX_WIDTH],
    /// Expected number of times that the emitter is chosen at the surface.
    pub expected: L,
    /// Numbers in [0, 1) for a point of the emitter.
    pub numbers: (L, L),
}

impl<S: Float> EmitterChoice<S> {
    /// Creates the choice among `emitters`, which are numbers and bounds. `low` and `high` are the
    /// corners of a box with most of the surfaces that they light.
    pub fn new(mut emitters: Vec<(u32, EmitterBounds)>, (low, high): (DVec3, DVec3)) -> Self {
        let centers = || emitters.iter().map(|(_, bounds)| bounds.ball.center);
        let least = centers().reduce(DVec3::min).unwrap_or_default();
        let most = centers().reduce(DVec3::max).unwrap_or_default();
        let extent = (most - least).max_element().max(f64::MIN_POSITIVE);
        let morton = |center: DVec3| morton_code(((center - least) / extent).to_array());
        sort_by_number(&mut emitters, |(_, bounds)| morton(bounds.ball.center) as i64);
        let count = emitters.len();
        let bounds: Vec<EmitterBounds> = emitters.iter().map(|(_, bounds)| *bounds).collect();
        let mut nodes = vec![Node::new(&bounds, 0, count)];
        let mut next = 0;
        while next < nodes.len() {
            let (first, end) = (nodes[next].first as usize, nodes[next].end as usize);
            if end - first > 1 {
                nodes[next].children = Some(nodes.len() as u32);
                let middle = first.midpoint(end);
                nodes.extend([Node::new(&bounds, first, middle), Node::new(&bounds, middle, end)]);
            }
            next += 1;
        }
        let mut sum = 0.0;
        let sums = std::iter::once(0.0).chain(bounds.iter().map(|bounds| {
            sum += bounds.power;
            sum
        }));
        let clusters_per_cell = count.min(MAX_CLUSTERS);
        let cells = if count > 1 { MAX_CELLS } else { 1 };
        let mut choice = Self {
            grid: Grid::new((low, high), cells),
            nodes,
            emitters: emitters.iter().map(|(number, _)| *number).collect(),
            sums: sums.collect(),
            ways: MAX_WAYS.min(1 << count.ilog2()),
            all_visible: true,
            colored: false,
            slots: (clusters_per_cell * SLOTS_PER_CLUSTER).next_power_of_two(),
            cluster_of: Vec::new(),
            clusters: Vec::new(),
            clusters_per_cell,
        };
        let facings = NORMALS.iter().map(|normal| Some(DVec3::from(*normal)));
        for facing in facings.chain([None]) {
            for cell in 0..choice.grid.count() {
                choice.add_cell(&Receivers { ball: choice.grid.ball(cell), facing });
            }
        }
        choice
    }

    /// Adds the clusters and slots of the next cell, which has the surfaces `cell`.
    fn add_cell(&mut self, cell: &Receivers) {
        // Subtrees by the gain of a division; bits of positive numbers are in the order of the numbers.
        let entry = |node: u32| {
            let (of, ball) = (&self.nodes[node as usize], self.nodes[node as usize].bounds.ball);
            let width = ball.radius / (ball.radius + ball.center.distance(cell.ball.center));
            ((of.importance(cell) * width).to_bits(), node)
        };
        let is_leaf = |node: &u32| self.nodes[*node as usize].children.is_none();
        let mut cut: Vec<u32> = Vec::with_capacity(self.clusters_per_cell);
        let mut heap = BinaryHeap::new();
        match self.clusters_per_cell == self.emitters.len() {
            true => cut.extend((0..self.nodes.len() as u32).filter(is_leaf)),
            false => heap.push(entry(0)),
        }
        while let Some((_, node)) = heap.pop() {
            match self.nodes[node as usize].children {
                Some(child) if cut.len() + heap.len() + 2 <= self.clusters_per_cell => {
                    heap.extend([entry(child), entry(child + 1)]);
                }
                Some(_) | None => cut.push(node),
            }
        }
        cut.sort_by_key(|node| self.nodes[*node as usize].first);
        let importances: Vec<f64> =
            cut.iter().map(|node| self.nodes[*node as usize].importance(cell)).collect();
        let total: f64 = importances.iter().sum();
        let free = (self.slots - cut.len()) as f64 / total;
        let (mut sum, mut slot) = (0.0, 0);
        for (number, node) in cut.iter().enumerate() {
            let emitter = self.nodes[*node as usize].first;
            self.clusters.push(Cluster { emitter, slot: S::from_f64(f64::from(slot)) });
            sum += importances[number];
            let end = match number + 1 == cut.len() {
                true => self.slots as u32,
                false => (sum * free) as u32 + number as u32 + 1,
            };
            self.cluster_of.extend((slot..end).map(|_| number as u16));
            slot = end;
        }
        let slot = S::from_f64(f64::from(slot));
        self.clusters.push(Cluster { emitter: self.emitters.len() as u32, slot });
    }

    /// Returns the cells of surfaces at `points` with the normals `normals`.
    #[inline(always)]
    pub fn cells<L: SimdFloat<Scalar = S>>(&self, points: Vec3<L>, normals: Vec3<L>) -> Cells {
        let number = |x: f64| L::from_f64(x);
        let side =
            |x: L, first: f64| L::select(x.gt(L::zero()), number(first), number(first + 1.0));
        let Vec3 { x, y, z } = normals;
        let along_y = L::select(y.abs().ge(z.abs()), side(y, 2.0), side(z, 4.0));
        let along_x = x.abs().ge(y.abs()) & x.abs().ge(z.abs());
        let facing = L::select(along_x, side(x, 0.0), along_y);
        let (cells, count) = (self.grid.cells(points), self.grid.count());
        let facing = |lane: usize| if lane < L::WIDTH { facing.lane(lane).to_u32() } else { 0 };
        let all = |lane: usize| cells[lane] + NORMALS.len() as u32 * count;
        Cells {
            facing: array_from_fn(|lane| cells[lane] + facing(lane) * count),
            all: array_from_fn(all),
        }
    }

    /// Chooses an emitter in each lane from one of the parts of the slots of its cell. `numbers` are
    /// uniform in [0, 1).
    #[inline(always)]
    pub fn choose<L: SimdFloat<Scalar = S>>(
        &self,
        cells: &[u32; MAX_WIDTH],
        way: usize,
        numbers: (L, L),
    ) -> Chosen<L> {
        let per_way = self.slots / self.ways;
        // The product with a power of two is exact, so it is less than the number of slots.
        let place = numbers.0 * L::from_f64(per_way as f64);
        let mut clusters = [[0; MAX_WIDTH]; 2];
        let mut slots = [[S::default(); MAX_WIDTH]; 2];
        for lane in 0..L::WIDTH {
            let cell = cells[lane] as usize;
            let slot = way * per_way + place.lane(lane).to_u32() as usize;
            let number = self.cluster_of[cell * self.slots + slot];
            let cluster = cell * (self.clusters_per_cell + 1) + number as usize;
            let (start, end) = (self.clusters[cluster], self.clusters[cluster + 1]);
            (clusters[0][lane], clusters[1][lane]) = (start.emitter, end.emitter);
            (slots[0][lane], slots[1][lane]) = (start.slot, end.slot);
        }
        let [start, end] = slots.map(|slots| L::from_fn(|lane| slots[lane]));
        let count = end - start;
        let mut expected = count * L::from_f64(self.ways as f64 / self.slots as f64);
        let mut rest = (place + (L::from_f64((way * per_way) as f64) - start)) / count;
        let [mut emitters, ends] = clusters;
        if self.clusters_per_cell < self.emitters.len() {
            let mut found = [[S::default(); MAX_WIDTH]; 2];
            for lane in 0..L::WIDTH {
                // Numbers in single precision are the lower ends of 2^24 intervals.
                let half = 0.25 * S::EPSILON * per_way as f64 / count.lane(lane).to_f64();
                let within = rest.lane(lane).to_f64() + half;
                let (place, share, rest) = self.choose_in(emitters[lane]..ends[lane], within);
                emitters[lane] = place;
                (found[0][lane], found[1][lane]) = (S::from_f64(share), S::from_f64(rest));
            }
            expected *= L::from_fn(|lane| found[0][lane]);
            rest = L::from_fn(|lane| found[1][lane]);
        }
        let places = emitters;
        let emitters = places.map(|place| self.emitters[place as usize]);
        let rest = rest.max(L::zero()).min(L::from_f64(1.0 - S::EPSILON));
        Chosen { places, emitters, expected, numbers: (rest, numbers.1) }
    }

    /// Chooses one of the emitters `cluster` in proportion to power by `number` in [0, 1). Returns
    /// its place, its probability, and the rest of the number.
    #[inline(always)]
    fn choose_in(&self, cluster: Range<u32>, number: f64) -> (u32, f64, f64) {
        let (first, end) = (cluster.start as usize, cluster.end as usize);
        let (low, high) = (self.sums[first], self.sums[end]);
        let sum = low + number * (high - low);
        let chosen = first + self.sums[first + 1..end].partition_point(|s| *s <= sum);
        let (before, after) = (self.sums[chosen], self.sums[chosen + 1]);
        let power = after - before;
        (chosen as u32, power / (high - low), (sum - before) / power)
    }

    /// Returns the expected number of times that the emitter at `place` in the order of the Morton
    /// curve is chosen at a surface at each point of `points`, whatever direction it faces.
    #[inline(always)]
    pub fn expected_at<L: SimdFloat<Scalar = S>>(&self, points: Vec3<L>, place: u32) -> L {
        let cells = self.grid.cells(points);
        let first = NORMALS.len() as u32 * self.grid.count();
        L::from_fn(|i| S::from_f64(self.expected(first + cells[i], place as usize)))
    }

    /// Returns the expected number of times that the emitter at `place` is chosen in `cell`.
    #[inline(always)]
    pub fn expected(&self, cell: u32, place: usize) -> f64 {
        let first = cell as usize * (self.clusters_per_cell + 1);
        let clusters = &self.clusters[first..=first + self.clusters_per_cell];
        let next = match self.clusters_per_cell == self.emitters.len() {
            true => place + 1,
            false => clusters.partition_point(|cluster| cluster.emitter as usize <= place),
        };
        let (start, end) = (clusters[next - 1], clusters[next]);
        let power = |first: usize, end: usize| self.sums[end] - self.sums[first];
        let share = power(place, place + 1) / power(start.emitter as usize, end.emitter as usize);
        let slots = end.slot.to_f64() - start.slot.to_f64();
        share * slots * (self.ways as f64 / self.slots as f64)
    }

    /// Returns `true` if there are few enough emitters to ask all at glossy surfaces. Rays that were
    /// sampled from a lobe then start where all are asked.
    pub fn few(&self) -> bool {
        self.emitters.len() <= MAX_ASKED
    }

    /// Returns the numbers of the emitters in the order of the Morton curve.
    pub fn emitters(&self) -> &[u32] {
        &self.emitters
    }

    /// Returns a sphere around all emitters.
    pub fn ball(&self) -> BoundingSphere {
        self.nodes[0].bounds.ball
    }

    /// Calls `found` for each emitter whose bounds a ray of `lanes` meets before `t_max`.
    #[inline(always)]
    pub fn near_rays<L: SimdFloat<Scalar = S>>(
        &self,
        ray: &Ray<L>,
        (t_max, lanes): (L, L::Mask),
        mut found: impl FnMut(u32),
    ) {
        let (mut stack, mut len) = ([0; 2 * u32::BITS as usize], 1);
        while len > 0 {
            len -= 1;
            let Node { children, first, bounds, .. } = &self.nodes[stack[len] as usize];
            let to_center = Vec3::of(bounds.ball.center.to_array()) - ray.origin;
            let along = to_center.dot(ray.direction);
            let distance2 = to_center.length_squared();
            let across2 = (to_center - ray.direction * along).length_squared();
            // Includes rounding errors of 1e-6 of the distance.
            let radius = bounds.ball.radius.min(1e18);
            let reach2 = L::from_f64(1.01 * radius * radius) + distance2 * L::from_f64(1e-10);
            let ahead = (along - t_max).le(reach2.sqrt()) & (-along).le(reach2.sqrt());
            if (lanes & across2.le(reach2) & ahead).none() {
                continue;
            }
            match children {
                Some(child) => {
                    (stack[len], stack[len + 1]) = (*child, child + 1);
                    len += 2;
                }
                None => found(self.emitters[*first as usize]),
            }
        }
    }
}

impl Node {
    fn new(emitters: &[EmitterBounds], first: usize, end: usize) -> Self {
        let emitters = &emitters[first..end];
        let balls = || emitters.iter().map(|bounds| bounds.ball);
        let corner =
            |ball: BoundingSphere, sign: f64| ball.center + DVec3::splat(sign * ball.radius);
        let low = balls().map(|ball| corner(ball, -1.0)).reduce(DVec3::min).unwrap_or_default();
        let high = balls().map(|ball| corner(ball, 1.0)).reduce(DVec3::max).unwrap_or_default();
        let center = 0.5 * (low + high);
        let radius = balls().map(|ball| ball.center.distance(center) + ball.radius);
        let ball = BoundingSphere { center, radius: radius.fold(0.0, f64::max) };
        let power = emitters.iter().map(|bounds| bounds.power).sum();
        let normals: Option<Vec<DVec3>> = emitters.iter().map(|bounds| bounds.normal).collect();
        let mean = normals.as_ref().and_then(|list| list.iter().sum::<DVec3>().try_normalize());
        let cosines = normals.iter().flatten().map(|n| n.dot(mean.unwrap_or_default()));
        let cos_spread = cosines.fold(1.0, f64::min);
        let bounds = EmitterBounds { ball, normal: mean, power };
        Self { first: first as u32, end: end as u32, children: None, bounds, cos_spread }
    }

    /// Returns the importance for the surfaces in `cell`.
    fn importance(&self, cell: &Receivers) -> f64 {
        let Receivers { ball: cell, facing } = cell;
        let EmitterBounds { ball, normal, power } = self.bounds;
        let to_cell = cell.center - ball.center;
        let reach = ball.radius + cell.radius;
        let distance2 = to_cell.length_squared();
        let importance = power / (distance2 + NEAR * reach * reach).max(f64::MIN_POSITIVE);
        let sin2 = reach * reach / distance2;
        if sin2 >= 1.0 {
            return importance;
        }
        let width = unit((1.0 - sin2).sqrt());
        let cos_to = |axis: DVec3| unit(axis.dot(to_cell) / distance2.sqrt());
        let emitted = normal.map_or(1.0, |normal| {
            let angle = smaller(cos_to(normal), unit(self.cos_spread));
            smaller(angle, width).0.max(0.0)
        });
        let received =
            facing.map_or(1.0, |facing| smaller(cos_to(-facing), width).0.max(MIN_RECEIVED));
        importance * emitted * received
    }
}

/// Returns the cosine and the sine of an angle from 0 to pi, from its cosine.
fn unit(cos: f64) -> (f64, f64) {
    (cos, (1.0 - cos * cos).max(0.0).sqrt())
}

/// Returns the cosine and the sine of the larger of a - b and 0, from those of the angles a and b.
fn smaller((cos_a, sin_a): (f64, f64), (cos_b, sin_b): (f64, f64)) -> (f64, f64) {
    if cos_a >= cos_b {
        return (1.0, 0.0);
    }
    (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b)
}

impl<S: Float> Grid<S> {
    /// Divides the box between the corners `low` and `high` into at most `max_cells` cells.
    fn new((low, high): (DVec3, DVec3), max_cells: usize) -> Self {
        let extent = (high - low).max(DVec3::ZERO);
        let size = |edge: f64| extent.to_array().map(|x| ((x / edge).ceil() as u32).max(1));
        let cells = |edge: f64| size(edge).map(f64::from).iter().product::<f64>();
        let mut edge = extent.max_element().max(f64::MIN_POSITIVE) / max_cells as f64;
        while cells(edge) > max_cells as f64 {
            edge *= 1.05;
        }
        let low = low.to_array().map(S::from_f64);
        Self { low, per_unit: S::from_f64(1.0 / edge), size: size(edge) }
    }

    fn count(&self) -> u32 {
        self.size.iter().product()
    }

    /// Returns the number of the cell of each lane's point.
    #[inline(always)]
    fn cells<L: SimdFloat<Scalar = S>>(&self, points: Vec3<L>) -> [u32; MAX_WIDTH] {
        let place = (points - Vec3::splat(self.low)) * L::splat(self.per_unit);
        array_from_fn(|lane| {
            let [x, y, z] = match lane < L::WIDTH {
                true => place.lane(lane),
                false => [S::default(); 3],
            };
            // The conversion returns 0 for negative numbers.
            let [x, y, z] = [(x, 0), (y, 1), (z, 2)].map(|(x, i)| x.to_u32().min(self.size[i] - 1));
            x + self.size[0] * (y + self.size[1] * z)
        })
    }

    /// Returns a sphere around the cell with the number `cell`.
    fn ball(&self, cell: u32) -> BoundingSphere {
        let [x, y, _] = self.size;
        let place = [cell % x, cell / x % y, cell / (x * y)].map(|i| f64::from(i) + 0.5);
        let edge = 1.0 / self.per_unit.to_f64();
        let center = DVec3::from(self.low.map(S::to_f64)) + edge * DVec3::from(place);
        BoundingSphere { center, radius: 0.75_f64.sqrt() * edge }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns emitters in the unit cube, every third of which emits into one hemisphere.
    fn emitters(count: u32) -> Vec<(u32, EmitterBounds)> {
        let emitter = |i: u32| {
            let number = |k: u32| f64::from((i + 1) * k % 1009) / 1009.0;
            let center = DVec3::new(number(331), number(577), number(811));
            let ball = BoundingSphere { center, radius: 0.01 };
            let normal = i.is_multiple_of(3).then(|| (center - DVec3::splat(0.5)).normalize());
            (i, EmitterBounds { ball, normal, power: if i == 7 { 1.0 } else { 0.01 * number(97) } })
        };
        (0..count).map(emitter).collect()
    }

    #[test]
    fn emitters_are_chosen_as_often_as_expected() {
        for count in [1, 3, 100, 1000] {
            let choice = EmitterChoice::<f64>::new(emitters(count), (DVec3::ZERO, DVec3::ONE));
            let expected = |cell, place| choice.expected(cell, place);
            let mut place_of = vec![0; count as usize];
            for (place, emitter) in choice.emitters.iter().enumerate() {
                place_of[*emitter as usize] = place;
            }
            for cell in (0..7 * choice.grid.count()).step_by(397) {
                let places = 0..count as usize;
                let sum: f64 = places.clone().map(|place| expected(cell, place)).sum();
                assert!((sum - choice.ways as f64).abs() < 1e-9, "{count}: {sum}");
                let mut found = vec![0.0; count as usize];
                let points = 1 << 12;
                for i in 0..points {
                    let numbers =
                        ((f64::from(i / choice.ways as u32) + 0.5) / f64::from(points), 0.5);
                    let numbers = (numbers.0 * choice.ways as f64, numbers.1);
                    let way = i as usize % choice.ways;
                    let chosen = choice.choose::<f64>(&[cell; MAX_WIDTH], way, numbers);
                    assert!((0.0..1.0).contains(&chosen.numbers.0));
                    let (times, place) = (chosen.expected, place_of[chosen.emitters[0] as usize]);
                    assert!((times - expected(cell, place)).abs() < 1e-9 * times);
                    found[place] += choice.ways as f64 / f64::from(points);
                }
                for place in places {
                    let off = (found[place] - expected(cell, place)).abs();
                    assert!(
                        off < 4.0 * choice.ways as f64 / f64::from(points),
                        "{count}, {place}: {off}"
                    );
                }
            }
        }
    }

    #[test]
    fn emitters_that_are_near_bright_and_turned_to_a_cell_are_chosen_most() {
        let of = |x: f64, up: f64, power: f64| {
            let ball = BoundingSphere { center: DVec3::new(x, 1.0, 0.0), radius: 0.1 };
            EmitterBounds { ball, normal: Some(DVec3::new(0.0, up, 0.0)), power }
        };
        let usual = of(5.0, -1.0, 1.0);
        let (low, high) = (DVec3::new(4.0, -1.0, -1.0), DVec3::new(6.0, -0.5, 1.0));
        for other in [of(-5.0, -1.0, 1.0), of(5.0, 1.0, 1.0), of(5.0, -1.0, 0.1)] {
            let choice = EmitterChoice::<f32>::new(vec![(0, usual), (1, other)], (low, high));
            let place = choice.emitters.iter().position(|e| *e == 0).unwrap();
            let point = Vec3::<f32>::of([5.0, -0.8, 0.0]);
            let [cell, ..] = choice.cells(point, Vec3::of([0.1, 0.9, 0.2])).facing;
            let share = choice.expected(cell, place) / choice.ways as f64;
            assert!(share > 0.7, "{share}: {other:?}");
        }
    }
}
