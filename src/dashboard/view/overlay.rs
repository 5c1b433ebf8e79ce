//! Overlays: help, lists, forms, prompts, questions.

use crate::dashboard::hints::{HelpLine, help};
use crate::dashboard::model::Model;
use crate::dashboard::noise_targets::{ABOUT, Cost};
use crate::dashboard::overlay::{Form, Overlay, Palette, Pick, Prompt, Question};
use crate::dashboard::overlay_layout::{OverlayLayout, wrapped};
use crate::dashboard::update::commands::COMMANDS;
use crate::dashboard::view::fields::{Fields, typed};
use crate::dashboard::view::frame::{overlay, scroll_mark};
use crate::dashboard::view::text::{Row, columns, cut, duration, durations};
use crate::dashboard::view::theme::Theme;
use crate::terminal::Area;
use ratatui::buffer::Buffer;
use ratatui::layout::Position;
use ratatui::style::Style;

/// Draws the overlay. Returns the position of the text cursor, if any.
pub fn draw(model: &Model, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
    let place = model.overlay_layout()?;
    match model.overlay.as_ref()? {
        Overlay::Help { scroll } => keys(*scroll, &place, theme, buffer),
        Overlay::Inventory { scroll } => inventory(model, *scroll, &place, theme, buffer),
        Overlay::NoiseTargets { cursor } => noise_targets(model, *cursor, &place, theme, buffer),
        Overlay::Palette(open) => return palette(open, &place, theme, buffer),
        Overlay::Pick(open) => pick(open, &place, theme, buffer),
        Overlay::Form(open) => return form(model, open, &place, theme, buffer),
        Overlay::Prompt(open) => return prompt(open, &place, theme, buffer),
        // Drawn separately: it has the whole screen.
        Overlay::ViewerImage(_) => {}
        Overlay::Question(open) => question(open, &place, theme, buffer),
    }
    None
}

/// Returns the first visible line and the number of rows of a list of `all` lines, and draws its
/// scroll bar.
fn window(
    place: &OverlayLayout,
    scroll: usize,
    all: usize,
    theme: &Theme,
    buffer: &mut Buffer,
) -> (usize, usize) {
    let rows = usize::from(place.list.height);
    let first = scroll.min(all.saturating_sub(rows));
    scroll_mark(place.list, (first, rows, all), theme.border(true), buffer);
    (first, rows)
}

fn keys(scroll: usize, place: &OverlayLayout, theme: &Theme, buffer: &mut Buffer) {
    overlay(place.frame, "keys", theme, buffer);
    let lines = help();
    let (first, rows) = window(place, scroll, lines.len(), theme, buffer);
    for (row, line) in (0..).zip(lines.iter().skip(first).take(rows)) {
        let mut to = Row::new(buffer, place.list, row);
        match line {
            HelpLine::Heading(title) => {
                to.put(" ", theme.heading()).put(title, theme.heading()).put(" ", theme.heading());
                let rest = to.left().saturating_sub(1);
                to.put(&"─".repeat(rest), theme.border(false));
            }
            HelpLine::Keys(keys, label) => {
                // The label takes precedence over long lists of keys.
                let room = to.left().saturating_sub(3 + columns(label) + 2 + 1);
                to.put_right(" ", 0, theme.text()).put_right(&cut(keys, room), 0, theme.accent());
                to.skip(3).put(label, theme.text());
            }
        }
    }
}

fn inventory(
    model: &Model,
    scroll: usize,
    place: &OverlayLayout,
    theme: &Theme,
    buffer: &mut Buffer,
) {
    overlay(place.frame, "inventory", theme, buffer);
    let lines = model.inventory(place.list.width);
    let (first, rows) = window(place, scroll, lines.len(), theme, buffer);
    for (row, line) in (0..).zip(lines.iter().skip(first).take(rows)) {
        Row::new(buffer, place.list, row).put(line, theme.text());
    }
}

fn noise_targets(
    model: &Model,
    cursor: usize,
    place: &OverlayLayout,
    theme: &Theme,
    buffer: &mut Buffer,
) {
    overlay(place.frame, "noise targets in 8-bit levels", theme, buffer);
    for (row, noise_target) in (0..place.list.height).zip(model.noise_targets()) {
        let (mut to, name, rest) =
            chosen(place.list, row, usize::from(row) == cursor, theme, buffer);
        let cost = match noise_target.cost {
            Cost::Reached(Some(seconds)) => format!("reached after {}", duration(seconds)),
            Cost::Reached(None) => "reached".to_string(),
            Cost::Left(from, to) => format!("{} more", durations(from, to)),
            Cost::Unknown => "not known yet".to_string(),
        };
        let target = if noise_target.is_target { "→ " } else { "  " };
        to.put_right("  ", 0, rest).put_right(&cost, 8, name).put_right("  ", 0, rest);
        to.put(target, theme.good()).put_wide(&noise_target.noise_codes.to_string(), 5, name);
        to.skip(2).put(noise_target.looks, rest);
    }
    say(ABOUT, theme.dim(), place.help, buffer);
}

