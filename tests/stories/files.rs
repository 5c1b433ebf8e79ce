//! Stories of files: saving, changes by other programs, errors in the file, quitting.

use super::*;

fn start(path: Option<&str>, text: &str) -> Model {
    let scene = Scene::parse(text, FILE).map(Arc::new);
    let path = path.map(PathBuf::from);
    let mut model = Model::new(path, "mirror-room.toml", scene, Stop::default());
    update(&mut model, Message::Resize([80, 24]), Duration::ZERO);
    model
}

fn press(model: &mut Model, keys: &str) -> Vec<Effect> {
    let press = |key: &str| update(model, Message::Key(key.parse().unwrap()), Duration::ZERO);
    keys.split_whitespace().flat_map(press).collect()
}

#[test]
fn quit_with_unsaved_edits_asks() {
    let mut desk = Desk::new(ROOM);
    desk.keys("] q");
    assert!(matches!(desk.model.overlay, Some(Overlay::Question(_))));
    desk.keys("Ctrl-c Esc");
    assert!(!desk.asked(|e| *e == Effect::Quit) && desk.model.overlay.is_none());
    desk.keys("q `c`");
    assert!(!desk.asked(|e| *e == Effect::Quit));
    desk.keys("q `s`");
    assert!(desk.asked(|e| *e == Effect::Quit));
    assert_ne!(desk.disk[Path::new(FILE)], ROOM);
    let mut desk = Desk::new(ROOM);
    desk.keys("] q `d`");
    assert!(desk.asked(|e| *e == Effect::Quit));
    assert_eq!(desk.disk[Path::new(FILE)], ROOM);
    let mut desk = Desk::new(ROOM);
    desk.keys("] u q");
    assert!(desk.asked(|e| *e == Effect::Quit), "nothing is left to save");
}

#[test]
fn save_as_asks_before_overwriting() {
    let mut desk = Desk::new(ROOM);
    desk.disk.insert("other.toml".into(), "precious".into());
    desk.keys("] W Ctrl-u `other.toml` Enter");
    assert_eq!(desk.disk[Path::new("other.toml")], "precious");
    assert!(
        matches!(&desk.model.overlay, Some(Overlay::Question(q)) if q.text.contains("other.toml"))
    );
    desk.keys("Esc");
    assert!(desk.model.is_unsaved());
    desk.keys("W Ctrl-u `other.toml` Enter `o`");
    assert_eq!(desk.disk[Path::new("other.toml")], desk.text());
    assert!(!desk.model.is_unsaved());
}

#[test]
fn untitled_scene_asks_for_path_before_quitting() {
    let mut model = start(None, ROOM);
    press(&mut model, "] q s");
    assert!(matches!(model.overlay, Some(Overlay::Prompt(_))));
    let effects = press(&mut model, "Enter");
    let Some(Effect::Save { scene, path, overwrite: false }) = effects.first() else {
        panic!("{effects:?}")
    };
    assert_eq!(path.as_deref(), Some(Path::new("mirror-room.toml")));
    let saved = Message::Saved(Arc::clone(scene), Ok("mirror-room.toml".into()));
    assert_eq!(update(&mut model, saved, Duration::ZERO).last(), Some(&Effect::Quit));
}

#[test]
fn edit_during_save_stays_unsaved() {
    let mut model = start(Some(FILE), ROOM);
    let effects = press(&mut model, "] Ctrl-s ]");
    let save = effects.into_iter().find_map(|e| match e {
        Effect::Save { scene, .. } => Some(scene),
        _ => None,
    });
    update(&mut model, Message::Saved(save.unwrap(), Ok(FILE.into())), Duration::ZERO);
    assert!(model.is_unsaved());
}

