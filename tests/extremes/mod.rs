//! Extreme sizes, places and proportions, at which renderers often fail: the thirty numbered tests
//! (`audit.rs` lists the file of each), the choice of precision, scaled and shifted scenes.

mod audit;
mod brightness;
mod camera;
mod cauchy;
mod cavity;
mod coincident;
mod compound;
mod contact;
mod degenerate;
mod diffuse;
mod lengths;
mod lens;
mod mesh;
mod on_surface;
mod precision;
mod scaled;
mod shadow;
mod sphere;
mod tapered;
mod volumes;
