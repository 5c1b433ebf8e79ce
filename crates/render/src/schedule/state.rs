//! Encoding of a schedule's state as bytes, from which a later process continues.
//!
//! All numbers are little-endian. A list starts with its length (u32); an option starts with 0
//! (`None`) or 1 (u8). The parts are, in this order:
//!
//! - the criterion (u8), the numbers of samples and rays (u64 each), and the sample count of the
//!   latest estimate in a uniform round (u32);
//! - 1 if the current round ends with an estimate, otherwise 0 (u8), and the current replicate
//!   (u8);
//! - the noise of the picture, the sums of the error probes with the number of samples at the
//!   latest one, and the points of the convergence fit;
//! - the jobs of the current round, its jobs that remain to be traced, and the tiles;
//! - an option of the same parts for the render whose round a stop criterion has cut off.

use crate::error_probe::{PairedDifference, ProbeSums};
use crate::film::file::{Fields, estimate_record};
use crate::film::{ByMeasure, Noise, TileNoise};
use crate::schedule::tile::Tile;
use crate::schedule::{Criterion, MAX_SAMPLES, Schedule};
use crate::wave::Job;

impl Schedule {
    /// Encodes everything on which the next samples depend, except for the settings.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.push(u8::from(self.settings.criterion == Criterion::Linear));
        out.extend(self.samples.to_le_bytes());
        out.extend(self.rays.to_le_bytes());
        out.extend(self.estimated_at.to_le_bytes());
        out.extend([u8::from(self.estimate), self.replicate as u8]);
        out.push(u8::from(self.noise.is_some()));
        if let Some(noise) = self.noise {
            by_measure(noise.rmse, &mut out);
            floats(&[noise.p95_levels], &mut out);
            by_measure(noise.effective_pixels, &mut out);
        }
        encode_probe(&self.probe, &mut out);
        out.extend(self.probed_at.to_le_bytes());
        length(self.convergence.points.len(), &mut out);
        self.convergence.points.iter().for_each(|(rays, noise)| floats(&[*rays, *noise], &mut out));
        for jobs in [&self.round, &self.remaining] {
            length(jobs.len(), &mut out);
            for job in jobs {
                [job.tile, job.first, job.count].iter().for_each(|n| out.extend(n.to_le_bytes()));
            }
        }
        length(self.tiles.len(), &mut out);
        for tile in &self.tiles {
            out.extend(tile.done.to_le_bytes());
            out.extend(tile.rays.to_le_bytes());
            out.push(u8::from(tile.glossy));
            out.push(u8::from(tile.error.is_some()));
            tile.error.iter().for_each(|estimate| estimate_record::encode(estimate, &mut out));
            out.push(tile.history.len() as u8);
            tile.history.iter().for_each(|estimate| estimate_record::encode(estimate, &mut out));
        }
        out.push(u8::from(self.interrupted.is_some()));
        self.interrupted.iter().for_each(|whole| out.extend(whole.encode()));
        out
    }

    /// Restores an encoded state into a new schedule of the same film, whose tiles hold `counts`
    /// samples per pixel in each replicate. The noise estimates are discarded if the criterion
    /// differs. Returns `None` if the state is not valid or does not belong to the film; the
    /// schedule may then have changed.
    pub fn restore(&mut self, state: &[u8], counts: &[[u32; 2]]) -> Option<()> {
        let mut fields = Fields::new(state);
        let criterion = self.decode(&mut fields, true)?;
        if counts.len() != self.tiles.len() {
            return None;
        }
        for (tile, [a, b]) in self.tiles.iter().zip(counts) {
            if tile.done != *b || a < b || *a > MAX_SAMPLES {
                return None;
            }
        }
        let traced = |job: &Job| counts[job.tile as usize][self.replicate] == job.first;
        if !fields.is_empty() || !self.remaining.iter().all(traced) {
            return None;
        }
        if criterion != self.settings.criterion {
            self.forget_estimates();
        }
        Some(())
    }

    /// Decodes a state into a new schedule of the same film. If `cut` is `false`, its round must not
    /// be cut off. Returns the criterion.
    fn decode(&mut self, fields: &mut Fields, cut: bool) -> Option<Criterion> {
        let new = self.clone();
        let criterion = if flag(fields)? { Criterion::Linear } else { Criterion::Levels };
        (self.samples, self.rays) = (fields.u64()?, fields.u64()?);
        self.estimated_at = fields.u32()?;
        self.estimate = flag(fields)?;
        self.replicate = usize::from(flag(fields)?);
        if flag(fields)? {
            self.noise = Some(Noise {
                rmse: decode_by_measure(fields)?,
                p95_levels: error(fields)?,
                effective_pixels: decode_by_measure(fields)?,
            });
        }
        (self.probe, self.probed_at) = (decode_probe(fields)?, fields.u64()?);
        let points = fields.u32()?;
        let point = |_| Some((error(fields)?, error(fields)?));
        self.convergence.points = (0..points).map(point).collect::<Option<_>>()?;
        self.round = self.decode_jobs(fields)?;
        self.remaining = self.decode_jobs(fields)?;
        if fields.u32()? as usize != self.tiles.len() {
            return None;
        }
        for tile in &mut self.tiles {
            decode_tile(tile, fields)?;
        }
        if flag(fields)? {
            let mut whole = new;
            if !cut {
                return None;
            }
            whole.decode(fields, false)?;
            self.interrupted = Some(Box::new(whole));
        }
        Some(criterion)
    }

    /// Decodes a list of jobs with different tiles.
    fn decode_jobs(&self, fields: &mut Fields) -> Option<Vec<Job>> {
        let mut seen = vec![false; self.tiles.len()];
        let jobs = fields.u32()?;
        let mut job = || {
            let job = Job { tile: fields.u32()?, first: fields.u32()?, count: fields.u32()? };
            let is_new = !std::mem::replace(seen.get_mut(job.tile as usize)?, true);
            let end = job.first.checked_add(job.count)?;
            (is_new && job.count > 0 && end <= MAX_SAMPLES).then_some(job)
        };
        (0..jobs).map(|_| job()).collect()
    }
}

