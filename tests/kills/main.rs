//! Two hundred programs die at random moments while their scene is edited, saved and exported: by
//! SIGTERM, SIGHUP, SIGKILL, and because their terminal is gone. No file is ever damaged, no edit is
//! lost that was made a while before, and where the program can do anything at all the terminal is as
//! it was.
//!
//! A failure names its number; `ZERKALO_KILL=17 cargo test --test kills` repeats that life alone: the
//! same keys at the same times, as far as the machine can keep them.
#![cfg(unix)]

#[path = "../common/mod.rs"]
mod common;
mod pty;
mod states;

use common::Numbers;
use pty::{Pty, find, screen};
use states::{KEYS, SAVE, SCENE, states};
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use zerkalo::film::read_exr;
use zerkalo::scene::Recovery;
use zerkalo::terminal::{ENTER, LEAVE};

/// Lives, and how many at a time. Mostly they sleep.
const LIVES: usize = 200;
const AT_A_TIME: usize = 16;
/// Of so many, one of each death is followed by another program, which offers what was left behind.
const FOLLOWED: usize = 20;
/// Edits that were made so long before are not lost, whatever happens.
const KEPT_AFTER: Duration = Duration::from_secs(2);
/// Keys that were pressed so long before have been read, when the program can still act.
const READ_AFTER: Duration = Duration::from_millis(300);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Death {
    Term,
    Hup,
    Kill,
    Closed,
}

const DEATHS: [Death; 4] = [Death::Term, Death::Hup, Death::Kill, Death::Closed];

impl Death {
    /// The exit status, if the program has a say in it, and how old edits are that have to be kept.
    fn consequences(self) -> (Option<u32>, Duration) {
        match self {
            Self::Term => (Some(143), READ_AFTER),
            Self::Hup | Self::Closed => (Some(129), READ_AFTER),
            Self::Kill => (None, KEPT_AFTER),
        }
    }
}

/// What is to happen: everything by the number of the life.
#[derive(Debug)]
struct Plan {
    death: Death,
    /// When, after the first picture.
    moment: Duration,
    /// Positions in `KEYS`, and when.
    keys: Vec<(Duration, usize)>,
}

impl Plan {
    fn of(number: usize) -> Self {
        let mut numbers = Numbers::new(0x5eed_0000 + number as u64);
        let death = DEATHS[number % DEATHS.len()];
        // What has to be two seconds old has to live for more than that.
        let [least, most] = if death == Death::Kill { [1.0, 4.5] } else { [0.0, 1.6] };
        let moment = numbers.between(least, most);
        // Whoever saves loses nothing that way: only who does not tells whether edits are kept.
        let saves = numbers.below(2) == 0;
        // Some press keys without a pause, others think.
        let pause = [0.03, 0.12, 0.5][numbers.below(3)];
        let mut at = 0.0;
        let mut keys = Vec::new();
        while at < moment {
            // Saving and exporting are rarer than edits.
            let key = match numbers.below(12) {
                0 if saves => SAVE,
                1 => SAVE + 1 + numbers.below(2),
                _ => numbers.below(SAVE),
            };
            keys.push((Duration::from_secs_f64(at), key));
            at += pause * numbers.between(0.2, 1.8);
        }
        Self { death, moment: Duration::from_secs_f64(moment), keys }
    }
}

/// How long the machine has kept somebody waiting who only wanted to sleep for a moment: when, and how
/// much too long.
static STALLS: Mutex<Vec<(Instant, Duration)>> = Mutex::new(Vec::new());

/// Sleeps for moments until it is `over`.
fn watch_for_stalls(over: &AtomicBool) {
    let nap = Duration::from_millis(20);
    while !over.load(Ordering::Relaxed) {
        let begun = Instant::now();
        std::thread::sleep(nap);
        let late = begun.elapsed() - nap;
        if late > nap {
            STALLS.lock().unwrap().push((begun, late));
        }
    }
}

/// What is forgiven for what the machine has done since `begun`.
fn forgiven(begun: Instant) -> Duration {
    let stalls = STALLS.lock().unwrap();
    let longest = stalls.iter().filter(|(at, _)| *at >= begun).map(|(_, late)| *late).max();
    // Several threads take part in keeping an edit, one after another.
    4 * longest.unwrap_or_default()
}

