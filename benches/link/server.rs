//! OpenSSH server for measurements over a connection.

use crate::tunnel::{NAMESPACE, SERVER_IP, Tunnel};
use std::fs;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// OpenSSH server that accepts a generated user key. It ends when this value is dropped.
pub struct Server {
    child: Child,
    folder: PathBuf,
    pub address: SocketAddr,
}

impl Server {
    /// Starts `sshd` with keys and settings in `folder`. It listens on loopback, or in the network
    /// namespace of `tunnel` if one is given.
    ///
    /// # Errors
    /// Fails if a program is missing or the server does not start.
    pub fn start(folder: &Path, tunnel: Option<&Tunnel>) -> Result<Self, String> {
        let daemon = ["/usr/sbin/sshd", "/usr/local/sbin/sshd", "/usr/bin/sshd"]
            .into_iter()
            .find(|path| Path::new(path).exists())
            .ok_or("there is no sshd: install openssh-server")?;
        for key in ["host", "user"] {
            let file = folder.join(key);
            if file.exists() {
                continue;
            }
            let status = Command::new("ssh-keygen")
                .args(["-q", "-t", "ed25519", "-N", "", "-f"])
                .arg(&file)
                .status()
                .map_err(|_| "there is no ssh-keygen: install openssh-client")?;
            if !status.success() {
                return Err("ssh-keygen makes no key".to_string());
            }
        }
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr());
        let mut address = port.map_err(|error| error.to_string())?;
        if tunnel.is_some() {
            address.set_ip(SERVER_IP.into());
        }
        let settings = format!(
            "ListenAddress {address}\nHostKey {0}/host\nAuthorizedKeysFile {0}/user.pub\n\
             StrictModes no\nUsePAM no\nPidFile none\nPasswordAuthentication no\n",
            folder.display()
        );
        let file = folder.join("sshd_config");
        fs::write(&file, settings).map_err(|error| error.to_string())?;
        // `sshd` needs this folder for privilege separation. The system creates it only at boot.
        let _ = fs::create_dir_all("/run/sshd");
        let log = fs::File::create(folder.join("sshd.log")).map_err(|error| error.to_string())?;
        let mut command = Command::new(daemon);
        if tunnel.is_some() {
            command = Command::new("ip");
            command.args(["netns", "exec", NAMESPACE, daemon]);
        }
        let child = command
            .args(["-D", "-e", "-f"])
            .arg(&file)
            .stderr(log)
            .stdin(Stdio::null())
            .spawn()
            .map_err(|error| error.to_string())?;
        let mut server = Self { child, folder: folder.to_path_buf(), address };
        let end = Instant::now() + Duration::from_secs(10);
        while TcpStream::connect(address).is_err() {
            let ended = server.child.try_wait().ok().flatten().is_some();
            if ended || Instant::now() > end {
                let log = fs::read_to_string(folder.join("sshd.log")).unwrap_or_default();
                return Err(format!("sshd does not start: {}", log.trim()));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(server)
    }

    /// Returns the words of an ssh command that connects to `address` and runs `command` on the
    /// server in a terminal.
    pub fn ssh(&self, address: SocketAddr, command: &str) -> Vec<String> {
        let mut words: Vec<String> = ["ssh", "-tt", "-F", "none", "-i"].map(String::from).into();
        words.push(self.folder.join("user").display().to_string());
        for option in [
            "StrictHostKeyChecking=no",
            "UserKnownHostsFile=/dev/null",
            "LogLevel=ERROR",
            "Compression=no",
        ] {
            words.extend(["-o".to_string(), option.to_string()]);
        }
        let [host, port] = [address.ip().to_string(), address.port().to_string()];
        words.extend(["-p".to_string(), port, host, command.to_string()]);
        words
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
