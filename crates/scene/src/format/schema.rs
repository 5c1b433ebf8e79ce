//! Reading of a scene from TOML by its schema. Unknown keys, values of a wrong type and missing keys
//! are found in the same pass.

use crate::diagnostic::{Diagnostic, FirstDiagnostics};
use crate::format::parts::Part;
use crate::format::source_map::subject_in;
use crate::light::{self, LightKind};
use crate::value::{
    Color, DefaultValue, Description, Field, KeyNode, PRESET, ValueType, did_you_mean, integer,
    names, nearest, read_value, sort_by_number, translated, truncated,
};
use crate::{
    Ambient, Background, FilmSettings, IntegratorSettings, Object, camera, material, shape,
};
use std::ops;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Top-level keys of a scene file.
pub const FIELDS: &[Field] = &[
    table("film", FilmSettings::FIELDS, "Film: size of the picture, pixel filter, sample limit."),
    table(
        "trace",
        IntegratorSettings::FIELDS,
        "Integrator: kinds of rays, depth, acceleration structure.",
    ),
    optional(
        "camera",
        ValueType::Table(camera::FIELDS),
        "at [0.0, 1.0, 5.0], directed at the origin",
        "Camera that the picture is taken from.",
    ),
    optional(
        "cameras",
        ValueType::Named(camera::FIELDS),
        "there are none",
        "Stored cameras by name. The picture is taken from `[camera]`.",
    ),
    table("background", Background::FIELDS, "Radiance of rays that hit no surface."),
    table("ambient", Ambient::FIELDS, "Ambient light: uniform, without shadows."),
    optional(
        "groups",
        ValueType::Named(light::LightGroup::FIELDS),
        "there are none",
        "Mixes of light groups by name, for the key `group` of lights and materials.",
    ),
    optional("light", ValueType::Tables(|| light::FIELDS), "there are none", "The lights."),
    optional(
        "materials",
        ValueType::Named(material::FIELDS),
        "there are none",
        "Materials by name, for the key `material` of objects.",
    ),
    optional("object", ValueType::Tables(|| Object::FIELDS), "there are none", "The objects."),
];

const fn table(name: &'static str, fields: &'static [Field], doc: &'static str) -> Field {
    optional(name, ValueType::Table(fields), "its keys have their defaults", doc)
}

const fn optional(
    name: &'static str,
    takes: ValueType,
    absent: &'static str,
    doc: &'static str,
) -> Field {
    Field::required(name, takes, "", doc).or(absent)
}

/// Reads `root`, the parsed `part` of the file, into `node`, which has default values and the type
/// `takes`. Adds the schema errors of `root` to `errors`. A node with an error keeps its default.
pub(crate) fn read(
    root: &Spanned<DeTable>,
    takes: ValueType,
    node: &mut dyn KeyNode,
    part: &Part,
    errors: &mut FirstDiagnostics,
) {
    let mut reader = SchemaReader { part, root: root.get_ref(), path: Vec::new(), errors };
    match takes {
        ValueType::Table(fields) => reader.table(root.get_ref(), 0..0, fields, node),
        ValueType::OneOf(fields) => reader.one_of(root.get_ref(), 0..0, fields, node),
        other => panic!("{other} is not a table"),
    }
}

/// Formats a path as a phrase: `shape.sphere`, `step 2 of transform`, `shape.cube of part 1 of
/// shape.union`.
fn phrase(keys: &[String]) -> String {
    let number = |position: &String| position.parse().map_or(0, |i: usize| i + 1);
    if let Some(of) = keys.iter().rposition(|key| key == "of")
        && let [position, inner @ ..] = &keys[of + 1..]
    {
        let part = format!("part {} of {}", number(position), phrase(&keys[..of]));
        return if inner.is_empty() { part } else { format!("{} of {part}", phrase(inner)) };
    }
    match keys {
        [transform, step, rest @ ..] if transform == "transform" => {
            let suffix: String = rest.iter().map(|key| format!(".{key}")).collect();
            format!("step {} of transform{suffix}", number(step))
        }
        keys => keys.join("."),
    }
}

