//! Image encoded as terminal output: its bytes, and the positions at which they may be divided.

use std::ops::Range;

/// Bytes that make a terminal show an image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Transfer {
    /// All bytes of the encoded image: escape sequences, one after another.
    pub bytes: Vec<u8>,
    /// Offsets between escape sequences, in ascending order, at which other output may be sent. The
    /// last offset is the length of `bytes`.
    pub stops: Vec<usize>,
    /// `true` if the image's escape sequences may be divided at any byte and ended early by ST
    /// (string terminator). Other output may follow a divided sequence only after its last byte or
    /// such an early end.
    pub divisible: bool,
    /// Bytes that remove the image from the screen, even if only a part of it was sent.
    pub remove: Vec<u8>,
    /// `true` if the image overwrites the cells that it covers. These cells must be drawn again
    /// after the image is removed.
    pub destroys: bool,
}

impl Transfer {
    /// Returns `(range, is_open)`. `range` is the range of the image's bytes to send next.
    /// `is_open` is `true` if the range ends inside of an escape sequence. The caller must then
    /// send the remainder of this sequence, or end it by ST, before any other output. `sent` is the
    /// number of bytes sent before. `room` is the number of bytes that may be sent now.
    ///
    /// The range holds as many complete sequences as fit into `room`. If not even one sequence
    /// fits, the result depends on [`Self::divisible`]. A divisible sequence is cut after `room`
    /// bytes (at least 1). An indivisible one is returned whole and exceeds `room`.
    pub fn slice(&self, sent: usize, room: usize) -> (Range<usize>, bool) {
        let room = room.max(usize::from(self.divisible));
        let later_stops = &self.stops[self.stops.partition_point(|stop| *stop <= sent)..];
        let fitting = later_stops.partition_point(|stop| *stop <= sent.saturating_add(room));
        match (fitting, later_stops.first()) {
            (_, None) => (sent..sent, false),
            (0, Some(stop)) if !self.divisible => (sent..*stop, false),
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
