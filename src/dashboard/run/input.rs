//! From the terminal's events to the dashboard's messages.

use crate::dashboard::input::{Button, Code, Key, Mouse, MouseKind};
use crate::dashboard::message::Message;
use crossbeam_channel::{Receiver, unbounded};
use crossterm::event::{
    self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent,
    MouseEventKind,
};
use std::io;
use std::thread;
use std::time::Instant;

/// Something that the user did, and when it was read.
#[derive(Debug)]
pub struct Input {
    /// When it was read; of what was joined, the first.
    pub at: Instant,
    /// What.
    pub message: Message,
}

/// Starts a thread that reads the terminal. After an error it ends.
pub fn read() -> io::Result<Receiver<io::Result<Input>>> {
    let (sender, receiver) = unbounded();
    thread::Builder::new().name("reader".into()).spawn(move || {
        loop {
            let input = match event::read() {
                Ok(event) => {
                    message(event).map(|message| Ok(Input { at: Instant::now(), message }))
                }
                Err(error) => Some(Err(error)),
            };
            let Some(input) = input else { continue };
            let failed = input.is_err();
            if sender.send(input).is_err() || failed {
                break;
            }
        }
    })?;
    Ok(receiver)
}

/// Adds `input` to what has not been acted upon yet. Of a drag only the newest place counts, of a
/// resize the newest size; ticks of the wheel add up.
pub fn join(queue: &mut Vec<Input>, input: Input) {
    if let Some(last) = queue.last_mut() {
        match (&mut last.message, &input.message) {
            (Message::Resize(size), Message::Resize(newest)) => return *size = *newest,
            (Message::Mouse(mouse), Message::Mouse(newest))
                if mouse.modified == newest.modified =>
            {
                let kind = match (mouse.kind, newest.kind) {
                    (MouseKind::Drag(a), MouseKind::Drag(b)) if a == b => Some(newest.kind),
                    (MouseKind::Scroll(a), MouseKind::Scroll(b)) => Some(MouseKind::Scroll(a + b)),
                    _ => None,
                };
                if let Some(kind) = kind {
                    return *mouse = Mouse { kind, ..*newest };
                }
            }
            _ => {}
        }
    }
    queue.push(input);
}

fn message(event: Event) -> Option<Message> {
    match event {
        Event::Key(event) => key(event).map(Message::Key),
        Event::Mouse(event) => mouse(event).map(Message::Mouse),
        Event::Paste(text) => Some(Message::Paste(text)),
        Event::Resize(columns, rows) => Some(Message::Resize([columns, rows])),
        Event::FocusGained | Event::FocusLost => None,
    }
}

fn key(event: KeyEvent) -> Option<Key> {
    if event.kind == KeyEventKind::Release {
        return None;
    }
    let code = match event.code {
        KeyCode::Char(c) => Code::Char(c),
        KeyCode::Enter => Code::Enter,
        KeyCode::Esc => Code::Esc,
        KeyCode::Tab | KeyCode::BackTab => Code::Tab,
        KeyCode::Backspace => Code::Backspace,
        KeyCode::Delete => Code::Delete,
        KeyCode::Left => Code::Left,
        KeyCode::Right => Code::Right,
        KeyCode::Up => Code::Up,
        KeyCode::Down => Code::Down,
        KeyCode::Home => Code::Home,
        KeyCode::End => Code::End,
        KeyCode::PageUp => Code::PageUp,
        KeyCode::PageDown => Code::PageDown,
        KeyCode::F(n) => Code::F(n),
        _ => return None,
    };
    let with = |modifier| event.modifiers.contains(modifier);
    let character = matches!(code, Code::Char(_));
    let back = event.code == KeyCode::BackTab;
    Some(Key {
        code,
        ctrl: with(KeyModifiers::CONTROL),
        alt: with(KeyModifiers::ALT),
        shift: back || with(KeyModifiers::SHIFT) && !character,
    })
}

