//! Lines of three lists as data: the outline (all parts of the scene), the inspector (properties of
//! the selection) and the form for a new object or light. `view` draws the lines, and `update`
//! moves the cursor over them.

use crate::dashboard::model::Model;
use crate::dashboard::overlay::{Form, Overlay};
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{Property, Target, Widget, outline as subjects, rows};
use zerkalo_scene::value::truncated;

/// Line of a list in a panel or form: a heading or an entry.
#[derive(Clone, Debug, PartialEq)]
pub enum ListLine<T> {
    /// Heading of the entries below.
    Heading(String),
    /// Entry, which can be under the cursor.
    Entry(T),
}

impl<T> ListLine<T> {
    /// Returns the entry of the line. Returns `None` for a heading.
    pub fn entry(&self) -> Option<&T> {
        match self {
            Self::Entry(entry) => Some(entry),
            Self::Heading(_) => None,
        }
    }
}

/// Line of the outline, the list of all parts of the scene.
pub type OutlineLine = ListLine<OutlineEntry>;

/// Line of the inspector or of a form.
pub type PanelLine = ListLine<Box<FieldLine>>;

/// Part of the scene that can be selected in the outline.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineEntry {
    /// Part of the scene that the entry selects.
    pub subject: Target,
    /// Name of the part, with control characters escaped.
    pub label: String,
    /// Note after the name: the material of an object, `off` for a light that is off, or the key
    /// that recalls a stored camera. Empty for other parts.
    pub note: String,
}

/// Line of the inspector or of a form: shows the value of a property, or one number of this value.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldLine {
    /// Part of the scene that the property belongs to.
    pub subject: Target,
    /// Property that the line shows. The line may show only one number of the value, see
    /// `component`.
    pub property: Property,
    /// Index of the number that the line shows, if the property's value is a list of numbers.
    /// `None` for any other value.
    pub component: Option<usize>,
    /// Name of the property or number on the line, left of the value.
    pub label: String,
    /// Value in the syntax of the text editor, with control characters escaped. Empty if the
    /// property is not set in the scene.
    pub value: String,
    /// Linear colour of the swatch that is drawn beside the value. A colour has one line for each
    /// of its three components, and the swatch is on the first. `None` for all other lines.
    pub swatch: Option<[f64; 3]>,
}

/// Returns the lines of the outline, the list of all parts of `scene`.
pub fn outline(scene: &Scene) -> Vec<OutlineLine> {
    let mut lines = Vec::new();
    let mut last = None;
    let mut views = 0;
    for (section, subject) in subjects(scene) {
        if last != Some(section) {
            lines.push(OutlineLine::Heading(section.title().to_string()));
            last = Some(section);
        }
        let note = match &subject {
            Target::View(_) => {
                views += 1;
                if views <= 9 { format!("key {views}") } else { String::new() }
            }
            Target::Light(i) if !scene.lights[*i].on => "off".to_string(),
            Target::Object(i) => truncated(&scene.objects[*i].material),
            _ => String::new(),
        };
        let label = subject.label(scene);
        lines.push(OutlineLine::Entry(OutlineEntry { subject, label, note }));
    }
    lines
}

/// Returns the index of the line that selects `subject` in the outline, the list of all parts of
/// the scene. Returns `None` if no line selects it.
pub fn outline_position(lines: &[OutlineLine], subject: &Target) -> Option<usize> {
    let selects = |line: &OutlineLine| line.entry().is_some_and(|entry| entry.subject == *subject);
    lines.iter().position(selects)
}

/// Returns the lines of the inspector: the properties of `subject`, and those of its material if it
/// is an object.
pub fn inspector(scene: &Scene, subject: &Target) -> Vec<PanelLine> {
    let mut lines = fields(scene, subject);
    let material = subject.material(scene).filter(|material| material != subject);
    if let Some(Target::Material(name)) = &material {
        let users = scene.objects.iter().filter(|o| o.names_material(name)).count();
        let shared = if users > 1 { format!(" · shared by {users}") } else { String::new() };
        lines.push(PanelLine::Heading(format!("material {}{shared}", truncated(name))));
        lines.extend(fields(scene, &Target::Material(name.clone())));
    }
    lines
}

/// Returns the lines of a form: the properties of the new object or light. If its material is new
/// as well, the lines include the material's properties. `base` is the scene before the form was
/// opened.
pub fn form(form: &Form, base: &Scene) -> Vec<PanelLine> {
    let has_new_material = match form.subject.material(&form.scene) {
        Some(Target::Material(name)) => !base.materials.contains_key(&name),
        _ => false,
    };
    match has_new_material {
        true => inspector(&form.scene, &form.subject),
        false => fields(&form.scene, &form.subject),
    }
}

fn fields(scene: &Scene, subject: &Target) -> Vec<PanelLine> {
    // A `subject` that no longer exists in the scene has no fields.
    let rows = rows(scene, subject).unwrap_or_default();
    rows.into_iter()
        .flat_map(|property| lines_of(subject, property))
        .map(|f| PanelLine::Entry(Box::new(f)))
        .collect()
}