/// Reader of one part of a scene file. `path` leads to the value that it is reading.
struct SchemaReader<'a> {
    part: &'a Part,
    root: &'a DeTable<'a>,
    path: Vec<String>,
    errors: &'a mut FirstDiagnostics,
}

impl SchemaReader<'_> {
    fn add(&mut self, span: ops::Range<usize>, found: String, help: String) {
        self.errors.add(self.part.in_file(span.start), || Diagnostic {
            subject: subject_in(self.root, &self.path, self.part.first_object),
            found,
            help,
            ..Diagnostic::default()
        });
    }

    /// Returns the current path below the table that diagnostics name: `shape.sphere` for
    /// `object.3.shape.sphere`.
    fn inner(&self) -> String {
        let above = match self.path.first().map(String::as_str) {
            Some("object" | "light" | "materials" | "cameras" | "groups") => 2,
            _ => 1,
        };
        phrase(self.path.get(above..).unwrap_or_default())
    }

    /// Returns ` in ` followed by [`Self::inner`]; an empty string if that is empty.
    fn place(&self) -> String {
        match self.inner() {
            inner if inner.is_empty() => inner,
            inner => format!(" in {inner}"),
        }
    }

    /// Adds an error about `value`, which has the wrong type.
    fn wrong(&mut self, span: ops::Range<usize>, value: &DeValue, expected: &str) {
        if self.errors.skips(self.part.in_file(span.start)) {
            return;
        }
        let name = match self.inner() {
            inner if inner.is_empty() => "it".to_string(),
            inner => inner,
        };
        self.add(span, format!("{name} is {}", describe(value)), format!("Expected {expected}."));
    }

    /// Adds an error about an unknown key. Returns the name in `fields` that was probably meant.
    fn unknown(
        &mut self,
        key: &Spanned<toml::de::DeString>,
        fields: &[Field],
    ) -> Option<&'static str> {
        if self.errors.skips(self.part.in_file(key.span().start)) {
            return None;
        }
        let known = || fields.iter().map(|f| f.name);
        let help = format!("Known: {}.{}", names(fields), Self::intended(key.get_ref(), fields));
        let found = format!("unknown key \"{}\"{}", truncated(key.get_ref()), self.place());
        self.add(key.span(), found, help);
        let is_shape = shape::KINDS.iter().any(|kind| kind.name == key.get_ref().as_ref());
        let shape = known().find(|name| *name == "shape").filter(|_| is_shape);
        shape.or_else(|| nearest(key.get_ref(), known()))
    }

    /// Returns a sentence with what the unknown key `given` of a table with the keys `fields` was
    /// probably meant to be; empty if that is unclear.
    fn intended(given: &str, fields: &[Field]) -> String {
        let has = |fields: &[Field]| fields.iter().any(|field| field.name == given);
        let of_object = fields.iter().any(|field| field.name == "shape");
        if of_object && has(shape::KINDS) {
            return format!(" Expected shape.{given} instead of {given}.");
        }
        let meant = did_you_mean(given, fields.iter().map(|field| field.name));
        if !meant.is_empty() {
            return meant;
        }
        let tables: [(&[Field], &str); 5] = [
            (material::FIELDS, "[materials.NAME]"),
            (Object::FIELDS, "[[object]]"),
            (light::FIELDS, "[[light]]"),
            (camera::FIELDS, "[camera]"),
            (FilmSettings::FIELDS, "[film]"),
        ];
        match tables.iter().find(|(fields, _)| has(fields)) {
            Some((_, table)) => format!(" It is a key of {table}."),
            None => translated(given),
        }
    }

    /// Reads a table with the keys `fields`, whose byte range is `span`, into `node`.
    fn table(
        &mut self,
        table: &DeTable,
        span: ops::Range<usize>,
        fields: &'static [Field],
        node: &mut dyn KeyNode,
    ) {
        let mut intended = Vec::new();
        let (preset, others): (Vec<_>, Vec<_>) =
            table.iter().partition(|(key, _)| key.get_ref() == PRESET);
        for (key, value) in preset.into_iter().chain(others) {
            match fields.iter().find(|f| f.name == key.get_ref().as_ref()) {
                Some(field) => self.child(field.name, field.takes, value, node),
                None => intended.extend(self.unknown(key, fields)),
            }
            if key.get_ref() == PRESET {
                node.rebase();
            }
        }
        for field in fields.iter().filter(|f| f.preset == DefaultValue::Required) {
            if !table.contains_key(field.name) && !intended.contains(&field.name) {
                let found = format!("key \"{}\" is missing{}", field.name, self.place());
                let help = format!("Expected {} = {}.", field.name, field.takes);
                self.add(span.clone(), found, help);
            }
        }
    }

    /// Reads a table that must have exactly one of the keys `fields` into `node`.
    fn one_of(
        &mut self,
        table: &DeTable,
        span: ops::Range<usize>,
        fields: &'static [Field],
        node: &mut dyn KeyNode,
    ) {
        let mut known: Vec<_> = Vec::new();
        for (key, value) in table {
            match fields.iter().find(|f| f.name == key.get_ref().as_ref()) {
                Some(field) => known.push((key, value, field)),
                None => {
                    self.unknown(key, fields);
                }
            }
        }
        sort_by_number(&mut known, |(key, ..)| key.span().start as i64);
        for (_, value, field) in known.iter().take(1) {
            self.child(field.name, field.takes, value, node);
        }
        let expected =
            || format!("Expected {}.", ValueType::OneOf(fields)).replace("a table with ", "");
        if let [_, second, ..] = known.as_slice() {
            let found =
                format!("{} has both {} and {}", self.inner(), known[0].2.name, second.2.name);
            self.add(second.0.span(), found, expected());
        } else if table.is_empty() {
            self.add(span, format!("{} is empty", self.inner()), expected());
        }
    }

    /// Adds an error if the table of a light, whose byte range is `span`, has no kind or several.
    fn kind_of_light(&mut self, table: &DeTable, span: ops::Range<usize>) {
        let is_known = |key: &str| light::FIELDS.iter().any(|field| field.name == key);
        let mut given: Vec<_> =
            table.keys().filter(|key| LightKind::KEYS.contains(&key.get_ref().as_ref())).collect();
        sort_by_number(&mut given, |key| key.span().start as i64);
        match given.as_slice() {
            [first, second, ..] => {
                let found = format!("both {} and {} are given", first.get_ref(), second.get_ref());
                let help = "Expected exactly one kind; a second light needs its own [[light]].";
                self.add(second.span(), found, help.to_string());
            }
            [] if table.keys().all(|key| is_known(key.get_ref())) => {
                let kinds = LightKind::KEYS.join(", ");
                let help = format!(
                    "Expected one of {kinds}, such as point = {{ position = [2.0, 4.0, 3.0] }}."
                );
                self.add(span, "the light has no kind".to_string(), help);
            }
            // If no kind is given, an unknown key may be a mistyped kind; it has its error already.
            [_] | [] => {}
        }
    }

    /// Reads `value` of the type `takes` into the child `key` of `parent`.
    fn child(
        &mut self,
        key: &str,
        takes: ValueType,
        value: &Spanned<DeValue>,
        parent: &mut dyn KeyNode,
    ) {
        if let Some(node) = parent.make_child(key) {
            self.path.push(key.to_string());
            self.value(takes, value, node);
            self.path.pop();
        }
    }

    fn entries(&mut self, list: &[Spanned<DeValue>], takes: ValueType, node: &mut dyn KeyNode) {
        let first = self.part.first_index(&self.path);
        for (i, entry) in (first..).zip(list) {
            self.child(&i.to_string(), takes, entry, node);
        }
    }

    /// Reads the value `spanned` of the type `takes` into `node`.
    fn value(&mut self, takes: ValueType, spanned: &Spanned<DeValue>, node: &mut dyn KeyNode) {
        let (value, span) = (spanned.get_ref(), spanned.span());
        match (takes, value) {
            (ValueType::Table(fields), DeValue::Table(table)) => {
                self.table(table, span.clone(), fields, node);
                if matches!(self.path.as_slice(), [list, _] if list == "light") {
                    self.kind_of_light(table, span);
                }
            }
            (ValueType::OneOf(fields), DeValue::Table(table)) => {
                self.one_of(table, span, fields, node);
            }
            (ValueType::ListOf(fields), DeValue::Array(list)) => {
                self.entries(list, ValueType::OneOf(fields), node);
            }
            (ValueType::Tables(fields), DeValue::Array(list)) => {
                self.entries(list, ValueType::Table(fields()), node);
            }
            (ValueType::Named(fields), DeValue::Table(named)) => {
                for (name, entry) in named {
                    self.child(name.get_ref(), ValueType::Table(fields), entry, node);
                }
            }
            (takes, value) if read_value(takes, value).is_some_and(|v| node.set_value(v)) => {}
            (ValueType::Choice(choices), DeValue::String(word)) => {
                let intended = did_you_mean(word, choices.iter().map(|c| c.name));
                let help = format!("Expected {takes}.{intended}");
                self.add(span, format!("{} is {}", self.inner(), describe(value)), help);
            }
            (ValueType::Color(_), DeValue::String(text)) => {
                let meant = Color::typed(text).map(|color| match color.to_hex() {
                    Some(code) => format!(" Did you mean \"{code}\"?"),
                    None => format!(" Did you mean {:?}?", color.0),
                });
                let help = format!("Expected {takes}.{}", meant.unwrap_or_default());
                self.add(span, format!("{} is {}", self.inner(), describe(value)), help);
            }
            (ValueType::Number(_), DeValue::Array(_) | DeValue::String(_))
                if self.path.last().is_some_and(|key| key == "emission") =>
            {
                self.wrong(span, value, &format!("{takes}; its colour is emission_color"));
            }
            (ValueType::Tables(_), _) if self.path.len() == 1 => {
                let expected = format!("tables that begin with [[{}]]", self.path[0]);
                self.wrong(span, value, &expected);
            }
            (ValueType::Named(_), _) => {
                let expected = format!("tables that begin with [{}.NAME]", self.path[0]);
                self.wrong(span, value, &expected);
            }
            (takes, _) => self.wrong(span, value, &takes.to_string()),
        }
    }
}

