//! Scene files in the different layouts that TOML allows.

/// Texts of one scene in the different layouts that TOML allows, with comments in every position.
pub const LAYOUTS: &[&str] = &[
    // Headers, dotted keys, inline tables.
    r##"# What this file shows.

[film]
size = [320, 240] # small

# The view.
[camera]
eye = [0.0, 1.0, 5.0]
# looks here
target = [0.0, 0.0, 0.0] # the middle
view_angle.vertical = 40.0

[[light]] # the only one
name = "lamp"
point = { position = [2.0, 4.0, 3.0] }

[materials.red]
color = "#ff0000" # pure
[materials."a.b \"c\""]
reflection = 0.5

# --- objects ---

# A ball.
[[object]]
name = "ball" # round
material = "red"
shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 } # half

# A cube,
# turned.
[[object]]
name = "cube"
shape.cube = { corner = [1, 0, 1], edge = 1 }
transform = [ { rotate_y = 30.0 }, { scale = 2.0 } ]

[[object]]
shape.platform = { center = [0, 0, 0], size = [8, 8] }

# The end.
"##,
    // Only headers; tables out of order; no line end at the end of the file.
    r##"# Headers.
[[object]]
name = "ball"
material = "red"
[object.shape.sphere]
center = [
  0.0, # x
  0.5, # y
  0.0,
]
radius = 5e-1

[[light]]
name = "lamp"
[light.point]
position = [2.0, 4.0, 3.0]
[camera]
target = [0, 0, 0]
[camera.view_angle]
vertical = 40
[materials]
# named below
[materials.red]
color = [1.0, 0.0, 0.0]

[[object]]
name = "cube"
[object.shape.cube]
corner = [1, 0, 1]
edge = 1
[[object.transform]]
rotate_y = 30.0 # a bit
[[object.transform]]
scale = [2.0, 2.0, 2.0]
[materials."a.b \"c\""]
reflection = 0.5
[film]
size = [0x140, 2_40]
[[object]]
shape = { platform = { center = [0, 0, 0], size = [8, 8] } }"##,
    // Inline tables wherever possible.
    r##"film.size = [320, 240]
camera = { target = [0, 0, 0], view_angle = { vertical = 40.0 } }
materials = { red = { color = [1, 0, 0] }, 'a.b "c"' = { reflection = 0.5 } }
light = [{ name = "lamp", point.position = [2, 4, 3] }] # one
object = [
    # first
    { name = "ball", material = "red", shape.sphere = { center = [0, 0.5, 0], radius = 0.5 } },
    # second
    { name = "cube", shape = { cube = { corner = [1, 0, 1], edge = 1 } }, transform = [
        { rotate_y = 30 }, # a bit
        { scale = 2 },
    ] },
    { shape.platform = { center = [0, 0, 0], size = [8, 8] } }, # ground
]
"##,
];
