//! Keys and replies in every order and in every way to come: no key is lost, none is made up.

use crate::terminal::cells::Colors;
use crate::terminal::event::{Button, Code, MouseKind};
use crate::terminal::*;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use std::time::Duration;

const WAIT: Duration = Duration::from_millis(40);

/// What keyboards send, and the names of the keys.
const KEYS: &[(&str, &str)] = &[
    ("a", "a"),
    ("A", "A"),
    ("c", "c"),
    ("u", "u"),
    ("[", "["),
    ("]", "]"),
    ("?", "?"),
    ("0", "0"),
    (";", ";"),
    (" ", "Space"),
    ("é", "é"),
    ("Я", "Я"),
    ("漢", "漢"),
    ("🪞", "🪞"),
    ("\r", "Enter"),
    ("\t", "Tab"),
    ("\x7f", "Backspace"),
    ("\x13", "Ctrl-s"),
    ("\0", "Ctrl-Space"),
    ("\x1ba", "Alt-a"),
    ("\x1bé", "Alt-é"),
    ("\x1b\r", "Alt-Enter"),
    ("\x1b[A", "Up"),
    ("\x1bOA", "Up"),
    ("\x1b[1;2D", "Shift-Left"),
    ("\x1b[1;3A", "Alt-Up"),
    ("\x1b[1;5C", "Ctrl-Right"),
    ("\x1b[Z", "Shift-Tab"),
    ("\x1b[H", "Home"),
    ("\x1b[1~", "Home"),
    ("\x1b[4~", "End"),
    ("\x1b[3~", "Delete"),
    ("\x1b[3;7~", "Ctrl-Alt-Delete"),
    ("\x1b[5~", "PageUp"),
    ("\x1b[6~", "PageDown"),
    ("\x1bOP", "F1"),
    ("\x1b[[C", "F3"),
    ("\x1bOS", "F4"),
    ("\x1b[15~", "F5"),
    ("\x1b[21~", "F10"),
    ("\x1b[24~", "F12"),
    ("\x1b[97;5u", "Ctrl-a"),
    ("\x1b[97;2u", "A"),
    ("\x1b[27u", "Esc"),
    ("\x1b[13;2u", "Shift-Enter"),
    ("\x1b[57;1:1u", "9"),
    ("\x1b[27;5;97~", "Ctrl-a"),
];

/// What terminals answer, known or not: what makes other readers lose keys or see some.
const REPLIES: &[&str] = &[
    "\x1b[?2026;2$y",
    "\x1b[?2026;0$y",
    "\x1b[4;2$y",
    "\x1b[24;80R",
    "\x1b[1;1R",
    "\x1b[?1;1R",
    "\x1b[?1;2c",
    "\x1b[?62;4;6;22c",
    "\x1b[>0;276;0c",
    "\x1b[=0c",
    "\x1b[0n",
    "\x1b[?997;1n",
    "\x1b[?13n",
    "\x1b[?1;0;256S",
    "\x1b[6;20;10t",
    "\x1b[4;800;1200t",
    "\x1b[?0u",
    "\x1b]11;rgb:1e1e/1e1e/2e2e\x1b\\",
    "\x1b]11;rgb:ff/ff/ff\x07",
    "\x1b]4;1;rgb:cdcd/0000/0000\x07",
    "\x1b]10;rgba:ffff/ffff/ffff/ffff\x1b\\",
    "\x1b]52;c;aGVsbG8=\x07",
    "\x1bP>|XTerm(379)\x1b\\",
    "\x1bP>|tmux 3.3a\x1b\\",
    "\x1bP1$r48:2::1:2:3m\x1b\\",
    "\x1bP0$r\x1b\\",
    "\x1bP1+r524742=382f382f38\x1b\\",
    "\x1bP!|00000000\x1b\\",
    "\x1b_Gi=31;OK\x1b\\",
    "\x1b_Gi=31;ENOTSUPPORTED:what\x1b\\",
    "\x1b[I",
    "\x1b[O",
];

fn keys(events: &[Event]) -> Vec<String> {
    let name = |event: &Event| match event {
        Event::Key(key) => Some(key.to_string()),
        Event::Reply(_) => None,
        other => Some(format!("{other:?}")),
    };
    events.iter().filter_map(name).collect()
}

