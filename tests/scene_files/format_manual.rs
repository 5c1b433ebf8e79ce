//! Manual of the scene format (docs/scene-format.md), generated from the tables of keys.

use crate::harness::*;
use zerkalo_scene::shape::{KINDS, TransformOp};
use zerkalo_scene::value::DefaultValue;

const INTRODUCTION: &str = "\
# Scene files

<!-- Generated from the tables in the program; do not edit.
     ZERKALO_BLESS=1 cargo test --release --test program scene_files:: regenerates it. -->

A scene file is [TOML](https://toml.io) text in UTF-8. Only objects are needed: every other table
and every key with a default may be left out. Unknown keys are errors.

- The coordinate system is right-handed: x to the right, y up, z towards the viewer. *Near* is +z.
- Lengths are in scene units of any size. Coordinates are from -1e9 to 1e9.
- Angles are in degrees. Rotations are counter-clockwise seen against the axis: from above, for a
  rotation about the vertical.
- A colour is `[red, green, blue]`, linear, or `\"#rrggbb\"`, sRGB. It may exceed 1.
- The radiance of a surface is a sum: `ambient` x colour x ambient light; for each light `diffuse`
  x colour x cosine plus `specular` x highlight; `reflection` x reflected radiance; `transmission`
  x transmitted radiance. The weights are not energy-conserving: the sum may exceed 1, and it is
  clipped only for display.
- A solid with `transmission` is a dielectric with the index of refraction `ior`: light is refracted
  by Snell's law where it enters and leaves, and totally reflected past the critical angle. Where
  such solids overlap, the one listed last fills the space and hides the surfaces of the others: a
  bubble is listed after its ball. At most four solids at one point are distinguished. A compound is
  one solid, whose first part with `transmission` gives the index and the absorption. An open surface
  (plane, platform, rectangle) is a thin pane without refraction.
- A transparent solid reflects on its outer side only, and past the critical angle. With `fresnel =
  \"dielectric\"` both sides divide the light physically between `reflection` (x F) and
  `transmission` (x 1 - F), so that glass has both at 1. Shadow rays end at transparent
  surfaces, clear or rough: transparent objects cast shadows like all others.
- Inside of a solid with `transmission` light is absorbed by Beer's law. After the distance d it has the
  share `attenuation_color` ^ (d / `attenuation_distance`) in each channel; a channel of 0 is black. So
  green bottle glass has `attenuation_color = [0.3, 0.7, 0.4]` with `attenuation_distance = 0.5`. Where
  solids overlap, the one that fills the space absorbs. A thin pane does not absorb.
- `roughness` and `lobe` blur transmitted light as well as reflected light: frosted glass has a roughness of
  about 0.3. The lobes `cone` and `square` are spread about the refracted direction. The lobes `beckmann` and
  `ggx` refract and reflect at microfacets, each with Fresnel's equations for its own normal (Walter et
  al. 2007), so that refraction is blurred less than reflection; light between microfacets is lost. A
  thin pane sends the rays that it transmits in the directions of its reflection, mirrored to the other
  side. Nothing is blurred where both sides have the same index of refraction.
- Where a transparent surface coincides with another one, within rounding, as the bottom of a glass on
  a table, the picture is the limit of a vanishing gap between them: light leaves the glass and then
  hits the table, whichever face rounding puts in front. Two glasses that touch have such a gap, too,
  also with equal indices: to make one body of both, let them overlap. Of solids on the same side
  of a common face, such as a box in the corner of a larger one, the transparent one lies outside the
  opaque one, and of transparent ones the one listed last. An open transparent surface on an opaque
  one is in front of it on either side; of two, the one listed last. Which of two coincident opaque
  surfaces is visible, unless one of them is flat and emits light, depends on rounding, but not on
  `acceleration`, number of threads or SIMD width. To decide it, move one of them by a thousandth of its
  size, or make one compound of both, which shows the part listed first. From outside, contact of two
  opaque solids is hidden; an eye inside of one of them sees it. In the same way rounding decides on
  which side an eye is that lies exactly on a surface. Of objects with the same shape, place and material
  the last one stands for all, except for open transparent ones, which attenuate light one by one.
