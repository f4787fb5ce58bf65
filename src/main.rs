//! The `footlight` command: see [`footlight::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    footlight::cli::main()
}
