//! Ray intersection against closed forms and exact arithmetic.

mod bits;
mod torus;
mod transforms;
mod tree;
