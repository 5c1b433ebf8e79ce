//! First hits of camera rays, for picking objects with a pointer and for auxiliary images.

use crate::world::World;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3, distinct};

/// Object, distance and normal at the first hit of a camera ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Index of the object in the scene; `None` for the background.
    pub object: Option<u32>,
    /// Index of the part of the object that was hit; 0 unless the object is a compound.
    pub part: u32,
    /// Distance from the eye to the hit point in scene units; infinite for the background.
    pub depth: f32,
    /// Unit geometric normal on the side that faces the eye; zero for the background.
    pub normal: [f32; 3],
    /// `true` if the surface reflects rays (mirror or glossy lobe) on the side that faces the eye.
    pub reflects: bool,
}

impl FirstHit {
    /// First hit of a ray that hits no object.
    pub const MISS: Self =
        Self { object: None, part: 0, depth: f32::INFINITY, normal: [0.0; 3], reflects: false };
}

impl<L: SimdFloat> World<L> {
    /// Writes the first hit of the camera ray through each of `points` into `hits`, a slice of the
    /// same length. A point is a position in the picture: a column and a row in pixels, with
    /// fractions.
    pub fn first_hit(&self, points: &[[f64; 2]], hits: &mut [FirstHit]) {
        for (points, hits) in points.chunks(L::WIDTH).zip(hits.chunks_mut(L::WIDTH)) {
            trace_packet(self, points, hits);
        }
    }
}

/// Writes the first hits of at most `WIDTH` camera rays.
fn trace_packet<L: SimdFloat>(world: &World<L>, points: &[[f64; 2]], hits: &mut [FirstHit]) {
    let point = |lane: usize| points[lane.min(points.len() - 1)];
    let corner_directions = Vec3::from_fn(|lane| {
        world.camera.pixel_corner_direction(point(lane).map(|c| c as u32).into())
    });
    let offset = |axis: usize| {
        L::from_fn(|lane| L::Scalar::from_f64(point(lane)[axis] - point(lane)[axis].floor()))
    };
    let ray = world.camera.rays(corner_directions, (offset(0), offset(1)));
    let hit = world.geometry.closest(&ray, world.geometry.all());
    let hit_points = ray.at(hit.t);
    let from_eye = hit_points - Vec3::of(world.camera.eye.to_array());
    let depth = from_eye.dot(from_eye).sqrt();
    hits.fill(FirstHit::MISS);
    for (primitive, lanes) in distinct(hit.primitive, hit.t.lt(L::from_f64(L::MAX))) {
        let normal = world.geometry.surface(primitive, hit.triangle, hit_points).normal;
        let facing = normal.dot(ray.direction);
        let source = &world.geometry.sources[primitive as usize];
        let bsdf = &world.bsdfs[world.bsdf_of[primitive as usize] as usize];
        for (lane, hit) in hits.iter_mut().enumerate().filter(|(l, _)| lanes.lane(*l)) {
            let front = facing.lane(lane).to_f64() < 0.0;
            let side = if front { 1.0 } else { -1.0 };
            let axis = |c: L| (side * c.lane(lane).to_f64()) as f32;
            *hit = FirstHit {
                object: Some(world.objects[source.form]),
                part: source.part as u32,
                depth: depth.lane(lane).to_f64() as f32,
                normal: [axis(normal.x), axis(normal.y), axis(normal.z)],
                reflects: world.depth > 0 && bsdf.reflection.is_some() && (front || bsdf.two_sided),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::lanes::{Double, Single};
    use zerkalo_scene::Scene;

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
        let mut hits = vec![FirstHit::MISS; points.len()];
        world.first_hit(points, &mut hits);
        hits
    }

    /// Checks object, distance and normal of first hits on a sphere and two rectangles. Ten pixels
    /// cover one unit of the picture plane at unit distance from the eye. The depth of the
    /// rectangles is 5; the nearest point of the sphere is 4 units from the eye.
    #[test]
    fn first_hits_have_objects_distances_and_normals() {
        let points = [[15.0, 10.0], [21.0, 10.0], [9.0, 10.0], [15.0, 0.5], [21.0, 19.9]];
        for hits in
            [first_hit::<Single>(&points), first_hit::<Double>(&points), first_hit::<f64>(&points)]
        {
            let objects: Vec<_> = hits.iter().map(|s| s.object).collect();
            assert_eq!(objects, [Some(0), Some(1), Some(2), None, Some(1)]);
            assert_eq!(hits[3], FirstHit::MISS);
            assert_eq!(
                hits.iter().map(|s| s.reflects).collect::<Vec<_>>(),
                [false, true, false, false, true]
            );
            // On the back of a surface, too, the normal points to the side of the eye.
            for hit in [hits[0], hits[1], hits[2]] {
                let [x, y, z] = hit.normal;
                assert!(x.abs() < 1e-5 && y.abs() < 1e-5 && (z - 1.0).abs() < 1e-5, "{hit:?}");
            }
            let distances = [4.0, 5.0 * (1.0f32 + 0.36).sqrt()];
            for (hit, distance) in hits.iter().zip(distances) {
                assert!((hit.depth - distance).abs() < 1e-4, "{hit:?} {distance}");
            }
        }
    }
}
