//! Unique names for new objects, lights, materials and cameras.

use crate::Scene;
use crate::edit::Target;

/// Returns `wanted` if this name is free. If not, returns it with the smallest number from 2 that
/// makes it free: `cube 2`. A number at the end of `wanted` is replaced.
pub(super) fn free_name(wanted: &str, taken: impl Fn(&str) -> bool) -> String {
    if !wanted.is_empty() && !taken(wanted) {
        return wanted.to_string();
    }
    let stem = match wanted.rsplit_once(' ') {
        Some((stem, number)) if number.parse::<u32>().is_ok() => stem,
        _ => wanted,
    };
    // Names have at most 60 characters: 54 of them leave room for the number.
    let stem: String = stem.chars().take(54).collect();
    (2u32..).map(|n| format!("{stem} {n}")).find(|name| !taken(name)).unwrap_or(stem)
}

/// Returns a name that no object has, and that none without a name shows.
pub(super) fn free_object(scene: &Scene, wanted: &str) -> String {
    let shows = |i: usize, own: &str, name: &str| match own {
        "" => Target::Object(i).label(scene) == name,
        own => own == name,
    };
    free_name(wanted, |name| (0..).zip(&scene.objects).any(|(i, o)| shows(i, &o.name, name)))
}

pub(super) fn free_light(scene: &Scene, wanted: &str) -> String {
    free_name(wanted, |name| scene.lights.iter().any(|l| l.name == name))
}

pub(super) fn free_material(scene: &Scene, wanted: &str) -> String {
    free_name(wanted, |name| scene.materials.contains_key(name))
}

pub(super) fn free_view(scene: &Scene, wanted: &str) -> String {
    free_name(wanted, |name| scene.cameras.contains_key(name))
}

#[cfg(test)]
mod tests {
    use super::free_name;

    #[test]
    fn unique_names_count_up() {
        let taken = ["cube", "cube 2", "a 7", "7"];
        let free = |wanted| free_name(wanted, |name| taken.contains(&name));
        assert_eq!(free("ball"), "ball");
        assert_eq!(free("cube"), "cube 3");
        assert_eq!(free("cube 2"), "cube 3");
        assert_eq!(free("a 7"), "a 2");
        assert_eq!(free("7"), "7 2");
        let long = "x".repeat(80);
        assert!(free_name(&long, |name| name == long).len() <= 60);
    }
}
