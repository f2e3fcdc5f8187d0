//! `mbd completions`.

use std::io::Write;

use clap::CommandFactory;
use clap_complete::{generate, Shell};
use multibody::codegen::read::json_schema;

use super::args::{Arguments, Completions, CompletionsArgs};
use super::Outcome;

/// Prints completions for a shell or an editor, or the manual page.
pub fn run(args: &CompletionsArgs, out: &mut dyn Write) -> Outcome {
    let mut command = Arguments::command();
    let shell = match args.what {
        Completions::Bash => Shell::Bash,
        Completions::Elvish => Shell::Elvish,
        Completions::Fish => Shell::Fish,
        Completions::Powershell => Shell::PowerShell,
        Completions::Zsh => Shell::Zsh,
        Completions::Schema => return Ok(out.write_all(json_schema().as_bytes())?),
        Completions::Man => {
            // One page holds all commands.
            let (mut page, whole) = (Vec::new(), clap_mangen::Man::new(command.clone()));
            whole.render_title(&mut page)?;
            whole.render_name_section(&mut page)?;
            whole.render_synopsis_section(&mut page)?;
            whole.render_description_section(&mut page)?;
            whole.render_options_section(&mut page)?;
            for sub in command.get_subcommands().filter(|sub| sub.get_name() != "help") {
                writeln!(page, ".SH \"mbd {}\"", sub.get_name())?;
                let sub = clap_mangen::Man::new(sub.clone());
                sub.render_description_section(&mut page)?;
                sub.render_options_section(&mut page)?;
            }
            return Ok(out.write_all(&page)?);
        }
    };
    // In memory: a reader that goes away is no failure.
    let mut text = Vec::new();
    generate(shell, &mut command, "mbd", &mut text);
    Ok(out.write_all(&text)?)
}
