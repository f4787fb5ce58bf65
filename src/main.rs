//! The `footlight` command: the program around the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    footlight::main()
}