/// Begins a row of a list with a cursor. Returns the row, and the styles of name and remainder.
fn chosen<'a>(
    list: Area,
    row: u16,
    is_chosen: bool,
    theme: &Theme,
    buffer: &'a mut Buffer,
) -> (Row<'a>, Style, Style) {
    let mut to = Row::new(buffer, list, row);
    let (name, rest) = match is_chosen {
        true => (theme.selected(true), theme.selected(true)),
        false => (theme.text(), theme.dim()),
    };
    if is_chosen {
        to.fill(name);
    }
    to.put(if is_chosen { " ▸ " } else { "   " }, name);
    (to, name, rest)
}

fn palette(
    open: &Palette,
    place: &OverlayLayout,
    theme: &Theme,
    buffer: &mut Buffer,
) -> Option<Position> {
    overlay(place.frame, "all actions", theme, buffer);
    let mut input = Row::new(buffer, place.input, 0);
    input.put(" : ", theme.accent());
    let cursor = typed(&open.editor, &mut input, theme);
    if open.found.is_empty() {
        let none = "nothing is called that";
        Row::new(buffer, place.list, 0).skip(3).put(none, theme.dim());
    }
    let (first, rows) = window(place, open.scroll, open.found.len(), theme, buffer);
    let shown = open.found.iter().enumerate().skip(first).take(rows);
    for (row, (i, found)) in (0..).zip(shown) {
        let Some(command) = COMMANDS.get(*found) else { continue };
        let (mut to, name, rest) = chosen(place.list, row, i == open.cursor, theme, buffer);
        let keys = command.all_keys(str::to_string);
        let key = if i == open.cursor { name } else { theme.accent() };
        to.put_right(" ", 0, key).put_right(&keys, columns(command.label) + 2, key);
        to.put(command.label, name);
        to.put_right("  ", 1, rest).put_right(command.chapter.title(), 1, rest);
    }
    cursor
}

fn pick(open: &Pick, place: &OverlayLayout, theme: &Theme, buffer: &mut Buffer) {
    overlay(place.frame, &open.title, theme, buffer);
    let (first, rows) = window(place, open.scroll, open.entries.len(), theme, buffer);
    let names = open.entries.iter().map(|(name, _)| columns(name)).max().unwrap_or(0);
    let shown = open.entries.iter().enumerate().skip(first).take(rows);
    for (row, (i, (name, doc))) in (0..).zip(shown) {
        let (mut to, style, rest) = chosen(place.list, row, i == open.cursor, theme, buffer);
        to.put_wide(name, names, style).skip(2).put(doc, rest);
    }
}

fn form(
    model: &Model,
    open: &Form,
    place: &OverlayLayout,
    theme: &Theme,
    buffer: &mut Buffer,
) -> Option<Position> {
    overlay(place.frame, &open.title, theme, buffer);
    let lines = model.field_lines();
    let fields = Fields {
        lines: &lines,
        list: place.list,
        help: place.help,
        cursor: open.cursor,
        scroll: open.scroll,
        editor: open.editor.as_ref(),
        problem: open.problem.as_deref(),
        active: true,
    };
    fields.draw(theme, buffer)
}

/// Draws text in the help rows.
fn say(text: &str, style: Style, help: Area, buffer: &mut Buffer) {
    let lines = wrapped(text, help.width);
    for (row, line) in (0..help.height).zip(&lines) {
        Row::new(buffer, help, row).put(line, style);
    }
}

fn prompt(
    open: &Prompt,
    place: &OverlayLayout,
    theme: &Theme,
    buffer: &mut Buffer,
) -> Option<Position> {
    overlay(place.frame, &open.title, theme, buffer);
    match &open.editor.problem {
        Some(problem) => say(problem, theme.bad(), place.help, buffer),
        None => say(&open.help, theme.dim(), place.help, buffer),
    }
    typed(&open.editor, &mut Row::new(buffer, place.input, 0), theme)
}

fn question(open: &Question, place: &OverlayLayout, theme: &Theme, buffer: &mut Buffer) {
    overlay(place.frame, "", theme, buffer);
    say(&open.text, theme.text(), place.help, buffer);
    for (row, (i, (letter, words, _))) in (0..).zip(open.answers.iter().enumerate()) {
        let (mut to, name, _) = chosen(place.list, row, i == open.cursor, theme, buffer);
        let key = if i == open.cursor { name } else { theme.accent() };
        to.put(&letter.to_string(), key).skip(2).put(words, name);
    }
}
