//! Consistency of the command table.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use zerkalo::dashboard::hints::reference;
use zerkalo::dashboard::update::commands::{COMMANDS, lookup};
use zerkalo::terminal::event::Key;

#[test]
fn every_key_runs_one_command_per_context() {
    let mut seen = HashMap::new();
    for command in COMMANDS {
        for (context, names) in command.keys {
            for name in names.split(' ') {
                let key: Key = name.parse().unwrap_or_else(|e| panic!("{}: {e}", command.label));
                assert_eq!(key.to_string(), *name);
                if let Some(other) = seen.insert((*context, key), command.label) {
                    panic!("{name} in {context:?} is both {other:?} and {:?}", command.label);
                }
                let found = lookup(*context, key).map(|found| found.label);
                assert_eq!(found, Some(command.label), "{name} in {context:?}");
            }
        }
    }
}

#[test]
fn every_command_has_a_label_of_its_own() {
    let mut labels = HashSet::new();
    for command in COMMANDS {
        assert!(labels.insert(command.label), "{:?} twice", command.label);
    }
}

/// `ZERKALO_BLESS=1 cargo test --test program stories::` rewrites the page.
#[test]
fn keys_page_matches_command_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/keys.md");
    let page = reference();
    if std::env::var_os("ZERKALO_BLESS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == page,
        "docs/keys.md differs from the command table: ZERKALO_BLESS=1 cargo test --test program stories::"
    );
}
