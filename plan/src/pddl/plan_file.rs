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

/// Reads a plan file: one action per line, `(name object ...)`; temporal planners add a time before
/// it and a duration after it; `;` starts a comment.
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

/// A line of a plan file while it is read from left to right.
struct Line<'a> {
    source: &'a str,
    /// Where it begins in the source, bytes.
    start: usize,
    text: &'a str,
    words: std::vec::IntoIter<(&'a str, usize)>,
}

fn read_line(
    source: &str,
    start: usize,
    text: &str,
    number: usize,
) -> Result<Option<PlanStep>, PddlError> {
    let words = words(text).collect::<Vec<_>>().into_iter();
    let mut line = Line {
        source,
        start,
        text,
        words,
    };
    let Some((_, at)) = line.peek() else {
        return Ok(None);
    };
    let time = line.time()?;
    let (name, objects) = line.action()?;
    if name.is_empty() {
        return Err(line.fail(at, "an action without a name".into()));
    }
    Ok(Some(PlanStep {
        name,
        objects,
        start: time,
        duration: line.duration()?,
        line: number,
    }))
}

impl<'a> Line<'a> {
    fn fail(&self, at: usize, message: String) -> PddlError {
        PddlError::new(self.source, self.start + at, message)
    }

    fn peek(&self) -> Option<(&'a str, usize)> {
        self.words.as_slice().first().copied()
    }

    /// The time before the action, if there is one.
    fn time(&mut self) -> Result<Option<f64>, PddlError> {
        let Some((first, at)) = self.peek().filter(|(first, _)| *first != "(") else {
            return Ok(None);
        };
        self.words.next();
        let time = first.strip_suffix(':').unwrap_or(first).parse::<f64>();
        let time = time.ok().filter(|time| time.is_finite());
        let goes_on = self
            .peek()
            .is_some_and(|(next, _)| next == "(" || next == ":");
        if time.is_none() || !goes_on {
            let message = format!("expected \"(\" or a time, found {first:?}");
            return Err(self.fail(at, message));
        }
        if self.peek().is_some_and(|(next, _)| next == ":") {
            self.words.next();
        }
        Ok(time)
    }

    /// Name and objects, in lower case.
    fn action(&mut self) -> Result<(String, Vec<String>), PddlError> {
        let (mut name, mut objects) = (String::new(), Vec::new());
        match self.words.next() {
            Some(("(", _)) => {}
            other => {
                let at = other.map_or(self.text.len(), |(_, at)| at);
                return Err(self.fail(at, "expected \"(\"".into()));
            }
        }
        loop {
            match self.words.next() {
                Some((")", _)) => return Ok((name, objects)),
                Some(("(", at)) => return Err(self.fail(at, "unexpected \"(\"".into())),
                Some((word, _)) if name.is_empty() => name = word.to_lowercase(),
                Some((word, _)) => objects.push(word.to_lowercase()),
                None => {
                    let end = self.text.trim_end().len();
                    return Err(self.fail(end, "expected \")\"".into()));
                }
            }
        }
    }

    /// The duration in brackets after the action, if there is one.
    fn duration(&mut self) -> Result<Option<f64>, PddlError> {
        let Some((_, at)) = self.peek() else {
            return Ok(None);
        };
        let text: String = self.words.by_ref().map(|(word, _)| word).collect();
        let inner = text
            .strip_prefix('[')
            .and_then(|text| text.strip_suffix(']'));
        let duration = inner.and_then(|text| text.parse::<f64>().ok());
        let duration = duration.filter(|time| time.is_finite());
        if duration.is_none() {
            let message = format!("expected a duration such as [0.5], found {text:?}");
            return Err(self.fail(at, message));
        }
        Ok(duration)
    }
}
