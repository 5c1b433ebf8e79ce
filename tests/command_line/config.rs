//! Configuration file of the user.

use super::*;

fn run(desk: &Desk, text: &str, args: &[&str]) -> Run {
    fs::create_dir_all(desk.path("zerkalo")).unwrap();
    fs::write(desk.path("zerkalo/config.toml"), text).unwrap();
    let mut command = desk.command(args);
    Run::from(command.env("XDG_CONFIG_HOME", desk.0.path()).output().unwrap())
}

#[test]
fn config_sets_options_keys_and_colours_and_prints_them() {
    let desk = Desk::new();
    let text = "[options]\nsize = \"32x24\"\nspp = 4\n[keys]\n\"undo\" = \"Ctrl-t z\"\n\
                [theme]\naccent = \"#ff8000\"\n";
    let printed = run(&desk, text, &["config"]).out;
    let table: toml::Table = printed.parse().unwrap();
    assert_eq!(table["options"]["size"].as_str(), Some("32x24"));
    assert_eq!(table["keys"]["undo"].as_str(), Some("Ctrl-t z"));
    assert_eq!(table["keys"]["only the picture"].as_str(), Some(""), "z is taken");
    assert_eq!(table["theme"]["accent"].as_str(), Some("#ff8000"));
    assert_eq!(run(&desk, &printed, &["config"]).out, printed, "it can be read again");
    let done = run(&desk, text, &["render", "scene.toml", "-o", "a.png"]);
    assert!(done.out.contains("32x24"), "{}", done.out);
    let done = run(&desk, text, &["render", "scene.toml", "-o", "a.png", "--size", "16x8"]);
    assert!(done.out.contains("16x8"), "the command line has precedence: {}", done.out);
}

#[test]
fn faults_of_config_have_place_and_remedy() {
    for (text, words) in [
        ("[option]\n", "config.toml:1:2  there is no table \"option\".* Did you mean \"options\"?"),
        (
            "[options]\nthread = 2\n",
            "config.toml:2:1  there is no option \"thread\".* Did you mean \"threads\"?",
        ),
        ("[options]\nthreads = 0\n", "config.toml:2:11  invalid value '0' for '--threads <N>'"),
        (
            "[options]\ncolor = \"pink\"\n",
            "config.toml:2:9  invalid value 'pink'.*possible values: auto, true",
        ),
        (
            "[keys]\n\"und\" = \"u\"\n",
            "config.toml:2:1  there is no action \"und\".* Did you mean \"undo\"?",
        ),
        (
            "[keys]\n\"undo\" = \"Ctrl-\"\n",
            "config.toml:2:10  there is no key \"Ctrl-\".*names as in",
        ),
        ("[theme]\naccent = \"red\"\n", "config.toml:2:10  accent is no colour.*#80a0ff"),
        ("[theme\n", "config.toml:1:"),
    ] {
        let desk = Desk::new();
        let failed = run(&desk, text, &["check", "scene.toml"]);
        let message = failed.err.replace('\n', " ");
        let mut rest = message.as_str();
        for part in words.split(".*") {
            let at = rest.find(part).unwrap_or_else(|| panic!("{text}: {part}: {message}"));
            rest = &rest[at + part.len()..];
        }
        assert_eq!(failed.status, 1, "{text}");
    }
}
