//! Plan files: what planners write.

use super::sexpr::{PddlError, words};

/// One action of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanStep {
    /// Name of the action, in small letters.
    pub name: String,
    /// Its objects, in small letters.
    pub objects: Vec<String>,
    /// When it starts (s), where the plan says so.
    pub start: Option<f64>,
    /// How long it takes (s), where the plan says so.
    pub duration: Option<f64>,
    /// Line of the file, from 1.
    pub line: usize,
}

impl std::fmt::Display for PlanStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name)?;
        self.objects
            .iter()
            .try_for_each(|object| write!(f, " {object}"))
    }
}

/// Reads a plan file: one action a line, `(name object ...)`, with a time before and a duration
/// after it where the planner is temporal; `;` starts a comment.
///
/// # Errors
/// [`PddlError`] with line and column.
///
/// ```
/// let steps = plan::pddl::read_plan("0.002: (Take-Part robot_1 part_a)  [0.001] ; first\n")?;
/// assert_eq!(steps[0].to_string(), "take-part robot_1 part_a");
/// assert_eq!((steps[0].start, steps[0].duration), (Some(0.002), Some(0.001)));
/// # Ok::<(), plan::pddl::PddlError>(())
/// ```
pub fn read_plan(source: &str) -> Result<Vec<PlanStep>, PddlError> {
    let mut steps = Vec::new();
    let mut start = 0;
    for (index, line) in source.split_inclusive('\n').enumerate() {
        if let Some(step) = read_line(source, start, line, index + 1)? {
            steps.push(step);
        }
        start += line.len();
    }
    Ok(steps)
}

#[allow(
    clippy::too_many_lines,
    reason = "one line of a plan, read from left to right"
)]
fn read_line(
    source: &str,
    start: usize,
    line: &str,
    number: usize,
) -> Result<Option<PlanStep>, PddlError> {
    let fail = |at: usize, message: String| PddlError::new(source, start + at, message);
    let mut tokens = words(line).peekable();
    let Some(&(first, at)) = tokens.peek() else {
        return Ok(None);
    };
    let mut step = PlanStep {
        name: String::new(),
        objects: Vec::new(),
        start: None,
        duration: None,
        line: number,
    };
    if first != "(" {
        tokens.next();
        let time = first.strip_suffix(':').unwrap_or(first).parse::<f64>();
        let time = time.ok().filter(|time| time.is_finite());
        if time.is_none()
            || tokens
                .peek()
                .is_none_or(|(next, _)| *next != "(" && *next != ":")
        {
            return Err(fail(
                at,
                format!("expected \"(\" or a time, found {first:?}"),
            ));
        }
        step.start = time;
        tokens.next_if(|(next, _)| *next == ":");
    }
    match tokens.next() {
        Some(("(", _)) => {}
        other => {
            return Err(fail(
                other.map_or(line.len(), |(_, at)| at),
                "expected \"(\"".into(),
            ));
        }
    }
    loop {
        match tokens.next() {
            Some((")", _)) => break,
            Some(("(", at)) => return Err(fail(at, "unexpected \"(\"".into())),
            Some((word, _)) if step.name.is_empty() => step.name = word.to_lowercase(),
            Some((word, _)) => step.objects.push(word.to_lowercase()),
            None => return Err(fail(line.trim_end().len(), "expected \")\"".into())),
        }
    }
    if step.name.is_empty() {
        return Err(fail(at, "an action without a name".into()));
    }
    let rest: Vec<(&str, usize)> = tokens.collect();
    if let Some((_, at)) = rest.first() {
        let text: String = rest.iter().map(|(word, _)| *word).collect();
        let duration = text
            .strip_prefix('[')
            .and_then(|text| text.strip_suffix(']'));
        let duration = duration.and_then(|text| text.parse::<f64>().ok());
        step.duration = Some(duration.filter(|time| time.is_finite()).ok_or_else(|| {
            fail(
                *at,
                format!("expected a duration such as [0.5], found {text:?}"),
            )
        })?);
    }
    Ok(Some(step))
}
