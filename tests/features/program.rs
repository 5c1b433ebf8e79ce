//! Tests of features of the program: cap on rays per pixel, threads, edits during rendering,
//! demonstrations.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;
use zerkalo_render::{Options, SyncRender};
use zerkalo_scene::History;
use zerkalo_scene::edit::{Edit, EditError};

fn options() -> Options {
    render_options(sobol(1))
}

/// Returns two values for each tile: its samples per pixel, and `true` if the camera sees a
/// reflecting surface in it.
fn tiles(film: &Film, scene: &Scene) -> Vec<(u32, bool)> {
    let hits = first_hits(scene);
    let width = film.header.width;
    (0..film.tile_count())
        .map(|i| {
            let tile = film.tile(i).expect("every tile has samples");
            let [x, y] = [i % film.tile_columns(), i / film.tile_columns()].map(|n| n * TILE);
            let rows = y..(y + TILE).min(film.header.height);
            let pixels = rows.flat_map(|y| (x..(x + TILE).min(width)).map(move |x| y * width + x));
            (tile.counts.iter().sum(), pixels.into_iter().any(|p| hits[p].reflects))
        })
        .collect()
}

/// Checks a render of `tested` to a noise of `levels` 8-bit levels. If `cap` is not 0, the cap on
/// rays per pixel must end the render, and the largest number of samples of a tile with a
/// reflecting surface must be `cap`. If `cap` is 0, the noise must end the render, after more than
/// 16 samples in such a tile.
fn caps_rays(tested: &Scene, cap: u32, levels: f64) -> Verdict {
    let scene = sized(tested.clone(), [96, 72]);
    let stop = noise_stop(levels);
    let settings =
        Settings { adaptive: true, criterion: Criterion::Levels, rays_per_pixel: 0, stop };
    let mut render = SyncRender::new(&scene, &options(), settings, 2).map_err(|e| e.to_string())?;
    let reason = loop {
        if let Some(reason) = render.step() {
            break reason;
        }
    };
    let glossy = tiles(&render.state.film, &scene).into_iter().filter(|(_, g)| *g);
    let samples: Vec<u32> = glossy.map(|(samples, _)| samples).collect();
    let most = samples.iter().copied().max().unwrap_or(0);
    let noise = render.noise_levels().unwrap_or(f64::INFINITY);
    if cap > 0 {
        ensure(reason == StoppedBy::RaysPerPixel, || format!("ended by {}", reason.name()))?;
        // Reflecting tiles with little noise may have fewer samples than `cap`.
        ensure(most == cap, || format!("{samples:?} samples"))?;
        ensure(noise > levels, || format!("{noise} 8-bit levels"))
    } else {
        ensure(reason == StoppedBy::Noise, || format!("ended by {}", reason.name()))?;
        ensure(noise <= levels && most > 16, || format!("{noise} 8-bit levels, {most} samples"))
    }
}

#[test]
fn a13_rays_per_pixel() {
    let capped = shipped("rays-per-pixel.toml");
    let mut other = capped.clone();
    other.film.rays_per_pixel = 64;
    let mut without = capped.clone();
    without.film.rays_per_pixel = 0;
    caps_rays(&capped, 16, 1.0).unwrap();
    caps_rays(&other, 64, 0.5).unwrap();
    caps_rays(&without, 0, 1.0).unwrap();
    println!("without: {}", caps_rays(&without, 16, 1.0).unwrap_err());
    println!("64 for 16: {}", caps_rays(&other, 16, 0.5).unwrap_err());
    println!("16 for none: {}", caps_rays(&capped, 0, 1.0).unwrap_err());
}

/// Checks that the scene has the objects and materials of the thread experiment, which measures
/// times with different numbers of threads. Only times of the same scene are comparable.
fn is_the_experiment(scene: &Scene) -> Verdict {
    let materials_of = |key: &str| -> Vec<&Material> {
        let objects = scene.objects.iter().filter(|o| o.shape.key() == key);
        objects.map(|o| &scene.materials[&o.material]).collect()
    };
    let reflections = |key: &str| -> Vec<(f64, f64)> {
        materials_of(key).iter().map(|m| (m.reflection, m.roughness)).collect()
    };
    let speculars =
        |key: &str| -> Vec<f64> { materials_of(key).iter().map(|m| m.specular).collect() };
    let right = reflections("sphere") == [(0.7, 0.05), (0.0, 0.0)]
        && reflections("cube") == [(0.4, 0.03)]
        && (speculars("prism"), speculars("pyramid")) == (vec![0.2], vec![0.2])
        && (materials_of("platform").len(), materials_of("rectangle").len()) == (1, 1)
        && materials_of("rectangle")[0].reflection > 0.0
        && (scene.objects.len(), scene.lights.len()) == (7, 1);
    ensure(right, || "not the scene of the thread experiment".into())
}

