//! The text of a program with a name: from byte offsets to lines and columns.

use std::ops::Range;

/// The text of a program and the name it is reported under.
///
/// Lines end at `\n`, `\r\n` or a lone `\r`; columns count characters; both start at 1. A byte
/// order mark has no column.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    text: String,
    line_starts: Vec<usize>,
}

impl Source {
    /// A source from text.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let text = text.into();
        let line_starts = line_starts(&text);
        Self {
            name: name.into(),
            text,
            line_starts,
        }
    }

    /// A source from bytes; what is not UTF-8 is shown as replacement characters. The spans of
    /// [`crate::text::read_bytes`] fit it.
    pub fn from_bytes(name: impl Into<String>, bytes: &[u8]) -> Self {
        Self::new(name, String::from_utf8_lossy(bytes))
    }

    /// The name, such as the path of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Line and column (from 1) of a byte offset; an offset within a character counts as the
    /// character, one past the end as the end.
    ///
    /// ```
    /// let source = crcl::Source::new("a.canon", "InitCanon ()\n  Dwell (1)\n");
    /// assert_eq!(source.position(15), (2, 3));
    /// ```
    pub fn position(&self, offset: usize) -> (usize, usize) {
        let line = self.line_index(offset);
        let start = self.line_starts.get(line).copied().unwrap_or(0);
        (line + 1, 1 + self.columns(start..offset))
    }

    /// Number of the line that holds the byte, from 0.
    pub(crate) fn line_index(&self, offset: usize) -> usize {
        self.line_starts
            .partition_point(|&start| start <= offset)
            .saturating_sub(1)
    }

    /// Bytes of a line (from 0) without its line end.
    pub(crate) fn line(&self, index: usize) -> Range<usize> {
        let start = self
            .line_starts
            .get(index)
            .copied()
            .unwrap_or(self.text.len());
        let end = self
            .line_starts
            .get(index + 1)
            .copied()
            .unwrap_or(self.text.len());
        let line = self.text.get(start..end).unwrap_or_default();
        start..start + line.trim_end_matches(['\n', '\r']).len()
    }

    /// The end of a line (from 0) with its line end.
    pub(crate) fn line_end(&self, index: usize) -> usize {
        self.line_starts
            .get(index + 1)
            .copied()
            .unwrap_or(self.text.len())
    }

    /// How many characters the range of bytes holds.
    pub(crate) fn columns(&self, range: Range<usize>) -> usize {
        let bytes = self.text.as_bytes();
        let range = range.start.min(bytes.len())..range.end.min(bytes.len());
        let characters = |part: &[u8]| part.iter().filter(|&&byte| byte & 0xC0 != 0x80).count();
        let mark = usize::from(range.start == 0 && self.text.starts_with('\u{FEFF}'));
        bytes.get(range).map_or(0, characters).saturating_sub(mark)
    }
}

fn line_starts(text: &str) -> Vec<usize> {
    let bytes = text.as_bytes();
    let ends_line = |&(at, &byte): &(usize, &u8)| {
        byte == b'\n' || (byte == b'\r' && bytes.get(at + 1) != Some(&b'\n'))
    };
    let after = bytes
        .iter()
        .enumerate()
        .filter(ends_line)
        .map(|(at, _)| at + 1);
    std::iter::once(0).chain(after).collect()
}

/// Finds lines and columns of ascending offsets in one pass over the text.
#[derive(Debug)]
pub(crate) struct Walker<'a> {
    text: &'a str,
    offset: usize,
    line: usize,
    column: usize,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(text: &'a str) -> Self {
        let offset = if text.starts_with('\u{FEFF}') {
            '\u{FEFF}'.len_utf8()
        } else {
            0
        };
        Self {
            text,
            offset,
            line: 1,
            column: 1,
        }
    }

    /// Line and column (from 1) of an offset that is not before the last one asked for.
    pub(crate) fn position(&mut self, offset: usize) -> (usize, usize) {
        let bytes = self.text.as_bytes();
        let passed = bytes.get(self.offset..offset).unwrap_or_default();
        for (at, byte) in passed.iter().enumerate() {
            let next = bytes.get(self.offset + at + 1);
            if *byte == b'\n' || (*byte == b'\r' && next != Some(&b'\n')) {
                (self.line, self.column) = (self.line + 1, 1);
            } else if byte & 0xC0 != 0x80 {
                self.column += 1;
            }
        }
        self.offset = self.offset.max(offset);
        (self.line, self.column)
    }
}
