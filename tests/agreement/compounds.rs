//! Compounds of the reference tracer. At each crossing of a part's surface, point tests just in
//! front and just behind decide if the ray enters or leaves the compound.

use crate::agreement::meshes::Triangles;
use crate::agreement::paint::{Canvas, Spot};
use crate::agreement::surfaces::{Piece, map, pieces};
use glam::{DAffine3, DMat3, DVec3};
use zerkalo::scene::Object;
use zerkalo::shape::{CsgOperand, Shape};

/// Simple shape: its pieces or triangles, and the transforms between its own coordinates and those
/// of the scene.
pub struct Leaf {
    pub pieces: Vec<Piece>,
    pub mesh: Option<Triangles>,
    pub canvas: Canvas,
    /// Centre and radius of a ball around all pieces of the shape; `None` for an infinite shape or
    /// a mesh.
    ball: Option<(DVec3, f64)>,
    own_from_scene: DAffine3,
    /// Matrix that maps normals from the shape's own coordinates to those of the scene: the inverse
    /// transpose of the transform.
    scene_from_own_normals: DMat3,
    own_from_scene_normals: DMat3,
    /// Name of the shape's material.
    pub material: String,
}

/// Tree of set operations (CSG) over the simple shapes of a compound.
enum Tree {
    Leaf(usize),
    Union(Vec<Tree>),
    Intersection(Vec<Tree>),
    Difference(Vec<Tree>),
}

/// Object of the scene: its simple shapes, and the tree of set operations that combines them.
pub struct Body {
    pub leaves: Vec<Leaf>,
    tree: Tree,
}

/// Distance of the two tested points, before and behind a crossing, from the crossing. The unit is
/// the length of the ray's direction.
const ASIDE: f64 = 1e-7;

/// Hit of a ray on an object: distance, normal, index of the simple shape, and index of the
/// triangle.
type Meeting = (f64, DVec3, usize, usize);

impl Leaf {
    /// Returns all crossings of a line with the surface: distance, normal in the shape's own
    /// coordinates, and index of the triangle.
    fn crossings(
        &self,
        origin: DVec3,
        direction: DVec3,
    ) -> impl Iterator<Item = (f64, DVec3, usize)> {
        let origin = self.own_from_scene.transform_point3(origin);
        let direction = self.own_from_scene.transform_vector3(direction);
        let missed = self.ball.is_some_and(|(center, radius)| {
            // Squared distance of the line from the centre.
            let (a, f) = (direction.length_squared(), center - origin);
            f.length_squared() - f.dot(direction).powi(2) / a > radius * radius
        });
        let pieces = if missed { &[][..] } else { &self.pieces[..] };
        let hits = pieces.iter().flat_map(move |piece| piece.meet(origin, direction));
        let hits = hits.flatten().map(|(t, n)| (t, n, 0));
        let mesh_hits = self.mesh.iter().flat_map(move |mesh| mesh.meet(origin, direction));
        hits.chain(mesh_hits)
    }

    /// Returns the interpolated normal of triangle `i` at `point`. Returns `None` for flat shading.
    pub fn smooth(&self, i: usize, point: DVec3) -> Option<DVec3> {
        let own = self.mesh.as_ref()?.smooth(i, self.own_from_scene.transform_point3(point))?;
        Some(self.scene_from_own_normals * own)
    }

    /// Returns the colour of triangle `i` in its file.
    pub fn color(&self, i: usize) -> DVec3 {
        self.mesh.as_ref().map_or(DVec3::ONE, |mesh| mesh.color(i))
    }

    /// Converts a point of the scene and its outward normal to the shape's own coordinates.
    pub fn spot(&self, facet: usize, point: DVec3, outer: DVec3) -> Spot<'_> {
        let point = self.own_from_scene.transform_point3(point);
        Spot { leaf: self, facet, point, normal: self.own_normal(outer) }
    }

    /// Returns the transform from the shape's own coordinates to those of the scene.
    pub fn scene_from_own(&self) -> DAffine3 {
        self.own_from_scene.inverse()
    }

    /// Converts a normal of the scene to the shape's own coordinates.
    pub fn own_normal(&self, normal: DVec3) -> DVec3 {
        (self.own_from_scene_normals * normal).normalize()
    }

    /// Converts a normal in the shape's own coordinates to those of the scene.
    pub fn scene_normal(&self, own: DVec3) -> DVec3 {
        (self.scene_from_own_normals * own).normalize()
    }

    fn contains(&self, point: DVec3) -> bool {
        let point = self.own_from_scene.transform_point3(point);
        self.pieces.iter().all(|piece| piece.is_behind(point))
    }
}

impl Body {
    /// Creates the body of `object`.
    ///
    /// # Errors
    ///
    /// Names a shape that the reference tracer does not support.
    pub fn new(object: &Object) -> Result<Self, String> {
        let place = object.transform.iter().fold(DAffine3::IDENTITY, |all, step| map(step) * all);
        let mut leaves = Vec::new();
        let tree = grow(&object.shape, &object.material, place, &mut leaves)?;
        Ok(Self { leaves, tree })
    }

