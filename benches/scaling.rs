//! Simulation of renders on many machines: workers take the shards of each round in turn, and plan
//! the next round when all are complete. The result is the time until the picture is written.
//!
//!     cargo bench -p zerkalo-benches --bench scaling -- [KEY=VALUE ..]
//!
//! The keys are the fields of [`Setup`], measured as docs/many-machines.md describes. Without keys,
//! the tables are for a frame of half an hour and one of 24 hours (`total`). The model:
//!
//! - The engine starts `starts_per_second` workers a second, once. Each reads and compiles the scene.
//! - A worker that is free takes the next shard. Shards shrink linearly to a tenth, as in
//!   `crates/render/src/plan/division.rs`; their real work differs from the expected one by
//!   `misjudged`.
//! - The worker reads the base of its tiles, traces, and writes its part. The parts of a round
//!   together are one film.
//! - The speed of a machine has a log-normal distribution; the standard deviation of its logarithm
//!   is `spread`. A fraction `slow` of the machines has a third of this speed.
//! - A machine fails after a time with an exponential distribution. After `requeue_seconds` the
//!   shard continues from its latest checkpoint on another machine.
//! - After the last shard of a round, one worker reads the reports in the headers and plans the next
//!   round, in `planning_seconds`; after the last round, the parts are merged.
//!
//! Random numbers have fixed seeds; the output is the same on every machine.

use std::collections::BinaryHeap;

/// Parameters of the simulation, measured or assumed. Their defaults are those of a render of the
/// scene glass-solids with 3840x2160 pixels, traced to a noise of 0.25 8-bit levels.
#[derive(Clone, Copy, Debug)]
struct Setup {
    /// Seconds that the whole picture takes on one machine; 0 for both tables.
    total: f64,
    /// Shards for each machine.
    per_machine: f64,
    /// Seconds to start a worker: start of the program, reading and compilation of the scene.
    start_seconds: f64,
    /// Seconds to find and take a shard.
    take_seconds: f64,
    /// Size of the film file in megabytes.
    film_mb: f64,
    /// Rate at which a worker reads its base and writes its part, in megabytes per second.
    part_mb_s: f64,
    /// Rate at which the parts are merged, in megabytes per second.
    merge_mb_s: f64,
    /// Seconds to write the picture.
    picture_seconds: f64,
    /// Seconds to plan a round, with the pause until workers notice.
    planning_seconds: f64,
    /// Standard deviation of the real work of a shard, as a share of the expected one.
    misjudged: f64,
    /// Number of workers that the engine starts per second.
    starts_per_second: f64,
    /// Standard deviation of the natural logarithm of the machines' speeds.
    spread: f64,
    /// Fraction of the machines whose speed is divided by 3.
    slow: f64,
    /// Mean time between failures of a machine, in hours.
    mtbf_hours: f64,
    /// Seconds from the failure of a machine until its shard continues.
    requeue_seconds: f64,
    /// Longest interval between two checkpoints of a shard, in seconds.
    checkpoint_seconds: f64,
}

const SETUP: Setup = Setup {
    total: 0.0,
    per_machine: 16.0,
    start_seconds: 0.2,
    take_seconds: 0.02,
    film_mb: 600.0,
    part_mb_s: 300.0,
    merge_mb_s: 500.0,
    picture_seconds: 3.0,
    planning_seconds: 0.6,
    misjudged: 0.1,
    starts_per_second: 20.0,
    spread: 0.1,
    slow: 0.02,
    mtbf_hours: 100.0,
    requeue_seconds: 60.0,
    checkpoint_seconds: 60.0,
};

/// Shares of all rays at the ends of the rounds, as in the larger frames of
/// `tests/shards.rs`: uniform, two to three adaptive rounds.
const ROUNDS: [f64; 4] = [0.03, 0.17, 0.75, 1.0];
/// Share by which the last shard is smaller than the first one.
const DECREASE: f64 = 0.9;

