//! The wire of RTDE (real-time data exchange), protocol version 2: big-endian packages over TCP.
//!
//! # Source
//! Universal Robots, "Real-Time Data Exchange (RTDE) Guide".

/// What is asked for in each cycle, in this order.
pub(crate) const FIELDS: [(&str, &str); 14] = [
    ("timestamp", "DOUBLE"),
    ("actual_q", "VECTOR6D"),
    ("actual_qd", "VECTOR6D"),
    ("target_q", "VECTOR6D"),
    ("actual_TCP_force", "VECTOR6D"),
    ("speed_scaling", "DOUBLE"),
    ("target_speed_fraction", "DOUBLE"),
    ("standard_analog_input0", "DOUBLE"),
    ("standard_analog_input1", "DOUBLE"),
    ("actual_digital_input_bits", "UINT64"),
    ("actual_digital_output_bits", "UINT64"),
    ("robot_mode", "INT32"),
    ("safety_mode", "INT32"),
    ("runtime_state", "UINT32"),
];

/// The longest package that is read (bytes).
pub(crate) const LONGEST: usize = 8192;

/// Kinds of packages.
pub(crate) mod kind {
    pub(crate) const PROTOCOL: u8 = b'V';
    pub(crate) const VERSION: u8 = b'v';
    pub(crate) const OUTPUTS: u8 = b'O';
    pub(crate) const START: u8 = b'S';
    pub(crate) const DATA: u8 = b'U';
}

/// The kind of a package, its payload, and its length with the header.
pub(crate) type Package<'a> = (u8, &'a [u8], usize);

/// The version of a controller's software.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// 3 for CB3, 5 for e-Series.
    pub major: u32,
    /// The second number.
    pub minor: u32,
    /// The third number.
    pub bugfix: u32,
}

/// What the controller sends in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cycle {
    /// The controller's time since it was switched on (s).
    pub(crate) timestamp: f64,
    /// Measured joint angles (rad).
    pub(crate) actual_q: [f64; 6],
    /// Measured joint speeds (rad/s).
    pub(crate) actual_qd: [f64; 6],
    /// Commanded joint angles (rad).
    pub(crate) target_q: [f64; 6],
    /// Force (N) and torque (N m) at the tool centre point, in the base frame.
    pub(crate) force: [f64; 6],
    /// Share of the planned speed by the controller's own limits.
    pub(crate) speed_scaling: f64,
    /// Share of the planned speed by the slider on the pendant.
    pub(crate) speed_fraction: f64,
    /// Analogue inputs (V or A).
    pub(crate) analogue: [f64; 2],
    /// Digital inputs, one bit each: 8 standard, 8 configurable, 2 of the tool.
    pub(crate) inputs: u64,
    /// Digital outputs, likewise.
    pub(crate) outputs: u64,
    /// 7 is running.
    pub(crate) robot_mode: i32,
    /// 1 is normal.
    pub(crate) safety_mode: i32,
    /// 2 is playing.
    pub(crate) runtime_state: u32,
}

/// A package with its header.
pub(crate) fn package(kind: u8, payload: &[u8]) -> Vec<u8> {
    let size = (payload.len() + 3) as u16;
    let mut bytes = size.to_be_bytes().to_vec();
    bytes.push(kind);
    bytes.extend_from_slice(payload);
    bytes
}

/// The names of the fields, with commas.
pub(crate) fn names() -> String {
    FIELDS.map(|(name, _)| name).join(",")
}

/// The first package of `bytes`: its kind, its payload and its length; `None` if it is not complete.
///
/// # Errors
/// A header that cannot be one.
pub(crate) fn first(bytes: &[u8]) -> Result<Option<Package<'_>>, String> {
    let [high, low, kind, ..] = *bytes else {
        return Ok(None);
    };
    let size = usize::from(u16::from_be_bytes([high, low]));
    if !(3..=LONGEST).contains(&size) {
        return Err(format!(
            "a package of {size} bytes; expected 3 to {LONGEST}: this is no RTDE"
        ));
    }
    Ok(bytes.get(3..size).map(|payload| (kind, payload, size)))
}

/// The version in the answer to a request for it.
pub(crate) fn version(payload: &[u8]) -> Option<Version> {
    let mut reader = Reader(payload);
    Some(Version {
        major: u32::from_be_bytes(reader.take()?),
        minor: u32::from_be_bytes(reader.take()?),
        bugfix: u32::from_be_bytes(reader.take()?),
    })
}

