//! Settings of the whole picture: film, integrator, background, ambient light.

use crate::value::{Color, choices, description};

description! {
    /// Film settings: size, pixel filter, sample limit of glossy pixels.
    pub struct FilmSettings {
        /// Width and height of the picture.
        size: [u32; 2] = [640, 480], in closed(1.0, 16384.0) "pixels";
        /// Distribution of samples over a pixel.
        filter: Filter = "box";
        /// Largest number of samples of a pixel that shows glossy reflections; 0 is no cap.
        rays_per_pixel: u32 = 0, in closed(0.0, 1e9) "samples";
        /// Display of light that is brighter than white; the samples stay the same.
        tone: Tone = "clip";
        /// Light group that is shown alone: a name in `groups`, the name of a light or of an emissive
        /// material, `ambient` or `background`. The samples stay the same.
        solo: String, or "all light";
    }
}

choices! {
    /// Tone curve from radiance to linear light of a display, as a fraction of its white.
    pub enum Tone {
        /// each colour channel is clipped at 1
        Clip = "clip",
        /// the Khronos PBR Neutral tone mapper (Khronos specification of 2024): it subtracts at most
        /// 0.04 from all channels, then compresses the colours whose largest channel is still above
        /// 0.76, and keeps their hues
        Neutral = "neutral",
    }
}

impl Tone {
    /// Word in scene files, options and film files.
    pub fn name(self) -> &'static str {
        Self::CHOICES[self as usize].name
    }

    /// Inverse of [`Self::name`].
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|tone| tone.name() == name)
    }
}

choices! {
    /// Distribution of samples over a pixel.
    pub enum Filter {
        /// samples uniform over the pixel's square
        Box = "box",
        /// all samples at the pixel's centre: no anti-aliasing
        Point = "point",
    }
}

description! {
    /// Integrator settings, the table `[trace]`.
    pub struct IntegratorSettings {
        /// Kinds of rays that are traced.
        ray_types: RayTypes = "full";
        /// Largest number of surfaces that a path hits after the first, or after a diffuse bounce;
        /// 0: no reflection, no transmission.
        max_depth: u32 = 16, in closed(0.0, 10000.0) "surfaces", step Units(10.0);
        /// Largest number of diffuse bounces of a path; 0: no indirect diffuse light. Ambient light
        /// stands for further bounces.
        max_diffuse_depth: u32 = 0, in closed(0.0, 100.0) "bounces";
        /// Caustics: after a diffuse bounce, too, mirrors reflect and glass transmits light. `false`
        /// leaves this light out.
        caustics: bool = true;
        /// Clear flat mirrors reflect each light once more, onto the surfaces in front of them, also
        /// without diffuse bounces.
        mirror_light: bool = false;
        /// Smallest throughput of a path; a path with less ends.
        min_throughput: f64 = 0.0, in SHARE;
        /// Treatment of sampled reflections below the surface's horizon.
        below_horizon: BelowHorizon = "fold";
        /// Acceleration structure. Every choice renders the same image; only speed differs.
        acceleration: Acceleration = "auto";
    }
}

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
}

choices! {
    /// Kinds of rays that are traced.
    #[derive(PartialOrd, Ord)]
    pub enum RayTypes {
        /// camera rays only: no shadows, no reflections
        Primary = "primary",
        /// camera rays and shadow rays
        Shadows = "shadows",
        /// camera, shadow, reflected and transmitted rays
        Full = "full",
    }
}

choices! {
    /// Treatment of sampled reflections below the surface's horizon.
    pub enum BelowHorizon {
        /// directions below the horizon are mirrored at the surface: no light is lost
        Fold = "fold",
        /// directions below the horizon are dropped: their light is lost
        Absorb = "absorb",
    }
}

description! {
    /// Radiance of rays that hit no surface.
    pub struct Background {
        /// Radiance of rays that hit no surface.
        color: Color = [0.0, 0.0, 0.0], in LIGHT "radiance";
    }
}

description! {
    /// Ambient light: uniform, without shadows.
    pub struct Ambient {
        /// Ambient light i_a from all directions, without shadows. Materials multiply it by k_a.
        color: Color = [0.0, 0.0, 0.0], in LIGHT "radiance";
    }
}
