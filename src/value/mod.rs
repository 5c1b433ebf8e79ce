//! What users write, as values: colours, and the faults that a value can have. Known to every
//! description (shape, material, light, camera, scene) and knowing none of them.

mod color;
mod fault;

pub use color::Color;
pub use fault::Fault;
