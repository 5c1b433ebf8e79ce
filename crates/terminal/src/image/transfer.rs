//! Encoded image, and the positions at which it may be divided.

use std::ops::Range;

/// Bytes that make a terminal show an image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transfer {
    /// Escape sequences, one after another.
    pub bytes: Vec<u8>,
    /// Offsets between escape sequences, ascending, at which other output may be sent. The last is
    /// the length of `bytes`.
    pub stops: Vec<usize>,
    /// `true` for sixel and files. Their sequences may be divided at any byte and ended early by ST
    /// (string terminator). A sixel image overwrites its cells, which must be drawn again after its
    /// removal.
    pub is_divisible: bool,
    /// Bytes that remove the image, even if only a part of it was sent.
    pub remove: Vec<u8>,
}

impl Transfer {
    /// Returns the range of at most `room` bytes to send after the first `sent` bytes, and `true`
    /// if the range ends inside an escape sequence. The rest of this sequence, or ST, must then be
    /// sent before any other output.
    ///
    /// If not even one sequence fits, a divisible sequence is cut; a sequence of kitty's protocol is
    /// returned whole.
    pub fn slice(&self, sent: usize, room: usize) -> (Range<usize>, bool) {
        let room = room.max(usize::from(self.is_divisible));
        let later_stops = &self.stops[self.stops.partition_point(|stop| *stop <= sent)..];
        let fitting = later_stops.partition_point(|stop| *stop <= sent.saturating_add(room));
        match (fitting, later_stops.first()) {
            (_, None) => (sent..sent, false),
            (0, Some(stop)) if !self.is_divisible => (sent..*stop, false),
            (0, Some(_)) => (sent..sent + room, true),
            (fitting, _) => (sent..later_stops[fitting - 1], false),
        }
    }

    /// Appends a complete escape sequence of the image.
    pub fn add(&mut self, sequence: &[u8]) {
        self.bytes.extend(sequence);
        self.stops.push(self.bytes.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that the slices of an image transfer cover all bytes in order, and that only
    /// divisible escape sequences are divided.
    #[test]
    fn slices_are_contiguous_and_complete() {
        for divisible in [false, true] {
            let mut transfer = Transfer { is_divisible: divisible, ..Transfer::default() };
            for length in [1, 7, 30, 2, 2, 100, 1] {
                transfer.add(&vec![length as u8; length]);
            }
            for room in 0..150 {
                let (mut sent, mut slices) = (0, 0);
                while sent < transfer.bytes.len() {
                    let (range, open) = transfer.slice(sent, room);
                    assert!(range.start == sent && range.end > sent, "{range:?} of {room}");
                    assert_eq!(open, !transfer.stops.contains(&range.end));
                    assert!(!open || divisible);
                    assert!(range.len() <= room.max(if divisible { 1 } else { 100 }));
                    sent = range.end;
                    slices += 1;
                }
                assert_eq!(sent, 143);
                assert!(room == 0 || slices <= 7 + 143 / room);
                assert_eq!(transfer.slice(sent, room), (143..143, false));
            }
        }
    }
}
