//! ROS 2's Common Data Representation: little endian, numbers at multiples of their size.
//!
//! # Source
//! Object Management Group, DDS-XTypes 1.3, section 7.4.3 (plain CDR, encoding version 1).

/// The head of every message: plain CDR, little endian.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// Writes one message.
#[derive(Debug)]
pub(crate) struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    pub(crate) fn new() -> Self {
        let mut bytes = Vec::with_capacity(256);
        bytes.extend_from_slice(&HEAD);
        Self { bytes }
    }

    /// Fills up to a multiple of `size` behind the head.
    fn align(&mut self, size: usize) {
        while !(self.bytes.len() - HEAD.len()).is_multiple_of(size) {
            self.bytes.push(0);
        }
    }

    pub(crate) fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    pub(crate) fn u64(&mut self, value: u64) {
        self.align(8);
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, value: f64) {
        self.u64(value.to_bits());
    }

    /// A text: its length with the final zero, its bytes, the zero.
    pub(crate) fn text(&mut self, value: &str) {
        self.u32(value.len() as u32 + 1);
        self.bytes.extend_from_slice(value.as_bytes());
        self.bytes.push(0);
    }

    /// A list of numbers of any length.
    pub(crate) fn numbers(&mut self, values: &[f64]) {
        self.u32(values.len() as u32);
        for value in values {
            self.f64(*value);
        }
    }

    /// Wall time as seconds and nanoseconds.
    pub(crate) fn stamp(&mut self, time_ns: u64) {
        self.u32((time_ns / 1_000_000_000) as u32);
        self.u32((time_ns % 1_000_000_000) as u32);
    }

    /// `std_msgs/Header`.
    pub(crate) fn header(&mut self, time_ns: u64, frame: &str) {
        self.stamp(time_ns);
        self.text(frame);
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Reads one message; every read gives `None` beyond its end.
#[derive(Debug)]
pub(crate) struct CdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    /// `None` for another encoding.
    pub(crate) fn new(message: &'a [u8]) -> Option<Self> {
        let bytes = message.strip_prefix(&HEAD)?;
        Some(Self { bytes, at: 0 })
    }

    fn take<const SIZE: usize>(&mut self) -> Option<[u8; SIZE]> {
        let start = self.at.next_multiple_of(SIZE);
        let taken = self.bytes.get(start..start.checked_add(SIZE)?)?;
        self.at = start + SIZE;
        taken.try_into().ok()
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    pub(crate) fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }

    pub(crate) fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let end = self.at.checked_add(length)?;
        let bytes = self.bytes.get(self.at..end)?;
        self.at = end;
        std::str::from_utf8(bytes.strip_suffix(&[0])?).ok()
    }

    /// A list of numbers, into an array with zeros behind; `None` where it is longer.
    pub(crate) fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let count = self.u32()? as usize;
        let mut values = [0.0; N];
        for value in values.get_mut(..count)? {
            *value = self.f64()?;
        }
        Some(values)
    }

    /// Wall time (ns since 1970).
    pub(crate) fn header(&mut self) -> Option<u64> {
        let (seconds, nanoseconds) = (self.u32()?, self.u32()?);
        self.text()?;
        Some(u64::from(seconds) * 1_000_000_000 + u64::from(nanoseconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let mut writer = CdrWriter::new();
        writer.text("abc");
        writer.u8(7);
        writer.f64(1.5);
        writer.numbers(&[2.0, -3.0]);
        let bytes = writer.finish();
        // Head 4, length 4, text 4, u8 1, up to 16, f64 8, count 4, up to 32, 2 numbers.
        assert_eq!(bytes.len(), 4 + 32 + 16);
        assert_eq!(&bytes[..12], &[0, 1, 0, 0, 4, 0, 0, 0, b'a', b'b', b'c', 0]);
        assert_eq!(&bytes[4 + 16..4 + 24], &1.5_f64.to_le_bytes());
        let mut reader = CdrReader::new(&bytes).unwrap();
        assert_eq!(reader.text(), Some("abc"));
        reader.at += 1;
        assert_eq!(reader.f64(), Some(1.5));
        assert_eq!(reader.numbers::<4>(), Some([2.0, -3.0, 0.0, 0.0]));
        assert_eq!(reader.u32(), None);
    }

    #[test]
    fn bytes_that_are_no_message_give_nothing() {
        assert!(CdrReader::new(&[1, 2, 3]).is_none());
        let mut reader = CdrReader::new(&[0, 1, 0, 0, 255, 255, 255, 255, 0]).unwrap();
        assert_eq!(reader.text(), None);
        let mut reader = CdrReader::new(&[0, 1, 0, 0, 255, 255, 255, 255, 0]).unwrap();
        assert_eq!(reader.numbers::<8>(), None);
    }
}
