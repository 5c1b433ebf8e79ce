//! Small valid files of every format that the program reads. Together they contain every feature
//! that the readers support.

use crate::harness::*;
use png::{BitDepth, ColorType};
use zerkalo_render::plan::PlannedTile;
use zerkalo_render::schedule::RoundEstimate;
use zerkalo_scene::value::fnv1a64;

/// Returns a triangle mesh of a sphere: its vertices, and the vertex indices of each triangle.
fn ball(rings: usize, sides: usize) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut points = Vec::new();
    for ring in 0..=rings {
        let polar = std::f32::consts::PI * ring as f32 / rings as f32;
        for side in 0..sides {
            let around = std::f32::consts::TAU * side as f32 / sides as f32;
            points.push([polar.sin() * around.cos(), polar.cos(), polar.sin() * around.sin()]);
        }
    }
    let index = |ring: usize, side: usize| (ring * sides + side % sides) as u32;
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for side in 0..sides {
            let [a, b] = [index(ring, side), index(ring, side + 1)];
            let [c, d] = [index(ring + 1, side), index(ring + 1, side + 1)];
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    (points, triangles)
}

/// Material file to which the OBJ files of [`obj`] refer.
pub const MTL: &str = "# colours\nnewmtl red\nKa 0 0 0\nKd 0.8 0.1 0.1\nNs 10\nillum 2\n\
                       map_Kd a.png\nnewmtl grey\nKd 0.5\nd 1.0\n";

/// Returns OBJ files with and without materials, normals and texture coordinates.
pub fn obj() -> Vec<Vec<u8>> {
    let (points, triangles) = ball(4, 6);
    let mut plain = String::from("# a ball\no ball\n");
    let mut full = String::from("mtllib a.mtl\n");
    for [x, y, z] in &points {
        plain += &format!("v {x} {y} {z}\n");
        full += &format!("v {x} {y} {z} 1.0 0.5 0.0\nvn {x} {y} {z}\nvt {x} {y}\n");
    }
    full += "usemtl red\n";
    for (n, t) in triangles.iter().enumerate() {
        let [a, b, c] = t.map(|i| i + 1);
        plain += &format!("f {a} {b} {c}\n");
        if n == 20 {
            full += "g second\nusemtl grey\ns off\nl 1 2\n";
        }
        full += &format!("f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\n");
    }
    full += "f -1 -2 -3 -4\n";
    vec![full.into(), plain.into()]
}

/// Returns PLY files: ASCII, little-endian and big-endian.
pub fn ply() -> Vec<Vec<u8>> {
    let (points, triangles) = ball(4, 6);
    ["ascii", "binary_little_endian", "binary_big_endian"]
        .iter()
        .map(|format| {
            let mut out = format!(
                "ply\nformat {format} 1.0\ncomment made here\nelement vertex {}\nproperty float x\n\
                 property float y\nproperty float z\nproperty float nx\nproperty float ny\n\
                 property float nz\nproperty uchar red\nelement face {}\n\
                 property list uchar int vertex_indices\nend_header\n",
                points.len(),
                triangles.len()
            )
            .into_bytes();
            let mut put = |text: String, bytes: &[u8]| match *format {
                "ascii" => out.extend(text.bytes()),
                "binary_little_endian" => out.extend(bytes),
                _ => out.extend(bytes.iter().rev()),
            };
            for p in &points {
                for x in p.iter().chain(p) {
                    put(format!("{x:.6} "), &x.to_le_bytes());
                }
                put("7\n".into(), &[7]);
            }
            for t in &triangles {
                put("3".into(), &[3]);
                t.iter().for_each(|i| put(format!(" {i}"), &i.to_le_bytes()));
                put("\n".into(), &[]);
            }
            out
        })
        .collect()
}

