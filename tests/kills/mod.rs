//! Crash tests. 40 programs are ended at random moments while their scene is edited, saved and
//! exported. They are ended by SIGTERM, SIGHUP, SIGKILL, or a closed terminal. No file may be
//! damaged, and no edit may be lost that was made at least a given time before the end. After
//! SIGTERM and SIGHUP the terminal must be restored.
//!
//! The message of a failure contains the number of its run.
//! `ZERKALO_KILL=17 cargo test --release --test program kills::` repeats run 17 alone, with the same
//! keys at the same times as far as the machine permits.
#![cfg(unix)]

mod states;

use crate::command_line::signals::signal;
use crate::harness::*;
use crate::pty::terminal::{REPLIES, Start, Terminal};
use states::{KEYS, SAVE, SCENE, states};
use std::panic::catch_unwind;
use std::sync::atomic::AtomicUsize;
use zerkalo_render::image_file::read_exr;
use zerkalo_scene::Recovery;
use zerkalo_terminal::{ENTER, LEAVE};

/// Number of programs that are started and ended.
const RUNS: usize = 20;
/// Number of programs in the ignored test.
const MANY_RUNS: usize = 400;
/// Number of concurrent programs per processor. It is limited because each program also traces with
/// several threads, and must still process keys as fast as they are typed.
const RUNS_PER_PROCESSOR: usize = 2;
/// Period of the recoveries: of this many consecutive runs, the first four are followed by a
/// recovery, one for each cause of the end. In a recovery the program is started again and restores
/// the unsaved edits.
const RECOVERY_PERIOD: usize = 20;
/// Smallest age of an edit that must survive SIGKILL. The age is the time from the edit's key press
/// to the signal.
const KEPT_AFTER: Duration = Duration::from_secs(2);
/// Smallest age of an edit that must survive SIGTERM, SIGHUP or the closing of the terminal. The
/// age is the time from the edit's key press to the signal or the closing.
const READ_AFTER: Duration = Duration::from_millis(300);

/// Cause of the program's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Term,
    Hup,
    Kill,
    Closed,
}

const ENDS: [End; 4] = [End::Term, End::Hup, End::Kill, End::Closed];

impl End {
    /// Returns the expected exit status, `None` for SIGKILL.
    fn status(self) -> Option<u32> {
        match self {
            Self::Term => Some(143),
            Self::Hup | Self::Closed => Some(129),
            Self::Kill => None,
        }
    }
}

/// Course of one run, derived from its number.
#[derive(Debug)]
struct Plan {
    end: End,
    /// Time from the first picture to the end of the program.
    moment: Duration,
    keys: Vec<(Duration, usize)>,
}

impl Plan {
    fn of(number: usize) -> Self {
        let mut numbers = Numbers::new(0x5eed_0000 + number as u64);
        let end = ENDS[number % ENDS.len()];
        // Runs that end by SIGKILL last longer, because after SIGKILL only edits that are at least
        // two seconds old must be kept.
        let [shortest, longest] = if end == End::Kill { [1.0, 4.5] } else { [0.0, 1.6] };
        let moment = numbers.between(shortest, longest);
        // Half of the runs never save, because saved edits do not test recovery.
        let saves = numbers.below(2) == 0;
        // Mean pause between two keys in seconds: fast and slow typing.
        let pause = [0.03, 0.12, 0.5][numbers.below(3)];
        let mut time = 0.0;
        let mut keys = Vec::new();
        while time < moment {
            // Saving and exporting are rarer than edits.
            let key = match numbers.below(12) {
                0 if saves => SAVE,
                1 => SAVE + 1 + numbers.below(2),
                _ => numbers.below(SAVE),
            };
            keys.push((Duration::from_secs_f64(time), key));
            time += pause * numbers.between(0.2, 1.8);
        }
        Self { end, moment: Duration::from_secs_f64(moment), keys }
    }
}

/// Stalls of the machine: short sleeps that lasted too long. Each is stored as its start and the
/// time by which it exceeded the requested duration.
static STALLS: Mutex<Vec<(Instant, Duration)>> = Mutex::new(Vec::new());

/// Measures short sleeps until `over` is `true`. Records a stall of the machine if a sleep lasts
/// more than twice as long as requested.
fn watch_for_stalls(over: &AtomicBool) {
    let nap = Duration::from_millis(20);
    while !over.load(Ordering::Relaxed) {
        let start = Instant::now();
        std::thread::sleep(nap);
        let excess = start.elapsed() - nap;
        if excess > nap {
            STALLS.lock().unwrap().push((start, excess));
        }
    }
}