- A light on a surface, within rounding, acts as a light at a vanishing distance from it, on the side
  of the lit point. So a light on the ceiling lights all of the room; the surface itself stays dark.
  A solid occludes what is behind it. An open surface (plane, platform, rectangle) has no inside, so
  that a light on it lights both sides: to light one, move the light off it.
- A flat object with `emission` (rectangle, platform, plane, flat mesh) on an opaque surface without
  emission, within rounding, acts as one at a vanishing distance from it: it is visible and hides that
  surface. If its material has `two_sided = false`, it is in front of the surface on the side that emits.
  Otherwise it is outside of a solid, or inside if the eye is inside of the solid. On an open surface,
  which has no inside, it is on the side of the eye, and the surface hides it from the other side: to
  light both, use two objects.
- A sphere, rectangle or disk light is a radiating surface without a body: rays pass through it, it
  casts no shadow, and it vanishes when it is switched off. An object behind or inside it is its
  housing; on an object's surface it shines outwards. Camera and reflected rays see it unless `visible
  = false`. A Cook-Torrance highlight and a microfacet lobe are the same reflection: a material with both
  shows such a light once, and lights without a size as highlights. Any other material with both
  `specular` and `reflection` shows it twice: leave `specular` out for the plain reflection.
- With `unit = \"radiance\"` the intensity of such a light is its radiance [W/(sr m\u{b2})]: a light of
  intensity 1 is white in the picture. With `unit = \"power\"` it is the emitted power [W], pi x
  radiance x area. The area is that of the side that shines, or of the whole sphere.
- A material with `emission` makes its objects emit light: the radiance [W/(sr m\u{b2})] is
  `emission` x `emission_color`, the same at every point and in every direction, without texture, in
  addition to the light that the surface reflects. Camera and mirrors see it. With `two_sided` both
  sides of a flat object emit, and the inside of a solid; otherwise the front alone. The materials have
  light groups as lights have: `emission` and `emission_color` of a scene in progress change without
  new samples, to 0 and back. Beyond eight lights and emissive materials the last ones share a group.
  Sixteen point lights or more without a `group` share one group. Spots do if their cones have together
  the solid angle of 16 hemispheres or more.
- Lights and materials with the same `group` are one light group, which has a place among the eight before
  all others. Its mix, `groups.NAME` with `intensity`, `color` and `on`, changes without new samples, also with
  hundreds of lights; the light of a lamp is multiplied by both. A lamp that shares its group needs new
  samples for another intensity or colour of its own. `film.solo` shows one light group alone.
- With `trace.mirror_light` clear flat mirrors (rectangles, platforms, planes, sides of boxes and prisms, without
  bumps) throw the light of each light once more, as direct light. Rough mirrors, environments, the lights
  among which paths choose (16 or more), and lights with a size beside transmission are left to diffuse
  bounces with `caustics`, which find lights with a size only.
- Diffuse surfaces, highlights and rough mirrors get the light of emissive spheres, rectangles, platforms,
  boxes, cubes, prisms, pyramids and meshes of up to 65536 triangles from points sampled on them, as
  that of lights with a size. The emission of other shapes (torus, cylinder, cone, plane, compound,
  sphere scaled to an ellipsoid, larger mesh) is found only by rays that hit them: the camera's,
  reflected, transmitted, and those of diffuse bounces. It makes no highlights, and without
  `max_diffuse_depth` it does not light diffuse surfaces; `zerkalo check` reports this.
- A texture multiplies the `color` of its material in the ambient and the diffuse part. White leaves
  it unchanged: `color = [1.0, 1.0, 1.0]` with `texture.image = { file = \"wood.png\", scale =
  [2.0, 2.0] }` or `texture.checker = { even = \"#ffffff\", odd = \"#202020\" }`. A bump,
  `bump.image = { file = \"bricks.png\", height = 0.02 }`, perturbs the shading normals, in
  highlights, reflections and refraction as well; shape, outline and shadows stay. A normal is
  perturbed less where it would turn away from the viewer.
- Textures are mapped in the shape's own space, before its `transform`, and move with the object.
  There u points to the right, v up; on a plane, platform or rectangle up is along its `up`, or away
  from the viewer where it lies flat; around a cylinder or cone it is along the axis; a cube, prism or
  pyramid is mapped before its `rotation`. So `mapping = \"box\"` puts an image upright on every side,
  in the size given by `scale`, whatever the size of the object.
