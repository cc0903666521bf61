//! Finds documents in a stream of bytes that has neither lengths nor separators.

/// The longest document that is read (bytes).
pub const LONGEST_DOCUMENT: usize = 1 << 20;

/// The longest declaration or comment between two documents (bytes).
const LONGEST_BETWEEN: usize = 4096;

/// What was found in the stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frame {
    /// A document, from its root tag to the end of it.
    Document(Vec<u8>),
    /// Bytes that belong to no document, and how many; blanks, NUL bytes, declarations and
    /// comments are not among them.
    Garbage(usize),
    /// A document that is too long. Nothing more can be found in this stream.
    TooLong,
}

/// The documents of a stream with one kind of root element.
///
/// ```
/// use crcl_tcp::{Frame, Frames};
/// let mut frames = Frames::new(&["Root"]);
/// frames.push(b"<?xml version=\"1.0\"?><Root>1</Ro");
/// assert_eq!(frames.next(), None);
/// frames.push(b"ot>\0\n<Root>2</Root>");
/// assert_eq!(frames.next(), Some(Frame::Document(b"<Root>1</Root>".to_vec())));
/// assert_eq!(frames.next(), Some(Frame::Document(b"<Root>2</Root>".to_vec())));
/// ```
#[derive(Clone, Debug)]
pub struct Frames {
    roots: Vec<Root>,
    buffer: Vec<u8>,
    /// Bytes from the beginning of the buffer in which no tag begins that we look for.
    searched: usize,
    /// The document that has begun at the beginning of the buffer.
    begun: Option<usize>,
    /// Bytes of no document since the last frame.
    garbage: usize,
    over: bool,
}

#[derive(Clone, Debug)]
struct Root {
    start: Vec<u8>,
    end: Vec<u8>,
}

impl Frames {
    /// Looks for documents whose root element has one of these names.
    pub fn new(names: &[&str]) -> Self {
        let root = |name: &&str| Root {
            start: format!("<{name}").into_bytes(),
            end: format!("</{name}").into_bytes(),
        };
        Self {
            roots: names.iter().map(root).collect(),
            buffer: Vec::new(),
            searched: 0,
            begun: None,
            garbage: 0,
            over: false,
        }
    }

    /// Takes bytes as they come.
    pub fn push(&mut self, bytes: &[u8]) {
        if !self.over {
            self.buffer.extend_from_slice(bytes);
        }
    }

    /// Drops everything before the next root tag; whether there is one.
    fn begin(&mut self) -> bool {
        let mut at = 0;
        let found = loop {
            let rest = self.buffer.get(at..).unwrap_or_default();
            match self.look(rest) {
                Look::Root(root) => break Some(root),
                Look::Wait => break None,
                Look::Skip(count) => at += count,
                Look::Garbage(count) => {
                    self.garbage += count;
                    at += count;
                }
            }
        };
        self.buffer.drain(..at);
        self.searched = 0;
        self.begun = found;
        found.is_some()
    }

    /// What stands at the beginning of `rest`, between documents.
    fn look(&self, rest: &[u8]) -> Look {
        let Some(first) = rest.first() else {
            return Look::Wait;
        };
        if *first == 0 || first.is_ascii_whitespace() {
            return Look::Skip(1);
        }
        if *first != b'<' {
            let other = |byte: &u8| *byte == b'<' || *byte == 0 || byte.is_ascii_whitespace();
            return Look::Garbage(rest.iter().position(other).unwrap_or(rest.len()));
        }
        let is_root = |root: &Root| tag(rest, &root.start) == Tag::Yes;
        if let Some(root) = self.roots.iter().position(is_root) {
            return Look::Root(root);
        }
        for (start, end) in [(&b"<?"[..], &b"?>"[..]), (b"<!--", b"-->")] {
            if !rest.starts_with(start) {
                continue;
            }
            let close = rest.windows(end.len()).position(|part| part == end);
            return match close {
                Some(close) => Look::Skip(close + end.len()),
                None if rest.len() < LONGEST_BETWEEN => Look::Wait,
                None => Look::Garbage(1),
            };
        }
        let starts = self.roots.iter().map(|root| root.start.as_slice());
        let mut starts = starts.chain([&b"<?"[..], b"<!--"]);
        if starts.any(|start| start.starts_with(rest) || (start == rest)) {
            Look::Wait
        } else {
            Look::Garbage(1)
        }
    }

