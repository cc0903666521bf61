//! `canter` under another name: cargo tells a package's tests the path of that package's own
//! binaries only, and the system tests are not in the package of the command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
