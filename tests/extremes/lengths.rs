//! Lengths of directions: a direction of any length that a file can contain gives the same picture.

use crate::harness::*;

/// Scene that sets every key whose value is a direction.
const TEXT: &str = "
    film.size = [24, 18]
    camera = { eye = [0.5, 1.5, 5.0], direction = [-0.125, -0.25, -1.0], up = [0.125, 1.0, 0.0] }
    ambient.color = [0.25, 0.25, 0.25]
    materials.mirror = { reflection = 0.75, roughness = 0.125 }
    materials.checked.texture.checker = { scale = [2.0, 2.0] }
    [[light]]
    directional = { direction = [-0.5, -1.0, -0.75] }
    [[object]]
    material = \"checked\"
    shape.plane = { point = [0.0, -0.5, 0.0], normal = [0.125, 1.0, 0.25] }
    [[object]]
    material = \"mirror\"
    shape.rectangle = { center = [0.0, 1.0, -2.0], size = [3.0, 2.0], normal = [0.25, 0.125, 1.0], up = [0.25, 1.0, 0.0] }
    [[object]]
    shape.box = { center = [0.0, 0.5, 0.0], size = [1.0, 1.0, 1.0] }
    transform = [{ rotate = { axis = [0.5, 1.0, 0.25], degrees = 30.0 } }]
";

/// Collects the names of all keys whose value is a direction. Compounds contain shapes again; the
/// search therefore ends at depth 8.
fn directions(fields: &[Field], depth: usize, out: &mut BTreeSet<&'static str>) {
    for field in fields.iter().filter(|_| depth < 8) {
        match field.takes {
            ValueType::Direction => {
                out.insert(field.name);
            }
            ValueType::Table(inner)
            | ValueType::OneOf(inner)
            | ValueType::ListOf(inner)
            | ValueType::Named(inner) => directions(inner, depth + 1, out),
            ValueType::Tables(inner) => directions(inner(), depth + 1, out),
            _ => {}
        }
    }
}

fn stretched(base: &Scene, factor: f64) -> Scene {
    let mut changed = base.to_table();
    let mut stretched_keys = BTreeSet::new();
    for key in keys(&changed).iter().filter(|key| matches!(key.takes, ValueType::Direction)) {
        let Some(Value::Array(numbers)) = value_at(&mut changed, &key.path) else { continue };
        for number in numbers {
            *number = Value::Float(number.as_float().unwrap() * factor);
        }
        stretched_keys.insert(key.path.last().unwrap().clone());
    }
    let mut all = BTreeSet::new();
    directions(FIELDS, 0, &mut all);
    assert!(
        stretched_keys.iter().map(String::as_str).eq(all),
        "the scene has only {stretched_keys:?}"
    );
    scene_of_table(&changed, &base.resolver)
        .unwrap_or_else(|| panic!("{factor:e}: the scene is invalid"))
}

#[test]
fn length_of_directions_does_not_change_the_picture() {
    let base = parsed(TEXT);
    for precision in [Precision::Single, Precision::Double] {
        let expected = rendered(&base, 1, precision, 4).film.bytes();
        // Powers of two change no bit of the mantissas of directions.
        for exponent in [-1000, -664, -512, 512, 664, 1000] {
            let other = stretched(&base, f64::from(exponent).exp2());
            let found = rendered(&other, 1, precision, 4).film.bytes();
            assert!(found == expected, "2^{exponent} in {precision:?}");
        }
    }
    // Other factors change the last digits, which an 8-bit picture does not show.
    let green_values = |scene: &Scene| {
        let rendering = rendered(scene, 1, Precision::Single, 4);
        let picture = picture(&rendering, zerkalo_render::film::Replicates::Both);
        picture.into_iter().map(|p| p[1]).collect::<Vec<f64>>()
    };
    let expected = green_values(&base);
    assert!(expected.iter().sum::<f64>() > 50.0);
    for length in [1e-300, 1e-200, 1e200, 1e300] {
        let found = green_values(&stretched(&base, length));
        let differing = found.iter().zip(&expected).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
        assert!(differing <= 2, "{length:e}: {differing} pixels differ");
    }
}
