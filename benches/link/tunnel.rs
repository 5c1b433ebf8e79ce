//! Tunnel with limited rate and a delay between the host and a network namespace, so that the
//! server's TCP connection has its own round trip, congestion control and send queue.

use std::io::{BufRead, BufReader};
use std::net::Ipv4Addr;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Name of the network namespace in which the server runs.
pub const NAMESPACE: &str = "zerkalo-bench";
/// Address of the server in its network namespace.
pub const SERVER_IP: Ipv4Addr = Ipv4Addr::new(10, 77, 0, 2);

/// Process that connects a network namespace to the host by a tunnel. When this value is dropped,
/// the process ends and the namespace is removed.
pub struct Tunnel {
    child: Child,
}

impl Tunnel {
    /// Starts a tunnel that transmits `rate` bytes per second towards the host and delays each
    /// direction by `one_way`.
    ///
    /// # Errors
    /// Fails if `ip` or `python3` is missing, or if the process lacks the permission to create
    /// network namespaces and TUN devices.
    pub fn start(rate: f64, one_way: Duration) -> Result<Self, String> {
        let added = Command::new("ip").args(["netns", "add", NAMESPACE]).status();
        if !added.is_ok_and(|status| status.success()) {
            return Err("no network namespace: needs root and iproute2".to_string());
        }
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/link/tunnel.py");
        let child = Command::new("python3")
            .args([script, NAMESPACE, &rate.to_string(), &one_way.as_secs_f64().to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut tunnel = Self { child: child.map_err(|_| "there is no python3".to_string())? };
        let mut line = String::new();
        let output = tunnel.child.stdout.take().expect("a pipe");
        match BufReader::new(output).read_line(&mut line) {
            Ok(1..) => Ok(tunnel),
            _ => Err("no TUN devices".to_string()),
        }
    }
}

impl Drop for Tunnel {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = Command::new("ip").args(["netns", "delete", NAMESPACE]).status();
    }
}
