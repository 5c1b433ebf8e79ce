//! Lights behind clear panes: their light is weaker by what the panes transmit, for every kind of
//! light and of surface.

use crate::harness::*;

/// Lights above the panes. Only rays find the torus.
const LIGHTS: [&str; 8] = [
    "[[light]]\npoint = { position = [0.3, 3.0, -0.2] }",
    "[[light]]\ndirectional = { direction = [0.2, -1.0, 0.3], angle = 2.0 }",
    "[[light]]\nsphere = { center = [0.3, 3.0, -0.2], radius = 0.4 }",
    "[[light]]\nrectangle = { center = [0.3, 3.0, 0.0], size = [1.0, 1.5], normal = [0, -1, 0] }",
    "[[light]]\nenvironment = {}",
    "shape.sphere = { center = [0.3, 3.0, -0.2], radius = 0.4 }",
    "shape.cube = { corner = [0.3, 3.0, -0.2], edge = 0.4 }",
    "shape.torus = { center = [0.3, 3.0, -0.2], axis = [0, 1, 0], ring = 0.5, tube = 0.2 }",
];

const SURFACES: [&str; 4] = [
    "diffuse = 0.5\nspecular = 0.3",
    "diffuse = 0.3\nreflection = 0.5\nroughness = 0.2",
    "diffuse = 0\nreflection = 0.7\nlobe = \"ggx\"\nalpha = 0.3",
    "diffuse = 0\nreflection = 0.7\nroughness = 0.8",
];

/// Panes that enclose the scene of [`view`], each in two layers.
fn panes(transmission: [f64; 2]) -> String {
    let mut text = String::new();
    for (layer, k_t) in transmission.into_iter().enumerate() {
        writeln!(text, "[materials.pane{layer}]\nambient = 0\ndiffuse = 0\ntransmission = {k_t:?}")
            .unwrap();
        for normal in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            let distance = 1.6 + 0.3 * layer as f64;
            let size = if layer == 0 { 3.2 } else { 3.8 };
            writeln!(
                text,
                "[[object]]\nmaterial = \"pane{layer}\"\nshape.rectangle = {{ center = {}, size = \
                 [{size:?}, {size:?}], normal = {}, up = {} }}",
                array(normal * distance),
                array(normal),
                array(normal.any_orthonormal_vector())
            )
            .unwrap();
        }
    }
    text
}

fn view(light: &str, surface: &str, bounces: u32, rest: &str) -> Scene {
    let lamp = match light.strip_prefix("shape") {
        Some(shape) => format!(
            "[materials.lamp]\ncolor = [0, 0, 0]\nemission = 1\n[[object]]\n\
             material = \"lamp\"\nshape{shape}"
        ),
        None => light.to_string(),
    };
    parsed(&format!(
        "film.size = [8, 6]\ntrace = {{ max_depth = 12, max_diffuse_depth = {bounces}, caustics = true }}
         camera = {{ eye = [0.0, 0.8, 1.5], target = [0, 0.1, 0], view_angle.vertical = 50 }}
         {lamp}\n[materials.floor]\ncolor = [1, 1, 1]\nambient = 0\n{surface}
         [[object]]\nmaterial = \"floor\"\nshape.platform = {{ center = [0, 0, 0], size = [3, 3] }}
         [[object]]\nmaterial = \"floor\"\nshape.sphere = {{ center = [0, 0.3, 0], radius = 0.3 }}
         {rest}"
    ))
}

#[test]
fn clear_panes_attenuate_every_light() {
    fn check<L: SimdFloat>(behind: &Scene, open: &Scene) {
        let [behind_panes, open] =
            [(behind, 1), (open, 2)].map(|(s, seed)| radiance::<L>(s, 512, seed));
        let off = (behind_panes.0 - 0.4 * open.0).abs() - 1e-4 * open.0;
        let error = behind_panes.1.hypot(0.4 * open.1);
        let same = open.0 > 0.0 && off <= two_sided_z(1e-5) * error;
        assert!(same, "{behind_panes:?}, open {open:?}:\n{}", behind.to_text());
    }
    for light in LIGHTS {
        for surface in SURFACES {
            for bounces in [0, 1] {
                let reflects = surface.starts_with("diffuse = 0\n");
                let delta = light.contains("point");
                if (bounces > 0 || delta) && reflects || light.contains("torus") && !reflects {
                    continue;
                }
                let behind = view(light, surface, bounces, &panes([0.8, 0.5]));
                let open = view(light, surface, bounces, "");
                check::<Single>(&behind, &open);
                check::<Double>(&behind, &open);
            }
        }
    }
}

/// Checks the light of a lamp that reaches a floor through one pane of glass against Fresnel's
/// equations for both of its sides, and that solids and rough panes still occlude the lamp.
#[test]
fn glass_pane_transmits_by_fresnel_and_other_glass_occludes() {
    let glass =
        "ambient = 0\ndiffuse = 0\nreflection = 1\ntransmission = 1\nfresnel = \"dielectric\"";
    let floor = |rest: &str| {
        let text = format!(
            "film = {{ size = [1, 1], filter = \"point\" }}
             camera = {{ eye = [0, 0.5, 0], target = [0, 0, 0], up = [0, 0, 1] }}
             [[light]]\npoint = {{ position = [0.0, 1.0, 1.7320508075688772] }}
             [materials.floor]\nambient = 0\ndiffuse = 1
             [materials.glass]\n{glass}
             [materials.rough]\n{glass}\nroughness = 0.1
             [[object]]\nmaterial = \"floor\"\nshape.platform = {{ center = [0, 0, 0], size = [1, 1] }}
             {rest}"
        );
        samples::<Double>(&parsed(&text), 1)[0][0]
    };
    let pane = |material: &str, y: f64| {
        format!(
            "[[object]]\nmaterial = \"{material}\"\n\
             shape.platform = {{ center = [0, {y:?}, 1.4], size = [2, 2] }}\n"
        )
    };
    // 60 degrees; the sine of the refracted ray is sin(60) / 1.5.
    let (i, t) = (PI / 3.0, ((PI / 3.0).sin() / 1.5).asin());
    let s = ((i - t).sin() / (i + t).sin()).powi(2);
    let p = ((i - t).tan() / (i + t).tan()).powi(2);
    let passed = 1.0 - s / (1.0 + s) - p / (1.0 + p);
    let open = floor("");
    assert!(open > 0.1);
    assert!((floor(&pane("glass", 0.6)) / open - passed).abs() < 1e-12);
    let two = pane("glass", 0.6) + &pane("glass", 0.7);
    assert!((floor(&two) / open - passed * passed).abs() < 1e-12);
    assert_eq!(floor(&pane("rough", 0.6)), 0.0);
    let ball = "[[object]]\nmaterial = \"glass\"\n\
                shape.sphere = { center = [0.0, 0.5, 0.8660254], radius = 0.2 }\n";
    assert_eq!(floor(ball), 0.0);
    assert_eq!(floor(&(pane("glass", 0.9) + ball)), 0.0);
}
