//! Simulation of renders on many machines. A picture is divided into shards, which the machines
//! trace in parallel. The result is the time until the picture is written, as a function of the
//! number of shards. The machines have different speeds, and they fail and are restarted.
//!
//!     cargo bench -p zerkalo-benches --bench scaling -- [KEY=VALUE ..]
//!
//! The keys are the fields of [`Setup`], measured as docs/many-machines.md describes. The model:
//!
//! - One machine renders the pilot (a first render that predicts the sample counts) and plans the
//!   shards. One machine also merges their results.
//! - The workflow engine starts `starts_per_second` tasks a second. Each task reads and compiles
//!   the scene, traces its shard, and writes the samples to the shared file system.
//! - The speed of a machine has a log-normal distribution; the standard deviation of its logarithm
//!   is `spread`. A fraction `slow` of the machines has a third of this speed.
//! - A machine fails after a time with an exponential distribution. After `requeue_seconds` the
//!   engine notices the failure, and the shard continues from its latest checkpoint on another
//!   machine.
//! - If there are more shards than machines, each machine that finishes a shard gets the next one.
//!
//! Random numbers have fixed seeds; the output is the same on every machine.

use std::collections::BinaryHeap;

/// Parameters of the simulation, measured or assumed. Their defaults are those of a render of the
/// scene glass-solids with 3840x2160 pixels, traced to a noise of 0.25 8-bit levels.
#[derive(Clone, Copy, Debug)]
struct Setup {
    /// Seconds that the whole picture takes on one machine.
    total: f64,
    /// Fraction of all rays that are traced before the last round of shards. In a render with one
    /// round, the pilot traces these rays; in a render with two rounds, the pilot and the first
    /// round.
    pilot: f64,
    /// Fraction of all rays that the pilot traces in a render with two rounds.
    first_pilot: f64,
    /// Seconds to start a task: start of the program, reading and compilation of the scene.
    start_seconds: f64,
    /// Size in megabytes of a shard's film file if it holds samples of all tiles.
    part_mb: f64,
    /// Mean number of blocks (16 samples of every pixel of a tile) that the shards together trace
    /// in a tile. With more shards than blocks, a shard's file holds samples of some tiles only.
    blocks: f64,
    /// Rate at which a shard's file is written, in megabytes per second.
    write_mb_s: f64,
    /// Rate at which the shards' files are merged, in megabytes per second.
    merge_mb_s: f64,
    /// Seconds to write the picture or the merged film.
    picture_seconds: f64,
    /// Ratio of the largest shard's work to the mean work of a shard, minus 1.
    imbalance: f64,
    /// Number of tasks that the engine starts per second.
    starts_per_second: f64,
    /// Standard deviation of the natural logarithm of the machines' speeds.
    spread: f64,
    /// Fraction of the machines whose speed is divided by 3.
    slow: f64,
    /// Mean time between failures of a machine, in hours.
    mtbf_hours: f64,
    /// Seconds from the failure of a machine until the engine starts its shard again.
    requeue_seconds: f64,
    /// Longest interval between two checkpoints of a shard, in seconds.
    checkpoint_seconds: f64,
}

const SETUP: Setup = Setup {
    total: 1_785.0,
    pilot: 0.30,
    first_pilot: 0.03,
    start_seconds: 0.2,
    part_mb: 600.0,
    blocks: 13.0,
    write_mb_s: 300.0,
    merge_mb_s: 200.0,
    picture_seconds: 3.0,
    imbalance: 0.02,
    starts_per_second: 20.0,
    spread: 0.1,
    slow: 0.02,
    mtbf_hours: 100.0,
    requeue_seconds: 60.0,
    checkpoint_seconds: 60.0,
};

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

/// Durations of the phases of one simulated render, in seconds.
#[derive(Clone, Copy, Default)]
struct Times {
    pilot: f64,
    shards: f64,
    merge: f64,
}

impl Times {
    fn total(&self) -> f64 {
        self.pilot + self.shards + self.merge
    }
}

impl Setup {
    /// Returns the size in megabytes of one film file of a render with `shards` shards. `blocks` is
    /// the mean number of blocks of samples in a tile. With fewer shards than blocks, every file
    /// holds samples of all tiles.
    fn part(&self, shards: usize, blocks: f64) -> f64 {
        self.part_mb * (blocks / shards as f64).min(1.0)
    }