/// The number of the recipe in the answer to a list of fields.
///
/// # Errors
/// The first field that the controller does not have, or has in another form.
pub(crate) fn recipe(payload: &[u8]) -> Result<u8, String> {
    let (number, types) = payload
        .split_first()
        .ok_or("an empty answer to the list of fields")?;
    let types = String::from_utf8_lossy(types);
    let mut found = types.split(',');
    for (name, wanted) in FIELDS {
        let found = found.next().unwrap_or("nothing").trim_end_matches('\0');
        if found != wanted {
            return Err(format!("{name} is {found}, expected {wanted}"));
        }
    }
    Ok(*number)
}

/// The fields of a data package of recipe `number`; `None` for another one or another length.
pub(crate) fn cycle(payload: &[u8], number: u8) -> Option<Cycle> {
    let (of, fields) = payload.split_first()?;
    if *of != number {
        return None;
    }
    let mut reader = Reader(fields);
    let cycle = Cycle {
        timestamp: reader.number()?,
        actual_q: reader.six()?,
        actual_qd: reader.six()?,
        target_q: reader.six()?,
        force: reader.six()?,
        speed_scaling: reader.number()?,
        speed_fraction: reader.number()?,
        analogue: [reader.number()?, reader.number()?],
        inputs: u64::from_be_bytes(reader.take()?),
        outputs: u64::from_be_bytes(reader.take()?),
        robot_mode: i32::from_be_bytes(reader.take()?),
        safety_mode: i32::from_be_bytes(reader.take()?),
        runtime_state: u32::from_be_bytes(reader.take()?),
    };
    let joints = cycle.actual_q.iter().chain(&cycle.actual_qd);
    let mut numbers = joints.chain(&cycle.target_q).chain([&cycle.timestamp]);
    (reader.0.is_empty() && numbers.all(|number| number.is_finite())).then_some(cycle)
}

/// Takes numbers from the front of bytes.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const L: usize>(&mut self) -> Option<[u8; L]> {
        let (first, rest) = self.0.split_first_chunk::<L>()?;
        self.0 = rest;
        Some(*first)
    }

    fn number(&mut self) -> Option<f64> {
        self.take().map(f64::from_be_bytes)
    }

    fn six(&mut self) -> Option<[f64; 6]> {
        let mut values = [0.0; 6];
        for value in &mut values {
            *value = self.number()?;
        }
        Some(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_cut_at_their_size() {
        let mut bytes = package(b'M', b"abc");
        bytes.extend(package(kind::START, &[1]));
        let (found, payload, length) = first(&bytes).unwrap().unwrap();
        assert_eq!((found, payload, length), (b'M', &b"abc"[..], 6));
        let (found, payload, _) = first(&bytes[length..]).unwrap().unwrap();
        assert_eq!((found, payload), (kind::START, &[1][..]));
        for end in 0..6 {
            assert_eq!(first(&bytes[..end]), Ok(None));
        }
        assert!(first(&[0, 2, 7]).is_err());
        assert!(first(&[0xff, 0xff, 7]).is_err());
    }

    #[test]
    fn a_field_that_the_controller_lacks_is_named() {
        let types = FIELDS.map(|(_, kind)| kind).join(",");
        let answer = |types: &str| [&[7], types.as_bytes()].concat();
        assert_eq!(recipe(&answer(&types)), Ok(7));
        let lacking = types.replacen("VECTOR6D", "NOT_FOUND", 1);
        let said = recipe(&answer(&lacking)).unwrap_err();
        assert_eq!(said, "actual_q is NOT_FOUND, expected VECTOR6D");
        assert!(recipe(&[]).is_err());
    }

    #[test]
    fn a_cycle_has_one_length() {
        let payload = vec![0; 1 + 8 * (1 + 24 + 4 + 2) + 12];
        assert_eq!(cycle(&payload, 0), Some(Cycle::default()));
        assert_eq!(cycle(&payload, 1), None);
        assert_eq!(cycle(&payload[..payload.len() - 1], 0), None);
        let mut wrong = payload;
        wrong[9..17].copy_from_slice(&f64::NAN.to_be_bytes());
        assert_eq!(cycle(&wrong, 0), None);
    }
}
