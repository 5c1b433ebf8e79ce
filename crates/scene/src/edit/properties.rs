//! Properties of an edit target (camera, light, object, material, ...), as an inspector shows them:
//! one row per key.

use crate::Scene;
use crate::edit::convert::{AIM, KIND, chosen};
use crate::edit::parse_value::{floats, show};
use crate::edit::toml_view::{exclusive_keys, fields, get, read};
use crate::edit::{EditError, Target};
use crate::format::emit::{color, preset};
use crate::value::{DefaultValue, Field, NumberRange, ValueType, names, number};
use toml::{Table, Value};

/// Word that a property accepts as its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// Text of the word. If it is the name of a material, it may contain any character that files
    /// allow.
    pub name: String,
    /// Description of the word; may be empty.
    pub doc: String,
}

/// Kind of a property's value, by which an inspector chooses the input element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Widget {
    /// Widget for free text, such as a name.
    Text,
    /// Widget for a switch: the value is `true` or `false`.
    Switch,
    /// Widget for a choice: the value is one of [`Property::words`].
    Choice,
    /// Widget for the kind of a shape or a light: the value is one of [`Property::words`]. The kind
    /// determines which other properties exist.
    Kind,
    /// Widget for a list of transform steps. Typing one of [`Property::words`] appends a step of
    /// that kind.
    List,
    /// Widget for a number, or for a list of numbers such as a position.
    #[default]
    Numbers,
    /// Widget for a colour: three numbers, the linear red, green and blue.
    Color,
}

/// Property of an edit target: one row of an inspector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Property {
    /// Dotted key, as [`set`](crate::edit::set) requires it: `shape.sphere.radius`,
    /// `transform.0.rotate_y`.
    pub key: String,
    /// Label of the property: the last part of the key, with spaces.
    pub label: String,
    /// Nesting depth of the property, by which its row is indented: 0, 1 or 2.
    pub depth: usize,
    /// Kind of the value, which determines the input element of the inspector.
    pub entry: Widget,
    /// Value as text, in the form in which it can be typed; empty if the key has no value.
    pub value: String,
    /// Each number of the value as text: the numbers of a list, or the three channels of a colour.
    /// Empty for other values.
    pub components: Vec<String>,
    /// Linear red, green and blue of a colour; `None` for other values.
    pub color: Option<[f64; 3]>,
    /// Unit of the numbers in the value; may be empty.
    pub unit: &'static str,
    /// Accepted values, as a phrase: `a number from 0 to 1`.
    pub expected: String,
    /// Accepted words of a choice, a kind or a list; empty for other properties.
    pub words: Vec<Word>,
    /// Description of the property, as a sentence.
    pub doc: &'static str,
    /// `true` if the value of the key is its default or the key is omitted.
    pub is_default: bool,
    /// Default value as text; `None` if the key is required.
    pub default: Option<String>,
}

/// Returns the properties of `subject`, in the order in which the manual of the scene format lists
/// its keys. The properties of an object's material are not included; they belong to the target
/// [`Target::material`].
///
/// # Errors
/// Fails if the scene has no such target.
pub fn rows(scene: &Scene, subject: &Target) -> Result<Vec<Property>, EditError> {
    let values = read(scene, subject)?;
    let mut walk = PropertyWalker { scene, subject, rows: Vec::new() };
    let virtual_kind = match subject {
        Target::Light(_) => Some(&KIND),
        Target::Camera | Target::View(_) => Some(&AIM),
        _ => None,
    };
    let has_size = match subject {
        Target::Light(i) => scene.lights.get(*i).is_some_and(|light| light.surface().is_some()),
        _ => true,
    };
    for field in fields(subject) {
        let is_environment = values.contains_key("environment");
        if !has_size && (field.name == "unit" || field.name == "visible" && !is_environment) {
            // Only lights with a size have the key `unit`. Only these lights and environments have
            // the key `visible`.
            continue;
        }
        if let Some(kind) = virtual_kind
            && exclusive_keys(subject).contains(&field.name)
        {
            // One row chooses between the two exclusive keys; the row of the key that is given
            // follows.
            if exclusive_keys(subject)[0] == field.name {
                walk.kind(kind, chosen(subject, &values), kind.name.to_string(), 0);
            }
            if values.contains_key(field.name) {
                walk.field(field, &values, field.name.to_string(), 1);
            }
            continue;
        }
        walk.field(field, &values, field.name.to_string(), 0);
    }
    Ok(walk.rows)
}

struct PropertyWalker<'a> {
    scene: &'a Scene,
    subject: &'a Target,
    rows: Vec<Property>,
}

