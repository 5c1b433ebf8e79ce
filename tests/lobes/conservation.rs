//! Conservation of energy and reciprocity of the reflection models. Every lobe, highlight and
//! masking must have the properties that [`crate::lobes::properties`] lists.

use crate::harness::*;
use crate::lobes::properties::{BsdfProperties, Energy, ReflectionModel, transmission_properties};
use crate::lobes::setup::*;
use std::f64::consts::FRAC_PI_2;
use zerkalo_scene::material::{FIELDS, Interface};

/// Checks that the words that the scene format accepts and the lists of enum variants have the same
/// order, so that these tests cover every word.
#[test]
fn variants_match_words_of_fields() {
    let words = |key: &str| -> Vec<&str> {
        let field = FIELDS.iter().find(|f| f.name == key).unwrap();
        let ValueType::Choice(choices) = field.takes else { panic!("{key}") };
        choices.iter().map(|c| c.name).collect()
    };
    let read = |key: &str| -> Vec<Material> {
        let of = |word: &&str| Material::from_text(&format!("{key} = \"{word}\"")).unwrap();
        words(key).iter().map(of).collect()
    };
    assert_eq!(read("lobe").iter().map(|m| m.lobe).collect::<Vec<_>>(), Lobe::ALL);
    assert_eq!(read("highlight").iter().map(|m| m.highlight).collect::<Vec<_>>(), Highlight::ALL);
    assert_eq!(read("masking").iter().map(|m| m.masking).collect::<Vec<_>>(), Masking::ALL);
    assert_eq!(read("fresnel").iter().map(|m| m.fresnel_mode()).collect::<Vec<_>>(), Fresnel::ALL);
}

/// Checks energy and reciprocity of the interface, reflection and transmission together, for light
/// from outside and from inside. A Fresnel mode that is declared not to have one of these
/// properties must violate it.
#[test]
fn transparent_surfaces_have_declared_properties() {
    for mode in Fresnel::ALL {
        let material = Material {
            reflection: 1.0,
            transmission: 1.0,
            fresnel: Some(mode),
            ..Material::default()
        };
        let transmission = Bsdf::<f64>::new(&material, true).transmission.unwrap();
        let n = Vec3::new(0.0, 0.0, 1.0);
        let (mut lost, mut lopsided) = (0f64, 0f64);
        for i in 0..900 {
            let (sin, cos) = (0.1 * f64::from(i)).to_radians().sin_cos();
            for (n_i, n_t) in [(1.0, material.ior), (material.ior, 1.0)] {
                let incident = Vec3::new(sin, 0.0, -cos);
                let there = Interface::new(incident, n, n_i, n_t);
                let split = there.split(&transmission, n_i == 1.0, false);
                lost = lost.max((split.reflected + split.transmitted + split.tir - 1.0).abs());
                if !there.tir {
                    let back = Interface::new(-there.refracted, -n, n_t, n_i);
                    let back = back.split(&transmission, n_i != 1.0, false);
                    lopsided = lopsided.max((back.reflected - split.reflected).abs());
                }
            }
        }
        let claims = transmission_properties(mode);
        assert_eq!(lost < 1e-12, claims.energy == Energy::Conserving, "{mode:?}: {lost}");
        assert_eq!(lopsided < 1e-9, claims.reciprocal, "{mode:?}: {lopsided}");
    }
}

/// Returns pairs of directions on the same side of a surface, at many angles to the normal.
fn pairs() -> Vec<(Vector, Vector)> {
    let n = tilted_normal();
    let angles = [0.01, 0.3, 0.8, 1.2, 1.5, 1.57];
    let mut pairs = Vec::new();
    for a in angles {
        for b in angles {
            for phi in [0.0, 0.4, 2.0, 3.0, PI] {
                pairs.push((at_angle(n, a, 0.3), at_angle(n, b, 0.3 + phi)));
            }
        }
    }
    pairs
}

/// Returns the value f (BRDF) of a highlight for light from `l` seen from `v`.
fn highlight_f(material: &Material, v: Vector, l: Vector) -> f64 {
    let n = tilted_normal();
    let finish = Bsdf::<f64>::new(material, true);
    let query = query::<f64>((combine(&[(-1.0, v)]), n), false);
    finish.highlight(&query, Vec3::of(l)).x / dot(n, l)
}

/// Returns the value f (BRDF) of a reflection lobe for light from `l` seen from `v`: the weight of
/// a sample, times its density, divided by the cosine of the angle between the surface normal and
/// `l`.
fn lobe_f(material: &Material, v: Vector, l: Vector) -> f64 {
    let n = tilted_normal();
    let finish = Bsdf::<f64>::new(material, true);
    match finish.lobe {
        ReflectionLobe::Mirror => unreachable!(),
        // The test of weight x density below shows that this lobe and the highlight have the same
        // f.
        ReflectionLobe::Microfacet(_) => highlight_f(material, v, l),
        _ => {
            let query = query::<f64>((combine(&[(-1.0, v)]), n), false);
            finish.reflection.unwrap() * finish.pdf(&query, Vec3::of(l)) / dot(n, l)
        }
    }
}

