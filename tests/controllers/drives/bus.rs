//! The devices of a bus in a row, and the frames that pass through them.

use super::esc::{Access, Device};

/// Bytes of the Ethernet header, the EtherCAT header, and a datagram's header.
const ETHERNET: usize = 14;
const ETHERCAT: usize = 2;
const DATAGRAM: usize = 10;

/// The bus.
pub(super) struct Bus {
    pub(super) devices: Vec<Device>,
    /// Frames with process data.
    pub(super) cycles: u64,
    /// Distances of frames from the middle between two pulses: sum (ns) and number, since the last look.
    pub(super) distance: [f64; 2],
    /// The devices from this one on do not answer.
    pub(super) cut: usize,
}

impl Bus {
    /// A frame passes through all devices; returns whether it was one of EtherCAT.
    pub(super) fn pass(&mut self, frame: &mut [u8]) -> bool {
        if frame.len() < ETHERNET + ETHERCAT || frame[12..14] != [0x88, 0xA4] {
            return false;
        }
        // The first device marks the sender's address.
        frame[6] |= 0x02;
        let mut at = ETHERNET + ETHERCAT;
        while at + DATAGRAM + 2 <= frame.len() {
            let word = u16::from_le_bytes([frame[at + 6], frame[at + 7]]);
            let length = usize::from(word & 0x07FF);
            let end = at + DATAGRAM + length + 2;
            if end > frame.len() {
                break;
            }
            self.datagram(&mut frame[at..end]);
            at = end;
            if word & 0x8000 == 0 {
                break;
            }
        }
        true
    }

    fn datagram(&mut self, bytes: &mut [u8]) {
        let length = bytes.len() - DATAGRAM - 2;
        let command = bytes[0];
        let (header, rest) = bytes.split_at_mut(DATAGRAM);
        let (data, counter) = rest.split_at_mut(length);
        let mut count = u16::from_le_bytes([counter[0], counter[1]]);
        let reach = self.cut.min(self.devices.len());
        if matches!(command, 10..=12) {
            let start = u32::from_le_bytes(header[2..6].try_into().unwrap()) as usize;
            self.cycles += 1;
            for device in &mut self.devices[..reach] {
                if let Some(phase) = device.phase() {
                    self.distance[0] += phase.abs();
                    self.distance[1] += 1.0;
                }
                count += device.exchange(start, data, command);
            }
        } else {
            for device in &mut self.devices[..reach] {
                count += access(device, command, header, data);
            }
        }
        counter.copy_from_slice(&count.to_le_bytes());
    }
}

/// A datagram that addresses registers; returns what the device adds to the working counter.
fn access(device: &mut Device, command: u8, header: &mut [u8], data: &mut [u8]) -> u16 {
    let number = u16::from_le_bytes([header[2], header[3]]);
    let address = usize::from(u16::from_le_bytes([header[4], header[5]]));
    let counted = matches!(command, 1..=3 | 7..=9 | 13);
    if counted {
        header[2..4].copy_from_slice(&number.wrapping_add(1).to_le_bytes());
    }
    let mine = match command {
        1..=3 | 13 => number == 0,
        4..=6 | 14 => number == device.station(),
        _ => true,
    };
    match command {
        1 | 4 if mine => u16::from(device.read(&mut Access { data, address })),
        2 | 5 | 8 if mine => u16::from(device.write(&Access { data, address })),
        7 => {
            let mut found = vec![0; data.len()];
            let read = device.read(&mut Access {
                data: &mut found,
                address,
            });
            for (to, from) in data.iter_mut().zip(found) {
                *to |= if read { from } else { 0 };
            }
            u16::from(read)
        }
        13 | 14 if mine => u16::from(device.read(&mut Access { data, address })),
        13 | 14 => u16::from(device.write(&Access { data, address })),
        3 | 6 | 9 if mine => {
            let written = data.to_vec();
            let mut written = written;
            let read = device.read(&mut Access { data, address });
            let wrote = device.write(&Access {
                data: &mut written,
                address,
            });
            u16::from(read) + 2 * u16::from(wrote)
        }
        _ => 0,
    }
}