fn decode_tile(tile: &mut Tile, fields: &mut Fields) -> Option<()> {
    (tile.done, tile.rays) = (fields.u32()?, fields.u64()?);
    tile.glossy = flag(fields)?;
    tile.error = if flag(fields)? { Some(decode_estimate(tile.pixels, fields)?) } else { None };
    let estimates = fields.u8()?;
    let estimate = |_| decode_estimate(tile.pixels, fields);
    tile.history = (0..estimates).map(estimate).collect::<Option<_>>()?;
    Some(())
}

fn decode_estimate(pixels: u32, fields: &mut Fields) -> Option<TileNoise> {
    estimate_record::decode(fields).filter(|estimate| estimate.pixels == pixels)
}

fn encode_probe(sums: &ProbeSums, out: &mut Vec<u8>) {
    out.extend(sums.packets.to_le_bytes());
    out.extend(sums.pixels.to_le_bytes());
    out.extend(sums.cost.to_le_bytes());
    for PairedDifference { product, product_squares, variance, mean } in [sums.rounding, sums.cut] {
        floats(&[product, product_squares, variance, mean], out);
    }
    floats(&sums.doublings, out);
}

fn decode_probe(fields: &mut Fields) -> Option<ProbeSums> {
    let (packets, pixels, cost) = (fields.u32()?, fields.u32()?, fields.u64()?);
    let mut difference = || {
        Some(PairedDifference {
            product: fields.f64()?,
            product_squares: fields.f64()?,
            variance: fields.f64()?,
            mean: fields.f64()?,
        })
    };
    let (rounding, cut) = (difference()?, difference()?);
    Some(ProbeSums {
        packets,
        pixels,
        cost,
        rounding,
        cut,
        doublings: [fields.f64()?, fields.f64()?],
    })
}

fn length(length: usize, out: &mut Vec<u8>) {
    out.extend((length as u32).to_le_bytes());
}

fn floats(values: &[f64], out: &mut Vec<u8>) {
    values.iter().for_each(|value| out.extend(value.to_le_bytes()));
}

fn by_measure(ByMeasure { linear, levels }: ByMeasure, out: &mut Vec<u8>) {
    floats(&[linear, levels], out);
}

fn decode_by_measure(fields: &mut Fields) -> Option<ByMeasure> {
    Some(ByMeasure { linear: error(fields)?, levels: error(fields)? })
}

/// Decodes an estimated error, which is infinite or NaN in extreme pictures, but not negative.
fn error(fields: &mut Fields) -> Option<f64> {
    fields.f64().filter(|value| value.is_nan() || *value >= 0.0)
}

fn flag(fields: &mut Fields) -> Option<bool> {
    fields.u8().filter(|flag| *flag < 2).map(|flag| flag == 1)
}
