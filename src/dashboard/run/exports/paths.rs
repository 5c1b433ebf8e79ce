//! File paths: unused names for exported files, and arguments of scp that copy them.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Largest number in a file name, which bounds the search for an unused one.
const MOST: u32 = 100_000;

/// Creates a file by calling `write` with the first unused path of `STEM-1.EXTENSION`,
/// `STEM-2.EXTENSION` and so on. `write` must create the file atomically and fail if the path
/// exists.
///
/// # Errors
/// Fails with the error of `write`, or with a message if no name is unused.
pub fn numbered<T, E: Display>(
    stem: &str,
    extension: &str,
    write: impl Fn(&Path) -> Result<T, E>,
) -> Result<PathBuf, String> {
    // A symbolic link takes a path even without a target.
    let is_taken = |path: &Path| path.symlink_metadata().is_ok();
    for number in 1..=MOST {
        let path = PathBuf::from(format!("{stem}-{number}.{extension}"));
        if is_taken(&path) {
            continue;
        }
        match write(&path) {
            Ok(_) => return Ok(path),
            // Another program has created a file of this name meanwhile.
            Err(_) if is_taken(&path) => {}
            Err(error) => return Err(error.to_string()),
        }
    }
    Err(format!("all names for files of {stem} are in use"))
}

pub fn full(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    path.to_string_lossy().into_owned()
}

/// Returns the URL of the file at `path` on this machine, for links in the terminal.
pub fn url(path: &Path) -> String {
    let path = full(path);
    let encoded = path.bytes().map(|byte| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' | b'~' => {
            char::from(byte).to_string()
        }
        _ => format!("%{byte:02X}"),
    });
    format!("file://{}{}", host_name(), encoded.collect::<String>())
}

/// Returns the argument of scp that copies the file at `path` from this machine:
/// `user@host:/absolute/path`, after `-P PORT ` if the port of SSH is not 22. Both are quoted for a
/// shell where necessary.
pub fn scp(path: &Path) -> String {
    let variable = |name| env::var(name).unwrap_or_default();
    let user = Some(variable("USER")).filter(|u| !u.is_empty()).unwrap_or(variable("LOGNAME"));
    scp_from(&variable("SSH_CONNECTION"), &user, &host_name(), &full(path))
}

/// Returns the result of [`scp`] for the value of `SSH_CONNECTION`, which is `CLIENT PORT SERVER
/// PORT`, or empty without SSH.
fn scp_from(connection: &str, user: &str, host_name: &str, path: &str) -> String {
    let fields: Vec<_> = connection.split_whitespace().collect();
    let (host, port) = match fields[..] {
        [_, _, host, port] if host.contains(':') => (format!("[{host}]"), port),
        [_, _, host, port] => (host.to_string(), port),
        _ => (host_name.to_string(), "22"),
    };
    let user_prefix = if user.is_empty() { String::new() } else { format!("{user}@") };
    let place = quoted(&format!("{user_prefix}{host}:{path}"));
    if port == "22" { place } else { format!("-P {} {place}", quoted(port)) }
}

/// Quotes `text` as a single word of a POSIX shell, if it needs quoting.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "@:/._-+,=%".contains(c);
    if text.chars().all(plain) {
        text.to_string()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

fn host_name() -> String {
    let known = fs::read_to_string("/proc/sys/kernel/hostname")
        .or_else(|_| fs::read_to_string("/etc/hostname"))
        .ok()
        .or_else(|| env::var("HOSTNAME").ok());
    known.map(|name| name.trim().to_string()).filter(|n| !n.is_empty()).unwrap_or("host".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exports_overwrite_nothing() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("room-2.png"), "old").unwrap();
        let room = folder.path().join("room").display().to_string();
        let write = |path: &Path| fs::File::create_new(path).map(drop);
        let names: Vec<_> = (0..3)
            .map(|_| numbered(&room, "png", write).unwrap())
            .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names, ["room-1.png", "room-3.png", "room-4.png"]);
        assert_eq!(fs::read(folder.path().join("room-2.png")).unwrap(), b"old");
        assert!(numbered(&format!("{room}/nowhere/room"), "png", write).is_err());
        // A name is skipped if another program creates a file of that name first.
        let late = |path: &Path| {
            let number = fs::read_dir(folder.path()).unwrap().count();
            if number < 6 {
                fs::write(path, "from another program").unwrap();
            }
            write(path)
        };
        let path = numbered(&room, "png", late).unwrap();
        assert!(path.ends_with("room-7.png"), "{path:?}");
    }

    #[test]
    fn scp_paths_include_host_and_port() {
        let over_ssh = "10.0.0.2 50312 192.168.1.7 22";
        for (connection, user, path, expected) in [
            (over_ssh, "ada", "/home/ada/a-1.png", "ada@192.168.1.7:/home/ada/a-1.png"),
            ("::1 5 fe80::1 2222", "ada", "/a.png", "-P 2222 'ada@[fe80::1]:/a.png'"),
            ("", "ada", "/a.png", "ada@box:/a.png"),
            ("nonsense", "", "/a.png", "box:/a.png"),
            ("", "", "/it's here.png", r"'box:/it'\''s here.png'"),
        ] {
            assert_eq!(scp_from(connection, user, "box", path), expected);
        }
        assert!(scp(Path::new("a.png")).contains(":/"));
        assert!(url(Path::new("/a b.png")).ends_with("/a%20b.png"));
    }
}
