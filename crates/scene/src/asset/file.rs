//! Asset files in memory: reading of whole files up to a size limit, and resolution of file names
//! that occur inside files.

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::text::Lines;
use crate::disk::open_regular;
use crate::process_memory::megabytes;
use crate::value::nearest_file;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

/// Largest size in bytes of an asset file that is read: 2 GiB.
pub const MAX_BYTES: u64 = 2 << 30;

/// Asset file in memory.
#[derive(Clone, Debug)]
pub struct FileContents {
    /// Path of the file.
    pub path: PathBuf,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

impl FileContents {
    /// Reads the file at `path`, which may have at most `limit` bytes.
    pub fn read(path: &Path, limit: u64) -> Result<Self, AssetError> {
        let error = |found: String, expected: &str| Err(AssetError::of_file(path, found, expected));
        let file = open(path)?;
        let length = file.metadata().map_err(|e| read_error(path, &e))?.len();
        let mut bytes = Vec::new();
        if length <= limit {
            if bytes.try_reserve_exact(length as usize + 1).is_err() {
                let found = format!("there is no memory for its {}", megabytes(length));
                return error(found, "a smaller file, or more free memory");
            }
            // Up to one byte more than `limit` is read, to notice that the file has grown.
            file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| read_error(path, &e))?;
        }
        let length = length.max(bytes.len() as u64);
        if length > limit {
            let found = format!("the file has {} MiB", length >> 20);
            return error(found, &format!("at most {} MiB", limit >> 20));
        }
        Ok(Self { path: path.to_path_buf(), bytes })
    }

    /// Reads the first `length` bytes of the file at `path`, or all of them if there are fewer.
    pub fn read_start(path: &Path, length: u64) -> Result<Self, AssetError> {
        let mut bytes = Vec::new();
        let read = open(path)?.take(length).read_to_end(&mut bytes);
        read.map_err(|e| read_error(path, &e))?;
        Ok(Self { path: path.to_path_buf(), bytes })
    }

    /// Creates an error at `place` in this file.
    pub fn error(
        &self,
        place: FileLocation,
        found: impl Into<String>,
        expected: &str,
    ) -> AssetError {
        AssetError { place, ..AssetError::of_file(&self.path, found, expected) }
    }

    /// Returns the line in which `rest` begins, the end of this file.
    pub fn line_of(&self, rest: &[u8]) -> FileLocation {
        FileLocation::Line(Lines::new(&self.bytes[..self.bytes.len() - rest.len()]).count())
    }

    /// Creates an error about this file as a whole.
    pub fn fault(&self, found: impl Into<String>, expected: &str) -> AssetError {
        self.error(FileLocation::Whole, found, expected)
    }

    /// Returns the path of the file `name`, which this file names relative to its folder; `None` if
    /// `name` is empty or could lead out of the folder. The rule is in docs/scene-format.md.
    pub fn resolve_relative(&self, name: &str) -> Option<PathBuf> {
        let name = name.replace('\\', "/");
        let inside = Path::new(&name)
            .components()
            .all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        // A colon in the first component indicates a Windows drive (`C:`) or a URL (`http:`).
        let drive = name.split('/').next().is_some_and(|first| first.contains(':'));
        let folder = self.path.parent().unwrap_or(Path::new(""));
        (inside && !drive && !name.is_empty()).then(|| folder.join(name))
    }
}

fn open(path: &Path) -> Result<File, AssetError> {
    open_regular(path).map_err(|error| match error.kind() {
        ErrorKind::InvalidInput => AssetError::of_file(path, error.to_string(), "a regular file"),
        _ => read_error(path, &error),
    })
}

/// Converts an I/O error that occurred while the file at `path` was read.
pub fn read_error(path: &Path, error: &std::io::Error) -> AssetError {
    let (found, expected) = match error.kind() {
        ErrorKind::NotFound => {
            let near = nearest_file(path).map(|near| format!("the path of a file, such as {near}"));
            let expected = near.unwrap_or_else(|| "the path of a file".to_string());
            return AssetError::of_file(path, "there is no such file", &expected);
        }
        ErrorKind::PermissionDenied => {
            ("permission to read the file is denied".to_string(), "a file that may be read")
        }
        _ => (format!("the file cannot be read: {error}"), "a file that can be read"),
    };
    AssetError::of_file(path, found, expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_names_stay_in_folder() {
        let source = FileContents { path: PathBuf::from("meshes/a.obj"), bytes: Vec::new() };
        assert_eq!(source.resolve_relative("a.mtl"), Some(PathBuf::from("meshes/a.mtl")));
        assert_eq!(source.resolve_relative("./x\\b.mtl"), Some(PathBuf::from("meshes/./x/b.mtl")));
        for name in ["", "../a.mtl", "x/../../a", "/etc/passwd", "C:\\a", "http://a/b", "file:a"] {
            assert_eq!(source.resolve_relative(name), None, "{name}");
        }
    }
}