- `roughness` is the tangent of the half-angle of the reflection cone, not a microfacet alpha. The
  square lobe has a square base of the same area, with the side sqrt(pi) x roughness; the microfacet
  lobes have the slope of equal second moment, `alpha` = roughness / (2 sqrt 2), unless `alpha` is
  given. So a change of the lobe keeps the blur comparable.
- A scene may name any file that its reader may read: a name is relative to the folder of the scene
  file, and `..`, absolute paths and symbolic links are followed, as in a shell. Only regular files
  are read, so that no device or pipe blocks; their content goes into the picture and into messages
  only. A file that a mesh file names in turn lies in the folder of that mesh file or below: such a
  name has no `..`, is not absolute, and is no URL. A library of colours elsewhere is left out with a
  warning; a buffer of vertices elsewhere is an error.
- What the reader of a mesh file leaves out or replaces is a warning: points and lines, textures, colours
  of vertices, skins and instances, extensions of glTF that change neither shape nor colour, triangles without
  area, normals and texture coordinates that are no numbers. Of a polygon any shape in a plane is filled, also
  with cuts to holes.
- Where a mesh is smooth and convex, shadow rays start above its triangles, on the curved surface that its normals
  show; the shadows of coarse meshes have an error of that height ([decisions/bvh.md](decisions/bvh.md)).
- An environment light is infinitely far away in all directions. It adds to the background, lights diffuse
  surfaces, makes highlights, and is seen by the camera and in mirrors unless `visible = false`. Its image
  is equirectangular: the top row is up (+y), the middle is towards -z, a quarter to the right of the middle
  is +x. Values of Radiance and OpenEXR files are radiances; values of PNG and JPEG files are sRGB levels. Negative
  values and NaN are replaced by 0, infinite ones by the largest finite value of the image, at least 65504; a note
  counts NaN and infinite pixels. An image has at most 33554432 pixels.
- A camera with `projection = \"equirectangular\"` makes such an image of its surroundings: `zerkalo render room.toml -o
  room.hdr`, with `direction = [0.0, 0.0, -1.0]` and a film twice as wide as high, lights another scene as the room does
  at the place of the camera. `aperture`, `focus` and `near` cannot be given with it.
- A Radiance image may have any of the eight orders of pixels; `EXPOSURE` and `COLORCORR` are divided out. Of an
  OpenEXR file, the first layer with the channels R, G and B is shown, otherwise Y as grey; their names may have a
  prefix if it is the only one with such channels in the layer. Primaries other than those of sRGB are converted.
- A spot light has its full intensity inside the cone of `inner_angle` about its axis and none outside the
  cone of `outer_angle`. Between them the factor is t^2 (3 - 2t), where t rises linearly with the cosine of
  the angle from 0 at the outer to 1 at the inner cone. Equal angles make a sharp edge.
- A light with falloff `none` gives a white diffuse surface that faces it the radiance `intensity` at any
  distance. With `inverse-square` the intensity is a radiant intensity [W/sr]: the
  irradiance is intensity x cosine / distance squared.

`zerkalo new FILE` writes a small scene with comments, `zerkalo check FILE` validates one.
";

pub fn format_manual() -> String {
    let mut out = INTRODUCTION.to_string();
    for field in FIELDS {
        let (title, fields): (String, &[Field]) = match field.takes {
            ValueType::Table(fields) => (format!("[{}]", field.name), fields),
            ValueType::Tables(fields) => (format!("[[{}]]", field.name), fields()),
            ValueType::Named(fields) => (format!("[{}.NAME]", field.name), fields),
            _ => continue,
        };
        push(&mut out, &format!("\n## `{title}`\n\n{}", field.doc));
        if let DefaultValue::Without(instead) = field.preset {
            push(&mut out, &format!(" Without it {instead}."));
        }
        push(&mut out, "\n\n");
        table(&mut out, fields);
        for inner in fields {
            nested(&mut out, inner);
        }
    }
    out
}

fn push(out: &mut String, text: &str) {
    out.push_str(text);
}

