use std::fs::File;
use std::io::{self, Read};

use anyhow::{Context, anyhow};

use crate::exit::Exit;
use crate::failure::Failure;

/// Rows of numbers from a CSV file, `-` for standard input; a first row that is not numbers is a
/// header and left out. Every row has `columns` finite numbers.
///
/// # Errors
/// [`Exit::Unreadable`], with the line and what was expected.
pub(crate) fn read(path: &str, columns: usize) -> Result<Vec<Vec<f64>>, Failure> {
    let source: Box<dyn Read> = if path == "-" {
        Box::new(io::stdin())
    } else {
        let file = File::open(path).with_context(|| format!("cannot read {path}"));
        Box::new(file.map_err(|cause| Failure::new(Exit::Unreadable, cause))?)
    };
    parse(source, columns)
        .with_context(|| format!("cannot read {path}"))
        .map_err(|cause| Failure::new(Exit::Unreadable, cause))
}

fn parse(source: impl Read, columns: usize) -> anyhow::Result<Vec<Vec<f64>>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(source);
    let mut rows = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record = record?;
        let line = record
            .position()
            .map_or(index as u64 + 1, csv::Position::line);
        let numbers: Result<Vec<f64>, _> = record.iter().map(str::parse::<f64>).collect();
        match numbers {
            Err(_) if index == 0 && record.iter().all(|cell| cell.parse::<f64>().is_err()) => {}
            Err(error) => return Err(anyhow!("line {line}: {error}")),
            Ok(row) if row.len() != columns => {
                return Err(anyhow!(
                    "line {line}: expected {columns} numbers, got {}",
                    row.len()
                ));
            }
            Ok(row) => match row.iter().find(|value| !value.is_finite()) {
                Some(value) => return Err(anyhow!("line {line}: {value} is not a finite number")),
                None => rows.push(row),
            },
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_left_out_and_faults_have_a_line() {
        assert_eq!(
            parse(&b"q1,q2\n1, 2\n3,4\n"[..], 2).unwrap(),
            [[1.0, 2.0], [3.0, 4.0]]
        );
        let fault = |text: &[u8]| parse(text, 2).unwrap_err().to_string();
        assert_eq!(fault(b"1,2\n3\n"), "line 2: expected 2 numbers, got 1");
        assert_eq!(fault(b"1,2\n3,NaN\n"), "line 2: NaN is not a finite number");
        assert!(fault(b"1,2\nx,4\n").starts_with("line 2: "));
        assert!(fault(b"1,x\n3,4\n").starts_with("line 1: "));
    }
}