#[test]
fn save_over_external_change_asks() {
    let mut model = start(Some(FILE), ROOM);
    press(&mut model, "] Ctrl-s");
    let scene = Arc::clone(model.history.scene());
    let changed = Message::Saved(scene, Err(SaveError::Changed(FILE.into())));
    update(&mut model, changed, Duration::ZERO);
    let Some(Overlay::Question(question)) = &model.overlay else { panic!() };
    assert!(question.text.contains("changed by another program"), "{}", question.text);
    assert!(press(&mut model, "Enter").is_empty(), "Enter alone does no harm");
    assert!(model.is_unsaved());
    let failed = SaveError::Failed { path: FILE.into(), what: "the disk is full".into() };
    let scene = Arc::clone(model.history.scene());
    update(&mut model, Message::Saved(scene, Err(failed)), Duration::ZERO);
    assert!(model.notice.as_ref().is_some_and(|n| n.text.contains("the disk is full")));
}

#[test]
fn external_change_reloads_unless_edits_would_be_lost() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Object(1));
    let other = ROOM.replace("radius = 0.5", "radius = 0.25");
    desk.disk.insert(FILE.into(), other.clone());
    desk.send(Message::ChangedOnDisk(String::new()));
    assert_eq!(desk.text(), other);
    assert_eq!(desk.model.selection, Target::Object(1), "found again by its name");
    desk.keys("]");
    desk.disk.insert(FILE.into(), ROOM.into());
    desk.send(Message::ChangedOnDisk(String::new()));
    desk.keys("Enter");
    assert!(desk.text().contains("0.25") && desk.model.is_unsaved(), "mine are kept");
    desk.send(Message::ChangedOnDisk(String::new()));
    desk.keys("`r`");
    assert_eq!((desk.text().as_str(), desk.model.is_unsaved()), (ROOM, false));
    // A change of the file is reported, but it does not close an open form.
    desk.keys("a Enter");
    desk.send(Message::ChangedOnDisk(String::new()));
    assert!(matches!(desk.model.overlay, Some(Overlay::Form(_))));
    assert!(desk.notice().contains("Ctrl-o"));
}

#[test]
fn notes_about_mesh_files_are_shown_when_they_change() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, lines: &str| {
        let path = folder.path().join(name);
        fs::write(&path, format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{lines}")).unwrap();
        format!("[[object]]\nshape.mesh.file = {path:?}\n")
    };
    let (noted, plain) =
        (write("noted.obj", "l 1 2\nl 2 3\nv 0 0 0 1 0 0\n"), write("plain.obj", ""));
    let notice = |model: &Model| model.notice.as_ref().map_or("", |n| &n.text).to_string();
    let note =
        "noted.obj\": points and lines were left out (2 times) (and 1 more: `zerkalo check`)";
    let mut model = start(Some(FILE), &(ROOM.to_string() + &noted));
    assert!(notice(&model).contains(note), "{}", notice(&model));
    press(&mut model, "Left");
    assert_eq!(notice(&model), "");
    for (text, expected) in [(plain, "read "), (noted, note)] {
        let scene = Scene::parse(&(ROOM.to_string() + &text), FILE).map(Arc::new);
        update(&mut model, Message::Loaded(Box::new(scene)), Duration::ZERO);
        assert!(notice(&model).contains(expected), "{}", notice(&model));
    }
}

#[test]
fn unreadable_file_loads_after_it_is_fixed() {
    let broken = ROOM.replace("radius = 0.5", "radius = -1");
    let mut model = start(Some(FILE), &broken);
    assert!(model.file.unreadable);
    let errors = model.file.broken.as_ref().unwrap().to_string();
    assert!(errors.contains("room.toml:33") && errors.contains("radius is -1"), "{errors}");
    let effects = press(&mut model, "] a ] x m Ctrl-s Enter Tab Down Right p");
    assert!(effects.is_empty(), "{effects:?}");
    assert!(model.notice.as_ref().unwrap().text.contains("No scene"));
    assert_eq!(press(&mut model, "Ctrl-o"), [Effect::Load]);
    let scene = Arc::new(Scene::parse(ROOM, FILE).unwrap());
    let loaded = Message::Loaded(Box::new(Ok(Arc::clone(&scene))));
    let effects = update(&mut model, loaded, Duration::ZERO);
    assert!(effects.contains(&Effect::Show(scene)));
    assert!(!model.file.unreadable && model.file.broken.is_none() && !model.is_unsaved());
    assert!(!press(&mut model, "]").is_empty());
    let mut model = start(Some(FILE), &broken);
    assert_eq!(press(&mut model, "q"), [Effect::Quit]);
}

