//! Plots a planned motion: joint quantities relative to their limits over time, and the path of the
//! tool from above and from the side.

mod bars;
mod scale;
mod strips;
mod svg;
mod views;

pub(crate) use bars::{Bar, bars};

use svg::{Anchor, Svg};

/// What is drawn.
pub(crate) struct Drawing {
    /// First line.
    pub(crate) title: String,
    /// Second line.
    pub(crate) subtitle: String,
    /// Names of the joints.
    pub(crate) joints: Vec<String>,
    /// Commands that take time, in order.
    pub(crate) spans: Vec<Span>,
    /// States in the order of time, at a constant period.
    pub(crate) rows: Vec<PlotRow>,
    /// Poses that the program asks for.
    pub(crate) targets: Vec<Target>,
}

/// Time that a command takes.
pub(crate) struct Span {
    /// Name and line, for the tooltip.
    pub(crate) label: String,
    /// Name, drawn where it fits.
    pub(crate) name: String,
    /// Start, s.
    pub(crate) start: f64,
    /// End, s.
    pub(crate) end: f64,
    /// Whether the arm moves.
    pub(crate) moving: bool,
}

/// State at one time. The four lists have one entry per joint, relative to the limits: the position
/// runs from -1 at the lower to 1 at the upper limit, the others are divided by theirs.
pub(crate) struct PlotRow {
    /// Time, s.
    pub(crate) time: f64,
    /// Position, velocity, acceleration, jerk.
    pub(crate) ratios: [Vec<f64>; 4],
    /// Controlled point in the workstation, m.
    pub(crate) point: [f64; 3],
}

/// A pose that the program asks for.
pub(crate) struct Target {
    /// Controlled point in the workstation, m.
    pub(crate) point: [f64; 3],
    /// Radius of the tolerance ball of an intermediate pose, m; none for the end of a move.
    pub(crate) tolerance: Option<f64>,
}

/// Size of the picture, pixels.
const SIZE: [f64; 2] = [1280.0, 900.0];

/// One colour per joint; readers with a colour vision deficiency can distinguish them too.
const COLOURS: [&str; 8] = [
    "#0969da", "#d1600a", "#1a9850", "#c2255c", "#7048e8", "#b08800", "#0b9bb0", "#6e7781",
];

/// The picture as SVG text.
pub(crate) fn svg(drawing: &Drawing) -> String {
    let mut svg = Svg::new(SIZE[0], SIZE[1]);
    svg.text("title", [28.0, 44.0], Anchor::Start, &drawing.title);
    svg.text("", [28.0, 66.0], Anchor::Start, &drawing.subtitle);
    strips::draw(&mut svg, drawing, [28.0, 92.0], [800.0, 784.0]);
    views::draw(&mut svg, drawing, [872.0, 92.0], [380.0, 784.0]);
    svg.finish()
}

fn colour(joint: usize) -> &'static str {
    COLOURS[joint % COLOURS.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawing(rows: usize) -> Drawing {
        let row = |k: usize| {
            let time = k as f64 * 0.01;
            let wave = |phase: f64| vec![(time * 2.0 + phase).sin(), (time * 3.0 + phase).cos()];
            PlotRow {
                time,
                ratios: [wave(0.0), wave(1.0), wave(2.0), wave(3.0)],
                point: [
                    0.4 + 0.1 * time.cos(),
                    0.3 * time.sin(),
                    0.2 + 0.05 * (2.0 * time).sin(),
                ],
            }
        };
        Drawing {
            title: "a < b".into(),
            subtitle: "test".into(),
            joints: vec!["one".into(), "two".into()],
            spans: vec![Span {
                label: "line 3: MoveTo".into(),
                name: "MoveTo".into(),
                start: 0.0,
                end: rows as f64 * 0.01,
                moving: true,
            }],
            rows: (0..rows).map(row).collect(),
            targets: vec![Target {
                point: [0.4, 0.0, 0.2],
                tolerance: Some(0.02),
            }],
        }
    }

    #[test]
    fn a_picture_is_finite_whatever_is_drawn() {
        for rows in [0, 1, 2, 700] {
            let text = svg(&drawing(rows));
            assert!(
                !text.contains("NaN") && !text.contains("inf"),
                "{rows} rows"
            );
            assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"));
        }
    }

    #[test]
    fn every_joint_has_a_curve_in_every_strip() {
        let text = svg(&drawing(300));
        for joint in 0..2 {
            let curve = format!("<path class=\"line\" stroke=\"{}\"", colour(joint));
            assert_eq!(text.matches(&curve).count(), 4);
        }
    }
}
