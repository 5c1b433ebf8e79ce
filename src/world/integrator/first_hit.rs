//! What the camera sees in one direction: for picking, and for views other than the picture.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::world::compile::World;

/// The first thing on a camera ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Number in the scene's list of objects; `None`: the background.
    pub object: Option<u32>,
    /// Distance from the eye to the point seen, in scene units; infinite for the background.
    pub depth: f32,
    /// Unit geometric normal there in scene axes, on the side that is seen; zero for the background.
    pub normal: [f32; 3],
    /// Whether the surface reflects, on the side that is seen.
    pub reflects: bool,
}

impl FirstHit {
    /// Nothing but background.
    pub const MISS: Self =
        Self { object: None, depth: f32::INFINITY, normal: [0.0; 3], reflects: false };
}

impl<L: SimdFloat> World<L> {
    /// What the camera sees through each of `points` of the raster (columns and rows in pixels, with
    /// fractions), into `seen` of the same length.
    pub fn first_hit(&self, points: &[[f64; 2]], seen: &mut [FirstHit]) {
        for (points, seen) in points.chunks(L::WIDTH).zip(seen.chunks_mut(L::WIDTH)) {
            self.look_at(points, seen);
        }
    }

    /// At most one packet of it.
    fn look_at(&self, points: &[[f64; 2]], seen: &mut [FirstHit]) {
        let point = |lane: usize| points[lane.min(points.len() - 1)];
        let base = Vec3::from_fn(|lane| {
            self.view.pixel_corner_direction(point(lane).map(|c| c as u32).into())
        });
        let within = |axis: usize| {
            L::from_fn(|lane| L::Scalar::from_f64(point(lane)[axis] - point(lane)[axis].floor()))
        };
        let (origin, direction) = self.view.rays(base, (within(0), within(1)));
        let ray = Ray { origin, direction };
        let hit = self.geometry.closest(&ray, self.geometry.all());
        let at = ray.at(hit.t);
        let eye = Vec3::of(self.view.eye().to_array());
        let from_eye = at - eye;
        let depth = from_eye.dot(from_eye).sqrt();
        seen.fill(FirstHit::MISS);
        let mut left = hit.t.lt(L::from_f64(L::MAX)).bits() & lanes_below(points.len());
        while left != 0 {
            let item = hit.item.id_lane(left.trailing_zeros() as usize);
            let here = hit.item.id_eq(item).bits() & left;
            left &= !here;
            let normal = self.geometry.surface(item, hit.triangle, at).normal;
            let facing = normal.dot(direction);
            let finish = &self.bsdfs[self.bsdf_of[item as usize] as usize];
            for (lane, sight) in seen.iter_mut().enumerate().filter(|(l, _)| here >> l & 1 != 0) {
                let front = facing.lane(lane).to_f64() < 0.0;
                let side = if front { 1.0 } else { -1.0 };
                let axis = |c: L| (side * c.lane(lane).to_f64()) as f32;
                *sight = FirstHit {
                    object: Some(self.geometry.sources()[item as usize].form as u32),
                    depth: depth.lane(lane).to_f64() as f32,
                    normal: [axis(normal.x), axis(normal.y), axis(normal.z)],
                    reflects: self.depth > 0
                        && finish.reflection.is_some()
                        && (front || finish.two_sided),
                };
            }
        }
    }
}

/// The first `count` lanes, as bits.
fn lanes_below(count: usize) -> u32 {
    (1 << count) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Single};
    use crate::scene::Scene;

    const SCENE: &str = r#"
        [film]
        size = [30, 20]
        [camera]
        eye = [100.0, 1.0, 5.0]
        direction = [0.0, 0.0, -1.0]
        view_angle.vertical = 90.0
        near = 0.5
        [materials.glass]
        reflection = 0.5
        [materials.one-way]
        reflection = 0.5
        two_sided = false
        [[object]]
        shape.sphere = { center = [100.0, 1.0, 0.0], radius = 1.0 }
        [[object]]
        material = "glass"
        shape.rectangle = { center = [103.0, 1.0, 0.0], size = [2.0, 20.0], normal = [0.0, 0.0, -1.0] }
        [[object]]
        material = "one-way"
        shape.rectangle = { center = [97.0, 1.0, 0.0], size = [2.0, 20.0], normal = [0.0, 0.0, -1.0] }
    "#;

    fn first_hit<L: SimdFloat>(points: &[[f64; 2]]) -> Vec<FirstHit> {
        let world = World::<L>::new(&Scene::parse(SCENE, "test").unwrap());
        let mut seen = vec![FirstHit::MISS; points.len()];
        world.first_hit(points, &mut seen);
        seen
    }

    /// One unit of the picture plane is 10 pixels; the planes of the things are 5 units away.
    #[test]
    fn the_camera_sees_objects_distances_and_normals() {
        let points = [[15.0, 10.0], [21.0, 10.0], [9.0, 10.0], [15.0, 0.5], [21.0, 19.9]];
        for seen in
            [first_hit::<Single>(&points), first_hit::<Double>(&points), first_hit::<f64>(&points)]
        {
            let objects: Vec<_> = seen.iter().map(|s| s.object).collect();
            assert_eq!(objects, [Some(0), Some(1), Some(2), None, Some(1)]);
            assert_eq!(seen[3], FirstHit::MISS);
            assert_eq!(
                seen.iter().map(|s| s.reflects).collect::<Vec<_>>(),
                [false, true, false, false, true]
            );
            // Backs show the side that is seen.
            for sight in [seen[0], seen[1], seen[2]] {
                let [x, y, z] = sight.normal;
                assert!(x.abs() < 1e-5 && y.abs() < 1e-5 && (z - 1.0).abs() < 1e-5, "{sight:?}");
            }
            let distances = [4.0, 5.0 * (1.0f32 + 0.36).sqrt()];
            for (sight, distance) in seen.iter().zip(distances) {
                assert!((sight.depth - distance).abs() < 1e-4, "{sight:?} {distance}");
            }
        }
    }
}
