//! The XML form of programs, and the documents that go over a CRCL connection.
//!
//! Written documents are valid against NIST's schema of 28 April 2021; documents of all versions
//! from 2 July 2014 on are read. Numbers are raw: the units in force when a command is executed
//! give them their meaning.
//!
//! # Source
//! NIST, CRCL schemas, versions 2014Jul2 to 2021Apr28.

mod command;
mod data;
mod document;
mod elements;
mod form;
mod guard;
mod meaning;
mod out;
mod own_settings;
mod read_command;
mod read_data;
mod read_status;
mod refusal;
mod status;
mod write;
mod write_status;

pub use crate::guard::GuardLimit;
pub use command::{
    ActuateJoint, COMMAND_NAMES, Instruction, JointDetails, JointReport, MoveScrew, StatusParts,
    StopCondition, XmlCommand,
};
pub use data::{Guard, JointTolerance, Parameter, PoseSettings, PoseTolerance, Quantity, Waypoint};
pub use document::{Instance, read_instance, read_instructions, read_status};
pub use meaning::Meaning;
pub use refusal::Refusal;
pub use status::{
    CommandState, CommandStatus, GripperState, GripperStatus, GuardsStatus, JointLimits,
    JointStatus, PoseStatus, ProgramPlace, SensorStatus, SensorValue, SettingsStatus, Status,
};
pub use write::{write, write_instance, write_instructions};
pub use write_status::write_status;

use std::ops::Range;

use roxmltree::Node;

use crate::code;
use crate::command::Command;
use crate::command_finding::{refused_extension, value_finding};
use crate::finding::{Finding, Findings};
use crate::lexer::clip;
use crate::program::{Located, Program, ReadOptions, Reading};
use crate::source::Walker;
use crate::text;
use crate::units::{ForceUnit, TorqueUnit};
use elements::{Reader, opening};

/// How many commands the blocks of a program may come to.
const LONGEST: usize = 1_000_000;

/// Reads a program in XML form: every command that can be read, and every fault. XML that is not
/// well formed gives one finding and no command. A document with a single command is a program of
/// one command. Blocks that are repeated are written out.
///
/// ```
/// use crcl::{Command, ReadOptions, xml};
/// let source = r#"<CRCLProgram xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
///     <InitCanon><CommandID>1</CommandID></InitCanon>
///     <MiddleCommand xsi:type="DwellType"><CommandID>2</CommandID><DwellTime>0.5</DwellTime>
///     </MiddleCommand>
///     <EndCanon><CommandID>3</CommandID></EndCanon></CRCLProgram>"#;
/// let reading = xml::read(source, &ReadOptions::default());
/// assert_eq!(reading.findings, []);
/// assert_eq!(reading.program.commands[1].command, Command::Dwell { seconds: 0.5 });
/// ```
pub fn read(source: &str, options: &ReadOptions) -> Reading {
    let mut findings = Findings::new(options.max_findings);
    let roots = ["CRCLProgram", "CRCLCommandInstance"];
    let program = document::with_root(source, &roots, &mut findings, |reader, root| {
        let nodes = reader.program_nodes(root)?;
        let mut blocks = Blocks {
            strict: options.strict,
            ..Blocks::default()
        };
        let mut walker = Walker::new(source);
        for (node, kind) in nodes {
            let place = place(node, &mut walker);
            let before = reader.findings.total();
            if let Some(instruction) = reader.instruction(node, kind) {
                blocks.take(reader, (node, before), &instruction, &place);
            }
        }
        Some(blocks.finish(reader, root))
    });
    findings.into_reading(program.unwrap_or_default())
}

/// Reads a program in XML form from the bytes of a file, which may be anything.
///
/// Bytes that are not UTF-8 text give one finding; [`crate::Source::from_bytes`] fits its span.
pub fn read_bytes(bytes: &[u8], options: &ReadOptions) -> Reading {
    text::decoded(bytes, options, read)
}

/// Whether a file is XML, by its first character.
pub fn looks_like_xml(bytes: &[u8]) -> bool {
    let body = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    body.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'<')
}

/// Where a command stands.
struct Place {
    span: Range<usize>,
    line: usize,
    column: usize,
}

fn place(node: Node, walker: &mut Walker) -> Place {
    let span = node.range();
    let (line, column) = walker.position(span.start);
    Place { span, line, column }
}

/// The commands so far, and the blocks that are open.
#[derive(Default)]
struct Blocks {
    program: Program,
    /// Refuse what is not of the standard language.
    strict: bool,
    /// Name of the block, where it begins in the program, where in the source.
    open: Vec<(String, usize, Range<usize>)>,
    /// Whether the limit was passed; said once.
    full: bool,
    /// The units that limits of guards are in.
    force: ForceUnit,
    torque: TorqueUnit,
}

