//! Shares of the bounces in the noise, against an experiment: paths that end earlier.

use super::*;
use zerkalo_render::BOUNCE_SHARES;

/// Largest difference of a share from the experiment.
const TOLERANCE: f64 = 0.15;

/// Returns the pictures of several seeds with 32 samples per pixel and at most `bounces` bounces.
fn pictures(scene: &Scene, bounces: u32) -> Vec<Vec<[f64; 3]>> {
    let mut scene = scene.clone();
    scene.trace.max_depth = scene.trace.max_depth.min(bounces);
    scene.trace.max_diffuse_depth = scene.trace.max_diffuse_depth.min(bounces);
    let picture = |seed| {
        let mut session = new_session(2, seed, spp_stop(32), false);
        finish(&mut session, &scene);
        let rows = session.with(|RenderState { film, weights, .. }, _| {
            let rows = (0..film.header.height).map(|y| film.row(y, Replicates::Both, weights));
            rows.flatten().collect()
        });
        rows.unwrap()
    };
    (5..11).map(picture).collect()
}

fn check(name: &str) {
    let scene = sized(shipped(name), [96, 72]);
    let mut session = new_session(2, 3, spp_stop(32), false);
    finish(&mut session, &scene);
    let (sender, receiver) = channel();
    session.submit(move |picture| sender.send(picture.unwrap().bounce_shares(1.0)).unwrap());
    let measured = receiver.recv_timeout(PATIENCE).unwrap().unwrap();
    let limited = [0, 1, 2, u32::MAX].map(|bounces| pictures(&scene, bounces));
    // The errors are those of the displayed picture with all bounces.
    let whole = &limited[BOUNCE_SHARES - 1];
    let mean = |i: usize, c: usize| {
        whole.iter().map(|picture| picture[i][c]).sum::<f64>() / whole.len() as f64
    };
    let error = |pair: &[Vec<[f64; 3]>], i: usize| {
        let levels = |sign: f64| {
            let half = |c: usize| 0.5 * sign * (pair[0][i][c] - pair[1][i][c]);
            Display::default().levels([0, 1, 2].map(|c| (mean(i, c) + half(c)).max(0.0)))
        };
        let (above, below) = (levels(1.0), levels(-1.0));
        (0..3).map(|c| (above[c] - below[c]).powi(2)).sum::<f64>()
    };
    let errors = limited.each_ref().map(|pictures| {
        let pairs = pictures.chunks(2);
        pairs.map(|pair| (0..pair[0].len()).map(|i| error(pair, i)).sum::<f64>()).sum::<f64>()
    });
    let truth: [f64; BOUNCE_SHARES] = std::array::from_fn(|k| {
        (errors[k] - if k == 0 { 0.0 } else { errors[k - 1] }) / errors[BOUNCE_SHARES - 1]
    });
    let apart = (0..BOUNCE_SHARES).map(|k| (measured[k] - truth[k]).abs()).fold(0.0, f64::max);
    println!("{name}: measured {measured:.2?}, by experiment {truth:.2?}, {apart:.2} apart");
    assert!(apart <= TOLERANCE || std::env::var_os("ZERKALO_ALL").is_some(), "{name}");
}

#[test]
fn noise_by_bounce_is_that_of_shorter_paths() {
    check("mirror-room.toml");
}

/// `cargo test --release --test program noise_by_bounce -- --ignored --nocapture`
#[test]
#[ignore = "takes a minute"]
fn noise_by_bounce_of_ten_scenes() {
    for name in [
        "lamp-and-mirror.toml",
        "gallery-metals.toml",
        "gallery-glass.toml",
        "gallery-three-balls.toml",
        "gallery-triptych.toml",
        "gallery-knot.toml",
        "gallery-water.toml",
        "gallery-still-life.toml",
        "gallery-dusk.toml",
        "gallery-skylight.toml",
    ] {
        check(name);
    }
}