/// Returns the time by which stalls of the machine since `start` may have delayed the writing of an
/// edit.
fn stall_allowance(start: Instant) -> Duration {
    let stalls = STALLS.lock().unwrap();
    let longest = stalls.iter().filter(|(at, _)| *at >= start).map(|(_, excess)| *excess).max();
    // An edit passes through several threads until it is written, and each may be delayed by a
    // stall.
    4 * longest.unwrap_or_default()
}

/// Starts the dashboard with `scene.toml` in `folder`, in a terminal that replies to only one
/// request. Several can run at the same time. Returns once the first picture is shown.
fn open(folder: &Path) -> Terminal {
    let start = Start {
        command: &[env!("CARGO_BIN_EXE_zerkalo"), "scene.toml", "--threads", "1"],
        folder,
        size: [60, 18],
        env: &[],
        replies: true,
    };
    let terminal = Terminal::open(&start, vec![REPLIES[0]], None);
    // `ENTER` contains the control sequences that enter the alternate screen. The first picture
    // counts as shown when 2000 bytes have followed them.
    terminal.wait_for_bytes(ENTER.len() + 2000);
    terminal
}

/// Executes the run `number`. Returns the time from the key press of the oldest lost edit to the
/// program's end, or 0 if no edit is lost.
///
/// # Errors
/// Fails if the exit status is wrong, if a file is damaged, if an edit that must be kept is lost,
/// or if the terminal is not restored after SIGTERM or SIGHUP.
fn run(number: usize) -> Result<Duration, String> {
    let plan = Plan::of(number);
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, SCENE).map_err(|error| error.to_string())?;
    let mut terminal = open(folder.path());
    let start = Instant::now();
    let mut sent = Vec::new();
    for (at, key) in &plan.keys {
        std::thread::sleep(at.saturating_sub(start.elapsed()));
        if start.elapsed() >= plan.moment {
            break;
        }
        terminal.send(KEYS[*key].1);
        sent.push((Instant::now(), *key));
    }
    std::thread::sleep(plan.moment.saturating_sub(start.elapsed()));
    let ended_at = Instant::now();
    match plan.end {
        End::Term => signal("TERM", terminal.process_id()),
        End::Hup => signal("HUP", terminal.process_id()),
        End::Kill => signal("KILL", terminal.process_id()),
        End::Closed => terminal.hang_up(),
    }
    let actual = terminal.status();
    if let Some(expected) = plan.end.status().filter(|expected| *expected != actual) {
        return Err(format!("exit status {actual}, not {expected}"));
    }
    if [End::Term, End::Hup].contains(&plan.end) {
        let (_, output) = terminal.end();
        let (_, after) = output.split_once(LEAVE).ok_or("the terminal was not left")?;
        if after.contains('\x1b') {
            return Err(format!("after leaving: {after:?}"));
        }
    }
    let keys: Vec<_> = sent.iter().map(|(_, key)| *key).collect();
    let states = states(&keys);
    check_files(folder.path(), &states, &keys)?;

    let kept_after = if plan.end == End::Kill { KEPT_AFTER } else { READ_AFTER };
    let kept_after = kept_after + stall_allowance(start);
    let safe = sent.iter().filter(|(at, _)| ended_at - *at >= kept_after).count();
    let kept = effective(&scene)?;
    let Some(state) = (0..states.len()).rev().find(|i| states[*i] == kept) else {
        return Err(format!("the kept text is no state of the scene:\n{kept}"));
    };
    if state < safe && !states[safe..].contains(&kept) {
        let ages: Vec<_> = sent.iter().map(|(at, _)| (ended_at - *at).as_secs_f64()).collect();
        return Err(format!(
            "{state} keys of {} are kept, {safe} ought to be (those older than {kept_after:?}); \
             seconds before the end: {ages:.2?}",
            keys.len()
        ));
    }
    if number % RECOVERY_PERIOD < ENDS.len() {
        recover(folder.path(), &kept)?;
    }
    Ok(sent.get(state).map_or(Duration::ZERO, |(at, _)| ended_at - *at))
}

