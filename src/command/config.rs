//! Configuration file of the user: defaults of options, keys and colours. `zerkalo config` prints it.

use crate::command::args::Cli;
use crate::command::{Failure, write_line};
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::update::commands::{COMMANDS, rebind, table};
use crate::dashboard::view::theme::{SHIPPED_TONES, set_tones, tones};
use clap::{Arg, Command, CommandFactory};
use std::env;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use toml_edit::{Document, Item, Table};
use zerkalo_scene::Diagnostic;
use zerkalo_scene::value::did_you_mean;
use zerkalo_scene::value::sanitized;
use zerkalo_terminal::cells::nearest_xterm;
use zerkalo_terminal::event::Key;

/// Options that the table `[options]` may set, for all commands that have them.
const OPTIONS: [&str; 12] = [
    "threads",
    "color",
    "graphics",
    "bandwidth",
    "precision",
    "size",
    "exposure",
    "tone",
    "noise",
    "spp",
    "time",
    "bits",
];

/// Options that the file has set: the name and the value of each.
static OPTIONS_SET: OnceLock<Vec<(&'static str, &'static str)>> = OnceLock::new();

/// Returns the path of the file (XDG Base Directory Specification), whether it exists or not.
fn path() -> Option<PathBuf> {
    let absolute = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = absolute("XDG_CONFIG_HOME");
    let folder = folder.or_else(|| absolute("HOME").map(|home| home.join(".config")))?;
    Some(folder.join("zerkalo/config.toml"))
}

/// Reads the file, sets keys and colours, and returns the command line with its defaults. Without a
/// file nothing changes.
pub fn command_line() -> Result<Command, String> {
    let text = path().and_then(|path| Some((std::fs::read_to_string(&path).ok()?, path)));
    if let Some((text, path)) = text {
        apply(&text, &path).map_err(|error| error.to_string())?;
    }
    let defaults = OPTIONS_SET.get().map_or(&[][..], Vec::as_slice);
    let mut command = with_defaults(Cli::command(), defaults);
    let names: Vec<_> = command.get_subcommands().map(|c| c.get_name().to_string()).collect();
    for name in names {
        command = command.mut_subcommand(name, |command| with_defaults(command, defaults));
    }
    Ok(command)
}

fn option<'a>(command: &'a Command, name: &str) -> Option<&'a Arg> {
    command.get_arguments().find(|arg| arg.get_long() == Some(name))
}

/// Returns the program without a subcommand, and the subcommands.
fn commands(root: &Command) -> impl Iterator<Item = &Command> {
    std::iter::once(root).chain(root.get_subcommands())
}

fn with_defaults(command: Command, defaults: &[(&'static str, &'static str)]) -> Command {
    defaults.iter().fold(command, |command, (name, value)| match option(&command, name) {
        Some(_) => command.mut_arg(name, |arg| arg.default_value(*value)),
        None => command,
    })
}

/// Cause of an error: byte offset in the text, finding and help.
type Fault = (usize, String, String);

fn apply(text: &str, path: &Path) -> Result<(), Box<Diagnostic>> {
    let located = |(at, found, help): Fault| Box::new(Diagnostic::at(path, text, at, found, help));
    let document = Document::parse(text).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        located((at, format!("it is not TOML: {}", error.message()), String::new()))
    })?;
    read(document.as_table()).map_err(located)
}

fn read(root: &Table) -> Result<(), Fault> {
    const TABLES: [&str; 3] = ["options", "keys", "theme"];
    for (name, item) in root {
        let at = root.key(name).and_then(|key| key.span()).map_or(0, |span| span.start);
        let at_table = item.span().map_or(at, |span| span.start);
        let Some(table) = item.as_table_like().filter(|_| TABLES.contains(&name)) else {
            return Err(unknown(at.max(at_table), "table", name, &TABLES));
        };
        let mut options = Vec::new();
        let (mut keys, mut colors) = (Vec::new(), SHIPPED_TONES.map(|(_, tone)| tone));
        for (key, item) in table.iter() {
            let at = table.key(key).and_then(|key| key.span()).map_or(at_table, |span| span.start);
            let value = item.span().map_or(at, |span| span.start);
            match name {
                "options" => options.push(read_option((at, key), (value, item))?),
                "keys" => keys.push(read_keys((at, key), (value, item))?),
                _ => {
                    let names = SHIPPED_TONES.map(|(name, _)| name);
                    let index = names.iter().position(|name| *name == key);
                    let index = index.ok_or_else(|| unknown(at, "colour", key, &names))?;
                    let rgb = item.as_str().and_then(rgb_of).ok_or_else(|| {
                        let help = "Expected a colour such as \"#80a0ff\".".to_string();
                        (value, format!("{key} is no colour"), help)
                    })?;
                    colors[index] = (rgb, nearest_xterm(rgb), colors[index].2);
                }
            }
        }
        match name {
            "options" => drop(OPTIONS_SET.set(options)),
            "keys" => rebind(&keys),
            _ => set_tones(colors),
        }
    }
    Ok(())
}

