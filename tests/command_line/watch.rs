//! Files that `zerkalo watch` reads: film files of shards, checkpoints, and files that change,
//! vanish or are damaged.

use crate::command_line::Desk;
use crate::command_line::shards::{done, merge, plan, trace, traced};
use crate::harness::*;
use std::time::SystemTime;
use zerkalo_render::film::file::EncodedFilm;
use zerkalo_render::plan::{FilmFiles, WatchedShards, WatchedState};

fn open(desk: &Desk, names: &[&str]) -> Result<FilmFiles, String> {
    let paths: Vec<PathBuf> = names.iter().map(|name| desk.path(name)).collect();
    FilmFiles::open(&paths)
}

fn film(desk: &Desk, name: &str) -> Film {
    FilmReader::open(&desk.path(name)).and_then(FilmReader::read).unwrap().film
}

fn sum(films: &FilmFiles) -> &Film {
    &films.sum.as_ref().unwrap().film
}

fn rows(films: &FilmFiles) -> Vec<WatchedShards> {
    films.shards(SystemTime::now())
}

fn states(films: &FilmFiles) -> Vec<(String, WatchedState)> {
    rows(films).into_iter().map(|row| (row.shards, row.state)).collect()
}

/// Replaces the file `name` in one step, as all writers of film files do.
fn replace(desk: &Desk, name: &str, bytes: &[u8]) {
    fs::write(desk.path("new"), bytes).unwrap();
    fs::rename(desk.path("new"), desk.path(name)).unwrap();
}

fn refusal(films: &FilmFiles) -> String {
    let refused = |row: &WatchedShards| match &row.state {
        WatchedState::Refused(reason) => Some(reason.clone()),
        _ => None,
    };
    rows(films).iter().find_map(refused).unwrap_or_default()
}

#[test]
fn parts_are_added_as_they_appear() {
    let desk = Desk::new();
    plan(&desk, "job", 3);
    let mut films = open(&desk, &["job.plan"]).unwrap();
    let expected =
        [("1", WatchedState::Missing), ("2", WatchedState::Missing), ("3", WatchedState::Missing)];
    assert_eq!(states(&films), expected.map(|(shards, state)| (shards.to_string(), state)));
    assert!(films.sum.is_none());
    assert_eq!(films.complete_shards(), Some([0, 3]));
    assert!(!films.poll(), "nothing has changed");
    for shard in [2, 3, 1] {
        trace(&desk, "job", shard);
        assert!(films.poll());
        let row = rows(&films).into_iter().find(|row| row.shards == shard.to_string()).unwrap();
        assert_eq!(row.state, WatchedState::Complete);
        assert!(row.samples > 0 && row.total == Some(row.samples), "{row:?}");
    }
    let parts = ["job-1.zk", "job-2.zk", "job-3.zk"].map(str::to_string);
    merge(&desk, &parts, "merged.zk");
    assert!(sum(&films).bytes() == film(&desk, "merged.zk").bytes());
    let merged = FilmReader::open(&desk.path("merged.zk")).unwrap();
    let entry = |header: &zerkalo_render::film::file::FilmFileHeader| {
        header.metadata.iter().find(|(key, _)| key == "Shards").cloned()
    };
    assert_eq!(entry(&films.sum.as_ref().unwrap().header), entry(&merged.header));
    assert!(entry(&merged.header).unwrap().1.starts_with("1-3 of 3, plan "));
    // The samples of a file that is removed no longer count. The names on the command line may have
    // any order.
    fs::remove_file(desk.path("job-2.zk")).unwrap();
    assert!(films.poll());
    let two = open(&desk, &["job-3.zk", "job-1.zk"]).unwrap();
    assert!(sum(&films).bytes() == sum(&two).bytes());
    assert_eq!(states(&two)[0], ("2".to_string(), WatchedState::Missing));
    assert_eq!(states(&films)[0], ("2".to_string(), WatchedState::Missing));
}

