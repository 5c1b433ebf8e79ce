//! Configuration file of the user: defaults of options, keys and colours. `zerkalo config` prints it.

use crate::command::args::Cli;
use crate::command::{Failure, write_line};
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::preferences::Preferences;
use crate::dashboard::update::commands::{COMMANDS, rebound};
use crate::dashboard::view::theme::SHIPPED_TONES;
use clap::{Arg, Command, CommandFactory};
use std::env;
use std::fmt::Write;
use std::path::PathBuf;
use toml_edit::{Document, Item, TableLike};
use zerkalo_scene::Diagnostic;
use zerkalo_scene::value::{did_you_mean, sanitized};
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

/// Contents of the file. The default are the settings as shipped.
#[derive(Default)]
pub struct Config {
    /// Options that the file sets: the name and the value of each.
    options: Vec<(&'static str, &'static str)>,
    pub preferences: Preferences,
}

/// Returns the path of the file (XDG Base Directory Specification), whether it exists or not.
fn path() -> Option<PathBuf> {
    let absolute = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = absolute("XDG_CONFIG_HOME");
    let folder = folder.or_else(|| absolute("HOME").map(|home| home.join(".config")))?;
    Some(folder.join("zerkalo/config.toml"))
}

impl Config {
    /// Reads the file, if there is one.
    pub fn read() -> Result<Self, String> {
        let text = path().and_then(|path| Some((std::fs::read_to_string(&path).ok()?, path)));
        let Some((text, path)) = text else { return Ok(Self::default()) };
        Self::parse(&text).map_err(|Fault { at, found, help }| {
            Diagnostic::at(&path, &text, at, found, help).to_string()
        })
    }

    fn parse(text: &str) -> Result<Self, Fault> {
        const TABLES: [&str; 3] = ["options", "keys", "theme"];
        let document = Document::parse(text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            Fault::new(at, format!("it is not TOML: {}", error.message()), "")
        })?;
        let (mut config, mut keys) = (Self::default(), Vec::new());
        for Entry { key: name, at, item, item_at } in entries(document.as_table(), 0) {
            let Some(table) = item.as_table_like().filter(|_| TABLES.contains(&name)) else {
                return Err(unknown(at.max(item_at), "table", name, &TABLES));
            };
            for entry in entries(table, item_at) {
                match name {
                    "options" => config.options.push(parse_option(&entry)?),
                    "keys" => keys.push(parse_keys(&entry)?),
                    _ => {
                        let (index, rgb) = parse_tone(&entry)?;
                        let tone = &mut config.preferences.tones[index];
                        *tone = (rgb, nearest_xterm(rgb), tone.2);
                    }
                }
            }
        }
        config.preferences.commands = rebound(&keys);
        Ok(config)
    }

    /// Returns the command line with the defaults by the file.
    pub fn command_line(&self) -> Command {
        let mut command = self.with_defaults(Cli::command());
        let names: Vec<_> = command.get_subcommands().map(|c| c.get_name().to_string()).collect();
        for name in names {
            command = command.mut_subcommand(name, |command| self.with_defaults(command));
        }
        command
    }

    fn with_defaults(&self, command: Command) -> Command {
        self.options.iter().fold(command, |command, (name, value)| match option(&command, name) {
            Some(_) => command.mut_arg(name, |arg| arg.default_value(*value)),
            None => command,
        })
    }

    /// Prints the settings in force, as a configuration file.
    pub fn print(&self) -> Result<(), Failure> {
        let file = path().map(|path| sanitized(&path.display().to_string())).unwrap_or_default();
        let mut text =
            format!("# {file}\n\n# Defaults of options, such as --threads.\n[options]\n");
        let root = Cli::command();
        let shipped = |name| {
            let mut args = commands(&root).filter_map(|command| option(command, name));
            let value = args.find_map(|arg| arg.get_default_values().first());
            value.map_or_else(String::new, |value| format!(" {}", value.display()))
        };
        for name in OPTIONS {
            let found = self.options.iter().find(|(known, _)| *known == name);
            let _ = match found {
                Some((_, value)) => writeln!(text, "{name} = {}", quoted(value)),
                None => writeln!(text, "# {name} ={}", shipped(name)),
            };
        }
        text += "\n# Keys of actions in their first place; docs/keys.md has the other places.\n[keys]\n";
        for command in self.preferences.commands {
            let (place, keys) = command.keys.first().copied().unwrap_or((KeyContext::Anywhere, ""));
            let place =
                if place.place().is_empty() { "" } else { &format!(" # {}", place.place()) };
            let _ = writeln!(text, "{} = {}{place}", quoted(command.label), quoted(keys));
        }
        text += "\n[theme]\n";
        for (name, ([r, g, b], ..)) in
            SHIPPED_TONES.map(|(name, _)| name).iter().zip(self.preferences.tones)
        {
            let _ = writeln!(text, "{name} = \"#{r:02x}{g:02x}{b:02x}\"");
        }
        write_line(std::io::stdout().lock(), text.trim_end())
    }
}

