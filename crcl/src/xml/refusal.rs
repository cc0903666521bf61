//! Why a command cannot be executed.

/// Why a command of XML cannot be executed, and which element says it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Name of the element.
    pub element: &'static str,
    /// Which of the elements of that name in the command, from 0.
    pub occurrence: usize,
    /// What cannot be done.
    pub message: String,
    /// What to do instead.
    pub help: Option<&'static str>,
}

/// A refusal of the first element of that name.
pub(super) fn refusal(element: &'static str, message: impl Into<String>) -> Refusal {
    Refusal {
        element,
        occurrence: 0,
        message: message.into(),
        help: None,
    }
}
