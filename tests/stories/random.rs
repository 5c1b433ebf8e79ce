//! Thousands of random key and mouse events on three scenes. The model must stay valid, and it must
//! be possible to undo every edit.

use super::*;

/// Number of events on each scene; `ZERKALO_EVENTS` sets another.
const EVENTS: usize = 2_400;
/// Label of the command that quits the program.
const QUIT: &str = "quit";

/// Random number generator xorshift64*.
struct Rng(u64);

impl Rng {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % n
    }
}

/// Returns every key of the command table, and keys that type characters.
fn keys() -> Vec<Key> {
    let bindings = COMMANDS.iter().flat_map(|command| command.keys);
    let names = bindings.flat_map(|(_, names)| names.split(' '));
    let mut keys: Vec<Key> = names.map(|name| name.parse().unwrap()).collect();
    for c in "0123456789.-#/eyxñ鏡 ".chars() {
        keys.push(Key { code: Code::Char(c), ctrl: false, alt: false, shift: false });
    }
    keys
}

fn quits(desk: &Desk, key: Key) -> bool {
    lookup(COMMANDS, desk.model.context(), key).is_some_and(|c| c.label == QUIT)
        || key.code == Code::Enter
            && (desk.picked_command() == Some(QUIT)
                || desk.editor().is_some_and(|e| ["q", "wq", "q!"].contains(&e.text())))
}

fn event(desk: &mut Desk, rng: &mut Rng, keys: &[Key]) {
    let [width, height] = [130, 40];
    match rng.below(20) {
        0..14 => {
            let key = keys[rng.below(keys.len())];
            if !quits(desk, key) {
                desk.key(key);
            }
        }
        // The command is run from the command palette, which also covers commands without a key.
        14 if desk.model.overlay.is_none() && desk.editor().is_none() => {
            let label = COMMANDS[rng.below(COMMANDS.len())].label;
            if label != QUIT {
                desk.palette(label);
            }
        }
        14..16 => {
            desk.keys("Esc Esc");
        }
        16 => {
            desk.click(rng.below(width) as u16, rng.below(height) as u16);
        }
        17 => {
            let button = [Button::Left, Button::Middle, Button::Right][rng.below(3)];
            let from = [rng.below(width) as u16, rng.below(height) as u16];
            let by = [rng.below(21) as i16 - 10, rng.below(11) as i16 - 5];
            desk.drag(button, from, by);
        }
        18 => {
            let ticks = rng.below(7) as i32 - 3;
            desk.mouse(MouseKind::Scroll(ticks), rng.below(width) as u16, rng.below(height) as u16);
        }
        _ => match rng.below(4) {
            0 => desk.send(Message::Resize([rng.below(220) as u16, rng.below(70) as u16])),
            1 => desk.send(Message::Paste("0.5\nq".into())),
            2 => desk.send(Message::Tick),
            _ => desk.now += Duration::from_secs(rng.below(3) as u64),
        },
    }
}

fn play(name: &str, text: &str, seed: u64, fired: &mut HashSet<&'static str>) {
    let (keys, mut rng) = (keys(), Rng(seed));
    let mut desk = Desk::new(text);
    desk.reads = false;
    let events = std::env::var("ZERKALO_EVENTS").ok().and_then(|n| n.parse().ok());
    for i in 0..events.unwrap_or(EVENTS) {
        event(&mut desk, &mut rng, &keys);
        // Questions are cancelled, because an answer may quit or load another file. Other tests
        // cover the answers.
        if let Some(Overlay::Question(_)) = desk.model.overlay {
            desk.keys("Esc");
        }
        assert!(!desk.asked(|e| *e == Effect::Quit), "{name}: event {i}");
        let scene = desk.scene();
        assert!(scene.faults().is_empty(), "{name}: event {i}: {:?}", scene.faults());
        assert!(desk.model.selection.exists(scene), "{name}: event {i}");
        desk.effects.clear();
        if scene_is_large(&desk) {
            desk.keys("Esc Esc Esc u u u u u u");
        }
    }
    fired.extend(&desk.fired);
    desk.model.overlay = None;
    desk.undo_all();
    desk.document = desk.original();
    assert_eq!(desk.text(), text, "{name}: everything undone");
}

/// Returns `true` if duplicates have made the scene large. More of them would test nothing new.
fn scene_is_large(desk: &Desk) -> bool {
    zerkalo_scene::edit::outline(desk.scene()).len() > 120
}

#[test]
fn random_events_keep_model_valid() {
    let physical = include_str!("../../scenes/features/mirror-room-physical.toml");
    let mut fired = HashSet::new();
    play("room", &(ROOM.to_string() + compounds::GOBLET), 1, &mut fired);
    play("built in", MIRROR_ROOM, 2, &mut fired);
    play("physical", physical, 3, &mut fired);
    let labels: Vec<_> = COMMANDS.iter().map(|c| c.label).filter(|label| *label != QUIT).collect();
    let missed: Vec<_> = labels.iter().filter(|label| !fired.contains(*label)).collect();
    let share = 1.0 - missed.len() as f64 / labels.len() as f64;
    println!("{:.1} % of {} commands run; not: {missed:?}", 100.0 * share, labels.len());
    assert!(share >= 0.95, "{share}: {missed:?}");
}
