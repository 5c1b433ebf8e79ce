//! Hash of the contents of the files that a scene names. The text of a scene has only their names.

use crate::Scene;
use crate::light::Light;
use crate::value::Fnv1a64;
use std::collections::HashMap;
use std::sync::Arc;

impl Scene {
    /// Returns the hash of the contents of the files that the scene names, as they were read;
    /// `None` if none is loaded.
    pub fn contents_hash(&self) -> Option<u64> {
        // A new key that names files needs a line here.
        let mut hash = Fnv1a64::default();
        let meshes = self.objects.iter().filter_map(|object| object.shape.mesh());
        add_each(&mut hash, meshes, |mesh, hash| {
            mesh.mesh.hash_contents(|bytes| hash.update(bytes))
        });
        let images = self.materials.values().flat_map(|material| material.images());
        add_each(&mut hash, images, |image, hash| image.hash_contents(hash));
        let environments = self.lights.iter().filter_map(Light::environment);
        let maps = environments.filter_map(|environment| environment.map());
        add_each(&mut hash, maps, |map, hash| map.hash_contents(hash));
        (hash != Fnv1a64::default()).then(|| hash.value())
    }
}

/// Adds the hash of each file's contents to `hash`. The contents of each file are hashed only once.
fn add_each<'a, T: 'a>(
    hash: &mut Fnv1a64,
    files: impl Iterator<Item = &'a Arc<T>>,
    add_contents: impl Fn(&T, &mut Fnv1a64),
) {
    let mut known = HashMap::new();
    for file in files {
        let value = *known.entry(Arc::as_ptr(file)).or_insert_with(|| {
            let mut hash = Fnv1a64::default();
            add_contents(file, &mut hash);
            hash.value()
        });
        hash.update(&value.to_le_bytes());
    }
}
