//! Comparison of the tables of documented keys with the keys that are read and written.

use crate::material::{Bump, Checker, HeightImage, ImageTexture, Texture};
use crate::shape::{CsgOperand, EXAMPLES, KINDS, MAX_DEPTH, Shape};
use crate::value::{DefaultValue, Description, Field, ValueType};
use crate::*;

/// Returns the valid keys of `T`. They are taken from the error message that lists the valid keys
/// after an unknown one was found.
fn keys_of<T: TomlText>() -> Vec<String> {
    let error = match T::from_text("\"no such key\" = 0") {
        Ok(_) => panic!("an unknown key was taken"),
        Err(errors) => errors.messages[0].help.clone(),
    };
    let list = error.strip_prefix("Known: ").unwrap_or_else(|| panic!("{error}"));
    let (list, _) = list.split_once('.').unwrap_or_else(|| panic!("{error}"));
    list.split(", ").map(str::to_string).collect()
}

fn same_keys<T: TomlText>(what: &str, fields: &[Field]) {
    let mut read_keys = keys_of::<T>();
    let mut documented: Vec<_> = fields.iter().map(|f| f.name.to_string()).collect();
    read_keys.sort();
    documented.sort();
    assert_eq!(read_keys, documented, "{what}");
}

/// Checks that the documented defaults of `fields` are the values that missing keys get. `needed`
/// is a TOML table with only the required keys. `what` is the name of the table in messages.
fn same_defaults<T: TomlText>(what: &str, fields: &[Field], needed: &str) {
    let read = T::from_text(needed).unwrap_or_else(|e| panic!("{what}: {e:?}"));
    let written = read.to_table();
    let given: toml::Table = needed.parse().unwrap();
    for field in fields {
        let value = written.get(field.name);
        match field.preset {
            DefaultValue::Required => {
                let mut without = given.clone();
                assert!(
                    without.remove(field.name).is_some(),
                    "{what}.{} is not needed",
                    field.name
                );
                let text = without.to_string();
                assert!(T::from_text(&text).is_err(), "{what} without {}", field.name);
            }
            DefaultValue::Is(text) => {
                let line = format!("value = {text}").parse::<toml::Table>().unwrap();
                assert_eq!(value, line.get("value"), "{what}.{}", field.name);
            }
            DefaultValue::Without(_) if given.contains_key(field.name) => {}
            DefaultValue::Without(_) => assert_eq!(value, None, "{what}.{}", field.name),
        }
    }
}

fn inner(fields: &[Field], name: &str) -> &'static [Field] {
    match fields.iter().find(|f| f.name == name).unwrap().takes {
        ValueType::Table(fields) | ValueType::OneOf(fields) => fields,
        ValueType::Tables(fields) => fields(),
        other => panic!("{name} takes {other:?}"),
    }
}

/// Returns the documented keys of one kind of texture or bump map. `key` is the key of the
/// material, `texture` or `bump`. `kind` is the kind of this texture or bump map, such as `image`.
fn texture(key: &str, kind: &str) -> &'static [Field] {
    inner(inner(crate::material::FIELDS, key), kind)
}

