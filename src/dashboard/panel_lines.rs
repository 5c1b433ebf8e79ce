//! Lines of outline, inspector and form as data. `view` draws them, and `update` moves the cursor
//! over them.

use crate::dashboard::search::has_words;
use crate::dashboard::{FieldList, Form, Model, Overlay};
use std::collections::BTreeSet;
use std::iter::successors;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{Property, Target, Widget, outline as targets, rows};
use zerkalo_scene::value::truncated;

/// Cursor of a list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ListCursor {
    /// Index of the entry under the cursor.
    pub index: usize,
    /// Index of the first visible entry.
    pub scroll: usize,
}

impl ListCursor {
    /// Moves the cursor by `steps` in a list of `len` entries.
    pub fn walk(&mut self, steps: isize, len: usize) {
        self.index = self.index.saturating_add_signed(steps).min(len.saturating_sub(1));
    }

    /// Scrolls a list of `len` entries so that the entry under the cursor is among the `rows`
    /// visible ones.
    pub fn follow(&mut self, len: usize, rows: usize) {
        self.walk(0, len);
        self.scroll = scrolled(self.scroll, Some(self.index), len, rows);
    }
}

/// Line of a list.
#[derive(Clone, Debug, PartialEq)]
pub enum ListLine<T> {
    Heading(String),
    /// Entry, which can be under the cursor.
    Entry(T),
}

impl<T> ListLine<T> {
    pub fn entry(&self) -> Option<&T> {
        match self {
            Self::Entry(entry) => Some(entry),
            Self::Heading(_) => None,
        }
    }
}

pub type OutlineLine = ListLine<OutlineEntry>;

/// Line of the inspector or of a form.
pub type PanelLine = ListLine<Box<FieldLine>>;

#[derive(Clone, Debug, PartialEq)]
pub struct OutlineEntry {
    pub target: Target,
    /// Name with control characters escaped.
    pub label: String,
    /// Number of compounds that have the part.
    pub depth: usize,
    /// `true` if the parts of a compound are listed, `false` if they are folded; `None` for others.
    pub unfolded: Option<bool>,
    /// Material of an object, `off` for a light that is off, or the key that recalls a stored
    /// camera.
    pub note: String,
}

/// Line that shows the value of a property, or one number of this value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldLine {
    /// Part of the scene that has the property.
    pub target: Target,
    pub property: Property,
    /// Index of the number that the line shows; `None` unless the value is a list of numbers.
    pub component: Option<usize>,
    /// Name on the line, left of the value.
    pub label: String,
    /// Value in the syntax of the text editor, with control characters escaped. Empty if the
    /// property is not set.
    pub value: String,
    /// Linear colour of the swatch beside the value; `None` except on the first line of a colour.
    pub swatch: Option<[f64; 3]>,
    /// `true` if the line is hidden while the list is folded.
    pub is_rare: bool,
    pub act: RowAct,
}

/// Effect of Enter on a line of the inspector or of a form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RowAct {
    #[default]
    Edit,
    /// Accepts the form.
    Add,
    /// Shows or hides the rarely used properties.
    Fold,
    /// Shows the fields of a folded group with a heading.
    Unfold,
}

impl FieldLine {
    /// Returns the help on the line: `problem`, or a description and the valid values, with the
    /// default if the present value is another.
    pub fn help(&self, problem: Option<&str>) -> Vec<String> {
        let Property { doc, expected, default, is_default, .. } = &self.property;
        let texts = match (problem, default) {
            (Some(problem), _) => vec![problem.to_string()],
            (None, Some(default)) if !default.is_empty() && !is_default => {
                vec![doc.to_string(), format!("{expected}; default {default}")]
            }
            (None, _) => vec![doc.to_string(), expected.clone()],
        };
        texts.into_iter().filter(|text| !text.is_empty()).collect()
    }

    /// Returns `true` if both lines show the same number or property.
    pub fn is_same(&self, other: &Self) -> bool {
        let id = |line: &Self| (line.act, line.component);
        id(self) == id(other)
            && self.target == other.target
            && self.property.key == other.property.key
    }
}

/// Keys of materials that are used most, in the order of their rows.
const COMMON: [&str; 9] = [
    "preset",
    "roughness",
    "reflection",
    "color",
    "metal",
    "transmission",
    "ior",
    "lobe",
    "emission",
];

