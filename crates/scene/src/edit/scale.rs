//! Scaling of objects, parts and lights about a point.

use crate::edit::compound::{body, set_body, to_compound};
use crate::edit::{Edit, EditError, Target, move_by};
use crate::value::{floor_log10, round_significant, rounded_to};
use crate::{Object, Scale, Scene, TransformOp};
use glam::DVec3;

/// Scales an object or a part by `factor` about a point, by two steps at the end of its transform,
/// which later scalings change. A light keeps its size and moves. Fails for other targets.
pub fn scale(scene: &Scene, target: &Target, factor: f64, about: DVec3) -> Result<Edit, EditError> {
    if !(factor.is_finite() && factor > 0.0) {
        return Err(EditError::new("the factor is not a number greater than 0", ""));
    }
    if let Target::Light(i) = target {
        let position = scene.lights.get(*i).and_then(|light| light.position());
        let by =
            position.map_or(DVec3::ZERO, |at| (factor - 1.0) * (DVec3::from_array(at) - about));
        return move_by(scene, target, by.to_array());
    }
    let Ok(mut body) = body(scene, target) else {
        let found = format!("{} cannot be scaled", target.label(scene));
        return Err(EditError::new(found, "Select an object, a part of one or a light."));
    };
    let mut next = scene.clone();
    scale_body(&mut body, factor, to_compound(scene, target).transform_point3(about));
    set_body(&mut next, target, body);
    Edit::checked(next, target.clone(), format!("scale {}", target.label(scene)))
}

fn scale_body(body: &mut Object, factor: f64, about: DVec3) {
    let (old, shift, own) = match body.transform[..] {
        [.., TransformOp::Scale(Scale(old)), TransformOp::Translate(shift)] => (old, shift, 2),
        [.., TransformOp::Scale(Scale(old))] => (old, [0.0; 3], 1),
        [.., TransformOp::Translate(shift)] => ([1.0; 3], shift, 1),
        _ => ([1.0; 3], [0.0; 3], 0),
    };
    let kept = body.transform.len() - own;
    body.transform.truncate(kept);
    let size = body.form().bounds().map_or(1.0, |(low, high)| (high - low).max_element());
    let digits = floor_log10(size.max(about.abs().max_element())) - 6;
    let shift = DVec3::from_array(shift) * factor + about * (1.0 - factor);
    let shift = shift.map(|x| rounded_to(x, digits)).to_array();
    let scale = old.map(|x| round_significant(x * factor, 12));
    if scale != [1.0; 3] {
        body.transform.push(TransformOp::Scale(Scale(scale)));
    }
    if shift != [0.0; 3] {
        body.transform.push(TransformOp::Translate(shift));
    }
}
