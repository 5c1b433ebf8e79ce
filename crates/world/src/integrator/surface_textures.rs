//! Textures and bump maps of primitives, and their evaluation at the hit points of a packet.

use crate::world::World;
use glam::{DAffine3, DVec3};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_kernel::primitive::{
    Aggregate, PrimitiveId, Projection, SurfacePoint, TexCoord, keep_visible,
};
use zerkalo_scene::Scene;
use zerkalo_scene::material::{
    Bump, BumpMap, CompiledTexture, Mapping, Material, Placement, Texture, TextureMapping,
};
use zerkalo_scene::shape::TextureSpace;

/// Texture and bump map of one primitive.
struct SurfaceTexture<S> {
    albedo: Option<(TextureMapping<S>, CompiledTexture<S>)>,
    bump: Option<(TextureMapping<S>, BumpMap)>,
}

/// Textures and bump maps of all primitives.
pub(crate) struct SurfaceTextures<L: SimdFloat> {
    /// Texture and bump map of each primitive; `None` for a primitive with neither. Empty if no
    /// material has a texture or a bump map.
    of_primitive: Vec<Option<SurfaceTexture<L::Scalar>>>,
}

/// Hit points of a packet on one primitive, at which textures are evaluated.
pub(crate) struct ShadingPoints<L: SimdFloat> {
    pub primitive: u32,
    /// Ids of the triangles that are hit, if the primitive is a mesh.
    pub triangle: L,
    /// Hit points, with outward normals.
    pub surface: SurfacePoint<L>,
    pub lanes: L::Mask,
}

/// Returns the projection that `mapping` selects for a shape with the texture space `space`.
fn projection(mapping: Mapping, space: &TextureSpace) -> Projection {
    match mapping {
        Mapping::Auto => space.default_mapping,
        Mapping::Uv if space.default_mapping == Projection::Planar => Projection::Planar,
        Mapping::Uv => Projection::Uv,
        Mapping::Planar => Projection::Planar,
        Mapping::Spherical => Projection::Spherical,
        Mapping::Cylindrical => Projection::Cylindrical,
        Mapping::Box => Projection::Box,
    }
}

impl<L: SimdFloat> SurfaceTextures<L> {
    /// Compiles the textures and bump maps of `primitives`, in coordinates relative to `origin`.
    pub fn new<'a>(
        scene: &Scene,
        primitives: &[PrimitiveId],
        origin: DVec3,
        material_of: impl Fn(&PrimitiveId) -> &'a Material,
    ) -> Self {
        let has_texture = |m: &Material| {
            m.texture.as_ref().is_some_and(Texture::has_effect)
                || m.bump.as_ref().is_some_and(Bump::has_effect)
        };
        if !primitives.iter().any(|id| has_texture(material_of(id))) {
            return Self { of_primitive: Vec::new() };
        }
        let world_from_scene = DAffine3::from_translation(-origin);
        let input_error = f64::EPSILON * origin.abs().max_element();
        // The texture spaces of the latest object are cached, because the primitives of an object
        // are adjacent.
        let mut spaces: (usize, Vec<TextureSpace>) = (usize::MAX, Vec::new());
        let of_primitive = primitives.iter().map(|id| {
            let material = material_of(id);
            if !has_texture(material) {
                return None;
            }
            let object = &scene.objects[id.form];
            if spaces.0 != id.form {
                spaces = (id.form, object.shape.texture_spaces());
            }
            let space = &spaces.1[id.part];
            let world_from_texture =
                world_from_scene * object.scene_from_object() * space.shape_from_texture;
            let mapping_of = |placement: &Placement| {
                let projection = projection(placement.mapping, space);
                let corners = space.corners;
                TextureMapping::new(
                    placement,
                    projection,
                    &world_from_texture,
                    corners,
                    input_error,
                )
            };
            let texture = material.texture.as_ref();
            let bump = material.bump.as_ref();
            Some(SurfaceTexture {
                albedo: texture
                    .and_then(|t| Some((mapping_of(t.placement()), CompiledTexture::new(t)?))),
                bump: bump.and_then(|b| Some((mapping_of(b.placement()), BumpMap::new(b)?))),
            })
        });
        Self { of_primitive: of_primitive.collect() }
    }

    fn textures(&self) -> impl Iterator<Item = &SurfaceTexture<L::Scalar>> {
        self.of_primitive.iter().flatten()
    }

    /// Returns `true` if the albedo of some primitive has a texture.
    pub fn is_colored(&self) -> bool {
        self.textures().any(|texture| texture.albedo.is_some())
    }

    /// Returns `true` if the normals of some primitive have a bump map.
    pub fn is_bumped(&self) -> bool {
        self.textures().any(|texture| texture.bump.is_some())
    }

    /// Returns the names of the texture features in use, for the inventory of the scene.
    pub fn features(&self) -> Vec<&'static str> {
        let albedos = || self.textures().filter_map(|texture| texture.albedo.as_ref());
        let is_image = |t: &CompiledTexture<_>| matches!(t, CompiledTexture::Image { .. });
        let mut names = Vec::new();
        names.extend(albedos().any(|(_, t)| is_image(t)).then_some("image texture"));
        names.extend(albedos().any(|(_, t)| !is_image(t)).then_some("checker"));
        names.extend(self.is_bumped().then_some("bump"));
        names
    }
}