/// Returns the lines of the outline: all parts of the scene, and the parts of the compounds in
/// `unfolded`.
pub fn outline(scene: &Scene, unfolded: &BTreeSet<Target>) -> Vec<OutlineLine> {
    let mut lines = Vec::new();
    let mut last = None;
    let mut views = 0;
    for (section, target) in targets(scene) {
        let compounds: Vec<_> = successors(target.compound(), Target::compound).collect();
        if !compounds.iter().all(|compound| unfolded.contains(compound)) {
            continue;
        }
        if last != Some(section) {
            lines.push(OutlineLine::Heading(section.title().to_string()));
            last = Some(section);
        }
        let note = match &target {
            Target::View(_) => {
                views += 1;
                if views <= 9 { format!("key {views}") } else { String::new() }
            }
            Target::Light(i) if !scene.lights[*i].on => "off".to_string(),
            Target::Light(i) => truncated(&scene.lights[*i].group),
            Target::Group(name) if !scene.groups[name].on => "off".to_string(),
            Target::Group(name) if *name == scene.film.solo => "alone".to_string(),
            Target::Group(name) => {
                let named = |group: &&String| *group == name;
                let lights = scene.lights.iter().map(|light| &light.group).filter(named).count();
                let glowing = scene.materials.values().filter(|material| material.emits());
                let glowing = glowing.map(|material| &material.group).filter(named).count();
                format!("{} lights", lights + glowing)
            }
            Target::Object(_) | Target::Part(..) => own_material(scene, &target),
            _ => String::new(),
        };
        let label = target.label(scene);
        let is_compound = !target.parts(scene).is_empty();
        let is_unfolded = is_compound.then(|| unfolded.contains(&target));
        lines.push(OutlineLine::Entry(OutlineEntry {
            target,
            label,
            depth: compounds.len(),
            unfolded: is_unfolded,
            note,
        }));
    }
    lines
}

/// Returns the name of the material of an object or part; empty if it is that of its compound.
fn own_material(scene: &Scene, target: &Target) -> String {
    let of = |target: &Target| target.material(scene).map(|material| material.label(scene));
    let whole = target.compound().and_then(|compound| of(&compound));
    of(target).filter(|own| whole.as_ref() != Some(own)).unwrap_or_default()
}

/// Returns the index of the line that selects `target`.
pub fn outline_position(lines: &[OutlineLine], target: &Target) -> Option<usize> {
    let selects = |line: &OutlineLine| line.entry().is_some_and(|entry| entry.target == *target);
    lines.iter().position(selects)
}

/// Returns the lines of the inspector: the properties of `target`, and those of its material.
pub fn inspector(scene: &Scene, target: &Target) -> Vec<PanelLine> {
    let mut lines = fields(scene, target);
    let material = target.material(scene).filter(|material| material != target);
    if let Some(Target::Material(name)) = &material {
        let users = scene.objects.iter().filter(|o| o.names_material(name)).count();
        let shared = if users > 1 { format!(" · shared by {users}") } else { String::new() };
        lines.push(PanelLine::Heading(format!("material {}{shared}", truncated(name))));
        lines.extend(fields(scene, &Target::Material(name.clone())));
    }
    lines
}

/// Returns the lines of a form: the properties of the new object or light, and those of its
/// material if that is not in `base`, the scene before the form was opened.
pub fn form(form: &Form, base: &Scene) -> Vec<PanelLine> {
    let has_new_material = match form.target.material(&form.scene) {
        Some(Target::Material(name)) => !base.materials.contains_key(&name),
        _ => false,
    };
    let what = form.title.strip_prefix("new ").unwrap_or(&form.title);
    let add =
        FieldLine { act: RowAct::Add, label: format!("✓ Add {what}"), ..FieldLine::default() };
    let mut lines = vec![PanelLine::Entry(Box::new(add))];
    lines.extend(match has_new_material {
        true => inspector(&form.scene, &form.target),
        false => fields(&form.scene, &form.target),
    });
    lines
}

fn fields(scene: &Scene, target: &Target) -> Vec<PanelLine> {
    // A `target` that no longer exists has no fields.
    let mut rows = rows(scene, target).unwrap_or_default();
    // The outline has the parts of compounds.
    rows.retain(|row| !row.key.ends_with(".of"));
    if let Target::Material(_) = target {
        rows.sort_by_key(|row| common(row).unwrap_or(COMMON.len()));
    }
    rows.into_iter()
        .flat_map(|property| lines_of(target, property))
        .map(|f| PanelLine::Entry(Box::new(f)))
        .collect()
}

