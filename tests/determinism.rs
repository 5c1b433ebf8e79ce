//! Determinism: a sample is a pure function of the seed, the pixel, the replicate and the sample
//! index. The bytes of the film do not depend on the number of threads, the order of tracing, the
//! packet layout or the division into parts.

use crate::harness::*;

const PRECISIONS: [Precision; 2] = [Precision::Single, Precision::Double];
const SEED: u64 = 29;
/// Film size that is not a multiple of the tile size, so that tiles at the edges are narrower than
/// a packet.
const SIZE: [u32; 2] = [37, 35];

/// Returns scenes that together contain every lobe, highlight and kind of light, several light
/// groups, a lens, and paths that branch.
fn scenes() -> Vec<(String, Scene)> {
    "mirror-room mirror-room-physical light-groups lobe-ggx glass depth-of-field many-lights"
        .split(' ')
        .map(|name| (name.to_string(), sized(shipped(&format!("{name}.toml")), SIZE)))
        .collect()
}

fn film_of_samples(scene: &Scene, precision: Precision, count: u32) -> Film {
    film_of_ranges(scene, precision, &[(0, count), (0, count)])
}

/// Returns the film of two ranges of samples, one for each replicate. A range is a first index and
/// a count.
fn film_of_ranges(scene: &Scene, precision: Precision, ranges: &[(u32, u32)]) -> Film {
    let mut rendering = begin(scene, SEED, precision);
    let pool = pool(2);
    for (replicate, (first, count)) in ranges.iter().enumerate() {
        if *count > 0 {
            let wave = wave(&rendering.film, replicate, *first, *count);
            trace(&mut rendering, &wave, &pool);
        }
    }
    rendering.film
}

#[test]
fn extreme_29_determinism() {
    for (name, scene) in scenes() {
        for precision in PRECISIONS {
            let expected = film_of_samples(&scene, precision, 19).bytes();
            for threads in [1, 2, 7] {
                let pool = pool(threads);
                let mut rng = Numbers::new(threads as u64);
                let mut rendering = begin(&scene, SEED, precision);
                for replicate in [1, 0] {
                    let mut wave = wave(&rendering.film, replicate, 0, 19);
                    rng.shuffle(&mut wave.jobs);
                    trace(&mut rendering, &wave, &pool);
                }
                let same = rendering.film.bytes() == expected;
                assert!(same, "{name} in {precision:?}, {threads} threads");
            }
        }
    }
    report(29, "both", "threads 1, 2, 7: the same bytes");
}

#[test]
fn extreme_29_sum_of_parts_does_not_depend_on_order() {
    // Ranges of samples of both replicates in each part. No range is aligned to a packet. One range
    // of replicate A and one of replicate B are empty.
    let parts: [[(u32, u32); 2]; 4] =
        [[(0, 3), (0, 13)], [(3, 18), (13, 1)], [(21, 0), (14, 16)], [(21, 9), (30, 0)]];
    for (name, scene) in scenes() {
        for precision in PRECISIONS {
            let expected = film_of_samples(&scene, precision, 30).bytes();
            let films = parts.map(|ranges| film_of_ranges(&scene, precision, &ranges));
            let mut order = [0, 1, 2, 3];
            for seed in 0..6 {
                Numbers::new(seed).shuffle(&mut order);
                let mut sum = Film::new(films[0].header.clone());
                order.iter().for_each(|i| sum.add(&films[*i]).unwrap());
                assert!(sum.bytes() == expected, "{name} in {precision:?}, order {order:?}");
            }
        }
    }
    report(29, "both", "parts in 6 orders: the same bytes");
}