/// Random number generator SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = self.0;
        let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn exponential(&mut self, mean: f64) -> f64 {
        -mean * (1.0 - self.unit()).ln()
    }

    fn normal(&mut self) -> f64 {
        let (a, b) = (self.unit(), self.unit());
        (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Durations of the parts of one simulated render, in seconds.
#[derive(Clone, Copy, Default)]
struct Times {
    rounds: f64,
    merge: f64,
}

impl Times {
    fn total(&self) -> f64 {
        self.rounds + self.merge
    }
}

impl Setup {
    /// Traces a round with the given `work`, seconds on a machine of mean speed, from the time
    /// `begin` on. `free` are the times at which the workers become free. Returns its end.
    fn round(
        &self,
        work: f64,
        begin: f64,
        (free, speeds): (&mut BinaryHeap<Free>, &[f64]),
        random: &mut Random,
    ) -> f64 {
        let shards = (speeds.len() as f64 * self.per_machine) as usize;
        let part = self.film_mb / shards as f64;
        let mut end: f64 = 0.0;
        for shard in 0..shards {
            let Some(Free { at, machine }) = free.pop() else { break };
            let mut now = at.max(begin) + self.take_seconds + part / self.part_mb_s;
            let size = 1.0 - DECREASE * (shard as f64 + 0.5) / shards as f64;
            let share = size / (1.0 - 0.5 * DECREASE) / shards as f64;
            let mut left = work * share * (self.misjudged * random.normal()).exp();
            let mut speed = speeds[machine];
            loop {
                let failure = random.exponential(3600.0 * self.mtbf_hours);
                let finish = left / speed;
                if failure > finish {
                    now += finish;
                    break;
                }
                // Samples since the latest checkpoint are lost.
                let kept = (failure / self.checkpoint_seconds).floor() * self.checkpoint_seconds;
                left -= kept * speed;
                now += failure + self.requeue_seconds + self.start_seconds;
                speed = 1.0;
            }
            now += part / self.part_mb_s;
            end = end.max(now);
            free.push(Free { at: now, machine });
        }
        end
    }

    fn render(&self, total: f64, machines: usize, random: &mut Random) -> Times {
        let speeds: Vec<f64> = (0..machines)
            .map(|_| {
                let slow = if random.unit() < self.slow { 1.0 / 3.0 } else { 1.0 };
                slow * (self.spread * random.normal()).exp()
            })
            .collect();
        let started = |machine: usize| machine as f64 / self.starts_per_second + self.start_seconds;
        let mut free: BinaryHeap<Free> =
            (0..machines).map(|machine| Free { at: started(machine), machine }).collect();
        let (mut now, mut before) = (0.0, 0.0);
        for end in ROUNDS {
            now = self.round((end - before) * total, now, (&mut free, &speeds), random);
            now += self.planning_seconds;
            before = end;
        }
        Times { rounds: now, merge: self.film_mb / self.merge_mb_s + self.picture_seconds }
    }

    fn set(&mut self, key: &str, value: f64) -> bool {
        let field = match key {
            "total" => &mut self.total,
            "per_machine" => &mut self.per_machine,
            "start_seconds" => &mut self.start_seconds,
            "take_seconds" => &mut self.take_seconds,
            "film_mb" => &mut self.film_mb,
            "part_mb_s" => &mut self.part_mb_s,
            "merge_mb_s" => &mut self.merge_mb_s,
            "picture_seconds" => &mut self.picture_seconds,
            "planning_seconds" => &mut self.planning_seconds,
            "misjudged" => &mut self.misjudged,
            "starts_per_second" => &mut self.starts_per_second,
            "spread" => &mut self.spread,
            "slow" => &mut self.slow,
            "mtbf_hours" => &mut self.mtbf_hours,
            "requeue_seconds" => &mut self.requeue_seconds,
            "checkpoint_seconds" => &mut self.checkpoint_seconds,
            _ => return false,
        };
        *field = value;
        true
    }
}

/// Machine, with the time at which it becomes free. The comparison is reversed, so that a max-heap
/// has the machine that becomes free first at its top.
#[derive(PartialEq)]
struct Free {
    at: f64,
    machine: usize,
}

impl Eq for Free {}
impl PartialOrd for Free {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Free {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.at.total_cmp(&self.at).then(other.machine.cmp(&self.machine))
    }
}

/// Number of renders that are simulated for a row of the table.
const RENDERS: usize = 200;

/// Prints a row of the table: median and 95th percentile of the render time with `machines`
/// machines.
fn row(setup: &Setup, total: f64, machines: usize) {
    let mut random = Random(machines as u64 * 1000);
    let mut times: Vec<Times> =
        (0..RENDERS).map(|_| setup.render(total, machines, &mut random)).collect();
    times.sort_by(|a, b| a.total().total_cmp(&b.total()));
    let (median, late) = (times[RENDERS / 2], times[RENDERS * 95 / 100]);
    let speedup = total / median.total();
    println!(
        "| {machines} | {:.0} | {:.0} | {:.0} | {:.0} | {speedup:.1} | {:.0} % |",
        median.rounds,
        median.merge,
        median.total(),
        late.total(),
        100.0 * speedup / machines as f64,
    );
}

fn main() {
    let mut setup = SETUP;
    for argument in std::env::args().skip(1).filter(|argument| !argument.starts_with("--")) {
        let value = argument.split_once('=').and_then(|(k, v)| Some((k, v.parse().ok()?)));
        if !value.is_some_and(|(key, value)| setup.set(key, value)) {
            eprintln!("`{argument}`: expected KEY=NUMBER with a key of {setup:?}");
            std::process::exit(2);
        }
    }
    println!("{setup:#?}");
    let totals = if setup.total > 0.0 { vec![setup.total] } else { vec![1785.0, 86_400.0] };
    for total in totals {
        println!("\nA frame of {total} s on one machine; times in seconds\n");
        println!("| machines | rounds | merge | total | 95 % within | speedup | efficiency |");
        println!("|---|---|---|---|---|---|---|");
        for exponent in 0..=10 {
            row(&setup, total, 1 << exponent);
        }
    }
}