#[test]
fn field_tables_match_deserialised_keys() {
    same_keys::<Scene>("scene", FIELDS);
    same_keys::<FilmSettings>("film", FilmSettings::FIELDS);
    same_keys::<IntegratorSettings>("trace", IntegratorSettings::FIELDS);
    same_keys::<Background>("background", Background::FIELDS);
    same_keys::<Ambient>("ambient", Ambient::FIELDS);
    same_keys::<Camera>("camera", crate::camera::FIELDS);
    same_keys::<crate::camera::ViewAngle>("view_angle", inner(crate::camera::FIELDS, "view_angle"));
    same_keys::<crate::camera::Aperture>("aperture", inner(crate::camera::FIELDS, "aperture"));
    same_keys::<crate::camera::Focus>("focus", inner(crate::camera::FIELDS, "focus"));
    same_keys::<Light>("light", crate::light::FIELDS);
    same_keys::<crate::light::Point>("point", inner(crate::light::FIELDS, "point"));
    same_keys::<crate::light::Directional>(
        "directional",
        inner(crate::light::FIELDS, "directional"),
    );
    same_keys::<crate::light::Spot>("spot", inner(crate::light::FIELDS, "spot"));
    same_keys::<crate::light::SphereLight>("sphere", inner(crate::light::FIELDS, "sphere"));
    same_keys::<crate::light::RectangleLight>(
        "rectangle",
        inner(crate::light::FIELDS, "rectangle"),
    );
    same_keys::<crate::light::DiskLight>("disk", inner(crate::light::FIELDS, "disk"));
    same_keys::<crate::light::Environment>(
        "environment",
        inner(crate::light::FIELDS, "environment"),
    );
    same_keys::<Material>("material", crate::material::FIELDS);
    same_keys::<Texture>("texture", inner(crate::material::FIELDS, "texture"));
    same_keys::<Bump>("bump", inner(crate::material::FIELDS, "bump"));
    same_keys::<ImageTexture>("texture.image", texture("texture", "image"));
    same_keys::<Checker>("texture.checker", texture("texture", "checker"));
    same_keys::<HeightImage>("bump.image", texture("bump", "image"));
    same_keys::<Object>("object", Object::FIELDS);
    same_keys::<Shape>("shape", KINDS);
    same_keys::<CsgOperand>("part", inner(inner(KINDS, "union"), "of"));
    same_keys::<TransformOp>("step", TransformOp::FIELDS);
    same_keys::<Rotate>("rotate", inner(TransformOp::FIELDS, "rotate"));
}

#[test]
fn field_tables_match_defaults() {
    same_defaults::<FilmSettings>("film", FilmSettings::FIELDS, "");
    same_defaults::<IntegratorSettings>("trace", IntegratorSettings::FIELDS, "");
    same_defaults::<Background>("background", Background::FIELDS, "");
    same_defaults::<Ambient>("ambient", Ambient::FIELDS, "");
    same_defaults::<Camera>("camera", crate::camera::FIELDS, "");
    same_defaults::<Light>("light", crate::light::FIELDS, "point.position = [0.0, 0.0, 0.0]");
    same_defaults::<crate::light::Environment>(
        "environment",
        inner(crate::light::FIELDS, "environment"),
        "",
    );
    same_defaults::<Material>("material", crate::material::FIELDS, "");
    same_defaults::<ImageTexture>("texture.image", texture("texture", "image"), "");
    same_defaults::<Checker>("texture.checker", texture("texture", "checker"), "");
    same_defaults::<HeightImage>("bump.image", texture("bump", "image"), "");
    same_defaults::<Object>("object", Object::FIELDS, EXAMPLES[0].1);
    same_defaults::<Rotate>(
        "rotate",
        inner(TransformOp::FIELDS, "rotate"),
        "axis = [0.0, 1.0, 0.0]\ndegrees = 1.0",
    );
}

#[test]
fn every_documented_choice_is_read() {
    fn words<T: TomlText>(fields: &[Field]) {
        words_beside::<T>("", fields);
    }
    fn words_beside<T: TomlText>(needed: &str, fields: &[Field]) {
        for field in fields {
            if let ValueType::Choice(choices) = field.takes {
                for choice in choices {
                    let line = format!("{needed}{} = \"{}\"", field.name, choice.name);
                    assert!(T::from_text(&line).is_ok(), "{line}");
                }
                let line = format!("{needed}{} = \"no such word\"", field.name);
                let error = T::from_text(&line).err().map(|e| e.messages[0].help.clone());
                let error = error.unwrap_or_else(|| panic!("{line} was read"));
                let documented =
                    choices.iter().filter(|c| error.contains(&format!("\"{}\"", c.name)));
                assert_eq!(documented.count(), choices.len(), "{error}");
                assert_eq!(error.matches('"').count(), 2 * choices.len(), "{error}");
            }
        }
    }
    words::<FilmSettings>(FilmSettings::FIELDS);
    words::<IntegratorSettings>(IntegratorSettings::FIELDS);
    words_beside::<Light>("point.position = [0, 0, 0]\n", crate::light::FIELDS);
    words::<Material>(crate::material::FIELDS);
    words::<ImageTexture>(texture("texture", "image"));
    words::<Checker>(texture("texture", "checker"));
    words::<HeightImage>(texture("bump", "image"));
}

