//! The text of a program with a name: from byte offsets to lines, columns and excerpts.

use std::ops::Range;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Lines longer than this (bytes) are shown in part.
const LONG_LINE: usize = 160;

/// How much of a long line is shown on each side of a span (bytes).
const AROUND: usize = 50;

/// The text of a program and the name it is reported under.
///
/// Lines end at `\n`, `\r\n` or a lone `\r`; columns count characters; both start at 1. A byte
/// order mark has no column. As [`SourceCode`] it shows excerpts of bounded size, however long
/// the lines are, with control characters made harmless.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    text: String,
    /// The text as it may be shown, byte for byte as long; nothing when it is the same.
    harmless: Option<String>,
    line_starts: Vec<usize>,
}

impl Source {
    /// A source from text.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let text = text.into();
        let line_starts = line_starts(&text);
        Self {
            name: name.into(),
            harmless: harmless(&text),
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

    /// Line and column (from 1) of a byte offset; an offset past the end counts as the end.
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

    /// Bytes of the part of a line that is worth showing for a span that begins in it: the whole
    /// line, or a window of a long one. Ends before the line end.
    pub(crate) fn excerpt(&self, span: &Range<usize>) -> Range<usize> {
        let line = self.line(self.line_index(span.start));
        if line.len() <= LONG_LINE {
            return line;
        }
        let start = line.start.max(span.start.saturating_sub(AROUND));
        let end = line.end.min(span.end.min(span.start + AROUND) + AROUND);
        self.boundary(start)..self.boundary(end)
    }

    /// A span cut to its first line and to the excerpt that is shown of it.
    pub(crate) fn shown_span(&self, span: &Range<usize>) -> Range<usize> {
        let excerpt = self.excerpt(span);
        let start = span.start.min(self.text.len());
        start..span.end.min(excerpt.end).max(start)
    }

    /// Part of the text, without control characters other than line ends and tabs.
    pub(crate) fn shown(&self, range: Range<usize>) -> &str {
        self.harmless
            .as_ref()
            .unwrap_or(&self.text)
            .get(range)
            .unwrap_or_default()
    }

    /// How many characters the range of bytes holds.
    fn columns(&self, range: Range<usize>) -> usize {
        let bytes = self.text.as_bytes();
        let range = range.start.min(bytes.len())..range.end.min(bytes.len());
        let characters = |part: &[u8]| part.iter().filter(|&&byte| byte & 0xC0 != 0x80).count();
        let mark = usize::from(range.start == 0 && self.text.starts_with('\u{FEFF}'));
        bytes.get(range).map_or(0, characters).saturating_sub(mark)
    }

    /// Number of the line that holds the byte, from 0.
    fn line_index(&self, offset: usize) -> usize {
        self.line_starts
            .partition_point(|&start| start <= offset)
            .saturating_sub(1)
    }

    /// Bytes of a line (from 0) without its line end.
    fn line(&self, index: usize) -> Range<usize> {
        let start = self
            .line_starts
            .get(index)
            .copied()
            .unwrap_or(self.text.len());
        let line = self
            .text
            .get(start..self.line_end(index))
            .unwrap_or_default();
        start..start + line.trim_end_matches(['\n', '\r']).len()
    }

    /// The end of a line (from 0) with its line end.
    fn line_end(&self, index: usize) -> usize {
        self.line_starts
            .get(index + 1)
            .copied()
            .unwrap_or(self.text.len())
    }

    /// The nearest character boundary that is not after the offset.
    fn boundary(&self, offset: usize) -> usize {
        let back = (0..4).map(|back| offset.saturating_sub(back));
        back.into_iter()
            .find(|&at| self.text.is_char_boundary(at))
            .unwrap_or(0)
    }

    /// Bytes to show for a span with lines of context, and the number (from 0) of the first line.
    fn context(&self, span: &Range<usize>, before: usize, after: usize) -> (Range<usize>, usize) {
        let own = self.line_index(span.start);
        let last = self.line_index(span.end.saturating_sub(1).max(span.start)) + after;
        let first = own.saturating_sub(before);
        let long = |index| self.line(index).len() > LONG_LINE;
        if long(own) {
            return (self.excerpt(span), own);
        }
        let first = (first..own)
            .rev()
            .take_while(|&index| !long(index))
            .last()
            .unwrap_or(own);
        let last = (own..=last)
            .take_while(|&index| !long(index))
            .last()
            .unwrap_or(own);
        let start = self.line(first).start;
        (start..self.line_end(last), first)
    }
}

impl SourceCode for Source {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        /// Wider spans are never shown as one.
        const WIDEST: usize = 8 * LONG_LINE;
        let range = span.offset()..span.offset() + span.len();
        if range.end > self.text.len() || range.len() > WIDEST {
            return Err(MietteError::OutOfBounds);
        }
        let (line, column) = self.position(range.start);
        let (shown, line, column) = match (before, after) {
            (0, 0) => (range, line - 1, column - 1),
            _ => {
                let (shown, first) = self.context(&range, before, after);
                if range.end > shown.end {
                    return Err(MietteError::OutOfBounds);
                }
                (shown, first, 0)
            }
        };
        let place = (shown.start, shown.len()).into();
        let (data, name) = (self.shown(shown).as_bytes(), self.name.clone());
        let lines = data.iter().filter(|&&byte| byte == b'\n').count();
        Ok(Box::new(MietteSpanContents::new_named(
            name, data, place, line, column, lines,
        )))
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

/// The text with a lone `\r` as line end and `?` for each byte of other control characters;
/// nothing when there are none.
fn harmless(text: &str) -> Option<String> {
    let plain = |c: char| matches!(c, '\n' | '\t') || !(c.is_control() || c == '\u{FEFF}');
    if text.chars().all(plain) {
        return None;
    }
    let mut shown = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '\r' if characters.peek() == Some(&'\n') => shown.push('\r'),
            '\r' => shown.push('\n'),
            '\u{FEFF}' => shown.push_str("   "),
            _ if plain(character) => shown.push(character),
            _ => (0..character.len_utf8()).for_each(|_| shown.push('?')),
        }
    }
    Some(shown)
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
