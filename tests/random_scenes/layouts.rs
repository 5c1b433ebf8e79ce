//! Arrangement of the objects of a random scene.

use crate::harness::*;
use crate::random_scenes::objects::{Finish, Stock, combined, named, object, resolved};
use crate::random_scenes::words::{chance, log, pick};

/// Kind of arrangement of the objects of a random scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    /// Objects in contact: on a floor, side by side, on top of each other.
    Contact,
    /// Objects of all sizes anywhere, from few to hundreds.
    Crowd,
    /// Nested compounds whose parts have different materials.
    Compounds,
    Glass,
    /// Facing mirrors with objects between them.
    Mirrors,
    /// Mostly empty picture: stars, hairlines, a distant crowd, a distant chessboard.
    Sparse,
    Flat,
    /// Positions and sizes from 1e-6 to 1e6.
    Wild,
}

impl Layout {
    pub const ALL: [Self; 8] = [
        Self::Contact,
        Self::Crowd,
        Self::Compounds,
        Self::Glass,
        Self::Mirrors,
        Self::Sparse,
        Self::Flat,
        Self::Wild,
    ];

    /// Returns the kinds of materials that the arrangement uses.
    pub fn finishes(self) -> &'static [Finish] {
        use Finish::{Any, Glass, Glowing, Mirror};
        match self {
            Self::Contact => &[Any, Any, Glass, Mirror],
            Self::Crowd | Self::Wild | Self::Flat => &[Any, Any, Any, Glass, Mirror],
            Self::Compounds => &[Any, Any, Mirror, Glass],
            Self::Glass => &[Glass, Glass, Glass, Any],
            Self::Mirrors => &[Mirror, Mirror, Any],
            Self::Sparse => &[Glowing, Glowing, Any, Mirror],
        }
    }

    /// Returns random objects around the origin, most of them within a distance of 4.
    pub fn objects(self, numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
        match self {
            Self::Contact => contact(numbers, stock),
            Self::Crowd => crowd(numbers, stock),
            Self::Compounds => compounds(numbers, stock),
            Self::Glass => glass(numbers, stock),
            Self::Mirrors => mirrors(numbers, stock),
            Self::Sparse => sparse(numbers, stock),
            Self::Flat => flat(numbers, stock),
            Self::Wild => wild(numbers, stock),
        }
    }
}

fn somewhere(numbers: &mut Numbers, half: f64) -> DVec3 {
    numbers.in_cube(half)
}

fn untransformed(mut object: Object) -> Object {
    object.transform.clear();
    object
}

/// Returns a random floor at y = 0: plane, platform, box or cylinder.
fn floor(numbers: &mut Numbers, stock: &Stock) -> Object {
    let (key, base, size) = match numbers.below(4) {
        0 => ("plane", DVec3::ZERO, DVec3::ONE),
        1 => ("platform", DVec3::NEG_Y, DVec3::new(8.0, 1.0, 8.0)),
        2 => ("box", DVec3::new(0.0, -0.5, 0.0), DVec3::new(8.0, 0.5, 8.0)),
        _ => ("cylinder", DVec3::new(0.0, -0.5, 0.0), DVec3::new(8.0, 0.5, 8.0)),
    };
    let mut object = untransformed(named(numbers, stock, key, base, size));
    object.shape = Shape::fitted_to(key, base, size).expect("a registered kind");
    object
}

/// Returns a floor, and random objects in cells of a unit grid on two levels, at most one in a
/// cell.
fn contact(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let mut all = vec![floor(numbers, stock)];
    let mut cells: Vec<DVec3> = Vec::new();
    for _ in 0..3 + numbers.below(6) {
        let mut cell = |n: usize| numbers.below(n) as f64;
        let base = DVec3::new(cell(3) - 1.0, if cell(4) == 0.0 { 1.0 } else { 0.0 }, cell(3) - 1.0);
        let candidate = object(numbers, stock, base, DVec3::ONE);
        if !cells.contains(&base) && resolved(&candidate).form().bounds().is_some() {
            cells.push(base);
            all.push(candidate);
        }
    }
    if chance(numbers, 1, 2) {
        let shift = numbers.below(all.len());
        all.rotate_left(shift);
    }
    all
}

fn crowd(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let count = pick(numbers, &[3, 8, 20, 60, 130, 250]);
    let random_object = |_| {
        let size = log(numbers, 0.1, 2.5);
        let base = somewhere(numbers, 4.0);
        object(numbers, stock, base, DVec3::splat(size))
    };
    (0..count).map(random_object).collect()
}

