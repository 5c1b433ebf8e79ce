//! One test for each feature in the table of docs/features.md, named after its row. Each test renders a
//! shipped scene and compares it with an independent source: a formula, the plain tracer of
//! tests/agreement, or a property that only this feature has. Each test must also fail when its feature is
//! replaced by a similar one, a mutation. Mutations of the scene are part of the test. Mutations of the
//! source code are files in `mutations`, which `mutate.sh` runs.

#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/answers.rs"]
mod answers;
#[path = "../common/mod.rs"]
mod common;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/compare.rs"]
mod compare;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/compounds.rs"]
mod compounds;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/lamps.rs"]
mod lamps;
#[path = "../agreement/meshes.rs"]
mod meshes;
#[path = "../common/normal.rs"]
mod normal;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/paint.rs"]
mod paint;
#[path = "../support/mod.rs"]
mod support;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/surfaces.rs"]
mod surfaces;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/through.rs"]
mod through;
#[allow(dead_code, reason = "shared with tests/agreement")]
#[path = "../agreement/tracer.rs"]
mod tracer;

mod analytic_shapes;
mod first_hits;
mod plain_tracer;
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
mod shapes;
mod shards;
mod table;
mod textures;
mod tracks;