/// One life. What went wrong, or how old the oldest edit was that was lost.
fn live(number: usize) -> Result<Duration, String> {
    let plan = Plan::of(number);
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, SCENE).map_err(|error| error.to_string())?;
    let mut pty = Pty::open(folder.path());
    // The first frame ends with a reset of its colours.
    pty.wait_for("first picture", |bytes| bytes.len() > ENTER.len() + 2000)?;
    let begun = Instant::now();
    let mut sent = Vec::new();
    for (at, key) in &plan.keys {
        std::thread::sleep(at.saturating_sub(begun.elapsed()));
        if begun.elapsed() >= plan.moment {
            break;
        }
        pty.send(KEYS[*key].1);
        sent.push((Instant::now(), *key));
    }
    std::thread::sleep(plan.moment.saturating_sub(begun.elapsed()));
    let died = Instant::now();
    match plan.death {
        Death::Term => pty.signal("TERM"),
        Death::Hup => pty.signal("HUP"),
        Death::Kill => pty.signal("KILL"),
        Death::Closed => pty.hang_up(),
    }
    let (status, kept_after) = plan.death.consequences();
    let found = pty.end()?;
    if let Some(expected) = status.filter(|expected| *expected != found) {
        return Err(format!("exit status {found}, not {expected}"));
    }
    let (bytes, restored) = pty.afterwards();
    if [Death::Term, Death::Hup].contains(&plan.death) {
        check_terminal(&bytes, restored)?;
    }
    let keys: Vec<_> = sent.iter().map(|(_, key)| *key).collect();
    let states = states(&keys);
    check_files(folder.path(), &states, &keys)?;

    let kept_after = kept_after + forgiven(begun);
    let safe = sent.iter().filter(|(at, _)| died - *at >= kept_after).count();
    let kept = effective(&scene)?;
    let Some(state) = (0..states.len()).rev().find(|i| states[*i] == kept) else {
        return Err(format!("what is kept is no state of the scene:\n{kept}"));
    };
    if state < safe && !states[safe..].contains(&kept) {
        let ages: Vec<_> = sent.iter().map(|(at, _)| (died - *at).as_secs_f64()).collect();
        return Err(format!(
            "{state} keys of {} are kept, {safe} ought to be (those older than {kept_after:?}); \
             seconds before the end: {ages:.2?}",
            keys.len()
        ));
    }
    if number % FOLLOWED < DEATHS.len() {
        follow(folder.path(), &kept)?;
    }
    Ok(sent.get(state).map_or(Duration::ZERO, |(at, _)| died - *at))
}

/// The terminal is as it was, and nothing steers it afterwards.
fn check_terminal(bytes: &[u8], restored: bool) -> Result<(), String> {
    let left = find(bytes, LEAVE.as_bytes()).ok_or("the terminal was not left")?;
    let after = &bytes[left + LEAVE.len()..];
    if after.contains(&0x1b) || !restored {
        let after = String::from_utf8_lossy(after);
        return Err(format!("after leaving: {after:?}; modes restored: {restored}"));
    }
    let screen = screen(bytes);
    let mouse = screen.mouse_protocol_mode() != vt100::MouseProtocolMode::None;
    if screen.alternate_screen() || screen.hide_cursor() || screen.bracketed_paste() || mouse {
        return Err("some mode of the screen is still set".to_string());
    }
    Ok(())
}

/// Every file is complete and what it may be.
fn check_files(folder: &Path, states: &[String], keys: &[usize]) -> Result<(), String> {
    let text = fs::read_to_string(folder.join("scene.toml")).map_err(|error| error.to_string())?;
    let saved = |(i, key): (usize, &usize)| (*key == SAVE).then(|| &states[i + 1]);
    let mut may_be = keys.iter().enumerate().filter_map(saved);
    if text != SCENE && !may_be.any(|state| *state == text) {
        return Err(format!("the scene's file holds what was never saved:\n{text}"));
    }
    for entry in fs::read_dir(folder).map_err(|error| error.to_string())? {
        let path = entry.map_err(|error| error.to_string())?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let bytes = fs::read(&path).map_err(|error| error.to_string())?;
        let sound = match &*name {
            "scene.toml" | ".scene.toml.unsaved" => true,
            _ if name.ends_with(".png") => is_whole_png(&bytes),
            _ if name.ends_with(".exr") => read_exr(&path).is_ok(),
            // Half-written, but it has no name that means anything; the next start removes it.
            _ => name.starts_with(".zerkalo-") && name.ends_with(".tmp"),
        };
        if !sound {
            return Err(format!("{name} is damaged or ought not to be there"));
        }
    }
    Ok(())
}