/// Parses a colour such as `#80a0ff`.
fn rgb_of(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
    let [_, rgb @ ..] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
    Some(rgb)
}

fn unknown(at: usize, what: &str, name: &str, known: &[&str]) -> Fault {
    let help = did_you_mean(name, known.iter().copied());
    let list =
        if known.len() > 12 { String::new() } else { format!("Known: {}.", known.join(", ")) };
    (at, format!("there is no {what} \"{}\"", sanitized(name)), list + &help)
}

/// Parses an option, whose value must be valid for each command that has the option.
fn read_option(
    (at, name): (usize, &str),
    (value_at, item): (usize, &Item),
) -> Result<(&'static str, &'static str), Fault> {
    let known = OPTIONS.into_iter().find(|known| *known == name);
    let known = known.ok_or_else(|| unknown(at, "option", name, &OPTIONS))?;
    let text = item.as_str().map_or_else(|| item.to_string().trim().to_string(), str::to_string);
    let root = Cli::command();
    for arg in commands(&root).filter_map(|command| option(command, name)) {
        let arg = arg.clone().required(false);
        let alone = Command::new("zerkalo").no_binary_name(true).arg(arg);
        if let Err(error) = alone.try_get_matches_from([format!("--{name}={text}")]) {
            let message = error.to_string();
            let reason: Vec<_> = message.lines().take_while(|line| !line.is_empty()).collect();
            let reason = reason.join(" ").replace("error: ", "").replace("  ", " ");
            return Err((value_at, reason, format!("`zerkalo render --help` describes --{name}.")));
        }
    }
    Ok((known, text.leak()))
}

/// Parses the new keys of a command: its index in the table, and the names of the keys.
fn read_keys(
    (at, label): (usize, &str),
    (value, item): (usize, &Item),
) -> Result<(usize, String), Fault> {
    let labels: Vec<_> = COMMANDS.iter().map(|command| command.label).collect();
    let index = labels.iter().position(|known| *known == label);
    let index = index.ok_or_else(|| unknown(at, "action", label, &labels))?;
    let help = || "Expected names as in `zerkalo config`, such as \"u Ctrl-z\".".to_string();
    let text = item.as_str();
    let text =
        text.ok_or_else(|| (value, format!("the keys of \"{label}\" are no text"), help()))?;
    let mut names = Vec::new();
    for name in text.split_whitespace() {
        let key: Key = name
            .parse()
            .map_err(|_| (value, format!("there is no key \"{}\"", sanitized(name)), help()))?;
        names.push(key.to_string());
    }
    Ok((index, names.join(" ")))
}

/// Prints the settings in force, as a configuration file.
pub fn run() -> Result<(), Failure> {
    let set = OPTIONS_SET.get().map_or(&[][..], Vec::as_slice);
    let file = path().map(|path| sanitized(&path.display().to_string())).unwrap_or_default();
    let mut text = format!("# {file}\n\n# Defaults of options, such as --threads.\n[options]\n");
    let root = Cli::command();
    let shipped = |name| {
        let mut args = commands(&root).filter_map(|command| option(command, name));
        let value = args.find_map(|arg| arg.get_default_values().first());
        value.map_or_else(String::new, |value| format!(" {}", value.display()))
    };
    for name in OPTIONS {
        let found = set.iter().find(|(known, _)| *known == name);
        let _ = match found {
            Some((_, value)) => writeln!(text, "{name} = {}", quoted(value)),
            None => writeln!(text, "# {name} ={}", shipped(name)),
        };
    }
    text +=
        "\n# Keys of actions in their first place; docs/keys.md has the other places.\n[keys]\n";
    for command in table() {
        let (place, keys) = command.keys.first().copied().unwrap_or((KeyContext::Anywhere, ""));
        let place = if place.place().is_empty() { "" } else { &format!(" # {}", place.place()) };
        let _ = writeln!(text, "{} = {}{place}", quoted(command.label), quoted(keys));
    }
    text += "\n[theme]\n";
    for (name, ([r, g, b], ..)) in SHIPPED_TONES.map(|(name, _)| name).iter().zip(tones()) {
        let _ = writeln!(text, "{name} = \"#{r:02x}{g:02x}{b:02x}\"");
    }
    write_line(std::io::stdout().lock(), text.trim_end())
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}