/// Checks that a render that is stopped within a wave can be resumed. A second render traces the
/// remaining jobs, as the successor of a killed process would. The sum of both films must equal the
/// film of an uninterrupted render.
#[test]
fn extreme_29_stopped_and_resumed() {
    let pool = pool(2);
    for (name, scene) in scenes() {
        for precision in PRECISIONS {
            let expected = film_of_samples(&scene, precision, 19).bytes();
            for pause in [None, Some(0), Some(300), Some(2000)] {
                let (mut stopped, mut resumed) =
                    (begin(&scene, SEED, precision), begin(&scene, SEED, precision));
                for replicate in [0, 1] {
                    let all = wave(&stopped.film, replicate, 0, 19);
                    let cancel = AtomicBool::new(pause.is_none());
                    let report = std::thread::scope(|scope| {
                        scope.spawn(|| {
                            std::thread::sleep(Duration::from_micros(pause.unwrap_or(0)));
                            cancel.store(true, Ordering::Relaxed);
                        });
                        stopped.trace_wave(&all, &pool, &cancel)
                    });
                    let mut remaining = all.clone();
                    let mut done = report.iter().map(Option::is_some);
                    remaining.jobs.retain(|_| !done.next().unwrap());
                    assert!(pause.is_some() || remaining.jobs.len() == all.jobs.len());
                    trace(&mut resumed, &remaining, &pool);
                }
                resumed.film.add(&stopped.film).unwrap();
                let same = resumed.film.bytes() == expected;
                assert!(same, "{name} in {precision:?}, stopped after {pause:?} us");
            }
        }
    }
    report(29, "both", "stopped and resumed: the same bytes");
}

/// Checks that packets of one pixel and of several pixels trace the same samples. A wave is a set
/// of concurrent tracing jobs. Waves of few samples make packets of several pixels; a wave of sixteen
/// samples makes packets of one pixel.
#[test]
fn film_does_not_depend_on_pixels_per_packet_in_any_scene() {
    let pool = pool(2);
    let mut differing = Vec::new();
    for (name, scene) in all_shipped() {
        // The picture has four tiles. Three of them are narrower or lower than a full tile.
        let scene = sized(scene, [18, 17]);
        for precision in PRECISIONS {
            let expected = film_of_samples(&scene, precision, 16).bytes();
            for counts in [&[1u32, 1, 2, 4, 8] as &[u32], &[5, 11]] {
                let mut rendering = begin(&scene, SEED, precision);
                let mut first = 0;
                for count in counts {
                    uniform(&mut rendering, first, *count, &pool);
                    first += count;
                }
                if rendering.film.bytes() != expected {
                    differing.push(format!("{name} in {precision:?}, waves of {counts:?}"));
                }
            }
        }
    }
    assert!(differing.is_empty(), "{}", differing.join("\n"));
}

#[test]
fn interleaved_first_pass_equals_a_plain_wave() {
    let pool = pool(2);
    // The picture of this scene is so wide that some pairs of tiles in a row have no packet in
    // common. Parts of the picture are black, and the scene has a BVH.
    let wide = ("wide".to_string(), sized(shipped("reflecting-tracks.toml"), [300, 40]));
    for (name, scene) in scenes().into_iter().chain([wide]) {
        for precision in PRECISIONS {
            let mut rendering = begin(&scene, SEED, precision);
            let first = wave(&rendering.film, 0, 0, 1);
            let mut updates = 0;
            let report =
                rendering.trace_first_pass(&first, &pool, &AtomicBool::new(false), &mut |film| {
                    assert!(film.samples() > 0);
                    updates += 1;
                });
            assert!(report.is_some() && updates > 0);
            for (replicate, first, count) in [(1, 0, 1), (0, 1, 15), (1, 1, 15)] {
                let wave = wave(&rendering.film, replicate, first, count);
                trace(&mut rendering, &wave, &pool);
            }
            let expected = film_of_samples(&scene, precision, 16).bytes();
            assert!(rendering.film.bytes() == expected, "{name} in {precision:?}");
        }
    }
}

#[test]
fn reused_film_equals_a_new_film() {
    let (_, scene) = &scenes()[0];
    let mut other = scene.clone();
    other.camera.eye[0] += 0.5;
    let options = render_options(sobol(SEED));
    let mut rendering = RenderState::new(&Arc::new(other.clone()), &options, None).unwrap();
    uniform(&mut rendering, 0, 8, &pool(2));
    let mut rendering =
        RenderState::new(&Arc::new(scene.clone()), &options, Some(rendering)).unwrap();
    uniform(&mut rendering, 0, 8, &pool(2));
    assert!(rendering.film.bytes() == film_of_samples(scene, Precision::Auto, 8).bytes());
}
