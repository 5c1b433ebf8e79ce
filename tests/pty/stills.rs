//! Viewer of exported images. The terminal emulator ignores graphics protocols, so that tests
//! decode the images from the program's output.

use super::picture::Picture;
use super::*;
use crate::command_line::signals::signal;
use crate::harness::*;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use icy_sixel::SixelImage;
use terminal::RequestReply;
use zerkalo_terminal::{ATTRIBUTES, LEAVE};

const SIZE: [u16; 2] = [120, 36];
/// Width and height in [`CELL`].
pub const CELL_PX: [usize; 2] = [10, 20];
pub const CELL: RequestReply = (b"\x1b[16t", "\x1b[6;20;10t");
pub const KITTY: RequestReply = (b"\x1b_Gi=31,", "\x1b_Gi=31;OK\x1b\\");
const SIXEL: RequestReply = (b"\x1b[c", "\x1b[?62;4;22c");
const COLORS: RequestReply = (b"\x1b[?1;1;0S", "\x1b[?1;0;256S");
/// Bytes that remove an image from the screen in kitty's graphics protocol.
const REMOVAL: &str = "\x1b_Gm=0,q=2;\x1b\\\x1b_Ga=d,d=I,i=163,q=2\x1b\\";

fn with_picture(fixture: &Fixture, args: &[&str], replies: &[RequestReply]) -> (Terminal, Picture) {
    let command = [&[PROGRAM, "room.toml", "--graphics", "cells"], args].concat();
    let start =
        Start { command: &command, folder: fixture.0.path(), size: SIZE, env: &[], replies: true };
    let mut terminal = Terminal::start_with(&start, replies);
    terminal.wait_for_text(" spp");
    wait_for_picture(&terminal);
    terminal.send("o");
    terminal.wait_for_text("No picture was written yet");
    terminal.send("p");
    terminal.wait_for_text("o shows it");
    let file = Picture::of_png(&fs::read(fixture.path("room-1.png")).unwrap());
    (terminal, file)
}