#[test]
fn error_in_changed_file_keeps_scene() {
    let mut desk = Desk::new(ROOM);
    desk.disk.insert(FILE.into(), ROOM.replace("[film]", "[flim]"));
    desk.send(Message::ChangedOnDisk(String::new()));
    assert!(desk.notice().contains("room.toml:2") && desk.notice().contains("flim"));
    assert_eq!(desk.text(), ROOM);
    desk.keys("] Ctrl-s");
    assert!(matches!(desk.model.overlay, Some(Overlay::Question(_))), "not over it unasked");
    desk.keys("Esc u");
    desk.disk.insert(FILE.into(), ROOM.into());
    desk.send(Message::ChangedOnDisk(String::new()));
    assert!(desk.model.file.broken.is_none());
}

#[test]
fn built_in_scene_opens_without_file() {
    let text = MIRROR_ROOM;
    let mut model = start(None, text);
    assert_eq!(**model.scene(), Scene::parse(text, "mirror-room.toml").unwrap());
    let raster = model.layout().unwrap().raster;
    let effects = update(&mut model, Message::Resize([120, 36]), Duration::ZERO);
    assert!(matches!(effects[..], [Effect::View(new)] if new.raster != Some(raster)));
}

#[test]
fn edit_during_save_prevents_quit() {
    let mut model = start(Some(FILE), ROOM);
    let effects = press(&mut model, "] q s ]");
    let save = effects.into_iter().find_map(|e| match e {
        Effect::Save { scene, .. } => Some(scene),
        _ => None,
    });
    let saved = Message::Saved(save.unwrap(), Ok(FILE.into()));
    let effects = update(&mut model, saved, Duration::ZERO);
    assert!(!effects.contains(&Effect::Quit) && model.is_unsaved());
}

#[test]
fn recovered_edits_replace_unreadable_file() {
    let mut model = start(Some(FILE), "[camera");
    let scene = Arc::new(Scene::parse(ROOM, FILE).unwrap());
    let left = OrphanedEdits { scene: Arc::clone(&scene), age: Duration::ZERO, changed: true };
    update(&mut model, Message::OrphanedEdits(left), Duration::ZERO);
    let effects = press(&mut model, "r");
    assert!(effects.contains(&Effect::Show(Arc::clone(&scene))), "{effects:?}");
    assert!(effects.contains(&Effect::Recover) && effects.contains(&Effect::Autosave(Some(scene))));
    assert!(model.is_unsaved() && !model.file.unreadable);
    // The contents of the file are not overwritten without confirmation.
    let effects = press(&mut model, "Ctrl-s");
    assert!(effects.is_empty() && matches!(model.overlay, Some(Overlay::Question(_))));
    let effects = press(&mut model, "o");
    assert!(matches!(effects[..], [Effect::Save { overwrite: true, .. }]), "{effects:?}");
}

#[test]
fn export_path_with_control_characters_is_not_copied() {
    let mut desk = Desk::new(ROOM);
    desk.keys("y");
    assert!(desk.notice().contains("No picture"));
    desk.keys("p P y");
    assert!(desk.asked(|e| *e == Effect::Copy("room-1.exr".into())));
    desk.effects.clear();
    desk.model.last_export = Some("a\nreboot\n.png".into());
    desk.keys("y");
    assert!(desk.effects.is_empty() && desk.notice().contains("not copied"));
}

