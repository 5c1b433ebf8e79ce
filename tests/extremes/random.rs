//! Random scenes in the words of scene files: every registered kind, material, light and limit, with
//! places and sizes from 1e-6 to 1e6.

use crate::common::Numbers;
use glam::DVec3;
use std::fmt::Write;
use zerkalo::shape::EXAMPLES;

/// What a random scene may hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contents {
    /// Everything.
    Anything,
    /// Only what gives the same value each time: centres of pixels, hard shadows, perfect mirrors.
    Determined,
}

/// From 1e-6 to 1e6, every power of ten as often.
fn size(numbers: &mut Numbers) -> f64 {
    10f64.powf(numbers.between(-6.0, 6.0))
}

/// Between two sizes, every power of ten as often.
fn between(numbers: &mut Numbers, low: f64, high: f64) -> f64 {
    10f64.powf(numbers.between(low.log10(), high.log10()))
}

fn place(numbers: &mut Numbers) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| match numbers.below(5) {
        0 => 0.0,
        1 | 2 => size(numbers),
        _ => -size(numbers),
    }))
}

fn list(v: DVec3) -> String {
    format!("[{:e}, {:e}, {:e}]", v.x, v.y, v.z)
}

fn color(numbers: &mut Numbers) -> String {
    list(DVec3::from_array(std::array::from_fn(|_| numbers.unit())))
}

fn pick<'a>(numbers: &mut Numbers, from: &[&'a str]) -> &'a str {
    from[numbers.below(from.len())]
}

fn material(numbers: &mut Numbers, contents: Contents) -> String {
    let determined = contents == Contents::Determined;
    let mut text = format!(
        "color = {}\nambient = {:e}\ndiffuse = {:e}\nspecular = {:e}\nexponent = {:e}\n\
         highlight = \"{}\"\nmasking = \"{}\"\ntwo_sided = {}\n",
        color(numbers),
        numbers.unit(),
        numbers.unit(),
        numbers.unit(),
        between(numbers, 1.0, 1e4),
        pick(numbers, &["phong", "cook-torrance"]),
        pick(numbers, &["v-cavity", "smith"]),
        numbers.below(2) == 0,
    );
    if numbers.below(3) > 0 {
        let lobes = ["mirror", "cone", "square", "beckmann", "ggx"];
        let lobe = if determined { "mirror" } else { pick(numbers, &lobes) };
        let roughness = [0.0, between(numbers, 1e-6, 10.0)][numbers.below(2)];
        writeln!(text, "reflection = {:e}\nlobe = \"{lobe}\"", numbers.unit()).unwrap();
        writeln!(text, "roughness = {roughness:e}").unwrap();
    }
    if !determined && numbers.below(4) == 0 {
        let index = between(numbers, 0.1, 10.0);
        writeln!(text, "transmission = {:e}\nindex = {index:e}", numbers.unit()).unwrap();
        if numbers.below(2) == 0 {
            text += "fresnel = \"dielectric\"\n";
        }
    } else if numbers.below(2) == 0 {
        let law = pick(numbers, &["constant", "schlick", "exact"]);
        writeln!(text, "fresnel = \"{law}\"\nreflectance = {}", color(numbers)).unwrap();
    }
    text
}

/// Some kind as its example has it, somewhere, somehow turned and stretched, and where it was put.
fn object(numbers: &mut Numbers, contents: Contents, number: usize) -> (String, DVec3, f64) {
    let (_, example) = EXAMPLES[numbers.below(EXAMPLES.len())];
    let (at, scale) = (place(numbers), size(numbers));
    let stretch = DVec3::from_array(std::array::from_fn(|_| {
        scale * [1.0, 1.0, between(numbers, 1e-2, 1e2)][numbers.below(3)]
    }));
    let stretch = if numbers.below(2) == 0 { DVec3::splat(scale) } else { stretch };
    let text = format!(
        "[materials.m{number}]\n{}[[object]]\nmaterial = \"m{number}\"\n{example}\n\
         transform = [{{ rotate_x = {:e} }}, {{ scale = {} }}, {{ rotate_z = {:e} }}, \
         {{ translate = {} }}]\n",
        material(numbers, contents),
        [0.0, numbers.between(-180.0, 180.0)][numbers.below(2)],
        list(stretch),
        [0.0, numbers.between(-180.0, 180.0)][numbers.below(2)],
        list(at),
    );
    (text, at, scale)
}

fn light(numbers: &mut Numbers, near: DVec3, scale: f64) -> String {
    let kind = if numbers.below(3) == 0 {
        format!("directional = {{ direction = {} }}", list(numbers.direction()))
    } else {
        let at = if numbers.below(2) == 0 {
            near + numbers.direction() * scale * between(numbers, 1.0, 1e3)
        } else {
            place(numbers)
        };
        let falloff = pick(numbers, &["none", "inverse-square"]);
        format!("point = {{ position = {} }}\nfalloff = \"{falloff}\"", list(at))
    };
    let intensity = size(numbers);
    format!("[[light]]\n{kind}\ncolor = {}\nintensity = {intensity:e}\n", color(numbers))
}

/// The text of a scene with so many objects. The camera looks at one of them.
pub fn scene(seed: u64, objects: usize, contents: Contents) -> String {
    let mut numbers = Numbers::new(seed);
    let numbers = &mut numbers;
    let things: Vec<_> = (0..objects).map(|i| object(numbers, contents, i)).collect();
    let (_, at, scale) = things[numbers.below(objects)];
    let eye = if numbers.below(5) == 0 {
        place(numbers)
    } else {
        at + numbers.direction() * scale * between(numbers, 0.1, 1e3)
    };
    let target = at + numbers.in_cube(0.5 * scale);
    let determined = contents == Contents::Determined;
    let filters = ["box", "center"];
    let mut text = format!(
        "[film]\nsize = [9, 7]\nfilter = \"{}\"\n[trace]\nlevel = \"{}\"\ndepth = {}\n\
         min_weight = {:e}\nhorizon = \"{}\"\n[camera]\neye = {}\ntarget = {}\nup = {}\n\
         view_angle.vertical = {:e}\nnear = {:e}\n[background]\ncolor = {}\n[ambient]\ncolor = {}\n",
        if determined { "center" } else { pick(numbers, &filters) },
        pick(numbers, &["primary", "shadows", "full", "full", "full"]),
        numbers.below(9),
        [0.0, 0.1 * numbers.unit()][numbers.below(2)],
        pick(numbers, &["fold", "absorb"]),
        list(eye),
        list(target),
        list(numbers.direction()),
        between(numbers, 1e-3, 179.9),
        [0.0, 0.0, size(numbers)][numbers.below(3)],
        color(numbers),
        color(numbers),
    );
    for _ in 0..1 + numbers.below(3) {
        text += &light(numbers, at, scale);
    }
    things.iter().for_each(|(thing, ..)| text += thing);
    text
}
