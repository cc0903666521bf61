//! Checks the order of a program's commands, without a robot.

use std::ops::Range;

use crate::code;
use crate::command::Command;
use crate::finding::Finding;
use crate::program::{Located, Program};
use crate::units::{CoordinateFrame, LengthUnit};

/// How a program is to be checked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CheckOptions {
    /// Make a second InitCanon, and EndCanon before InitCanon, errors. Default: warnings.
    pub strict: bool,
    /// The length unit that holds after InitCanon. Default: millimetre.
    pub default_length: LengthUnit,
}

/// Finds what is wrong with the order of commands, in the order of the program:
///
/// - commands before InitCanon or after EndCanon, a second InitCanon, a missing EndCanon;
/// - a move while speed or acceleration is zero;
/// - gripper commands without a tool, a tool change with a closed gripper;
/// - a program that was probably written in metres and is read in millimetres.
///
/// What needs a robot (reach, maximum speed) is not checked.
///
/// ```
/// use crcl::{CheckOptions, ReadOptions, check, code, text};
/// let reading = text::read("OpenGripper ()", &ReadOptions::default());
/// let findings = check(&reading.program, &CheckOptions::default());
/// assert_eq!(findings[0].code, code::NO_INIT);
/// ```
pub fn check(program: &Program, options: &CheckOptions) -> Vec<Finding> {
    if program.commands.is_empty() {
        let finding = Finding::error(code::EMPTY, 0..0, "this program has no command");
        return vec![finding.help("the shortest program is `InitCanon ()` and `EndCanon (0)`")];
    }
    let mut findings = sequence(&program.commands, options.strict);
    findings.extend(standstill(&program.commands));
    findings.extend(tools(&program.commands));
    findings.extend(metres(&program.commands, options.default_length));
    findings.sort_by_key(|finding| finding.span.start);
    findings
}

/// The phases of the machine that InitCanon and EndCanon drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Unready,
    Ready,
    Ended,
}

/// Commands in a row that come when none may.
struct Refused<'a> {
    first: &'a Located,
    count: usize,
    end: Option<Range<usize>>,
}

impl Refused<'_> {
    fn finding(self) -> Finding {
        let name = self.first.command.name();
        let others = match self.count - 1 {
            0 => String::new(),
            1 => " and 1 more command".to_owned(),
            more => format!(" and {more} more commands"),
        };
        let verb = if self.count == 1 { "comes" } else { "come" };
        let span = self.first.span.clone();
        match self.end {
            None => {
                let message = format!("{name}{others} {verb} before InitCanon");
                let finding = Finding::error(code::NO_INIT, span, message);
                finding
                    .expected("`InitCanon ()`")
                    .found(format!("`{name}`"))
                    .help("begin the program with `InitCanon ()`")
            }
            Some(end) => {
                let message = format!("{name}{others} {verb} after EndCanon");
                let finding = Finding::error(code::AFTER_END, span, message);
                finding
                    .expected("`InitCanon ()` or the end of the program")
                    .found(format!("`{name}`"))
                    .help("move EndCanon to the end, or start again with `InitCanon ()`")
                    .note(end, "the program ends here")
            }
        }
    }
}

/// Follows InitCanon and EndCanon.
fn sequence(commands: &[Located], strict: bool) -> Vec<Finding> {
    let mut findings = Vec::new();
    let (mut phase, mut began, mut end) = (Phase::Unready, None, None);
    let mut refused: Option<Refused> = None;
    for located in commands {
        match (phase, &located.command) {
            (_, Command::StopMotion { .. }) => {}
            (Phase::Ready, Command::InitCanon) => {
                findings.push(second_init(located, began.clone(), strict));
            }
            (_, Command::InitCanon) => {
                findings.extend(refused.take().map(Refused::finding));
                (phase, began) = (Phase::Ready, Some(located.span.clone()));
            }
            (Phase::Ready, Command::EndCanon { .. }) => {
                (phase, end) = (Phase::Ended, Some(located.span.clone()));
            }
            (Phase::Unready, Command::EndCanon { .. }) => {
                findings.push(nothing_to_end(located, strict));
            }
            (Phase::Ready, _) => {}
            (Phase::Unready | Phase::Ended, _) => match &mut refused {
                Some(refused) => refused.count += 1,
                None => {
                    refused = Some(Refused {
                        first: located,
                        count: 1,
                        end: end.clone(),
                    })
                }
            },
        }
    }
    findings.extend(refused.map(Refused::finding));
    if let (Phase::Ready, Some(last)) = (phase, commands.last()) {
        findings.push(missing_end(last));
    }
    findings
}

fn second_init(located: &Located, began: Option<Range<usize>>, strict: bool) -> Finding {
    let message = "InitCanon a second time, without EndCanon before it";
    let finding = judged(strict, code::SECOND_INIT, located.span.clone(), message).help(
        "it sets the units back to mm and degree; put `EndCanon (0)` before it, or delete it",
    );
    match began {
        Some(span) => finding.note(span, "the program begins here"),
        None => finding,
    }
}

fn nothing_to_end(located: &Located, strict: bool) -> Finding {
    let message = "EndCanon has nothing to end";
    judged(strict, code::NOTHING_TO_END, located.span.clone(), message)
        .expected("`InitCanon ()`")
        .found("`EndCanon`")
        .help("begin the program with `InitCanon ()`")
}

fn missing_end(last: &Located) -> Finding {
    let end = last.span.end;
    Finding::warning(code::NO_END, end..end, "the program stops without EndCanon")
        .expected("`EndCanon (0)`")
        .found("the end of the program")
        .help("end the program with `EndCanon (0)`")
}