/// Returns STL files: ASCII and binary.
pub fn stl() -> Vec<Vec<u8>> {
    let (points, triangles) = ball(4, 6);
    let mut text = String::from("solid ball\n");
    let mut bytes = vec![b'x'; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in &triangles {
        text += "  facet normal 0 0 1\n    outer loop\n";
        [0.0f32, 0.0, 1.0].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        for [x, y, z] in t.map(|i| points[i as usize]) {
            text += &format!("      vertex {x} {y} {z}\n");
            [x, y, z].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        }
        text += "    endloop\n  endfacet\n";
        bytes.extend([0, 0]);
    }
    text += "endsolid ball\n";
    vec![text.into(), bytes]
}

/// Returns the JSON description and the buffer of a glTF file. `uri` is the JSON entry with the
/// buffer's location, followed by a comma. It is empty for binary glTF.
fn description(uri: &str) -> (String, Vec<u8>) {
    let (points, triangles) = ball(4, 6);
    let mut buffer = Vec::new();
    points.iter().flatten().for_each(|x| buffer.extend(x.to_le_bytes()));
    let uvs = buffer.len();
    points.iter().flat_map(|p| &p[..2]).for_each(|x| buffer.extend(x.to_le_bytes()));
    let faces = buffer.len();
    triangles.iter().flatten().for_each(|i| buffer.extend((*i as u16).to_le_bytes()));
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1,2]}},{{"mesh":0,"translation":[1,2,3],"rotation":[0,0,0.6,0.8]}},
{{"mesh":0,"matrix":[2,0,0,0,0,2,0,0,0,0,-2,0,5,0,0,1]}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.5,0.25,0,1]}}}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":0,"TEXCOORD_0":1}},"indices":2,"material":0}},
{{"attributes":{{"POSITION":0}},"mode":5}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{n},"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}},
{{"bufferView":1,"componentType":5126,"count":{n},"type":"VEC2"}},
{{"bufferView":2,"componentType":5123,"count":{t},"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":{uvs},"byteStride":12}},
{{"buffer":0,"byteOffset":{uvs},"byteLength":{uv_bytes}}},
{{"buffer":0,"byteOffset":{faces},"byteLength":{face_bytes}}}],
"buffers":[{{{uri}"byteLength":{all}}}]}}"#,
        n = points.len(),
        t = 3 * triangles.len(),
        uv_bytes = faces - uvs,
        face_bytes = buffer.len() - faces,
        all = buffer.len(),
    );
    (text, buffer)
}

/// Returns binary glTF files.
pub fn glb() -> Vec<Vec<u8>> {
    let (mut text, mut buffer) = description("");
    while text.len() % 4 != 0 {
        text.push(' ');
    }
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let mut out = b"glTF".to_vec();
    let total = 12 + 8 + text.len() + 8 + buffer.len();
    out.extend(2u32.to_le_bytes());
    out.extend((total as u32).to_le_bytes());
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(text.bytes());
    out.extend((buffer.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(buffer);
    vec![out]
}

/// Returns glTF files with an embedded buffer.
pub fn gltf() -> Vec<Vec<u8>> {
    let (_, buffer) = description("");
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut data = String::new();
    for three in buffer.chunks(3) {
        let word = (0..3).fold(0u32, |w, i| w << 8 | u32::from(*three.get(i).unwrap_or(&0)));
        for digit in 0..4 {
            let used = digit <= three.len();
            let index = word >> (18 - 6 * digit) & 63;
            data.push(if used { char::from(DIGITS[index as usize]) } else { '=' });
        }
    }
    let uri = format!("\"uri\":\"data:application/octet-stream;base64,{data}\",");
    vec![description(&uri).0.into()]
}

/// Returns PNG images: coloured, grey, 16 bits, with alpha.
pub fn png() -> Vec<Vec<u8>> {
    let image = |color: ColorType, depth: BitDepth| {
        let level = |x: u32, y: u32, channel| [x * 37, y * 91, x * y, 255][channel] as u8;
        let samples = color.samples() * if depth == BitDepth::Sixteen { 2 } else { 1 };
        let row = |y| (0..33).flat_map(move |x| (0..samples).map(move |i| level(x, y, i % 4)));
        let levels = (0..17).flat_map(row).collect();
        PngImage { width: 33, height: 17, color, depth, levels }.bytes()
    };
    vec![
        image(ColorType::Grayscale, BitDepth::Eight),
        image(ColorType::Rgba, BitDepth::Eight),
        image(ColorType::Grayscale, BitDepth::Sixteen),
        image(ColorType::Rgb, BitDepth::Eight),
    ]
}

/// Corrects the checksum (CRC-32 of type and data) of every PNG chunk that can be found.
pub fn repair_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(end) = length.checked_add(at + 8) else { return };
        let Some(data) = bytes.get(at + 4..end) else { return };
        let crc = data.iter().fold(u32::MAX, |mut crc, byte| {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = crc >> 1 ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
            }
            crc
        });
        let Some(place) = bytes.get_mut(end..end + 4) else { return };
        place.copy_from_slice(&(!crc).to_be_bytes());
        at = end + 4;
    }
}

