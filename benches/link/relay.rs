//! Relay that limits the server's output to a rate and delays both directions.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes in the relay beyond which the sender waits, as in a router at this rate.
const MAX_BUFFERED: usize = 64 << 10;

/// Listening relay. It forwards each connection to the server.
pub struct Relay {
    pub address: SocketAddr,
}

/// Bytes in transmission with their times of arrival.
#[derive(Default)]
struct Pipe {
    pieces: VecDeque<(Instant, Vec<u8>)>,
    bytes: usize,
    closed: bool,
}

impl Relay {
    /// Starts a relay to the server at `target`. Its output is limited to `rate` bytes per second; both
    /// directions are delayed by `one_way`.
    pub fn start(target: SocketAddr, rate: f64, one_way: Duration) -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let Ok(server) = TcpStream::connect(target) else { continue };
                let _ = client.set_nodelay(true).and_then(|()| server.set_nodelay(true));
                let (Ok(up), Ok(down)) = (client.try_clone(), server.try_clone()) else { continue };
                forward(up, server, f64::INFINITY, one_way);
                forward(down, client, rate, one_way);
            }
        });
        Ok(Self { address })
    }
}

/// Forwards one direction.
fn forward(mut from: TcpStream, mut to: TcpStream, rate: f64, one_way: Duration) {
    let pipe = Arc::new((Mutex::new(Pipe::default()), Condvar::new()));
    let other = Arc::clone(&pipe);
    thread::spawn(move || {
        // Small pieces, so that the rate is even.
        let mut buffer = [0; 1400];
        let mut free_at = Instant::now();
        loop {
            let read = from.read(&mut buffer).unwrap_or(0);
            let (pipe, changed) = &*pipe;
            let mut pipe =
                changed.wait_while(pipe.lock().unwrap(), |pipe| pipe.bytes > MAX_BUFFERED).unwrap();
            if read == 0 {
                pipe.closed = true;
                changed.notify_all();
                break;
            }
            free_at = free_at.max(Instant::now()) + Duration::from_secs_f64(read as f64 / rate);
            pipe.bytes += read;
            pipe.pieces.push_back((free_at + one_way, buffer[..read].to_vec()));
            changed.notify_all();
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
            shared.lock().unwrap().bytes -= piece.len();
            changed.notify_all();
        }
        let _ = to.shutdown(Shutdown::Write);
    });
}
