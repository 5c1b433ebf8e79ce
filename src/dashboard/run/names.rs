//! Names: of pictures that overwrite nothing, and for fetching them from afar.

use std::env;
use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// The most pictures of one scene and format in one folder.
const MOST: u32 = 100_000;

/// Creates an empty file in `folder` under the first name of `STEM-1.EXTENSION`, `STEM-2.EXTENSION`
/// and so on that is free, and thereby keeps the name from everybody else.
pub fn reserve(folder: &Path, stem: &str, extension: &str) -> io::Result<PathBuf> {
    for number in 1..=MOST {
        let path = folder.join(format!("{stem}-{number}.{extension}"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(_) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, format!("{MOST} names are in use")))
}

/// Where scp finds `path` on this machine: `user@host:/absolute/path`, after `-P PORT ` if that is
/// not the usual one; quoted for a shell where needed.
pub fn scp(path: &Path) -> String {
    let variable = |name| env::var(name).unwrap_or_default();
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let user = Some(variable("USER")).filter(|u| !u.is_empty()).unwrap_or(variable("LOGNAME"));
    scp_from(&variable("SSH_CONNECTION"), &user, &host_name(), &path.to_string_lossy())
}

/// `connection`: `SSH_CONNECTION` as sshd sets it, "client port server port"; else empty.
fn scp_from(connection: &str, user: &str, host_name: &str, path: &str) -> String {
    let fields: Vec<_> = connection.split_whitespace().collect();
    let (host, port) = match fields[..] {
        [_, _, host, port] if host.contains(':') => (format!("[{host}]"), port),
        [_, _, host, port] => (host.to_string(), port),
        _ => (host_name.to_string(), "22"),
    };
    let at = if user.is_empty() { String::new() } else { format!("{user}@") };
    let place = quoted(&format!("{at}{host}:{path}"));
    if port == "22" { place } else { format!("-P {} {place}", quoted(port)) }
}

/// `text` as one word of a shell.
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
    fn nothing_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("room-2.png"), "old").unwrap();
        let names: Vec<_> = (0..3)
            .map(|_| reserve(folder.path(), "room", "png").unwrap())
            .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names, ["room-1.png", "room-3.png", "room-4.png"]);
        assert_eq!(fs::read(folder.path().join("room-2.png")).unwrap(), b"old");
        assert!(reserve(&folder.path().join("nowhere"), "room", "png").is_err());
    }

    #[test]
    fn where_scp_finds_it() {
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
    }
}
