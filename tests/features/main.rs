//! One test for every feature in the table of docs/features.md, named after its row. Each shows a shipped
//! scene and holds it against something independent: a formula, the plain tracer of tests/agreement, a
//! property that nothing else has. Each also fails when the feature is replaced by what stands next to
//! it: where the neighbour can be written into the scene, the test does that itself; where it takes
//! other source code, a file in `mutations` says which, and `mutate.sh` tries it.

#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/answers.rs"]
mod answers;
#[path = "../common/mod.rs"]
mod common;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/compare.rs"]
mod compare;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/compounds.rs"]
mod compounds;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/meshes.rs"]
mod meshes;
#[path = "../common/normal.rs"]
mod normal;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/paint.rs"]
mod paint;
#[path = "../support/mod.rs"]
mod support;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/surfaces.rs"]
mod surfaces;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/through.rs"]
mod through;
#[allow(dead_code, reason = "of tests/agreement; not all of it is needed here")]
#[path = "../agreement/tracer.rs"]
mod tracer;

mod beside;
mod row;
mod sight;
mod solids;

mod camera;
mod extents;
mod light;
mod lobes;
mod mesh;
mod mutations;
mod paths;
mod program;
mod shapes;
mod table;
mod textures;
mod tracks;
