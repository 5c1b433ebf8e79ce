//! Cache of asset files (meshes and images), shared between compilations of scenes.

use crate::asset::error::AssetError;
use crate::asset::file::{FileContents, MAX_BYTES, read_error};
use crate::asset::image::Image;
use crate::asset::memory::{AssetKind, asset_memory};
use crate::asset::mesh;
use crate::asset::radiance_map::RadianceMap;
use crate::disk::FileStamp;
use crate::process_memory::missing_memory;
use std::collections::HashSet;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use zerkalo_kernel::primitive::Mesh;

/// Largest total memory in bytes of the cached files that no scene uses. An undo may need them.
const UNUSED_BYTES: usize = 256 << 20;

/// Largest size in bytes of an image file for a texture or an environment: 512 MiB.
const MAX_IMAGE_BYTES: u64 = 512 << 20;

/// Estimated peak memory for building the BVH of a mesh \[bytes per triangle\].
const BUILD_BYTES: u64 = 400;

/// Stage of loading an asset file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LoadProgress {
    /// Reading of a file.
    Reading {
        /// Path of the file.
        file: PathBuf,
        /// Length in bytes.
        bytes: u64,
    },
    /// Building of the BVH of a mesh.
    Building {
        /// Path of the mesh file.
        file: PathBuf,
        /// Number of triangles of the mesh.
        triangles: usize,
    },
}

impl fmt::Display for LoadProgress {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let name =
            |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match self {
            Self::Reading { file, bytes } => {
                write!(f, "reading {}: {:.1} MB", name(file), *bytes as f64 / 1e6)
            }
            Self::Building { file, triangles } => {
                write!(f, "reading {}: BVH of {triangles} triangles", name(file))
            }
        }
    }
}

/// Cache key of one version of a file.
#[derive(Clone, PartialEq, Eq)]
struct Key {
    path: PathBuf,
    stamp: FileStamp,
}

/// Content of a file or the error of reading it. Empty until the file has been read.
type CacheEntry<T> = Arc<OnceLock<Result<Arc<T>, AssetError>>>;

/// Files of one type, the most recently used first.
struct Cache<T>(Vec<(Key, CacheEntry<T>)>);

impl Key {
    fn of(path: &Path) -> Result<Self, AssetError> {
        let stamp = std::fs::metadata(path).and_then(|metadata| FileStamp::new(&metadata));
        let canonical = std::fs::canonicalize(path);
        let key = stamp.and_then(|stamp| Ok(Self { path: canonical?, stamp }));
        key.map_err(|error| read_error(path, &error))
    }
}

impl<T> Cache<T> {
    fn has(&self, key: &Key) -> bool {
        self.0.iter().any(|(known, _)| known == key)
    }

    /// Returns the entry for `key`, a new one if necessary. Removes other versions of the file.
    fn entry(&mut self, key: Key) -> CacheEntry<T> {
        let known = self.0.iter().find(|(k, _)| *k == key).map(|(_, entry)| entry.clone());
        self.0.retain(|(k, _)| k.path != key.path);
        let entry = known.unwrap_or_default();
        self.0.insert(0, (key, entry.clone()));
        entry
    }

    /// Returns the keys of the files that scenes use, or could not use.
    fn used(&self) -> impl Iterator<Item = &Key> {
        let is_used = |entry: &CacheEntry<T>| match entry.get() {
            Some(Ok(file)) => Arc::strong_count(file) > 1,
            Some(Err(_)) => true,
            None => false,
        };
        self.0.iter().filter(move |(_, entry)| is_used(entry)).map(|(key, _)| key)
    }

    /// Evicts files that no scene uses, the least recently used first, until they take at most
    /// [`UNUSED_BYTES`]. `bytes_of` returns the memory of a file in bytes.
    fn evict(&mut self, bytes_of: impl Fn(&T) -> usize) {
        let mut sum = 0usize;
        self.0.retain(|(_, entry)| {
            let bytes = match entry.get() {
                Some(Ok(file)) if Arc::strong_count(file) == 1 => bytes_of(file),
                Some(Err(_)) => 0,
                Some(Ok(_)) | None => return true,
            };
            sum = sum.saturating_add(bytes);
            sum <= UNUSED_BYTES
        });
    }
}

/// Cache of all asset files that scenes name, shared by scenes and threads. A file is read again
/// only if it has changed on disk or was evicted. Errors are cached as well.
pub struct Assets {
    meshes: Mutex<Cache<Mesh>>,
    images: Mutex<Cache<Image>>,
    radiance_maps: Mutex<Cache<RadianceMap>>,
    progress: Box<dyn Fn(&LoadProgress) + Send + Sync>,
}

impl Default for Assets {
    fn default() -> Self {
        Self::new(|_| {})
    }
}

impl fmt::Debug for Assets {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Assets").finish_non_exhaustive()
    }
}