/// Returns the lines of `property`, which belongs to `subject`. A value that is a list of numbers
/// has one line for each number. Any other value has one line.
fn lines_of(subject: &Target, property: Property) -> Vec<FieldLine> {
    let line = |component: Option<usize>, label: String, value: &str| FieldLine {
        subject: subject.clone(),
        property: property.clone(),
        component,
        label,
        value: zerkalo_scene::value::sanitized(value),
        swatch: property.color.filter(|_| component.unwrap_or(0) == 0),
    };
    if property.components.len() < 2 {
        return vec![line(None, property.label.clone(), &property.value)];
    }
    let names: &[&str] = match (property.entry, property.components.len()) {
        (Widget::Color, _) => &["red", "green", "blue"],
        (_, 2) => &["width", "height"],
        _ => &["x", "y", "z"],
    };
    let component_line = |(i, value): (usize, &String)| {
        let name = names.get(i).copied().unwrap_or_default();
        line(Some(i), format!("{} {name}", property.label), value)
    };
    property.components.iter().enumerate().map(component_line).collect()
}

impl Model {
    /// Returns the lines of the form if one is open, otherwise those of the inspector.
    pub fn field_lines(&self) -> Vec<PanelLine> {
        match &self.overlay {
            Some(Overlay::Form(open)) => form(open, self.history.scene()),
            _ => inspector(self.scene(), &self.selection),
        }
    }
}

/// Returns the index of a line near `wanted` that shows a property. This is the first such line at
/// or after `wanted`, or the last such line before `wanted` if there is none after it. Returns 0 if
/// no line shows a property.
pub fn nearest_field(lines: &[PanelLine], wanted: usize) -> usize {
    let field = |i: &usize| lines[*i].entry().is_some();
    (wanted..lines.len())
        .find(field)
        .or_else(|| (0..lines.len().min(wanted)).rev().find(field))
        .unwrap_or(0)
}

/// Returns the index of the line to which the cursor moves from `cursor` by `steps` lines,
/// downwards if `steps` is positive. Headings are skipped and not counted. The cursor stops at the
/// first and at the last line with a property.
pub fn walk_fields(lines: &[PanelLine], cursor: usize, steps: isize) -> usize {
    let fields: Vec<usize> = (0..lines.len()).filter(|i| lines[*i].entry().is_some()).collect();
    let position =
        fields.iter().position(|i| *i >= cursor).unwrap_or(fields.len().saturating_sub(1));
    let to = position.saturating_add_signed(steps).min(fields.len().saturating_sub(1));
    fields.get(to).copied().unwrap_or(0)
}

/// Returns the new scroll position of a list: the index of its first visible line. The list has
/// `len` lines, of which `rows` are visible. The new position is the nearest one to the present
/// position `scroll` at which the line with index `cursor` is visible. If `rows` is greater than 2,
/// the line above the cursor is visible, too.
pub fn scrolled(scroll: usize, cursor: usize, len: usize, rows: usize) -> usize {
    let lowest = (cursor + 1).saturating_sub(rows);
    let highest = if rows > 2 { cursor.saturating_sub(1) } else { cursor };
    scroll.clamp(lowest.min(highest), highest).min(len.saturating_sub(rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_scene::built_in;

    #[test]
    fn every_target_has_outline_line_and_fields() {
        let mut scene = built_in();
        scene.cameras.insert("left".into(), scene.camera.clone());
        scene.lights[0].on = false;
        let lines = outline(&scene);
        for (_, subject) in subjects(&scene) {
            assert!(outline_position(&lines, &subject).is_some(), "{subject:?}");
            let fields = inspector(&scene, &subject);
            assert!(!fields.is_empty(), "{subject:?}");
        }
        let notes: Vec<_> = lines
            .iter()
            .filter_map(OutlineLine::entry)
            .map(|entry| format!("{}/{}", entry.label, entry.note))
            .collect();
        assert!(notes.contains(&"lamp/off".to_string()) && notes.contains(&"left/key 1".into()));
        let ball = inspector(&scene, &Target::Object(2));
        let labels: Vec<_> = ball.iter().filter_map(|l| Some(l.entry()?.label.clone())).collect();
        for label in ["center x", "center z", "radius", "color green", "roughness"] {
            assert!(labels.contains(&label.to_string()), "{labels:?}");
        }
        assert!(ball.contains(&PanelLine::Heading("material red".into())));
    }

    #[test]
    fn cursor_skips_headings() {
        let scene = built_in();
        let lines = inspector(&scene, &Target::Object(2));
        let heading = lines.iter().position(|l| l.entry().is_none()).unwrap();
        assert_eq!(walk_fields(&lines, heading - 1, 1), heading + 1);
        assert_eq!(walk_fields(&lines, heading + 1, -1), heading - 1);
        assert_eq!(walk_fields(&lines, 0, -5), 0);
        assert_eq!(walk_fields(&lines, 0, 1000), lines.len() - 1);
        assert_eq!(nearest_field(&lines, heading), heading + 1);
        assert_eq!(nearest_field(&lines, 1000), lines.len() - 1);
        assert_eq!((walk_fields(&[], 3, 1), nearest_field(&[], 3)), (0, 0));
    }

    #[test]
    fn scrolling_keeps_cursor_visible() {
        for rows in 0..12 {
            for len in 1..30 {
                let mut scroll = 0;
                for cursor in (0..len).chain((0..len).rev()) {
                    scroll = scrolled(scroll, cursor, len, rows);
                    let seen = scroll <= cursor && cursor < scroll + rows.max(1);
                    assert!(seen || rows == 0, "{cursor} of {len} in {rows} from {scroll}");
                    assert!(scroll + rows <= len.max(rows));
                }
            }
        }
    }
}
