//! What the program does with a scene: rays per pixel, threads, edits while it runs, demonstrations.

use crate::beside::agrees;
use crate::row::{Verdict, ensure, material, number};
use crate::sight::{RASTER, sees, sights};
use crate::support::{begin, follow, picture, pool, settings, shipped, sized};
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo::film::{Display, Film, Replicates, TILE};
use zerkalo::material::Material;
use zerkalo::render::schedule::{Criterion, Settings, Stop, StoppedBy};
use zerkalo::render::session::{Session, State};
use zerkalo::render::{Options, SyncRender};
use zerkalo::sampling::{SampleSettings, SamplerKind};
use zerkalo::scene::edit::{self, Edit, EditError, Target};
use zerkalo::scene::{Document, History, Scene};
use zerkalo::shape::Shape;
use zerkalo::world::{self, Precision};

fn options() -> Options {
    Options {
        world: world::Options::default(),
        sampling: SampleSettings { seed: 1, kind: SamplerKind::Sobol },
        display: Display::default(),
    }
}

/// Samples of each tile's pixels, and whether the camera sees something that reflects in it.
fn tiles(film: &Film, scene: &Scene) -> Vec<(u32, bool)> {
    let seen = sights(scene);
    let width = film.width();
    (0..film.tile_count())
        .map(|i| {
            let tile = film.tile(i).expect("every tile has samples");
            let [x, y] = film.tile_origin(i);
            let rows = y..(y + TILE).min(film.height());
            let pixels = rows.flat_map(|y| (x..(x + TILE).min(width)).map(move |x| y * width + x));
            (tile.counts().iter().sum(), pixels.into_iter().any(|p| seen[p].reflects))
        })
        .collect()
}

