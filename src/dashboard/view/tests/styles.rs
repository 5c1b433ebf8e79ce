//! Tests of colours and text attributes. The golden files contain only the text of the screens.

use crate::dashboard::model::Colors;
use crate::dashboard::view::tests::states::{STATES, tracing};
use crate::dashboard::view::tests::{drawn, row_text};
use crate::dashboard::{Focus, Model};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier};

fn state(name: &str, screen: [u16; 2]) -> Model {
    let mut model = tracing(screen);
    STATES.iter().find(|(known, _)| *known == name).unwrap().1(&mut model);
    model
}

fn corner(buffer: &Buffer, area: Rect) -> (String, Color, Modifier) {
    let cell = &buffer[(area.x, area.y)];
    (cell.symbol().to_string(), cell.fg, cell.modifier)
}

/// Checks that the border of the panel with the focus differs from the borders of all other panels.
#[test]
fn focus_is_visible_at_every_colour_depth() {
    for colors in Colors::ALL {
        for focus in [Focus::Picture, Focus::Outline, Focus::Inspector] {
            for screen in [[200, 60], [120, 36], [80, 24]] {
                let mut model = tracing(screen);
                model.colors = colors;
                model.focus = focus;
                let (buffer, _) = drawn(&model);
                let layout = model.layout().unwrap();
                let panels = [
                    (Focus::Picture, Some(layout.picture)),
                    (Focus::Outline, layout.outline),
                    (Focus::Inspector, layout.inspector),
                ];
                let mark = |wanted: Focus| {
                    let area = panels.iter().find(|(of, _)| *of == wanted).unwrap().1;
                    area.map(|area| corner(&buffer, area))
                };
                let others: Vec<_> = panels
                    .iter()
                    .filter(|(of, _)| *of != focus)
                    .filter_map(|(of, _)| mark(*of))
                    .collect();
                let focused = mark(focus).expect("the panel with the focus is there");
                assert!(others.iter().all(|other| *other != focused), "{colors:?} {focus:?}");
                assert!(others.windows(2).all(|pair| pair[0] == pair[1]), "{colors:?} {focus:?}");
            }
        }
    }
}

/// Checks that the screen has no colours that the colour depth does not support.
#[test]
fn colours_stay_within_colour_depth() {
    for (name, make) in STATES {
        for colors in Colors::ALL {
            let mut model = tracing([120, 36]);
            make(&mut model);
            model.colors = colors;
            let (buffer, _) = drawn(&model);
            for cell in buffer.content() {
                for color in [cell.fg, cell.bg] {
                    let fits = match colors {
                        Colors::True => true,
                        Colors::Indexed => !matches!(color, Color::Rgb(..)),
                        Colors::Sixteen => match color {
                            Color::Indexed(index) => index < 16,
                            Color::Rgb(..) => false,
                            _ => true,
                        },
                        Colors::Mono => color == Color::Reset,
                    };
                    assert!(fits, "{name}: {color:?} among {colors:?}");
                }
            }
        }
    }
}

#[test]
fn cursor_row_is_highlighted() {
    for colors in Colors::ALL {
        let mut model = state("inspector", [120, 36]);
        model.colors = colors;
        let (buffer, _) = drawn(&model);
        let (list, _) = model.inspector_rows().unwrap();
        let marked = |y: u16| {
            let cell = &buffer[(list.x + 2, y)];
            cell.bg != Color::Reset || cell.modifier.contains(Modifier::REVERSED)
        };
        let rows: Vec<_> = (list.y..list.y + list.height).filter(|y| marked(*y)).collect();
        assert_eq!(rows, [list.y + model.inspector.cursor as u16], "{colors:?}");
    }
}

#[test]
fn defaults_are_dimmed_and_problems_red() {
    let model = state("typing-refused", [120, 36]);
    let (buffer, cursor) = drawn(&model);
    let (_, help) = model.inspector_rows().unwrap();
    assert!(row_text(&buffer, help.y).contains("is no colour"));
    let refusal = buffer[(help.x + 2, help.y)].fg;
    let typed = cursor.map(|at| buffer[(at.x - 1, at.y)].fg).expect("a cursor where text is typed");
    assert_eq!(refusal, typed, "the reason and what it is about have one colour");

    let model = state("inspector", [200, 60]);
    let lines = model.field_lines();
    let (buffer, _) = drawn(&model);
    let (list, _) = model.inspector_rows().unwrap();
    let mut looks = [Vec::new(), Vec::new()];
    for (y, line) in (list.y..list.y + list.height).zip(&lines) {
        let Some(field) = line.entry().filter(|f| !f.value.is_empty()) else { continue };
        if y == list.y + model.inspector.cursor as u16 {
            continue;
        }
        let row: Vec<_> = (list.x..list.x + list.width).map(|x| buffer[(x, y)].symbol()).collect();
        let at = row.concat().rfind(&field.value).map(|byte| row.concat()[..byte].chars().count());
        if let Some(at) = at {
            looks[usize::from(field.property.is_default)].push(buffer[(list.x + at as u16, y)].fg);
        }
    }
    let [given, defaults] = looks;
    assert!(!given.is_empty() && !defaults.is_empty());
    assert!(given.iter().all(|color| *color == Color::Reset), "{given:?}");
    assert!(defaults.iter().all(|color| *color != Color::Reset), "{defaults:?}");
}

/// Checks that hints and parts of the status line are omitted as a whole rather than truncated.
#[test]
fn status_and_hints_are_not_truncated() {
    for (name, make) in STATES {
        for width in [40, 60, 80, 120] {
            let mut model = tracing([width, 24]);
            make(&mut model);
            model.notice = None;
            let (buffer, _) = drawn(&model);
            for y in [22, 23] {
                assert!(!row_text(&buffer, y).contains('…'), "{name} at {width}");
            }
        }
    }
}
