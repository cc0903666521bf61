//! What values look like, for messages.

use crate::call::{Node, Tree};
use crate::lexer::clip;

/// What a value looks like from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Braces with numbers only.
    Vector,
    /// Braces with vectors, or a call of Pose.
    Pose,
    /// Braces with poses.
    Poses(usize),
    /// Anything else.
    Other,
}

/// The shape of a value.
pub(crate) fn shape(node: &Node, source: &str) -> Shape {
    let is_number = |node: &Node| matches!(node.value, Tree::Number { .. } | Tree::Faulty);
    match &node.value {
        Tree::Call { name, .. } if source.get(name.clone()) == Some("Pose") => Shape::Pose,
        Tree::Braces(items) => match items.first() {
            None => Shape::Other,
            Some(first) if is_number(first) && items.iter().all(is_number) => Shape::Vector,
            Some(first) => match shape(first, source) {
                Shape::Vector => Shape::Pose,
                Shape::Pose => Shape::Poses(items.len()),
                _ => Shape::Other,
            },
        },
        _ => Shape::Other,
    }
}

/// A description of a value, for "found".
pub(crate) fn describe(node: &Node, source: &str) -> String {
    let written = || clip(source.get(node.span.clone()).unwrap_or_default());
    match (&node.value, shape(node, source)) {
        (Tree::Number { .. }, _) => format!("the number `{}`", written()),
        (Tree::Text(text), _) => format!("the text \"{}\"", clip(text)),
        (Tree::Word, _) => format!("the word `{}`", written()),
        (Tree::Call { name, .. }, _) => {
            format!(
                "a call of `{}`",
                clip(source.get(name.clone()).unwrap_or_default())
            )
        }
        (_, Shape::Poses(count)) => plural(count, "a list of", "pose"),
        (Tree::Braces(items), Shape::Vector) => plural(items.len(), "braces with", "number"),
        (Tree::Braces(items), _) => plural(items.len(), "braces with", "part"),
        (Tree::Faulty, _) => "a faulty value".to_owned(),
    }
}

fn plural(count: usize, before: &str, noun: &str) -> String {
    format!(
        "{before} {count} {noun}{}",
        if count == 1 { "" } else { "s" }
    )
}

/// So many arguments, in words.
pub(crate) fn arguments(count: usize) -> String {
    match count {
        0 => "no argument".to_owned(),
        1 => "1 argument".to_owned(),
        _ => format!("{count} arguments"),
    }
}
