//! Walks through elements in the order that the schema prescribes.

use std::ops::Range;

use roxmltree::Node;

use crate::code;
use crate::finding::{Finding, Findings};
use crate::lexer::clip;

/// The namespace of `xsi:type`.
const XSI: &str = "http://www.w3.org/2001/XMLSchema-instance";

/// Reads elements and collects what is wrong with them.
pub(super) struct Reader<'f> {
    pub(super) findings: &'f mut Findings,
}

/// The children of an element, to be taken in their order.
///
/// After the first child that is out of order nothing more is said about the element: one finding
/// explains it.
pub(super) struct Children<'a, 'd> {
    owner: Node<'a, 'd>,
    rest: std::vec::IntoIter<Node<'a, 'd>>,
    next: Option<Node<'a, 'd>>,
    last: Option<Node<'a, 'd>>,
    broken: bool,
}

impl<'a, 'd> Children<'a, 'd> {
    /// The next child if it has that name.
    pub(super) fn maybe(&mut self, name: &str) -> Option<Node<'a, 'd>> {
        if self.broken || !self.next.is_some_and(|next| next.has_tag_name(name)) {
            return None;
        }
        self.last = self.next;
        std::mem::replace(&mut self.next, self.rest.next())
    }

    /// The next children as long as they have that name.
    pub(super) fn many(&mut self, name: &str) -> Vec<Node<'a, 'd>> {
        std::iter::from_fn(|| self.maybe(name)).collect()
    }

    /// The next child, which must have that name.
    pub(super) fn wanted(&mut self, reader: &mut Reader, name: &str) -> Option<Node<'a, 'd>> {
        let found = self.maybe(name);
        if found.is_none() && !self.broken {
            self.broken = true;
            reader.findings.push(self.lacks(name));
        }
        found
    }

    /// The next children as long as they have that name; at least `least` of them.
    pub(super) fn some(
        &mut self,
        reader: &mut Reader,
        name: &str,
        least: usize,
    ) -> Option<Vec<Node<'a, 'd>>> {
        let found = self.many(name);
        if found.len() >= least || self.broken {
            return (!self.broken).then_some(found);
        }
        self.broken = true;
        let element = self.owner.tag_name().name();
        let message = format!(
            "`{}` needs at least {least} elements `{name}`, but has {}",
            clip(element),
            found.len()
        );
        let finding = Finding::error(code::XML_MISSING, opening(self.owner), message);
        reader.findings.push(finding.expected(format!("`{name}`")));
        None
    }

    /// Says what comes after the last child that is known.
    pub(super) fn end(self, reader: &mut Reader) -> Option<()> {
        if self.broken {
            return None;
        }
        let Some(next) = self.next else {
            return Some(());
        };
        let name = clip(next.tag_name().name());
        let owner = clip(self.owner.tag_name().name());
        let message = format!("the element `{name}` has no place here in `{owner}`");
        let expected = match self.last {
            Some(last) => format!("the end of `{owner}` after `{}`", last.tag_name().name()),
            None => format!("no element in `{owner}`"),
        };
        let finding = Finding::error(code::XML_ELEMENT, opening(next), message)
            .expected(expected)
            .found(format!("`{name}`"))
            .help("the elements of CRCL stand in a fixed order; `Name` is the first");
        reader.findings.push(finding);
        None
    }

    fn lacks(&self, name: &str) -> Finding {
        let owner = clip(self.owner.tag_name().name());
        let (span, found) = match self.next {
            Some(next) => (opening(next), format!("`{}`", clip(next.tag_name().name()))),
            None => (opening(self.owner), format!("the end of `{owner}`")),
        };
        let message = format!("`{owner}` needs the element `{name}` here");
        Finding::error(code::XML_MISSING, span, message)
            .expected(format!("`{name}`"))
            .found(found)
            .help("the elements of CRCL stand in a fixed order; `Name` is the first")
    }
}