impl PropertyWalker<'_> {
    fn field(&mut self, field: &'static Field, values: &Table, key: String, depth: usize) {
        let value = get(values, field.name);
        match (field.takes, value) {
            (ValueType::Table(inner), Some(Value::Table(values))) => {
                for field in inner {
                    self.field(field, values, format!("{key}.{}", field.name), depth);
                }
            }
            (ValueType::OneOf(_), None) => self.kind(field, None, key, depth),
            (ValueType::OneOf(kinds), Some(Value::Table(values))) => {
                let given = kinds.iter().find(|k| values.contains_key(k.name));
                self.kind(field, given.map(|k| k.name), key.clone(), depth);
                if let Some(kind) = given {
                    self.field(kind, values, format!("{key}.{}", kind.name), depth + 1);
                }
            }
            (ValueType::ListOf(_), value) => self.steps(field, value, &key, depth),
            _ => self.leaf(field, value, key, depth),
        }
    }

    fn steps(&mut self, field: &'static Field, value: Option<&Value>, key: &str, depth: usize) {
        let ValueType::ListOf(kinds) = field.takes else { return };
        let list = value.and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let mut row = self.row(field, key.to_string(), depth);
        row.entry = Widget::List;
        row.value = match list.len() {
            0 => String::new(),
            1 => "1 step".to_string(),
            n => format!("{n} steps"),
        };
        row.words = words(kinds);
        row.is_default = list.is_empty();
        self.rows.push(row);
        for (i, step) in list.iter().enumerate() {
            let Some(values) = step.as_table() else { continue };
            let given = kinds.iter().find(|k| values.contains_key(k.name));
            let Some(kind) = given else { continue };
            let from = self.rows.len();
            self.field(kind, values, format!("{key}.{i}.{}", kind.name), depth + 1);
            for row in &mut self.rows[from..] {
                row.label = format!("{} {}", i + 1, row.label);
            }
        }
    }

    fn kind(&mut self, field: &'static Field, given: Option<&str>, key: String, depth: usize) {
        let mut row = self.row(field, key, depth);
        if let ValueType::OneOf(kinds) = field.takes {
            row.words = words(kinds);
        }
        row.entry = Widget::Kind;
        row.value = given.unwrap_or_default().to_string();
        let optional = matches!(field.preset, DefaultValue::Without(_));
        row.default = row.default.filter(|_| optional);
        row.is_default = optional && given.is_none();
        self.rows.push(row);
    }

    fn leaf(&mut self, field: &'static Field, value: Option<&Value>, key: String, depth: usize) {
        let mut row = self.row(field, key, depth);
        row.value = value.map_or(String::new(), |value| show(field.takes, value));
        match field.takes {
            ValueType::Text => row.entry = Widget::Text,
            ValueType::Switch => row.entry = Widget::Switch,
            ValueType::Choice(choices) => {
                row.entry = Widget::Choice;
                let word =
                    |c: &crate::value::Choice| Word { name: c.name.into(), doc: c.doc.into() };
                row.words = choices.iter().map(word).collect();
            }
            ValueType::Color(_) => {
                row.entry = Widget::Color;
                row.color = value.and_then(color).map(|c| c.0);
            }
            _ => {}
        }
        if matches!(row.entry, Widget::Numbers | Widget::Color) {
            let numbers = value.and_then(floats).unwrap_or_default();
            row.components = numbers.into_iter().map(number).collect();
        }
        if is_material(self.subject, field) {
            row.entry = Widget::Choice;
            let name = |name: &String| Word { name: name.clone(), doc: String::new() };
            row.words = self.scene.materials.keys().map(name).collect();
        }
        row.is_default = match field.preset {
            DefaultValue::Required => false,
            DefaultValue::Without(_) => value.is_none(),
            DefaultValue::Is(text) => value == preset(text).as_ref(),
        };
        self.rows.push(row);
    }

    fn row(&self, field: &'static Field, key: String, depth: usize) -> Property {
        Property {
            key,
            label: field.name.replace('_', " "),
            depth,
            unit: field.unit,
            expected: expected(field.takes),
            doc: field.doc,
            default: match field.preset {
                DefaultValue::Required => None,
                DefaultValue::Is(text) => Some(text.trim_matches('"').to_string()),
                DefaultValue::Without(instead) => Some(instead.to_string()),
            },
            ..Property::default()
        }
    }
}