/// Key of the group of fields under the heading of a material.
pub const MATERIAL: &str = "fields of the material";

/// Hides the fields of `folded` groups: those that are indented below another field, or that follow
/// a heading.
fn without(folded: &BTreeSet<String>, lines: Vec<PanelLine>) -> Vec<PanelLine> {
    let mut hidden_from = usize::MAX;
    let visible = |line| match line {
        PanelLine::Heading(title) if folded.contains(MATERIAL) => {
            hidden_from = 0;
            let (act, label) = (RowAct::Unfold, format!("▸ {title}"));
            Some(PanelLine::Entry(Box::new(FieldLine { act, label, ..FieldLine::default() })))
        }
        PanelLine::Heading(_) => Some(line),
        PanelLine::Entry(mut field) => {
            let Property { depth, key, .. } = &field.property;
            if *depth >= hidden_from {
                return None;
            }
            let is_folded = folded.contains(key.as_str());
            hidden_from = if is_folded { depth + 1 } else { usize::MAX };
            field.label.extend(is_folded.then_some(" ▸"));
            Some(PanelLine::Entry(field))
        }
    };
    lines.into_iter().filter_map(visible).collect()
}

/// Returns the position of a material's property among the [`COMMON`] ones.
fn common(row: &Property) -> Option<usize> {
    COMMON.iter().position(|key| row.key.split('.').next() == Some(*key))
}

/// Returns the lines that are visible in the state `list`.
fn visible(lines: Vec<PanelLine>, list: &FieldList, folded: &BTreeSet<String>) -> Vec<PanelLine> {
    if let Some(filter) = &list.filter {
        let is_found = |line: &PanelLine| {
            line.entry().is_some_and(|field| has_words(&field.label, filter.text()))
        };
        return lines.into_iter().filter(is_found).collect();
    }
    let mut lines = without(folded, lines);
    let is_rare = |line: &&PanelLine| line.entry().is_some_and(|field| field.is_rare);
    let rare = lines.iter().filter(is_rare).count();
    let label = if list.unfolded { "▾ fewer".to_string() } else { format!("▸ {rare} more") };
    let fold = FieldLine { act: RowAct::Fold, label, ..FieldLine::default() };
    lines.retain(|line| list.unfolded || !is_rare(&line));
    lines.extend((rare > 0).then(|| PanelLine::Entry(Box::new(fold))));
    lines
}

/// Returns the lines of `property` of `target`: one for each number if the value is a list of
/// numbers, otherwise a single one.
fn lines_of(target: &Target, property: Property) -> Vec<FieldLine> {
    let line = |component: Option<usize>, label: String, value: &str| FieldLine {
        target: target.clone(),
        property: property.clone(),
        component,
        label,
        value: zerkalo_scene::value::sanitized(value),
        swatch: property.color.filter(|_| component.unwrap_or(0) == 0),
        is_rare: matches!(target, Target::Material(_))
            && property.is_default
            && common(&property).is_none(),
        act: RowAct::Edit,
    };
    if property.components.len() < 2 {
        return vec![line(None, property.label.clone(), &property.value)];
    }
    let names: &[&str] = match (property.widget, property.components.len()) {
        (Widget::Color, _) => &["r", "g", "b"],
        (_, 2) => &["width", "height"],
        _ => &["x", "y", "z"],
    };
    let component_line = |(i, value): (usize, &String)| {
        let name = names.get(i).copied().unwrap_or_default();
        line(Some(i), format!("{}.{name}", property.label), value)
    };
    property.components.iter().enumerate().map(component_line).collect()
}

impl Model {
    pub fn outline_lines(&self) -> Vec<OutlineLine> {
        outline(self.scene(), &self.unfolded)
    }

    /// Returns the lines of the open form, or of the inspector.
    pub fn field_lines(&self) -> Vec<PanelLine> {
        let lines = match &self.overlay {
            Some(Overlay::Form(open)) => form(open, self.history.scene()),
            _ => inspector(self.scene(), &self.selection),
        };
        visible(lines, self.field_list(), &self.folded)
    }

