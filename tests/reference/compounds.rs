//! Compounds of the reference tracer. At each crossing of a part's surface, point tests just in
//! front and just behind decide if the ray enters or leaves the compound.

use crate::harness::*;
use crate::reference::meshes::Triangles;
use crate::reference::paint::{Canvas, Spot};
use crate::reference::surfaces::{Piece, map, pieces};

/// Simple shape: its pieces or triangles, and the transforms between its own coordinates and those
/// of the scene.
pub struct Leaf {
    pub pieces: Vec<Piece>,
    pub mesh: Option<Triangles>,
    pub canvas: Canvas,
    /// Centre and radius of a ball around all pieces of the shape, in its own coordinates; `None`
    /// for an infinite shape or a mesh.
    ball: Option<(DVec3, f64)>,
    /// Centre and radius of a ball around all pieces of the shape, in scene coordinates.
    scene_ball: Option<(DVec3, f64)>,
    own_from_scene: DAffine3,
    /// `true` if the shape's own coordinates are those of the scene.
    is_in_place: bool,
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
    /// Centre and radius of a ball around an object of one simple shape, in scene coordinates;
    /// `None` for a compound, an infinite shape or a mesh.
    ball: Option<(DVec3, f64)>,
}

/// Distance from a crossing to each of two tested points, one before and one behind it, in lengths
/// of the ray's direction.
const ASIDE: f64 = 1e-7;

/// Hit of a ray on an object: distance, normal, index of the simple shape, and index of the shape's
/// piece or triangle.
pub type Meeting = (f64, DVec3, usize, usize);

impl Leaf {
    /// Passes the crossings of a line with the surface to `take`: the distance of each, and the
    /// index of the piece or triangle.
    fn crossings(&self, origin: DVec3, direction: DVec3, mut take: impl FnMut(f64, usize)) {
        let (origin, direction) = self.own(origin, direction);
        for (i, piece) in self.pieces.iter().enumerate() {
            piece.meet(origin, direction, |t| take(t, i));
        }
        if let Some(mesh) = &self.mesh {
            mesh.meet(origin, direction, take);
        }
    }

    /// Returns the normal in scene coordinates at the crossing of a line with piece or triangle `i`
    /// at the distance `t`.
    fn normal(&self, origin: DVec3, direction: DVec3, t: f64, i: usize) -> DVec3 {
        let (origin, direction) = self.own(origin, direction);
        self.scene_normal(match &self.mesh {
            Some(mesh) => mesh.normal(i),
            None => self.pieces[i].normal(origin, direction, t),
        })
    }

    fn own(&self, origin: DVec3, direction: DVec3) -> (DVec3, DVec3) {
        let own = &self.own_from_scene;
        if self.is_in_place {
            return (origin, direction);
        }
        (own.transform_point3(origin), own.transform_vector3(direction))
    }

    /// Returns the interpolated normal of triangle `i` at `point`. Returns `None` for flat shading.
    pub fn smooth(&self, i: usize, point: DVec3) -> Option<DVec3> {
        let own = self.mesh.as_ref()?.smooth(i, self.own_from_scene.transform_point3(point))?;
        Some(self.scene_from_own_normals * own)
    }

    /// Returns the mean of the nearest points to `point` in front of the tangent planes at the
    /// corners of triangle `i`. `viewer` is the geometric normal on the viewer's side.
    pub fn lifted(&self, i: usize, point: DVec3, viewer: DVec3) -> DVec3 {
        let own = self.own_from_scene.transform_point3(point);
        let ends = self.mesh.as_ref().and_then(|mesh| mesh.ends(i, own));
        let (Some(ends), Some(smooth)) = (ends, self.smooth(i, point)) else { return point };
        let to_viewer = smooth.dot(viewer).signum();
        let nearest = ends.map(|(share, corner, normal)| {
            let normal = self.scene_normal(normal) * to_viewer;
            let corner = self.scene_from_own().transform_point3(corner);
            (point - normal * (point - corner).dot(normal).min(0.0)) * share
        });
        let lifted = nearest.into_iter().sum::<DVec3>();
        if (lifted - point).dot(viewer) > 1e-9 { lifted } else { point }
    }

    /// Returns the colour that the mesh file gives triangle `i`; white without colours in the file.
    pub fn color(&self, i: usize) -> DVec3 {
        self.mesh.as_ref().map_or(DVec3::ONE, |mesh| mesh.color(i))
    }

    /// Converts a point of the scene and its outward normal `outer` to the shape's own coordinates.
    /// `facet` is the index of the piece or triangle that contains the point.
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

    pub fn scene_normal(&self, own: DVec3) -> DVec3 {
        (self.scene_from_own_normals * own).normalize()
    }

