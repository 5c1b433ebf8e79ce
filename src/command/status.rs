//! `zerkalo status`: prints how far a job is, from the headers of its parts.

use crate::command::args::StatusArgs;
use crate::command::{Failure, print_json, print_line};
use crate::dashboard::text::duration;
use serde_json::json;
use std::time::SystemTime;
use zerkalo_render::plan::{FilmFiles, WatchedState};

pub fn run(args: &StatusArgs) -> Result<(), Failure> {
    let now = SystemTime::now();
    let (files, _) = FilmFiles::of_headers(std::slice::from_ref(&args.plan))?;
    let job = files.job().ok_or("name a plan file, which `zerkalo plan` has written")?;
    let settings = &job.head.settings;
    let rows = files.shards(now);
    let is = |state: WatchedState| {
        let found = rows.iter().filter(move |row| row.state == state);
        found.map(|row| row.shards.clone()).collect::<Vec<_>>()
    };
    let mut failed = Vec::new();
    for row in &rows {
        if let WatchedState::Refused(reason) = &row.state {
            failed.push(json!({ "shard": row.shards, "reason": reason }));
        }
    }
    let [complete, late] = [WatchedState::Complete, WatchedState::Late].map(is);
    let finished = job.is_finished();
    let (rays, base) = (files.rays(), settings.base_rays);
    let total = settings.total_rays;
    let (share, hours) = match (finished, total > 0.0) {
        (true, _) => (Some(1.0), Some(0.0)),
        (false, true) => {
            let planned = std::fs::metadata(&job.path)?.modified()?;
            let seconds = now.duration_since(planned).unwrap_or_default().as_secs_f64();
            let rate = rays.saturating_sub(base) as f64 / seconds.max(1.0);
            let left = (total - rays as f64).max(0.0);
            (Some((rays as f64 / total).min(1.0)), (rate > 0.0).then(|| left / rate / 3600.0))
        }
        (false, false) => (None, None),
    };
    if args.json.json {
        return print_json(&json!({
            "plan": job.path.display().to_string(),
            "round": settings.round,
            "finished": finished,
            // Null in the first round, before there is an estimate.
            "percent": share.map(|share| 100.0 * share),
            "hours_left": hours,
            "rays": rays,
            "shards": settings.shards,
            "complete": complete.len(),
            "running": is(WatchedState::Running).len(),
            "missing": is(WatchedState::Missing).len(),
            "late": late,
            "failed": failed,
        }));
    }
    let percent = share.map_or("of unknown work".to_string(), |s| format!("{:.0} %", 100.0 * s));
    let left = match (finished, hours) {
        (true, _) => "  finished".to_string(),
        (false, Some(hours)) => format!("  {} left", duration(3600.0 * hours)),
        (false, None) => String::new(),
    };
    print_line(&format!(
        "{}  round {}  {percent}{left}  {} of {} shards complete, {} late, {} failed",
        job.path.display(),
        settings.round,
        complete.len(),
        settings.shards,
        late.len(),
        failed.len()
    ))
}
