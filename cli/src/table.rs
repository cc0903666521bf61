use std::io::Read;

use anyhow::anyhow;

use crate::failure::Failure;
use crate::input;

/// A row of numbers and the line of the file that it is from.
#[derive(Debug, PartialEq)]
pub(crate) struct CsvRow {
    pub(crate) line: u64,
    pub(crate) numbers: Vec<f64>,
}

/// Rows of numbers from a CSV file, `-` for standard input; a first row that is not numbers is a
/// header and left out. Every row has one finite number for each of the `columns`.
///
/// # Errors
/// [`Exit::Unreadable`](crate::exit::Exit::Unreadable), with the line, the column, what was
/// expected and what was found.
pub(crate) fn read(path: &str, columns: &[&str]) -> Result<Vec<CsvRow>, Failure> {
    let source = input::lines(path)?;
    input::unreadable(path, parse(source, columns))
}

fn parse(source: impl Read, columns: &[&str]) -> anyhow::Result<Vec<CsvRow>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(source);
    let mut rows = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record = record?;
        if index == 0 && record.iter().all(|cell| cell.parse::<f64>().is_err()) {
            continue;
        }
        let line = record
            .position()
            .map_or(index as u64 + 1, csv::Position::line);
        if record.len() != columns.len() {
            return Err(anyhow!(
                "line {line}: expected {} numbers, {}, got {} cells",
                columns.len(),
                columns.join(","),
                record.len()
            ));
        }
        let cells = record.iter().zip(columns).enumerate();
        let numbers = cells.map(|(index, (cell, name))| match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(anyhow!(
                "line {line}, column {} ({name}): expected a finite number, got {cell:?}",
                index + 1
            )),
        });
        let numbers = numbers.collect::<anyhow::Result<Vec<_>>>()?;
        rows.push(CsvRow { line, numbers });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_left_out_and_faults_have_a_place() {
        let rows = parse(&b"q1,q2\n1, 2\n3,4\n"[..], &["q1", "q2"]).unwrap();
        let row = |line, numbers: [f64; 2]| CsvRow {
            line,
            numbers: numbers.to_vec(),
        };
        assert_eq!(rows, [row(2, [1.0, 2.0]), row(3, [3.0, 4.0])]);
        let fault = |text: &[u8]| parse(text, &["q1", "q2"]).unwrap_err().to_string();
        assert_eq!(
            fault(b"1,2\n3\n"),
            "line 2: expected 2 numbers, q1,q2, got 1 cells"
        );
        assert_eq!(
            fault(b"1,2\n3,NaN\n"),
            "line 2, column 2 (q2): expected a finite number, got \"NaN\""
        );
        assert_eq!(
            fault(b"1,2\nx,4\n"),
            "line 2, column 1 (q1): expected a finite number, got \"x\""
        );
        assert!(fault(b"1,x\n3,4\n").starts_with("line 1, column 2"));
    }
}