fn judged(strict: bool, code: &'static str, span: Range<usize>, message: &str) -> Finding {
    if strict {
        Finding::error(code, span, message)
    } else {
        Finding::warning(code, span, message)
    }
}

/// Finds moves that speed or acceleration zero makes impossible; one finding per setting.
fn standstill(commands: &[Located]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let (mut speed, mut acceleration): (Option<&Located>, Option<&Located>) = (None, None);
    for located in commands {
        let zero = |value: f64| (value == 0.0).then_some(located);
        match located.command {
            Command::SetAbsoluteSpeed { value } | Command::SetRelativeSpeed { percent: value } => {
                speed = zero(value);
            }
            Command::SetAbsoluteAcceleration { value }
            | Command::SetRelativeAcceleration { percent: value } => acceleration = zero(value),
            _ if located.command.is_move() => {
                findings.extend(speed.take().map(|set| no_move(located, "speed", set)));
                let set = acceleration.take();
                findings.extend(set.map(|set| no_move(located, "acceleration", set)));
            }
            _ => {}
        }
    }
    findings
}

fn no_move(located: &Located, quantity: &str, set: &Located) -> Finding {
    let message = format!(
        "{} cannot move: the {quantity} is zero",
        located.command.name()
    );
    Finding::error(code::ZERO_SPEED, located.span.clone(), message)
        .help(format!("set the {quantity} above zero before the move"))
        .note(
            set.span.clone(),
            format!("the {quantity} is set to zero here"),
        )
}

/// Follows tool changer and gripper as far as the program determines their states.
fn tools(commands: &[Located]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let (mut released, mut closed): (Option<&Located>, Option<&Located>) = (None, None);
    for located in commands {
        match (&located.command, released) {
            (
                Command::OpenGripper | Command::CloseGripper | Command::SetEndEffector { .. },
                Some(released),
            ) => {
                findings.push(no_tool(located, released));
            }
            (Command::SetEndEffector { setting }, None) => {
                closed = (*setting == 0.0).then_some(located);
            }
            (Command::OpenGripper, None) => closed = None,
            (Command::CloseGripper, None) => closed = Some(located),
            (Command::OpenToolChanger, _) => {
                findings.extend(closed.map(|closed| still_closed(located, closed)));
                (released, closed) = (Some(located), None);
            }
            (Command::CloseToolChanger, _) => released = None,
            _ => {}
        }
    }
    findings
}

fn no_tool(located: &Located, released: &Located) -> Finding {
    let message = format!("{} while the tool changer is open", located.command.name());
    Finding::error(code::NO_TOOL, located.span.clone(), message)
        .help("take a gripper first with `CloseToolChanger ()`")
        .note(released.span.clone(), "the end effector is released here")
}

fn still_closed(located: &Located, closed: &Located) -> Finding {
    let message = "the tool changer cannot open while the gripper is closed";
    Finding::error(code::GRIPPER_CLOSED, located.span.clone(), message)
        .help("write `OpenGripper ()` before it")
        .note(closed.span.clone(), "the gripper is closed here")
}

/// Finds a program whose points are all so near to each other and to the origin that they are
/// metres rather than the default millimetres.
fn metres(commands: &[Located], default_length: LengthUnit) -> Option<Finding> {
    /// Largest spread (mm) and distance from the origin (mm) that cause the warning.
    const SPREAD: f64 = 5.0;
    const DISTANCE: f64 = 10.0;
    let moves = default_moves(commands);
    let points: Vec<_> = moves
        .iter()
        .flat_map(|m| m.command.poses())
        .map(|p| p.point())
        .collect();
    let (first, last) = (moves.first()?, moves.last()?);
    let spread = spread(&points);
    let near = points.iter().all(|point| length(point) < DISTANCE);
    let all_zero = points.iter().all(|point| length(point) == 0.0);
    if default_length != LengthUnit::Millimeter || spread >= SPREAD || !near || all_zero {
        return None;
    }
    let message = match points.len() {
        1 => format!(
            "the only pose is {:.3} mm from the origin",
            length(&points[0])
        ),
        count => format!("all {count} poses lie within {spread:.3} mm of each other"),
    };
    let help = "if the program is in metres, write `SetLengthUnits (\"meter\")` after InitCanon, \
                or read it with metre as the default length unit";
    let finding = Finding::warning(code::LOOKS_LIKE_METRES, first.span.clone(), message)
        .expected("moves of more than 5 mm")
        .help(help);
    Some(match moves.len() {
        1 => finding,
        _ => finding.note(last.span.clone(), "the last of these moves"),
    })
}

/// The moves in workstation coordinates while the length unit is the default one.
fn default_moves(commands: &[Located]) -> Vec<&Located> {
    let (mut default_unit, mut workstation) = (true, true);
    let mut moves = Vec::new();
    for located in commands {
        match located.command {
            Command::InitCanon => (default_unit, workstation) = (true, true),
            Command::SetLengthUnits { .. } => default_unit = false,
            Command::SetCoordinateFrame { frame } => {
                workstation = frame == CoordinateFrame::Workstation;
            }
            _ if default_unit && workstation && !located.command.poses().is_empty() => {
                moves.push(located);
            }
            _ => {}
        }
    }
    moves
}

/// Diagonal of the smallest box with edges along the axes that holds all points.
fn spread(points: &[[f64; 3]]) -> f64 {
    let side = |axis: usize| {
        let values = || points.iter().map(move |point| point[axis]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    length(&[side(0), side(1), side(2)])
}

fn length(vector: &[f64; 3]) -> f64 {
    vector
        .iter()
        .map(|number| number * number)
        .sum::<f64>()
        .sqrt()
}