#[test]
fn unfinished_shards_are_running_and_then_late() {
    let desk = Desk::new();
    plan(&desk, "job", 2);
    trace(&desk, "job", 1);
    // Film file of shard 1 as it remains when a signal stops its render: the chunk PART says that
    // the shard is unfinished.
    let whole = FilmReader::open(&desk.path("job-1.zk")).unwrap().header;
    let mut header = whole.clone();
    let text = String::from_utf8(header.chunks[b"PART"].clone()).unwrap();
    header.chunks.insert(*b"PART", text.replace("complete", "unfinished").into_bytes());
    let empty = Film::new(whole.film.clone());
    let file = EncodedFilm::new(&header, &empty, None).pieces.concat();
    let complete = fs::read(desk.path("job-1.zk")).unwrap();
    let mut films = open(&desk, &["job.plan"]).unwrap();
    replace(&desk, "job-1.zk", &file);
    assert!(films.poll());
    let at = |films: &FilmFiles, later: u64| {
        let now = SystemTime::now() + Duration::from_secs(later);
        films.shards(now).into_iter().find(|row| row.shards == "1").unwrap()
    };
    let row = at(&films, 0);
    assert_eq!((row.state, row.samples), (WatchedState::Running, 0));
    assert!(row.total.unwrap() > 0);
    let row = at(&films, 200);
    assert!(row.state == WatchedState::Late && row.age.unwrap().as_secs() >= 199, "{row:?}");
    // If the clock of the reader is behind that of the writer, the age of a file is 0, not
    // negative.
    let early = films.shards(SystemTime::UNIX_EPOCH);
    assert!(early.iter().all(|row| row.age.is_none_or(|age| age.is_zero())));
    assert_eq!(sum(&films).samples(), 0);
    // A film file of a shard is not used if it is marked complete but has no samples.
    header.chunks.insert(*b"PART", text.into_bytes());
    let file = EncodedFilm::new(&header, &empty, None).pieces.concat();
    replace(&desk, "job-1.zk", &file);
    assert!(films.poll());
    assert!(refusal(&films).contains("its 0 samples are not the"), "{}", refusal(&films));
    replace(&desk, "job-1.zk", &complete);
    assert!(films.poll());
    assert_eq!(at(&films, 1000).state, WatchedState::Complete);
}

#[test]
fn files_that_do_not_belong_together_are_refused_by_name() {
    let desk = Desk::new();
    let parts = traced(&desk, "job", 2);
    traced(&desk, "other", 3);
    let run = desk.render("a.png", &["--spp", "2", "--checkpoint", "a.zk"]);
    assert_eq!(run.status, 0, "{}", run.err);
    fs::copy(desk.path("job-1.zk"), desk.path("copy.zk")).unwrap();
    fs::copy(desk.path("a.zk"), desk.path("b.zk")).unwrap();
    for (names, expected) in [
        (["job-1.zk", "copy.zk"], "both hold shard 1; name one of them"),
        (["job-1.zk", "other-1.zk"], "belong to different plans (`shards 2` and `shards 3`)"),
        (["job-1.zk", "a.zk"], "a.zk to other films: it belongs to no plan"),
        (["a.zk", "b.zk"], "a.zk to other films: it belongs to no plan"),
        (["job.plan", "other.plan"], "are two plans; name one of them"),
        (["other.plan", "job-1.zk"], "belong to different plans"),
    ] {
        let error = open(&desk, &names).unwrap_err();
        assert!(error.contains(expected), "{names:?}: {error}");
    }
    let plan = fs::read(desk.path("job.plan")).unwrap();
    fs::write(desk.path("cut.plan"), &plan[..plan.len() / 2]).unwrap();
    assert!(open(&desk, &["cut.plan"]).unwrap_err().contains("cut.plan: it is damaged"));

    // A single checkpoint can be watched. The displayed film has its samples.
    let single = open(&desk, &["a.zk"]).unwrap();
    assert!(sum(&single).bytes() == film(&desk, "a.zk").bytes());
    assert_eq!((single.complete_shards(), states(&single).len()), (None, 1));
    // A file that does not belong to the plan is left out if it replaces a watched file.
    let mut films = open(&desk, &["job.plan"]).unwrap();
    let whole = sum(&films).bytes();
    let own = fs::read(desk.path("job-1.zk")).unwrap();
    for (foreign, expected) in [
        ("other-1.zk", "belong to different plans"),
        ("job-2.zk", "both hold shard 2"),
        ("a.zk", "it belongs to no plan"),
        ("scene.toml", "it is not a film file"),
    ] {
        replace(&desk, "job-1.zk", &fs::read(desk.path(foreign)).unwrap());
        assert!(films.poll());
        assert!(refusal(&films).contains(expected), "{foreign}: {}", refusal(&films));
        assert!(sum(&films).bytes() != whole);
    }
    replace(&desk, "job-1.zk", &own);
    assert!(films.poll());
    assert!(sum(&films).bytes() == whole && refusal(&films).is_empty());
    assert_eq!(parts.len(), 2);
}

