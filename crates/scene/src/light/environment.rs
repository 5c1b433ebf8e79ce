//! Environment light: radiance from all directions, from an equirectangular image or a gradient.
//!
//! ```toml
//! environment = { file = "sky.hdr", rotation = 90.0 }
//! environment = { zenith = [0.2, 0.4, 0.9], horizon = [0.9, 0.9, 0.8], nadir = [0.2, 0.2, 0.2] }
//! ```

use crate::asset::{DirectionSample, Loaded, RadianceMap, Reading};
use crate::light::{LightDesc, LightForm, LightSample};
use crate::value::{Color, description};
use std::f64::consts::PI;
use std::sync::Arc;
use zerkalo_kernel::lanes::{SimdFloat, Vec3};

/// Number of rows of the image that represents a gradient environment.
const GRADIENT_ROWS: u32 = 512;

description! {
    /// Light from all directions, such as the sky.
    pub struct Environment {
        /// Name of an equirectangular image (Radiance HDR, OpenEXR, PNG, JPEG), relative to the
        /// folder of the scene file. The middle of the image is towards -z. An empty name selects
        /// the gradient.
        file: String = "";
        /// Radiance of the gradient straight above.
        zenith: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Radiance of the gradient at the horizon. Above and below, the radiance changes linearly
        /// with the sine of the elevation.
        horizon: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Radiance of the gradient straight below.
        nadir: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Rotation of the image about the vertical, counter-clockwise seen from above.
        rotation: f64 = 0.0, in closed(-360.0, 360.0) "degrees";
        loads map: Loaded<RadianceMap>;
    }
}

impl Environment {
    pub fn file(&self) -> Option<&str> {
        (!self.file.is_empty()).then_some(self.file.as_str())
    }

    /// Returns the image of the environment; `None` for a gradient, or if no readable file has been
    /// loaded.
    pub fn map(&self) -> Option<&Arc<RadianceMap>> {
        self.map.content()
    }

    /// Reads the image with `load`, unless it is loaded already.
    pub fn resolve(&mut self, load: impl FnOnce(&str) -> Reading<RadianceMap>) {
        self.map.resolve(&self.file, load);
    }

    /// Returns an image of the gradient, with a single column, because the radiance depends on the
    /// elevation alone.
    fn gradient(&self) -> RadianceMap {
        let row = |row: u32| {
            let height = (PI * (f64::from(row) + 0.5) / f64::from(GRADIENT_ROWS)).cos();
            let end = if height > 0.0 { self.zenith.0 } else { self.nadir.0 };
            let horizon = self.horizon.0;
            std::array::from_fn(|c| (horizon[c] + height.abs() * (end[c] - horizon[c])) as f32)
        };
        RadianceMap::new([1, GRADIENT_ROWS], &(0..GRADIENT_ROWS).map(row).collect::<Vec<_>>())
    }
}

impl LightDesc for Environment {
    fn form(&self) -> LightForm<'_> {
        LightForm::Environment(self)
    }

    fn usual_name(&self) -> &'static str {
        "sky"
    }
}

/// Environment light compiled for the kernels, white and with intensity 1.
pub struct EnvironmentLight {
    map: Arc<RadianceMap>,
    /// Sine and cosine of the angle of rotation.
    rotation: [f64; 2],
}

impl EnvironmentLight {
    /// Compiles `environment`. Returns `None` if its image is not loaded.
    pub fn new(environment: &Environment) -> Option<Self> {
        let map = match environment.file() {
            Some(_) => environment.map()?.clone(),
            None => Arc::new(environment.gradient()),
        };
        Some(Self { map, rotation: environment.rotation.to_radians().sin_cos().into() })
    }

    pub fn map(&self) -> &RadianceMap {
        &self.map
    }