fn is_whole_png(bytes: &[u8]) -> bool {
    let Ok(mut reader) = png::Decoder::new(std::io::Cursor::new(bytes)).read_info() else {
        return false;
    };
    let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
    reader.next_frame(&mut pixels).is_ok() && reader.finish().is_ok()
}

/// What the next start has: what was kept, or else the file.
fn effective(scene: &Path) -> Result<String, String> {
    let mut found = Recovery::new(Some(scene), "", None).find();
    if found.elsewhere || !found.unreadable.is_empty() || found.orphans.len() > 1 {
        return Err(format!("found: {found:?}"));
    }
    match found.orphans.pop() {
        Some(lost) => Ok(lost.text.clone()),
        None => fs::read_to_string(scene).map_err(|error| error.to_string()),
    }
}

/// Another program offers what was kept, takes it up and saves it.
fn follow(folder: &Path, kept: &str) -> Result<(), String> {
    let scene = folder.join("scene.toml");
    let is_saved = || fs::read_to_string(&scene).is_ok_and(|text| text == kept);
    let offered = !is_saved();
    let mut pty = Pty::open(folder);
    if offered {
        pty.wait_for_text("broke off")?;
        pty.send(b"r");
        pty.wait_for_text("recovered")?;
        pty.send(b"\x13");
        pty.wait_for_text("saved scene.toml")?;
    } else {
        pty.wait_for_text("scene.toml")?;
    }
    pty.send(b"q");
    let status = pty.end()?;
    let left = folder.join(".scene.toml.unsaved").exists();
    if status != 0 || left || !is_saved() {
        return Err(format!(
            "the next start: status {status}; kept edits still there: {left}; saved: {}",
            is_saved()
        ));
    }
    Ok(())
}

#[test]
fn two_hundred_kills_damage_nothing_and_lose_nothing_old() {
    let only = std::env::var("ZERKALO_KILL").ok().map(|text| text.parse::<usize>().unwrap());
    let numbers: Vec<_> = only.map_or_else(|| (0..LIVES).collect(), |number| vec![number]);
    let (next, over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        scope.spawn(|| watch_for_stalls(&over));
        let work = || {
            while let Some(number) = numbers.get(next.fetch_add(1, Ordering::Relaxed)) {
                let result = live(*number);
                results.lock().unwrap().push((*number, result));
            }
        };
        let workers: Vec<_> = (0..AT_A_TIME).map(|_| scope.spawn(work)).collect();
        workers.into_iter().for_each(|worker| worker.join().expect("a worker ends"));
        over.store(true, Ordering::Relaxed);
    });
    let results = results.into_inner().unwrap();
    let mut failures = Vec::new();
    for death in DEATHS {
        let of = results.iter().filter(|(number, _)| Plan::of(*number).death == death);
        let mut lost: Vec<_> = of.filter_map(|(_, result)| result.as_ref().ok()).collect();
        lost.sort_unstable();
        let median = lost.get(lost.len() / 2).copied();
        println!(
            "{death:?}: {} lives, oldest lost edit: median {median:.2?}, most {:.2?}",
            lost.len(),
            lost.last()
        );
    }
    for (number, result) in &results {
        if let Err(what) = result {
            let plan = Plan::of(*number);
            failures.push(format!(
                "life {number}, {:?} after {:.3} s: {what}\n  again: ZERKALO_KILL={number} cargo test \
                 --test kills",
                plan.death,
                plan.moment.as_secs_f64()
            ));
        }
    }
    assert!(
        failures.is_empty(),
        "{} of {}:\n{}",
        failures.len(),
        results.len(),
        failures.join("\n")
    );
}