/// Returns JPEG images: coloured, grey, progressive and in CMYK.
pub fn jpeg() -> Vec<Vec<u8>> {
    let files: [&[u8]; 4] = [
        include_bytes!("../images/color.jpg"),
        include_bytes!("../images/grey.jpg"),
        include_bytes!("../images/progressive.jpg"),
        include_bytes!("../images/cmyk.jpg"),
    ];
    files.map(Vec::from).into()
}

/// Returns Radiance images: with runs of components, with repeated pixels, without compression.
pub fn hdr() -> Vec<Vec<u8>> {
    let header = "#?RADIANCE\n# a sky\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 20\n";
    let component = |c: u8| [&[144, c], &[4, 1, 2, 3, c][..]].concat();
    let exponent = [148, 129];
    let runs = [&[2, 2, 0, 20], &[3, 4, 5].map(component).concat()[..], &exponent].concat();
    let repeats = [[9, 8, 7, 129], [1, 1, 1, 17], [6, 5, 4, 130], [1, 1, 1, 1]].concat();
    let plain: Vec<u8> = (0..20).flat_map(|x| [x, 2 * x, 3 * x, 120 + x]).collect();
    [runs, repeats, plain].map(|row| [header.as_bytes(), &row.repeat(4)].concat()).into()
}

/// Returns the scene files that come with the program.
pub fn toml() -> Vec<Vec<u8>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .collect();
    paths.sort();
    // Longer files would find the same errors as short ones, but more slowly.
    let texts = paths.iter().map(|p| std::fs::read(p).unwrap()).filter(|t| t.len() < 20_000);
    texts.collect()
}

/// Returns two plan files (a plan divides a render among several processes). The second one names
/// an earlier plan.
pub fn plan() -> Vec<Vec<u8>> {
    let tile = |(base, end, glossy): (u32, u32, bool)| PlannedTile {
        base,
        end,
        rays_per_sample: 2.75,
        glossy,
        earlier: [RoundEstimate { samples: base, allocation: 2.0, reported: 0.5 }; 2],
    };
    let plan = |base_plan: Option<u64>, shards: u32| Plan {
        settings: PlanSettings {
            source: "scenes/mirror-room.toml".into(),
            scene_hash: "fnv1a64:0123456789abcdef".into(),
            size: [40, 20],
            seed: 3,
            sampler: SamplerKind::Sobol,
            precision: zerkalo_world::Precision::Single,
            display: Display::default(),
            rays_per_pixel: 0,
            noise_levels: 0.25,
            shards,
            round: 2,
            base_plan,
            base_rays: 5,
            total_rays: 8.5,
        },
        predicted_levels: 0.25,
        slopes: [0.7, 0.5],
        tiles: [
            (4, 16, false),
            (8, 8, false),
            (16, 480, true),
            (4, 8, false),
            (4, 4, false),
            (32, 64, true),
        ]
        .map(tile)
        .to_vec(),
    };
    [plan(None, 8), plan(Some(12), 40)].map(|plan| plan.text().into_bytes()).into()
}

/// Returns the text of a plan file before its checksum line, with the correct checksum appended.
pub fn repaired_plan(bytes: &[u8]) -> Vec<u8> {
    let end = bytes.windows(9).rposition(|w| w == b"checksum ").unwrap_or(bytes.len());
    let mut out = bytes[..end].to_vec();
    let checksum = fnv1a64(&out);
    out.extend(format!("checksum {checksum:016x}\n").bytes());
    out
}

/// Returns a film file in which the checksum of every complete chunk is correct. The bytes from the
/// first incomplete chunk on are unchanged.
pub fn repair_film(bytes: &[u8]) -> Vec<u8> {
    const START: usize = 12;
    let mut out = bytes.to_vec();
    let mut at = START;
    let mut all = crc32fast::Hasher::new();
    all.update(&out[..START.min(out.len())]);
    while let Some(head) = out.get(at..at + 12) {
        let length = u64::from_le_bytes(head[4..].try_into().unwrap());
        let end = usize::try_from(length).ok().and_then(|n| (at + 12).checked_add(n));
        let Some(end) = end.filter(|end| end.checked_add(4).is_some_and(|e| e <= out.len())) else {
            break;
        };
        if &out[at..at + 4] == b"DONE" && end - at >= 24 {
            let total = all.clone().finalize();
            out[at + 20..at + 24].copy_from_slice(&total.to_le_bytes());
        }
        let checksum = crc32fast::hash(&out[at..end]).to_le_bytes();
        out[end..end + 4].copy_from_slice(&checksum);
        let is_tile = &out[at..at + 4] == b"TILE";
        all.update(if is_tile { &checksum } else { &out[at..end + 4] });
        at = end + 4;
    }
    out
}