impl Assets {
    /// Creates an empty cache. The thread that loads a file calls `progress` at the start of each
    /// stage.
    pub fn new(progress: impl Fn(&LoadProgress) + Send + Sync + 'static) -> Self {
        Self {
            meshes: Mutex::new(Cache(Vec::new())),
            images: Mutex::new(Cache(Vec::new())),
            radiance_maps: Mutex::new(Cache(Vec::new())),
            progress: Box::new(progress),
        }
    }

    /// Returns the mesh in the file at `path`.
    pub fn mesh(&self, path: &Path) -> Result<Arc<Mesh>, AssetError> {
        let read = |key: &Key| {
            let needed = key.stamp.bytes.saturating_mul(mesh::parse_bytes(path));
            check_memory(path, "the file", needed)?;
            let triangles = mesh::parse(&self.read(path, key, MAX_BYTES)?)?;
            let count = triangles.triangles.len();
            let tree = format!("the BVH of {count} triangles");
            check_memory(path, &tree, (count as u64).saturating_mul(BUILD_BYTES))?;
            (self.progress)(&LoadProgress::Building { file: path.to_path_buf(), triangles: count });
            Ok(Mesh::new(triangles))
        };
        load(&self.meshes, path, read, Mesh::bytes)
    }

    /// Returns the image in the file at `path`.
    pub fn image(&self, path: &Path) -> Result<Arc<Image>, AssetError> {
        let read = |key: &Key| Image::parse(&self.read(path, key, MAX_IMAGE_BYTES)?);
        load(&self.images, path, read, Image::bytes)
    }

    /// Returns the environment image (radiance from all directions) in the file at `path`.
    pub fn radiance_map(&self, path: &Path) -> Result<Arc<RadianceMap>, AssetError> {
        let read = |key: &Key| RadianceMap::parse(&self.read(path, key, MAX_IMAGE_BYTES)?);
        load(&self.radiance_maps, path, read, RadianceMap::bytes)
    }

    /// Checks, by the headers of `files`, that those that are not in the cache fit into memory
    /// together.
    ///
    /// # Errors
    /// Fails with an error about the largest file if they do not fit.
    pub fn check_total_memory(&self, files: &[(AssetKind, PathBuf)]) -> Result<(), AssetError> {
        let (mut sum, mut decoding, mut largest) = (0u64, 0, (0, Path::new("")));
        let mut counted = HashSet::new();
        for (kind, path) in files {
            let Ok(key) = Key::of(path) else { continue };
            let is_cached = match kind {
                AssetKind::Mesh => locked(&self.meshes).has(&key),
                AssetKind::Texture => locked(&self.images).has(&key),
                AssetKind::Environment => locked(&self.radiance_maps).has(&key),
            };
            let length = key.stamp.bytes;
            if !is_cached && counted.insert((kind, key.path)) {
                let [kept, further] = asset_memory(*kind, path, length);
                sum = sum.saturating_add(kept);
                decoding = decoding.max(further);
                largest = largest.max((kept, path));
            }
        }
        let missing = missing_memory(sum.saturating_add(decoding)).filter(|_| sum > 0);
        missing.map_or(Ok(()), |missing| {
            let found = match counted.len() {
                1 => format!("the file {missing}"),
                n => format!("with the other {} files of the scene, this file {missing}", n - 1),
            };
            let expected = "fewer or smaller meshes and images, or more free memory";
            Err(AssetError::of_file(largest.1, found, expected))
        })
    }

    /// Returns the files of scenes that have changed since they were read, with their stamps now.
    pub fn changed(&self) -> Vec<(PathBuf, Option<FileStamp>)> {
        let mut known: Vec<Key> = locked(&self.meshes).used().cloned().collect();
        known.extend(locked(&self.images).used().cloned());
        known.extend(locked(&self.radiance_maps).used().cloned());
        let now = |key: Key| {
            let stamp = FileStamp::of(&key.path);
            (stamp != Some(key.stamp)).then_some((key.path, stamp))
        };
        known.into_iter().filter_map(now).collect()
    }

    fn read(&self, path: &Path, key: &Key, limit: u64) -> Result<FileContents, AssetError> {
        (self.progress)(&LoadProgress::Reading {
            file: path.to_path_buf(),
            bytes: key.stamp.bytes,
        });
        FileContents::read(path, limit)
    }
}

/// Checks that `needed` bytes of memory are available for `what`.
fn check_memory(path: &Path, what: &str, needed: u64) -> Result<(), AssetError> {
    let expected = "a mesh of fewer triangles, or more free memory";
    missing_memory(needed).map_or(Ok(()), |missing| {
        Err(AssetError::of_file(path, format!("{what} {missing}"), expected))
    })
}

/// Locks a cache. It is valid even after a panic, because no method leaves it half changed.
fn locked<T>(cache: &Mutex<Cache<T>>) -> MutexGuard<'_, Cache<T>> {
    cache.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the file at `path` from `cache`. If it is missing there, `read` reads it; meanwhile