/// Checks that a watched job goes on to its next round, whose missing tiles are those of the round
/// before.
#[test]
fn next_round_is_watched_over_the_round_before() {
    let desk = Desk::new();
    traced(&desk, "job", 2);
    let mut films = open(&desk, &["job.plan"]).unwrap();
    let first = sum(&films).bytes();
    done(&desk, &["plan", "--from", "job.plan", "--noise", "0.5"]);
    assert!(films.poll());
    assert_eq!((films.complete_shards(), states(&films).len()), (Some([0, 2]), 2));
    assert!(sum(&films).bytes() == first);
    trace(&desk, "job.2", 2);
    assert!(films.poll());
    let [part, both] = [film(&desk, "job.2-2.zk"), film(&desk, "job-1.zk")];
    let held = |film: &Film, tile| film.counts(tile) != [0; 2];
    for tile in (0..part.tile_count()).filter(|tile| held(&part, *tile) || held(&both, *tile)) {
        let from = if held(&part, tile) { &part } else { &both };
        assert_eq!(sum(&films).counts(tile), from.counts(tile), "tile {tile}");
    }
}

#[test]
fn damaged_files_are_left_out() {
    let desk = Desk::new();
    traced(&desk, "job", 2);
    let mut films = open(&desk, &["job.plan"]).unwrap();
    let whole = sum(&films).bytes();
    let part = fs::read(desk.path("job-2.zk")).unwrap();
    fs::remove_file(desk.path("job-2.zk")).unwrap();
    assert!(films.poll());
    let without = sum(&films).bytes();
    let mut random = 7u64;
    let mut next = |below: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (random >> 33) as usize % below
    };
    for round in 0..120 {
        let mut bytes = part.clone();
        match round % 3 {
            0 => bytes.truncate(next(part.len())),
            1 => bytes[next(part.len())] ^= 1 << next(8),
            _ => bytes.extend(&part[..=next(64)]),
        }
        replace(&desk, "job-2.zk", &bytes);
        assert!(films.poll());
        assert!(sum(&films).bytes() == without, "round {round}");
        assert!(refusal(&films).contains("job-2.zk"), "round {round}: {}", refusal(&films));
        if round % 20 == 0 {
            replace(&desk, "job-2.zk", &part);
            assert!(films.poll() && sum(&films).bytes() == whole, "round {round}");
        }
    }
    // A folder in the place of the file.
    fs::remove_file(desk.path("job-2.zk")).unwrap();
    fs::create_dir(desk.path("job-2.zk")).unwrap();
    assert!(films.poll() && !refusal(&films).is_empty());
    assert!(sum(&films).bytes() == without);
}

#[test]
fn watch_needs_a_terminal_and_files() {
    let desk = Desk::new();
    let run = desk.run(&["watch", "job-1.zk"]);
    assert_eq!(run.status, 2, "{}", run.err);
    assert!(
        run.err.contains("a terminal at stdin and stdout; `zerkalo merge --partial"),
        "{}",
        run.err
    );
    assert_eq!(desk.run(&["watch"]).status, 2);
}
