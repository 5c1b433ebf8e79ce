//! Parts of a glTF description that are read. Indices, counts and offsets are `f64`, because some
//! programs write `3.0`; [`whole`] converts them.

use glam::{DAffine3, DMat4, DQuat};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::HashMap;

/// Accessors of attributes, by name.
pub type Attributes = HashMap<String, f64>;

/// Returns a count, offset or index; a number beyond all lists if it is negative or a fraction.
pub fn whole(number: f64) -> usize {
    if number >= 0.0 && number.fract() == 0.0 { number as usize } else { usize::MAX }
}

/// Defines structs of optional JSON members. Others are skipped.
macro_rules! objects {
    ($($(#[$comment:meta])* $name:ident { $($(#[$key:meta])* $field:ident: $type:ty),* })*) => {$(
        $(#[$comment])*
        #[derive(Default, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub struct $name { $($(#[$key])* pub $field: $type),* }
    )*};
}

objects! {
    /// Description of a glTF file.
    Document {
        asset: Asset, scene: Option<f64>, scenes: Vec<Scene>, nodes: Vec<Node>,
        meshes: Vec<Mesh>, materials: Vec<Material>, accessors: Vec<Accessor>,
        buffer_views: Vec<BufferView>, buffers: Vec<Buffer>, extensions_required: Vec<String>
    }
    Asset { version: String }
    Scene { nodes: Vec<f64> }
    Node {
        children: Vec<f64>, mesh: Option<f64>, skin: Option<IgnoredAny>, weights: Vec<f64>,
        matrix: Option<Box<[f64; 16]>>, translation: Option<[f64; 3]>,
        rotation: Option<[f64; 4]>, scale: Option<[f64; 3]>, extensions: Extensions
    }
    Mesh { primitives: Vec<Primitive>, weights: Vec<f64> }
    Primitive {
        attributes: Attributes, indices: Option<f64>, material: Option<f64>, mode: Option<f64>,
        targets: Vec<Attributes>, extensions: Extensions
    }
    Material { pbr_metallic_roughness: Surface }
    /// Metallic-roughness surface of a material.
    Surface { base_color_factor: Option<[f32; 4]>, base_color_texture: Option<IgnoredAny> }
    Accessor {
        buffer_view: Option<f64>, byte_offset: f64, component_type: f64, normalized: bool,
        count: f64, #[serde(rename = "type")] kind: String, sparse: Option<Sparse>
    }
    /// Elements of an accessor that differ from those of its buffer view.
    Sparse { count: f64, indices: View, values: View }
    /// Begin of items in a buffer view.
    View { buffer_view: f64, byte_offset: f64, component_type: f64 }
    BufferView {
        buffer: f64, byte_offset: f64, byte_length: f64, byte_stride: Option<f64>,
        extensions: Extensions
    }
    Buffer { uri: Option<String> }
    /// Extensions of nodes, primitives and buffer views.
    Extensions {
        #[serde(rename = "EXT_mesh_gpu_instancing")] instances: Option<IgnoredAny>,
        #[serde(rename = "KHR_draco_mesh_compression")] draco: Option<IgnoredAny>,
        #[serde(rename = "EXT_meshopt_compression", alias = "KHR_meshopt_compression")]
        meshopt: Option<IgnoredAny>
    }
}

impl Node {
    /// Returns the transform relative to the parent.
    pub fn map(&self) -> DAffine3 {
        if let Some(matrix) = &self.matrix {
            return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
        }
        DAffine3::from_scale_rotation_translation(
            self.scale.unwrap_or([1.0; 3]).into(),
            self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
            self.translation.unwrap_or_default().into(),
        )
    }
}
