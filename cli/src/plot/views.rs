//! The right side: the path of the tool from above and from the side, at the same scale.

use super::scale::{Scale, marks};
use super::svg::{Anchor, Svg};
use super::{Drawing, PlotRow};

const GAP: f64 = 30.0;
/// Space for the marks of the axes, left of and below each view.
const LEFT: f64 = 48.0;
const BELOW: f64 = 40.0;
const LEGEND: f64 = 24.0;
/// Colours of the path from rest to full speed.
const SPEEDS: [&str; 8] = [
    "#3b4cc0", "#4a6fdc", "#2c93d1", "#14a89b", "#4fb05a", "#b3a82a", "#e58a1f", "#d7301f",
];

/// Which axes a view shows: to the right (or left when `leftwards`) and up.
struct View {
    name: &'static str,
    across: usize,
    up: usize,
    leftwards: bool,
}

/// A view laid out on the page.
struct Layout {
    across: Scale,
    up: Scale,
    pixels_per_meter: f64,
}

pub(super) fn draw(svg: &mut Svg, drawing: &Drawing, [x, y]: [f64; 2], size: [f64; 2]) {
    let [width, height] = size;
    speed_legend(svg, drawing, [x + LEFT, y], width - LEFT);
    let bounds = bounds(drawing);
    let extent = |axis: usize| bounds[axis][1] - bounds[axis][0];
    // The longer horizontal axis goes across the page. With x up the page, y points left.
    let turned = extent(1) > extent(0);
    let (across, up) = if turned { (1, 0) } else { (0, 1) };
    let views = [
        View {
            name: "from above",
            across,
            up,
            leftwards: turned,
        },
        View {
            name: "from the side",
            across,
            up: 2,
            leftwards: turned,
        },
    ];
    let wide = width - LEFT;
    let tall = (height - LEGEND) / 2.0 - GAP - BELOW;
    let least = |room: f64, axis: usize| room / extent(axis);
    let scale = least(wide, across).min(least(tall, up)).min(least(tall, 2));
    for (index, view) in views.iter().enumerate() {
        let top = y + LEGEND + GAP + index as f64 * (tall + GAP + BELOW);
        let middle = |axis: usize| (bounds[axis][0] + bounds[axis][1]) / 2.0;
        let half = |room: f64| room / scale / 2.0;
        let (centre, side) = (middle(view.across), half(wide));
        let mut range = [centre - side, centre + side];
        if view.leftwards {
            range.reverse();
        }
        let (centre, side) = (middle(view.up), half(tall));
        let layout = Layout {
            across: Scale::new(range, [x + LEFT, x + width]),
            up: Scale::new([centre - side, centre + side], [top + tall, top]),
            pixels_per_meter: scale,
        };
        svg.text("head", [x + LEFT, top - 8.0], Anchor::Start, view.name);
        axes(svg, view, &layout);
        way(svg, drawing, view, &layout);
        targets(svg, drawing, view, &layout);
    }
}

/// Least and largest coordinate of everything that is shown, with a margin; never empty.
fn bounds(drawing: &Drawing) -> [[f64; 2]; 3] {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let mut include = |point: &[f64; 3], radius: f64| {
        for (bound, value) in bounds.iter_mut().zip(point) {
            *bound = [bound[0].min(value - radius), bound[1].max(value + radius)];
        }
    };
    for row in &drawing.rows {
        include(&row.point, 0.0);
    }
    for target in &drawing.targets {
        include(&target.point, target.tolerance.unwrap_or(0.0));
    }
    for bound in &mut bounds {
        if bound[0] > bound[1] {
            *bound = [0.0, 0.0];
        }
        let margin = ((bound[1] - bound[0]) * 0.08).max(0.02);
        *bound = [bound[0] - margin, bound[1] + margin];
    }
    bounds
}