/// Returns the texture coordinates at the hit points: the primitive's own coordinates if it has
/// some and `mapping` uses them, otherwise the coordinates of the projection.
fn coordinates<L: SimdFloat>(
    geometry: &Aggregate<L>,
    mapping: &TextureMapping<L::Scalar>,
    points: &ShadingPoints<L>,
) -> TexCoord<L> {
    let surface = &points.surface;
    if mapping.wants_uv()
        && let Some(own) = geometry.uv(points.primitive, points.triangle, surface.point)
    {
        return mapping.placed(own);
    }
    mapping.coordinates(surface.point, surface.normal)
}

fn surface_texture<L: SimdFloat>(
    world: &World<L>,
    primitive: u32,
) -> Option<&SurfaceTexture<L::Scalar>> {
    world.surface_textures.of_primitive.get(primitive as usize)?.as_ref()
}

/// Returns the factor of the albedo from vertex colour and texture; `None` if there is neither.
#[inline(never)]
pub(crate) fn albedo_factor<L: SimdFloat>(
    world: &World<L>,
    points: &ShadingPoints<L>,
) -> Option<Vec3<L>> {
    let vertex_color = world.geometry.color(points.primitive, points.triangle);
    let Some((mapping, texture)) =
        surface_texture(world, points.primitive).and_then(|texture| texture.albedo.as_ref())
    else {
        return vertex_color;
    };
    let coord = coordinates(&world.geometry, mapping, points);
    let (u, v) = if texture.has_edges() {
        let SurfacePoint { point, normal, max_coordinate } = points.surface;
        let rounding = max_coordinate.max(point.max_abs()) * L::from_f64(L::EPSILON);
        mapping.beside_edges(&coord, normal, rounding)
    } else {
        (coord.u, coord.v)
    };
    let color = texture.eval((u, v), points.lanes.bits());
    Some(vertex_color.map_or(color, |vertex_color| vertex_color.component_mul(color)))
}

/// Returns unit shading normals at the hit points of rays along `direction`: interpolated on smooth
/// meshes, perturbed by bump maps, and bent so that they face the rays. The normals are on the side
/// of `geometric`, the normal that faces the rays and points outwards in the lanes `front`. Also
/// returns the lifts of the points, see [`Aggregate::shading_normal`].
#[inline(never)]
pub(crate) fn shading_normal<L: SimdFloat>(
    world: &World<L>,
    points: &ShadingPoints<L>,
    (front, geometric): (L::Mask, Vec3<L>),
    direction: Vec3<L>,
) -> (Vec3<L>, Option<Vec3<L>>) {
    let ShadingPoints { primitive, triangle, .. } = *points;
    let at = SurfacePoint { normal: geometric, ..points.surface };
    let (normal, lift) = world.geometry.shading_normal(primitive, triangle, &at, direction);
    let Some((mapping, bump)) =
        surface_texture(world, points.primitive).and_then(|texture| texture.bump.as_ref())
    else {
        return (normal, lift);
    };
    let coord = coordinates(&world.geometry, mapping, points);
    let (slope_u, slope_v) = bump.gradient((coord.u, coord.v), points.lanes.bits());
    let gradient = coord.grad_u * slope_u + coord.grad_v * slope_v;
    let outward = L::select(front, L::one(), -L::one());
    (keep_visible(mapping.bumped(normal, outward, gradient), geometric, direction), lift)
}