#[test]
fn other_exports_do_not_end_a_render_at_another_size() {
    let mut desk = Desk::new(ROOM);
    // The picture that `p` writes has the same size.
    desk.keys("Ctrl-e Ctrl-u `64x48 png` Enter p");
    desk.send(Message::Exported(Err("the disk is full".into())));
    desk.send(Message::ExportProgress(Some((0.5, None))));
    desk.send(Message::ExportProgress(Some((0.4, None))));
    assert!(desk.model.export.is_some_and(|export| export.progress == 0.5), "never backwards");
    desk.keys("Ctrl-e `n`");
    assert!(desk.asked(|e| *e == Effect::FinishExport));
    desk.send(Message::ExportProgress(None));
    assert!(desk.model.export.is_none());
}

#[test]
fn image_viewer_closes_on_any_key() {
    let mut desk = Desk::new(ROOM);
    desk.keys("o");
    assert!(desk.model.overlay.is_none() && desk.notice().contains("No picture"));
    desk.keys("p o");
    let looked = |desk: &Desk| matches!(&desk.model.overlay, Some(Overlay::ViewerImage(looked)) if looked.path.ends_with("room-1.png"));
    assert!(looked(&desk));
    // After a resize the image is encoded again, for the new screen size.
    desk.effects.clear();
    let screen = [100, 30];
    desk.effects.extend(update(&mut desk.model, Message::Resize(screen), Duration::ZERO));
    assert!(
        looked(&desk) && desk.asked(|e| matches!(e, Effect::ViewImage { screen: [100, 30], .. }))
    );
    let before = desk.text();
    desk.keys("x");
    assert!(desk.model.overlay.is_none() && desk.text() == before);
    // An unreadable image is reported and the viewer closes.
    desk.keys("o");
    let message = Message::ViewerImage("room-1.png".into(), Err("it is gone".to_string()));
    update(&mut desk.model, message, Duration::ZERO);
    assert!(desk.model.overlay.is_none() && desk.notice().contains("room-1.png cannot be shown"));
    desk.keys("o Ctrl-c");
    assert!(desk.asked(|e| *e == Effect::Quit));
}

