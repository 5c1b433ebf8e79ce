//! Test of rendering in regions, the feature for big pictures.

use crate::features::row::*;
use crate::harness::*;
use zerkalo_render::RegionRender;

const SIZE: [u32; 2] = [100, 70];
const SEED: u64 = 5;

/// Renders `scene` in regions of `rows` rows. Compares each row with `whole`, a uniform render of
/// the whole picture.
fn regions_equal(whole: &Film, scene: &Scene, rows: u32) -> Verdict {
    let scene = Arc::new(sized(scene.clone(), SIZE));
    let options = render_options(sobol(SEED));
    let stop = spp_stop(8);
    let mut observe = |_: &_| Ok(());
    let how = settings(false, 0, stop);
    let mut render = RegionRender::new(&scene, &options, how, rows, 2)?;
    let mix = begin(&scene, SEED, Precision::Auto).weights;
    let mut films = 0;
    for y in 0..SIZE[1] as usize {
        let film = render.film_with_row(y, &mut observe).map_err(|e| e.to_string())?;
        films += u32::from(y == film.first_row);
        for replicates in [Replicates::A, Replicates::B] {
            let region = film.row(y - film.first_row, replicates, &mix);
            let expected = whole.row(y, replicates, &mix);
            ensure(region == expected, || format!("row {y} of regions of {rows} rows differs"))?;
        }
    }
    ensure(films == SIZE[1].div_ceil(rows), || format!("{films} regions of {rows} rows"))
}

#[test]
fn e3_regions() {
    let mut state = begin(&sized(shipped("mirror-room.toml"), SIZE), SEED, Precision::Auto);
    follow(&mut state, settings(false, 0, spp_stop(8)), &pool(2));
    let whole = state.film;
    let check = |scene: &Scene| {
        [16, 32, 48, 80].iter().try_for_each(|rows| regions_equal(&whole, scene, *rows))
    };
    row(
        "mirror-room.toml",
        check,
        &[
            ("another mirror", &|s| material(s, "mirror").roughness = 0.3),
            ("another camera", &|s| s.camera.eye[0] += 0.1),
            ("no anti-aliasing", &|s| s.film.filter = Filter::Point),
        ],
    );
}