/// Returns the documented example of a shape as a table with only the keys of the shape.
fn example(kind: &Field, text: &str) -> toml::Table {
    let table: toml::Table = text.parse().unwrap();
    table["shape"][kind.name].as_table().unwrap().clone()
}

fn read(kind: &Field, values: &toml::Table) -> Result<Shape, SceneErrors> {
    let outer = toml::Table::from_iter([(kind.name.to_string(), values.clone().into())]);
    Shape::from_text(&outer.to_string())
}

#[test]
fn shape_examples_and_tables_are_valid() {
    assert_eq!(KINDS.len(), EXAMPLES.len());
    for (kind, (key, text)) in KINDS.iter().zip(EXAMPLES) {
        assert_eq!(kind.name, *key);
        let ValueType::Table(fields) = kind.takes else { panic!("{key}") };
        let given = example(kind, text);
        let shape = read(kind, &given).unwrap_or_else(|e| panic!("{key}: {e:?}"));
        assert_eq!(shape.key(), *key);
        assert_eq!(shape.faults(), [], "{key}");
        // The file names in examples are relative to the root folder of the project.
        let name = format!(concat!(env!("ZERKALO_ROOT"), "{}.toml"), key);
        let scene = Scene::parse(&format!("[[object]]\n{text}\n"), &name);
        assert!(scene.is_ok(), "{key}: {}", scene.unwrap_err());

        let written = shape.to_table();
        let mut read_keys: Vec<_> = written[*key].as_table().unwrap().keys().cloned().collect();
        let mut documented: Vec<_> = fields.iter().map(|f| f.name.to_string()).collect();
        read_keys.sort();
        documented.sort();
        assert_eq!(read_keys, documented, "{key}");
        for field in fields {
            let mut without = given.clone();
            without.remove(field.name);
            let read = read(kind, &without);
            match field.preset {
                DefaultValue::Required => assert!(read.is_err(), "{key} without {}", field.name),
                DefaultValue::Is(text) => {
                    let line = format!("value = {text}").parse::<toml::Table>().unwrap();
                    let written = read.unwrap().to_table();
                    assert_eq!(written[*key][field.name], line["value"], "{key}.{}", field.name);
                }
                DefaultValue::Without(_) => assert!(read.is_ok(), "{key} without {}", field.name),
            }
        }
    }
}

#[test]
fn every_shape_number_is_range_checked() {
    for (kind, (key, text)) in KINDS.iter().zip(EXAMPLES) {
        let ValueType::Table(fields) = kind.takes else { panic!("{key}") };
        for field in fields {
            let bad: Vec<toml::Value> = match field.takes {
                ValueType::Number(range) if range.low == 0.0 && range.low_in => vec![(-1.0).into()],
                ValueType::Number(range) if range.low == 0.0 => vec![0.0.into(), (-1.0).into()],
                ValueType::Number(_) => vec![f64::INFINITY.into()],
                ValueType::Numbers(n, range) => {
                    let outside = if range.low == 0.0 { 0.0 } else { 1e10 };
                    (0..n)
                        .map(|i| {
                            let mut list = vec![1.0; n];
                            list[i] = outside;
                            list.into()
                        })
                        .collect()
                }
                ValueType::Direction => vec![vec![0.0; 3].into()],
                // The errors in parts of compounds are tested by `errors_in_parts_name_the_part`.
                ValueType::Tables(_) => continue,
                ValueType::Text | ValueType::Choice(_) => continue,
                other => panic!("{key}.{} takes {other:?}: test it", field.name),
            };
            let nan = match bad[0].as_array() {
                Some(list) => vec![f64::NAN; list.len()].into(),
                None => toml::Value::from(f64::NAN),
            };
            for value in bad.into_iter().chain([nan]) {
                let mut values = example(kind, text);
                values.insert(field.name.into(), value.clone());
                let faults = read(kind, &values).unwrap().faults();
                let key_path = format!("{key}.{}", field.name);
                assert!(
                    faults.len() == 1 && faults[0].key == key_path,
                    "{key_path} = {value}: {faults:?}"
                );
            }
        }
    }
}

