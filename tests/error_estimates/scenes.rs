//! Random scenes for the survey of error estimates. Sparse pictures have noise in a few pixels,
//! dense pictures in all of them.

use crate::error_estimates::coverage::Balls;
use crate::harness::*;

/// Names of the kinds of generated scenes.
pub const KINDS: &str = "one ball|balls of a pixel|stars|hairlines|far checkerboard|distant crowd|\
     crowd with mirrors|closed glossy room|mirror room|glass|caustics|bounces|rough glass|lamps out of focus|\
     environment with a sun";
/// Number of scenes of the first ten kinds, ten of which follow each other. Scenes beyond are of the
/// other five.
const FIRST_KINDS: u64 = 200;

/// Generated scene with its name.
pub struct Sample {
    pub name: String,
    pub scene: Scene,
    /// Unshaded balls of the scene, which have a closed form; `None` for other scenes.
    pub balls: Option<Balls>,
}

fn whole(n: &mut Numbers, low: u32, high: u32) -> u32 {
    low + n.below((high - low + 1) as usize) as u32
}

fn random_color(n: &mut Numbers) -> String {
    format!("{:.3?}", [0; 3].map(|_| n.between(0.05, 0.95)))
}

/// Half of the visible height at z = 0 for the camera at (0, 0, 10), whose vertical view angle is
/// 40 degrees.
const HALF_HEIGHT: f64 = 3.64;

pub fn scene(seed: u64) -> Sample {
    let kind = if seed < FIRST_KINDS { seed % 10 } else { 10 + seed % 5 } as usize;
    let mut n = Numbers::new(seed.wrapping_mul(0x9e37_79b9) ^ 0x5eed);
    let size = [[160, 120], [160, 128], [200, 100], [240, 180]][whole(&mut n, 0, 3) as usize];
    let name = format!("{seed} {}", KINDS.split('|').nth(kind).unwrap());
    let unshaded = |balls: Balls| Sample {
        name: name.clone(),
        scene: parsed(&balls_text(&balls, size)),
        balls: Some(balls),
    };
    let scene = match kind {
        0 => return unshaded(balls(&mut n, size, 1, 1.0)),
        1 => {
            let count = whole(&mut n, 20, 100);
            return unshaded(balls(&mut n, size, count, 1.0));
        }
        2 => {
            let (count, bright) = (whole(&mut n, 100, 500), n.log_uniform(3.0, 100.0));
            return unshaded(balls(&mut n, size, count, bright));
        }
        3 => hairlines(&mut n, size),
        4 => checkerboard(&mut n, size),
        5 => crowd(&mut n, size, false),
        6 => crowd(&mut n, size, true),
        7 => room(&mut n, size),
        8 => {
            let mut scene = sized(shipped("mirror-room.toml"), size);
            let mirror = scene.materials.get_mut("mirror").unwrap();
            mirror.roughness = n.log_uniform(0.003, 0.5);
            scene.camera.eye[0] += n.between(-1.0, 1.0);
            scene
        }
        10..=12 => lit_ball(&mut n, size, kind),
        13 => out_of_focus(&mut n, size),
        14 => {
            let mut scene = sized(shipped("environment-image.toml"), size);
            for material in scene.materials.values_mut().filter(|m| m.roughness > 0.0) {
                material.roughness = n.log_uniform(0.02, 0.6);
            }
            scene.camera.eye[0] += n.between(-2.0, 2.0);
            scene
        }
        _ => {
            let name = ["glass-solids.toml", "glass.toml", "water-glass.toml"];
            let mut scene = sized(shipped(name[whole(&mut n, 0, 2) as usize]), size);
            scene.camera.eye[1] += n.between(0.0, 0.3);
            scene
        }
    };
    Sample { name, scene, balls: None }
}

fn head(size: [u32; 2], background: &str, ambient: f64) -> String {
    format!(
        "[film]\nsize = {size:?}\n[camera]\neye = [0.0, 0.0, 10.0]\ntarget = [0.0, 0.0, 0.0]\n\
         view_angle.vertical = 40.0\n[background]\ncolor = {background}\n\
         [ambient]\ncolor = [{ambient:?}, {ambient:?}, {ambient:?}]\n"
    )
}