/// Returns the largest relative difference between f(v, l) and f(l, v) over many pairs of
/// directions.
fn asymmetry(f: impl Fn(Vector, Vector) -> f64) -> f64 {
    let of = |(v, l): &(Vector, Vector)| {
        let (there, back) = (f(*v, *l), f(*l, *v));
        (there - back).abs() / there.max(back).max(1e-300)
    };
    pairs().iter().map(of).fold(0.0, f64::max)
}

fn check_reciprocity(name: &str, claims: BsdfProperties, asymmetry: f64) {
    if claims.reciprocal {
        assert!(asymmetry < 1e-10, "{name} is not reciprocal: {asymmetry:.1e}");
    } else {
        assert!(asymmetry > 0.5, "{name} is reciprocal after all: {asymmetry:.1e}");
    }
}

#[test]
fn closed_form_13_reciprocity_is_as_claimed() {
    for (lobe, masking) in every_lobe() {
        for roughness in [0.5, 2.0] {
            let name = format!("{lobe:?} {masking:?} {roughness}");
            let mut material = reflector(lobe, masking, roughness);
            material.fresnel = Some(Fresnel::Schlick);
            material.f0 = Some(Color([0.3; 3]));
            if lobe == Lobe::Mirror {
                mirror_is_reciprocal(&material);
                continue;
            }
            if !has_facets(lobe) {
                // Without a Fresnel reflectance, the test checks a property of the lobe alone.
                material.f0 = None;
            }
            check_reciprocity(&name, lobe.properties(), asymmetry(|v, l| lobe_f(&material, v, l)));
        }
    }
    for highlight in Highlight::ALL {
        for (lobe, masking) in every_lobe() {
            let mut material = reflector(lobe, masking, 0.7);
            material.highlight = highlight;
            let name = format!("{highlight:?} {lobe:?} {masking:?}");
            let asymmetry = asymmetry(|v, l| highlight_f(&material, v, l));
            check_reciprocity(&name, highlight.properties(), asymmetry);
        }
    }
}

/// Checks the reciprocity of a mirror, whose BRDF has no finite value: the reverse ray follows the
/// same path with the same weight.
fn mirror_is_reciprocal(material: &Material) {
    assert!(material.lobe.properties().reciprocal);
    let n = tilted_normal();
    for (v, _) in pairs() {
        let reflect = |incident: Vector| {
            let mut out = None;
            let numbers = Draws::random(1);
            each_reflection::<f64>(material, (incident, n), true, numbers, 1, |d, w| {
                out = Some((d, w));
            });
            out.unwrap()
        };
        let (there, weight) = reflect(combine(&[(-1.0, v)]));
        let (back, weight_back) = reflect(combine(&[(-1.0, there)]));
        assert!(dot(combine(&[(1.0, back), (-1.0, v)]), back).abs() < 1e-14);
        assert!((weight[0] - weight_back[0]).abs() < 1e-14, "{weight:?} {weight_back:?}");
    }
}

/// Returns the mean weight of sampled reflections. The angle of incidence is `degrees`, and the
/// reflections are sampled with 65,536 Sobol points.
fn mean_weight(material: &Material, degrees: f64) -> f64 {
    let n = tilted_normal();
    let incident = combine(&[(-1.0, at_angle(n, degrees.to_radians(), 1.0))]);
    let (mut sum, count) = (0.0, 1 << 16);
    each_reflection::<Double>(material, (incident, n), true, Draws::sobol(9), count, |_, w| {
        sum += w[0];
    });
    sum / f64::from(count)
}

#[test]
fn closed_form_7_energy_is_as_claimed() {
    for (lobe, masking) in every_lobe() {
        for alpha in [1e-3, 0.1, 0.4, 1.0, 2.0] {
            for degrees in [0.0, 45.0, 75.0, 85.0, 89.0, 89.9] {
                let mut material = reflector(lobe, masking, alpha * 8f64.sqrt());
                material.alpha = Some(alpha);
                let mean = mean_weight(&material, degrees);
                let name = format!("{lobe:?} {masking:?} alpha {alpha} at {degrees}: {mean}");
                match lobe.properties().energy {
                    Energy::Conserving => assert!(mean == 1.0, "{name}"),
                    Energy::Losing => assert!(mean <= 1.0 + 1e-3, "{name}"),
                    Energy::Unbounded => unreachable!("no lobe is"),
                }
            }
        }
    }
}

/// Returns the albedo of a highlight that is seen at the angle `degrees`, for light from all
/// directions. It is computed by the midpoint rule.
fn highlight_albedo(material: &Material, degrees: f64) -> f64 {
    let n = tilted_normal();
    let v = at_angle(n, degrees.to_radians(), 0.0);
    let (rings, turns) = (400, 400);
    let mut sum = 0.0;
    for i in 0..rings {
        let theta = (f64::from(i) + 0.5) / f64::from(rings) * FRAC_PI_2;
        for j in 0..turns {
            let l = at_angle(n, theta, (f64::from(j) + 0.5) / f64::from(turns) * TAU);
            sum += highlight_f(material, v, l) * dot(n, l) * theta.sin();
        }
    }
    sum * FRAC_PI_2 * TAU / f64::from(rings * turns)
}