/// Checks that every file in `folder` is complete. The scene file must have its original text or a
/// text that was saved. `states` has the texts of the scene before the first and after each of
/// `keys`.
fn check_files(folder: &Path, states: &[String], keys: &[usize]) -> Result<(), String> {
    let text = fs::read_to_string(folder.join("scene.toml")).map_err(|error| error.to_string())?;
    let saved = |(i, key): (usize, &usize)| (*key == SAVE).then(|| &states[i + 1]);
    let mut may_be = keys.iter().enumerate().filter_map(saved);
    if text != SCENE && !may_be.any(|state| *state == text) {
        return Err(format!("the scene's file holds text that was never saved:\n{text}"));
    }
    for entry in fs::read_dir(folder).map_err(|error| error.to_string())? {
        let path = entry.map_err(|error| error.to_string())?.path();
        // The state folder has the list of recent scenes.
        if path.is_dir() {
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let bytes = fs::read(&path).map_err(|error| error.to_string())?;
        let is_sound = match &*name {
            "scene.toml" | ".scene.toml.unsaved" => true,
            _ if name.ends_with(".png") => is_whole_png(&bytes),
            _ if name.ends_with(".exr") => read_exr(&path).is_ok(),
            // The program may be killed while it writes a temporary file. The next start removes
            // the file.
            _ => name.starts_with(".zerkalo-") && name.ends_with(".tmp"),
        };
        if !is_sound {
            return Err(format!("{name} is damaged or unexpected"));
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

/// Returns the text of the scene that the next start would show: the recovered edits if there are
/// any, otherwise the scene file.
fn effective(scene: &Path) -> Result<String, String> {
    let mut recovery = Recovery::new(Some(scene), "", None).find();
    if recovery.elsewhere || !recovery.unreadable.is_empty() || recovery.orphans.len() > 1 {
        return Err(format!("found: {recovery:?}"));
    }
    match recovery.orphans.pop() {
        Some(lost) => Ok(lost.text.clone()),
        None => fs::read_to_string(scene).map_err(|error| error.to_string()),
    }
}

/// Starts the program again. If there are unsaved edits, the program offers to restore them; this
/// function accepts the offer and saves the edits. The scene file must then contain the text
/// `kept`.
fn recover(folder: &Path, kept: &str) -> Result<(), String> {
    let scene = folder.join("scene.toml");
    let is_saved = || fs::read_to_string(&scene).is_ok_and(|text| text == kept);
    let offered = !is_saved();
    let mut terminal = open(folder);
    if offered {
        terminal.wait_for_text("ended unexpectedly");
        terminal.send("r");
        terminal.wait_for_text("recovered");
        terminal.send("\x13");
        terminal.wait_for_text("saved scene.toml");
    } else {
        terminal.wait_for_text("scene.toml");
    }
    terminal.send("q");
    let status = terminal.status();
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
fn random_ends_damage_no_file_and_lose_no_old_edit() {
    let only = std::env::var("ZERKALO_KILL").ok().map(|text| text.parse::<usize>().unwrap());
    check_runs(only.map_or_else(|| (0..RUNS).collect(), |number| vec![number]));
}

#[test]
#[ignore = "minutes: cargo test --release --test program kills:: -- --ignored"]
fn many_random_ends_damage_no_file_and_lose_no_old_edit() {
    check_runs((0..MANY_RUNS).collect());
}

/// Executes the runs with the given numbers, several at a time. Panics if a run fails.
fn check_runs(numbers: Vec<usize>) {
    let (next, over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        scope.spawn(|| watch_for_stalls(&over));
        let work = || {
            while let Some(number) = numbers.get(next.fetch_add(1, Ordering::Relaxed)) {
                let result = catch_unwind(|| run(*number)).unwrap_or_else(|panic| {
                    Err(panic.downcast_ref::<String>().cloned().unwrap_or_default())
                });
                results.lock().unwrap().push((*number, result));
            }
        };
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        let workers: Vec<_> =
            (0..RUNS_PER_PROCESSOR * processors).map(|_| scope.spawn(work)).collect();
        workers.into_iter().for_each(|worker| worker.join().expect("a worker ends"));
        over.store(true, Ordering::Relaxed);
    });
    let results = results.into_inner().unwrap();
    let mut failures = Vec::new();
    for end in ENDS {
        let of_end = results.iter().filter(|(number, _)| Plan::of(*number).end == end);
        let mut lost: Vec<_> = of_end.filter_map(|(_, result)| result.as_ref().ok()).collect();
        lost.sort_unstable();
        let median = lost.get(lost.len() / 2).copied();
        println!(
            "{end:?}: {} runs, oldest lost edit: median {median:.2?}, most {:.2?}",
            lost.len(),
            lost.last()
        );
    }
    for (number, result) in &results {
        if let Err(what) = result {
            let plan = Plan::of(*number);
            failures.push(format!(
                "run {number}, {:?} after {:.3} s: {what}\n  again: ZERKALO_KILL={number} cargo test \
                 --release --test program kills::",
                plan.end,
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

#[test]
fn lost_terminal_during_an_export_ends_with_status_of_sighup() {
    for _ in 0..4 {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
        let mut terminal = open(folder.path());
        terminal.send("p");
        terminal.hang_up();
        assert_eq!(terminal.status(), 129);
    }
}
