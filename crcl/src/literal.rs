//! Numbers and quoted texts as they are written.

use std::ops::Range;

/// The number of a text in C++ form: `12`, `-1.5`, `.12`, `+3.`, `2e-3`.
pub(crate) fn parse_number(text: &str) -> Option<f64> {
    let plain = |c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-' | 'e' | 'E');
    if text.chars().all(plain) {
        text.parse().ok()
    } else {
        None
    }
}

/// What to write instead of something that looks like a number.
pub(crate) fn number_help(text: &str) -> &'static str {
    let unit = text.trim_start_matches(|c: char| !c.is_alphabetic());
    match unit {
        "mm" | "cm" | "m" | "in" | "inch" | "meter" => {
            "numbers carry no unit; set it before with `SetLengthUnits (\"mm\")`"
        }
        "deg" | "degree" | "rad" => {
            "numbers carry no unit; set it before with `SetAngleUnits (\"degree\")`"
        }
        "s" | "ms" => "numbers carry no unit; times are in seconds",
        "f" | "F" | "l" | "L" => "leave out the letter at the end",
        _ => "write a plain decimal number such as `-12.5` or `2e-3`",
    }
}

/// The text that a quoted one stands for, or the range of a bad escape and what to do.
pub(crate) fn unescape(body: &str) -> Result<String, (Range<usize>, &'static str)> {
    let mut text = String::with_capacity(body.len());
    let mut characters = body.char_indices();
    while let Some((start, character)) = characters.next() {
        if character != '\\' {
            text.push(character);
            continue;
        }
        let Some((at, escaped)) = characters.next() else {
            return Err((start..start + 1, "write `\\\\` for a backslash"));
        };
        match escaped {
            'n' => text.push('\n'),
            'r' => text.push('\r'),
            't' => text.push('\t'),
            '"' | '\\' | '\'' => text.push(escaped),
            'u' => {
                let digits = body.get(at + 1..at + 5).unwrap_or_default();
                let value = u32::from_str_radix(digits, 16)
                    .ok()
                    .and_then(char::from_u32);
                let Some(value) = value.filter(|_| !digits.starts_with('+')) else {
                    return Err((start..at + 1, "write `\\u` and four hexadecimal digits"));
                };
                text.push(value);
                characters.nth(3);
            }
            _ => {
                let help =
                    "write `\\\\` for a backslash; the escapes are \\\" \\\\ \\n \\r \\t \\uXXXX";
                return Err((start..at + escaped.len_utf8(), help));
            }
        }
    }
    Ok(text)
}
