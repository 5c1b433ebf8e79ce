//! Textures and bumps on the things of a world: what materials say, laid on shapes where they stand.

use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::material::{
    Bump, BumpMap, CompiledTexture, Mapping, Material, Placement, Projection, TexCoord, Texture,
    TextureMapping,
};
use crate::primitive::{Aggregate, PrimitiveId, SurfacePoint, keep_visible};
use crate::scene::Scene;
use crate::shape::{DefaultMapping, TextureSpace};
use crate::world::compile::World;
use glam::{DAffine3, DVec3};

/// What one item wears.
struct SurfaceTexture<S> {
    pattern: Option<(TextureMapping<S>, CompiledTexture<S>)>,
    heights: Option<(TextureMapping<S>, BumpMap)>,
}

/// What the items of a world wear.
pub(crate) struct SurfaceTextures<L: SimdFloat> {
    of_item: Vec<Option<SurfaceTexture<L::Scalar>>>,
}

/// A packet's points on the surface of one item. Made only where it is asked for, so that elsewhere
/// nothing of it leaves the registers.
pub(crate) struct ShadingPoints<L: SimdFloat> {
    /// Tag of the item.
    pub item: u32,
    /// Tags of the triangles, on a mesh.
    pub facet: L,
    /// The points, with the normals that point outwards.
    pub surface: SurfacePoint<L>,
    /// The lanes that are there.
    pub lanes: L::Mask,
}

/// The formula that a mapping comes to on a shape.
fn projection(mapping: Mapping, space: &TextureSpace) -> Projection {
    match (mapping, space.default_mapping) {
        (Mapping::Planar, _) | (Mapping::Uv | Mapping::Auto, DefaultMapping::Planar) => {
            Projection::Planar
        }
        (Mapping::Spherical, _) | (Mapping::Auto, DefaultMapping::Spherical) => {
            Projection::Spherical
        }
        (Mapping::Cylindrical, _) | (Mapping::Auto, DefaultMapping::Cylindrical) => {
            Projection::Cylindrical
        }
        (Mapping::Box, _) | (Mapping::Auto, DefaultMapping::Box) => Projection::Box,
        (Mapping::Uv, _) | (Mapping::Auto, DefaultMapping::Uv) => Projection::Uv,
    }
}

impl<L: SimdFloat> SurfaceTextures<L> {
    /// For each of the items that `sources` lists what its material says, which `material` finds by
    /// object and part; `None`: nothing is worn. `origin`: what was subtracted from the scene.
    pub fn new<'a>(
        scene: &Scene,
        sources: &[PrimitiveId],
        origin: DVec3,
        material: impl Fn(&PrimitiveId) -> &'a Material,
    ) -> Option<Self> {
        let worn = |m: &Material| {
            m.texture.as_ref().is_some_and(Texture::has_effect)
                || m.bump.as_ref().is_some_and(Bump::has_effect)
        };
        if !sources.iter().any(|source| worn(material(source))) {
            return None;
        }
        let back = DAffine3::from_translation(-origin);
        let mut spaces: (usize, Vec<TextureSpace>) = (usize::MAX, Vec::new());
        let of_item = sources.iter().map(|source| {
            let material = material(source);
            if !worn(material) {
                return None;
            }
            let object = &scene.objects[source.form];
            if spaces.0 != source.form {
                spaces = (source.form, object.shape.texture_spaces());
            }
            let space = &spaces.1[source.part];
            let there = back * object.scene_from_object() * space.shape_from_texture;
            let projector = |placement: &Placement| {
                let projection = projection(placement.mapping, space);
                TextureMapping::new(placement, projection, &there, space.corners)
            };
            let texture = material.texture.as_ref();
            let bump = material.bump.as_ref();
            Some(SurfaceTexture {
                pattern: texture
                    .and_then(|t| Some((projector(&t.placement()), CompiledTexture::new(t)?))),
                heights: bump.and_then(|b| Some((projector(&b.placement()), BumpMap::new(b)?))),
            })
        });
        Some(Self { of_item: of_item.collect() })
    }

    fn surface_textures(&self) -> impl Iterator<Item = &SurfaceTexture<L::Scalar>> {
        self.of_item.iter().flatten()
    }

    /// Whether colours vary anywhere.
    pub fn is_colored(&self) -> bool {
        self.surface_textures().any(|surface_texture| surface_texture.pattern.is_some())
    }

    /// Whether normals are turned anywhere.
    pub fn is_bumped(&self) -> bool {
        self.surface_textures().any(|surface_texture| surface_texture.heights.is_some())
    }

    /// What occurs, in words.
    pub fn words(&self) -> Vec<&'static str> {
        let patterns = || {
            self.surface_textures().filter_map(|surface_texture| surface_texture.pattern.as_ref())
        };
        let image = |pattern: &CompiledTexture<_>| matches!(pattern, CompiledTexture::Image { .. });
        let mut words = Vec::new();
        words.extend(patterns().any(|(_, p)| image(p)).then_some("image texture"));
        words.extend(patterns().any(|(_, p)| !image(p)).then_some("checker"));
        words.extend(self.is_bumped().then_some("bump"));
        words
    }
}