/// Returns `count` balls of constant radiance. They are about as large as a pixel if `radiance` is
/// at most 1 (white), and smaller if it is above 1.
fn balls(n: &mut Numbers, size: [u32; 2], count: u32, radiance: f64) -> Balls {
    let pixel = 2.0 * HALF_HEIGHT / f64::from(size[1]);
    let across = HALF_HEIGHT * f64::from(size[0]) / f64::from(size[1]);
    let ball = |_| {
        let (x, y) = (n.between(-across, across), n.between(-HALF_HEIGHT, HALF_HEIGHT));
        let radius =
            pixel * if radiance > 1.0 { n.log_uniform(0.05, 0.5) } else { n.between(0.3, 1.5) };
        ([x, y, 0.0], radius)
    };
    Balls { balls: (0..count).map(ball).collect(), radiance, background: 0.01 }
}

pub fn balls_text(balls: &Balls, size: [u32; 2]) -> String {
    let mut text = head(size, &format!("{:?}", [balls.background; 3]), 1.0);
    write!(text, "[materials.m]\ncolor = {:?}\ndiffuse = 0.0\n", [balls.radiance; 3]).unwrap();
    for ([x, y, z], radius) in &balls.balls {
        write!(
            text,
            "[[object]]\nmaterial = \"m\"\nshape.sphere = {{ center = [{x}, {y}, {z}], radius = {radius} }}\n"
        )
        .unwrap();
    }
    text
}

/// Returns a scene of long boxes that are thinner than a pixel.
fn hairlines(n: &mut Numbers, size: [u32; 2]) -> Scene {
    let pixel = 2.0 * HALF_HEIGHT / f64::from(size[1]);
    let mut text = head(size, "[0.02, 0.03, 0.05]", 1.0);
    text += "[materials.m]\ncolor = [1.0, 0.9, 0.8]\ndiffuse = 0.0\n";
    for _ in 0..whole(n, 3, 40) {
        let (length, width) = (n.between(0.5, 5.0), pixel * n.log_uniform(0.02, 0.8));
        let (turn, x, y) = (n.between(0.0, 180.0), n.between(-4.0, 4.0), n.between(-3.0, 3.0));
        write!(
            text,
            "[[object]]\nmaterial = \"m\"\n\
             shape.box = {{ center = [0.0, 0.0, 0.0], size = [{length}, {width}, {width}] }}\n\
             transform = [{{ rotate_z = {turn} }}, {{ translate = [{x}, {y}, 0.0] }}]\n"
        )
        .unwrap();
    }
    parsed(&text)
}

/// Returns the scene of a plane with a checker texture, up to its horizon.
fn checkerboard(n: &mut Numbers, size: [u32; 2]) -> Scene {
    let (height, scale) = (n.between(0.3, 3.0), n.log_uniform(0.2, 3.0));
    let mut text = head(size, "[0.2, 0.3, 0.5]", 1.0);
    write!(
        text,
        "[materials.m]\ncolor = [1.0, 1.0, 1.0]\ndiffuse = 0.0\n\
         texture.checker = {{ even = [0.9, 0.9, 0.9], odd = [0.05, 0.05, 0.05], scale = [{scale}, {scale}] }}\n\
         [[object]]\nmaterial = \"m\"\nshape.platform = {{ center = [0.0, -{height}, 0.0], size = [400.0, 400.0] }}\n"
    )
    .unwrap();
    parsed(&text)
}

/// Returns a scene of lit balls, in a small part of the picture or all over it. If `mirrors` is
/// `true`, about a quarter of the balls are glossy mirrors.
fn crowd(n: &mut Numbers, size: [u32; 2], mirrors: bool) -> Scene {
    let mut text = head(size, "[0.0, 0.0, 0.0]", 0.05);
    text += "[[light]]\npoint = { position = [3.0, 5.0, 8.0] }\nintensity = 1.0\n";
    let kinds = 4;
    for kind in 0..kinds {
        let color = random_color(n);
        write!(text, "[materials.m{kind}]\ncolor = {color}\nspecular = 0.3\nexponent = 40.0\n")
            .unwrap();
        if mirrors && kind == 0 {
            text += "reflection = 0.7\nroughness = 0.05\n";
        }
    }
    let spread = if mirrors { 3.0 } else { n.between(0.5, 2.5) };
    let (count, radius) = (whole(n, 200, 1500), spread * n.log_uniform(0.01, 0.06));
    for _ in 0..count {
        let center = [0; 3].map(|_| spread * (n.unit() + n.unit() + n.unit() - 1.5) / 0.9);
        let kind = whole(n, 0, kinds - 1);
        write!(
            text,
            "[[object]]\nmaterial = \"m{kind}\"\nshape.sphere = {{ center = {center:?}, radius = {radius} }}\n"
        )
        .unwrap();
    }
    parsed(&text)
}

