//! The objects of a drive: read and written through the mailbox, mapped into the process data.

use std::collections::HashMap;

use super::servo::Servo;

/// Reasons of a refusal.
const NO_OBJECT: u32 = 0x0602_0000;
const READ_ONLY: u32 = 0x0601_0002;
const NOT_MAPPABLE: u32 = 0x0604_0041;

/// Objects that may be mapped: index and bits.
const MAPPABLE: [(u16, u8); 8] = [
    (0x6040, 16),
    (0x607A, 32),
    (0x6060, 8),
    (0x6041, 16),
    (0x6064, 32),
    (0x6061, 8),
    (0x6077, 16),
    (0x603F, 16),
];

/// All objects: value and length in bytes.
pub(super) struct Dictionary(HashMap<(u16, u8), (u32, u8)>);

impl Dictionary {
    pub(super) fn new() -> Self {
        let mut objects = HashMap::new();
        let rows = [
            (0x1000, 0, 0x0002_0192, 4),
            (0x6502, 0, 0x0000_0080, 4),
            (0x6060, 0, 0, 1),
            (0x6065, 0, 0xFFFF_FFFF, 4),
            (0x6066, 0, 5, 2),
            (0x60C2, 1, 1, 1),
            (0x60C2, 2, 0xFD, 1),
            (0x1C32, 1, 0, 2),
            // As shipped it maps the controlword and the statusword only.
            (0x1C12, 0, 1, 1),
            (0x1C12, 1, 0x1600, 2),
            (0x1C13, 0, 1, 1),
            (0x1C13, 1, 0x1A00, 2),
            (0x1600, 0, 1, 1),
            (0x1600, 1, 0x6040_0010, 4),
            (0x1A00, 0, 1, 1),
            (0x1A00, 1, 0x6041_0010, 4),
        ];
        for (index, sub, value, length) in rows {
            objects.insert((index, sub), (value, length));
        }
        Self(objects)
    }

    /// The value of an object; 0 where it is not there.
    pub(super) fn value(&self, index: u16, sub: u8) -> u32 {
        self.0.get(&(index, sub)).map_or(0, |object| object.0)
    }

    /// The mapping entries of one direction.
    fn entries(&self, assignment: u16) -> Vec<u32> {
        let lists = 1..=self.value(assignment, 0) as u8;
        let of = |list| {
            let data = self.value(assignment, list) as u16;
            let count = self.value(data, 0) as u8;
            (1..=count).map(move |entry| self.value(data, entry))
        };
        lists.flat_map(of).collect()
    }

    /// Bytes of the process data of one direction.
    pub(super) fn length(&self, assignment: u16) -> usize {
        let bits = self.entries(assignment).into_iter();
        bits.map(|entry| (entry & 0xFF) as usize).sum::<usize>() / 8
    }

    /// The process data came: outputs to the servo; returns the inputs.
    pub(super) fn exchange(&mut self, outputs: &[u8], servo: &mut Servo) -> Vec<u8> {
        let mut at = 0;
        let mut told = [0_u32; 3];
        told[2] = self.value(0x6060, 0);
        for entry in self.entries(0x1C12) {
            let length = (entry & 0xFF) as usize / 8;
            let mut value = [0; 4];
            value[..length].copy_from_slice(&outputs[at..at + length]);
            at += length;
            let place = match entry >> 16 {
                0x6040 => 0,
                0x607A => 1,
                _ => 2,
            };
            told[place] = u32::from_le_bytes(value);
        }
        servo.take(told[0] as u16, told[1].cast_signed(), told[2] as u8, self);
        self.inputs(servo)
    }

    /// The inputs as the servo is now.
    pub(super) fn inputs(&self, servo: &Servo) -> Vec<u8> {
        let mut bytes = Vec::new();
        for entry in self.entries(0x1C13) {
            let value: u32 = match entry >> 16 {
                0x6041 => servo.status().into(),
                0x6064 => servo.counts().cast_unsigned(),
                0x6061 => servo.mode.into(),
                0x603F => servo.error.into(),
                _ => 0,
            };
            let length = (entry & 0xFF) as usize / 8;
            bytes.extend_from_slice(&value.to_le_bytes()[..length]);
        }
        bytes
    }

    /// The answer to a request in the mailbox; none where it is no request of CoE.
    pub(super) fn answer(&mut self, request: &[u8]) -> Option<Vec<u8>> {
        // Six bytes of the mailbox, two of CoE, then command, index, subindex, value.
        if request[5] & 0x0F != 3 || request[7] >> 4 != 2 {
            return None;
        }
        let (command, sub) = (request[8], request[11]);
        let index = u16::from_le_bytes([request[9], request[10]]);
        let value = u32::from_le_bytes(request[12..16].try_into().unwrap());
        let answered = match command >> 5 {
            1 => {
                let length = 4 - (command >> 2 & 3);
                self.set(index, sub, value, length).map(|()| (0x60, 0))
            }
            2 => match self.0.get(&(index, sub)) {
                Some((value, length)) => Ok((0x43 | (4 - length) << 2, *value)),
                None => Err(NO_OBJECT),
            },
            _ => Err(0x0504_0001),
        };
        let (command, value) = answered.unwrap_or_else(|code| (0x80, code));
        let mut answer = vec![10, 0, 0, 0, 0, request[5], 0, 0x30, command];
        answer.extend_from_slice(&index.to_le_bytes());
        answer.push(sub);
        answer.extend_from_slice(&value.to_le_bytes());
        Some(answer)
    }

    fn set(&mut self, index: u16, sub: u8, value: u32, length: u8) -> Result<(), u32> {
        let mapping = matches!(index, 0x1600 | 0x1A00);
        if mapping && sub > 0 {
            let (mapped, bits) = ((value >> 16) as u16, (value & 0xFF) as u8);
            if !MAPPABLE.contains(&(mapped, bits)) {
                return Err(NOT_MAPPABLE);
            }
            self.0.insert((index, sub), (value, 4));
            return Ok(());
        }
        let mask = if length >= 4 {
            u32::MAX
        } else {
            (1 << (8 * u32::from(length))) - 1
        };
        match self.0.get_mut(&(index, sub)) {
            None => Err(NO_OBJECT),
            Some(_) if matches!(index, 0x1000 | 0x6502) => Err(READ_ONLY),
            Some(object) if object.1 != length => Err(0x0607_0010),
            Some(object) => {
                object.0 = value & mask;
                Ok(())
            }
        }
    }
}
