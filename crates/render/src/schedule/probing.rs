//! Error probes: when they are due, and the parts of the error to which their results lead.

use crate::error_parts::{ErrorParts, ErrorTarget, ROUNDING_TO_8_BITS};
use crate::error_probe::ProbeSums;
use crate::schedule::{SAMPLE_ALIGNMENT, Schedule};
use std::ops::Range;

/// Reciprocal of the largest share of a render's rays that the first probe may cost.
const FIRST_SHARE: u64 = 128;
/// Reciprocal of the largest share of a render's rays that all probes together may cost.
const SHARE: u64 = 256;
/// Number of rays per primitive after which the scene is compiled in double precision. Compiling a
/// primitive takes about as long as four rays.
const RAYS_PER_PRIMITIVE: u64 = 256;
/// Largest number of packets of one probe.
const MAX_PACKETS: u64 = 1024;
/// Smallest number of packets of the first probe.
const MIN_PACKETS: u32 = 16;
/// Samples of a packet: those of 16 pixels in both replicates.
const PACKET_SAMPLES: u64 = 32;
/// Largest error of rounding with which `auto` stays in single precision, as a share of the target.
const ROUNDING_SHARE: f64 = 0.1;

/// Parts of a picture's error that a probe can measure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measurable {
    /// `true` if the picture is traced in single precision.
    pub rounding: bool,
    /// `true` if limits of the scene cut paths.
    pub cut_paths: bool,
    /// Number of primitives, with each triangle of a mesh.
    pub primitives: u64,
}

impl Schedule {
    /// Returns the packets of the next probe; `None` if none is due. Probes follow noise estimates,
    /// and the number of samples doubles from one to the next.
    pub fn due_probe(&self) -> Option<Range<u32>> {
        let Measurable { rounding, cut_paths, primitives } = self.measurable;
        let is_between_rounds = self.remaining.is_empty() && self.replicate == 1;
        let due = self.noise.is_some()
            && is_between_rounds
            && (rounding || cut_paths)
            && self.samples / 2 >= self.probed_at;
        if !due {
            return None;
        }
        let done = &self.probe;
        let cost_of_packet = match done.packets {
            // Paths of three lengths in double precision, and once more in single precision.
            0 => 7 * PACKET_SAMPLES * self.rays / self.samples.max(1),
            packets => done.cost / u64::from(packets),
        };
        let least = u64::from(MIN_PACKETS.saturating_sub(done.packets));
        let share = if least > 0 { FIRST_SHARE } else { SHARE };
        let affordable = (self.rays / share).saturating_sub(done.cost) / cost_of_packet.max(1);
        let packets = match self.settings.stop.error {
            Some(_) => affordable.max(least),
            None if affordable < least || self.rays < RAYS_PER_PRIMITIVE * primitives => 0,
            None => affordable,
        };
        let packets = packets.min(MAX_PACKETS).min(self.tiles.len() as u64 + least) as u32;
        (packets > 0).then_some(done.packets..done.packets + packets)
    }

    /// Records the results of the probe that was due.
    pub fn record_probe(&mut self, sums: &ProbeSums) {
        self.probe.add(sums);
        self.probed_at = self.samples;
    }

