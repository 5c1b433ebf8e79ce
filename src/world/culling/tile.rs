//! What the rays of one part of the picture may meet: the things that its camera rays see, and those
//! that may stand between what they see and a light. Most parts see one or two things, and nothing
//! shades them: the others are never asked.

use crate::camera::View;
use crate::lanes::{Lanes, Real};
use crate::light::Lamp;
use crate::primitive::{Ball, Bound, Form, Geometry, Pencil, Selection, Towards};
use crate::world::culling::light_buffer::{LightBuffer, Occluder};
use crate::world::culling::screen_grid::{Cells, Rectangle};
use glam::DVec3;

/// The things that some camera rays and the shadow rays from where they end may meet.
#[derive(Clone, Debug)]
pub struct Outlook {
    /// What the camera rays may meet.
    pub(crate) seen: Selection,
    /// For each light of the world, what shadow rays may meet.
    pub(crate) shading: Vec<Selection>,
}

impl Outlook {
    /// Everything, for `lamps` lights.
    pub(crate) fn everything<L: Lanes>(geometry: &Geometry<L>, lamps: usize) -> Self {
        Self { seen: geometry.all().clone(), shading: vec![geometry.all().clone(); lamps] }
    }
}

/// How the rays of a part of the picture are kept from things that they cannot meet.
pub(crate) enum Culling {
    /// By a pencil of lines from the eye, and what stands between it and the lights.
    Pencils(Surroundings),
    /// By rectangles on the screen.
    Rectangles(Vec<Rectangle>),
    /// By lists of the few things of a tree that are seen in each part of the screen.
    Cells(Cells),
    /// Not at all, or by the geometry itself.
    Nothing,
}

impl Culling {
    /// What camera rays through a rectangle of the raster may meet, and the shadow rays from where they
    /// end, to `lamps` lights; `None`: nothing is ruled out.
    pub fn outlook<L: Lanes>(
        &self,
        geometry: &Geometry<L>,
        lamps: usize,
        view: &View,
        (origin, extent): ([usize; 2], [usize; 2]),
    ) -> Option<Outlook> {
        match self {
            Self::Pencils(surroundings) => {
                let [_, _, forward] = view.frame();
                let corners = view.corners(origin, extent);
                let pencil = Pencil { apex: view.eye(), forward, corners };
                Some(surroundings.outlook(geometry, Some(&pencil)))
            }
            Self::Rectangles(of) => {
                let seen = geometry.select(|item| of[item as usize].overlaps(origin, extent));
                Some(Outlook { seen, ..Outlook::everything(geometry, lamps) })
            }
            Self::Cells(cells) => {
                let seen = geometry.select_few(&cells.seen(origin, extent)?);
                Some(Outlook { seen, ..Outlook::everything(geometry, lamps) })
            }
            Self::Nothing => None,
        }
    }
}

/// What outlooks are found from.
pub(crate) struct Surroundings {
    /// For each item of the geometry.
    bounds: Vec<Bound>,
    /// For each item: paths may be inside it, so that it may shade itself.
    hollow: Vec<bool>,
    /// For each light.
    towards: Vec<Towards>,
}

impl Surroundings {
    /// `eye`: where paths begin; `None`: not known. `entered`: for each item, whether paths get inside
    /// it. `off_lamps`: how far from the lamps shadow rays end at most.
    pub fn new<S: Real>(
        forms: Vec<&Form>,
        eye: Option<DVec3>,
        entered: &[bool],
        (lamps, off_lamps): (&[Lamp<S>], f64),
    ) -> Self {
        let bound = |form: &Form| Bound::new(form).grown(off_lamps);
        let bounds: Vec<Bound> = forms.into_iter().map(bound).collect();
        let vector = |v: &[S; 3]| DVec3::from(v.map(S::to_f64));
        let towards = lamps.iter().map(|lamp| match lamp {
            Lamp::Falling { position } | Lamp::Even { position } => {
                Towards::Point(vector(position))
            }
            Lamp::Directional { towards } => Towards::Direction(vector(towards)),
        });
        // The outside of a convex thing does not see itself, and only paths that begin inside, or are
        // let in, get inside.
        let hollow = |(b, entered): (&Bound, &bool)| {
            let holds_eye = || eye.is_none_or(|eye| b.ball().holds(eye));
            !b.is_convex() || !b.is_flat() && (*entered || holds_eye())
        };
        let hollow = bounds.iter().zip(entered).map(hollow).collect();
        Self { towards: towards.collect(), hollow, bounds }
    }

    /// For each light what shadow rays to it meet of the things in the geometry's tree.
    pub fn light_buffers<L: Lanes>(
        &self,
        geometry: &Geometry<L>,
    ) -> Vec<Option<LightBuffer<L::Scalar>>> {
        let occluder = |item: u32| Occluder {
            ball: self.bounds[item as usize].ball(),
            own: (!self.hollow[item as usize]).then_some(item),
        };
        let occluders: Vec<Occluder> = geometry.in_tree().into_iter().map(occluder).collect();
        self.towards.iter().map(|towards| LightBuffer::new(towards, &occluders)).collect()
    }

    /// The outlook of camera rays inside `pencil`; `None`: of any rays.
    pub fn outlook<L: Lanes>(&self, geometry: &Geometry<L>, pencil: Option<&Pencil>) -> Outlook {
        let part = |bound: &Bound| match pencil {
            Some(pencil) => bound.part_in(pencil),
            None => Some(bound.ball()),
        };
        let parts: Vec<Option<Ball>> = self.bounds.iter().map(part).collect();
        let seen = geometry.select(|item| parts[item as usize].is_some());
        let shades = |item: usize, towards: &Towards| {
            let lit = |(other, part): (usize, &Option<Ball>)| {
                part.is_some_and(|part| {
                    (other != item || self.hollow[item]) && self.bounds[item].shades(&part, towards)
                })
            };
            parts.iter().enumerate().any(lit)
        };
        let of_light = |towards| geometry.select(|item| shades(item as usize, towards));
        Outlook { seen, shading: self.towards.iter().map(of_light).collect() }
    }
}
