//! What may be written in a texture.

use crate::value::{Choice, Field, NumberRange, ValueType};

/// The kinds of `texture`.
pub(super) const TEXTURE_KINDS: &[Field] = &[
    Field::required("image", ValueType::Table(IMAGE_FIELDS), "", "A PNG or JPEG image."),
    Field::required(
        "checker",
        ValueType::Table(CHECKER_FIELDS),
        "",
        "Squares of two colours, two by two a repeat.",
    ),
];

/// The kinds of `bump`.
pub(super) const BUMP_KINDS: &[Field] = &[Field::required(
    "image",
    ValueType::Table(BUMP_FIELDS),
    "",
    "Heights from a PNG or JPEG image: black is low, white is high.",
)];

/// The keys of `texture.image`.
pub(super) const IMAGE_FIELDS: &[Field] = &[
    Field::preset(
        "file",
        ValueType::Text,
        "",
        "\"\"",
        "Name of the file, relative to the folder of the scene file. Empty: white.",
    ),
    MAPPING,
    AXIS,
    SCALE,
    OFFSET,
    WRAP,
    Field::preset(
        "filter",
        ValueType::Choice(FILTERS),
        "",
        "\"bilinear\"",
        "What lies between the middles of the pixels.",
    ),
];

/// The keys of `texture.checker`.
pub(super) const CHECKER_FIELDS: &[Field] = &[
    Field::preset(
        "even",
        ValueType::Color(NumberRange::COEFFICIENT),
        "",
        "[1.0, 1.0, 1.0]",
        "Colour of the square that begins at u = v = 0.",
    ),
    Field::preset(
        "odd",
        ValueType::Color(NumberRange::COEFFICIENT),
        "",
        "[0.1, 0.1, 0.1]",
        "Colour of its neighbours.",
    ),
    MAPPING,
    AXIS,
    SCALE,
    OFFSET,
];

/// The keys of `bump.image`.
pub(super) const BUMP_FIELDS: &[Field] = &[
    Field::preset(
        "file",
        ValueType::Text,
        "",
        "\"\"",
        "Name of the file, relative to the folder of the scene file. Empty: flat.",
    ),
    Field::preset(
        "height",
        ValueType::Number(NumberRange::closed(-1e3, 1e3)),
        "scene units",
        "0.02",
        "How far white rises above black, before the object's transform; negative: how far it sinks.",
    ),
    MAPPING,
    AXIS,
    SCALE,
    OFFSET,
    WRAP,
];

const MAPPING: Field = Field::preset(
    "mapping",
    ValueType::Choice(MAPPINGS),
    "",
    "\"auto\"",
    "Where the coordinates u (to the right) and v (up) come from.",
);

const AXIS: Field = Field::optional(
    "axis",
    ValueType::Choice(AXES),
    "",
    "y for `spherical` and `cylindrical`, z for `planar`",
    "What those mappings turn around, or look along.",
);

const SCALE: Field = Field::preset(
    "scale",
    ValueType::Numbers(2, NumberRange::above(0.0, 1e6)),
    "",
    "[1.0, 1.0]",
    "Repeats per unit of u and of v: the larger, the smaller the picture.",
);

const OFFSET: Field = Field::preset(
    "offset",
    ValueType::Numbers(2, NumberRange::closed(-1e6, 1e6)),
    "",
    "[0.0, 0.0]",
    "Added to the scaled u and v, in repeats: moves the picture to the left and down.",
);

const WRAP: Field = Field::preset(
    "wrap",
    ValueType::Choice(WRAPS),
    "",
    "\"repeat\"",
    "What lies beyond the edges of the image.",
);

const MAPPINGS: &[Choice] = &[
    Choice {
        name: "auto",
        doc: "as it suits the shape: `spherical` on spheres, `cylindrical` on all that is round about \
              an axis, `box` on solids with flat faces, `planar` on what is flat, `uv` on a mesh \
              whose file has texture coordinates, `box` on any other",
    },
    Choice {
        name: "planar",
        doc: "seen along the axis; one repeat a scene unit, from the lower left corner of the box \
              around the shape (of a plane, from its `point`)",
    },
    Choice {
        name: "spherical",
        doc: "u once around the axis, v once from pole to pole, seen from the middle of the box \
              around the shape; the middle of the image looks to the front",
    },
    Choice {
        name: "cylindrical",
        doc: "u once around the axis, v once along the shape; the ends show the colours of their rims",
    },
    Choice {
        name: "box",
        doc: "each side as it is seen from outside; one repeat a scene unit, from the side's lower \
              left corner",
    },
    Choice {
        name: "uv",
        doc: "the texture coordinates in a mesh's file; on rectangles and platforms once from edge \
              to edge",
    },
];

const AXES: &[Choice] = &[
    Choice { name: "x", doc: "to the right" },
    Choice { name: "y", doc: "up, or along the axis of a cylinder or cone" },
    Choice { name: "z", doc: "to the front, or along the normal of what is flat" },
];

const WRAPS: &[Choice] = &[
    Choice { name: "repeat", doc: "the image again and again" },
    Choice { name: "clamp", doc: "its outermost pixels" },
];

const FILTERS: &[Choice] = &[
    Choice { name: "bilinear", doc: "even transitions" },
    Choice { name: "nearest", doc: "none: every pixel is a square" },
];
