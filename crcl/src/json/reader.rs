//! JSON values with their places in the source.

use std::borrow::Cow;
use std::ops::Range;

use serde_json::value::RawValue;

use crate::code;
use crate::fields::{Field, fields, items};
use crate::finding::{Finding, Findings};
use crate::lexer::clip;
use crate::suggest;

/// Reads meaning into JSON values; each knows its place by where it lies in the source.
pub(super) struct Reader<'a, 'f> {
    pub(super) source: &'a str,
    pub(super) strict: bool,
    pub(super) findings: &'f mut Findings,
}

impl<'a> Reader<'a, '_> {
    pub(super) fn number(&mut self, noun: &str, raw: &RawValue) -> Option<f64> {
        let written = raw.get();
        if !written.starts_with(|c: char| c == '-' || c.is_ascii_digit()) {
            return self.wrong_type(noun, "a number", raw);
        }
        let number = written
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite());
        if number.is_none() {
            let message = format!("`{}` is too large for a number", clip(written));
            self.findings
                .push(Finding::error(code::OVERFLOW, self.span(raw), message));
        }
        number
    }

    pub(super) fn text(&mut self, noun: &str, raw: &'a RawValue) -> Option<Cow<'a, str>> {
        if !raw.get().starts_with('"') {
            return self.wrong_type(noun, "a text", raw);
        }
        match serde_json::from_str::<String>(raw.get()) {
            Ok(text) => Some(Cow::Owned(text)),
            Err(_) => self.wrong_type(noun, "a text of whole characters", raw),
        }
    }

    pub(super) fn fields(&mut self, noun: &str, raw: &'a RawValue) -> Option<Vec<Field<'a>>> {
        let found = fields(raw);
        if found.is_none() && raw.get().starts_with('{') {
            let message = "a field name in this object has a broken escape";
            self.findings.push(Finding::error(
                code::JSON_SYNTAX,
                self.opening(raw),
                message,
            ));
        } else if found.is_none() {
            return self.wrong_type(noun, "an object in `{}`", raw);
        }
        found
    }

    pub(super) fn items(&mut self, noun: &str, raw: &'a RawValue) -> Option<Vec<&'a RawValue>> {
        let found = items(raw);
        if found.is_none() {
            return self.wrong_type(noun, "a list in `[]`", raw);
        }
        found
    }

    pub(super) fn wrong_type<T>(
        &mut self,
        noun: &str,
        expected: &str,
        raw: &RawValue,
    ) -> Option<T> {
        let message = format!("{noun} must be {expected}");
        let finding = Finding::error(code::ARGUMENT_TYPE, self.span(raw), message);
        self.findings
            .push(finding.expected(expected).found(describe(raw)));
        None
    }

    /// The value of a field that must be there.
    pub(super) fn wanted(
        &mut self,
        noun: &str,
        object: &RawValue,
        fields: &[Field<'a>],
        name: &str,
    ) -> Option<&'a RawValue> {
        let value = find(fields, name);
        if value.is_none() {
            let message = format!("{noun} needs the field \"{name}\"");
            let finding = Finding::error(code::MISSING_FIELD, self.opening(object), message);
            let found: Vec<_> = fields
                .iter()
                .map(|f| format!("\"{}\"", clip(&f.name)))
                .collect();
            let found = if found.is_empty() {
                "no field".to_owned()
            } else {
                found.join(", ")
            };
            self.findings
                .push(finding.expected(format!("\"{name}\"")).found(clip(&found)));
        }
        value
    }

    /// Whether all fields are known and none comes twice; reports those that are not.
    pub(super) fn known(
        &mut self,
        noun: &str,
        fields: &[Field<'a>],
        names: &[&'static str],
    ) -> bool {
        let before = self.findings.total();
        let mut seen: Vec<&str> = Vec::new();
        for field in fields {
            let span = self.key(field);
            let name = field.name.as_ref();
            if !names.contains(&name) {
                let message = format!("{noun} has no field \"{}\"", clip(name));
                let finding = Finding::error(code::UNKNOWN_FIELD, span, message);
                self.findings.push(match suggest::nearest(name, names) {
                    Some(near) => finding.help(format!("did you mean \"{near}\"?")),
                    None => finding.help("delete it"),
                });
            } else if seen.contains(&name) {
                let message = format!("the field \"{name}\" comes twice");
                let finding = Finding::error(code::DUPLICATE_FIELD, span, message);
                self.findings.push(finding.help("keep one of them"));
            } else {
                seen.push(name);
            }
        }
        self.findings.total() == before
    }

    /// Bytes of the source that a value takes.
    pub(super) fn span(&self, raw: &RawValue) -> Range<usize> {
        self.place(raw.get())
    }

    /// The first byte of a value, for findings about something that it lacks.
    pub(super) fn opening(&self, raw: &RawValue) -> Range<usize> {
        let start = self.span(raw).start;
        start..start + 1
    }

    /// Bytes of the source that a field's name takes; its value's first byte when the name is
    /// written with escapes.
    fn key(&self, field: &Field<'a>) -> Range<usize> {
        match &field.name {
            Cow::Borrowed(name) => self.place(name),
            Cow::Owned(_) => self.opening(field.value),
        }
    }

    /// Where a part of the source lies in it.
    fn place(&self, part: &str) -> Range<usize> {
        let start = (part.as_ptr() as usize).saturating_sub(self.source.as_ptr() as usize);
        start..(start + part.len()).min(self.source.len())
    }
}

pub(super) fn find<'a>(fields: &[Field<'a>], name: &str) -> Option<&'a RawValue> {
    fields
        .iter()
        .find(|field| field.name == name)
        .map(|field| field.value)
}

/// A description of a JSON value, for "found".
pub(super) fn describe(raw: &RawValue) -> String {
    let written = raw.get();
    match written.chars().next() {
        Some('{') => "an object".to_owned(),
        Some('[') => "a list".to_owned(),
        Some('"') => format!("the text {}", clip(written)),
        Some('t' | 'f' | 'n') => format!("`{written}`"),
        _ => format!("the number `{}`", clip(written)),
    }
}
