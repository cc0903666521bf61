//! Programs: read, checked, with findings as exceptions.

use crcl::{CheckOptions, LengthUnit, Program, ReadOptions, Reading, Source};
use pyo3::prelude::*;

use crate::error::{Field, Raise, argument};
use crate::wait;

/// A program as it was given.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    /// The name that findings show.
    pub(crate) name: String,
    /// The text.
    pub(crate) text: String,
    /// Unit of length until the program sets one: mm, m or inch.
    pub(crate) length: String,
}

impl Given {
    /// Unit of length until the program sets one.
    pub(crate) fn length(&self) -> PyResult<LengthUnit> {
        match self.length.as_str() {
            "mm" => Ok(LengthUnit::Millimeter),
            "m" => Ok(LengthUnit::Meter),
            "inch" => Ok(LengthUnit::Inch),
            other => Err(argument(format!(
                "length: expected mm, m or inch, got {other:?}"
            ))),
        }
    }

    /// All findings, and what could be read.
    fn read(&self, default_length: LengthUnit) -> Reading {
        let bytes = self.text.as_bytes();
        let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
        let read = if crcl::xml::looks_like_xml(bytes) {
            crcl::xml::read
        } else if first.is_some_and(|byte| matches!(byte, b'{' | b'[')) {
            crcl::json::read
        } else {
            crcl::text::read
        };
        let mut reading = read(&self.text, &ReadOptions::default());
        // Errors of the order of commands may be consequences of other errors.
        if !reading.has_errors() {
            let options = CheckOptions {
                strict: false,
                default_length,
            };
            let more = crcl::check(&reading.program, &options);
            reading.findings.extend(more);
            reading.findings.sort_by_key(|finding| finding.span.start);
        }
        reading
    }

    /// The program, if it has no errors.
    ///
    /// # Errors
    /// `ProgramError` with its findings.
    pub(crate) fn program(&self, py: Python<'_>) -> PyResult<Program> {
        let length = self.length()?;
        let reading = wait::short(py, "reading a program", || self.read(length))?;
        if !reading.has_errors() {
            return Ok(reading.program);
        }
        Err(self.refusal(&reading).into())
    }

    /// The errors as an exception.
    fn refusal(&self, reading: &Reading) -> Raise {
        let source = Source::new(&*self.name, &*self.text);
        let look = (crcl::Look::Plain, 100);
        let text = crcl::render(&reading.findings, reading.omitted, &source, look);
        let records = crcl::records(&reading.findings, &source);
        let first = reading.findings.iter().find(|finding| finding.is_error());
        let (line, column) = first.map_or((1, 1), |first| source.position(first.span.start));
        Raise::new("ProgramError", text.trim_end())
            .with("findings", Field::Json(json(&records)))
            .with("line", Field::Count(line))
            .with("column", Field::Count(column))
    }
}

/// Data as JSON; plain data always has a form.
pub(crate) fn json(data: &impl serde::Serialize) -> String {
    serde_json::to_string(data).unwrap_or_else(|_| "null".to_owned())
}

/// All findings about a program, as JSON.
#[pyfunction]
pub(crate) fn check(
    py: Python<'_>,
    name: String,
    text: String,
    length: String,
) -> PyResult<String> {
    let given = Given { name, text, length };
    let length = given.length()?;
    wait::short(py, "checking a program", || {
        let reading = given.read(length);
        let source = Source::new(&*given.name, &*given.text);
        json(&crcl::records(&reading.findings, &source))
    })
}
