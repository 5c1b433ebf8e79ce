//! Random scenes: objects, camera, lights and settings.

use crate::harness::*;
use crate::random_scenes::layouts::Layout;
use crate::random_scenes::objects::{Stock, emission, library, material, resolved};
use crate::random_scenes::words::{KeyValue, chance, direction, log, pick, table};
use zerkalo_kernel::primitive::ParallelogramForm;
use zerkalo_scene::value::Description;
use zerkalo_scene::{FilmSettings, IntegratorSettings};

/// Random scene, with its text.
pub struct Random {
    pub layout: Layout,
    /// Text of the scene file.
    pub text: String,
}

/// Points of a scene at which intersection or shading often fails. Eyes and lights are placed
/// there.
struct Spots {
    /// Points on surfaces of objects, exact up to rounding.
    on: Vec<DVec3>,
    /// Points inside of objects.
    inside: Vec<DVec3>,
    middle: DVec3,
    radius: f64,
}

impl Spots {
    fn new(numbers: &mut Numbers, objects: &[Object], layout: Layout) -> Self {
        let forms: Vec<Form> = objects.iter().take(12).map(|o| resolved(o).form()).collect();
        let on = forms.iter().map(|form| on_surface(numbers, form)).collect();
        let boxes: Vec<_> = forms.iter().filter_map(|form| form.bounds()).collect();
        let mut inside: Vec<_> = boxes.iter().map(|(low, high)| 0.5 * (*low + *high)).collect();
        inside.push(DVec3::Y);
        let (middle, radius) = match (layout, boxes.first()) {
            (Layout::Wild, Some((low, high))) => (inside[0], 0.5 * (*high - *low).length()),
            (Layout::Sparse | Layout::Crowd, _) => (DVec3::ZERO, 4.0),
            _ => (DVec3::Y * 0.5, 2.0),
        };
        Self { on, inside, middle, radius }
    }
}

fn on_surface(numbers: &mut Numbers, form: &Form) -> DVec3 {
    match form {
        Form::Sphere(SphereForm { center, radius }) => {
            *center + *radius * pick(numbers, &[DVec3::Y, DVec3::X, DVec3::Z])
        }
        Form::Plane(PlaneForm { normal, offset }) => {
            let across = normal.any_orthonormal_vector() * numbers.between(-2.0, 2.0);
            *normal * *offset + across
        }
        Form::Parallelogram(ParallelogramForm { corner, u, v }) => {
            *corner + (*u + *v) * pick(numbers, &[0.5, 0.0])
        }
        Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, corners }) => {
            let face = &faces[numbers.below(faces.len())];
            let near = |c: &&DVec3| (face.normal.dot(**c) - face.offset).abs() < 1e-9 * c.length();
            let face_corners: Vec<_> = corners.iter().filter(near).collect();
            face_corners.iter().copied().sum::<DVec3>() / face_corners.len().max(1) as f64
        }
        other => match other.bounds() {
            Some((low, high)) => DVec3::new(0.5 * (low.x + high.x), high.y, 0.5 * (low.z + high.z)),
            None => DVec3::ZERO,
        },
    }
}