    /// Returns the radiance that arrives from the unit vectors `direction`, and the density
    /// [1/sr] with which [`EnvironmentLight::sample`] draws them. Both are zero outside `lanes`.
    #[inline(never)]
    pub fn radiance<L: SimdFloat>(&self, direction: Vec3<L>, lanes: L::Mask) -> (Vec3<L>, L) {
        let ([sin, cos], Vec3 { x, y, z }) = (self.rotation.map(L::from_f64), direction);
        self.map.radiance(Vec3::new(x * cos - z * sin, y, x * sin + z * cos), lanes)
    }

    /// Samples a direction for each of `lanes`, where the environment is brighter than on average.
    /// In other lanes the irradiance is zero. `u` and `v` are uniform in [0, 1).
    #[inline(never)]
    pub fn sample<L: SimdFloat>(&self, (u, v): (L, L), lanes: L::Mask) -> LightSample<L> {
        let [sin, cos] = self.rotation.map(L::from_f64);
        let DirectionSample { direction, radiance, density } = self.map.sample((u, v), lanes);
        let Vec3 { x, y, z } = direction;
        LightSample {
            wi: Vec3::new(x * cos + z * sin, y, z * cos - x * sin),
            distance: L::from_f64(L::MAX),
            irradiance: radiance * (L::one() / density),
            density,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::lanes::Double;

    fn light(environment: Environment) -> EnvironmentLight {
        EnvironmentLight::new(&environment).expect("an environment")
    }

    fn radiance(light: &EnvironmentLight, direction: [f64; 3]) -> [f64; 3] {
        light.radiance(Vec3::<Double>::of(direction), Double::mask(true)).0.lane(0)
    }

    #[test]
    fn gradient_changes_with_the_sine_of_the_height() {
        let light = light(Environment {
            zenith: Color([1.0, 2.0, 0.0]),
            horizon: Color([3.0, 2.0, 0.0]),
            nadir: Color([5.0, 0.0, 0.5]),
            ..Environment::default()
        });
        for (height, expected) in [
            (1.0, [1.0, 2.0, 0.0]),
            (0.6, [1.8, 2.0, 0.0]),
            (0.0, [3.0, 2.0, 0.0]),
            (-0.6, [4.2, 0.8, 0.3]),
            (-1.0, [5.0, 0.0, 0.5]),
        ] {
            let across = f64::sqrt(1.0 - height * height);
            let found = radiance(&light, [0.6 * across, height, -0.8 * across]);
            for c in 0..3 {
                // The image is least exact at the horizon, where the slope of the gradient changes.
                // The tolerance is the largest change over two rows of the image: two rows of pi /
                // `GRADIENT_ROWS` radians, times the largest slope 2.
                let difference = (found[c] - expected[c]).abs();
                assert!(difference < 4.0 * PI / f64::from(GRADIENT_ROWS), "{height}: {found:?}");
            }
        }
    }

    /// Checks that a rotation of the environment by 90 degrees moves the middle of its image from
    /// -z to -x.
    #[test]
    fn rotation_is_counter_clockwise_from_above() {
        let pixels = [0, 1, 2, 3].map(|i| [f32::from(u8::from(i == 1 || i == 2)); 3]).repeat(2);
        let map = Arc::new(RadianceMap::new([4, 2], &pixels));
        let mut environment =
            Environment { file: "a".to_string(), rotation: 90.0, ..Environment::default() };
        environment.resolve(|_| Some(Ok(map)));
        let light = light(environment);
        assert!((radiance(&light, [-1.0, 0.0, 0.0])[0] - 1.0).abs() < 1e-12);
        assert!(radiance(&light, [1.0, 0.0, 0.0])[0].abs() < 1e-12);
        let numbers = (Double::from_f64(0.5), Double::from_f64(0.5));
        let sample = light.sample(numbers, Double::mask(true));
        let (radiance, density) = light.radiance(sample.wi, Double::mask(true));
        let first = |x: Double| SimdFloat::lane(x, 0);
        assert!((first(density) / first(sample.density) - 1.0).abs() < 1e-9);
        let expected = first(radiance.x) / first(density);
        assert!((first(sample.irradiance.x) / expected - 1.0).abs() < 1e-9);
    }
}