fn compounds(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let mut all = Vec::new();
    if chance(numbers, 1, 2) {
        all.push(floor(numbers, stock));
    }
    for _ in 0..1 + numbers.below(3) {
        let base = DVec3::new(numbers.between(-2.0, 2.0), 0.0, numbers.between(-2.0, 2.0));
        let mut whole = object(numbers, stock, base, DVec3::splat(2.0));
        if chance(numbers, 2, 3) {
            whole.shape = combined(numbers, base, DVec3::splat(2.0), stock.materials, stock.levels);
            whole.transform.clear();
        }
        all.push(whole);
    }
    all
}

/// Returns random nested solids, and panes.
fn glass(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let mut all = vec![floor(numbers, stock)];
    for _ in 0..1 + numbers.below(3) {
        let base = DVec3::new(numbers.between(-1.5, 1.5), 0.0, numbers.between(-1.5, 1.5));
        let mut size = DVec3::splat(2.0);
        for _ in 0..1 + numbers.below(3) {
            all.push(object(numbers, stock, base, size));
            size *= pick(numbers, &[1.0, 0.9, 0.5]);
        }
    }
    all
}

/// Returns mirrors on both sides, and random objects between them.
fn mirrors(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let mut all = vec![floor(numbers, stock)];
    for side in [-1.0, 1.0] {
        let key = pick(numbers, &["rectangle", "box", "plane", "sphere"]);
        let size = DVec3::new(4.0, 3.0, 0.1);
        all.push(named(numbers, stock, key, DVec3::new(0.0, 0.0, 2.5 * side), size));
    }
    for _ in 0..1 + numbers.below(4) {
        let base = DVec3::new(numbers.between(-1.5, 1.5), 0.0, numbers.between(-1.5, 1.5));
        let size = log(numbers, 0.2, 1.0);
        all.push(object(numbers, stock, base, DVec3::splat(size)));
    }
    all
}

fn sparse(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let count = pick(numbers, &[2, 10, 40, 150]);
    let way = numbers.below(4);
    let random_object = |_| {
        let base = somewhere(numbers, 3.5);
        match way {
            // Small objects (stars), or thin and high ones (hairlines).
            0 | 1 => {
                let thin = log(numbers, 0.01, 0.1);
                let size = DVec3::new(thin, if way == 0 { thin } else { 3.0 }, thin);
                let key = pick(numbers, &["sphere", "box", "cylinder", "rectangle"]);
                named(numbers, stock, key, base, size)
            }
            2 => object(numbers, stock, base, DVec3::splat(0.05)),
            // A distant platform; with a checker texture it is a chessboard.
            _ => {
                let size = DVec3::new(8.0, 0.05, 100.0);
                named(numbers, stock, "platform", DVec3::new(base.x, -1.0, -40.0), size)
            }
        }
    };
    (0..if way == 3 { 1 } else { count }).map(random_object).collect()
}

/// Returns random flat objects and flat faces in the plane y = 0, seen from both sides.
fn flat(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let count = 2 + numbers.below(4);
    let random_object = |_| {
        let base = DVec3::new(numbers.between(-1.5, 1.5), 0.0, numbers.between(-1.5, 1.5));
        let size = DVec3::splat(pick(numbers, &[1.0, 2.0]));
        let key = pick(numbers, &["platform", "plane", "box", "mesh", "mesh", "cylinder", "cube"]);
        let below = if key == "platform" { base - DVec3::Y * size.y } else { base };
        let mut object = named(numbers, stock, key, below, size);
        if chance(numbers, 1, 4) {
            object.transform.push(TransformOp::Scale(Scale([1.0, -1.0, 1.0])));
        }
        object
    };
    (0..count).map(random_object).collect()
}

/// Returns random objects with log-uniform positions and sizes from 1e-6 to 1e6.
fn wild(numbers: &mut Numbers, stock: &Stock) -> Vec<Object> {
    let mut all = Vec::new();
    for _ in 0..1 + numbers.below(6) {
        let base = DVec3::from_array([(); 3].map(|()| match numbers.below(5) {
            0 => 0.0,
            1 | 2 => log(numbers, 1e-6, 1e6),
            _ => -log(numbers, 1e-6, 1e6),
        }));
        let size = log(numbers, 1e-6, 1e6);
        let mut stretch = || pick(numbers, &[1.0, 1.0, 0.01]);
        let size = size * DVec3::new(stretch(), stretch(), stretch());
        all.push(object(numbers, stock, base, size));
    }
    all
}
