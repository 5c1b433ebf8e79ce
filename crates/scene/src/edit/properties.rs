//! Properties of an edit target as an inspector shows them: one row per key.

#![allow(clippy::wildcard_enum_match_arm)]

use crate::Scene;
use crate::edit::convert::{AIM, KIND};
use crate::edit::parse_value::{color, parse, show};
use crate::edit::part::{exclusive_keys, fields, given_key, part};
use crate::edit::{EditError, Target};
use crate::value::{
    DefaultValue, Field, KeyNode, KeyValue, NumberRange, ValueType, names, node_at, number, written,
};

/// Word that a property accepts as its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// Word as shown and typed. If it names a material, it may contain any character.
    pub name: String,
    /// Description of the word; may be empty.
    pub doc: String,
}

impl Word {
    pub(super) fn new(name: impl Into<String>, doc: impl Into<String>) -> Self {
        Self { name: name.into(), doc: doc.into() }
    }
}

/// Input element for the value of a property in an inspector. Choices, kinds and lists accept the
/// words in [`Property::words`].
#[allow(missing_docs, reason = "the names say it")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Widget {
    Text,
    Switch,
    Choice,
    /// Kind of a shape or a light, which determines the other properties.
    Kind,
    /// List of transform steps. A word that is chosen appends a step.
    List,
    #[default]
    Numbers,
    Color,
}

/// Property of an edit target: one row of an inspector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Property {
    /// Dotted key, such as `shape.sphere.radius`.
    pub key: String,
    /// Label of the property: the last part of the key, with spaces.
    pub label: String,
    /// Nesting depth of the property, by which its row is indented: 0, 1 or 2.
    pub depth: usize,
    /// Input element of the inspector.
    pub widget: Widget,
    /// Value as text, in the form in which it can be typed; empty if the key has no value.
    pub value: String,
    /// Each number of the value as text.
    pub components: Vec<String>,
    /// Linear red, green and blue of a colour; `None` for other values.
    pub color: Option<[f64; 3]>,
    /// Unit of the numbers in the value; may be empty.
    pub unit: &'static str,
    /// Ends of the range of usual numbers; `None` if there is none.
    pub range: Option<[f64; 2]>,
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

/// Returns the properties of `target` in the order of the manual, without the properties of an
/// object's material.
pub fn rows(scene: &Scene, target: &Target) -> Result<Vec<Property>, EditError> {
    let part = part(scene, target)?;
    let mut walk = PropertyWalker { scene, target, base: part.base(), rows: Vec::new() };
    let virtual_kind = match target {
        Target::Light(_) => Some(&KIND),
        Target::Camera | Target::View(_) => Some(&AIM),
        Target::Object(_)
        | Target::Part(..)
        | Target::Group(_)
        | Target::Material(_)
        | Target::Settings(_) => None,
    };
    let given = given_key(part, target);
    let hidden_key =
        |name: &str| matches!(target, Target::Light(i) if !scene.lights[*i].has_key(name));
    for field in fields(target) {
        if hidden_key(field.name) {
            continue;
        }
        if let Some(kind) = virtual_kind
            && exclusive_keys(target).contains(&field.name)
        {
            // One row chooses between the exclusive keys; the row of the key that is given follows.
            if exclusive_keys(target)[0] == field.name {
                walk.kind(kind, given, kind.name.to_string(), 0);
            }
            if given == Some(field.name)
                && let Some(node) = part.child(field.name)
            {
                walk.field(field, node, field.name.to_string(), 1);
            }
        } else if let Some(node) = part.child(field.name) {
            walk.field(field, node, field.name.to_string(), 0);
        }
    }
    Ok(walk.rows)
}

/// Collector of the rows of one edit target.
struct PropertyWalker<'a> {
    scene: &'a Scene,
    target: &'a Target,
    /// Values of omitted keys by a preset.
    base: Option<Box<dyn KeyNode>>,
    rows: Vec<Property>,
}