/// Returns a random scene with the objects of `layout`. Returns `None` if it has validation errors,
/// such as objects too small for their position.
fn draw(numbers: &mut Numbers, layout: Layout) -> Option<Scene> {
    let finishes = layout.finishes();
    let materials: BTreeMap<String, _> = (0..2 + numbers.below(4))
        .map(|i| (format!("m{i}"), material(numbers, finishes[i % finishes.len()])))
        .collect();
    let names: Vec<String> = materials.keys().cloned().collect();
    let stock = Stock { materials: &names, levels: 1 + numbers.below(3) };
    let objects = layout.objects(numbers, &stock);
    let spots = Spots::new(numbers, &objects, layout);
    let size = film_size(numbers, layout);
    let mut scene = Scene {
        film: FilmSettings { size, ..FilmSettings::default() },
        trace: trace(numbers),
        camera: camera(numbers, &spots, layout),
        lights: lights(numbers, &spots, layout),
        materials,
        objects,
        resolver: library(),
        ..Scene::default()
    };
    if chance(numbers, 1, 4) {
        scene.film.filter = zerkalo_scene::Filter::Point;
    }
    if chance(numbers, 1, 8) {
        scene.film.rays_per_pixel = 8;
    }
    scene.ambient.color = pick(numbers, &[Color::BLACK, Color([0.4; 3]), Color([0.2, 0.1, 0.3])]);
    scene.background.color =
        pick(numbers, &[Color::BLACK, Color([0.3, 0.6, 1.0]), Color([0.01; 3])]);
    if layout != Layout::Wild {
        displace(numbers, &mut scene);
    }
    scene.resolve();
    if !scene.faults().is_empty() {
        // One cause of errors is a shape without the texture coordinates that its texture needs.
        scene.materials.values_mut().for_each(|m| (m.texture, m.bump) = (None, None));
    }
    if !scene.faults().is_empty() {
        return None;
    }
    // Highlights of emissive objects are sampled only by points that are chosen on the objects. In
    // a sharp highlight few samples are bright, and the reported error is too low. Objects
    // therefore emit light only if no material has a highlight.
    if scene.materials.values().all(|material| material.specular == 0.0) {
        for material in scene.materials.values_mut() {
            (material.emission, material.emission_color) = emission(numbers);
        }
    }
    Some(scene)
}

fn film_size(numbers: &mut Numbers, layout: Layout) -> [u32; 2] {
    // Pictures of the layout `Sparse` are large enough for some tiles to be empty.
    const LARGE: [[u32; 2]; 4] = [[96, 80], [128, 64], [160, 128], [40, 30]];
    const USUAL: [[u32; 2]; 5] = [[64, 48], [40, 30], [48, 36], [33, 17], [20, 20]];
    const NARROW: [[u32; 2]; 5] = [[1, 1], [1, 1000], [1000, 1], [3, 70], [90, 2]];
    match layout {
        Layout::Sparse => pick(numbers, &LARGE),
        _ if chance(numbers, 1, 4) => pick(numbers, &NARROW),
        _ => pick(numbers, &USUAL),
    }
}

fn trace(numbers: &mut Numbers) -> IntegratorSettings {
    let key_value: KeyValue = &|numbers: &mut Numbers, field: &Field| match field.name {
        "ray_types" => Some(Value::String(
            pick(numbers, &["full", "full", "full", "full", "shadows", "primary"]).to_string(),
        )),
        "max_depth" => Some(Value::Integer(pick(numbers, &[0, 1, 2, 3, 4, 8, 16, 40]))),
        "max_diffuse_depth" => Some(Value::Integer(pick(numbers, &[0, 0, 0, 1, 2]))),
        "min_throughput" => Some(Value::Float(pick(numbers, &[0.0, 0.01, 0.1]))),
        _ => None,
    };
    let keys: Table = table(numbers, IntegratorSettings::FIELDS, 0.5, key_value);
    let mut trace = IntegratorSettings::from_text(&keys.to_string()).expect("keys of the table");
    trace.acceleration = Acceleration::Auto;
    trace
}