fn all_at_once(bytes: &str) -> Vec<Event> {
    let mut decoder = Decoder::new(WAIT);
    let events = decoder.take(bytes.as_bytes());
    assert_eq!(decoder.patience(), None, "{bytes:?} is left half-way");
    events
}

#[test]
fn every_key_is_known() {
    for (bytes, name) in KEYS {
        assert_eq!(keys(&all_at_once(bytes)), [*name], "{bytes:?}");
    }
}

#[test]
fn replies_are_no_keys() {
    for reply in REPLIES {
        assert_eq!(keys(&all_at_once(reply)), [""; 0], "{reply:?}");
    }
}

#[test]
fn replies_say_what_they_say() {
    let rgb = |r, g, b| Reply::Background([r, g, b]);
    for (bytes, reply) in [
        ("\x1b[24;80R", Reply::Cursor { row: 24, column: 80 }),
        ("\x1b[?62;4;22c", Reply::Attributes(vec![62, 4, 22])),
        ("\x1b[?2026;2$y", Reply::Mode { mode: 2026, setting: 2 }),
        ("\x1b]11;rgb:1e1e/2020/ffff\x1b\\", rgb(0x1e, 0x20, 0xff)),
        ("\x1b]11;rgb:0/8/f\x07", rgb(0, 136, 255)),
        ("\x1b]11;rgb:00000/8/f\x07", Reply::Other),
        ("\x1bP>|kitty(0.26.5)\x1b\\", Reply::Version("kitty(0.26.5)".into())),
        ("\x1bP1$r0;48:2:1:2:3m\x1b\\", Reply::Setting("0;48:2:1:2:3m".into())),
        ("\x1b_Gi=31;OK\x1b\\", Reply::Graphics(true)),
        ("\x1b_Gi=31;EINVAL\x1b\\", Reply::Graphics(false)),
        ("\x1b[6;20;10t", Reply::CellSize([10, 20])),
        ("\x1b[?1;0;1024S", Reply::SixelColors(1024)),
        ("\x1b[?2;0;1000;800S", Reply::SixelSize([1000, 800])),
        ("\x1b[?1;3;0S", Reply::Other),
    ] {
        assert_eq!(all_at_once(bytes), [Event::Reply(reply)], "{bytes:?}");
    }
}

#[test]
fn answers_make_capabilities() {
    let mut found = Capabilities::from_environment(Environment::default());
    assert_eq!(found.colors, Colors::Indexed);
    let answers = "\x1bP1$r0;48:2::1:2:3m\x1b\\\x1bP>|XTerm(379)\x1b\\\x1b]11;rgb:ff/ff/ff\x07\
                   \x1b[?2026;2$y\x1b_Gi=31;OK\x1b\\\x1b[6;20;10t\x1b[?62;4c";
    for event in all_at_once(answers) {
        if let Event::Reply(reply) = event {
            found.learn(&reply);
        }
    }
    let expected = Capabilities {
        colors: Colors::True,
        synchronised: true,
        version: Some("XTerm(379)".into()),
        background: Some([255; 3]),
        kitty_graphics: true,
        sixel: true,
        cell_px: Some([10, 20]),
        ..Capabilities::from_environment(Environment::default())
    };
    assert_eq!(found, expected);
    // Of what answers through tmux only some show pictures among text.
    let multiplexer = Some(Multiplexer::Tmux);
    for (version, expected) in [
        ("tmux 3.3a", false),
        ("kitty(0.27.1)", false),
        ("kitty(0.28.0)", true),
        ("ghostty 1.2", true),
    ] {
        let tmux = Environment { multiplexer, ..Environment::default() };
        let mut behind = Capabilities::from_environment(tmux);
        behind.learn(&Reply::Version("tmux 3.3a".into()));
        behind.learn(&Reply::Version(version.into()));
        assert_eq!(behind.placeholders, expected, "{version}");
        assert_eq!(behind.version.as_deref(), Some("tmux 3.3a"));
    }
    // What the user has forbidden no answer brings back.
    let mut without =
        Capabilities::from_environment(Environment { no_color: true, ..Default::default() });
    without.learn(&Reply::Setting("48;2;1;2;3m".into()));
    assert_eq!(without.colors, Colors::Mono);
}

