use super::svg::{Anchor, Svg};

/// A time beside the one it is compared with.
pub(crate) struct Bar {
    /// What it is about.
    pub(crate) name: String,
    /// Time, s; none where there is no motion.
    pub(crate) value: Option<f64>,
    /// Time with a stop at each pose, s.
    pub(crate) reference: Option<f64>,
}

/// Left edge and length of a bar that is as long as its reference, pixels.
const BAR: [f64; 2] = [180.0, 640.0];
/// Height of a row, pixels.
const ROW: f64 = 34.0;

/// Motion times as parts of the time with exact stops, as SVG text.
pub(crate) fn bars(title: &str, rows: &[Bar]) -> String {
    let height = 110.0 + ROW * rows.len() as f64;
    let mut svg = Svg::new(1040.0, height);
    svg.text("title", [28.0, 44.0], Anchor::Start, title);
    let legend = "motion time, as a part of the time with a stop at each pose";
    svg.text("", [28.0, 66.0], Anchor::Start, legend);
    for (index, row) in rows.iter().enumerate() {
        draw(&mut svg, row, 92.0 + ROW * index as f64);
    }
    svg.finish()
}

fn draw(svg: &mut Svg, row: &Bar, top: f64) {
    let [left, length] = BAR;
    let text = top + 0.5 * ROW;
    svg.text("head", [left - 14.0, text], Anchor::End, &row.name);
    let (Some(value), Some(reference)) = (row.value, row.reference.filter(|r| *r > 0.0)) else {
        let words = row
            .value
            .map_or("no motion".to_owned(), |v| format!("{v:.3} s"));
        svg.text("", [left, text], Anchor::Start, &words);
        return;
    };
    let part = (value / reference).clamp(0.0, 1.2);
    svg.rectangle("rest", [left, top], [length, ROW - 12.0]);
    svg.rectangle("bar", [left, top], [length * part, ROW - 12.0]);
    let words = format!("{value:.3} s of {reference:.3} s");
    svg.text("", [left + length + 14.0, text], Anchor::Start, &words);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_its_name_and_time() {
        let bar = |name: &str, value, reference| Bar {
            name: name.into(),
            value,
            reference,
        };
        let rows = [
            bar("L", Some(0.5), Some(1.0)),
            bar("none", None, None),
            bar("alone", Some(2.0), None),
        ];
        let text = bars("a < b", &rows);
        assert!(text.contains("0.500 s of 1.000 s") && text.contains("no motion"));
        assert!(text.contains("a &lt; b") && !text.contains("NaN"));
    }
}