fn camera(numbers: &mut Numbers, spots: &Spots, layout: Layout) -> Camera {
    let target = match numbers.below(3) {
        0 => spots.middle,
        1 => pick(numbers, &spots.inside),
        _ => spots.middle + numbers.in_cube(0.3 * spots.radius),
    };
    let mut angle = numbers.between(20.0, 75.0);
    let around = |numbers: &mut Numbers, distance: f64| {
        let mut away = direction(numbers);
        if chance(numbers, 3, 4) && away.y <= 0.0 {
            away.y = 0.2 - away.y;
        }
        spots.middle + away * (spots.radius * distance)
    };
    let way = if layout == Layout::Sparse { 9 } else { numbers.below(10) };
    let eye = match way {
        0 => pick(numbers, &spots.on),
        1 => pick(numbers, &spots.inside) + numbers.in_cube(0.01 * spots.radius),
        2 | 3 => {
            angle = numbers.between(100.0, 178.0);
            let distance = numbers.between(0.2, 2.0);
            around(numbers, distance)
        }
        4 => {
            angle = numbers.between(1.0, 6.0);
            let distance = log(numbers, 10.0, 300.0);
            around(numbers, distance)
        }
        _ => {
            let distance = numbers.between(1.2, 4.0);
            around(numbers, distance)
        }
    };
    // A camera on a surface or inside an object looks in any direction in half of the cases.
    let look = if way < 2 && chance(numbers, 1, 2) { direction(numbers) } else { target - eye };
    let look = if look == DVec3::ZERO { DVec3::NEG_Z } else { look };
    let ups = [DVec3::Y, DVec3::Y, DVec3::Z, DVec3::new(0.3, 0.9, 0.2)];
    let aims = |up: &&DVec3| up.cross(look).length() > 1e-3 * look.length();
    let first = numbers.below(ups.len());
    let up = ups[first..].iter().chain(&ups).find(aims).copied().unwrap_or(DVec3::X);
    let near = if chance(numbers, 1, 8) { spots.radius * log(numbers, 1e-3, 2.0) } else { 0.0 };
    let (projection, aperture, focus) = lens(eye, near, spots);
    Camera {
        eye: eye.to_array(),
        target: None,
        direction: Some(look.to_array()),
        up: up.to_array(),
        projection,
        view_angle: match numbers.below(3) {
            0 => ViewAngle::Horizontal(angle),
            _ => ViewAngle::Vertical(angle),
        },
        near,
        aperture,
        focus,
    }
}

/// Returns projection, aperture and focus of the camera. One camera in three has a lens; of the others
/// without a near plane, one in eight is a panorama. The random numbers depend on the eye alone, so that
/// all other parts of the scene are the same with and without a lens.
fn lens(eye: DVec3, near: f64, spots: &Spots) -> (Projection, Option<Aperture>, Option<Focus>) {
    let mut numbers =
        Numbers::new(eye.to_array().map(f64::to_bits).into_iter().fold(0, u64::wrapping_add));
    if !chance(&mut numbers, 1, 3) {
        let is_panorama = near == 0.0 && chance(&mut numbers, 1, 8);
        let projection =
            if is_panorama { Projection::Equirectangular } else { Projection::Perspective };
        return (projection, None, None);
    }
    let aperture = match numbers.below(4) {
        0 => Aperture::FNumber(log(&mut numbers, 0.1, 10.0)),
        1 => Aperture::Radius(spots.radius * log(&mut numbers, 1e-9, 1e-3)),
        _ => Aperture::Radius(spots.radius * log(&mut numbers, 1e-3, 1.0)),
    };
    let focus = match numbers.below(3) {
        0 => Focus::Point(pick(&mut numbers, &spots.on).to_array()),
        1 => Focus::Point(pick(&mut numbers, &spots.inside).to_array()),
        _ => Focus::Distance(spots.radius * log(&mut numbers, 1e-2, 1e2)),
    };
    let aims = focus != Focus::Point(eye.to_array());
    (Projection::Perspective, aims.then_some(aperture), aims.then_some(focus))
}