    /// Returns the parts of the picture's error. `left_out` names what the model leaves out.
    /// Returns `None` before the first estimate of the noise.
    pub fn error_parts(&self, left_out: &[&'static str]) -> Option<ErrorParts> {
        let noise = self.noise?.rmse.levels;
        let (rounding, cut_paths) = self.probed_parts();
        let quantization = self.settings.stop.error.map_or(ROUNDING_TO_8_BITS, |e| e.quantization);
        Some(ErrorParts {
            noise,
            rounding,
            cut_paths,
            probed_pixels: if self.measurable.cut_paths { self.probe.pixels } else { 0 },
            quantization,
            left_out: left_out.to_vec(),
            is_target: self.settings.stop.error.is_some(),
        })
    }

    /// Returns the errors of rounding and of cut paths; `None` for a part that was not measured.
    fn probed_parts(&self) -> (Option<f64>, Option<f64>) {
        let Measurable { rounding, cut_paths, .. } = self.measurable;
        let (probe, spp) = (&self.probe, self.spp().mean);
        let rounding = if rounding { probe.rounding(spp) } else { Some(0.0) };
        (rounding, if cut_paths { probe.cut_paths(spp) } else { Some(0.0) })
    }

    /// Returns the noise at which the error meets `target`; if the other parts alone exceed it, the
    /// noise at which noise and quantisation would meet it.
    pub(super) fn noise_target(&self, target: ErrorTarget) -> f64 {
        let (rounding, cut_paths) = self.probed_parts();
        let square = |x: f64| x * x;
        let alone = square(target.levels) - square(target.quantization);
        let rest = (target.levels - cut_paths.unwrap_or(0.0)).max(0.0);
        let left = square(rest) - square(target.quantization) - square(rounding.unwrap_or(0.0));
        if left > 0.0 { left } else { alone.max(0.0) }.sqrt()
    }

    /// Returns `true` if enough of the picture was probed for the error to end the render.
    pub(super) fn is_probed(&self) -> bool {
        let Measurable { rounding, cut_paths, .. } = self.measurable;
        !(rounding || cut_paths) || self.probe.packets >= MIN_PACKETS
    }

    /// Returns the error of rounding if it is too large for the error target, so that `auto` should
    /// choose double precision. Only the first probes decide, so that little work is lost.
    pub fn excessive_rounding(&self) -> Option<f64> {
        let target = self.settings.stop.error?.levels;
        let rounding = self.probe.systematic_rounding()?;
        let is_early = self.spp().max <= 2 * SAMPLE_ALIGNMENT;
        (is_early && self.measurable.rounding && rounding > ROUNDING_SHARE * target)
            .then_some(rounding)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error_probe::PairedDifference;
    use crate::schedule::{Settings, Stop};

    /// Checks that the noise has to be smaller if other parts of the error are large, and that a
    /// part without bound does not let the render go on for ever.
    #[test]
    fn error_target_leaves_room_for_rounding_and_cut_paths() {
        let target = ErrorTarget { levels: 0.6, quantization: 0.3 };
        let stop = Stop { error: Some(target), ..Stop::default() };
        let mut schedule = Schedule::new(&[256; 4], Settings::until(stop));
        schedule.measurable = Measurable { rounding: true, cut_paths: true, primitives: 1 };
        assert!(
            (schedule.noise_target(target) - 0.27f64.sqrt()).abs() < 1e-9 && !schedule.is_probed()
        );
        let pixels = 256.0;
        let difference = |levels: f64| PairedDifference {
            product: pixels * levels * levels,
            product_squares: pixels * levels.powi(4),
            ..PairedDifference::default()
        };
        let (rounding, cut) = (difference(0.1), difference(0.08));
        let sums = ProbeSums { packets: 16, pixels: 256, rounding, cut, ..ProbeSums::default() };
        let doublings = [8.0, 2.0];
        schedule.record_probe(&ProbeSums { doublings, ..sums });
        // The rest of the doublings, 2 (0.25 / 0.75) of 10, raises the bound to 0.08 (1 + 1 / 15).
        let rest: f64 = 0.6 - 0.08 * 16.0 / 15.0;
        let noise = (rest * rest - 0.01 - 0.09).sqrt();
        assert!((schedule.noise_target(target) - noise).abs() < 1e-9 && schedule.is_probed());
        assert!((schedule.excessive_rounding().unwrap() - 0.1).abs() < 1e-9);
        schedule.probe.doublings = [8.0, 8.0];
        assert_eq!(schedule.probed_parts().1, Some(f64::INFINITY));
        assert!((schedule.noise_target(target) - 0.27f64.sqrt()).abs() < 1e-9);
    }
}