    /// Returns the closest hit of a ray beyond the distance `from`: distance, unit normal, index of
    /// the simple shape, and index of the triangle. The normal points outwards on a solid, and to
    /// the front on a flat shape or a mesh. Distances are in lengths of `direction`.
    pub fn meet(&self, origin: DVec3, direction: DVec3, from: f64) -> Option<Meeting> {
        let mut nearest: Option<Meeting> = None;
        for (i, leaf) in self.leaves.iter().enumerate() {
            for (t, normal, facet) in leaf.crossings(origin, direction) {
                if t <= from || nearest.is_some_and(|n| n.0 <= t) {
                    continue;
                }
                let normal = leaf.scene_normal(normal);
                if matches!(self.tree, Tree::Leaf(_)) {
                    nearest = Some((t, normal, i, facet));
                    continue;
                }
                let inside = |t: f64| self.contains(&self.tree, origin + direction * t);
                let (before, after) = (inside(t - ASIDE), inside(t + ASIDE));
                if before != after {
                    let outward = after == (normal.dot(direction) < 0.0);
                    nearest = Some((t, if outward { normal } else { -normal }, i, facet));
                }
            }
        }
        nearest
    }

    /// Returns the only simple shape of an object that is no compound. Returns `None` for a
    /// compound.
    pub fn simple(&self) -> Option<&Leaf> {
        matches!(self.tree, Tree::Leaf(_)).then(|| &self.leaves[0])
    }

    /// Returns `true` if the object is a mesh, which has no defined inside.
    pub fn is_mesh(&self) -> bool {
        self.leaves[0].mesh.is_some()
    }

    /// Returns `true` if one of the object's simple shapes is a torus.
    pub fn has_torus(&self) -> bool {
        let mut pieces = self.leaves.iter().flat_map(|leaf| &leaf.pieces);
        pieces.any(|piece| matches!(piece, Piece::Torus(..)))
    }

    /// Returns `true` if the object is flat, so that it has no inside.
    pub fn is_open(&self) -> bool {
        let pieces = &self.leaves[0].pieces;
        matches!(self.tree, Tree::Leaf(_))
            && matches!(pieces[..], [Piece::Polygon(..)] | [Piece::Plane(..)])
    }

    /// Returns `true` if `point` is inside of the object.
    pub fn holds(&self, point: DVec3) -> bool {
        self.contains(&self.tree, point)
    }

    fn contains(&self, tree: &Tree, point: DVec3) -> bool {
        let inside = |tree: &Tree| self.contains(tree, point);
        match tree {
            Tree::Leaf(i) => self.leaves[*i].contains(point),
            Tree::Union(list) => list.iter().any(inside),
            Tree::Intersection(list) => list.iter().all(inside),
            Tree::Difference(list) => inside(&list[0]) && !list[1..].iter().any(inside),
        }
    }
}

/// Returns centre and radius of a ball around all `pieces`. Returns `None` if there are no pieces,
/// or an infinite one.
fn ball(pieces: &[Piece]) -> Option<(DVec3, f64)> {
    let balls = pieces.iter().map(Piece::ball).collect::<Option<Vec<_>>>()?;
    let center = balls.iter().map(|ball| ball.0).sum::<DVec3>() / balls.len() as f64;
    let reaches = balls.iter().map(|ball| center.distance(ball.0) + ball.1);
    // The margin of 0.1 % is far larger than the rounding error of the line's distance from the
    // centre.
    reaches.reduce(f64::max).map(|radius| (center, 1.001 * radius))
}

fn grow(
    shape: &Shape,
    material: &str,
    scene_from_own: DAffine3,
    leaves: &mut Vec<Leaf>,
) -> Result<Tree, String> {
    let mut all = |operands: &[CsgOperand]| -> Result<Vec<Tree>, String> {
        operands
            .iter()
            .map(|part| {
                let inner =
                    part.transform.iter().fold(DAffine3::IDENTITY, |all, step| map(step) * all);
                let material = if part.material.is_empty() { material } else { &part.material };
                grow(&part.shape, material, scene_from_own * inner, leaves)
            })
            .collect()
    };
    Ok(match shape {
        Shape::Union(u) => Tree::Union(all(&u.of)?),
        Shape::Intersection(i) => Tree::Intersection(all(&i.of)?),
        Shape::Difference(d) => Tree::Difference(all(&d.of)?),
        simple => {
            let mesh = match simple {
                Shape::MeshDesc(file) => Some(Triangles::new(file)),
                _ => None,
            };
            let pieces = if mesh.is_some() { Vec::new() } else { pieces(simple)? };
            let scene_from_own_normals = scene_from_own.matrix3.inverse().transpose();
            leaves.push(Leaf {
                canvas: Canvas::new(simple, mesh.as_ref()),
                ball: ball(&pieces),
                pieces,
                mesh,
                own_from_scene: scene_from_own.inverse(),
                scene_from_own_normals,
                own_from_scene_normals: scene_from_own_normals.inverse(),
                material: material.to_string(),
            });
            Tree::Leaf(leaves.len() - 1)
        }
    })
}