/// other threads can use the cache.
fn load<T>(
    cache: &Mutex<Cache<T>>,
    path: &Path,
    read: impl FnOnce(&Key) -> Result<T, AssetError>,
    bytes_of: impl Fn(&T) -> usize,
) -> Result<Arc<T>, AssetError> {
    let key = Key::of(path)?;
    let entry = locked(cache).entry(key.clone());
    let file = entry.get_or_init(|| read(&key).map(Arc::new)).clone();
    locked(cache).evict(bytes_of);
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn counted() -> (Assets, Arc<AtomicUsize>) {
        let count = Arc::new(AtomicUsize::new(0));
        let counter = count.clone();
        let assets = Assets::new(move |progress| {
            if matches!(progress, LoadProgress::Reading { .. }) {
                counter.fetch_add(1, Ordering::SeqCst);
            }
        });
        (assets, count)
    }

    #[test]
    fn file_is_read_once_until_it_changes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, TRIANGLE).unwrap();
        let (assets, reads) = counted();
        let meshes: Vec<_> = std::thread::scope(|scope| {
            let threads: Vec<_> =
                (0..8).map(|_| scope.spawn(|| assets.mesh(&path).unwrap())).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        assert!(meshes.iter().all(|m| Arc::ptr_eq(m, &meshes[0])));
        assert_eq!(reads.load(Ordering::SeqCst), 1);
        let other = folder.path().join(".").join("a.obj");
        assert!(Arc::ptr_eq(&assets.mesh(&other).unwrap(), &meshes[0]));
        std::fs::write(&path, format!("{TRIANGLE}f 3 2 1\n")).unwrap();
        assert_eq!(assets.mesh(&path).unwrap().mesh.triangles.len(), 2);
        assert_eq!(reads.load(Ordering::SeqCst), 2);
        assert_eq!(locked(&assets.meshes).0.len(), 1);
    }

    #[test]
    fn errors_are_cached_except_missing_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let (assets, reads) = counted();
        assert!(assets.mesh(&path).unwrap_err().found.contains("no such file"));
        std::fs::write(&path, "f 1 2 3\n").unwrap();
        for _ in 0..3 {
            assert!(assets.mesh(&path).unwrap_err().found.contains("vertex 1"));
        }
        assert_eq!(reads.load(Ordering::SeqCst), 1);
        assert!(assets.mesh(folder.path()).unwrap_err().found.contains("not a regular file"));
    }

    /// Checks that files are refused by the sum of their headers, of which none is decoded. Each of
    /// them is short, and declares an environment that takes 738 MB.
    #[test]
    fn sum_of_all_files_is_compared_with_memory() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<_> = (0..1000)
            .map(|i| {
                let path = folder.path().join(format!("{i}.hdr"));
                let rows = [0; 4100];
                let header = b"#?RADIANCE\n\n-Y 4096 +X 8192\n";
                std::fs::write(&path, [&header[..], &rows].concat()).unwrap();
                (AssetKind::Environment, path)
            })
            .collect();
        let (assets, reads) = counted();
        let error = assets.check_total_memory(&files).unwrap_err();
        let words = "with the other 999 files of the scene, this file needs 738";
        assert!(error.found.starts_with(words), "{error}");
        assert!(error.found.contains(" GB of memory, and "), "{error}");
        assert!(error.expected.contains("fewer or smaller"), "{error}");
        assert_eq!(reads.load(Ordering::SeqCst), 0);
        // The same file counts once, and files that cannot be read or have no header count as nothing.
        let once = vec![files[0].clone(); 1000];
        assert_eq!(assets.check_total_memory(&once), Ok(()));
        std::fs::write(&files[0].1, "no image").unwrap();
        let other = vec![files[0].clone(), (AssetKind::Texture, folder.path().join("none.png"))];
        assert_eq!(assets.check_total_memory(&other), Ok(()));
    }

    #[test]
    fn unused_files_are_evicted_least_recent_first() {
        let mut cache = Cache::<usize>(Vec::new());
        let stamp = FileStamp::of(Path::new(".")).unwrap();
        let key = |name: &str| Key { path: name.into(), stamp };
        let put = |cache: &mut Cache<usize>, name| {
            let file = Arc::new(UNUSED_BYTES / 2);
            cache.entry(key(name)).set(Ok(file.clone())).unwrap();
            file
        };
        let held = put(&mut cache, "held");
        for name in ["a", "b", "c"] {
            drop(put(&mut cache, name));
        }
        cache.evict(|bytes| *bytes);
        let known =
            |cache: &Cache<usize>, name| cache.0.iter().any(|(known, _)| *known == key(name));
        assert!(known(&cache, "held") && !known(&cache, "a"));
        assert!(known(&cache, "b") && known(&cache, "c"));
        drop(held);
        cache.entry(key("b"));
        cache.evict(|bytes| *bytes);
        assert!(!known(&cache, "held") && known(&cache, "b") && known(&cache, "c"));
    }
}