fn lights(numbers: &mut Numbers, spots: &Spots, layout: Layout) -> Vec<Light> {
    let count = pick(numbers, &[0, 1, 1, 1, 1, 2, 2, 2, 3, 14]);
    let light = |i: usize| {
        let far = chance(numbers, 1, 4);
        let narrow = !far && chance(numbers, 1, 4);
        let position = match numbers.below(6) {
            0 => pick(numbers, &spots.on),
            1 => pick(numbers, &spots.inside),
            2 => {
                let height = spots.radius * log(numbers, 1e-3, 1.0);
                pick(numbers, &spots.on) + DVec3::Y * height
            }
            _ => {
                let mut away = direction(numbers);
                away.y = away.y.abs() + 0.1;
                spots.middle + away * (spots.radius * log(numbers, 0.5, 10.0))
            }
        };
        let falloff = pick(numbers, &[Falloff::None, Falloff::InverseSquare]);
        let strongest = if layout == Layout::Wild { 1e6 } else { 10.0 };
        let strength = log(numbers, 1.0 / strongest, strongest);
        let area = if falloff == Falloff::None { 1.0 } else { spots.radius * spots.radius };
        // The order of the draws determines the scenes of all seeds.
        let sun = far.then(|| Directional::along(direction(numbers).to_array()));
        let color = Color([(); 3].map(|()| numbers.unit()));
        let on = chance(numbers, 9, 10);
        let kind = match sun {
            Some(sun) => LightKind::from(sun),
            None if narrow => spot(numbers, position, spots.middle).into(),
            None => Point { position: position.to_array() }.into(),
        };
        Light {
            name: format!("l{i}"),
            color,
            intensity: if far { strength } else { strength * area },
            falloff: if far { Falloff::None } else { falloff },
            on,
            ..Light::new(kind)
        }
    };
    (0..count).map(light).collect()
}

fn spot(numbers: &mut Numbers, position: DVec3, target: DVec3) -> Spot {
    let outer_angle = pick(numbers, &[0.5, 10.0, 30.0, 60.0, 120.0, 180.0]);
    let inner_angle = outer_angle * pick(numbers, &[0.0, 0.5, 1.0]);
    let toward = (target - position).normalize_or(DVec3::NEG_Y);
    let direction = (toward + 0.3 * direction(numbers)).to_array();
    Spot { position: position.to_array(), direction, outer_angle, inner_angle }
}

/// Scales the whole scene with a probability of 1/3, and translates it with a probability of 1/3.
fn displace(numbers: &mut Numbers, scene: &mut Scene) {
    let scale = match numbers.below(3) {
        0 => log(numbers, 1e-4, 1e4),
        _ => 1.0,
    };
    let max_shift = if chance(numbers, 1, 2) { 1e5 } else { 10.0 };
    let shift = match numbers.below(3) {
        0 => numbers.in_cube(max_shift) * scale.max(1e-2),
        _ => DVec3::ZERO,
    };
    let moved = |point: [f64; 3]| (DVec3::from_array(point) * scale + shift).to_array();
    let mut extra = Vec::new();
    if scale != 1.0 {
        extra.push(TransformOp::Scale(Scale([scale; 3])));
    }
    if shift != DVec3::ZERO {
        extra.push(TransformOp::Translate(shift.to_array()));
    }
    scene.objects.iter_mut().for_each(|object| object.transform.extend(extra.iter().copied()));
    scene.camera.eye = moved(scene.camera.eye);
    scene.camera.near *= scale;
    for light in &mut scene.lights {
        if let Some(position) = light.position_mut() {
            *position = moved(*position);
        }
        if light.falloff == Falloff::InverseSquare {
            light.intensity *= scale * scale;
        }
    }
}

pub fn seeds_of(layout: Layout, numbers: Range<u64>) -> impl Iterator<Item = u64> {
    let index = Layout::ALL.iter().position(|l| *l == layout).expect("a layout");
    numbers.map(move |i| i * Layout::ALL.len() as u64 + index as u64)
}

pub fn scene(seed: u64) -> Random {
    let layout = Layout::ALL[seed as usize % Layout::ALL.len()];
    let mut numbers = Numbers::new(seed ^ 0x5ce4_e000_0000_0000);
    let drawn = (0..100).find_map(|_| draw(&mut numbers, layout));
    let scene = drawn.unwrap_or_else(|| panic!("seed {seed}: no scene without faults in 100"));
    Random { layout, text: scene.to_text() }
}