/// Waits until the output of the program contains `text`. Returns the output from `text` on.
fn wait_for_bytes(terminal: &Terminal, text: &str) -> String {
    let mut all = String::new();
    terminal.wait_for(text, |_| {
        // The callback runs under the lock of the screen, and `bytes` needs the same lock. The
        // output is therefore searched below.
        Some(())
    });
    for _ in 0..6000 {
        all = String::from_utf8_lossy(&terminal.bytes()).into_owned();
        if let Some(start) = all.find(text) {
            return all[start..].to_string();
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("no {text:?} in {} bytes", all.len());
}

/// Returns the chunks of images in kitty's graphics protocol: the keys and the Base64 data of each
/// chunk.
fn chunks(bytes: &str) -> Vec<(&str, &str)> {
    let chunk = |text: &'_ str| -> Option<(usize, usize)> {
        let keys = text.find(';')?;
        Some((keys, text.find('\x1b')?))
    };
    let all = bytes.split("\x1b_G").skip(1);
    all.filter_map(|text| chunk(text).map(|(keys, end)| (&text[..keys], &text[keys + 1..end])))
        .collect()
}

#[test]
fn kitty_protocol_shows_the_exported_file() {
    let fixture = Fixture::with_room();
    let (mut terminal, file) = with_picture(&fixture, &[], &[KITTY, CELL]);
    let before = terminal.bytes().len();
    terminal.send("o");
    terminal.wait_for_text("640×480  ·  any key returns");
    let shown = String::from_utf8_lossy(&terminal.bytes()[before..]).into_owned();
    let chunks = chunks(&shown);
    assert!(chunks[0].0.contains("a=T,f=100,i=163,C=1,q=2"), "{}", chunks[0].0);
    assert!(shown.contains("\x1b[6;29H\x1b_Ga=T"), "64 x 24 of 120 x 35 cells, of 10 x 20 pixels");
    assert!(chunks.iter().all(|(keys, letters)| keys.contains("q=2") && letters.len() <= 4096));
    assert!(chunks.last().unwrap().0.ends_with("m=0"));
    let letters: String = chunks.iter().map(|(_, letters)| *letters).collect();
    let sent = Picture::of_png(&STANDARD.decode(letters).unwrap());
    assert_eq!((sent.size, sent.rgb == file.rgb), (file.size, true));
    // Any key closes the viewer.
    terminal.send("x");
    terminal.wait_for_text("outline");
    let after = String::from_utf8_lossy(&terminal.bytes()).into_owned();
    assert_eq!(after.matches(REMOVAL).count(), 1);
    // A later frame shows the list of keys. When it is visible, the frame that removes the image has
    // certainly been written.
    terminal.send("?");
    terminal.wait_for_text("orbit left");
    terminal.send("\x1b");
    terminal.wait_until_gone("orbit left");
    terminal.send("q");
    let (status, bytes) = terminal.end();
    assert_eq!((status, bytes.matches(REMOVAL).count()), (0, 1), "nothing is left to remove");
    assert!(bytes.ends_with(LEAVE));
}

#[test]
fn signal_removes_the_image() {
    let fixture = Fixture::with_room();
    let (mut terminal, _) = with_picture(&fixture, &[], &[KITTY, CELL]);
    terminal.send("o");
    terminal.wait_for_text("640×480  ·  any key returns");
    signal("TERM", terminal.process_id());
    let (status, bytes) = terminal.end();
    assert_eq!(status, 143);
    assert!(
        bytes.ends_with(&format!("\x1b\\{REMOVAL}{ATTRIBUTES}{LEAVE}")),
        "{:?}",
        &bytes[bytes.len() - 200..]
    );
}

#[test]
fn key_ends_the_transfer() {
    let fixture = Fixture::with_room();
    let slow = ["--bandwidth", "30"];
    let (mut terminal, _) = with_picture(&fixture, &slow, &[KITTY, CELL]);
    terminal.send("o");
    wait_for_bytes(&terminal, "\x1b_Ga=T");
    terminal.send("\x1b");
    let output = wait_for_bytes(&terminal, "\x1b_Ga=T");
    assert!(
        !chunks(&output).iter().any(|(keys, letters)| keys.ends_with("m=0") && !letters.is_empty())
    );
    terminal.wait_for_text("outline");
    let output = wait_for_bytes(&terminal, REMOVAL);
    assert!(!output[REMOVAL.len()..].contains("\x1b_G"), "no chunk comes after the end");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn sixel_shows_the_exported_file_in_strips() {
    let fixture = Fixture::with_room();
    for (args, is_interrupted) in [(&[][..], false), (&["--bandwidth", "30"], true)] {
        let (mut terminal, file) = with_picture(&fixture, args, &[SIXEL, COLORS, CELL]);
        let before = terminal.bytes().len();
        terminal.send("o");
        if is_interrupted {
            wait_for_bytes(&terminal, "\x1bP");
            terminal.send("y");
        } else {
            terminal.wait_for_text("640×480  ·  any key returns");
            let shown = String::from_utf8_lossy(&terminal.bytes()[before..]).into_owned();
            let strips =
                shown.split("\x1bP").skip(1).map(|strip| strip.split("\x1b\\").next().unwrap());
            let mut rgb = Vec::new();
            let mut count = 0;
            for strip in strips {
                let image = SixelImage::decode(format!("\x1bP{strip}\x1b\\").as_bytes()).unwrap();
                assert_eq!(image.width, file.size[0]);
                let drawn = image.pixels.chunks_exact(4).filter(|pixel| pixel[3] > 0);
                rgb.extend(drawn.flat_map(|p| [p[0], p[1], p[2]]));
                count += 1;
            }
            // At most 16 strips are allowed, because xterm keeps only 16 images.
            assert!(count <= 16 && rgb.len() == file.rgb.len(), "{count} strips");
            let difference: u64 =
                rgb.iter().zip(&file.rgb).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
            let mean = difference as f64 / rgb.len() as f64;
            assert!(mean < 5.0, "mean error of {mean} levels");
            terminal.send(" ");
        }
        terminal.wait_for_text("outline");
        fs::remove_file(fixture.path("room-1.png")).unwrap();
        terminal.send("q");
        let (status, bytes) = terminal.end();
        // The last image sequence is complete. After it, the screen is cleared and drawn again.
        let (strips, after) = bytes.rsplit_once("\x1bP").unwrap();
        assert!(strips.contains("\x1bP") || is_interrupted);
        let (_, after) = after.split_once("\x1b\\").unwrap();
        assert!(after.contains("\x1b[2J") && after.ends_with(LEAVE));
        assert_eq!(status, 0);
    }
}

#[test]
fn viewer_uses_half_blocks_until_a_late_reply() {
    let fixture = Fixture::with_room();
    let (mut terminal, _) = with_picture(&fixture, &[], &[]);
    terminal.send("o");
    terminal.wait_for_text("640×480 in half blocks  ·  any key returns");
    wait_for_picture(&terminal);
    assert!(!String::from_utf8_lossy(&terminal.bytes()).contains("\x1b_Ga=T"));
    terminal.send("\r");
    terminal.wait_for_text("outline");
    terminal.send(
        "\x1b_Gi=31;EINVAL:x\x1b\\\x1b_Gi=31;OK\x1b\\\x1b_Ga=T;\x1b\\\x1bP>|kitty(9.9)\x1b\\",
    );
    terminal.send("o");
    wait_for_bytes(&terminal, "\x1b_Ga=T");
    terminal.wait_for_text("640×480  ·  any key returns");
    // The image file is replaced by a damaged one while the viewer is closed.
    terminal.send("o");
    terminal.wait_for_text("outline");
    fs::write(fixture.path("room-1.png"), b"\x89PNG\r\n\x1a\nnothing").unwrap();
    terminal.send("o");
    terminal.wait_for_text("room-1.png cannot be shown");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}