impl PropertyWalker<'_> {
    /// Adds the rows of the key `key`, whose value is `node`.
    fn field(&mut self, field: &'static Field, node: &dyn KeyNode, key: String, depth: usize) {
        match field.takes {
            ValueType::Table(inner) if !node.is_absent() => {
                for field in inner {
                    if let Some(node) = node.child(field.name) {
                        self.field(field, node, format!("{key}.{}", field.name), depth);
                    }
                }
            }
            ValueType::OneOf(kinds) => {
                let given = given_kind(kinds, node);
                self.kind(field, given.map(|(kind, _)| kind.name), key.clone(), depth);
                if let Some((kind, node)) = given {
                    self.field(kind, node, format!("{key}.{}", kind.name), depth + 1);
                }
            }
            ValueType::ListOf(kinds) => self.steps(field, kinds, node, &key, depth),
            _ => self.leaf(field, node, key, depth),
        }
    }

    /// Adds a row for a list of transform steps, then the rows of each step.
    fn steps(
        &mut self,
        field: &'static Field,
        kinds: &'static [Field],
        list: &dyn KeyNode,
        key: &str,
        depth: usize,
    ) {
        let steps: Vec<_> = (0..).map_while(|i: usize| list.child(&i.to_string())).collect();
        let mut row = self.row(field, key.to_string(), depth);
        row.value = match steps.len() {
            0 => String::new(),
            1 => "1 step".to_string(),
            n => format!("{n} steps"),
        };
        row.is_default = steps.is_empty();
        self.rows.push(row);
        for (i, step) in steps.into_iter().enumerate() {
            let Some((kind, node)) = given_kind(kinds, step) else { continue };
            let from = self.rows.len();
            self.field(kind, node, format!("{key}.{i}.{}", kind.name), depth + 1);
            for row in &mut self.rows[from..] {
                row.label = format!("{} {}", i + 1, row.label);
            }
        }
    }

    /// Adds a row for the choice of a kind; `given` is the present kind.
    fn kind(&mut self, field: &'static Field, given: Option<&str>, key: String, depth: usize) {
        let mut row = self.row(field, key, depth);
        row.value = given.unwrap_or_default().to_string();
        let optional = matches!(field.preset, DefaultValue::Without(_));
        row.default = row.default.filter(|_| optional);
        row.is_default = optional && given.is_none();
        self.rows.push(row);
    }

    /// Adds the row of a key with a single value.
    fn leaf(&mut self, field: &'static Field, node: &dyn KeyNode, key: String, depth: usize) {
        let mut row = self.row(field, key, depth);
        let value = node.value();
        let of_base = self.base.as_ref().and_then(|base| node_at(base.as_ref(), &row.key)?.value());
        row.is_default = match field.preset {
            DefaultValue::Required => false,
            DefaultValue::Without(_) => node.is_absent(),
            DefaultValue::Is(text) => value == of_base.clone().or(parse(field, text).ok()),
        };
        if let Some(of_base) = of_base {
            row.default = Some(show(field.takes, &of_base));
        }
        if let Some(value) = value {
            row.value = show(field.takes, &value);
            row.color = color(field.takes, &value).map(|c| c.0);
            if let KeyValue::Numbers(numbers) = value {
                row.components = numbers.into_iter().map(number).collect();
            }
        }
        if let ValueType::Tables(_) = field.takes {
            // The parts of a compound are shown as text, because edits cannot change them.
            row.value = written(field.takes, node).to_string();
        }
        self.rows.push(row);
    }

    /// Returns the row of `key` without its value.
    fn row(&self, field: &'static Field, key: String, depth: usize) -> Property {
        let (widget, words) = match field.takes {
            ValueType::Text if is_material(self.target, field) => {
                let names = self.scene.materials.keys();
                (Widget::Choice, names.map(|name| Word::new(name, "")).collect())
            }
            ValueType::Text => (Widget::Text, Vec::new()),
            ValueType::Switch => (Widget::Switch, Vec::new()),
            ValueType::Choice(choices) => {
                (Widget::Choice, choices.iter().map(|c| Word::new(c.name, c.doc)).collect())
            }
            ValueType::OneOf(kinds) => (Widget::Kind, words(kinds)),
            ValueType::ListOf(kinds) => (Widget::List, words(kinds)),
            ValueType::Color(_) => (Widget::Color, Vec::new()),
            _ => (Widget::Numbers, Vec::new()),
        };
        Property {
            key,
            label: field.name.replace('_', " "),
            depth,
            widget,
            words,
            unit: field.unit,
            range: usual_range(field.takes),
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

/// Returns the field of the kind that `node` has, and the child of `node` with the kind's value.
fn given_kind<'a>(
    kinds: &'static [Field],
    node: &'a dyn KeyNode,
) -> Option<(&'static Field, &'a dyn KeyNode)> {
    kinds.iter().find_map(|kind| Some((kind, node.child(kind.name)?)))
}

/// Returns `true` if the value of `field` in `target` is the name of a material.
pub(super) fn is_material(target: &Target, field: &Field) -> bool {
    matches!(target, Target::Object(_) | Target::Part(..)) && field.name == "material"
}

/// Returns a [`Word`] for each of the fields `kinds`, with the name and the help text of the field.
pub(super) fn words(kinds: &[Field]) -> Vec<Word> {
    kinds.iter().map(|k| Word::new(k.name, k.doc)).collect()
}

/// Returns the ends of the range of usual numbers.
fn usual_range(takes: ValueType) -> Option<[f64; 2]> {
    let range = takes.range();
    let is_share = [NumberRange::SHARE, NumberRange::COEFFICIENT].contains(&range);
    match range.high <= 360.0 {
        _ if is_share || matches!(takes, ValueType::Color(_)) => Some([0.0, 1.0]),
        true => Some([range.low, range.high]),
        false => None,
    }
}

/// Returns a phrase for the accepted values in the notation that users type.
fn expected(takes: ValueType) -> String {
    match takes {
        ValueType::Text => "text".to_string(),
        ValueType::Numbers(n, range) => format!("{n} numbers, each {range}"),
        ValueType::Wholes(n, range) => format!("{n} whole numbers, each {range}"),
        ValueType::Direction => "3 numbers, not all zero".to_string(),
        ValueType::Factor => "a number other than 0, or 3 of them".to_string(),
        ValueType::Color(NumberRange { high, .. }) => {
            format!(
                "red, green, blue (linear, 0 to {}), #rrggbb, a name, hsv 30 1 1, 2700 K",
                number(high)
            )
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
    use crate::edit::{outline, set};
    use crate::testing::mirror_room;

    fn row(scene: &Scene, target: &Target, key: &str) -> Property {
        let rows = rows(scene, target).unwrap();
        rows.into_iter().find(|r| r.key == key).unwrap_or_else(|| panic!("no row {key}"))
    }

    #[test]
    fn rows_flatten_nested_tables_and_show_kinds() {
        let scene = mirror_room();
        let keys = |target: &Target| -> Vec<String> {
            rows(&scene, target).unwrap().into_iter().map(|r| r.key).collect()
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
                "projection",
                "view_angle",
                "view_angle.vertical",
                "near",
                "aperture",
                "focus"
            ]
        );
        assert_eq!(keys(&Target::Light(0))[..4], ["name", "group", "kind", "point.position"]);
        let radius = row(&scene, &Target::Object(2), "shape.sphere.radius");
        assert_eq!((radius.value.as_str(), radius.components.len()), ("0.5", 1));
        assert_eq!((radius.unit, radius.depth, radius.is_default), ("scene units", 1, false));
        assert_eq!(radius.expected, "a number greater than 0, at most 1e9");
        let shape = row(&scene, &Target::Object(2), "shape");
        assert_eq!((shape.value.as_str(), shape.widget), ("sphere", Widget::Kind));
        assert_eq!(shape.words.len(), crate::shape::KINDS.len());
        let alpha = row(&scene, &Target::Material("red".into()), "alpha");
        assert!(alpha.value.is_empty() && alpha.components.is_empty() && alpha.is_default);
        assert_eq!(alpha.default.as_deref(), Some("roughness / (2 √2)"));
        let material = row(&scene, &Target::Object(2), "material");
        assert_eq!((material.widget, material.words.len()), (Widget::Choice, 6));
    }

    /// Checks that setting a property to the text of its displayed value changes nothing.
    #[test]
    fn every_row_value_can_be_typed_back() {
        let mut scene = mirror_room();
        let steps = "[{ rotate = { axis = [1, 0, 0], degrees = 5 } }, { scale = 2.0 }]";
        let text = format!(
            "[[object]]\nshape.plane = {{ point = [0, -9, 0], normal = [0, 1, 0] }}\ntransform = {steps}\n"
        );
        scene.objects.extend(Scene::parse(&text, "").unwrap().objects);
        scene.cameras.insert("left".into(), scene.camera.clone());
        for (_, target) in outline(&scene) {
            for row in rows(&scene, &target).unwrap() {
                if row.widget == Widget::List || row.value.is_empty() {
                    continue;
                }
                let again = set(&scene, &target, &row.key, &row.value);
                let again = again.unwrap_or_else(|e| panic!("{target:?} {}: {e}", row.key));
                assert_eq!(again.scene, scene, "{target:?} {}", row.key);
            }
        }
    }
}
