//! What is said of the words themselves: the first session, the commands, and words that are wrong.

use super::{Answer, Said, Words, pretty};
use crate::problem::{Cause, Problem};
use clap::CommandFactory;
use clap::error::ErrorKind;
use serde_json::json;
use std::ffi::OsString;

pub const ABOUT: &str = "\
Diaphane renders translucent things (skin, marble, jade, wax, milk, leaves) from text files,
and says what each way of rendering them costs.";

pub const FIRST_SESSION: &str = "\
A first session:
  diaphane new pebble                        write pebble.ron and pebble.material.ron
  diaphane render pebble.ron -o pebble.png   make a picture of it
  diaphane preview pebble.ron                look at it in a window, and edit
  diaphane check pebble.ron                  after an edit: say all that is wrong with it
  diaphane explain pebble.ron                say what a picture takes, and what it does not
  diaphane techniques                        list the ways of making light go through things";

pub const TEMPLATE: &str = "{about}\n\n{before-help}{usage-heading} {usage}\n\n{all-args}{after-help}";

pub const EXIT: &str = "\
Exit status:
  0 done   1 the files are wrong   2 the words are wrong   3 there is no adapter
  4 a comparison is beyond its limit
  5 it could not finish: disk full, device lost, interrupted; what was done is kept

`diaphane help COMMAND` says more of each.";

/// Whether words that cannot be read ask for JSON.
pub fn wants_json(words: &[OsString]) -> bool {
    words.iter().take_while(|word| *word != "--").any(|word| word == "--json")
}

/// What is said when there are no words: all of it.
pub fn all() -> Answer {
    let mut command = Words::command();
    command.build();
    let commands: Vec<_> = command
        .get_subcommands()
        .map(|sub| json!({ "name": sub.get_name(), "about": sub.get_about().map(ToString::to_string) }))
        .collect();
    let facts = json!({ "version": env!("CARGO_PKG_VERSION"), "commands": commands });
    Answer::new(command.render_help().to_string(), facts)
}

/// What is said when the words cannot be read, or ask for help.
pub fn complaint(error: &clap::Error, json: bool) -> Said {
    let text = error.render().to_string();
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return Said::facts(if json { pretty(&json!({ "text": text })) } else { text });
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let problem = Problem::new(Cause::Words, "another word is missing").hint("`--help` lists what can follow");
        return Said { talk: text, ..Said::wrong(&problem.into(), json) };
    }
    // clap says it well; programs get its parts.
    let (what, rest) = text.split_once("\n\n").unwrap_or((&text, ""));
    let line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let hints: Vec<String> = rest.split("\n\n").map(line).filter(|hint| !hint.is_empty()).collect();
    let problem = Problem::new(Cause::Words, line(what.trim_start_matches("error: "))).hint(hints.join("; "));
    Said { talk: text, ..Said::wrong(&problem.into(), json) }
}