/// Background, grid and marks in millimetres.
fn axes(svg: &mut Svg, view: &View, layout: &Layout) {
    const AXES: [&str; 3] = ["x / mm", "y / mm", "z / mm"];
    let [left, right] = layout.across.range().map(|value| layout.across.at(value));
    let [bottom, top] = layout.up.range().map(|value| layout.up.at(value));
    svg.rectangle("panel", [left, top], [right - left, bottom - top]);
    for mark in marks(layout.across.range(), 6).0 {
        let at = layout.across.at(mark);
        svg.line("grid", [at, top], [at, bottom]);
        svg.text(
            "small",
            [at, bottom + 16.0],
            Anchor::Middle,
            &millimetres(mark),
        );
    }
    for mark in marks(layout.up.range(), 6).0 {
        let at = layout.up.at(mark);
        svg.line("grid", [left, at], [right, at]);
        svg.text(
            "small",
            [left - 8.0, at + 4.0],
            Anchor::End,
            &millimetres(mark),
        );
    }
    let middle = (left + right) / 2.0;
    svg.text(
        "small",
        [middle, bottom + 32.0],
        Anchor::Middle,
        AXES[view.across],
    );
    svg.text(
        "small",
        [right, top - 8.0],
        Anchor::End,
        &format!("up: {}", AXES[view.up]),
    );
}

fn millimetres(meters: f64) -> String {
    let rounded = (meters * 1e3).round();
    if rounded < 0.0 {
        format!("\u{2212}{}", -rounded)
    } else {
        format!("{}", rounded.abs())
    }
}

/// The path in pieces of one colour each, by speed.
fn way(svg: &mut Svg, drawing: &Drawing, view: &View, layout: &Layout) {
    let peak = peak_speed(&drawing.rows);
    let at = |row: &PlotRow| {
        [
            layout.across.at(row.point[view.across]),
            layout.up.at(row.point[view.up]),
        ]
    };
    let mut piece: Vec<[f64; 2]> = Vec::new();
    let mut piece_shade = 0;
    for pair in drawing.rows.windows(2) {
        let shade = shade(speed(&pair[0], &pair[1]), peak);
        if piece.is_empty() || shade != piece_shade {
            svg.curve("path", SPEEDS[piece_shade], &piece);
            piece.clear();
            piece.push(at(&pair[0]));
            piece_shade = shade;
        }
        // Points nearer than a fifth of a pixel (the arm waits) make no visible difference.
        let next = at(&pair[1]);
        let apart = piece
            .last()
            .is_none_or(|last| (next[0] - last[0]).hypot(next[1] - last[1]) > 0.2);
        if apart {
            piece.push(next);
        }
    }
    svg.curve("path", SPEEDS[piece_shade], &piece);
    if let Some(first) = drawing.rows.first() {
        svg.circle("start", at(first), 4.5);
    }
}

/// Mean speed of the controlled point between two rows, m/s.
fn speed(from: &PlotRow, to: &PlotRow) -> f64 {
    let squares: f64 = from
        .point
        .iter()
        .zip(&to.point)
        .map(|(a, b)| (b - a).powi(2))
        .sum();
    squares.sqrt() / (to.time - from.time).max(1e-9)
}

fn peak_speed(rows: &[PlotRow]) -> f64 {
    rows.windows(2)
        .map(|pair| speed(&pair[0], &pair[1]))
        .fold(0.0, f64::max)
}

fn shade(speed: f64, peak: f64) -> usize {
    let part = if peak > 0.0 { speed / peak } else { 0.0 };
    ((part * SPEEDS.len() as f64) as usize).min(SPEEDS.len() - 1)
}

fn targets(svg: &mut Svg, drawing: &Drawing, view: &View, layout: &Layout) {
    for target in &drawing.targets {
        let at = [
            layout.across.at(target.point[view.across]),
            layout.up.at(target.point[view.up]),
        ];
        match target.tolerance {
            Some(tolerance) => {
                let radius = tolerance * layout.pixels_per_meter;
                if radius >= 2.0 {
                    svg.circle("ball", at, radius);
                }
                svg.circle("pose", at, 1.8);
            }
            None => svg.circle("goal", at, 3.2),
        }
    }
}

/// The legend of the colours.
fn speed_legend(svg: &mut Svg, drawing: &Drawing, [x, y]: [f64; 2], width: f64) {
    let peak = peak_speed(&drawing.rows);
    let label = format!("{:.0} mm/s", peak * 1e3);
    svg.text("head", [x, y + 14.0], Anchor::Start, "way of the tool");
    svg.text("small", [x + width, y + 14.0], Anchor::End, &label);
    let right = x + width - 6.4 * label.len() as f64 - 8.0;
    let left = right - 14.0 * SPEEDS.len() as f64;
    for (index, colour) in SPEEDS.iter().enumerate() {
        let from = left + 14.0 * index as f64;
        svg.curve("path", colour, &[[from, y + 10.0], [from + 12.0, y + 10.0]]);
    }
    svg.text("small", [left - 6.0, y + 14.0], Anchor::End, "0");
}
