//! The EEPROM of a drive: what the master must know before it can talk to it.

use super::esc::{MAILBOX, MAILBOX_LENGTH, PROCESS};

/// The image of a drive's EEPROM.
pub(super) fn image(number: usize) -> Vec<u8> {
    let mut bytes = vec![0; 0x80];
    let mut put = |word: usize, values: &[u16]| {
        for (place, value) in values.iter().enumerate() {
            let at = 2 * (word + place);
            bytes[at..at + 2].copy_from_slice(&value.to_le_bytes());
        }
    };
    // Vendor, product, revision, serial number; the mailbox, with CoE.
    put(0x08, &[0x0CA2, 0, 0x0402, 0, 1, 0, number as u16 + 1, 0]);
    let length = MAILBOX_LENGTH as u16;
    put(
        0x18,
        &[MAILBOX[0] as u16, length, MAILBOX[1] as u16, length, 0x0004],
    );
    put(0x3E, &[15, 1]);
    category(&mut bytes, 10, b"\x01\x0ASTAND-IN402");
    let mut general = vec![0_u8; 32];
    // Its name is the first string; CoE with assignment and mapping.
    (general[2], general[3], general[5]) = (1, 1, 0x0D);
    category(&mut bytes, 30, &general);
    category(&mut bytes, 40, &[1, 2, 0, 0]);
    let mut managers = Vec::new();
    let rows = [
        (MAILBOX[0], MAILBOX_LENGTH, 0x26, 1),
        (MAILBOX[1], MAILBOX_LENGTH, 0x22, 2),
        (PROCESS[0], 0, 0x64, 3),
        (PROCESS[1], 0, 0x20, 4),
    ];
    for (start, length, control, kind) in rows {
        managers.extend_from_slice(&(start as u16).to_le_bytes());
        managers.extend_from_slice(&(length as u16).to_le_bytes());
        managers.extend_from_slice(&[control, 0, 1, kind]);
    }
    category(&mut bytes, 41, &managers);
    bytes.extend_from_slice(&[0xFF; 4]);
    bytes
}

fn category(bytes: &mut Vec<u8>, kind: u16, data: &[u8]) {
    let words = data.len().div_ceil(2);
    bytes.extend_from_slice(&kind.to_le_bytes());
    bytes.extend_from_slice(&(words as u16).to_le_bytes());
    bytes.extend_from_slice(data);
    bytes.resize(bytes.len() + 2 * words - data.len(), 0);
}