/// Returns the validation errors of a union of a ball and the part with the TOML text `part`. Each
/// error is a pair `(key, message)`.
fn faults_of(part: &str) -> Vec<(String, String)> {
    let ball = "{ shape.sphere = { center = [0, 0, 0], radius = 1 } }";
    let shape = Shape::from_text(&format!("union.of = [{ball}, {part}]")).unwrap();
    shape.faults().into_iter().map(|f| (f.key, f.found)).collect()
}

#[test]
fn errors_in_parts_name_the_part() {
    for (part, key, words) in [
        ("{ shape.sphere = { center = [0, 0, 0], radius = -1 } }", "shape.sphere.radius", "-1"),
        ("{ shape.platform = { center = [0, 0, 0], size = [1, 1] } }", "shape", "flat"),
        (
            "{ shape.cube = { corner = [0, 0, 0], edge = 1 }, transform = [{ scale = 0 }] }",
            "transform.0.scale",
            "0",
        ),
        (
            "{ shape.cube = { corner = [0, 0, 0], edge = 1 }, transform = [{ translate = [1e9, 0, 0] }, { scale = 2 }] }",
            "transform",
            "beyond 1e9",
        ),
        ("{ shape.union = { of = [] } }", "shape.union.of", "empty"),
        (
            "{ shape.union.of = [{ shape.cube = { corner = [0, 0, 0], edge = 1 } }] }",
            "shape.union.of",
            "one part",
        ),
        (
            "{ shape.intersection.of = [{ shape.unit_frustum = { s = 1 } }, \
               { shape.unit_frustum = { s = -1 } }] }",
            "shape.intersection.of.1.shape.unit_frustum.s",
            "-1",
        ),
    ] {
        let faults = faults_of(part);
        assert_eq!(faults.len(), 1, "{part}: {faults:?}");
        assert_eq!(faults[0].0, format!("union.of.1.{key}"), "{part}");
        assert!(faults[0].1.contains(words), "{part}: {faults:?}");
    }
    // A plane as a part stands for a half-space. A union rejects it, because the union would be
    // unbounded; an intersection or a difference with a bounded part accepts it.
    let plane = "{ shape.plane = { point = [0, 0, 0], normal = [0, 1, 0] } }";
    let faults = faults_of(plane);
    assert!(faults.len() == 1 && faults[0].0 == "union.of", "{faults:?}");
    let cut = "{ shape.sphere = { center = [0, 0, 0], radius = 1 } }";
    assert_eq!(faults_of(&format!("{{ shape.intersection.of = [{cut}, {plane}] }}")), []);
    assert_eq!(faults_of(&format!("{{ shape.difference.of = [{cut}, {plane}] }}")), []);
}

#[test]
fn compound_nesting_depth_is_limited() {
    let sphere = || Shape::from_text("sphere = { center = [0, 0, 0], radius = 1 }").unwrap();
    let part = CsgOperand::new;
    let mut shape = sphere();
    for depth in 1..=MAX_DEPTH + 1 {
        shape = Shape::Union(crate::shape::Union { of: vec![part(shape), part(sphere())] });
        assert_eq!(shape.faults().is_empty(), depth <= MAX_DEPTH, "{depth}");
    }
}
