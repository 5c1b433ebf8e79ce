//! Extremes of cameras and of orthonormal frames.

use crate::harness::*;
use zerkalo_scene::camera::CompiledCamera;

fn check_finite<L: SimdFloat>(camera: &Camera, size: [u32; 2], name: &str) {
    let view = CompiledCamera::new(camera, size, DVec3::ZERO);
    let [u, v, w] = view.frame;
    for (a, b, expected) in
        [(u, u, 1.0), (v, v, 1.0), (w, w, 1.0), (u, v, 0.0), (v, w, 0.0), (w, u, 0.0)]
    {
        assert!((a.dot(b) - expected).abs() < 1e-15, "{name}: frame {u} {v} {w}");
    }
    let xs = [0, size[0] / 2, size[0] - 1];
    let ys = [0, size[1] / 2, size[1] - 1];
    for pixel in xs.into_iter().flat_map(|x| ys.map(|y| (x, y))) {
        for offset in [0.0, 0.5, 1.0] {
            let Ray { origin: o, direction: d } = view.rays(
                Vec3::<L>::splat(view.pixel_corner_direction(pixel)),
                (L::from_f64(offset), L::from_f64(offset)),
            );
            for lane in 0..L::WIDTH {
                let (o, d) = (to_dvec3(o, lane), to_dvec3(d, lane));
                assert!(o.is_finite() && d.is_finite(), "{name}: pixel {pixel:?}: {o} {d}");
                assert!((d.length() - 1.0).abs() < 4.0 * L::EPSILON, "{name}: {pixel:?}: {d}");
                assert!(d.dot(w) > 0.0, "{name}: pixel {pixel:?} points backwards: {d}");
            }
        }
    }
}

#[test]
fn extreme_17_odd_cameras() {
    let looks = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1e-9, 1.0, 0.0]];
    for direction in looks {
        for degrees in [1e-3, 40.0, 179.9] {
            for size in [[1, 1], [16384, 1], [1, 16384], [640, 480]] {
                for view_angle in [ViewAngle::Vertical(degrees), ViewAngle::Horizontal(degrees)] {
                    let camera = Camera {
                        eye: [1.0, -2.0, 3.0],
                        target: None,
                        direction: Some(direction),
                        view_angle,
                        ..Camera::at_origin()
                    };
                    let name = format!("{direction:?} {view_angle:?} {size:?}");
                    check_finite::<Double>(&camera, size, &name);
                    check_finite::<Single>(&camera, size, &name);
                }
            }
        }
    }
    report(17, "both", "rays finite");
}

#[test]
fn extreme_17_narrow_and_wide_angles_are_right() {
    let mut worst = 0f64;
    for degrees in [1e-3f64, 1.0, 90.0, 179.9] {
        let camera = Camera { view_angle: ViewAngle::Horizontal(degrees), ..Camera::at_origin() };
        let view = CompiledCamera::new(&camera, [1000, 1], DVec3::ZERO);
        let angle = |y: f64| {
            let Ray { direction: left, .. } =
                view.rays(Vec3::<f64>::splat(view.pixel_corner_direction((0, 0))), (0.0, y));
            let Ray { direction: right, .. } =
                view.rays(Vec3::<f64>::splat(view.pixel_corner_direction((999, 0))), (1.0, y));
            let (a, b) =
                (DVec3::new(left.x, left.y, left.z), DVec3::new(right.x, right.y, right.z));
            a.cross(b).length().atan2(a.dot(b)).to_degrees()
        };
        let found = angle(0.5);
        // Unit vectors are rounded to 1e-16; so is the angle, in radians.
        let tolerance = 1e-13 + 1e-13 * degrees;
        assert!((found - degrees).abs() < tolerance, "{degrees}: {found}");
        worst = worst.max((found - degrees).abs());
    }
    report(17, "double", &format!("angles {worst:.0e} degrees off at most"));
}

fn check_frames<L: SimdFloat>(bound: f64) {
    let mut numbers = Numbers::new(18);
    let mut worst: f64 = 0.0;
    for round in 0..1_000_000 / L::WIDTH {
        // Normals in single precision are rounded a second time. Their length then differs from 1
        // by as much as rounding to single precision can cause.
        let mut normals = [[0.0; 3]; 16];
        for n in &mut normals {
            let around = match round % 4 {
                0 => numbers.direction(),
                // Normals near the poles, some so near that their tilt rounds to zero.
                _ => {
                    let tilt = 10f64.powf(numbers.between(-17.0, -3.0));
                    let pole = if numbers.bits() & 1 == 0 { 1.0 } else { -1.0 };
                    let side = numbers.direction();
                    let d = DVec3::new(side.x * tilt, side.y * tilt, pole);
                    match round % 4 {
                        1 => d.normalize(),
                        2 => {
                            DVec3::new(0.0, side.y * tilt * 1e-6, pole * (1.0 - f64::EPSILON / 2.0))
                        }
                        // Normals near the equator, where the sign of z changes.
                        _ => DVec3::new(side.x, side.y, pole * tilt).normalize(),
                    }
                }
            };
            *n = around.to_array();
        }
        if round == 0 {
            let e = f64::EPSILON;
            normals[0] = [0.0, 0.0, -1.0];
            normals[1 % L::WIDTH] = [0.0, 0.0, -1.0 + e / 2.0];
            normals[2 % L::WIDTH] = [0.0, 0.0, -1.0 - e];
            normals[3 % L::WIDTH] = [0.0, -0.0, 1.0];
        }
        let n = Vec3::<L>::from_fn(|i| normals[i].map(zerkalo_kernel::lanes::Float::from_f64));
        let frame = Frame::around(n);
        for i in 0..L::WIDTH {
            let [t, b, n] = [frame.t, frame.b, frame.n].map(|v| to_dvec3(v, i));
            for (a, b, expected) in
                [(t, t, 1.0), (b, b, 1.0), (t, b, 0.0), (b, n, 0.0), (n, t, 0.0)]
            {
                let off = (a.dot(b) - expected).abs();
                assert!(off <= bound, "{}: {n}: {t} {b}: {off}", L::NAME);
                worst = worst.max(off);
            }
            assert!(t.cross(b).dot(n) > 0.0, "{}: {n}: left-handed", L::NAME);
        }
    }
    assert!(worst > 0.0);
    report(18, precision::<L>(), &format!("{worst:.0e}"));
}

#[test]
fn extreme_18_orthonormal_bases() {
    check_frames::<Double>(1e-15);
    check_frames::<Single>(1e-15 * (f64::from(f32::EPSILON) / f64::EPSILON));
}