#[test]
fn mice_of_both_protocols() {
    let mouse = |kind, column, row, modified| Event::Mouse(Mouse { kind, column, row, modified });
    let left = Button::Left;
    for (bytes, expected) in [
        ("\x1b[<0;1;1M", Some(mouse(MouseKind::Press(left), 0, 0, false))),
        ("\x1b[<0;300;200m", Some(mouse(MouseKind::Release(left), 299, 199, false))),
        ("\x1b[<34;5;6M", Some(mouse(MouseKind::Drag(Button::Right), 4, 5, false))),
        ("\x1b[<48;5;6M", Some(mouse(MouseKind::Drag(left), 4, 5, true))),
        ("\x1b[<64;5;6M", Some(mouse(MouseKind::Scroll(1), 4, 5, false))),
        ("\x1b[<65;5;6M", Some(mouse(MouseKind::Scroll(-1), 4, 5, false))),
        ("\x1b[<66;5;6M", None),
        ("\x1b[<35;5;6M", None),
        ("\x1b[<0;0;0M", None),
        ("\x1b[M !!", Some(mouse(MouseKind::Press(left), 0, 0, false))),
        ("\x1b[M#!!", Some(mouse(MouseKind::Release(left), 0, 0, false))),
    ] {
        assert_eq!(all_at_once(bytes), Vec::from_iter(expected), "{bytes:?}");
    }
}

#[test]
fn releases_are_no_keys() {
    assert_eq!(keys(&all_at_once("\x1b[97;1:3u\x1b[1;1:3A\x1b[97;1:2u")), ["a"]);
}

#[test]
fn escape_alone_is_a_key_after_a_while() {
    let mut decoder = Decoder::new(WAIT);
    assert_eq!(decoder.take(b"\x1b"), []);
    assert_eq!(decoder.patience(), Some(WAIT));
    assert_eq!(keys(&decoder.give_up()), ["Esc"]);
    assert_eq!(decoder.patience(), None);
    // A key that is typed after it is that key.
    for next in ["[", "]", "q", "O", "P", "_", "]]]", "[["] {
        assert_eq!(decoder.take(b"\x1b"), []);
        assert_eq!(keys(&decoder.give_up()), ["Esc"]);
        let mut found = decoder.take(next.as_bytes());
        found.extend(decoder.give_up());
        assert_eq!(keys(&found).concat(), next);
    }
    assert_eq!(keys(&decoder.take(b"\x1b\x1b\x1b[A")), ["Esc", "Esc", "Up"]);
}

#[test]
fn the_rest_of_a_reply_whose_escape_came_long_ago_is_no_key() {
    for reply in REPLIES.iter().filter(|reply| reply.len() > 3 && !reply.starts_with("\x1b[=")) {
        let mut decoder = Decoder::new(WAIT);
        decoder.take(b"\x1b");
        assert_eq!(keys(&decoder.give_up()), ["Esc"]);
        if reply.starts_with("\x1bP!") {
            continue;
        }
        assert_eq!(keys(&decoder.take(&reply.as_bytes()[1..])), [""; 0], "{reply:?}");
        assert_eq!(keys(&decoder.take(b"q")), ["q"], "{reply:?}");
    }
}

#[test]
fn what_never_ends_is_given_up() {
    for begun in ["\x1b[12;", "\x1b]11;rgb:", "\x1bP1$r", "\x1b_Gi=", "\x1bO1", "\u{e9}"] {
        let mut decoder = Decoder::new(WAIT);
        let bytes = begun.as_bytes();
        // Of the character only its first byte.
        let bytes = if begun.starts_with('\x1b') { bytes } else { &bytes[..1] };
        assert_eq!(decoder.take(bytes), [], "{begun:?}");
        assert!(decoder.patience().is_some_and(|p| p >= Duration::from_millis(500)));
        assert_eq!(keys(&decoder.give_up()), [""; 0], "{begun:?}");
        assert_eq!(keys(&decoder.take(b"q")), ["q"], "{begun:?}");
    }
    for (introducer, key) in [("\x1b[", "Alt-["), ("\x1bO", "Alt-O"), ("\x1b]", "Alt-]")] {
        let mut decoder = Decoder::new(WAIT);
        assert_eq!(decoder.take(introducer.as_bytes()), []);
        assert_eq!(keys(&decoder.give_up()), [key]);
    }
}

