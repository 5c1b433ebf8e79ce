//! Length of the SSH connection's TCP send queue: bytes that the other host, such as a jump host,
//! has not acknowledged (proc(5), `/proc/net/tcp`).

use std::fs;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// Send queue of one TCP connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TcpSendQueue {
    local: SocketAddr,
    remote: SocketAddr,
}

impl TcpSendQueue {
    /// Finds the connection by the value of `SSH_CONNECTION`. Returns `None` if the kernel does not
    /// list it.
    pub fn find(ssh_connection: &str) -> Option<Self> {
        let queue = Self::parse(ssh_connection)?;
        queue.bytes().is_some().then_some(queue)
    }

    /// Returns the number of bytes in the queue; `None` if the kernel does not list the connection.
    pub fn bytes(&self) -> Option<usize> {
        let tables = ["/proc/net/tcp", "/proc/net/tcp6"];
        tables.into_iter().find_map(|path| self.bytes_in(&fs::read_to_string(path).ok()?))
    }

    /// Parses the value of `SSH_CONNECTION`: address and port of the client, then of the server.
    fn parse(text: &str) -> Option<Self> {
        let fields: Vec<_> = text.split_whitespace().collect();
        let [client, client_port, server, server_port] = fields[..] else { return None };
        let address = |ip: &str, port: &str| {
            // A scope such as `%eth0` is not in the kernel's table.
            let ip: IpAddr = ip.split('%').next()?.parse().ok()?;
            Some(SocketAddr::new(ip.to_canonical(), port.parse().ok()?))
        };
        Some(Self { local: address(server, server_port)?, remote: address(client, client_port)? })
    }

    fn bytes_in(&self, table: &str) -> Option<usize> {
        table.lines().skip(1).find_map(|line| {
            let mut fields = line.split_whitespace().skip(1);
            let [local, remote] = [fields.next()?, fields.next()?].map(address);
            let queues = fields.nth(1)?;
            let is_match = local? == self.local && remote? == self.remote;
            is_match.then(|| usize::from_str_radix(queues.split(':').next()?, 16).ok())?
        })
    }
}

/// Parses an address of the kernel's table, such as `0100007F:0016`: hexadecimal 32-bit words in
/// native byte order, and the port.
fn address(text: &str) -> Option<SocketAddr> {
    let (words, port) = text.split_once(':')?;
    let mut bytes = Vec::with_capacity(16);
    for start in (0..words.len()).step_by(8) {
        let word = u32::from_str_radix(words.get(start..start + 8)?, 16).ok()?;
        bytes.extend(word.to_ne_bytes());
    }
    let ip = match <[u8; 4]>::try_from(&*bytes) {
        Ok(v4) => IpAddr::V4(Ipv4Addr::from(v4)),
        Err(_) => IpAddr::V6(Ipv6Addr::from(<[u8; 16]>::try_from(&*bytes).ok()?)),
    };
    Some(SocketAddr::new(ip.to_canonical(), u16::from_str_radix(port, 16).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::net::{TcpListener, TcpStream};

    #[test]
    #[cfg(target_endian = "little")]
    fn connection_is_found_by_both_addresses() {
        let head = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt\n";
        let v4 = "   0: 0200000A:0016 0100000A:1388 01 00003E80:00000000 01:00000014 00000000  0\n";
        let v6 = "   1: 0000000000000000FFFF00000200000A:0016 0000000000000000FFFF00000100000A:1389 \
                  01 00000010:00000000 01:00000014\n";
        let table = format!("{head}{v4}{v6}");
        let bytes_of =
            |text: &str| TcpSendQueue::parse(text).and_then(|queue| queue.bytes_in(&table));
        assert_eq!(bytes_of("10.0.0.1 5000 10.0.0.2 22"), Some(16_000));
        assert_eq!(bytes_of("10.0.0.1 5001 10.0.0.2 22"), Some(16));
        assert_eq!(bytes_of("::ffff:10.0.0.1 5001 ::ffff:10.0.0.2 22"), Some(16));
        assert_eq!(bytes_of("10.0.0.1 5002 10.0.0.2 22"), None);
        for wrong in ["", "10.0.0.1 22", "a b c d", "10.0.0.1 5000 10.0.0.2 99999"] {
            assert_eq!(bytes_of(wrong), None, "{wrong}");
        }
        assert_eq!(
            TcpSendQueue::parse("10.0.0.1 5000 10.0.0.2 22").unwrap().bytes_in("nonsense\n0:\n"),
            None
        );
    }

    /// Checks that the kernel reports the bytes that the other end of a TCP connection has not
    /// read.
    #[test]
    #[cfg(target_os = "linux")]
    fn kernel_reports_unread_bytes() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut server = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (_client, from) = listener.accept().unwrap();
        let remote = listener.local_addr().unwrap();
        let text = format!("{} {} {} {}", remote.ip(), remote.port(), from.ip(), from.port());
        let Some(queue) = TcpSendQueue::find(&text) else {
            // Some containers hide the kernel's table `/proc/net/tcp`.
            assert!(!std::path::Path::new("/proc/net/tcp").exists(), "{text} is not bytes_of");
            return;
        };
        assert_eq!(queue.bytes(), Some(0));
        server.set_nonblocking(true).unwrap();
        while server.write(&[0; 1 << 16]).is_ok() {}
        assert!(queue.bytes().is_some_and(|bytes| bytes > 1 << 16));
    }
}
