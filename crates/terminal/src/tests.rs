//! Tests of the decoding of terminal input: keys and replies in any order, divided between reads at
//! any byte. No key may be lost, and no reply may be decoded as a key.

use crate::cells::Colors;
use crate::event::{Button, Code, MouseKind};
use crate::*;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use std::time::Duration;

const WAIT: Duration = Duration::from_millis(40);

/// Byte sequences that terminals send for keys, each with the name of its key.
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
    ("\x1b[1;2R", "Shift-F3"),
];

/// Replies of terminals to requests of this program and of other programs. Some other decoders lose
/// keys after these replies or decode the replies as keys.
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
    assert_eq!(decoder.patience(), None, "{bytes:?} is incomplete");
    events
}

#[test]
fn key_sequences_decode_to_their_keys() {
    for (bytes, name) in KEYS {
        assert_eq!(keys(&all_at_once(bytes)), [*name], "{bytes:?}");
    }
}

#[test]
fn replies_produce_no_keys() {
    for reply in REPLIES {
        assert_eq!(keys(&all_at_once(reply)), [""; 0], "{reply:?}");
    }
}

#[test]
fn replies_are_decoded() {
    let rgb = |r, g, b| Reply::Background([r, g, b]);
    for (bytes, reply) in [
        ("\x1b[0n", Reply::Status),
        ("\x1b[24;80R", Reply::Other),
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
fn replies_set_capabilities() {
    let mut capabilities = Capabilities::from_environment(Environment::default());
    assert_eq!(capabilities.colors, Colors::Indexed);
    let replies = "\x1bP1$r0;48:2::1:2:3m\x1b\\\x1bP>|XTerm(379)\x1b\\\x1b]11;rgb:ff/ff/ff\x07\
                   \x1b[?2026;2$y\x1b_Gi=31;OK\x1b\\\x1b[6;20;10t\x1b[?62;4c";
    for event in all_at_once(replies) {
        if let Event::Reply(reply) = event {
            capabilities.learn(&reply);
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
    assert_eq!(capabilities, expected);
    // Inside tmux, tmux reports its version first and the terminal outside tmux second. The second
    // version decides if images can be placed by placeholders.
    let multiplexer = Some(Multiplexer::Tmux);
    for (version, expected) in [
        ("tmux 3.3a", false),
        ("kitty(0.27.1)", false),
        ("kitty(0.28.0)", true),
        ("ghostty 1.2", true),
    ] {
        let environment = Environment { multiplexer, ..Environment::default() };
        let mut tmux_client = Capabilities::from_environment(environment);
        tmux_client.learn(&Reply::Version("tmux 3.3a".into()));
        tmux_client.learn(&Reply::Version(version.into()));
        assert_eq!(tmux_client.placeholders, expected, "{version}");
        assert_eq!(tmux_client.version.as_deref(), Some("tmux 3.3a"));
    }
    // No reply overrides `NO_COLOR`.
    let mut no_color =
        Capabilities::from_environment(Environment { no_color: true, ..Default::default() });
    no_color.learn(&Reply::Setting("48;2;1;2;3m".into()));
    assert_eq!(no_color.colors, Colors::Mono);
}

#[test]
fn mouse_reports_of_both_protocols_are_decoded() {
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
fn key_releases_are_ignored() {
    assert_eq!(keys(&all_at_once("\x1b[97;1:3u\x1b[1;1:3A\x1b[97;1:2u")), ["a"]);
}

#[test]
fn lone_escape_is_a_key_after_timeout() {
    let mut decoder = Decoder::new(WAIT);
    assert_eq!(decoder.take(b"\x1b"), []);
    assert_eq!(decoder.patience(), Some(WAIT));
    assert_eq!(keys(&decoder.give_up()), ["Esc"]);
    assert_eq!(decoder.patience(), None);
    // After an ESC that was reported as the key Escape, the next typed characters are decoded as
    // keys of their own.
    for next in ["[", "]", "q", "O", "P", "_", "]]]", "[["] {
        assert_eq!(decoder.take(b"\x1b"), []);
        assert_eq!(keys(&decoder.give_up()), ["Esc"]);
        let mut events = decoder.take(next.as_bytes());
        events.extend(decoder.give_up());
        assert_eq!(keys(&events).concat(), next);
    }
    assert_eq!(keys(&decoder.take(b"\x1b\x1b\x1b[A")), ["Esc", "Esc", "Up"]);
}

#[test]
fn reply_after_given_up_escape_produces_no_keys() {
    for reply in REPLIES.iter().filter(|reply| reply.len() > 3) {
        let mut decoder = Decoder::new(WAIT);
        decoder.take(b"\x1b");
        assert_eq!(keys(&decoder.give_up()), ["Esc"]);
        assert_eq!(keys(&decoder.take(&reply.as_bytes()[1..])), [""; 0], "{reply:?}");
        assert_eq!(keys(&decoder.take(b"q")), ["q"], "{reply:?}");
    }
}

#[test]
fn incomplete_sequences_are_given_up() {
    for prefix in ["\x1b[12;", "\x1b]11;rgb:", "\x1bP1$r", "\x1b_Gi=", "\x1bO1", "\u{e9}"] {
        let mut decoder = Decoder::new(WAIT);
        let bytes = prefix.as_bytes();
        // Of the character é only the first byte is decoded.
        let bytes = if prefix.starts_with('\x1b') { bytes } else { &bytes[..1] };
        assert_eq!(decoder.take(bytes), [], "{prefix:?}");
        assert_eq!(decoder.patience(), Some(WAIT), "{prefix:?}");
        assert_eq!(keys(&decoder.give_up()), [""; 0], "{prefix:?}");
        assert_eq!(keys(&decoder.take(b"q")), ["q"], "{prefix:?}");
    }
    for (introducer, key) in [("\x1b[", "Alt-["), ("\x1bO", "Alt-O"), ("\x1b]", "Alt-]")] {
        let mut decoder = Decoder::new(WAIT);
        assert_eq!(decoder.take(introducer.as_bytes()), []);
        assert_eq!(keys(&decoder.give_up()), [key]);
    }
}

#[test]
fn pasted_text_produces_no_keys() {
    let text = "qqq\x1b[A]]]\r\x1b[24;80R漢";
    let pasted = all_at_once(&format!("\x1b[200~{text}\x1b[201~x"));
    assert_eq!(pasted[0], Event::Paste(text.to_string()));
    assert_eq!(keys(&pasted[1..]), ["x"]);
    // A paste longer than 1 MiB is truncated.
    let long = "m".repeat(3 << 20);
    let pasted = all_at_once(&format!("\x1b[200~{long}\x1b[201~x"));
    assert!(matches!(&pasted[0], Event::Paste(kept) if kept.len() == 1 << 20));
    assert_eq!(keys(&pasted[1..]), ["x"]);
}

#[test]
fn paste_with_a_pause_stays_a_paste() {
    let mut decoder = Decoder::new(WAIT);
    let paste = |text: &str| Event::Paste(text.into());
    assert_eq!(decoder.take(b"\x1b[200~half"), []);
    assert_eq!(decoder.give_up(), [paste("half")]);
    // After a pause the decoder waits for the rest of the paste without limit.
    assert_eq!(decoder.patience(), None);
    assert_eq!(decoder.take(b"]]]\x03dq\x1b["), []);
    assert!(decoder.patience().is_some());
    let rest = decoder.take(b"201~x");
    assert_eq!(rest[0], paste("]]]\x03dq"));
    assert_eq!(keys(&rest[1..]), ["x"]);
    assert_eq!(keys(&decoder.take(b"y")), ["y"]);
}

#[test]
fn escape_and_interrupt_end_a_paste_without_end() {
    for (byte, key) in [(b"\x1b", "Esc"), (b"\x03", "Ctrl-c")] {
        let mut decoder = Decoder::new(WAIT);
        decoder.take(b"\x1b[200~half");
        // Before the first pause, the bytes of Escape and Ctrl-C are part of the pasted text.
        assert_eq!(decoder.take(byte), []);
        assert!(matches!(&decoder.give_up()[..], [Event::Paste(_)]), "{key}");
        assert_eq!(decoder.take(b"q"), []);
        assert_eq!(decoder.give_up(), [Event::Paste("q".into())]);
        assert_eq!(decoder.take(byte), []);
        assert_eq!(keys(&decoder.give_up()), [key]);
        assert_eq!(keys(&decoder.take(b"q")), ["q"], "{key}");
        // If the end sequence of the paste arrives after all, it produces no key.
        assert_eq!(keys(&decoder.take(b"\x1b[201~q")), ["q"], "{key}");
    }
}

#[test]
fn reply_flood_hides_no_key() {
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
    // A reply without an end needs only bounded memory.
    let mut decoder = Decoder::new(WAIT);
    decoder.take(b"\x1b]52;c;");
    (0..1000).for_each(|_| assert_eq!(decoder.take(&[b'A'; 1 << 12]), []));
    assert_eq!(keys(&decoder.take(b"\x07q")), ["q"]);
}

/// Strategy for a key or a reply, as `(bytes, name)`. `name` is the name of the key, or `None` for
/// a reply.
fn key_or_reply() -> impl Strategy<Value = (&'static str, Option<&'static str>)> {
    prop_oneof![
        select(KEYS).prop_map(|(bytes, name)| (bytes, Some(name))),
        select(REPLIES).prop_map(|bytes| (bytes, None)),
    ]
}

/// Strategy for arbitrary input: keys, replies, mouse reports and pastes, complete or cut off, and
/// random bytes.
fn any_input() -> impl Strategy<Value = Vec<u8>> {
    const OTHERS: &[&str] = &[
        "\x1b[<0;3;4M",
        "\x1b[M !!",
        "\x1b[200~a\x1b[A\x1b[20\x1b[201~",
        "\x1bX",
        "\x1b^",
        "\x18",
    ];
    let sequence = prop_oneof![key_or_reply().prop_map(|(bytes, _)| bytes), select(OTHERS)].boxed();
    prop_oneof![
        sequence.clone().prop_map(|bytes| bytes.as_bytes().to_vec()),
        (sequence, 0usize..8)
            .prop_map(|(bytes, cut)| { bytes.as_bytes()[..cut.min(bytes.len())].to_vec() }),
        vec(any::<u8>(), 0..6),
        vec(select(&b"\x1b\x1b\x1b[]OP_\\\x07\x18\r1;:?<>$~uMA\xc3\xa9\x9c"[..]), 0..10),
    ]
}

/// Decodes `bytes` in pieces. The pieces end at `cuts`, which are taken modulo the length of
/// `bytes` plus 1.
fn in_pieces(decoder: &mut Decoder, bytes: &[u8], cuts: &[usize]) -> Vec<Event> {
    let mut cuts: Vec<_> = cuts.iter().map(|cut| cut % (bytes.len() + 1)).collect();
    cuts.extend([0, bytes.len()]);
    cuts.sort_unstable();
    cuts.windows(2).flat_map(|piece| decoder.take(&bytes[piece[0]..piece[1]])).collect()
}

/// Checks input that the parser `vte` alone would decode differently. The module `decode` lists it.
#[test]
fn keyboard_sequences_beyond_vte_are_decoded() {
    for (bytes, expected) in [
        ("\x1b\x1ba", &["Esc", "Alt-a"][..]),
        ("\x1bXq", &["Alt-X", "q"]),
        ("\x1b^q", &["Alt-^", "q"]),
        ("\x1b q", &["Alt-Space", "q"]),
        ("\x1b/q", &["Alt-/", "q"]),
        ("\x1b\x7fq", &["Alt-Backspace", "q"]),
        ("\x1b\rq", &["Alt-Enter", "q"]),
        ("\x1b\\q", &["Alt-\\", "q"]),
        ("\x1bÜq", &["Alt-Ü", "q"]),
        ("\x1b[1;\rq", &["Enter", "q"]),
        ("\x1b[1\x7fq", &["Backspace", "q"]),
        ("\x1b[12Üq", &["Ü", "q"]),
        ("\x1b[\rq", &["Alt-[", "Enter", "q"]),
        ("\x1b[\x1b[A", &["Alt-[", "Up"]),
        ("\x1b[1<Aq", &["q"]),
        ("\x1bO5Pq", &["Ctrl-F1", "q"]),
        ("\x1bP>|Ü1\x1b\\q", &["q"]),
        ("\x1b_GÜ;OK\x1b\\q", &["q"]),
        ("\x1b]11;Ü\x1b\\q", &["q"]),
        ("\x1bP1$r\x1b[A", &["Up"]),
        ("\x1b]11;\x18q", &["q"]),
    ] {
        assert_eq!(keys(&all_at_once(bytes)), expected, "{bytes:?}");
    }
}

proptest! {
    #[test]
    fn any_split_of_keys_and_replies_yields_the_keys(
        input in vec(key_or_reply(), 1..40),
        cuts in vec(0usize..1000, 0..60),
    ) {
        let bytes: Vec<u8> = input.iter().flat_map(|(bytes, _)| bytes.bytes()).collect();
        let expected: Vec<_> = input.iter().filter_map(|(_, name)| *name).collect();
        let mut decoder = Decoder::new(WAIT);
        let events = in_pieces(&mut decoder, &bytes, &cuts);
        prop_assert_eq!(keys(&events), expected);
        prop_assert_eq!(decoder.patience(), None);
    }

    /// Checks that the division of the input into reads of several bytes has no influence on the
    /// decoded events. The input mixes sequences, their beginnings and random bytes.
    #[test]
    fn any_split_of_any_bytes_yields_the_same_events(
        input in vec(any_input(), 0..40),
        cuts in vec(0usize..1000, 0..60),
    ) {
        let bytes = input.concat();
        let mut decoder = Decoder::new(WAIT);
        let mut whole = decoder.take(&bytes);
        let patience = decoder.patience();
        whole.extend(decoder.give_up());
        // A character in a read of its own may be a key after a cut reply.
        let last = std::str::from_utf8(&bytes[bytes.len() / 5 * 5..]);
        prop_assume!(last.is_err() || last.unwrap().chars().count() != 1);
        let cuts: Vec<_> = cuts.iter().map(|cut| 5 * (cut % (bytes.len() / 5 + 1))).collect();
        let mut decoder = Decoder::new(WAIT);
        let mut events = in_pieces(&mut decoder, &bytes, &cuts);
        prop_assert_eq!(decoder.patience(), patience);
        events.extend(decoder.give_up());
        prop_assert_eq!(&events, &whole);
    }

    #[test]
    fn any_bytes_leave_the_decoder_ready(bytes in vec(any::<u8>(), 0..200)) {
        let mut decoder = Decoder::new(WAIT);
        decoder.take(&bytes);
        decoder.give_up();
        let after = keys(&decoder.take(b" q"));
        prop_assert_eq!(after.last().map(String::as_str), Some("q"));
    }

    /// Checks that a reply that is cut off swallows no key. Keys arrive in reads of their own, after
    /// any pause. If the bytes of a cut reply and of a key are those of a complete sequence, the key
    /// is decoded only after a pause.
    #[test]
    fn cut_reply_swallows_no_key(
        reply in select(REPLIES),
        cut in 2usize..40,
        input in vec((select(KEYS), any::<bool>()), 1..4),
    ) {
        let cut = &reply.as_bytes()[..cut.min(reply.len() - 1)];
        let mut decoder = Decoder::new(WAIT);
        let mut events = decoder.take(cut);
        let mut bytes = cut.to_vec();
        let mut is_complete = false;
        for ((key, _), is_paused) in &input {
            if *is_paused {
                events.extend(decoder.give_up());
            }
            let is_open = decoder.patience().is_some();
            events.extend(decoder.take(key.as_bytes()));
            bytes.extend(key.as_bytes());
            is_complete |= is_open && matches!(
                Decoder::new(WAIT).take(&bytes)[..],
                [Event::Reply(_) | Event::Key(_) | Event::Mouse(_)]
            );
        }
        events.extend(decoder.give_up());
        let expected: Vec<_> = input.iter().map(|((_, name), _)| name.to_string()).collect();
        let found = keys(&events);
        prop_assert!(is_complete || found.ends_with(&expected), "{found:?}");
    }

    /// Checks that replies produce no keys. Long pauses separate the sequences.
    #[test]
    fn late_replies_produce_no_keys(input in vec(key_or_reply(), 1..40)) {
        let mut decoder = Decoder::new(WAIT);
        let mut events = Vec::new();
        for (bytes, _) in &input {
            events.extend(decoder.take(bytes.as_bytes()));
            events.extend(decoder.give_up());
        }
        let expected: Vec<_> = input.iter().filter_map(|(_, name)| *name).collect();
        prop_assert_eq!(keys(&events), expected);
    }
}

#[test]
fn shifted_character_is_its_capital_without_modifier() {
    let events = all_at_once("\x1b[65;2u");
    assert_eq!(events, [Event::Key(Key::plain(Code::Char('A')))]);
}
