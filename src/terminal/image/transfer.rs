//! What is sent for a still, and where it may be cut.

use std::ops::Range;

/// Bytes that make a terminal show a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transfer {
    /// All of them.
    pub bytes: Vec<u8>,
    /// So many bytes on, in ascending order, no sequence is open: anything else may be sent there. The
    /// last one is the end.
    pub stops: Vec<usize>,
    /// Sequences may be cut anywhere, and ended early by ST.
    pub divisible: bool,
    /// What takes the picture away again, or what there is of it.
    pub remove: Vec<u8>,
    /// What is below the picture has to be drawn again when it is gone.
    pub destroys: bool,
}

impl Transfer {
    /// The next bytes after the first `sent`: at most `room`, or one piece if that is larger and cannot
    /// be cut; and whether a sequence is open after them.
    pub fn slice(&self, sent: usize, room: usize) -> (Range<usize>, bool) {
        let room = room.max(usize::from(self.divisible));
        let later = &self.stops[self.stops.partition_point(|stop| *stop <= sent)..];
        let fitting = later.partition_point(|stop| *stop <= sent.saturating_add(room));
        match (fitting, later.first()) {
            (_, None) => (sent..sent, false),
            (0, Some(stop)) if !self.divisible => (sent..*stop, false),
            (0, Some(_)) => (sent..sent + room, true),
            (fitting, _) => (sent..later[fitting - 1], false),
        }
    }

    /// Adds a sequence.
    pub fn add(&mut self, sequence: &[u8]) {
        self.bytes.extend(sequence);
        self.stops.push(self.bytes.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the room, slices are everything, in order; nothing but divisible sequences is cut.
    #[test]
    fn slices_make_up_the_whole() {
        for divisible in [false, true] {
            let mut transfer = Transfer { divisible, ..Transfer::default() };
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
