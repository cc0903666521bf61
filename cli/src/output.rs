use std::io::{self, Write};

use serde::Serialize;

/// Writes `value` to standard output as indented JSON and a newline.
///
/// # Errors
/// Standard output cannot be written.
pub(crate) fn json(value: &impl Serialize) -> io::Result<()> {
    json_to(&mut io::stdout().lock(), value)
}

/// Writes `value` as indented JSON and a newline.
///
/// # Errors
/// The sink cannot be written.
pub(crate) fn json_to(out: &mut impl Write, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, value)?;
    writeln!(out)
}

/// Writes a line to standard error; a failure to do so cannot be reported.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