    fn contains(&self, point: DVec3) -> bool {
        let point = self.own_from_scene.transform_point3(point);
        let outside =
            |(center, radius): (DVec3, f64)| point.distance_squared(center) > radius * radius;
        !self.ball.is_some_and(outside) && self.pieces.iter().all(|piece| piece.is_behind(point))
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
        let ball = if let [leaf] = &leaves[..] { leaf.scene_ball } else { None };
        Ok(Self { leaves, tree, ball })
    }

    /// Returns the closest hit of a ray between the distances `from` and `end`: distance, unit
    /// normal, index of the simple shape, and index of the piece or triangle. The normal points
    /// outwards on a solid, and to the front on a flat shape or a mesh. Distances are in lengths of
    /// `direction`.
    pub fn meet(&self, origin: DVec3, direction: DVec3, from: f64, end: f64) -> Option<Meeting> {
        if misses(self.ball, origin, direction, end) {
            return None;
        }
        let (mut end, mut nearest) = (end, None);
        for (i, leaf) in self.leaves.iter().enumerate() {
            if self.leaves.len() > 1 && misses(leaf.scene_ball, origin, direction, end) {
                continue;
            }
            let normal = |t, facet| leaf.normal(origin, direction, t, facet);
            if matches!(self.tree, Tree::Leaf(_)) {
                let mut found = None;
                leaf.crossings(origin, direction, |t, facet| {
                    if t > from && t < end {
                        (end, found) = (t, Some(facet));
                    }
                });
                return found.map(|facet| (end, normal(end, facet), i, facet));
            }
            leaf.crossings(origin, direction, |t, facet| {
                if !(t > from && t < end) {
                    return;
                }
                let inside = |t: f64| self.contains(&self.tree, origin + direction * t);
                let (before, after) = (inside(t - ASIDE), inside(t + ASIDE));
                if before != after {
                    let normal = normal(t, facet);
                    let outward = after == (normal.dot(direction) < 0.0);
                    (end, nearest) =
                        (t, Some((t, if outward { normal } else { -normal }, i, facet)));
                }
            });
        }
        nearest
    }

    /// Returns the only simple shape of an object that is not a compound. Returns `None` for a
    /// compound.
    pub fn simple(&self) -> Option<&Leaf> {
        matches!(self.tree, Tree::Leaf(_)).then(|| &self.leaves[0])
    }

    /// Returns `true` if the object is a mesh, which has no defined inside.
    pub fn is_mesh(&self) -> bool {
        self.leaves[0].mesh.is_some()
    }

    /// Returns `true` if the object is flat, so that it has no inside.
    pub fn is_open(&self) -> bool {
        let pieces = &self.leaves[0].pieces;
        matches!(self.tree, Tree::Leaf(_))
            && matches!(pieces[..], [Piece::Polygon(..)] | [Piece::Plane(..)])
    }

    /// Returns `true` if `point` is inside the object.
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

/// Returns `true` if a ray does not reach `ball`, centre and radius of a ball, before the distance
/// `end`. Returns `false` without a ball.
fn misses(ball: Option<(DVec3, f64)>, origin: DVec3, direction: DVec3, end: f64) -> bool {
    ball.is_some_and(|(center, radius)| {
        // Distance to the point of the ray that is nearest to the centre.
        let (a, f) = (direction.length_squared(), center - origin);
        let nearest = (f.dot(direction) / a).clamp(0.0, end);
        (f - direction * nearest).length_squared() > radius * radius
    })
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

/// Returns an upper bound of the length to which a map stretches a unit vector: the square root of
/// the largest sum of magnitudes in a row of M^T M. It is exact for a similarity.
fn longest(map: &DMat3) -> f64 {
    let square = map.transpose() * *map;
    let rows = [square.x_axis, square.y_axis, square.z_axis];
    rows.map(|row| row.abs().element_sum()).into_iter().fold(0.0, f64::max).sqrt()
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
            let ball = ball(&pieces);
            let in_scene = |(center, radius): (DVec3, f64)| {
                let center = scene_from_own.transform_point3(center);
                (center, radius * longest(&scene_from_own.matrix3))
            };
            let scene_from_own_normals = scene_from_own.matrix3.inverse().transpose();
            leaves.push(Leaf {
                canvas: Canvas::new(simple, mesh.as_ref()),
                ball,
                scene_ball: ball.map(in_scene),
                pieces,
                mesh,
                own_from_scene: scene_from_own.inverse(),
                is_in_place: scene_from_own == DAffine3::IDENTITY,
                scene_from_own_normals,
                own_from_scene_normals: scene_from_own_normals.inverse(),
                material: material.to_string(),
            });
            Tree::Leaf(leaves.len() - 1)
        }
    })
}
