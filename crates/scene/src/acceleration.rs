//! Acceleration structures as scene files name them.

use crate::value::choices;

choices! {
    /// Acceleration structure. Every choice renders the same image; only speed differs.
    pub enum Acceleration {
        /// the fastest by measurement: `bvh` in scenes with many objects, otherwise a list for each
        /// tile of the picture
        Auto = "auto",
        /// every ray tests every primitive
        None = "none",
        /// screen bounds of each primitive, for camera rays
        ScreenBounds = "screen-bounds",
        /// oriented bounding boxes: one per primitive, in its own space
        Obb = "obb",
        /// axis-aligned bounding boxes: one per primitive, in the scene's space
        Aabb = "aabb",
        /// a bounding volume hierarchy
        Bvh = "bvh",
    }
}

impl Acceleration {
    /// Returns the name of this acceleration structure in scene files and on the command line.
    pub fn name(self) -> &'static str {
        Self::CHOICES[self as usize].name
    }

    /// Returns the structure with the name `name`; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
}