/// Coordinates by a projection, or by what the mesh says.
fn coordinates<L: SimdFloat>(
    geometry: &Aggregate<L>,
    projector: &TextureMapping<L::Scalar>,
    points: &ShadingPoints<L>,
) -> TexCoord<L> {
    let surface = &points.surface;
    if projector.wants_uv()
        && let Some(own) = geometry.uv(points.item, points.facet, surface.point)
    {
        let [u, v] = own.uv;
        let [du, dv] = own.gradients;
        return projector.placed(TexCoord { u, v, grad_u: du, grad_v: dv });
    }
    projector.coordinates(surface.point, surface.normal)
}

impl<L: SimdFloat> World<L> {
    fn surface_texture(&self, item: u32) -> Option<&SurfaceTexture<L::Scalar>> {
        self.surface_textures.as_ref()?.of_item[item as usize].as_ref()
    }

    /// The colour of its own that a thing has, if it has one: that in its mesh's file, and its texture.
    #[inline(never)]
    pub(crate) fn albedo_factor(&self, points: &ShadingPoints<L>) -> Option<Vec3<L>> {
        let painted = self.geometry.color(points.item, points.facet);
        let Some((projector, pattern)) =
            self.surface_texture(points.item).and_then(|s| s.pattern.as_ref())
        else {
            return painted;
        };
        let at = coordinates(&self.geometry, projector, points);
        let color = pattern.eval((at.u, at.v), points.lanes.bits());
        Some(painted.map_or(color, |painted| painted.component_mul(color)))
    }

    /// The normal that light is computed with where rays along `direction` meet a surface whose
    /// geometric normal on their side is `geometric`: smooth, and turned by bumps; on the same side,
    /// and facing the viewer. `front`: where that normal points outwards.
    #[inline(never)]
    pub(crate) fn shading_normal(
        &self,
        points: &ShadingPoints<L>,
        (front, geometric): (L::Mask, Vec3<L>),
        direction: Vec3<L>,
    ) -> Vec3<L> {
        let at = (points.surface.point, geometric);
        let normal = self.geometry.shading_normal((points.item, points.facet), at, direction);
        let Some((projector, heights)) =
            self.surface_texture(points.item).and_then(|s| s.heights.as_ref())
        else {
            return normal;
        };
        let at = coordinates(&self.geometry, projector, points);
        let (along_u, along_v) = heights.gradient((at.u, at.v), points.lanes.bits());
        let gradient = at.grad_u * along_u + at.grad_v * along_v;
        let outward = L::select(front, L::one(), -L::one());
        keep_visible(projector.bumped(normal, outward, gradient), geometric, direction)
    }
}