    /// Where the document that has begun ends.
    fn end(&mut self, root: usize) -> Option<usize> {
        let root = self.roots.get(root)?;
        for at in self.searched..self.buffer.len() {
            let rest = self.buffer.get(at..)?;
            if rest.first() != Some(&b'<') {
                continue;
            }
            match end_tag(rest, &root.end) {
                Tag::Yes => {
                    let close = rest.iter().position(|byte| *byte == b'>')?;
                    return Some(at + close + 1);
                }
                Tag::Perhaps => {
                    self.searched = at;
                    return None;
                }
                Tag::No => {}
            }
        }
        self.searched = self.buffer.len();
        None
    }

    /// Takes the document that ends at `end` out of the buffer. One that was broken off and begun
    /// again is garbage up to its last beginning.
    fn take(&mut self, root: usize, end: usize) -> Frame {
        self.begun = None;
        let document: Vec<u8> = self.buffer.drain(..end).collect();
        self.searched = 0;
        let start = self.roots.get(root).map(|root| root.start.as_slice());
        let start = start.unwrap_or_default();
        let last = (0..document.len()).rev().find(|at| {
            let rest = document.get(*at..).unwrap_or_default();
            tag(rest, start) == Tag::Yes
        });
        let last = last.unwrap_or(0);
        self.garbage += last;
        Frame::Document(document.get(last..).unwrap_or_default().to_vec())
    }
}

/// The next thing in the stream; nothing when more bytes are needed.
impl Iterator for Frames {
    type Item = Frame;

    fn next(&mut self) -> Option<Frame> {
        if self.over {
            return None;
        }
        let begun = match self.begun {
            Some(root) => Some(root),
            None => {
                let began = self.begin();
                if self.garbage > 0 {
                    return Some(Frame::Garbage(std::mem::take(&mut self.garbage)));
                }
                self.begun.filter(|_| began)
            }
        };
        let root = begun?;
        let end = self.end(root);
        let length = end.unwrap_or(self.buffer.len());
        if length > LONGEST_DOCUMENT {
            self.over = true;
            self.buffer = Vec::new();
            return Some(Frame::TooLong);
        }
        let frame = self.take(root, end?);
        Some(frame)
    }
}

/// What stands between documents.
enum Look {
    /// The root tag of that number.
    Root(usize),
    /// More bytes are needed.
    Wait,
    /// Blanks, a declaration or a comment of so many bytes.
    Skip(usize),
    /// So many bytes that belong to nothing.
    Garbage(usize),
}

/// Whether a tag begins here.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tag {
    Yes,
    No,
    /// More bytes are needed.
    Perhaps,
}

/// Whether `rest` begins with this opening tag: its name is not only the beginning of a longer one.
fn tag(rest: &[u8], start: &[u8]) -> Tag {
    if !rest.starts_with(start) {
        return Tag::No;
    }
    match rest.get(start.len()) {
        Some(byte) if byte.is_ascii_whitespace() || matches!(byte, b'>' | b'/') => Tag::Yes,
        Some(_) => Tag::No,
        None => Tag::Perhaps,
    }
}