/// Follows the scene's own cap towards a noise of `codes`. With `cap` no tile that reflects has more samples,
/// and that is why it ends; with 0 the noise is reached, and it takes more.
fn caps_rays(shown: &Scene, cap: u32, codes: f64) -> Verdict {
    let scene = sized(shown.clone(), [96, 72]);
    let stop = Stop { noise_codes: Some(codes), ..Stop::default() };
    let asked = Settings { adaptive: true, criterion: Criterion::Codes, rays_per_pixel: 0, stop };
    let mut course = SyncRender::new(&scene, &options(), asked, 2).map_err(|e| e.to_string())?;
    let reason = loop {
        if let Some(reason) = course.step() {
            break reason;
        }
    };
    let glossy = tiles(&course.rendering().film, &scene).into_iter().filter(|(_, g)| *g);
    let samples: Vec<u32> = glossy.map(|(samples, _)| samples).collect();
    let most = samples.iter().copied().max().unwrap_or(0);
    let noise = course.noise_codes().unwrap_or(f64::INFINITY);
    if cap > 0 {
        ensure(reason == StoppedBy::RaysPerPixel, || format!("ended by {}", reason.name()))?;
        // Tiles with little noise may stay below it.
        ensure(most == cap, || format!("{samples:?} samples"))?;
        ensure(noise > codes, || format!("{noise} codes"))
    } else {
        ensure(reason == StoppedBy::Noise, || format!("ended by {}", reason.name()))?;
        ensure(noise <= codes && most > 16, || format!("{noise} codes by {most} samples"))
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

/// What the scene has to hold for times on it to be comparable.
fn is_the_experiment(scene: &Scene) -> Verdict {
    let of = |key: &str| -> Vec<&Material> {
        let those = scene.objects.iter().filter(|o| o.shape.key() == key);
        those.map(|o| &scene.materials[&o.material]).collect()
    };
    let reflections = |key: &str| -> Vec<(f64, f64)> {
        of(key).iter().map(|m| (m.reflection, m.roughness)).collect()
    };
    let speculars = |key: &str| -> Vec<f64> { of(key).iter().map(|m| m.specular).collect() };
    let right = reflections("sphere") == [(0.7, 0.05), (0.0, 0.0)]
        && reflections("cube") == [(0.4, 0.03)]
        && (speculars("prism"), speculars("pyramid")) == (vec![0.2], vec![0.2])
        && (of("platform").len(), of("rectangle").len()) == (1, 1)
        && of("rectangle")[0].reflection > 0.0
        && (scene.objects.len(), scene.lights.len()) == (7, 1);
    ensure(right, || "another scene than the one that times are compared on".into())
}

/// The film of a render by `threads` threads that gives tiles different counts.
fn film(scene: &Scene, seed: u64, threads: usize) -> Film {
    let mut rendering = begin(&sized(scene.clone(), [100, 70]), seed, Precision::Auto);
    let stop = Stop { spp: Some(96), ..Stop::default() };
    follow(&mut rendering, settings(true, 0, stop), &pool(threads));
    rendering.film
}

/// Any number of threads fills the film with the same bytes, and every pixel of it.
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

/// Raster and samples of the pictures that follow edits.
const SMALL: [u32; 2] = [40, 30];
const SPP: Stop = Stop { spp: Some(8), noise_codes: None, rmse_linear: None, seconds: None };

/// A session that shows scenes while they are edited.
struct Desk {
    session: Session,
}

impl Desk {
    fn new() -> Self {
        let asked = settings(false, 0, SPP);
        Self { session: Session::new(2, options(), asked).unwrap() }
    }

    /// The session's picture of `scene` once it rests.
    fn shows(&mut self, scene: &Scene) -> Vec<[f64; 3]> {
        let generation = self.session.set_scene(Arc::new(scene.clone()));
        let end = Instant::now() + Duration::from_secs(60);
        while Instant::now() < end {
            let Some(snapshot) = self.session.wait(Duration::from_millis(100)) else { continue };
            let report = &snapshot.report;
            if matches!(report.state, State::Finished(_)) && report.generation == generation {
                return self.session.with(|r, _| picture(r, Replicates::Both)).expect("a film");
            }
        }
        panic!("the session does not come to rest")
    }
}

/// The picture of a scene that is read from the file that would be saved now.
fn saved_and_rendered(scene: &Scene) -> Vec<[f64; 3]> {
    let text = Document::new(scene, "room.toml").text().to_string();
    let read = Scene::parse(&text, "room.toml").unwrap_or_else(|e| panic!("{e}"));
    let mut rendering = begin(&read, 1, Precision::Auto);
    follow(&mut rendering, settings(false, 0, SPP), &pool(2));
    picture(&rendering, Replicates::Both)
}

/// One edit of a scene, by a name.
type Act<'a> = (&'a str, Box<dyn Fn(&Scene) -> Result<Edit, EditError> + 'a>);

/// Sets `key` of what is called by `label` in the outline.
fn set<'a>(label: &'a str, key: &'a str, text: &'a str) -> Act<'a> {
    let act = move |scene: &Scene| {
        let subject = edit::outline(scene).into_iter().map(|(_, s)| s).find(|s| {
            // The mirror's material is called as the mirror is.
            s.label(scene) == label && !(label == "mirror" && matches!(s, Target::Object(_)))
        });
        edit::set(scene, &subject.unwrap_or_else(|| panic!("no {label}")), key, text)
    };
    (key, Box::new(act))
}

