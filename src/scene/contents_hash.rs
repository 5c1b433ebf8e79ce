//! Hash of the contents of the files that a scene names. The text of a scene has only their names.

use crate::scene::Scene;
use crate::value::Fnv1a64;
use std::collections::HashMap;
use std::sync::Arc;

impl Scene {
    /// Hash of the meshes and images of the scene, in the order in which the scene names them.
    /// Returns `None` if there are none. It covers the data that were read, so that later changes
    /// of the files have no influence.
    pub fn contents_hash(&self) -> Option<u64> {
        // A new field that may name files has to be added here.
        let Self {
            film: _,
            trace: _,
            camera: _,
            cameras: _,
            background: _,
            ambient: _,
            lights,
            materials,
            objects,
            resolver: _,
        } = self;
        let mut hash = Fnv1a64::default();
        let mut known = HashMap::new();
        for mesh in objects.iter().filter_map(|object| object.shape.mesh()) {
            let value = once(&mut known, Arc::as_ptr(mesh), |hash| mesh.mesh().hash_contents(hash));
            hash.update(&value.to_le_bytes());
        }
        let mut known = HashMap::new();
        for image in materials.values().flat_map(|material| material.images()) {
            let value = once(&mut known, Arc::as_ptr(image), |hash| image.hash_contents(hash));
            hash.update(&value.to_le_bytes());
        }
        let mut known = HashMap::new();
        let environments = lights.iter().filter_map(|light| light.environment.as_ref());
        for map in environments.filter_map(|environment| environment.map()) {
            let value = once(&mut known, Arc::as_ptr(map), |hash| map.hash_contents(hash));
            hash.update(&value.to_le_bytes());
        }
        (hash != Fnv1a64::default()).then(|| hash.value())
    }
}

/// Returns the hash of a file's contents. A file that the scene names repeatedly is hashed once.
fn once<T>(
    known: &mut HashMap<*const T, u64>,
    file: *const T,
    add_contents: impl FnOnce(&mut Fnv1a64),
) -> u64 {
    *known.entry(file).or_insert_with(|| {
        let mut hash = Fnv1a64::default();
        add_contents(&mut hash);
        hash.value()
    })
}
