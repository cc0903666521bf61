//! The process data of one drive: where its objects are, and their values.

/// The objects that we ask for: index, subindex and length in bits, as a mapping entry.
pub(crate) const OUTPUTS: [u32; 3] = [0x6040_0010, 0x607A_0020, 0x6060_0008];
pub(crate) const INPUTS: [u32; 5] = [
    0x6041_0010,
    0x6064_0020,
    0x6061_0008,
    0x6077_0010,
    0x603F_0010,
];

/// The mode of operation: cyclic synchronous position.
pub(crate) const POSITION_MODE: i8 = 8;

/// Where the objects are (bytes from the beginning of the drive's data).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) control: usize,
    pub(crate) target: usize,
    pub(crate) mode: Option<usize>,
    pub(crate) status: usize,
    pub(crate) position: usize,
    pub(crate) mode_now: Option<usize>,
    pub(crate) torque: Option<usize>,
    pub(crate) error: Option<usize>,
}

/// What a drive says in a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Said {
    /// Statusword.
    pub(crate) status: u16,
    /// Position (counts).
    pub(crate) position: i32,
    /// Mode of operation; none where it is not mapped.
    pub(crate) mode: Option<i8>,
    /// Torque (thousandths of the rated torque).
    pub(crate) torque: i16,
    /// Error code (0x603F); 0 where it is not mapped.
    pub(crate) error: u16,
}

impl Layout {
    /// From the mapping entries of both directions.
    ///
    /// # Errors
    /// The object that is missing, or does not begin at a whole byte.
    pub(crate) fn find(outputs: &[u32], inputs: &[u32]) -> Result<Self, &'static str> {
        let need = |entries, entry, name| place(entries, entry).ok_or(name);
        Ok(Self {
            control: need(outputs, OUTPUTS[0], "controlword 0x6040")?,
            target: need(outputs, OUTPUTS[1], "target position 0x607A")?,
            mode: place(outputs, OUTPUTS[2]),
            status: need(inputs, INPUTS[0], "statusword 0x6041")?,
            position: need(inputs, INPUTS[1], "position 0x6064")?,
            mode_now: place(inputs, INPUTS[2]),
            torque: place(inputs, INPUTS[3]),
            error: place(inputs, INPUTS[4]),
        })
    }

    /// What the drive says; data that are too short say that it is not ready.
    pub(crate) fn read(&self, data: &[u8]) -> Said {
        let two = |at: usize| bytes(data, at).map_or(0, u16::from_le_bytes);
        Said {
            status: two(self.status),
            position: bytes(data, self.position).map_or(0, i32::from_le_bytes),
            mode: self
                .mode_now
                .and_then(|at| bytes(data, at))
                .map(i8::from_le_bytes),
            torque: self.torque.map_or(0, |at| two(at).cast_signed()),
            error: self.error.map_or(0, two),
        }
    }

    /// Tells the drive its controlword and its target (counts).
    pub(crate) fn write(&self, data: &mut [u8], control: u16, target: i32) {
        put(data, self.control, &control.to_le_bytes());
        put(data, self.target, &target.to_le_bytes());
        if let Some(mode) = self.mode {
            put(data, mode, &POSITION_MODE.to_le_bytes());
        }
    }
}

/// Where an object is (bytes), if it is mapped with its length and begins at a whole byte.
fn place(entries: &[u32], wanted: u32) -> Option<usize> {
    let mut bits = 0_usize;
    for entry in entries {
        if *entry == wanted {
            return bits.is_multiple_of(8).then_some(bits / 8);
        }
        bits += (entry & 0xFF) as usize;
    }
    None
}

fn bytes<const N: usize>(data: &[u8], at: usize) -> Option<[u8; N]> {
    data.get(at..at + N)?.try_into().ok()
}

fn put(data: &mut [u8], at: usize, value: &[u8]) {
    if let Some(place) = data.get_mut(at..at + value.len()) {
        place.copy_from_slice(value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_found_in_foreign_mappings() {
        let inputs = [0x603F_0010, 0x6041_0010, 0x0000_0008, 0x6064_0020];
        let layout = Layout::find(&OUTPUTS, &inputs).unwrap();
        assert_eq!(
            (layout.status, layout.position, layout.error),
            (2, 5, Some(0))
        );
        assert_eq!(layout.torque, None);
        let mut data = [0_u8; 9];
        data[2..4].copy_from_slice(&0x1637_u16.to_le_bytes());
        data[5..9].copy_from_slice(&(-5_i32).to_le_bytes());
        let said = layout.read(&data);
        assert_eq!((said.status, said.position), (0x1637, -5));
        assert_eq!(layout.read(&data[..4]).position, 0);
        assert_eq!(
            Layout::find(&OUTPUTS, &[0x6041_0010]),
            Err("position 0x6064")
        );
        let crooked = [0x6041_0010, 0x0000_0004, 0x6064_0020];
        assert_eq!(Layout::find(&OUTPUTS, &crooked), Err("position 0x6064"));
    }

    #[test]
    fn outputs_are_written_where_they_are() {
        let layout = Layout::find(&OUTPUTS, &INPUTS).unwrap();
        let mut data = [0_u8; 7];
        layout.write(&mut data, 0x000F, 0x0102_0304);
        assert_eq!(data, [0x0F, 0x00, 0x04, 0x03, 0x02, 0x01, 8]);
        layout.write(&mut data[..3], 0, 0);
    }
}
