//! The documents of CRCL's XML: programs, single commands, status.

use roxmltree::{Error, Node, ParsingOptions};

use super::command::Instruction;
use super::elements::{Reader, opening};
use super::status::{ProgramPlace, Status};
use crate::code;
use crate::finding::{Finding, Findings};
use crate::lexer::clip;

/// Elements, texts and comments of one document that are read at most.
const NODES: u32 = 20_000_000;

/// How many findings are kept about a document that is not a program.
const FINDINGS: usize = 20;

/// A document with a single command.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Name of the document.
    pub name: Option<String>,
    /// The command.
    pub instruction: Instruction,
    /// Where the command comes from.
    pub place: ProgramPlace,
}

impl Instance {
    /// A document with that command and nothing else.
    pub fn new(instruction: Instruction) -> Self {
        Self {
            name: None,
            instruction,
            place: ProgramPlace::default(),
        }
    }
}

/// Reads a document with a single command.
///
/// ```
/// let source = r#"<CRCLCommandInstance><CRCLCommand xsi:type="DwellType"
///     xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"><CommandID>7</CommandID>
///     <DwellTime>0.5</DwellTime></CRCLCommand></CRCLCommandInstance>"#;
/// let instance = crcl::xml::read_instance(source).unwrap();
/// assert_eq!(instance.instruction.id, 7);
/// assert_eq!(instance.instruction.command, crcl::xml::XmlCommand::Dwell(0.5));
/// ```
///
/// # Errors
/// Everything that is wrong with the document; at least one finding.
pub fn read_instance(source: &str) -> Result<Instance, Vec<Finding>> {
    read_one(source, "CRCLCommandInstance", |reader, root| {
        reader.instance(root)
    })
}

/// Reads a status document.
///
/// # Errors
/// Everything that is wrong with the document; at least one finding.
pub fn read_status(source: &str) -> Result<Status, Vec<Finding>> {
    read_one(source, "CRCLStatus", |reader, root| reader.status(root))
}

/// Reads the commands of a program as they are written. [`crate::xml::read`] gives the commands
/// of the language instead.
///
/// # Errors
/// Everything that is wrong with the document; at least one finding.
pub fn read_instructions(source: &str) -> Result<Vec<Instruction>, Vec<Finding>> {
    read_one(source, "CRCLProgram", |reader, root| {
        let nodes = reader.program_nodes(root)?;
        let read: Vec<_> = nodes
            .into_iter()
            .map(|(node, kind)| reader.instruction(node, kind))
            .collect();
        read.into_iter().collect()
    })
}

fn read_one<T>(
    source: &str,
    root: &str,
    read: impl FnOnce(&mut Reader, Node) -> Option<T>,
) -> Result<T, Vec<Finding>> {
    let mut findings = Findings::new(FINDINGS);
    let value = with_root(source, &[root], &mut findings, |reader, node| {
        read(reader, node)
    });
    match value {
        Some(value) if findings.total() == 0 => Ok(value),
        _ => Err(findings.kept),
    }
}

/// Gives the root element to `read` if it is one of `roots`; otherwise says what is wrong.
pub(super) fn with_root<T>(
    source: &str,
    roots: &[&str],
    findings: &mut Findings,
    read: impl FnOnce(&mut Reader, Node) -> Option<T>,
) -> Option<T> {
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: NODES,
        ..ParsingOptions::default()
    };
    let document = match roxmltree::Document::parse_with_options(source, options) {
        Ok(document) => document,
        Err(error) => {
            findings.push(syntax(source, &error));
            return None;
        }
    };
    let node = document.root_element();
    let name = node.tag_name();
    if name.namespace().is_some() || !roots.contains(&name.name()) {
        findings.push(wrong_root(node, roots));
        return None;
    }
    read(&mut Reader { findings }, node)
}

fn wrong_root(node: Node, roots: &[&str]) -> Finding {
    let name = node.tag_name();
    let found = clip(name.name());
    let expected: Vec<_> = roots.iter().map(|root| format!("`{root}`")).collect();
    let expected = expected.join(" or ");
    let finding = |message: String| {
        Finding::error(code::XML_ROOT, opening(node), message).expected(expected.clone())
    };
    if let Some(space) = name.namespace() {
        let message = format!("CRCL has no namespace, but `{found}` is of {}", clip(space));
        return finding(message).help("delete the attribute `xmlns`");
    }
    finding(format!("this document is a `{found}`")).found(format!("`{found}`"))
}

/// The finding for text that is not XML.
fn syntax(source: &str, error: &Error) -> Finding {
    let place = error.pos();
    let full = error.to_string();
    let at_end = format!(" at {}:{}", place.row, place.col);
    let message = full.replace(&at_end, "");
    let lines = source.split_inclusive('\n');
    let start: usize = lines
        .take((place.row as usize).saturating_sub(1))
        .map(str::len)
        .sum();
    let rest = source.get(start..).unwrap_or_default();
    let column = (place.col as usize).saturating_sub(1);
    let at = start
        + rest
            .char_indices()
            .nth(column)
            .map_or(rest.len(), |(at, _)| at);
    let length = source
        .get(at..)
        .and_then(|rest| rest.chars().next())
        .map_or(0, char::len_utf8);
    let finding = Finding::error(
        code::XML_SYNTAX,
        at..at + length,
        format!("not XML: {message}"),
    );
    match error {
        Error::DtdDetected => finding.help("delete the DOCTYPE; entities are not read"),
        Error::UnexpectedEndOfStream | Error::UnclosedRootNode => {
            finding.help("an element or a quote is not closed")
        }
        _ => finding,
    }
}

impl Reader<'_> {
    /// A document with a single command.
    fn instance(&mut self, root: Node) -> Option<Instance> {
        let (name, mut children) = self.children(root);
        let command = children.wanted(self, "CRCLCommand")?;
        let instruction = self.instruction(command, None);
        let place = self.program_place(&mut children);
        children.end(self)?;
        Some(Instance {
            name,
            instruction: instruction?,
            place: place?,
        })
    }

    /// The elements of a program that are commands, with the kind of those whose name tells it.
    pub(super) fn program_nodes<'a, 'd>(
        &mut self,
        root: Node<'a, 'd>,
    ) -> Option<Vec<(Node<'a, 'd>, Option<&'static str>)>> {
        let (_, mut children) = self.children(root);
        if root.has_tag_name("CRCLCommandInstance") {
            let command = children.wanted(self, "CRCLCommand")?;
            return Some(vec![(command, None)]);
        }
        let first = children.wanted(self, "InitCanon")?;
        let middle = children.many("MiddleCommand");
        let last = children.wanted(self, "EndCanon");
        let mut nodes = vec![(first, Some("InitCanon"))];
        nodes.extend(middle.into_iter().map(|node| (node, None)));
        nodes.extend(last.map(|node| (node, Some("EndCanon"))));
        if last.is_some() {
            children.end(self);
        }
        Some(nodes)
    }
}
