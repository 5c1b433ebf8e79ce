//! Picture files that the program writes, which must have the same bytes for any number of threads
//! and of SIMD lanes.

use crate::harness::*;
use png::{BitDepth, ColorType};
use std::process::Command;

#[test]
fn extreme_29_picture_files_are_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let scene = concat!(env!("ZERKALO_ROOT"), "/scenes/mirror-room.toml");
    for (name, options) in [
        ("adaptive.png", &["--noise", "1.5"] as &[&str]),
        ("uniform.png", &["--spp", "30", "--uniform", "--bits", "16"]),
        ("double.png", &["--spp", "40", "--precision", "double"]),
        ("linear.exr", &["--rmse", "0.01"]),
    ] {
        let file = |threads: &str| {
            let path = folder.path().join(format!("{threads}-{name}"));
            let mut command = Command::new(env!("CARGO_BIN_EXE_zerkalo"));
            command.args(["render", scene, "--size", "100x70", "--threads", threads]);
            let run = command.args(options).arg("-o").arg(&path).output().unwrap();
            assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
            fs::read(path).unwrap()
        };
        let one = file("1");
        assert!(one == file("2"), "{name}: 2 threads change the file");
        assert!(one == file("7"), "{name}: 7 threads change the file");
    }
}

/// Compares hashes of pictures that `zerkalo render` writes with stored ones. Most of the pictures
/// use adaptive sampling. The hashes are equal for 8 and for 16 lanes. The test requires fused
/// multiply-add, because the last bits differ without it.
#[cfg(all(target_arch = "x86_64", target_feature = "fma"))]
#[test]
fn golden_pictures_do_not_depend_on_lane_count() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let mut hashes = String::new();
    for (name, options) in [
        ("mirror-room", "--noise 0.7"),
        ("mirror-room-physical", "--rmse 0.002"),
        ("mirror-room-physical", "--rmse 0.002 --precision double"),
        ("reflecting-tracks", "--noise 2"),
        ("glass-solids", "--spp 45"),
        ("rays-per-pixel", "--spp 50 --uniform"),
        ("many-lights", "--rmse 0.004"),
    ] {
        let scene = shipped_path(&format!("{name}.toml"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_zerkalo"));
        command.arg("render").arg(&scene).args(["--size", "100x70", "--bits", "16"]);
        let run = command.args(options.split(' ')).arg("-o").arg(&path).output().unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let image = PngImage::open(&path).unwrap();
        assert_eq!((image.color, image.depth), (ColorType::Rgb, BitDepth::Sixteen));
        let values = image.levels.as_chunks().0.iter().map(|bytes| u16::from_be_bytes(*bytes));
        // FNV-1a.
        let hash = values.fold(0xcbf2_9ce4_8422_2325u64, |hash, value| {
            (hash ^ u64::from(value)).wrapping_mul(0x100_0000_01b3)
        });
        hashes += &format!("{hash:016x} {name} {options}\n");
    }
    assert_eq!(hashes, include_str!("golden/pictures.txt"), "{hashes}");
}
