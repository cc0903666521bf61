//! Reads files that users name: regular files of a limited size, or standard input.

use std::fs::{self, File};
use std::io::{self, Read};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use anyhow::{Context, anyhow};

use crate::exit::Exit;
use crate::failure::Failure;

/// Largest file that is read into memory at once, bytes. A program of a million poses has a third
/// of it.
const LARGEST: u64 = 256 << 20;

/// Longest line of a table, bytes. Without it a file without line ends would fill the memory.
const LONGEST_LINE: usize = 1 << 20;

/// The bytes of a regular file, or of standard input for `-`.
///
/// # Errors
/// [`Exit::Unreadable`]: the file is missing, is no regular file, or is too large.
pub(crate) fn bytes(path: &str) -> Result<Vec<u8>, Failure> {
    let read = || -> anyhow::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        source(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > LARGEST {
            return Err(anyhow!(
                "expected at most {} MiB, got more",
                LARGEST / (1 << 20)
            ));
        }
        Ok(bytes)
    };
    unreadable(path, read())
}

/// The text of a regular file.
///
/// # Errors
/// As [`bytes`], or the file is not UTF-8.
pub(crate) fn text(path: &Path) -> Result<String, Failure> {
    let shown = path.display().to_string();
    let bytes = bytes(&shown)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        anyhow!("expected text in UTF-8, but byte {at} is none")
    });
    unreadable(&shown, text)
}

/// A regular file, or standard input for `-`, to be read line by line; a line that is too long is
/// an error when it is reached.
///
/// # Errors
/// [`Exit::Unreadable`]: the file is missing or is no regular file.
pub(crate) fn lines(path: &str) -> Result<impl Read, Failure> {
    let source = unreadable(path, source(path))?;
    Ok(ShortLines { source, length: 0 })
}

/// The same cause with the name of the file before it.
pub(crate) fn unreadable<T>(path: &str, result: anyhow::Result<T>) -> Result<T, Failure> {
    result
        .with_context(|| format!("cannot read {path}"))
        .map_err(|cause| Failure::new(Exit::Unreadable, cause))
}

/// Refuses what is not a regular file: opening a pipe would wait for a writer, and a device may
/// never end. A missing file is reported when it is opened.
///
/// # Errors
/// Expected and found, and what to do.
pub(crate) fn check_regular(path: &Path) -> anyhow::Result<()> {
    let Ok(found) = fs::metadata(path) else {
        return Ok(());
    };
    let kind = found.file_type();
    let (found, help) = if kind.is_file() {
        return Ok(());
    } else if kind.is_dir() {
        ("a folder", "")
    } else if kind.is_fifo() {
        let help = "; to read from a pipe give `-` and redirect standard input";
        ("a pipe", help)
    } else if kind.is_socket() {
        ("a socket", "")
    } else {
        (
            "a device",
            "; to read from a device give `-` and redirect standard input",
        )
    };
    Err(anyhow!("expected a regular file, found {found}{help}"))
}

fn source(path: &str) -> anyhow::Result<Box<dyn Read>> {
    if path == "-" {
        return Ok(Box::new(io::stdin()));
    }
    check_regular(Path::new(path))?;
    Ok(Box::new(File::open(path)?))
}

/// Passes its source through until a line is too long.
struct ShortLines<R> {
    source: R,
    /// Bytes since the last end of a line.
    length: usize,
}

impl<R: Read> Read for ShortLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        let got = buffer.get(..count).unwrap_or_default();
        for (index, piece) in got.split(|byte| *byte == b'\n').enumerate() {
            let begun = if index == 0 { self.length } else { 0 };
            self.length = begun + piece.len();
            if self.length > LONGEST_LINE {
                let message =
                    format!("expected lines of at most {LONGEST_LINE} bytes, got a longer one");
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_ends_the_reading() {
        let read = |length: usize, lines: usize| {
            let text = format!("{}\n", "1".repeat(length)).repeat(lines);
            let mut out = Vec::new();
            let source = text.as_bytes();
            ShortLines { source, length: 0 }
                .read_to_end(&mut out)
                .map(|_| out.len())
        };
        assert_eq!(read(1000, 3000).unwrap(), 1001 * 3000);
        let error = read(LONGEST_LINE + 1, 1).unwrap_err().to_string();
        assert!(error.contains("1048576 bytes"), "{error}");
        let mut endless = ShortLines {
            source: io::repeat(0),
            length: 0,
        };
        assert!(io::copy(&mut endless, &mut io::sink()).is_err());
    }
}
