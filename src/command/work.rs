//! `zerkalo work`: traces the shards of a job together with other processes, through all rounds.
//!
//! A worker takes the first shard that no worker has begun. When all are taken, the workers wait; one
//! of them, which holds the lock of the plan, continues shards of dead processes and plans the next
//! round. If it dies, another one does. Nothing else coordinates them.

use crate::command::args::WorkArgs;
use crate::command::shard::{self, ShardTracer, Traced};
use crate::command::{Failure, handle_signals, print_line, read_scene};
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, SystemTime};
use zerkalo_render::plan::{Job, Plan};
use zerkalo_scene::disk::{self, Claim};

/// Pause between two looks at the other workers.
const POLL: Duration = Duration::from_millis(200);
/// Age of an unfinished part from which its process counts as dead, on a file system without locks.
const DEAD: Duration = Duration::from_secs(180);

pub fn run(args: &WorkArgs) -> Result<(), Failure> {
    let job = Job::open(&args.plan)?;
    let document = read_scene(&args.scene)?;
    shard::check_scene(&document, &args.scene, &job)?;
    let signals = handle_signals()?;
    let state = shard::compile(&document, &args.scene, &job, args.acceleration)?;
    let tracer =
        ShardTracer { state: Some(state), threads: args.threads.count(), signals: &signals };
    // Waiting workers look at the shards from different places on.
    let looked = std::process::id();
    let complete = vec![false; job.head.settings.shards as usize];
    Worker { job, tracer, looked, complete }.run()
}

struct Worker<'a> {
    job: Job,
    tracer: ShardTracer<'a>,
    /// Number of looks at shards of other workers.
    looked: u32,
    /// `true` for the shards of this round that are known to be complete.
    complete: Vec<bool>,
}

impl Worker<'_> {
    fn run(mut self) -> Result<(), Failure> {
        while !self.job.is_finished() {
            for shard in 1..=self.job.head.settings.shards {
                if !self.job.part_path(shard).exists() {
                    self.take(shard)?;
                }
            }
            while !self.job.is_finished() && !self.job.advance() {
                self.finish_round()?;
                if let Some(status) = self.tracer.signals.caught() {
                    return Err(Failure::Signalled(status));
                }
            }
            self.complete = vec![false; self.job.head.settings.shards as usize];
        }
        print_line(&format!("{}  finished", self.job.path.display()))
    }

    /// Traces a shard. Returns `false` if another process does.
    fn take(&mut self, number: u32) -> Result<bool, Failure> {
        let path = self.job.part_path(number);
        let mut claim = match Claim::new(&path) {
            Err(error) if shard::is_taken(&error) => return Ok(false),
            claim => claim?,
        };
        if claim.is_unlocked() && age(&path) < DEAD {
            return Ok(false);
        }
        match self.tracer.trace(&self.job, number, &mut claim)? {
            Traced::Done => Ok(true),
            Traced::Taken => Ok(false),
            Traced::Stopped(status) => Err(Failure::Signalled(status)),
        }
    }

    /// Continues a shard of a dead process, plans the next round, or waits a moment.
    fn finish_round(&mut self) -> Result<(), Failure> {
        let shards = self.job.head.settings.shards;
        let planner = Claim::new(&self.job.path);
        let looked_at = match &planner {
            Ok(_) => 1..=shards,
            Err(_) => {
                self.looked = self.looked.wrapping_add(1);
                let shard = self.looked % shards + 1;
                shard..=shard
            }
        };
        let mut all_complete = planner.is_ok();
        for shard in looked_at {
            let index = shard as usize - 1;
            if !self.complete[index] {
                let path = self.job.part_path(shard);
                self.complete[index] =
                    shard::is_complete(&path, &self.job.head) || self.take(shard)?;
            }
            all_complete &= self.complete[index];
        }
        if !all_complete {
            sleep(POLL);
            return Ok(());
        }
        match self.job.next_plan(self.job.head.settings.noise_levels)? {
            Some(plan) => {
                disk::write(&self.job.next_path(), plan.text().as_bytes())?;
                print_line(&describe(&self.job.next_path(), &plan))
            }
            None => Ok(self.job.set_finished()?),
        }
    }
}

/// Returns the time since the last modification of a file.
fn age(path: &Path) -> Duration {
    let modified = std::fs::metadata(path).and_then(|metadata| metadata.modified());
    modified.ok().and_then(|time| SystemTime::now().duration_since(time).ok()).unwrap_or_default()
}

/// Formats what a plan decides, and why other rounds follow.
pub fn describe(path: &Path, plan: &Plan) -> String {
    let settings = &plan.settings;
    let (path, round, spp) = (path.display(), settings.round, plan.head().spp());
    let target = settings.noise_levels;
    if round == 1 {
        return format!(
            "{path}  {} shards  round 1: uniform, {spp:.0} spp; two or three adaptive rounds to a \
             noise of {target} 8-bit levels follow, planned from the noise of the round before",
            settings.shards
        );
    }
    let (base, total) = (settings.base_rays as f64, settings.total_rays);
    let expected = plan.predicted_levels;
    let last = expected <= 1.02 * target;
    let why = match last {
        true => "the last, because the estimates reach as far as the target".to_string(),
        false => format!(
            "another follows, because the target takes {:.1} times the rays so far",
            total / base.max(1.0)
        ),
    };
    format!(
        "{path}  {} shards  round {round}: {spp:.0} spp  expected noise {expected:.3} of {target} 8-bit \
         levels; {why}",
        settings.shards
    )
}
