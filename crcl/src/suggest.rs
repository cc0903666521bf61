//! Finds the known name that is most similar to an unknown one.

/// Longer names than this are never a misspelt one of ours.
const LONGEST: usize = 48;

/// Commands of later dialects and what says the same here.
const ELSEWHERE: &[(&str, &str)] = &[
    (
        "SetTransSpeed",
        "here it is SetAbsoluteSpeed or SetRelativeSpeed",
    ),
    (
        "SetTransAccel",
        "here it is SetAbsoluteAcceleration or SetRelativeAcceleration",
    ),
    (
        "SetEndPoseTolerance",
        "here it is SetEndPointTolerance and SetEndAngleTolerance",
    ),
    (
        "SetIntermediatePoseTolerance",
        "here it is SetIntermediatePointTolerance",
    ),
    ("SetEndEffector", "here it is OpenGripper and CloseGripper"),
    (
        "StartObjectScan",
        "scanning for objects is not part of the language here",
    ),
    (
        "StopObjectScan",
        "scanning for objects is not part of the language here",
    ),
    ("ActuateJoints", "the language does not move single joints"),
    ("MoveScrew", "screw moves are not part of the language"),
    (
        "SetRotSpeed",
        "rotation follows the speed of the controlled point",
    ),
    (
        "SetRotAccel",
        "rotation follows the acceleration of the controlled point",
    ),
];

/// What to tell about a name that is none of `names`, if there is something worth telling.
pub(crate) fn advice(name: &str, names: &[&'static str]) -> Option<String> {
    if let Some(same) = names.iter().find(|known| known.eq_ignore_ascii_case(name)) {
        return Some(format!("did you mean `{same}`? Capital letters matter"));
    }
    if let Some((_, advice)) = ELSEWHERE.iter().find(|(known, _)| *known == name) {
        return Some((*advice).to_owned());
    }
    nearest(name, names).map(|near| format!("did you mean `{near}`?"))
}

/// The nearest of the names, when it is near enough to be meant.
pub(crate) fn nearest(name: &str, names: &[&'static str]) -> Option<&'static str> {
    if name.chars().count() > LONGEST {
        return None;
    }
    let lower = name.to_lowercase();
    let distances = names
        .iter()
        .map(|&known| (distance(&lower, &known.to_lowercase()), known));
    let (steps, known) = distances.min_by_key(|&(steps, _)| steps)?;
    (steps * 3 <= known.chars().count().max(3)).then_some(known)
}

/// Fewest single-letter changes, where swapping two neighbours counts as one.
///
/// # Source
/// F. J. Damerau, "A technique for computer detection and correction of spelling errors",
/// Comm. ACM 7(3), 1964; the restricted form, in which no part is edited twice.
fn distance(from: &str, to: &str) -> usize {
    let (from, to): (Vec<char>, Vec<char>) = (from.chars().collect(), to.chars().collect());
    let mut before_last = vec![0; to.len() + 1];
    let mut last: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.iter().enumerate() {
        let mut row = vec![i + 1; to.len() + 1];
        for (j, b) in to.iter().enumerate() {
            let replaced = last[j] + usize::from(a != b);
            row[j + 1] = replaced.min(row[j] + 1).min(last[j + 1] + 1);
            let swapped = i > 0 && j > 0 && *a == to[j - 1] && from[i - 1] == *b;
            if swapped {
                row[j + 1] = row[j + 1].min(before_last[j - 1] + 1);
            }
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_the_textbook_ones() {
        for (from, to, steps) in [
            ("", "", 0),
            ("a", "", 1),
            ("kitten", "sitting", 3),
            ("Dwlel", "Dwell", 1),
            ("ab", "ba", 1),
        ] {
            assert_eq!(distance(from, to), steps, "{from} -> {to}");
            assert_eq!(distance(to, from), steps, "{to} -> {from}");
        }
    }

    #[test]
    fn far_names_are_not_suggested() {
        let names = ["Dwell", "MoveTo"];
        assert_eq!(nearest("Dwel", &names), Some("Dwell"));
        assert_eq!(nearest("Rotate", &names), None);
        assert_eq!(nearest(&"x".repeat(1000), &names), None);
    }
}