/// Cause of an error at the byte offset `at` in the text.
struct Fault {
    at: usize,
    found: String,
    help: String,
}

impl Fault {
    fn new(at: usize, found: String, help: &str) -> Self {
        Self { at, found, help: help.to_string() }
    }
}

/// Key and value of a table, with their byte offsets in the text.
struct Entry<'a> {
    key: &'a str,
    at: usize,
    item: &'a Item,
    item_at: usize,
}

/// Returns the entries of the table at the offset `table_at`.
fn entries(table: &dyn TableLike, table_at: usize) -> impl Iterator<Item = Entry<'_>> {
    table.iter().map(move |(key, item)| {
        let at = table.key(key).and_then(|key| key.span()).map_or(table_at, |span| span.start);
        Entry { key, at, item, item_at: item.span().map_or(at, |span| span.start) }
    })
}

fn option<'a>(command: &'a Command, name: &str) -> Option<&'a Arg> {
    command.get_arguments().find(|arg| arg.get_long() == Some(name))
}

/// Returns the program without a subcommand, and the subcommands.
fn commands(root: &Command) -> impl Iterator<Item = &Command> {
    std::iter::once(root).chain(root.get_subcommands())
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
    Fault::new(at, format!("there is no {what} \"{}\"", sanitized(name)), &(list + &help))
}

/// Parses a tone: its index in [`SHIPPED_TONES`], and its colour.
fn parse_tone(entry: &Entry) -> Result<(usize, [u8; 3]), Fault> {
    let names = SHIPPED_TONES.map(|(name, _)| name);
    let index = names.iter().position(|name| *name == entry.key);
    let index = index.ok_or_else(|| unknown(entry.at, "colour", entry.key, &names))?;
    let rgb = entry.item.as_str().and_then(rgb_of).ok_or_else(|| {
        let found = format!("{} is no colour", entry.key);
        Fault::new(entry.item_at, found, "Expected a colour such as \"#80a0ff\".")
    })?;
    Ok((index, rgb))
}

/// Parses an option, whose value must be valid for each command that has the option.
fn parse_option(entry: &Entry) -> Result<(&'static str, &'static str), Fault> {
    let name = OPTIONS.into_iter().find(|known| *known == entry.key);
    let name = name.ok_or_else(|| unknown(entry.at, "option", entry.key, &OPTIONS))?;
    let item = entry.item;
    let text = item.as_str().map_or_else(|| item.to_string().trim().to_string(), str::to_string);
    let root = Cli::command();
    for arg in commands(&root).filter_map(|command| option(command, name)) {
        let arg = arg.clone().required(false);
        let alone = Command::new("zerkalo").no_binary_name(true).arg(arg);
        if let Err(error) = alone.try_get_matches_from([format!("--{name}={text}")]) {
            let message = error.to_string();
            let reason: Vec<_> = message.lines().take_while(|line| !line.is_empty()).collect();
            let reason = reason.join(" ").replace("error: ", "").replace("  ", " ");
            let help = format!("`zerkalo render --help` describes --{name}.");
            return Err(Fault::new(entry.item_at, reason, &help));
        }
    }
    Ok((name, text.leak()))
}

/// Parses the new keys of a command: its index in the table, and the names of the keys.
fn parse_keys(entry: &Entry) -> Result<(usize, String), Fault> {
    let label = entry.key;
    let labels: Vec<_> = COMMANDS.iter().map(|command| command.label).collect();
    let index = labels.iter().position(|known| *known == label);
    let index = index.ok_or_else(|| unknown(entry.at, "action", label, &labels))?;
    let fault = |found: String| {
        let help = "Expected names as in `zerkalo config`, such as \"u Ctrl-z\".";
        Fault::new(entry.item_at, found, help)
    };
    let text = entry.item.as_str();
    let text = text.ok_or_else(|| fault(format!("the keys of \"{label}\" are no text")))?;
    let names = text.split_whitespace().map(|name| {
        let key = name.parse::<Key>();
        let key = key.map_err(|_| fault(format!("there is no key \"{}\"", sanitized(name))))?;
        Ok(key.to_string())
    });
    Ok((index, names.collect::<Result<Vec<_>, Fault>>()?.join(" ")))
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}