/// Returns the scene of a room of glossy walls around the eye.
fn room(n: &mut Numbers, size: [u32; 2]) -> Scene {
    let mut text = head(size, "[0.0, 0.0, 0.0]", 0.03).replace("10.0]\ntarget", "2.5]\ntarget");
    text += "[[light]]\npoint = { position = [0.5, 2.0, 1.0] }\nintensity = 6.0\nfalloff = \"inverse-square\"\n";
    for name in ["wall", "ball"] {
        let (color, reflection, roughness) =
            (random_color(n), n.between(0.3, 0.8), n.log_uniform(0.02, 0.6));
        write!(
            text,
            "[materials.{name}]\ncolor = {color}\ndiffuse = 0.5\nreflection = {reflection}\nroughness = {roughness}\n"
        )
        .unwrap();
    }
    text += "[[object]]\nmaterial = \"wall\"\nshape.box = { center = [0.0, 0.0, 0.0], size = [6.0, 5.0, 6.0] }\n";
    for _ in 0..whole(n, 1, 6) {
        let (x, y, z) = (n.between(-2.0, 2.0), n.between(-2.0, 1.0), n.between(-2.0, 0.5));
        let radius = n.between(0.2, 0.7);
        write!(
            text,
            "[[object]]\nmaterial = \"ball\"\nshape.sphere = {{ center = [{x}, {y}, {z}], radius = {radius} }}\n"
        )
        .unwrap();
    }
    parsed(&text)
}

/// Returns the scene of a ball under a small lamp: clear glass with caustics on the floor (kind 10),
/// matte in a closed room with diffuse bounces (11), or rough glass (12).
fn lit_ball(n: &mut Numbers, size: [u32; 2], kind: usize) -> Scene {
    let eye = if kind == 11 { "2.5]\ntarget" } else { "8.0]\ntarget" };
    let mut text = head(size, "[0.02, 0.02, 0.03]", 0.0).replace("10.0]\ntarget", eye);
    let glass = "diffuse = 0.0\nreflection = 1.0\ntransmission = 1.0\nior = 1.5\nfresnel = \"dielectric\"\n";
    let (trace, ball) = match kind {
        10 => ("max_diffuse_depth = 1\ncaustics = true\n".to_string(), glass.to_string()),
        11 => (
            format!("max_diffuse_depth = {}\n", whole(n, 1, 3)),
            "color = [0.8, 0.7, 0.6]\n".into(),
        ),
        _ => {
            let roughness = n.log_uniform(0.01, 0.5);
            (String::new(), format!("{glass}lobe = \"ggx\"\nroughness = {roughness}\n"))
        }
    };
    let (x, lamp, intensity) =
        (n.between(-1.5, 1.5), n.log_uniform(0.02, 0.4), n.log_uniform(3.0, 60.0));
    let (radius, color) = (n.between(0.4, 1.2), random_color(n));
    write!(
        text,
        "[trace]\n{trace}[[light]]\nsphere = {{ center = [{x}, 2.2, -1.0], radius = {lamp} }}\n\
         intensity = {intensity}\n\
         [materials.wall]\ncolor = {color}\n[materials.ball]\n{ball}\
         [[object]]\nmaterial = \"wall\"\n\
         shape.box = {{ center = [0.0, 0.0, 0.0], size = [6.0, 5.0, 18.0] }}\n\
         [[object]]\nmaterial = \"ball\"\n\
         shape.sphere = {{ center = [0.0, -0.6, -1.0], radius = {radius} }}\n"
    )
    .unwrap();
    parsed(&text)
}

/// Returns the scene of bright balls before and behind the plane of focus.
fn out_of_focus(n: &mut Numbers, size: [u32; 2]) -> Scene {
    let (aperture, emission) = (n.log_uniform(0.03, 1.0), n.log_uniform(2.0, 300.0));
    let lens =
        format!("view_angle.vertical = 40.0\naperture.radius = {aperture}\nfocus.distance = 8.0");
    let mut text =
        head(size, "[0.01, 0.01, 0.02]", 0.0).replace("view_angle.vertical = 40.0", &lens);
    write!(text, "[materials.m]\ndiffuse = 0.0\nambient = 0.0\nemission = {emission}\n").unwrap();
    for _ in 0..whole(n, 5, 60) {
        let (x, y, z) = (n.between(-4.0, 4.0), n.between(-3.0, 3.0), n.between(-15.0, 4.0));
        let radius = n.log_uniform(0.01, 0.1);
        write!(
            text,
            "[[object]]\nmaterial = \"m\"\nshape.sphere = {{ center = [{x}, {y}, {z}], radius = {radius} }}\n"
        )
        .unwrap();
    }
    parsed(&text)
}