    /// Returns the seconds from the start of the first task to the end of the last one. `work` is
    /// the sum of all shards' seconds on a machine of mean speed. `part` is the size of a shard's
    /// file in megabytes.
    fn shards(
        &self,
        work: f64,
        shards: usize,
        machines: usize,
        part: f64,
        random: &mut Random,
    ) -> f64 {
        let speeds: Vec<f64> = (0..machines)
            .map(|_| {
                let slow = if random.unit() < self.slow { 1.0 / 3.0 } else { 1.0 };
                slow * (self.spread * random.normal()).exp()
            })
            .collect();
        // Heap of the machines by the time at which they become free. The earliest one is at the
        // top.
        let mut free: BinaryHeap<Free> =
            (0..machines).map(|machine| Free { at: 0.0, machine }).collect();
        let mut end: f64 = 0.0;
        for shard in 0..shards {
            let Some(Free { at, machine }) = free.pop() else { break };
            let mut now = at.max(shard as f64 / self.starts_per_second) + self.start_seconds;
            // The model assumes that the first shard is the largest one.
            let excess = if shard == 0 { 1.0 + self.imbalance } else { 1.0 };
            let mut left = work / shards as f64 * excess;
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
            now += part / self.write_mb_s;
            end = end.max(now);
            free.push(Free { at: now, machine });
        }
        end
    }

    /// Simulates a render and returns the durations of its phases. If `rounds` is 1, these are
    /// pilot, shards and merge; otherwise there are two rounds of shards.
    fn render(&self, rounds: usize, shards: usize, machines: usize, random: &mut Random) -> Times {
        let ends = match rounds {
            1 => vec![self.pilot, 1.0],
            _ => vec![self.first_pilot, self.pilot, 1.0],
        };
        let mut times =
            Times { pilot: self.start_seconds + ends[0] * self.total, ..Times::default() };
        for pair in ends.windows(2) {
            let share = pair[1] - pair[0];
            let part = self.part(shards, self.blocks * share / (1.0 - self.pilot));
            times.shards += self.shards(share * self.total, shards, machines, part, random);
            times.merge +=
                (part * shards as f64 + self.part_mb) / self.merge_mb_s + self.picture_seconds;
        }
        times
    }

    fn set(&mut self, key: &str, value: f64) -> bool {
        let field = match key {
            "total" => &mut self.total,
            "pilot" => &mut self.pilot,
            "first_pilot" => &mut self.first_pilot,
            "start_seconds" => &mut self.start_seconds,
            "part_mb" => &mut self.part_mb,
            "blocks" => &mut self.blocks,
            "write_mb_s" => &mut self.write_mb_s,
            "merge_mb_s" => &mut self.merge_mb_s,
            "picture_seconds" => &mut self.picture_seconds,
            "imbalance" => &mut self.imbalance,
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
/// machines and `per_machine` shards for each of them.
fn row(setup: &Setup, rounds: usize, machines: usize, per_machine: usize) {
    let mut random = Random(machines as u64 * 1000 + per_machine as u64);
    let mut times: Vec<Times> = (0..RENDERS)
        .map(|_| setup.render(rounds, machines * per_machine, machines, &mut random))
        .collect();
    times.sort_by(|a, b| a.total().total_cmp(&b.total()));
    let (median, late) = (times[RENDERS / 2], times[RENDERS * 95 / 100]);
    let speedup = setup.total / median.total();
    println!(
        "| {machines} | {} | {:.0} | {:.0} | {:.0} | {:.0} | {:.0} | {speedup:.1} | {:.0} % |",
        machines * per_machine,
        median.pilot,
        median.shards,
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
    for (rounds, per_machine) in [(1, 1), (2, 1), (2, 4)] {
        println!("\n{rounds} round(s), {per_machine} shard(s) a machine; times in seconds\n");
        println!(
            "| machines | shards | pilot | shards | merge | total | 95 % within | speedup | efficiency |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        for exponent in 0..=10 {
            row(&setup, rounds, 1 << exponent, per_machine);
        }
    }
}
