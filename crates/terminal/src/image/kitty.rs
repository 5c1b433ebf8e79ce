//! Kitty's graphics protocol (sw.kovidgoyal.net/kitty/graphics-protocol): PNG files in chunks.

use crate::image::transfer::Transfer;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use crossterm::cursor::MoveTo;
use ratatui::layout::Rect;

/// Base64 characters in a chunk. The protocol permits multiples of 4 up to 4096. A chunk of 1024
/// fits into the smallest budget of a frame.
const CHUNK: usize = 1024;

/// Number of the image. It is below 256, because placeholders encode it as an indexed colour.
pub const IMAGE: u8 = 163;

/// Character in place of which the terminal shows a part of an image.
const PLACEHOLDER: char = '\u{10eeee}';

/// Combining marks that encode the row of a placeholder: the first ones of the protocol's table.
const MARKS: [u32; 88] = [
    0x305, 0x30d, 0x30e, 0x310, 0x312, 0x33d, 0x33e, 0x33f, 0x346, 0x34a, 0x34b, 0x34c, 0x350,
    0x351, 0x352, 0x357, 0x35b, 0x363, 0x364, 0x365, 0x366, 0x367, 0x368, 0x369, 0x36a, 0x36b,
    0x36c, 0x36d, 0x36e, 0x36f, 0x483, 0x484, 0x485, 0x486, 0x487, 0x592, 0x593, 0x594, 0x595,
    0x597, 0x598, 0x599, 0x59c, 0x59d, 0x59e, 0x59f, 0x5a0, 0x5a1, 0x5a8, 0x5a9, 0x5ab, 0x5ac,
    0x5af, 0x5c4, 0x610, 0x611, 0x612, 0x613, 0x614, 0x615, 0x616, 0x617, 0x657, 0x658, 0x659,
    0x65a, 0x65b, 0x65d, 0x65e, 0x6d6, 0x6d7, 0x6d8, 0x6d9, 0x6da, 0x6db, 0x6dc, 0x6df, 0x6e0,
    0x6e1, 0x6e2, 0x6e4, 0x6e7, 0x6e8, 0x6eb, 0x6ec, 0x730, 0x732, 0x733,
];

/// Largest number of rows that placeholders can encode.
pub const MAX_ROWS: u16 = MARKS.len() as u16;

/// Returns the text of each cell in row `row` of the image. Without a column, the terminal itself
/// counts the columns from the left.
pub fn placeholder(row: u16, column: Option<u16>) -> String {
    let mark = |n| MARKS.get(usize::from(n)).and_then(|mark: &u32| char::from_u32(*mark));
    [Some(PLACEHOLDER), mark(row), column.and_then(mark)].into_iter().flatten().collect()
}

/// Returns the bytes that show the file `png` in the cells `place`. Inside tmux, these cells must
/// hold placeholders. If `stretched` or `through_tmux`, the terminal scales the image to the cells.
pub fn transfer(png: &[u8], place: Rect, stretched: bool, through_tmux: bool) -> Transfer {
    let remove = [GIVE_UP.to_string(), removal(IMAGE.into())];
    let wrap = |sequence: String| if through_tmux { wrapped(&sequence) } else { sequence };
    let remove = remove.map(wrap).concat().into_bytes();
    let mut transfer = Transfer { remove, ..Transfer::default() };
    let Rect { x, y, width, height } = place;
    // The image appears at the cursor when the last chunk arrives.
    let cursor = match through_tmux {
        true => String::new(),
        false => MoveTo(x, y).to_string(),
    };
    let mut placement = if through_tmux { "U=1" } else { "C=1" }.to_string();
    if stretched || through_tmux {
        placement += &format!(",c={width},r={height}");
    }
    let keys = format!("i={IMAGE},{placement}");
    send(&mut transfer, png, &keys, &cursor, through_tmux);
    transfer
}

/// Ends an incomplete transfer, which the terminal discards, by an empty last chunk (`m=0`).
pub const GIVE_UP: &str = "\x1b_Gm=0,q=2;\x1b\\";

/// Returns the sequence that removes the image `id`.
pub fn removal(id: u32) -> String {
    format!("\x1b_Ga=d,d=I,i={id},q=2\x1b\\")
}

