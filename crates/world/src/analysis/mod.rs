//! Judgements about a scene as a whole: precision, range of radiance, bias of truncated paths,
//! reuse of samples after an edit, inventory.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

pub(crate) mod clearance;
pub(crate) mod inventory;
pub(crate) mod precision;
pub(crate) mod radiance_range;
mod sample_reuse;
pub(crate) mod truncation_bias;