#[test]
fn a15_user_edits() {
    let mut acts = vec![
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
        acts.push(("add", Box::new(move |s| edit::add_object(s, &name, None))));
        acts.push((
            "move",
            Box::new(|s| edit::move_by(s, &Target::Object(s.objects.len() - 1), [-0.3, 0.2, 0.3])),
        ));
        acts.push(("remove", Box::new(|s| edit::delete(s, &Target::Object(s.objects.len() - 1)))));
    }
    acts.push(("add light", Box::new(|s| edit::add_light(s, "directional"))));

    let first = Arc::new(sized(shipped("mirror-room.toml"), SMALL));
    let mut desk = Desk::new();
    let mut history = History::new(Arc::clone(&first));
    let mut before = desk.shows(&first);
    for (name, act) in &acts {
        let edit = act(history.scene()).unwrap_or_else(|refusal| panic!("{name}: {refusal:?}"));
        let (label, next) = (edit.label.clone(), Arc::new(edit.scene));
        let objects = next.objects.len() as i32 - history.scene().objects.len() as i32;
        let expected = match *name {
            "add" => 1,
            "remove" => -1,
            _ => 0,
        };
        assert_eq!(objects, expected, "{label}");
        let now = desk.shows(&next);
        assert!(now == saved_and_rendered(&next), "{label}: not the picture of the edited scene");
        // An edit that is not carried out would show what was there before.
        assert!(now != before, "{label} changes nothing");
        assert!(history.record(next, &label, false), "{label}");
        before = now;
    }
    // The cap on rays changes no sample that is there, only how many there will be.
    let (_, cap) = set("film", "rays_per_pixel", "4");
    let capped = cap(history.scene()).unwrap().scene;
    let mut capped = Arc::new(capped);
    let course = |scene: &Scene| {
        let asked = settings(false, 0, SPP);
        let mut course = SyncRender::new(scene, &options(), asked, 2).unwrap();
        while course.step().is_none() {}
        course.samples()
    };
    assert!(course(&capped) < course(history.scene()));
    // Every edit can be taken back, and the picture with it.
    while let Some(label) = history.undo() {
        assert_ne!(label, "");
    }
    assert_eq!(history.scene(), &first);
    capped = Arc::clone(history.scene());
    assert!(desk.shows(&capped) == saved_and_rendered(&first));
}

/// Two scenes that differ in one thing only, once it is made equal.
fn differ_only(left: &Scene, right: &Scene, made_equal: impl Fn(&mut Scene, &Scene)) -> Verdict {
    ensure(left != right, || "the two are the same".into())?;
    let mut same = left.clone();
    made_equal(&mut same, right);
    ensure(same == *right, || "the two differ in something else, too".into())
}

/// Brightness of the floor to the left of the ball divided by that to the right of it.
fn left_to_right(scene: &Scene) -> f64 {
    let mut scene = sized(scene.clone(), RASTER);
    let ball = scene.objects.iter().find(|o| o.name == "ball").unwrap().shape.clone();
    let Shape::Sphere(ball) = ball else { panic!("not a ball") };
    // From above, with the ball lifted out of the way of the eye but not of its shadow.
    scene.camera.eye = [ball.center[0], 9.0, ball.center[2]];
    scene.camera.target = Some([ball.center[0], 0.0, ball.center[2]]);
    scene.camera.up = [0.0, 0.0, -1.0];
    scene.camera.view_angle = zerkalo::camera::ViewAngle::Vertical(14.0);
    scene.objects.retain(|o| ["floor", "ball"].contains(&o.name.as_str()));
    let floor = number(&scene, "floor") as u32;
    let (seen, shown) = (sights(&scene), crate::beside::without_chance(&scene));
    let side = |left: bool| -> f64 {
        let half = RASTER[0] as usize / 2;
        let pixels = (0..seen.len()).filter(|i| (i % RASTER[0] as usize >= half) != left);
        let floor = pixels.filter(|i| seen[*i].object == Some(floor));
        floor.map(|i| shown[i].element_sum()).sum()
    };
    side(true) / side(false)
}

fn demonstrates_viewpoints([left, right]: [&Scene; 2]) -> Verdict {
    differ_only(left, right, |same, other| same.camera = other.camera.clone())?;
    sees(left, left)?;
    sees(right, right)?;
    ensure(left.camera.eye[0] < 0.0 && right.camera.eye[0] > 0.0, || "sides exchanged".into())
}

fn demonstrates_lights([left, right]: [&Scene; 2]) -> Verdict {
    differ_only(left, right, |same, other| same.lights = other.lights.clone())?;
    // Light from the left casts the ball's shadow to the right.
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

/// Two scenes, and what they have to show.
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
    for (i, (own, check)) in demonstrations.iter().enumerate() {
        check([&own[0], &own[1]]).unwrap();
        for [a, b] in [[&own[0], &own[0]], [&own[1], &own[0]]] {
            println!("{}", check([a, b]).unwrap_err());
        }
        let (other, _) = demonstrations[(i + 1) % 3];
        println!("{}", check([&own[0], &other[1]]).unwrap_err());
    }
}