/// Returns `true` if the value of `field` in the edit target `subject` is the name of a material.
pub(super) fn is_material(subject: &Target, field: &Field) -> bool {
    matches!(subject, Target::Object(_)) && field.name == "material"
}

/// Returns a [`Word`] for each of the fields `kinds`, with the name and the help text of the field.
pub(super) fn words(kinds: &[Field]) -> Vec<Word> {
    kinds.iter().map(|k| Word { name: k.name.into(), doc: k.doc.into() }).collect()
}

/// Returns a phrase for the accepted values of the type `takes`, such as `3 numbers, not all zero`.
/// The phrase describes the notation that users type. The manual of the scene format has another
/// phrase for types whose notation in files differs.
fn expected(takes: ValueType) -> String {
    match takes {
        ValueType::Text => "text".to_string(),
        ValueType::Numbers(n, range) => format!("{n} numbers, each {range}"),
        ValueType::Wholes(n, range) => format!("{n} whole numbers, each {range}"),
        ValueType::Direction => "3 numbers, not all zero".to_string(),
        ValueType::Factor => "a number other than 0, or 3 of them".to_string(),
        ValueType::Color(NumberRange { high, .. }) => {
            format!("red, green, blue (linear, 0 to {}) or #rrggbb", number(high))
        }
        ValueType::OneOf(kinds) | ValueType::ListOf(kinds) => format!("one of {}", names(kinds)),
        ValueType::Choice(choices) => {
            let names: Vec<_> = choices.iter().map(|c| c.name).collect();
            format!("one of {}", names.join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;
    use crate::edit::{outline, set};

    fn row(scene: &Scene, subject: &Target, key: &str) -> Property {
        let rows = rows(scene, subject).unwrap();
        rows.into_iter().find(|r| r.key == key).unwrap_or_else(|| panic!("no row {key}"))
    }

    #[test]
    fn rows_flatten_nested_tables_and_show_kinds() {
        let scene = built_in();
        let keys = |subject: &Target| -> Vec<String> {
            rows(&scene, subject).unwrap().into_iter().map(|r| r.key).collect()
        };
        let ball = ["name", "material", "shape", "shape.sphere.center", "shape.sphere.radius"];
        assert_eq!(keys(&Target::Object(2))[..5], ball);
        assert_eq!(
            keys(&Target::Camera),
            [
                "eye",
                "aim",
                "target",
                "up",
                "view_angle",
                "view_angle.vertical",
                "near",
                "aperture",
                "focus"
            ]
        );
        assert_eq!(keys(&Target::Light(0))[..3], ["name", "kind", "point.position"]);
        let radius = row(&scene, &Target::Object(2), "shape.sphere.radius");
        assert_eq!((radius.value.as_str(), radius.components.len()), ("0.5", 1));
        assert_eq!((radius.unit, radius.depth, radius.is_default), ("scene units", 1, false));
        assert_eq!(radius.expected, "a number greater than 0, at most 1e9");
        let shape = row(&scene, &Target::Object(2), "shape");
        assert_eq!((shape.value.as_str(), shape.entry), ("sphere", Widget::Kind));
        assert_eq!(shape.words.len(), crate::shape::KINDS.len());
        let alpha = row(&scene, &Target::Material("red".into()), "alpha");
        assert!(alpha.value.is_empty() && alpha.components.is_empty() && alpha.is_default);
        assert_eq!(alpha.default.as_deref(), Some("roughness / (2 √2)"));
        let material = row(&scene, &Target::Object(2), "material");
        assert_eq!((material.entry, material.words.len()), (Widget::Choice, 6));
    }

    /// Checks that setting a property to the text of its displayed value changes nothing.
    #[test]
    fn every_row_value_can_be_typed_back() {
        let mut scene = built_in();
        let steps = "[{ rotate = { axis = [1, 0, 0], degrees = 5 } }, { scale = 2.0 }]";
        let text = format!(
            "[[object]]\nshape.plane = {{ point = [0, -9, 0], normal = [0, 1, 0] }}\ntransform = {steps}\n"
        );
        scene.objects.extend(Scene::parse(&text, "").unwrap().objects);
        scene.cameras.insert("left".into(), scene.camera.clone());
        for (_, subject) in outline(&scene) {
            for row in rows(&scene, &subject).unwrap() {
                if row.entry == Widget::List || row.value.is_empty() {
                    continue;
                }
                let again = set(&scene, &subject, &row.key, &row.value);
                let again = again.unwrap_or_else(|e| panic!("{subject:?} {}: {e}", row.key));
                assert_eq!(again.scene, scene, "{subject:?} {}", row.key);
            }
        }
    }
}
