//! Tests of features, one for each row of the table in docs/features.md, named after the row.
//!
//! Each test renders a shipped scene and compares it with an independent source: a formula, the
//! reference tracer of tests/reference, or a property that only this feature has. Each test must
//! also fail when its feature is replaced by a similar one, a mutation. Mutations of the scene are
//! part of the test. Mutations of the source code are files in `mutations`, which `mutate.sh` runs.

mod regions;
mod row;

mod camera;
mod emitters;
mod extents;
mod glass;
mod light;
mod lobes;
mod mesh;
mod mutations;
mod paths;
mod program;
mod roughness_mix;
mod shapes;
mod shards;
mod table;
mod textures;
mod tracks;
