//! History of pictures, with one of which the live picture is compared.

use std::sync::Arc;
use std::time::Duration;
use zerkalo_render::film::LinearImage;

/// Largest number of kept pictures.
const MOST: usize = 6;

#[derive(Clone, Debug)]
pub struct KeptPicture {
    pub image: Arc<LinearImage>,
    /// Mean number of samples per pixel.
    pub spp: f64,
    /// Estimated error, if known.
    pub noise_levels: Option<f64>,
    /// Generation of the picture in its session.
    pub generation: u64,
    /// Label of the last undo step of its scene.
    pub step: String,
    /// `true` if the user has kept it.
    pub is_pinned: bool,
}

impl KeptPicture {
    pub fn description(&self) -> String {
        let noise =
            self.noise_levels.map_or(String::new(), |levels| format!(", noise {levels:.2}"));
        format!("{:.0} spp{noise}, {}", self.spp, self.step)
    }
}

#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// Pictures, the newest first.
    pub kept: Vec<KeptPicture>,
    /// Index of the picture that the user has chosen to compare with.
    pub chosen: Option<usize>,
    /// Border between the pictures in a wipe, in widths of the picture from its middle.
    pub border: f64,
    /// Label of the last undo step of the live picture; `None` before the first change.
    pub step: Option<String>,
    /// Time since which the live picture is rendered.
    pub since: Duration,
    /// Generation of the last picture that was kept because it had converged.
    pub converged: u64,
}

impl Pictures {
    /// Adds a picture. It replaces one of the same generation unless the user has pinned that.
    pub fn add(&mut self, picture: KeptPicture) {
        if picture.is_pinned {
            self.chosen = Some(0);
        }
        match self.kept.first_mut() {
            Some(last) if !last.is_pinned && last.generation == picture.generation => {
                *last = picture;
            }
            _ => {
                let was_chosen = self.chosen.filter(|_| !picture.is_pinned);
                self.chosen = was_chosen.map(|index| index + 1).or(self.chosen);
                self.kept.insert(0, picture);
            }
        }
        if self.kept.len() > MOST {
            let is_last = self.chosen == Some(MOST);
            self.kept.remove(if is_last { MOST - 1 } else { MOST });
            self.chosen = if is_last { Some(MOST - 1) } else { self.chosen };
        }
    }

    /// Returns the picture that is compared with the live one of generation `live`: the chosen one,
    /// or else the newest of another generation.
    pub fn compared(&self, live: u64) -> Option<&KeptPicture> {
        let chosen = self.chosen.and_then(|index| self.kept.get(index));
        let other = || self.kept.iter().find(|picture| picture.generation != live);
        chosen.or_else(other).or(self.kept.first())
    }
}
