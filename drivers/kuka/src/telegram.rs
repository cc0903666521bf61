//! The telegrams of RSI: XML of a form that is fixed by the controller's configuration.

use core::fmt::Write as _;

use crate::JOINTS;

/// What the controller sends in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Telegram {
    /// Measured joint angles (rad).
    pub angles: [f64; JOINTS],
    /// Late answers in a row, by the controller's count.
    pub late: u32,
    /// The controller's time stamp, which the answer repeats.
    pub ipoc: u64,
}

/// Reads a telegram of the controller; `None` if it is none.
///
/// ```
/// let text = "<Rob Type=\"KUKA\"><AIPos A1=\"90\" A2=\"0\" A3=\"0\" A4=\"0\" A5=\"0\" A6=\"-90\"/>\
///             <Delay D=\"2\"/><IPOC>4208163634</IPOC></Rob>";
/// let telegram = driver_kuka::read(text).expect("a telegram");
/// assert!((telegram.angles[0] - core::f64::consts::FRAC_PI_2).abs() < 1e-12);
/// assert_eq!((telegram.late, telegram.ipoc), (2, 4_208_163_634));
/// ```
pub fn read(text: &str) -> Option<Telegram> {
    let joints = element(text, "AIPos")?;
    let mut telegram = Telegram::default();
    for (joint, angle) in telegram.angles.iter_mut().enumerate() {
        let degrees: f64 = attribute(joints, &format!("A{}", joint + 1))?
            .parse()
            .ok()?;
        if !degrees.is_finite() {
            return None;
        }
        *angle = degrees.to_radians();
    }
    if let Some(delay) = element(text, "Delay") {
        telegram.late = attribute(delay, "D")?.parse().ok()?;
    }
    let from = text.find("<IPOC>")? + "<IPOC>".len();
    let rest = text.get(from..)?;
    telegram.ipoc = rest.get(..rest.find('<')?)?.trim().parse().ok()?;
    Some(telegram)
}

/// Writes the answer: the corrections of the joints (rad) against where RSI was switched on, and the
/// telegram's own time stamp.
pub fn answer(into: &mut String, corrections: &[f64; JOINTS], ipoc: u64) {
    into.clear();
    into.push_str("<Sen Type=\"CANTER\"><AKorr");
    for (joint, correction) in corrections.iter().enumerate() {
        // Writing to a text cannot fail.
        let _ = write!(into, " A{}=\"{:.9}\"", joint + 1, correction.to_degrees());
    }
    let _ = write!(into, "/><IPOC>{ipoc}</IPOC></Sen>");
}

/// The text of the first element `name`, up to its end.
fn element<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let from = text.match_indices('<').find_map(|(at, _)| {
        let rest = text.get(at + 1..)?.strip_prefix(name)?;
        rest.starts_with([' ', '/', '\t', '\n', '\r'])
            .then_some(rest)
    })?;
    from.get(..from.find('>')?)
}

/// The value of an attribute of an element.
fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let key = format!("{name}=\"");
    let at = element.match_indices(&key).find_map(|(at, _)| {
        let before = element.get(..at)?.chars().next_back()?;
        before.is_whitespace().then_some(at + key.len())
    })?;
    let rest = element.get(at..)?;
    rest.get(..rest.find('"')?)
}