/// Describes a TOML value in words: `the string "abc"`, `the number -2`, `[1, 2]`.
fn describe(value: &DeValue) -> String {
    match value {
        DeValue::String(_) => format!("the string {}", literal(value)),
        DeValue::Integer(digits) => match integer(digits) {
            Some(number) => format!("the number {number}"),
            None => format!("a whole number too large for 64 bits, {}", literal(value)),
        },
        DeValue::Float(_) => format!("the number {}", literal(value)),
        DeValue::Array(list) if list.is_empty() => "an empty list".to_string(),
        DeValue::Array(list) => {
            let items: Vec<_> = list.iter().take(4).map(|item| literal(item.get_ref())).collect();
            let ellipsis = if list.len() > items.len() { ", …" } else { "" };
            format!("[{}{ellipsis}]", items.join(", "))
        }
        DeValue::Boolean(_) | DeValue::Datetime(_) | DeValue::Table(_) => literal(value),
    }
}

/// Returns a TOML value as it is written; lists, tables and dates in words.
fn literal(value: &DeValue) -> String {
    match value {
        DeValue::String(text) => format!("\"{}\"", truncated(text)),
        DeValue::Integer(digits) => truncated(digits.as_str()),
        DeValue::Float(digits) => truncated(digits.as_str()),
        DeValue::Boolean(yes) => yes.to_string(),
        DeValue::Datetime(_) => "a date or time".to_string(),
        DeValue::Array(_) => "a list".to_string(),
        DeValue::Table(_) => "a table".to_string(),
    }
}
