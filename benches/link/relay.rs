//! Relay that limits the rate of the server's output and delays both directions. It reads from the
//! server only as fast as it transmits, so that the server's TCP send queue fills as on a slow
//! connection.

use rustix::net::sockopt::set_socket_recv_buffer_size;
use rustix::net::{AddressFamily, SocketType, connect, socket};
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Sizes in bytes of the receive buffer of the relay's socket to the server, as a connection has it
/// and as a jump host has it. The kernel acknowledges all bytes that reach the buffer, even if the
/// relay has not read them yet. A large buffer therefore accepts bytes faster than the simulated
/// connection.
pub const RECEIVE_BUFFERS: [usize; 2] = [4 << 10, 48 << 10];
/// Largest number of bytes that the relay forwards at once.
const PIECE: usize = 700;

/// Relay that listens at an address and forwards each connection to the server.
pub struct Relay {
    pub address: SocketAddr,
}

/// Bytes that the relay holds back until their times of arrival.
#[derive(Default)]
struct Pipe {
    pieces: VecDeque<(Instant, Vec<u8>)>,
    closed: bool,
}

impl Relay {
    /// Starts a relay to the server at `target`. The rate of the server's output is limited to
    /// `rate` bytes per second. Both directions are delayed by `one_way`. `buffer` is the size of the
    /// receive buffer in bytes.
    pub fn start(
        target: SocketAddr,
        rate: f64,
        one_way: Duration,
        buffer: usize,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let Ok(server) = connected(target, buffer) else { continue };
                let _ = client.set_nodelay(true).and_then(|()| server.set_nodelay(true));
                let (Ok(up), Ok(down)) = (client.try_clone(), server.try_clone()) else { continue };
                forward(up, server, f64::INFINITY, one_way);
                forward(down, client, rate, one_way);
            }
        });
        Ok(Self { address })
    }
}

/// Connects to the server at `target` with a receive buffer of `buffer` bytes.
fn connected(target: SocketAddr, buffer: usize) -> io::Result<TcpStream> {
    let socket = socket(AddressFamily::INET, SocketType::STREAM, None)?;
    set_socket_recv_buffer_size(&socket, buffer)?;
    connect(&socket, &target)?;
    Ok(TcpStream::from(socket))
}

/// Forwards one direction of a connection, from `from` to `to`, at no more than `rate` bytes per
/// second and with a delay of `one_way`.
fn forward(mut from: TcpStream, mut to: TcpStream, rate: f64, one_way: Duration) {
    let pipe = Arc::new((Mutex::new(Pipe::default()), Condvar::new()));
    let other = Arc::clone(&pipe);
    thread::spawn(move || {
        // The pieces are small, so that the bytes arrive at a steady rate and not in bursts.
        let mut buffer = [0; PIECE];
        let mut free_at = Instant::now();
        loop {
            let read = from.read(&mut buffer).unwrap_or(0);
            free_at = free_at.max(Instant::now()) + Duration::from_secs_f64(read as f64 / rate);
            let (pipe, changed) = &*pipe;
            let mut pipe = pipe.lock().unwrap();
            pipe.closed = read == 0;
            if read > 0 {
                pipe.pieces.push_back((free_at + one_way, buffer[..read].to_vec()));
            }
            changed.notify_all();
            drop(pipe);
            if read == 0 {
                break;
            }
            // The next piece is read when this one has been transmitted.
            thread::sleep(free_at.saturating_duration_since(Instant::now()));
        }
    });
    thread::spawn(move || {
        let (shared, changed) = &*other;
        loop {
            let mut pipe = changed
                .wait_while(shared.lock().unwrap(), |p| p.pieces.is_empty() && !p.closed)
                .unwrap();
            let Some((at, piece)) = pipe.pieces.pop_front() else { break };
            drop(pipe);
            thread::sleep(at.saturating_duration_since(Instant::now()));
            if to.write_all(&piece).is_err() {
                break;
            }
        }
        let _ = to.shutdown(Shutdown::Write);
    });
}
