//! Conversion of terminal events to messages.

use crate::dashboard::Message;
use crossbeam_channel::{Receiver, unbounded};
use std::time::Instant;
use std::{io, thread};
use zerkalo_terminal::event::{Mouse, MouseKind};
use zerkalo_terminal::{InputReader, TimedEvent};

/// User input with the time at which it was read.
#[derive(Debug)]
pub struct Input {
    /// Time of the first of the events that were merged into this one.
    pub at: Instant,
    pub message: Message,
}

/// Starts a thread that sends terminal events to the returned receiver, which is disconnected as
/// soon as a read fails.
pub fn read(mut reader: InputReader) -> io::Result<Receiver<TimedEvent>> {
    let (sender, receiver) = unbounded();
    thread::Builder::new().name("reader".into()).spawn(move || {
        while let Ok(events) = reader.wait(None) {
            if events.into_iter().any(|event| sender.send(event).is_err()) {
                break;
            }
        }
    })?;
    Ok(receiver)
}

/// Appends `input` to `queue`. Successive drags are merged into one with the newest position, and
/// resizes into the newest. Ticks of the mouse wheel are added up.
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

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_terminal::event::{Button, Code, Key};

    fn at(kind: MouseKind, column: u16) -> Input {
        let mouse = Mouse { kind, column, row: 1, modified: false };
        Input { at: Instant::now(), message: Message::Mouse(mouse) }
    }

    #[test]
    fn only_drags_and_wheel_ticks_are_joined() {
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
    fn resizes_are_joined_and_keys_are_not() {
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
