//! Relighting: reuse of a film for an edited scene. If the film can be reused, its samples, mixed
//! with the weights of the edited scene, must give the picture of a fresh render. The test edits
//! every key of the scene format, from the tables of keys.

use crate::harness::*;

const SEED: u64 = 11;
const SAMPLES: u32 = 2;

/// Returns a scene with one object of each kind on a grid in front of the camera, with all kinds of
/// material, under all kinds of light.
fn base() -> Scene {
    let mut text = "
        film = { size = [30, 20], rays_per_pixel = 64 }
        trace = { max_depth = 3 }
        camera = { eye = [0.0, 1.0, 14.0], target = [0.0, 0.0, 0.0] }
        cameras.left = { eye = [-3.0, 1.0, 9.0], direction = [0.3, 0.0, -1.0] }
        background.color = [0.1, 0.2, 0.3]
        ambient.color = [0.3, 0.25, 0.2]
        materials.matte = { color = [0.9, 0.4, 0.2], specular = 0.3 }
        materials.mirror = { reflection = 0.6, roughness = 0.1, two_sided = false }
        materials.glass = { transmission = 0.7, reflection = 0.4, fresnel = \"dielectric\" }
        materials.inner.color = [0.1, 0.9, 0.1]
        materials.cut = { color = [0.9, 0.1, 0.9], reflection = 0.2 }
        materials.spare.color = [0.5, 0.5, 0.5]
        [materials.gold]
        metal = \"gold\"
        reflection = 0.8
        lobe = \"ggx\"
        alpha = 0.2
        highlight = \"cook-torrance\"
        specular = 0.5
        [materials.painted]
        texture.image = { file = \"scenes/textures/wood.png\", scale = [2.0, 2.0] }
        bump.image = { file = \"scenes/textures/brick-heights.png\", height = 0.2 }
        [materials.checked]
        texture.checker = { even = [0.9, 0.9, 0.1], odd = [0.1, 0.1, 0.9], scale = [3.0, 3.0] }
        [groups.left]
        intensity = 0.7
        [[light]]
        name = \"lamp\"
        point = { position = [2.0, 6.0, 8.0] }
        falloff = \"inverse-square\"
        intensity = 120.0
        [[light]]
        directional = { direction = [0.5, -1.0, -0.5] }
        color = [0.9, 0.8, 0.6]
        intensity = 0.4
        [[light]]
        name = \"off\"
        point = { position = [-4.0, 4.0, 6.0] }
        on = false
        [[light]]
        point = { position = [-5.0, 5.0, 4.0] }
        intensity = 0.2
        group = \"left\"
        [[light]]
        point = { position = [-5.0, 1.0, 5.0] }
        color = [0.2, 0.3, 0.1]
        group = \"left\"
        [[object]]
        name = \"die\"
        material = \"matte\"
        transform = [{ rotate = { axis = [1.0, 1.0, 0.0], degrees = 20.0 } }, { translate = [0.0, 3.2, 0.0] }]
        [[object.shape.difference.of]]
        material = \"inner\"
        shape.box = { center = [0.0, 0.0, 0.0], size = [1.5, 1.5, 1.5] }
        [[object.shape.difference.of]]
        [[object.shape.difference.of.shape.union.of]]
        material = \"cut\"
        shape.sphere = { center = [0.7, 0.7, 0.7], radius = 0.7 }
        transform = [{ scale = [1.0, 1.1, 1.0] }]
        [[object.shape.difference.of.shape.union.of]]
        shape.sphere = { center = [-0.7, 0.7, 0.7], radius = 0.5 }
    "
    .to_string();
    let finishes = ["matte", "mirror", "glass", "gold", "painted", "checked"];
    for (i, (key, example)) in EXAMPLES.iter().enumerate() {
        let example = example.replace("scenes/meshes/knot.ply", "scenes/meshes/stone.obj");
        let (x, y) = ((i % 6) as f64 * 1.8 - 4.5, (i / 6) as f64 * 1.7 - 2.6);
        let transform = if *key == "plane" {
            "transform = [{ rotate_x = 80.0 }, { translate = [0.0, -3.5, -3.0] }]".to_string()
        } else {
            format!(
                "transform = [{{ rotate_x = 25.0 }}, {{ scale = 0.8 }}, {{ translate = [{x:?}, {y:?}, 0.0] }}]"
            )
        };
        let finish = finishes[i % finishes.len()];
        write!(text, "\n[[object]]\nmaterial = \"{finish}\"\n{example}\n{transform}\n").unwrap();
    }
    Scene::parse(&text, NAME).unwrap_or_else(|e| panic!("{e}"))
}

fn rendered(scene: &Scene, pool: &rayon::ThreadPool) -> RenderState {
    let mut rendering = begin(scene, SEED, Precision::Single);
    uniform(&mut rendering, 0, SAMPLES, pool);
    rendering
}

/// Returns a changed value for `key` of `scene`. The value may be invalid. Returns `None` if no
/// value can be derived, such as for a table that the scene does not have.
fn proposal(key: &Key, scene: &mut Table, numbers: &mut Numbers) -> Option<Value> {
    // An earlier edit may have removed the table.
    let materials = scene.get("materials").and_then(Value::as_table).into_iter();
    let names: Vec<String> =
        materials.flat_map(Table::keys).cloned().chain([String::new()]).collect();
    let old = value_at(scene, &key.path).cloned();
    let other = |x: f64, numbers: &mut Numbers| match numbers.below(5) {
        0 => 0.0,
        1 => x + 0.25,
        2 => -x,
        3 => x * 1.5,
        _ => (x * 0.5).min(1.0),
    };
    let one_of = |value: &Value, numbers: &mut Numbers| match value {
        Value::Array(list) if !list.is_empty() => {
            let mut list = list.clone();
            let i = numbers.below(list.len());
            let x = list[i].as_float().or(list[i].as_integer().map(|x| x as f64));
            list[i] = Value::Float(other(x.unwrap_or(0.0), numbers));
            Value::Array(list)
        }
        Value::Float(x) => Value::Float(other(*x, numbers)),
        Value::Integer(x) => Value::Float(other(*x as f64, numbers)),
        value => value.clone(),
    };
    let random = |n: usize, numbers: &mut Numbers| {
        Value::Array((0..n).map(|_| Value::Float(numbers.unit())).collect())
    };
    Some(match key.takes {
        ValueType::Text => Value::String(match key.path.last()?.as_str() {
            "material" => names[numbers.below(names.len())].clone(),
            "file" if key.path.iter().any(|k| k == "mesh") => "scenes/meshes/vase.ply".into(),
            "file" => format!("scenes/textures/{}.png", ["wood", "sheet"][numbers.below(2)]),
            _ => format!("name {}", numbers.below(1000)),
        }),
        ValueType::Switch => Value::Boolean(!old.and_then(|v| v.as_bool()).unwrap_or(true)),
        ValueType::Choice(words) => Value::String(words[numbers.below(words.len())].name.into()),
        ValueType::Whole(_) => Value::Integer(numbers.below(9) as i64),
        ValueType::Wholes(n, _) => {
            Value::Array((0..n).map(|_| Value::Integer(8 + numbers.below(24) as i64)).collect())
        }
        ValueType::Number(_) | ValueType::Factor => {
            one_of(&old.unwrap_or(Value::Float(numbers.unit())), numbers)
        }
        ValueType::Numbers(n, _) => match old {
            Some(old) => one_of(&old, numbers),
            None => random(n, numbers),
        },
        ValueType::Direction => match old {
            Some(old) => one_of(&old, numbers),
            None => random(3, numbers),
        },
        ValueType::Color(_) => match numbers.below(4) {
            0 => Value::Array(vec![Value::Float(0.0); 3]),
            _ => random(3, numbers),
        },
        ValueType::OneOf(kinds) => {
            let kind = kinds[numbers.below(kinds.len())].name;
            let value = match EXAMPLES.iter().find(|(key, _)| *key == kind) {
                Some((_, example)) => {
                    let mut table: Table = example.parse().unwrap();
                    return table.remove("shape");
                }
                None if key.path.last()? == "view_angle" => Value::Float(30.0),
                None => Value::Table(Table::new()),
            };
            Value::Table(Table::from_iter([(kind.to_string(), value)]))
        }
        ValueType::ListOf(_) => {
            let mut list = old.and_then(|v| v.as_array().cloned()).unwrap_or_default();
            let step = Table::from_iter([("rotate_z".to_string(), Value::Float(10.0))]);
            if numbers.below(2) == 0 {
                list.push(step.into())
            } else {
                list.truncate(1)
            }
            Value::Array(list)
        }
        ValueType::Tables(_) => {
            let mut list = old?.as_array()?.clone();
            let i = numbers.below(list.len());
            let mut taken = list.remove(i);
            match numbers.below(3) {
                0 => {}
                1 => {
                    taken.as_table_mut()?.remove("name");
                    list.extend([taken.clone(), taken]);
                }
                _ => list.insert(numbers.below(list.len() + 1), taken),
            }
            Value::Array(list)
        }
        ValueType::Named(_) => {
            let mut named = old?.as_table()?.clone();
            let name = named.keys().nth(numbers.below(named.len().max(1)))?.clone();
            let value = named.remove(&name)?;
            if numbers.below(2) == 0 {
                named.insert(format!("{name} too"), value);
            }
            Value::Table(named)
        }
        ValueType::Table(_) => old?,
    })
}

/// Sets `key` to another value or removes it.
fn edit(changed: &mut Table, key: &Key, numbers: &mut Numbers) {
    if numbers.below(8) == 0 {
        return put(changed, &key.path, None);
    }
    if let Some(value) = proposal(key, changed, numbers) {
        put(changed, &key.path, Some(value));
    }
}

struct Bench {
    base: Scene,
    film: RenderState,
    pool: Pool,
    tried: usize,
    served: usize,
    /// Last components of the edited keys in two sets. The first set contains the keys after whose
    /// edits the film was not reused, the second those after whose edits it was reused.
    by_key: [BTreeSet<String>; 2],
}

impl Bench {
    fn new() -> Self {
        let (base, pool) = (base(), pool(2));
        let film = rendered(&base, &pool);
        Self { base, film, pool, tried: 0, served: 0, by_key: Default::default() }
    }

    /// Checks the picture if the film is reused for the edited scene `changed`. Returns `true` if
    /// it is reused, `false` if it is not, and `None` if the edited scene is invalid.
    fn holds(&mut self, changed: &Table, what: &str) -> Option<bool> {
        let edited = scene_of_table(changed, &self.base.resolver)?;
        self.tried += 1;
        if !self.film.try_reuse(&Arc::new(edited.clone())) {
            return Some(false);
        }
        self.served += 1;
        let relit = picture(&self.film, Replicates::Both);
        let fresh = picture(&rendered(&edited, &self.pool), Replicates::Both);
        assert_eq!(relit.len(), fresh.len(), "{what}");
        let brightest = fresh.iter().flatten().fold(1.0f64, |m, x| m.max(*x));
        for (relit, fresh) in relit.iter().flatten().zip(fresh.iter().flatten()) {
            // Tolerance for the rounding of samples to the film's steps and of weights in single
            // precision.
            assert!((relit - fresh).abs() < 1e-6 * brightest, "{what}: {relit} is {fresh} afresh");
        }
        Some(true)
    }
}

#[test]
fn relit_film_equals_render_of_the_edited_scene() {
    let mut bench = Bench::new();
    let mut numbers = Numbers::new(5);
    let plain = bench.base.to_table();
    let all = keys(&plain);
    assert!(all.len() > 450, "only {} keys", all.len());
    for key in &all {
        for _ in 0..2 {
            let mut changed = plain.clone();
            edit(&mut changed, key, &mut numbers);
            let what = format!("{:?} = {:?}", key.path, value_at(&mut changed, &key.path));
            if let Some(served) = bench.holds(&changed, &what).filter(|_| changed != plain) {
                bench.by_key[usize::from(served)].insert(key.path.last().unwrap().clone());
            }
        }
    }
    // Several edits at once. Four of five are of keys that often allow relighting.
    let mild = |key: &&Key| {
        matches!(key.path[0].as_str(), "light" | "groups" | "ambient" | "background" | "materials")
    };
    let mild: Vec<&Key> = all.iter().filter(mild).collect();
    for round in 0..200 {
        let mut changed = plain.clone();
        let mut what = String::new();
        for _ in 0..2 + round % 3 {
            let from_mild = numbers.below(5) > 0;
            let key = if from_mild {
                mild[numbers.below(mild.len())]
            } else {
                &all[numbers.below(all.len())]
            };
            edit(&mut changed, key, &mut numbers);
            write!(what, "{:?} = {:?}; ", key.path, value_at(&mut changed, &key.path)).unwrap();
        }
        bench.holds(&changed, &what);
    }
    let Bench { tried, served, by_key: [refused, accepted], .. } = &bench;
    println!("{} keys, {tried} scenes, {served} served; {accepted:?}; not {refused:?}", all.len());
    assert!(*tried > 900 && *served > 150, "{tried} {served}");
    for key in ["intensity", "color", "on", "name", "rays_per_pixel", "eye", "material", "cameras"]
    {
        assert!(accepted.contains(key), "no edit of {key} was served");
    }
}

#[test]
fn material_of_a_compound_part_prevents_relighting() {
    let mut bench = Bench::new();
    for name in ["inner", "cut"] {
        let mut edited = bench.base.clone();
        edited.materials.get_mut(name).unwrap().diffuse = 0.125;
        assert!(!bench.film.try_reuse(&Arc::new(edited)), "{name}");
        let mut renamed = bench.base.clone();
        let material = renamed.materials.remove(name).unwrap();
        renamed.materials.insert("other".into(), material);
        for object in &mut renamed.objects {
            object.rename_material(name, "other");
        }
        assert!(renamed.faults().is_empty());
        assert_eq!(bench.holds(&renamed.to_table(), name), Some(true));
    }
}
