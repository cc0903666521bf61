//! The left side: a bar of commands above four plots over time.

use super::scale::{Scale, marks};
use super::svg::{Anchor, Svg};
use super::{Drawing, colour};

const NAMES: [&str; 4] = ["position", "velocity", "acceleration", "jerk"];
const RIBBON: f64 = 24.0;
const GAP: f64 = 30.0;
/// Space left of the plots for the marks of their axes, and below them for the time axis.
const LEFT: f64 = 44.0;
const BELOW: f64 = 40.0;
/// The range of the plots: the limits and a little beyond.
const RANGE: [f64; 2] = [-1.12, 1.12];

pub(super) fn draw(svg: &mut Svg, drawing: &Drawing, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
    let end = drawing.rows.last().map_or(1.0, |row| row.time.max(1e-3));
    let time = Scale::new([0.0, end], [x + LEFT, x + width]);
    let strips = y + RIBBON;
    let tall = (height - RIBBON - BELOW - 4.0 * GAP) / 4.0;
    ribbon(svg, drawing, &time, y);
    for (quantity, name) in NAMES.iter().enumerate() {
        let top = strips + GAP + quantity as f64 * (tall + GAP);
        let value = Scale::new(RANGE, [top + tall, top]);
        frame(svg, drawing, &time, &value);
        let of = if quantity == 0 {
            "between the joint limits"
        } else {
            "\u{f7} joint limit"
        };
        svg.text("head", [x + LEFT, top - 8.0], Anchor::Start, name);
        let beside = x + LEFT + 8.0 + 7.6 * name.len() as f64;
        svg.text("small", [beside, top - 8.0], Anchor::Start, of);
        curves(svg, drawing, quantity, &time, &value);
    }
    legend(svg, drawing, [x + width, strips + GAP - 8.0]);
    time_axis(svg, &time, y + height - BELOW);
}

/// Bars for the commands that take time; dwells and tools are grey.
fn ribbon(svg: &mut Svg, drawing: &Drawing, time: &Scale, y: f64) {
    for span in &drawing.spans {
        let (left, right) = (time.at(span.start), time.at(span.end));
        svg.open(&span.label);
        let class = if span.moving { "bar" } else { "rest" };
        svg.rectangle(class, [left, y], [(right - left).max(0.5), RIBBON - 4.0]);
        if right - left > 6.4 * span.name.len() as f64 + 8.0 {
            let middle = [(left + right) / 2.0, y + 14.0];
            svg.text("small", middle, Anchor::Middle, &span.name);
        }
        svg.close();
    }
}

/// Background, grid, borders of commands and the limits of one strip.
fn frame(svg: &mut Svg, drawing: &Drawing, time: &Scale, value: &Scale) {
    let [start, end] = time.range().map(|t| time.at(t));
    let [bottom, top] = value.range().map(|v| value.at(v));
    svg.rectangle("panel", [start, top], [end - start, bottom - top]);
    for mark in [-0.5, 0.0, 0.5] {
        svg.line("grid", [start, value.at(mark)], [end, value.at(mark)]);
    }
    for span in &drawing.spans {
        let at = time.at(span.end);
        svg.line("grid", [at, top], [at, bottom]);
    }
    for mark in [-1.0, 0.0, 1.0] {
        let label = if mark < 0.0 {
            "\u{2212}1"
        } else if mark > 0.0 {
            "1"
        } else {
            "0"
        };
        svg.text(
            "small",
            [start - 8.0, value.at(mark) + 4.0],
            Anchor::End,
            label,
        );
    }
    for limit in [-1.0, 1.0] {
        svg.line("limit", [start, value.at(limit)], [end, value.at(limit)]);
    }
}

fn curves(svg: &mut Svg, drawing: &Drawing, quantity: usize, time: &Scale, value: &Scale) {
    for (joint, name) in drawing.joints.iter().enumerate() {
        let points: Vec<_> = drawing
            .rows
            .iter()
            .filter_map(|row| {
                let ratio = row.ratios[quantity].get(joint)?;
                let shown = ratio.clamp(RANGE[0], RANGE[1]);
                Some([time.at(row.time), value.at(shown)])
            })
            .collect();
        svg.open(name);
        svg.curve("line", colour(joint), &points);
        svg.close();
    }
}

/// Joint numbers in their colours, right-aligned.
fn legend(svg: &mut Svg, drawing: &Drawing, [right, y]: [f64; 2]) {
    let count = drawing.joints.len();
    svg.text(
        "small",
        [right - 28.0 * count as f64 - 12.0, y],
        Anchor::End,
        "joint",
    );
    for (joint, name) in drawing.joints.iter().enumerate() {
        let at = right - 28.0 * (count - joint) as f64 + 6.0;
        svg.open(name);
        svg.dot(colour(joint), [at, y - 4.0], 4.5);
        svg.text(
            "small",
            [at + 8.0, y],
            Anchor::Start,
            &format!("{}", joint + 1),
        );
        svg.close();
    }
}

fn time_axis(svg: &mut Svg, time: &Scale, y: f64) {
    let (seconds, step) = marks(time.range(), 10);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    for second in seconds {
        let at = time.at(second);
        svg.line("grid", [at, y], [at, y + 5.0]);
        svg.text(
            "small",
            [at, y + 18.0],
            Anchor::Middle,
            &format!("{second:.decimals$}"),
        );
    }
    let middle = (time.at(time.range()[0]) + time.at(time.range()[1])) / 2.0;
    svg.text("small", [middle, y + 36.0], Anchor::Middle, "time / s");
}
