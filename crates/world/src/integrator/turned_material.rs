//! Material that has become rougher, with a lobe in two parts: the former lobe p, with the share a,
//! and the rest q. The whole lobe is p' = a p + (1 - a) q.
//!
//! A product of m whole lobes without a^M p..p, for m <= M, is a sum of products without negative
//! terms: for each k < M the first k lobes are p, the next one is q and the others are p', with the
//! factor (1 - a) a^k. Each sample of order M chooses k at random, in proportion to a^k.

use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::path::{MAX_ORDER, Radiance};
use zerkalo_kernel::lanes::{Mask, SimdFloat};
use zerkalo_kernel::sampling::PacketSampler;

/// Divided lobe of a material.
pub struct TurnedMaterial {
    /// Index of the BSDF with the whole lobe.
    pub index: u32,
    /// Index of the BSDF with the rest q; that with the former lobe p follows it.
    pub parts: u32,
    /// Share a of the former lobe.
    pub share: f64,
    /// Order M of the samples that are traced; 0 for samples of the whole lobe.
    pub order: usize,
}

impl TurnedMaterial {
    /// Counts the reflections at the material, and chooses the part of its lobe in each lane.
    #[inline(never)]
    pub(crate) fn divide<L: SimdFloat>(
        &self,
        interaction: &mut SurfaceInteraction<L>,
        sampler: &PacketSampler<'_, L>,
        out: &mut Radiance<L>,
    ) {
        let own =
            interaction.bsdfs(interaction.reflecting).find(|(i, _)| *i == self.index as usize);
        let Some((_, lanes)) = own else { return };
        let number = if self.order > 1 { sampler.reservoir_1d(0) } else { L::zero() };
        let sum: f64 = (0..self.order as i32).map(|k| self.share.powi(k)).sum();
        let mut remaining = lanes;
        let mut below = 0.0;
        // Lanes whose choice k is at least the number of earlier reflections, and more than it.
        let mut chosen_from = L::mask(true);
        for reflection in 0..=MAX_ORDER {
            let again = match out.met.get(reflection) {
                Some(met) => remaining & *met,
                None => L::mask(false),
            };
            let now = remaining.and_not(again);
            if now.any() {
                out.counts.meetings = out.counts.meetings.max(reflection as u8 + 1);
            }
            if let Some(met) = out.met.get_mut(reflection) {
                *met = *met | now;
            }
            if reflection < self.order {
                below += self.share.powi(reflection as i32) / sum;
                let later = match reflection + 1 < self.order {
                    true => chosen_from.and_not(number.lt(L::from_f64(below))),
                    false => L::mask(false),
                };
                let rest = now & chosen_from.and_not(later);
                let part = |i: u32| L::from_id(self.parts + i);
                interaction.bsdf = L::select(rest, part(0), interaction.bsdf);
                interaction.bsdf = L::select(now & later, part(1), interaction.bsdf);
                chosen_from = later;
            }
            remaining = again;
        }
    }
}