/// Files about each of which a reader has a note: name, contents, and the note.
fn noted_files() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let obj = |lines: &str| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{lines}").into_bytes();
    let ply = |lines: &str, end: &str| {
        format!(
            "ply\nformat ascii 1.0\n{lines}element vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{end}element face 1\nproperty list uchar int vertex_indices\n\
             end_header\n0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n"
        )
    };
    let stl = [&[0; 80][..], &[1, 0, 0, 0], &[0; 12]].concat();
    let corners = [[0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|c| c.map(f32::to_le_bytes));
    let stl = [&stl[..], corners.as_flattened().as_flattened(), &[0, 0x80]].concat();
    let gltf = |node: &str, primitives: &str, more: &str| {
        let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
        let part = r#"{"attributes":{"POSITION":0}}"#;
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36,
            "uri":"data:application/octet-stream;base64,{data}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "meshes":[{{"primitives":[{part},{primitives}]}}],"nodes":[{{"mesh":0{node}}}],
            "scenes":[{{"nodes":[0]}}],"scene":0{more}}}"#
        )
        .replace(",]", "]")
        .into_bytes()
    };
    let jpeg = include_bytes!("../images/grey.jpg");
    let sky = |pixel: &[u8]| [b"#?RGBE\n\n-Y 1 +X 2\n", pixel, &[128; 4]].concat();
    vec![
        ("a.obj", obj("l 1 2\n"), "points and lines were left out"),
        ("b.obj", obj("surf 0 1 0 1 1\n"), "curves and free-form surfaces were left out"),
        ("c.obj", obj("v 0 0 1 1 0 0\n"), "a colour of a vertex was not read"),
        ("d.obj", obj("f 1 2 2\n"), "a triangle without area was left out"),
        ("e.obj", obj("f 2 3 1\n"), "a triangle that equals another one was left out"),
        ("f.obj", obj("f 1 2\n"), "a face of fewer than three corners was left out"),
        ("g.obj", obj("v 1 1.5 0\nf 1 4 2 3\n"), "a polygon whose outline crosses itself"),
        ("h.obj", obj("mtllib none.mtl\n"), "no colours: "),
        ("i.obj", obj("mtllib ../x.mtl\n"), "no colours: \"../x.mtl\" is not in the mesh's folder"),
        (
            "j.obj",
            obj("mtllib other.mtl\nusemtl red\nf 3 2 1\n"),
            "a material that no library before it defines",
        ),
        ("k.obj", obj("mtllib bad.mtl\n"), "a colour of a material cannot be read"),
        ("l.obj", obj("mtllib map.mtl\n"), "a texture of a material was not read"),
        ("m.obj", obj("vt nan 0\nf 1/1 3/1 2/1\n"), "texture coordinates that are no numbers"),
        ("n.obj", obj("vn 0 0 1\nf 1//1 3//1 2//1\n"), "a normal that is missing was computed"),
        ("a.ply", ply("", "property uchar red\n").into(), "the colours of vertices or faces"),
        ("b.ply", ply("comment TextureFile t.png\n", "property float w\n").into(), "a texture was"),
        ("a.stl", stl, "a colour of a triangle was not read"),
        (
            "a.gltf",
            gltf(r#","extensions":{"EXT_mesh_gpu_instancing":{}}"#, "", ""),
            "the instances of a node were not read",
        ),
        ("b.gltf", gltf(r#","skin":0"#, "", ""), "the joints of a skin were not read"),
        (
            "c.gltf",
            gltf("", "", r#","extensionsRequired":["KHR_materials_unlit"]"#),
            "the extension KHR_materials_unlit was not applied",
        ),
        ("d.gltf", gltf("", r#"{"attributes":{"POSITION":0},"mode":1}"#, ""), "points and lines"),
        ("e.gltf", gltf("", r#"{"attributes":{}}"#, ""), "a part without positions was left out"),
        (
            "f.gltf",
            gltf("", r#"{"attributes":{"POSITION":0,"COLOR_0":0}}"#, ""),
            "the colours of the vertices of a part were not read",
        ),
        (
            "g.gltf",
            gltf("", r#"{"attributes":{"POSITION":0},"material":0}"#, ""),
            "the base colour texture of a part was not read",
        ),
        ("a.hdr", sky(&[255; 4]), "pixels that are infinite or above 1e15, taken as 65504"),
        ("a.jpg", [&jpeg[..jpeg.len() - 60], &[0; 4000]].concat(), "the file has no end"),
    ]
}

/// Checks that `check`, `render` and the dashboard show every note of a reader.
#[test]
fn every_note_of_a_reader_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("bad.mtl"), "newmtl a\nKd x\n").unwrap();
    fs::write(path("other.mtl"), "newmtl b\nKd 1 1 1\n").unwrap();
    fs::write(path("map.mtl"), "newmtl a\nmap_Kd t.png\n").unwrap();
    let mut all = String::from("ambient.color = [1, 1, 1]\n");
    let files = noted_files();
    for (name, contents, note) in &files {
        fs::write(path(name), contents).unwrap();
        let file = path(name);
        let part = match name.rsplit('.').next() {
            Some("hdr") => format!("[[light]]\nenvironment.file = {file:?}\n"),
            Some("jpg") => format!("[materials.jpg]\ntexture.image.file = {file:?}\n"),
            _ => format!("[[object]]\nshape.mesh.file = {file:?}\n"),
        };
        let model = start(Some(FILE), &(ROOM.to_string() + &part));
        let notice = model.notice.as_ref().map_or("", |n| &n.text);
        assert!(notice.contains(&format!("{name}\": {note}")), "{name}: {notice}");
        all += &part;
    }
    fs::write(path("all.toml"), all).unwrap();
    for args in ["check all.toml", "render all.toml -o a.png --size 16x12 --spp 1 --threads 1"] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_zerkalo"));
        let run = command.args(args.split(' ')).current_dir(folder.path()).output().unwrap();
        let printed = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{args}: {printed}");
        for (name, _, note) in &files {
            assert!(printed.contains(&format!("{name}\": {note}")), "{args}, {name}: {printed}");
        }
    }
}