/// Appends the details of `field` that its row refers to: the words that it accepts, or the keys of
/// its table.
fn nested(out: &mut String, field: &Field) {
    match field.takes {
        ValueType::Choice(choices) => {
            let mut words = format!("\n`{}`:\n\n", field.name);
            for choice in choices {
                // Writing into a `String` cannot fail.
                let _ = writeln!(words, "- `\"{}\"`: {}", choice.name, choice.doc);
            }
            // Several tables may have the same words.
            if out.contains(&words) {
                words = format!("\n`{}`: the same words as above.\n", field.name);
            }
            push(out, &words);
        }
        ValueType::Table(fields) => {
            push(out, &format!("\n`{}`:\n\n", field.name));
            table(out, fields);
            fields.iter().for_each(|field| nested(out, field));
        }
        ValueType::OneOf(_) if field.name == "shape" => shapes(out),
        ValueType::OneOf(fields) => {
            push(out, &format!("\n`{}`, exactly one of:\n\n", field.name));
            kinds(out, fields);
            for kind in fields {
                if let ValueType::Table(inner) = kind.takes {
                    push(out, &format!("\n`{}.{}`:\n\n", field.name, kind.name));
                    table(out, inner);
                    inner.iter().for_each(|field| nested(out, field));
                }
            }
        }
        ValueType::ListOf(_) => steps(out),
        _ => {}
    }
}

fn shapes(out: &mut String) {
    for (kind, (_, example)) in KINDS.iter().zip(EXAMPLES) {
        push(out, &format!("\n### `shape.{}`\n\n{}\n\n", kind.name, kind.doc));
        push(out, &format!("```toml\n{example}\n```\n\n"));
        if let ValueType::Table(fields) = kind.takes {
            table(out, fields);
            fields.iter().for_each(|field| nested(out, field));
        }
    }
}

fn steps(out: &mut String) {
    push(out, "\n### `transform`\n\n");
    push(out, "A list of steps, carried out in order, each with exactly one of these keys:\n\n");
    push(
        out,
        "```toml\ntransform = [{ rotate_y = 30.0 }, { translate = [0.0, 1.0, 0.0] }]\n```\n\n",
    );
    kinds(out, TransformOp::FIELDS);
    for field in TransformOp::FIELDS {
        nested(out, field);
    }
}

/// Appends a table of mutually exclusive keys to the manual. One of them must be given; they have
/// no defaults.
fn kinds(out: &mut String, fields: &[Field]) {
    push(out, "| key | value | unit | meaning |\n|---|---|---|---|\n");
    for field in fields {
        row(out, &[&code(field.name), &value(field), field.unit, field.doc]);
    }
}

fn table(out: &mut String, fields: &[Field]) {
    push(out, "| key | value | unit | default | meaning |\n|---|---|---|---|---|\n");
    for field in fields {
        let default = match field.preset {
            DefaultValue::Required => "needed".to_string(),
            DefaultValue::Is(text) => code(text),
            DefaultValue::Without(instead) => format!("none: {instead}"),
        };
        row(out, &[&code(field.name), &value(field), field.unit, &default, field.doc]);
    }
}

fn code(text: &str) -> String {
    format!("`{text}`")
}

fn value(field: &Field) -> String {
    match field.takes {
        ValueType::Table(_) => "a table, see below".to_string(),
        ValueType::OneOf(_) => "exactly one kind, see below".to_string(),
        ValueType::ListOf(_) => "a list of steps, see below".to_string(),
        ValueType::Choice(_) => "a word, see below".to_string(),
        ValueType::Tables(_) => "a list of parts".to_string(),
        takes => takes.to_string(),
    }
}

fn row(out: &mut String, cells: &[&str]) {
    let cells: Vec<_> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
    push(out, &format!("| {} |\n", cells.join(" | ")));
}

/// Checks that table rows of the format manual with the words "see below" refer to a later part
/// of the same section.
#[test]
fn reference_rows_refer_to_later_sections() {
    let text = format_manual();
    let mut words = 0;
    for section in text.split("\n## ").flat_map(|part| part.split("\n### ")) {
        for (at, row) in section.match_indices("\n| `") {
            let line = section[at + row.len()..].lines().next().unwrap();
            let (name, rest) = line.split_once('`').unwrap();
            if rest.starts_with(" | a word, see below |") {
                let below = &section[at..];
                let notations = [":\n\n- `\"", ": the same words as above.\n"];
                let found =
                    notations.map(|notation| below.contains(&format!("\n`{name}`{notation}")));
                assert!(found.contains(&true), "{line}");
                words += 1;
            }
        }
    }
    assert!(words > 15, "only {words} rows with words");
}
