//! A slow line in user space: what the server sends is limited to a rate, and everything comes late.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes that a line takes before the sender has to wait: as much as routers hold at this rate.
const HELD: usize = 64 << 10;

/// A listening relay. Every connection to it goes on to the server.
pub struct Relay {
    pub address: SocketAddr,
}

/// Pieces on their way.
#[derive(Default)]
struct Pipe {
    pieces: VecDeque<(Instant, Vec<u8>)>,
    bytes: usize,
    closed: bool,
}

impl Relay {
    /// To the server at `target`; what comes from it is limited to `rate` bytes a second, and
    /// everything takes `one_way` longer.
    pub fn start(target: SocketAddr, rate: f64, one_way: Duration) -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let Ok(server) = TcpStream::connect(target) else { continue };
                let _ = client.set_nodelay(true).and_then(|()| server.set_nodelay(true));
                let (Ok(up), Ok(down)) = (client.try_clone(), server.try_clone()) else { continue };
                carry(up, server, f64::INFINITY, one_way);
                carry(down, client, rate, one_way);
            }
        });
        Ok(Self { address })
    }
}

/// One direction.
fn carry(mut from: TcpStream, mut to: TcpStream, rate: f64, one_way: Duration) {
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
                changed.wait_while(pipe.lock().unwrap(), |pipe| pipe.bytes > HELD).unwrap();
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
        let (pipe, changed) = &*other;
        loop {
            let mut held = changed
                .wait_while(pipe.lock().unwrap(), |p| p.pieces.is_empty() && !p.closed)
                .unwrap();
            let Some((at, piece)) = held.pieces.pop_front() else { break };
            drop(held);
            thread::sleep(at.saturating_duration_since(Instant::now()));
            if to.write_all(&piece).is_err() {
                break;
            }
            pipe.lock().unwrap().bytes -= piece.len();
            changed.notify_all();
        }
        let _ = to.shutdown(Shutdown::Write);
    });
}