impl Blocks {
    /// Takes a command; `before` is how many findings there were before it was read.
    fn take(
        &mut self,
        reader: &mut Reader,
        (node, before): (Node, usize),
        instruction: &Instruction,
        place: &Place,
    ) {
        match instruction.command {
            XmlCommand::SetForceUnits(unit) => self.force = unit,
            XmlCommand::SetTorqueUnits(unit) => self.torque = unit,
            _ => {}
        }
        match instruction.in_si(self.force, self.torque).meaning() {
            Ok(Meaning::Commands(commands)) => {
                for command in commands {
                    if let Some(info) = command.info().filter(|_| self.strict)
                        && let Some(finding) = refused_extension(info, opening(node))
                    {
                        reader.findings.push(finding);
                        continue;
                    }
                    if let Err(error) = command.check()
                        && reader.findings.total() == before
                        && command.poses().is_empty()
                    {
                        let finding = value_finding(&error, opening(node));
                        reader.findings.push(finding);
                    }
                    self.push(command, place);
                }
            }
            Ok(Meaning::NoEffect(why)) => {
                let name = instruction.command.name();
                let message = format!("{name} does nothing in a program: {why}");
                let finding = Finding::warning(code::NO_EFFECT, opening(node), message);
                reader.findings.push(finding);
            }
            Ok(Meaning::LoopStart(name)) => {
                let begins = self.program.commands.len();
                self.open.push((name, begins, opening(node)));
            }
            Ok(Meaning::LoopEnd { name, count }) => self.repeat(reader, node, &name, count),
            Err(refusal) => reader.findings.push(refused(node, &refusal)),
        }
    }

    fn push(&mut self, command: Command, place: &Place) {
        self.program.commands.push(Located {
            command,
            span: place.span.clone(),
            line: place.line,
            column: place.column,
        });
    }

    fn repeat(&mut self, reader: &mut Reader, node: Node, name: &str, count: i32) {
        let Some((begun, start, _)) = self.open.pop() else {
            let message = format!("the block `{}` ends, but does not begin", clip(name));
            let finding = Finding::error(code::LOOP, opening(node), message);
            reader
                .findings
                .push(finding.expected("LoopBlockStart before it"));
            return;
        };
        if begun != name || count < 0 {
            let (message, expected) = if begun == name {
                let message = format!("a block is repeated 0 or more times, not {count}");
                (message, "a number not below 0".to_owned())
            } else {
                let message = format!("the block `{}` ends inside `{}`", clip(name), clip(&begun));
                (message, format!("the end of `{}`", clip(&begun)))
            };
            let finding = Finding::error(code::LOOP, opening(node), message);
            reader.findings.push(finding.expected(expected));
            return;
        }
        let block = self.program.commands.split_off(start);
        let times = usize::try_from(count).unwrap_or(0);
        let length = block.len().saturating_mul(times).saturating_add(start);
        if length > LONGEST {
            self.program.commands.extend(block);
            if !std::mem::replace(&mut self.full, true) {
                let message = format!("the blocks come to {length} commands");
                let finding = Finding::error(code::TOO_LARGE, opening(node), message)
                    .expected(format!("at most {LONGEST} commands"));
                reader.findings.push(finding);
            }
            return;
        }
        for _ in 0..times {
            self.program.commands.extend(block.iter().cloned());
        }
    }

    fn finish(self, reader: &mut Reader, root: Node) -> Program {
        for (name, _, span) in &self.open {
            let message = format!("the block `{}` does not end", clip(name));
            let end = root.range().end;
            let finding = Finding::error(code::LOOP, span.clone(), message)
                .expected("LoopBlockEnd")
                .note(end..end, "the program ends here");
            reader.findings.push(finding);
        }
        self.program
    }
}

/// The finding for a command that cannot be executed.
fn refused(node: Node, refusal: &Refusal) -> Finding {
    let element = node
        .descendants()
        .filter(|inner| inner.has_tag_name(refusal.element))
        .nth(refusal.occurrence)
        .unwrap_or(node);
    let message = format!("Canter cannot do this yet: {}", refusal.message);
    let finding = Finding::error(code::UNSUPPORTED, opening(element), message)
        .found(format!("`{}`", element.tag_name().name()));
    match refusal.help {
        Some(help) => finding.help(help),
        None => finding.help("docs/crcl.md has the table of what is supported"),
    }
}