/// Whether `rest` begins with this closing tag, which may have blanks before its bracket.
fn end_tag(rest: &[u8], end: &[u8]) -> Tag {
    if rest.len() < end.len() && end.starts_with(rest) {
        return Tag::Perhaps;
    }
    let Some(after) = rest.strip_prefix(end) else {
        return Tag::No;
    };
    match after.iter().find(|byte| !byte.is_ascii_whitespace()) {
        Some(b'>') => Tag::Yes,
        Some(_) => Tag::No,
        None => Tag::Perhaps,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    const ROOTS: [&str; 2] = ["CRCLCommandInstance", "CRCLProgram"];

    fn document(inside: &str) -> String {
        format!("<CRCLCommandInstance a=\"b\">{inside}</CRCLCommandInstance >")
    }

    fn all(stream: &[u8], piece: usize) -> Vec<Frame> {
        let mut frames = Frames::new(&ROOTS);
        let mut found = Vec::new();
        for bytes in stream.chunks(piece) {
            frames.push(bytes);
            found.extend(frames.by_ref());
        }
        found
    }

    fn documents(frames: &[Frame]) -> Vec<&[u8]> {
        let mut found = Vec::new();
        for frame in frames {
            if let Frame::Document(bytes) = frame {
                found.push(bytes.as_slice());
            }
        }
        found
    }

    #[test]
    fn every_split_gives_the_same_documents() {
        let (one, two) = (document("<x>1</x>"), document("</CRCLCommandInstances>2"));
        let head = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";
        let stream = format!("{head}{one}\0\r\n{head}{two}\n{one}");
        let wanted = [one.as_bytes(), two.as_bytes(), one.as_bytes()];
        for piece in 1..=stream.len() {
            let found = all(stream.as_bytes(), piece);
            assert_eq!(documents(&found), wanted, "in pieces of {piece}");
            let none = |frame: &Frame| matches!(frame, Frame::Document(_));
            assert!(found.iter().all(none), "{piece}: {found:?}");
        }
    }

    #[test]
    fn a_document_that_was_broken_off_does_not_take_the_next_with_it() {
        let whole = document("1");
        let stream = format!("rubbish <CRCLCommandInstance><a>{whole}");
        let found = all(stream.as_bytes(), 7);
        assert_eq!(documents(&found), [whole.as_bytes()]);
        assert!(matches!(
            all(b"rubbish, and more of it. ", 25)[..],
            [Frame::Garbage(_)]
        ));
    }

    #[test]
    fn long_documents_end_the_stream() {
        let long = "x".repeat(LONGEST_DOCUMENT);
        assert_eq!(all(document(&long).as_bytes(), 4096), [Frame::TooLong]);
        let open = format!("<CRCLProgram>{long}{long}");
        assert_eq!(all(open.as_bytes(), 4096), [Frame::TooLong]);
        let fits = document(&"x".repeat(LONGEST_DOCUMENT - 100));
        assert_eq!(all(fits.as_bytes(), 4096).len(), 1);
    }

    fn cases() -> ProptestConfig {
        let cases = std::env::var("CANTER_FUZZ_CASES")
            .ok()
            .and_then(|text| text.parse().ok());
        ProptestConfig {
            cases: cases.unwrap_or(2000),
            rng_seed: RngSeed::Fixed(64444),
            ..ProptestConfig::default()
        }
    }

    const PIECES: [&str; 14] = [
        "<CRCLCommandInstance",
        "<CRCLCommandInstance>",
        "</CRCLCommandInstance>",
        "</CRCLCommandInstance",
        "<CRCLProgram>",
        "</CRCLProgram >",
        "<?xml version=\"1.0\"?>",
        "<?xml",
        "<!--",
        "\0",
        " >",
        "<",
        "&amp;",
        "é",
    ];

    proptest! {
        #![proptest_config(cases())]

        /// Whatever comes, and in whatever pieces: no panic, bounded memory, the same documents.
        #[test]
        fn any_stream_is_taken_apart(
            parts in prop::collection::vec(prop_oneof![
                prop::sample::select(PIECES.to_vec()).prop_map(|text| text.as_bytes().to_vec()),
                prop::collection::vec(any::<u8>(), 0..8),
            ], 0..40),
            piece in 1..20_usize,
        ) {
            let stream = parts.concat();
            let found = all(&stream, piece);
            let whole = all(&stream, stream.len().max(1));
            prop_assert_eq!(documents(&found), documents(&whole));
            for document in documents(&found) {
                prop_assert!(document.starts_with(b"<CRCL") && document.ends_with(b">"));
            }
        }
    }
}