/// Appends the chunks of the file `png` to `transfer`. `keys` has the image and its placement, and
/// `cursor` moves the cursor there.
pub fn send(transfer: &mut Transfer, png: &[u8], keys: &str, cursor: &str, through_tmux: bool) {
    let wrap = |sequence: String| if through_tmux { wrapped(&sequence) } else { sequence };
    let letters = STANDARD.encode(png);
    let count = letters.len().div_ceil(CHUNK);
    for i in 0..count {
        let chunk = &letters[i * CHUNK..letters.len().min((i + 1) * CHUNK)];
        let first = match i {
            0 => format!("a=T,f=100,{keys},"),
            _ => String::new(),
        };
        let more = u8::from(i + 1 < count);
        let cursor = if i == 0 || more == 0 { cursor } else { "" };
        let chunk = wrap(format!("\x1b_G{first}q=2,m={more};{chunk}\x1b\\"));
        transfer.add(format!("{cursor}{chunk}").as_bytes());
    }
}

/// Wraps an escape sequence so that tmux passes it on.
pub fn wrapped(sequence: &str) -> String {
    format!("\x1bPtmux;{}\x1b\\", sequence.replace('\x1b', "\x1b\x1b"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Decoder;
    use std::time::Duration;

    const PLACE: Rect = Rect { x: 3, y: 1, width: 40, height: 12 };

    #[test]
    fn chunks_carry_the_whole_file() {
        for length in [1, 767, 768, 769, 5000] {
            let png: Vec<u8> = (0..length).map(|i| (i % 251) as u8).collect();
            for (stretched, tmux) in [(false, false), (true, false), (false, true)] {
                let transfer = transfer(&png, PLACE, stretched, tmux);
                let text = String::from_utf8(transfer.bytes.clone()).unwrap();
                let plain = text.replace("\x1b\x1b", "\x1b").replace("\x1bPtmux;", "");
                let pieces: Vec<_> = plain.split("\x1b_G").skip(1).collect();
                let parts = pieces.iter().map(|piece| {
                    let (keys, letters) = piece.split_once(';').unwrap();
                    assert!(keys.contains("q=2") && piece.contains("\x1b\\"));
                    (keys, letters.split_once('\x1b').unwrap().0)
                });
                let (keys, letters): (Vec<_>, Vec<_>) = parts.unzip();
                assert!(letters.iter().all(|l| l.len() <= 4096));
                assert!(letters[..letters.len() - 1].iter().all(|l| l.len() % 4 == 0));
                assert_eq!(STANDARD.decode(letters.concat()).unwrap(), png);
                let open = keys.iter().filter(|keys| keys.contains("m=1")).count();
                assert_eq!(open, keys.len() - 1);
                assert!(keys[0].contains("a=T,f=100,i=163"));
                assert_eq!(keys[0].contains("c=40,r=12"), stretched || tmux);
                assert_eq!(plain.contains("\x1b[2;4H"), !tmux);
                assert!(String::from_utf8_lossy(&transfer.remove).contains("a=d,d=I,i=163"));
            }
        }
    }

    #[test]
    fn placeholders_of_rows_are_distinct() {
        let rows: std::collections::BTreeSet<_> =
            (0..MAX_ROWS).map(|row| placeholder(row, None)).collect();
        assert_eq!(rows.len(), usize::from(MAX_ROWS));
        assert!(rows.iter().all(|row| row.chars().count() == 2));
        assert!(rows.iter().all(|row| unicode_width::UnicodeWidthStr::width(&**row) == 1));
        assert_eq!(placeholder(0, None), "\u{10eeee}\u{305}");
        assert_eq!(placeholder(11, Some(1)), "\u{10eeee}\u{34c}\u{30d}");
    }

    #[test]
    fn graphics_replies_are_not_keys() {
        let mut decoder = Decoder::new(Duration::from_millis(10));
        let events = decoder.take(b"\x1b_Gi=163;EINVAL:broken\x1b\\\x1b_Gi=163;OK\x1b\\");
        assert!(events.iter().all(|e| matches!(e, crate::Event::Reply(_))));
    }
}