/// Returns the film of an adaptive render by `threads` threads. The tiles of the film have
/// different sample counts.
fn film(scene: &Scene, seed: u64, threads: usize) -> Film {
    let mut rendering = begin(&sized(scene.clone(), [100, 70]), seed, Precision::Auto);
    let stop = spp_stop(96);
    follow(&mut rendering, settings(true, 0, stop), &pool(threads));
    rendering.film
}

/// Checks that the film of `scene` has the same bytes for 1, 2 and 7 threads, and that every tile
/// has samples. `seed_of` returns the seed for a number of threads.
fn threads_do_not_matter(scene: &Scene, seed_of: impl Fn(usize) -> u64) -> Verdict {
    is_the_experiment(scene)?;
    let one = film(scene, seed_of(1), 1);
    let counts: Vec<u32> =
        tiles(&one, &sized(scene.clone(), [100, 70])).iter().map(|t| t.0).collect();
    ensure(counts.iter().all(|n| *n >= 32), || format!("samples per tile: {counts:?}"))?;
    ensure(counts.iter().any(|n| *n != counts[0]), || "all tiles have equal counts".into())?;
    for threads in [2, 7] {
        let same = film(scene, seed_of(threads), threads).bytes() == one.bytes();
        ensure(same, || format!("{threads} threads make another film than one"))?;
    }
    Ok(())
}

#[test]
fn a14_threads() {
    let scene = shipped("thread-experiment.toml");
    threads_do_not_matter(&scene, |_| 3).unwrap();
    threads_do_not_matter(&scene, |threads| threads as u64).unwrap_err();
    let mut other = scene.clone();
    material(&mut other, "shiny").roughness = 0.1;
    threads_do_not_matter(&other, |_| 3).unwrap_err();
}

/// Width and height in pixels of the pictures after edits.
const SMALL: [u32; 2] = [40, 30];
/// Stop criterion of the pictures after edits.
const SPP: Stop =
    Stop { spp: Some(8), noise_levels: None, rmse_linear: None, error: None, seconds: None };

/// Client of a session, which renders scenes on its own thread while they are edited.
struct Desk {
    session: Session,
}

impl Desk {
    fn new() -> Self {
        let settings = settings(false, 0, SPP);
        Self { session: Session::new(2, options(), settings).unwrap() }
    }

    fn finished_picture(&mut self, scene: &Scene) -> Vec<[f64; 3]> {
        let mut generation = self.session.set_scene(Arc::new(scene.clone()));
        let end = Instant::now() + Duration::from_secs(60);
        while Instant::now() < end {
            let Some(snapshot) = self.session.wait(Duration::from_millis(100)) else { continue };
            let report = &snapshot.report;
            // A mix of roughnesses is rendered afresh, as `R` does.
            if report.mixed && report.generation == generation {
                generation = self.session.restart();
                continue;
            }
            if matches!(report.state, State::Finished(_)) && report.generation == generation {
                return self.session.with(|r, _| picture(r, Replicates::Both)).expect("a film");
            }
        }
        panic!("the session does not finish")
    }
}

/// Returns the picture of `scene` after the scene was saved and read again.
fn saved_and_rendered(scene: &Scene) -> Vec<[f64; 3]> {
    let text = scene.to_text();
    let read = Scene::parse(&text, "room.toml").unwrap_or_else(|e| panic!("{e}"));
    let mut rendering = begin(&read, 1, Precision::Auto);
    follow(&mut rendering, settings(false, 0, SPP), &pool(2));
    picture(&rendering, Replicates::Both)
}

type NamedEdit<'a> = (&'a str, Box<dyn Fn(&Scene) -> Result<Edit, EditError> + 'a>);

/// Returns the edit that sets the property `key` of a part of the scene. `label` is the part's
/// label in the outline.
fn set<'a>(label: &'a str, key: &'a str, text: &'a str) -> NamedEdit<'a> {
    let edit = move |scene: &Scene| {
        let subject = edit::outline(scene).into_iter().map(|(_, s)| s).find(|s| {
            // The mirror and its material have the same label.
            s.label(scene) == label && !(label == "mirror" && matches!(s, Target::Object(_)))
        });
        edit::set(scene, &subject.unwrap_or_else(|| panic!("no {label}")), key, text)
    };
    (key, Box::new(edit))
}

