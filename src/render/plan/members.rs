//! Members of a merged film: film files of one plan whose shards do not overlap.

use crate::render::plan::part::{Part, PartShard};
use crate::render::plan::{BASE, Plan};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A film file with samples of a plan, and the shards that it holds.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub path: PathBuf,
    pub plan: Arc<Plan>,
    /// Checksum of the plan.
    pub checksum: u64,
    /// Shards in ascending order.
    pub shards: Vec<PartShard>,
    /// Number of rays of all samples in the file.
    pub rays: u64,
}

/// Plans by checksum. Film files of the same plan share it in memory.
#[derive(Debug, Default)]
pub(super) struct Plans(HashMap<u64, Arc<Plan>>);

impl Plans {
    /// Creates the member for the film file at `path`. `part` is the plan and the shards in the
    /// file.
    pub fn member(&mut self, path: &Path, part: Part) -> Member {
        let Part { plan, shards, rays } = part;
        let checksum = plan.checksum();
        let plan = Arc::clone(self.0.entry(checksum).or_insert_with(|| Arc::new(plan)));
        Member { path: path.to_path_buf(), plan, checksum, shards, rays }
    }
}

/// Shards of a merged film by number, each with the file that holds it.
pub(super) type ShardFiles = BTreeMap<u32, (PathBuf, PartShard)>;

/// Returns the plan of all members, and each shard with the file that holds it. A plan may continue
/// the merged film of another plan; that film then becomes the base.
///
/// # Errors
/// Fails if the members belong to different plans or if two of them hold the same shard.
pub(super) fn join(members: &mut [Member]) -> Result<(Arc<Plan>, ShardFiles), String> {
    let plan = common_plan(members)?;
    let mut shards = ShardFiles::new();
    for member in members.iter() {
        for shard in &member.shards {
            let entry = (member.path.clone(), *shard);
            if let Some((other, _)) = shards.insert(shard.number, entry) {
                return Err(format!(
                    "{} and {} both hold {}; name one of them",
                    other.display(),
                    member.path.display(),
                    shard_name(shard.number)
                ));
            }
        }
    }
    Ok((plan, shards))
}

fn common_plan(members: &mut [Member]) -> Result<Arc<Plan>, String> {
    let latest = members.iter().find(|latest| {
        let base = latest.plan.settings.base_plan;
        members.iter().all(|m| m.checksum == latest.checksum || Some(m.checksum) == base)
    });
    let Some(latest) = latest else {
        let Some(a) = members.first() else { return Err("no parts are named".to_string()) };
        let b = members.iter().find(|member| member.checksum != a.checksum).unwrap_or(a);
        return Err(format!(
            "{} and {} belong to different plans ({}); name parts of one plan",
            a.path.display(),
            b.path.display(),
            a.plan.difference(&b.plan)
        ));
    };
    let (plan, checksum) = (Arc::clone(&latest.plan), latest.checksum);
    for member in members.iter_mut().filter(|member| member.checksum != checksum) {
        if !member.plan.is_whole(&member.shards) {
            return Err(format!(
                "cannot use {}: it is the base of a plan and lacks shards; merge it completely \
                 first",
                member.path.display()
            ));
        }
        member.shards = vec![PartShard { number: BASE, complete: true }];
        (member.plan, member.checksum) = (Arc::clone(&plan), checksum);
    }
    Ok(plan)
}

/// Returns the name of a shard for messages.
pub(super) fn shard_name(number: u32) -> String {
    match number {
        BASE => "the base (shard 0)".to_string(),
        number => format!("shard {number}"),
    }
}