fn mouse(event: MouseEvent) -> Option<Mouse> {
    let kind = match event.kind {
        MouseEventKind::Down(b) => MouseKind::Press(button(b)),
        MouseEventKind::Up(b) => MouseKind::Release(button(b)),
        MouseEventKind::Drag(b) => MouseKind::Drag(button(b)),
        MouseEventKind::ScrollUp => MouseKind::Scroll(1),
        MouseEventKind::ScrollDown => MouseKind::Scroll(-1),
        MouseEventKind::Moved | MouseEventKind::ScrollLeft | MouseEventKind::ScrollRight => {
            return None;
        }
    };
    let modified = event.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT);
    Some(Mouse { kind, column: event.column, row: event.row, modified })
}

fn button(button: MouseButton) -> Button {
    match button {
        MouseButton::Left => Button::Left,
        MouseButton::Middle => Button::Middle,
        MouseButton::Right => Button::Right,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pressed(code: KeyCode, modifiers: KeyModifiers) -> String {
        key(KeyEvent::new(code, modifiers)).map_or(String::new(), |key| key.to_string())
    }

    #[test]
    fn keys_have_the_names_of_the_key_table() {
        let none = KeyModifiers::NONE;
        for (code, modifiers, name) in [
            (KeyCode::Char('a'), none, "a"),
            (KeyCode::Char('A'), KeyModifiers::SHIFT, "A"),
            (KeyCode::Char('s'), KeyModifiers::CONTROL, "Ctrl-s"),
            (KeyCode::Char(' '), none, "Space"),
            (KeyCode::Left, KeyModifiers::SHIFT, "Shift-Left"),
            (KeyCode::Up, KeyModifiers::ALT, "Alt-Up"),
            (KeyCode::BackTab, KeyModifiers::SHIFT, "Shift-Tab"),
            (KeyCode::BackTab, none, "Shift-Tab"),
            (KeyCode::PageDown, none, "PageDown"),
            (KeyCode::F(2), none, "F2"),
            (KeyCode::CapsLock, none, ""),
        ] {
            assert_eq!(pressed(code, modifiers), name);
        }
        let release =
            KeyEvent::new_with_kind(KeyCode::Enter, KeyModifiers::NONE, KeyEventKind::Release);
        assert_eq!(key(release), None);
    }

    fn at(kind: MouseKind, column: u16) -> Input {
        let mouse = Mouse { kind, column, row: 1, modified: false };
        Input { at: Instant::now(), message: Message::Mouse(mouse) }
    }

    #[test]
    fn drags_and_ticks_are_joined_and_nothing_else() {
        use MouseKind::{Drag, Press, Release, Scroll};
        let (left, right) = (Button::Left, Button::Right);
        let mut queue = Vec::new();
        for (kind, column) in [
            (Press(left), 1),
            (Drag(left), 2),
            (Drag(left), 3),
            (Drag(left), 4),
            (Release(left), 4),
            (Drag(right), 5),
            (Drag(left), 6),
            (Scroll(1), 7),
            (Scroll(1), 8),
            (Scroll(-1), 9),
        ] {
            join(&mut queue, at(kind, column));
        }
        let joined: Vec<_> = queue
            .iter()
            .map(|input| match &input.message {
                Message::Mouse(mouse) => (mouse.kind, mouse.column),
                other => panic!("{other:?}"),
            })
            .collect();
        let expected = [
            (Press(left), 1),
            (Drag(left), 4),
            (Release(left), 4),
            (Drag(right), 5),
            (Drag(left), 6),
            (Scroll(1), 9),
        ];
        assert_eq!(joined, expected);
        assert!(queue.windows(2).all(|pair| pair[0].at <= pair[1].at));
    }

    #[test]
    fn of_sizes_only_the_newest_counts_and_keys_stay_apart() {
        let mut queue = Vec::new();
        let now = Instant::now();
        let key = Key { code: Code::Left, ctrl: false, alt: false, shift: false };
        for message in [
            Message::Resize([80, 24]),
            Message::Resize([81, 24]),
            Message::Key(key),
            Message::Key(key),
            Message::Resize([90, 30]),
        ] {
            join(&mut queue, Input { at: now, message });
        }
        assert!(matches!(queue[0].message, Message::Resize([81, 24])));
        assert!(matches!(queue[1].message, Message::Key(k) if k == key));
        assert_eq!(queue.len(), 4);
    }
}