#[test]
fn a15_user_edits() {
    let mut edits = vec![
        set("lamp", "point.position", "-2 3 2"),
        set("lamp", "intensity", "0.4"),
        set("mirror", "roughness", "0.3"),
        set("camera", "eye", "-1.5 1.2 4"),
        set("camera", "target", "0.3 0.7 0"),
        set("ball", "shape.sphere.radius", "0.7"),
        set("cube", "shape.cube.rotation", "10"),
        set("red", "color", "0.2 0.3 0.9"),
        set("red", "specular", "0.9"),
        set("red", "reflection", "0.5"),
        set("red", "roughness", "0.4"),
    ];
    for kind in edit::object_kinds() {
        let name = kind.name.clone();
        edits.push(("add", Box::new(move |s| edit::add_object(s, &name, None))));
        edits.push((
            "move",
            Box::new(|s| edit::move_by(s, &Target::Object(s.objects.len() - 1), [-0.3, 0.2, 0.3])),
        ));
        edits.push(("remove", Box::new(|s| edit::delete(s, &Target::Object(s.objects.len() - 1)))));
    }
    edits.push(("add light", Box::new(|s| edit::add_light(s, "directional"))));

    let first = Arc::new(sized(shipped("mirror-room.toml"), SMALL));
    let mut desk = Desk::new();
    let mut history = History::new(Arc::clone(&first));
    let mut before = desk.finished_picture(&first);
    for (name, apply) in &edits {
        let edit = apply(history.scene()).unwrap_or_else(|refusal| panic!("{name}: {refusal:?}"));
        let (label, next) = (edit.label.clone(), Arc::new(edit.scene));
        let objects = next.objects.len() as i32 - history.scene().objects.len() as i32;
        let expected = match *name {
            "add" => 1,
            "remove" => -1,
            _ => 0,
        };
        assert_eq!(objects, expected, "{label}");
        let now = desk.finished_picture(&next);
        assert!(now == saved_and_rendered(&next), "{label}: not the picture of the edited scene");
        // An edit that the session ignored would leave the previous picture.
        assert!(now != before, "{label} changes nothing");
        assert!(history.record(next, &label, false), "{label}");
        before = now;
    }
    // The cap on rays leaves existing samples unchanged and limits the number of samples to come.
    let (_, cap) = set("film", "rays_per_pixel", "4");
    let capped = cap(history.scene()).unwrap().scene;
    let mut capped = Arc::new(capped);
    let sample_count = |scene: &Scene| {
        let settings = settings(false, 0, SPP);
        let mut render = SyncRender::new(scene, &options(), settings, 2).unwrap();
        while render.step().is_none() {}
        render.schedule.samples
    };
    assert!(sample_count(&capped) < sample_count(history.scene()));
    // Undoing all edits restores the scene and its picture.
    while let Some(label) = history.undo() {
        assert_ne!(label, "");
    }
    assert_eq!(history.scene(), &first);
    capped = Arc::clone(history.scene());
    assert!(desk.finished_picture(&capped) == saved_and_rendered(&first));
}

/// Checks that two scenes differ, and that `equalise`, which copies a part of the second scene to
/// the first, removes their only difference.
fn differ_only(left: &Scene, right: &Scene, equalise: impl Fn(&mut Scene, &Scene)) -> Verdict {
    ensure(left != right, || "the scenes are equal".into())?;
    let mut same = left.clone();
    equalise(&mut same, right);
    ensure(same == *right, || "the scenes have other differences, too".into())
}

/// Returns the brightness of the floor left of the ball, divided by that right of the ball, both
/// seen from above.
fn left_to_right(scene: &Scene) -> f64 {
    let mut scene = sized(scene.clone(), RASTER);
    let ball = scene.objects.iter().find(|o| o.name == "ball").unwrap().shape.clone();
    let Shape::Sphere(ball) = ball else { panic!("not a ball") };
    // Seen from above; only pixels that show the floor count.
    scene.camera.eye = [ball.center[0], 9.0, ball.center[2]];
    scene.camera.target = Some([ball.center[0], 0.0, ball.center[2]]);
    scene.camera.up = [0.0, 0.0, -1.0];
    scene.camera.view_angle = zerkalo_scene::camera::ViewAngle::Vertical(14.0);
    scene.objects.retain(|o| ["floor", "ball"].contains(&o.name.as_str()));
    let floor = number(&scene, "floor") as u32;
    let (hits, pixels) = (first_hits(&scene), without_noise(&scene));
    let side = |left: bool| -> f64 {
        let half = RASTER[0] as usize / 2;
        let indices = (0..hits.len()).filter(|i| (i % RASTER[0] as usize >= half) != left);
        let floor_indices = indices.filter(|i| hits[*i].object == Some(floor));
        floor_indices.map(|i| pixels[i].element_sum()).sum()
    };
    side(true) / side(false)
}