impl Reader<'_> {
    /// The children of an element that has elements only. Its optional `Name` is taken.
    pub(super) fn children<'a, 'd>(
        &mut self,
        owner: Node<'a, 'd>,
    ) -> (Option<String>, Children<'a, 'd>) {
        self.no_text(owner);
        let elements: Vec<_> = owner.children().filter(Node::is_element).collect();
        let mut rest = elements.into_iter();
        let next = rest.next();
        let mut children = Children {
            owner,
            rest,
            next,
            last: None,
            broken: false,
        };
        let name = children.maybe("Name").and_then(|name| self.text(name));
        (name, children)
    }

    /// Says what is written between the elements of `owner`.
    fn no_text(&mut self, owner: Node) {
        let stray = owner
            .children()
            .find(|child| child.is_text() && child.text().is_some_and(|text| !is_blank(text)));
        let Some(stray) = stray else { return };
        let text = stray.text().unwrap_or_default().trim();
        let name = clip(owner.tag_name().name());
        let message = format!("text between the elements of `{name}`");
        let blank = |text: &str| text.len() - text.trim_start().len();
        let start = stray.range().start + stray.text().map_or(0, blank);
        let span = start..(start + 1).min(stray.range().end.max(start));
        let finding = Finding::error(code::XML_TEXT, span, message)
            .expected("elements only")
            .found(format!("`{}`", clip(text)));
        self.findings.push(finding.help("delete it"));
    }

    /// The text of an element that has no elements, as it is written.
    pub(super) fn text(&mut self, node: Node) -> Option<String> {
        if let Some(inner) = node.children().find(Node::is_element) {
            let (outer, name) = (node.tag_name().name(), inner.tag_name().name());
            let message = format!("the element `{}` holds a value, not elements", clip(outer));
            let finding = Finding::error(code::XML_ELEMENT, opening(inner), message);
            self.findings.push(
                finding
                    .expected("a value")
                    .found(format!("`{}`", clip(name))),
            );
            return None;
        }
        let text = node.children().filter(Node::is_text);
        Some(text.filter_map(|text| text.text()).collect())
    }

    /// The text of an element, with blanks at the ends dropped and others made one.
    pub(super) fn token(&mut self, node: Node) -> Option<String> {
        let text = self.text(node)?;
        Some(text.split_ascii_whitespace().collect::<Vec<_>>().join(" "))
    }

    /// A finite number.
    pub(super) fn number(&mut self, node: Node) -> Option<f64> {
        let text = self.token(node)?;
        let plain = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
        if matches!(text.as_str(), "INF" | "-INF" | "+INF" | "NaN") {
            let message = format!(
                "`{}` must be a finite number, got {text}",
                node.tag_name().name()
            );
            let finding = Finding::error(code::NOT_FINITE, value_span(node), message);
            self.findings
                .push(finding.help("write a plain decimal number"));
            return None;
        }
        let number = text.chars().all(plain).then(|| text.parse::<f64>().ok());
        match number.flatten() {
            Some(number) if number.is_finite() => Some(number),
            Some(_) => {
                let message = format!("`{}` is too large for a number", clip(&text));
                self.findings
                    .push(Finding::error(code::OVERFLOW, value_span(node), message));
                None
            }
            None => self.wrong(node, "a number", &text),
        }
    }

    /// A whole number.
    pub(super) fn integer(&mut self, node: Node) -> Option<i64> {
        let text = self.token(node)?;
        match text.parse::<i64>() {
            Ok(integer) => Some(integer),
            Err(_) => self.wrong(node, "a whole number", &text),
        }
    }

    /// A whole number of 32 bits.
    pub(super) fn count(&mut self, node: Node) -> Option<i32> {
        let integer = self.integer(node)?;
        match i32::try_from(integer) {
            Ok(count) => Some(count),
            Err(_) => self.wrong(node, "a whole number of 32 bits", &integer.to_string()),
        }
    }

    /// `true` or `false`, also as 1 or 0.
    pub(super) fn boolean(&mut self, node: Node) -> Option<bool> {
        let text = self.token(node)?;
        match text.as_str() {
            "true" | "1" => Some(true),
            "false" | "0" => Some(false),
            _ => self.wrong(node, "`true` or `false`", &text),
        }
    }

    /// One of several names.
    pub(super) fn choice<T: Copy>(&mut self, node: Node, names: &[(&str, T)]) -> Option<T> {
        let text = self.token(node)?;
        if let Some((_, value)) = names.iter().find(|(name, _)| *name == text) {
            return Some(*value);
        }
        let names: Vec<_> = names.iter().map(|(name, _)| format!("`{name}`")).collect();
        self.wrong(node, &format!("one of {}", names.join(", ")), &text)
    }

    /// The `xsi:type` of an element, without prefix and without the `Type` at its end.
    pub(super) fn kind<'a>(&mut self, node: Node<'a, '_>) -> Option<&'a str> {
        let Some(kind) = node.attribute((XSI, "type")) else {
            let name = clip(node.tag_name().name());
            let message = format!("the element `{name}` does not say which kind it is");
            let finding = Finding::error(code::XML_KIND, opening(node), message)
                .expected(format!("`<{name} xsi:type=\"...Type\">`"))
                .found("no attribute `xsi:type`");
            self.findings.push(finding);
            return None;
        };
        let kind = kind.trim();
        let local = kind.rsplit_once(':').map_or(kind, |(_, local)| local);
        Some(local.strip_suffix("Type").unwrap_or(local))
    }

    /// The `xsi:type` of an element that may have one.
    pub(super) fn is_kind(&self, node: Node, kind: &str) -> bool {
        node.attribute((XSI, "type"))
            .is_some_and(|found| found.trim().trim_end_matches("Type") == kind)
    }

    /// Says that the value of an element is of another type.
    pub(super) fn wrong<T>(&mut self, node: Node, expected: &str, found: &str) -> Option<T> {
        let message = format!("`{}` must be {expected}", node.tag_name().name());
        let found = if found.is_empty() {
            "nothing".to_owned()
        } else {
            format!("`{}`", clip(found))
        };
        let finding = Finding::error(code::XML_VALUE, value_span(node), message);
        self.findings.push(finding.expected(expected).found(found));
        None
    }
}

fn is_blank(text: &str) -> bool {
    text.chars().all(|c| c.is_ascii_whitespace())
}

/// The opening bracket and the name of an element, for findings about the element as a whole.
pub(super) fn opening(node: Node) -> Range<usize> {
    let start = node.range().start;
    let name = node.tag_name().name().len() + 1;
    start..(start + name).min(node.range().end)
}

/// The value of an element, or its tag where it has none.
pub(super) fn value_span(node: Node) -> Range<usize> {
    match node.children().find(Node::is_text) {
        Some(text) => text.range(),
        None => opening(node),
    }
}
