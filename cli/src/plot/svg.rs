//! Writes SVG text: a few shapes, coordinates in pixels with two decimals.

use std::fmt::{Display, Write};

/// A picture under construction.
pub(super) struct Svg {
    text: String,
}

/// Style of the picture; follows the reader's light or dark setting if the viewer supports it.
const STYLE: &str = "\
text{font-family:Inter,'Segoe UI','Helvetica Neue',Arial,'DejaVu Sans',sans-serif;font-size:12px;fill:#57606a}\
.title{font-size:21px;font-weight:600;fill:#1f2328}\
.head{font-size:13px;font-weight:600;fill:#1f2328}\
.small{font-size:11px}\
.paper{fill:#ffffff}.panel{fill:#f6f8fa}\
.grid{stroke:#d8dee4;stroke-width:1;fill:none}\
.limit{stroke:#cf222e;stroke-width:1;stroke-dasharray:5 4;fill:none;opacity:.75}\
.bar{fill:#ddf4ff;stroke:#54aeff;stroke-width:.75}.rest{fill:#eaeef2;stroke:#afb8c1;stroke-width:.75}\
.line{fill:none;stroke-width:1.5;stroke-linejoin:round;stroke-linecap:round}\
.path{fill:none;stroke-width:2.4;stroke-linejoin:round;stroke-linecap:round}\
.ball{fill:#d4a72c;fill-opacity:.22;stroke:#9a6700;stroke-width:1}\
.pose{fill:#9a6700}.goal{fill:#1f2328}.start{fill:#ffffff;stroke:#1f2328;stroke-width:2}\
@media (prefers-color-scheme:dark){\
text{fill:#9198a1}.title,.head{fill:#f0f6fc}.paper{fill:#0d1117}.panel{fill:#151b23}.grid{stroke:#2f3742}\
.bar{fill:#0c2d6b;stroke:#1f6feb}.rest{fill:#21262d;stroke:#57606a}\
.goal{fill:#f0f6fc}.start{fill:#0d1117;stroke:#f0f6fc}.pose{fill:#e3b341}.ball{stroke:#e3b341}}";

/// Where a text stands relative to its point.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    /// An empty picture of this size, with rounded corners.
    pub(super) fn new(width: f64, height: f64) -> Self {
        let mut svg = Self {
            text: String::new(),
        };
        svg.push(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n<style>{STYLE}</style>\n\
             <rect class=\"paper\" width=\"{width}\" height=\"{height}\" rx=\"12\"/>\n"
        ));
        svg
    }

    /// A rectangle of a class with slightly rounded corners.
    pub(super) fn rectangle(&mut self, class: &str, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        self.push(format_args!(
            "<rect class=\"{class}\" x=\"{x:.2}\" y=\"{y:.2}\" width=\"{width:.2}\" \
             height=\"{height:.2}\" rx=\"3\"/>\n"
        ));
    }

    /// A straight line.
    pub(super) fn line(&mut self, class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
        self.push(format_args!(
            "<path class=\"{class}\" d=\"M{x1:.2} {y1:.2}L{x2:.2} {y2:.2}\"/>\n"
        ));
    }

    /// A line through points, in a colour; points that make no visible difference are left out.
    pub(super) fn curve(&mut self, class: &str, colour: &str, points: &[[f64; 2]]) {
        if points.len() < 2 {
            return;
        }
        let points = simplified(points);
        self.push(format_args!(
            "<path class=\"{class}\" stroke=\"{colour}\" d=\""
        ));
        for (index, [x, y]) in points.iter().enumerate() {
            self.push(format_args!(
                "{}{x:.2} {y:.2}",
                if index == 0 { 'M' } else { 'L' }
            ));
        }
        self.push(format_args!("\"/>\n"));
    }

    /// A disc or ring.
    pub(super) fn circle(&mut self, class: &str, [x, y]: [f64; 2], radius: f64) {
        self.push(format_args!(
            "<circle class=\"{class}\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\"/>\n"
        ));
    }

    /// A filled disc of a colour.
    pub(super) fn dot(&mut self, colour: &str, [x, y]: [f64; 2], radius: f64) {
        self.push(format_args!(
            "<circle fill=\"{colour}\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\"/>\n"
        ));
    }

    /// A text on one line.
    pub(super) fn text(&mut self, class: &str, [x, y]: [f64; 2], anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escaped(text);
        self.push(format_args!(
            "<text class=\"{class}\" x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"{anchor}\">{text}</text>\n"
        ));
    }

    /// Everything until [`Svg::close`] gets `title` as its tooltip.
    pub(super) fn open(&mut self, title: &str) {
        self.push(format_args!("<g><title>{}</title>\n", escaped(title)));
    }

    /// Ends what [`Svg::open`] began.
    pub(super) fn close(&mut self) {
        self.push(format_args!("</g>\n"));
    }

    /// The whole picture as text.
    pub(super) fn finish(mut self) -> String {
        self.push(format_args!("</svg>\n"));
        self.text
    }

    fn push(&mut self, text: impl Display) {
        // Writing to a string cannot fail.
        let _ = write!(self.text, "{text}");
    }
}

/// How far a curve may be from its points, pixels.
const UNSEEN: f64 = 0.12;

/// The points without those that are within [`UNSEEN`] of the line through their neighbours.
///
/// # Source
/// D. Douglas and T. Peucker, "Algorithms for the reduction of the number of points required to
/// represent a digitized line", Cartographica 10(2), 1973.
fn simplified(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        (keep[first], keep[last]) = (true, true);
        let distance = |index: &usize| off_line(points[*index], points[first], points[last]);
        let farthest = (first + 1..last).max_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(farthest) = farthest.filter(|index| distance(index) > UNSEEN) {
            open.extend([(first, farthest), (farthest, last)]);
        }
    }
    points
        .iter()
        .zip(keep)
        .filter_map(|(point, kept)| kept.then_some(*point))
        .collect()
}

/// Distance of a point from the line between two others.
fn off_line([x, y]: [f64; 2], [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) -> f64 {
    let (dx, dy) = (x2 - x1, y2 - y1);
    let squared = dx * dx + dy * dy;
    let part = if squared > 0.0 {
        ((x - x1) * dx + (y - y1) * dy) / squared
    } else {
        0.0
    };
    let part = part.clamp(0.0, 1.0);
    (x - x1 - part * dx).hypot(y - y1 - part * dy)
}

/// Text with XML's special characters replaced and control characters dropped.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            other if other.is_control() => {}
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simplified_curve_stays_within_the_unseen() {
        let points: Vec<_> = (0..2000)
            .map(|k| [f64::from(k) * 0.4, 70.0 * (f64::from(k) * 0.01).sin()])
            .collect();
        let kept = simplified(&points);
        assert!(kept.len() < points.len() / 10, "{} points", kept.len());
        for point in &points {
            let nearest = kept
                .windows(2)
                .map(|pair| off_line(*point, pair[0], pair[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest <= UNSEEN);
        }
    }

    #[test]
    fn text_of_a_program_cannot_break_the_picture() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text("small", [1.0, 2.0], Anchor::Middle, "a<b & \"c\"\u{7}");
        let text = svg.finish();
        assert!(
            text.contains(">a&lt;b &amp; &quot;c&quot;</text>"),
            "{text}"
        );
    }
}
