//! Grid on the ground, which the picture's panel shows for a scene without objects.

use glam::DVec3;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::step_length;
use zerkalo_terminal::cells::Raster;

const DARK: [u8; 3] = [20, 22, 28];
const LINE: [u8; 3] = [72, 78, 92];

/// Returns the grid of lines at height 0, as the camera of `scene` sees it. Squares have ten steps of
/// the arrow keys; lines end where they would be closer than two pixels.
pub fn raster(scene: &Scene, [width, height]: [usize; 2]) -> Raster {
    let camera = &scene.camera;
    let (eye, size) = (DVec3::from_array(camera.eye), scene.film.size.map(f64::from));
    let square = 10.0 * step_length(scene);
    // Position on the ground in squares.
    let ground = |x: usize, y: usize| {
        let at = [(x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64];
        let direction = camera.direction_at(at, size);
        let t = -eye.y / direction.y;
        (t > 0.0 && t.is_finite()).then(|| [0, 2].map(|axis| (eye + direction * t)[axis] / square))
    };
    Raster::from_fn(width, height, |i| {
        let (x, y) = (i % width, i / width);
        let (Some(here), Some(beside), Some(below)) =
            (ground(x, y), ground(x + 1, y), ground(x, y + 1))
        else {
            return DARK;
        };
        let is_line = |axis: usize| {
            let mut near = [beside[axis], below[axis]].into_iter();
            let is_crossed = near.clone().any(|other| other.floor() != here[axis].floor());
            is_crossed && near.all(|other| (other - here[axis]).abs() < 0.5)
        };
        if is_line(0) || is_line(1) { LINE } else { DARK }
    })
}