#[test]
fn pasted_text_is_no_keys() {
    let text = "qqq\x1b[A]]]\r\x1b[24;80R漢";
    let pasted = all_at_once(&format!("\x1b[200~{text}\x1b[201~x"));
    assert_eq!(pasted[0], Event::Paste(text.to_string()));
    assert_eq!(keys(&pasted[1..]), ["x"]);
    // Nor is more of it than anybody would keep.
    let much = "m".repeat(3 << 20);
    let pasted = all_at_once(&format!("\x1b[200~{much}\x1b[201~x"));
    assert!(matches!(&pasted[0], Event::Paste(kept) if kept.len() == 1 << 20));
    assert_eq!(keys(&pasted[1..]), ["x"]);
    // Nor if its end never comes.
    let mut decoder = Decoder::new(WAIT);
    assert_eq!(decoder.take(b"\x1b[200~half"), []);
    assert_eq!(decoder.give_up(), [Event::Paste("half".into())]);
}

#[test]
fn a_flood_of_replies_hides_no_key() {
    let mut bytes = String::new();
    let mut expected = Vec::new();
    for i in 0..20_000 {
        bytes.push_str(REPLIES[i % REPLIES.len()]);
        if i % 97 == 0 {
            let (key, name) = KEYS[i / 97 % KEYS.len()];
            bytes.push_str(key);
            expected.push(name);
        }
    }
    assert_eq!(keys(&all_at_once(&bytes)), expected);
    // A reply without end takes no memory without end.
    let mut decoder = Decoder::new(WAIT);
    decoder.take(b"\x1b]52;c;");
    (0..1000).for_each(|_| assert_eq!(decoder.take(&[b'A'; 1 << 12]), []));
    assert_eq!(keys(&decoder.take(b"\x07q")), ["q"]);
}

/// A key or a reply: its bytes, and the key's name.
fn thing() -> impl Strategy<Value = (&'static str, Option<&'static str>)> {
    prop_oneof![
        select(KEYS).prop_map(|(bytes, name)| (bytes, Some(name))),
        select(REPLIES).prop_map(|bytes| (bytes, None)),
    ]
}

proptest! {
    /// Cut into pieces anywhere, with pauses shorter than what anybody waits.
    #[test]
    fn no_key_is_lost_and_none_made_up(
        things in vec(thing(), 1..40),
        cuts in vec(0usize..1000, 0..60),
    ) {
        let bytes: Vec<u8> = things.iter().flat_map(|(bytes, _)| bytes.bytes()).collect();
        let expected: Vec<_> = things.iter().filter_map(|(_, name)| *name).collect();
        let mut cuts: Vec<_> = cuts.into_iter().map(|cut| cut % (bytes.len() + 1)).collect();
        cuts.extend([0, bytes.len()]);
        cuts.sort_unstable();
        let mut decoder = Decoder::new(WAIT);
        let mut events = Vec::new();
        for piece in cuts.windows(2) {
            events.extend(decoder.take(&bytes[piece[0]..piece[1]]));
        }
        prop_assert_eq!(keys(&events), expected);
        prop_assert_eq!(decoder.patience(), None);
    }

    /// However it comes, what was sent byte by byte says the same as what was sent at once.
    #[test]
    fn any_bytes_are_read_alike_in_pieces(bytes in vec(any::<u8>(), 0..200)) {
        let mut decoder = Decoder::new(WAIT);
        let mut whole = decoder.take(&bytes);
        whole.extend(decoder.give_up());
        let mut in_pieces = Vec::new();
        let mut decoder = Decoder::new(WAIT);
        for byte in &bytes {
            in_pieces.extend(decoder.take(&[*byte]));
        }
        in_pieces.extend(decoder.give_up());
        prop_assert_eq!(whole, in_pieces);
        // And leaves a reader that reads on.
        let after = keys(&decoder.take(b" q"));
        prop_assert_eq!(after.last().map(String::as_str), Some("q"));
    }

    /// Long pauses between whole things: replies that come when nobody asks any more.
    #[test]
    fn late_replies_are_passed_over(things in vec(thing(), 1..40)) {
        let mut decoder = Decoder::new(WAIT);
        let mut events = Vec::new();
        for (bytes, _) in &things {
            events.extend(decoder.take(bytes.as_bytes()));
            events.extend(decoder.give_up());
        }
        let expected: Vec<_> = things.iter().filter_map(|(_, name)| *name).collect();
        prop_assert_eq!(keys(&events), expected);
    }
}

#[test]
fn modifiers_of_characters_are_told_once() {
    let found = all_at_once("\x1b[65;2u");
    assert_eq!(found, [Event::Key(Key::plain(Code::Char('A')))]);
}
