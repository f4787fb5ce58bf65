//! Messages for typed lines that are no verbs: one sentence with the reason, and a way out.

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use super::error::{Error, usage};
use super::usage;
use footlight_show::lang::nearest;

/// The command of a verb.
pub fn find<'c>(verbs: &'c Command, name: &str) -> Result<&'c Command, Error> {
    if let Some(found) = verbs.find_subcommand(name) {
        return Ok(found);
    }
    let names = verbs.get_subcommands().map(Command::get_name);
    let hint = match nearest(name, names) {
        _ if name == "send" => "`footlight help send` explains the command".to_owned(),
        Some(near) => format!("did you mean `{near}`?"),
        None => "`help` lists the verbs".to_owned(),
    };
    usage(format!("there is no verb or declaration `{name}`; {hint}"))
}

/// An argument in clap's notation, without its brackets.
fn plain(argument: &str) -> String {
    argument.replace(['<', '>'], "").replace("...", "")
}

/// The error for invalid arguments of a verb.
pub fn refused(verb: &Command, error: &clap::Error) -> Error {
    let name = verb.get_name();
    let said = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => plain(word),
        Some(ContextValue::Strings(words)) => plain(&words.join(", ")),
        _ => String::new(),
    };
    let argument = said(ContextKind::InvalidArg);
    let value = said(ContextKind::InvalidValue);
    let way_out = || format!("such as `{}`", usage::example(verb));
    Error::Usage(match error.kind() {
        ErrorKind::UnknownArgument if argument.starts_with('-') => {
            match said(ContextKind::SuggestedArg) {
                near if near.is_empty() => {
                    format!("`{name}` has no option `{argument}`: {}", usage::of(verb))
                }
                near => format!("`{name}` has no option `{argument}`; did you mean `{near}`?"),
            }
        }
        ErrorKind::UnknownArgument | ErrorKind::TooManyValues => {
            format!("`{argument}` is left over: {}", usage::of(verb))
        }
        ErrorKind::InvalidValue if value.is_empty() => {
            let option = argument.split(' ').next().unwrap_or_default();
            let what = argument.get(option.len()..).unwrap_or_default();
            format!("`{option}` needs a value{what}: {}", usage::of(verb))
        }
        ErrorKind::InvalidValue => {
            let known = said(ContextKind::ValidValue);
            let option = argument.split(' ').next().filter(|a| a.starts_with('-'));
            let whose = option.unwrap_or(name);
            format!(
                "`{whose}` takes {known}, not `{value}`: {}",
                usage::of(verb)
            )
        }
        ErrorKind::ValueValidation => match std::error::Error::source(error) {
            Some(reason) => reason.to_string(),
            None => format!("`{value}` is no value of `{argument}`, {}", way_out()),
        },
        ErrorKind::MissingRequiredArgument => {
            format!("`{name}` needs `{argument}`, {}", way_out())
        }
        ErrorKind::ArgumentConflict => {
            let other = said(ContextKind::PriorArg);
            format!("`{argument}` does not go with `{other}`")
        }
        _ => format!("{}: {}", error.kind(), usage::of(verb)),
    })
}
