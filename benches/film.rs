//! Cost of film operations other than tracing: estimation of a tile's noise, conversion to a
//! displayed picture, addition of films, reading and writing of files.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use zerkalo_render::film::testing::{TestFilm, header};
use zerkalo_render::film::{
    Display, Estimator, Film, Header, LightWeights, TILE_PIXELS, Thumbnail,
};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_scene::Tone;
use zerkalo_world::Precision;

/// Returns a film with `groups` light groups that shows a noisy gradient. Each pixel has two
/// replicates (halves of the samples) of 64 samples each. The noise is estimated from the
/// difference between the replicates.
fn film(width: usize, height: usize, groups: usize) -> Film {
    let scales = vec![2f64.powi(28); groups];
    let precision = Precision::Single;
    let mut film = Film::new(Header { width, height, scales, seed: 1, precision });
    let all: Vec<_> = (0..film.tile_count()).collect();
    let mut state = 1u64;
    for slot in film.slots(&all) {
        let [x0, y0] = slot.origin;
        let tile = slot.prepare();
        for (replicate, pixel) in (0..2).flat_map(|r| (0..TILE_PIXELS).map(move |p| (r, p))) {
            let (x, y) = (x0 + pixel % 16, y0 + pixel / 16);
            let values: Vec<_> = (0..groups * 3)
                .map(|c| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let noise = (state >> 40) as f64 / 16_777_216.0;
                    let gradient = (x * (c + 1) + y) as f64 / (width * (c + 1) + height) as f64;
                    (64.0 * 2f64.powi(28) * (gradient + 0.02 * noise) / groups as f64) as i64
                })
                .collect();
            tile.add(replicate, pixel, &values);
        }
        tile.advance(0, 64);
        tile.advance(1, 64);
    }
    film
}

fn white(groups: usize) -> LightWeights {
    LightWeights { weights: vec![[1.0; 3]; groups] }
}

fn noise(c: &mut Criterion) {
    let mut group = c.benchmark_group("noise of a tile");
    for groups in [1, 4] {
        let film = film(640, 480, groups);
        for tone in Tone::ALL {
            let name = tone.name();
            let display = Display { exposure_ev: 0.0, tone };
            let estimator = Estimator::new(&film.header.scales, &white(groups), &display);
            let mut tile = (0..film.tile_count()).cycle();
            let id = BenchmarkId::new(format!("{groups} groups"), name);
            group.bench_function(id, |b| {
                b.iter(|| estimator.tile(film.tile(tile.next().unwrap()).unwrap()));
            });
        }
    }
}

fn pictures(c: &mut Criterion) {
    let mut group = c.benchmark_group("1920x1080");
    group.sample_size(10);
    let one = film(1920, 1080, 1);
    let other = film(1920, 1080, 1);
    group.bench_function("resampled to 200x110", |b| {
        b.iter(|| Thumbnail::of_film(&one, 200, 110).mixed(&white(1)));
    });
    group.bench_function("add", |b| {
        let mut sum = film(1920, 1080, 1);
        b.iter(|| sum.add(black_box(&other)));
    });
    let dir = tempfile::tempdir().expect("a temporary directory");
    for (name, depth) in
        [("8.png", Depth::Eight), ("16.png", Depth::Sixteen), ("32.exr", Depth::Eight)]
    {
        let target = ImageOutput::from_path(dir.path().join(name)).expect("a known extension");
        let header = header(&one);
        group.bench_function(name, |b| b.iter(|| target.write(&header, depth, &mut &one)));
        let bytes = std::fs::metadata(&target.path).map_or(0, |m| m.len());
        println!("{name}: {bytes} bytes");
    }
}

criterion_group!(benches, noise, pictures);
criterion_main!(benches);