fn demonstrates_viewpoints([left, right]: [&Scene; 2]) -> Verdict {
    differ_only(left, right, |same, other| same.camera = other.camera.clone())?;
    hits_agree(left, left)?;
    hits_agree(right, right)?;
    ensure(left.camera.eye[0] < 0.0 && right.camera.eye[0] > 0.0, || "sides exchanged".into())
}

fn demonstrates_lights([left, right]: [&Scene; 2]) -> Verdict {
    differ_only(left, right, |same, other| same.lights = other.lights.clone())?;
    // A light on the left casts the ball's shadow to the right.
    let ratios = [left_to_right(left), left_to_right(right)];
    ensure(ratios[0] > 1.02 && ratios[1] < 0.98, || format!("left to right: {ratios:?}"))
}

fn demonstrates_roughness([sharp, blurred]: [&Scene; 2]) -> Verdict {
    differ_only(sharp, blurred, |same, other| {
        material(same, "mirror").roughness = other.materials["mirror"].roughness;
    })?;
    let both = [sharp, blurred].map(|s| s.materials["mirror"].roughness);
    ensure(both == [0.0, 0.3], || format!("roughness {both:?}"))?;
    agrees(sharp, sharp, 48)?;
    agrees(blurred, blurred, 48)
}

/// Two scenes, and the check that their pictures must pass.
type Demonstration<'a> = (&'a [Scene; 2], fn([&Scene; 2]) -> Verdict);

#[test]
fn a16_demonstrations() {
    let pair = |a: &str, b: &str| [shipped(a), shipped(b)];
    let viewpoints = pair("viewpoint-left.toml", "viewpoint-right.toml");
    let lights = pair("light-left.toml", "light-right.toml");
    let roughness = pair("roughness-0.toml", "roughness-0.3.toml");
    let demonstrations: [Demonstration; 3] = [
        (&viewpoints, demonstrates_viewpoints),
        (&lights, demonstrates_lights),
        (&roughness, demonstrates_roughness),
    ];
    for (i, (pair, check)) in demonstrations.iter().enumerate() {
        check([&pair[0], &pair[1]]).unwrap();
        for [a, b] in [[&pair[0], &pair[0]], [&pair[1], &pair[0]]] {
            println!("{}", check([a, b]).unwrap_err());
        }
        let (other, _) = demonstrations[(i + 1) % 3];
        println!("{}", check([&pair[0], &other[1]]).unwrap_err());
    }
}

/// Waits until the session has rendered the scene with the version number `generation`. Writes a
/// checkpoint after the first samples if `path` is given. Returns the bytes of the film, and the
/// number of rays.
fn film_of(session: &mut Session, generation: u64, path: Option<&Path>) -> (Vec<u8>, u64) {
    let mut path = path;
    loop {
        let snapshot = session.wait(Duration::from_secs(60)).expect("a report");
        let report = &snapshot.report;
        assert_eq!(report.generation, generation);
        if report.noise.is_some()
            && let Some(path) = path.take()
        {
            let (sender, receiver) = std::sync::mpsc::channel();
            let provenance = Provenance {
                source: String::new(),
                scene_hash: String::new(),
                sampler: SamplerKind::Sobol,
                adaptive: true,
            };
            session.submit(move |picture| {
                sender.send(picture.unwrap().checkpoint(&provenance)).unwrap();
            });
            receiver.recv().unwrap().expect("a picture").write(path, Existing::Replace).unwrap();
        }
        if let State::Finished(_) = report.state {
            let film = session.with(|state, _| state.film.bytes()).expect("a film");
            return (film, report.rays);
        }
    }
}

#[test]
fn a19_checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zk");
    let scene = Arc::new(sized(shipped("mirror-room.toml"), [96, 72]));
    let stop = noise_stop(0.7);
    let settings =
        Settings { adaptive: true, criterion: Criterion::Levels, rays_per_pixel: 0, stop };
    let start = || Session::new(2, options(), settings).unwrap();
    let mut first = start();
    let generation = first.set_scene(Arc::clone(&scene));
    let whole = film_of(&mut first, generation, Some(&path));
    let checkpoint = Checkpoint::read(&path).unwrap();
    let samples = FilmReader::open(&path).unwrap().read().unwrap().film.samples();
    let mut second = start();
    let generation = second.continue_from(Arc::clone(&scene), checkpoint);
    let (film, rays) = film_of(&mut second, generation, None);
    assert!(film == whole.0, "other samples after {samples}");
    assert_eq!(rays, whole.1, "rays after {samples} samples");
    // The checkpoint was taken before the end.
    let end = second.with(|state, _| state.film.samples()).unwrap();
    assert!(samples < end, "{samples} samples of {end}");
}
