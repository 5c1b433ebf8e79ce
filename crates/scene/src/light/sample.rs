//! Result of sampling a light from hit points: the same record for every kind of light.

use zerkalo_kernel::lanes::Vec3;

/// Light of unit strength that arrives at hit points if nothing occludes it, from one direction for
/// each lane.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L> {
    /// Unit vector from the hit point towards the light.
    pub wi: Vec3<L>,
    /// Distance from the hit point to the light; the largest finite number for parallel light and
    /// environments, half of it for a sun.
    pub distance: L,
    /// Irradiance on a surface that faces the light. For a light with a size or an environment it
    /// is an estimate: the radiance divided by the sampling density. Zero if no light arrives.
    pub irradiance: Vec3<L>,
    /// Density [1/sr] with which `wi` is sampled; the largest finite number for lights without a
    /// size, zero if no light arrives.
    pub density: L,
}