    /// Returns the key of the group of the field under the cursor and the index of its first line,
    /// which is the field itself if others are indented below it; `None` if it has no group.
    pub fn field_group(&self) -> Option<(String, usize)> {
        let (lines, cursor) = (self.field_lines(), self.field_list().cursor);
        let depth = |line: &PanelLine| line.entry().map(|field| field.property.depth);
        let own = lines.get(cursor).and_then(depth)?;
        let key = |at: usize| Some((lines[at].entry()?.property.key.to_string(), at));
        let heads = lines.get(cursor + 1).and_then(depth).is_some_and(|below| below > own);
        if heads || lines[cursor].entry().is_some_and(|f| self.folded.contains(&*f.property.key)) {
            return key(cursor);
        }
        let above = (0..cursor).rev().find(|i| depth(&lines[*i]).is_none_or(|d| d < own))?;
        match lines[above] {
            PanelLine::Heading(_) => Some((MATERIAL.to_string(), above)),
            PanelLine::Entry(_) => key(above),
        }
    }
}

/// Returns the index to which the cursor moves by `steps` entries, downwards if positive. Headings
/// are not counted: from a heading, or from beyond the end, the cursor first moves to the next
/// entry, or else to the last. Returns 0 if there are no entries.
pub fn walked<T>(lines: &[ListLine<T>], cursor: usize, steps: isize) -> usize {
    let entries: Vec<usize> = (0..lines.len()).filter(|i| lines[*i].entry().is_some()).collect();
    let last = entries.len().saturating_sub(1);
    let position = entries.iter().position(|i| *i >= cursor).unwrap_or(last);
    entries.get(position.saturating_add_signed(steps).min(last)).copied().unwrap_or(0)
}

/// Returns the index of the first visible line in a list of `len` lines, of which `rows` are
/// visible. It is the index closest to the present one, `scroll`, at which the line `cursor` is
/// visible, and also the line above it if `rows` is greater than 2. Without `cursor`, only the end
/// of the list limits the index.
pub fn scrolled(scroll: usize, cursor: Option<usize>, len: usize, rows: usize) -> usize {
    let following = |cursor: usize| {
        let lowest = (cursor + 1).saturating_sub(rows);
        let highest = if rows > 2 { cursor.saturating_sub(1) } else { cursor };
        scroll.clamp(lowest.min(highest), highest)
    };
    cursor.map_or(scroll, following).min(len.saturating_sub(rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::testing::mirror_room;

    #[test]
    fn every_target_has_outline_line_and_fields() {
        let mut scene = mirror_room();
        scene.cameras.insert("left".into(), scene.camera.clone());
        scene.lights[0].on = false;
        let lines = outline(&scene, &BTreeSet::new());
        for (_, target) in targets(&scene) {
            assert!(outline_position(&lines, &target).is_some(), "{target:?}");
            let fields = inspector(&scene, &target);
            assert!(!fields.is_empty(), "{target:?}");
        }
        let notes: Vec<_> = lines
            .iter()
            .filter_map(OutlineLine::entry)
            .map(|entry| format!("{}/{}", entry.label, entry.note))
            .collect();
        assert!(notes.contains(&"lamp/off".to_string()) && notes.contains(&"left/key 1".into()));
        let ball = inspector(&scene, &Target::Object(2));
        let labels: Vec<_> = ball.iter().filter_map(|l| Some(l.entry()?.label.clone())).collect();
        for label in ["center.x", "center.z", "radius", "color.g", "roughness"] {
            assert!(labels.contains(&label.to_string()), "{labels:?}");
        }
        assert!(ball.contains(&PanelLine::Heading("material red".into())));
    }

    #[test]
    fn cursor_skips_headings() {
        let scene = mirror_room();
        let lines = inspector(&scene, &Target::Object(2));
        let heading = lines.iter().position(|l| l.entry().is_none()).unwrap();
        assert_eq!(walked(&lines, heading - 1, 1), heading + 1);
        assert_eq!(walked(&lines, heading + 1, -1), heading - 1);
        assert_eq!(walked(&lines, 0, -5), 0);
        assert_eq!(walked(&lines, 0, 1000), lines.len() - 1);
        assert_eq!(walked(&lines, heading, 0), heading + 1);
        assert_eq!(walked(&lines, 1000, 0), lines.len() - 1);
        assert_eq!(walked::<()>(&[], 3, 1), 0);
    }

    #[test]
    fn scrolling_keeps_cursor_visible() {
        for rows in 0..12 {
            for len in 1..30 {
                let mut scroll = 0;
                for cursor in (0..len).chain((0..len).rev()) {
                    scroll = scrolled(scroll, Some(cursor), len, rows);
                    let seen = scroll <= cursor && cursor < scroll + rows.max(1);
                    assert!(seen || rows == 0, "{cursor} of {len} in {rows} from {scroll}");
                    assert!(scroll + rows <= len.max(rows));
                }
            }
        }
    }
}