#[test]
fn closed_form_7_energy_of_highlights_is_as_claimed() {
    for highlight in Highlight::ALL {
        let mut largest: f64 = 0.0;
        for (lobe, masking) in every_lobe() {
            for degrees in [0.0, 45.0, 75.0] {
                let mut material = reflector(lobe, masking, 0.3 * 8f64.sqrt());
                material.highlight = highlight;
                material.exponent = 0.5;
                largest = largest.max(highlight_albedo(&material, degrees));
            }
        }
        match highlight.properties().energy {
            Energy::Losing => assert!(largest <= 1.0 + 1e-3, "{highlight:?}: {largest}"),
            Energy::Unbounded => assert!(largest > 1.2, "{highlight:?} is bounded: {largest}"),
            Energy::Conserving => unreachable!("no highlight is"),
        }
    }
}

#[test]
fn closed_form_13_weight_times_density_is_the_highlight() {
    let n = tilted_normal();
    let facets = every_lobe().into_iter().filter(|(l, _)| has_facets(*l));
    let mut compared = 0;
    for (lobe, masking) in facets {
        for alpha in [1e-3, 0.05, 0.3, 1.0, 2.0] {
            for degrees in [0.0f64, 30.0, 60.0, 85.0, 89.9] {
                let mut material = reflector(lobe, masking, 0.0);
                material.alpha = Some(alpha);
                material.fresnel = Some(Fresnel::Exact);
                material.f0 = Some(Color([0.9, 0.5, 0.04]));
                let finish = Bsdf::<f64>::new(&material, true);
                let v = at_angle(n, degrees.to_radians(), 2.0);
                let incident = combine(&[(-1.0, v)]);
                let draws = Draws::sobol(3);
                each_reflection::<f64>(&material, (incident, n), true, draws, 500, |d, weight| {
                    if weight == [0.0; 3] {
                        return;
                    }
                    let query = query::<f64>((incident, n), false);
                    let density = finish.pdf(&query, Vec3::of(d));
                    let shine = finish.highlight(&query, Vec3::of(d));
                    for (w, f_cos) in weight.into_iter().zip(vector(shine)) {
                        // The first term is the error of exp(-tan^2 / alpha^2), because the slope
                        // comes from rounded directions. The second is the error of the cosine
                        // between the normal and the light, which is tiny at grazing angles.
                        let error = (w * density / f_cos - 1.0).abs();
                        let limit = 1e-12 / (alpha * degrees.to_radians().cos());
                        let limit = limit + 1e-15 / dot(n, d);
                        let name = format!("{lobe:?} {masking:?} {alpha} {degrees}");
                        assert!(error < limit, "{name}: {} {f_cos}", w * density);
                        compared += 1;
                    }
                });
            }
        }
    }
    assert!(compared > 50_000, "{compared}");
    // The third axis of the frame must be exactly the normal, because the density of the square
    // lobe is computed in this frame.
    assert!(vector(Frame::around(Vec3::<f64>::of(n)).n) == n);
}

/// Checks that the value of a lobe in a sampled direction, divided by the density of this
/// direction, is the weight of the sample. This must hold both if directions below the surface are
/// mirrored up and if they are absorbed.
#[test]
fn value_over_density_is_the_weight_of_the_sample() {
    let n = tilted_normal();
    let mut compared = 0;
    for (lobe, masking) in every_lobe().into_iter().filter(|(lobe, _)| *lobe != Lobe::Mirror) {
        for (fold, degrees) in [true, false].into_iter().flat_map(|f| [(f, 3.0f64), (f, 80.0)]) {
            let mut material = reflector(lobe, masking, 0.6);
            material.fresnel = Some(Fresnel::Exact);
            material.f0 = Some(Color([0.9, 0.5, 0.04]));
            let finish = Bsdf::<f64>::new(&material, true);
            let incident = combine(&[(-1.0, at_angle(n, degrees.to_radians(), 1.0))]);
            let draws = Draws::sobol(5);
            each_reflection::<f64>(&material, (incident, n), fold, draws, 400, |d, weight| {
                if weight == [0.0; 3] {
                    return;
                }
                let query = query::<f64>((incident, n), fold);
                let BsdfValue { value, density } = finish.eval(&query, Vec3::of(d));
                for (w, value) in weight.into_iter().zip(vector(value)) {
                    let error = (value / density / w - 1.0).abs();
                    assert!(error < 1e-9, "{lobe:?} {masking:?} {degrees} {fold}: {error:e}");
                    compared += 1;
                }
            });
        }
    }
    assert!(compared > 5000, "{compared}");
}
