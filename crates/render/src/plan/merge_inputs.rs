//! Inputs of a merge: film files that belong to one plan. No shard may be in two of the files.

use crate::plan::part::{Part, PartShard};
use crate::plan::{BASE, Plan};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Film file with its plan and the shards whose samples it holds.
#[derive(Clone, Debug)]
pub(super) struct MergeInput {
    pub path: PathBuf,
    pub plan: Arc<Plan>,
    /// Checksum of `plan`.
    pub checksum: u64,
    /// Shards that the film file holds, in ascending order.
    pub shards: Vec<PartShard>,
    /// Number of rays of all samples in the file.
    pub rays: u64,
}

/// Plans of film files, by checksum, so that all files of a plan share one copy of it.
#[derive(Debug, Default)]
pub(super) struct Plans(HashMap<u64, Arc<Plan>>);

impl Plans {
    /// Creates an input of a merge from the film file at `path`, which holds `part`.
    pub fn input(&mut self, path: &Path, part: Part) -> MergeInput {
        let Part { plan, shards, rays } = part;
        let checksum = plan.checksum();
        let plan = Arc::clone(self.0.entry(checksum).or_insert_with(|| Arc::new(plan)));
        MergeInput { path: path.to_path_buf(), plan, checksum, shards, rays }
    }
}

/// Checks that the film files `inputs` can be merged, and returns their common plan. One input may
/// be the merged film that this plan started from. It becomes an input of this plan that holds only
/// the shard [`BASE`].
///
/// # Errors
/// Fails if there is no input, if the files belong to different plans, if two of them hold the same
/// shard, or if the merged film lacks shards of its own plan.
pub(super) fn join(inputs: &mut [&mut MergeInput]) -> Result<Arc<Plan>, String> {
    let plan = common_plan(inputs)?;
    let mut holders: HashMap<u32, &Path> = HashMap::new();
    for input in inputs.iter() {
        for shard in &input.shards {
            if let Some(other) = holders.insert(shard.number, &input.path) {
                return Err(format!(
                    "{} and {} both hold {}; name one of them",
                    other.display(),
                    input.path.display(),
                    shard_name(shard.number)
                ));
            }
        }
    }
    Ok(plan)
}

fn common_plan(inputs: &mut [&mut MergeInput]) -> Result<Arc<Plan>, String> {
    let latest = inputs.iter().find(|latest| {
        let base = latest.plan.settings.base_plan;
        inputs.iter().all(|m| m.checksum == latest.checksum || Some(m.checksum) == base)
    });
    let Some(latest) = latest else {
        let Some(a) = inputs.first() else { return Err("no parts are named".to_string()) };
        let b = inputs.iter().find(|input| input.checksum != a.checksum).unwrap_or(a);
        return Err(format!(
            "{} and {} belong to different plans ({}); name parts of one plan",
            a.path.display(),
            b.path.display(),
            a.plan.difference(&b.plan)
        ));
    };
    let (plan, checksum) = (Arc::clone(&latest.plan), latest.checksum);
    for input in inputs.iter_mut().filter(|input| input.checksum != checksum) {
        if !input.plan.is_whole(&input.shards) {
            return Err(format!(
                "cannot use {}: it is the base of a plan and lacks shards; merge it completely \
                 first",
                input.path.display()
            ));
        }
        input.shards = vec![PartShard { number: BASE, complete: true }];
        (input.plan, input.checksum) = (Arc::clone(&plan), checksum);
    }
    Ok(plan)
}

/// Returns the name of the shard `number` in messages, such as `shard 3`.
pub(super) fn shard_name(number: u32) -> String {
    match number {
        BASE => "the base (shard 0)".to_string(),
        number => format!("shard {number}"),
    }
}
