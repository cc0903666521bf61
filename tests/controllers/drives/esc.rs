//! The EtherCAT side of a device: registers, states, EEPROM, mailbox, process data, clock.

use std::time::Duration;

use scheduling::now_ns;

use super::dictionary::Dictionary;
use super::servo::Servo;

/// Registers of a device, by their address.
const STATION: usize = 0x0010;
const AL_CONTROL: usize = 0x0120;
const AL_STATUS: usize = 0x0130;
const AL_CODE: usize = 0x0134;
const WATCHDOG_DIVIDER: usize = 0x0400;
const WATCHDOG: usize = 0x0420;
const EEPROM_CONTROL: usize = 0x0502;
const EEPROM_DATA: usize = 0x0508;
const FMMU: usize = 0x0600;
const SYNC_MANAGER: usize = 0x0800;
const PORT_TIMES: usize = 0x0900;
const SYSTEM_TIME: usize = 0x0910;
const RECEIVE_TIME: usize = 0x0918;
const TIME_OFFSET: usize = 0x0920;
const SYNC_ACTIVE: usize = 0x0981;
const SYNC_START: usize = 0x0990;
const SYNC_CYCLE: usize = 0x09A0;
const CLOCK_END: usize = 0x0A00;

/// The buffers, as the EEPROM says.
pub(super) const MAILBOX: [usize; 2] = [0x1000, 0x1080];
pub(super) const MAILBOX_LENGTH: usize = 0x80;
pub(super) const PROCESS: [usize; 2] = [0x1100, 0x1180];
const MEMORY: usize = 0x2000;

/// A device on the bus.
pub(super) struct Device {
    memory: Vec<u8>,
    eeprom: Vec<u8>,
    pub(super) dictionary: Dictionary,
    pub(super) servo: Servo,
    /// It has a distributed clock, this much faster than the time here, and this much ahead (ns).
    clock: Option<(f64, u64)>,
    /// When the last process data came (ns); none outside operation.
    heard_ns: Option<u64>,
}

/// A piece of a datagram for one device.
pub(super) struct Access<'a> {
    pub(super) data: &'a mut [u8],
    pub(super) address: usize,
}

impl Device {
    pub(super) fn new(number: usize, last: bool, clocked: bool, servo: Servo) -> Self {
        let mut memory = vec![0; MEMORY];
        memory[0] = 0x11;
        // Four sync managers and FMMUs; a clock of 64 bits that gives pulses.
        (memory[4], memory[5]) = (4, 4);
        let flags: u16 = if clocked { 0x010C } else { 0 };
        memory[8..10].copy_from_slice(&flags.to_le_bytes());
        memory[0x0110] = if last { 0x10 } else { 0x30 };
        memory[AL_STATUS] = 1;
        let clock = clocked.then(|| (1.0 + (number + 1) as f64 * 2e-5, 7_000_000 * number as u64));
        Self {
            memory,
            eeprom: super::eeprom::image(number),
            dictionary: Dictionary::new(),
            servo,
            clock,
            heard_ns: None,
        }
    }

    pub(super) fn station(&self) -> u16 {
        self.word(STATION)
    }

    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.memory[at], self.memory[at + 1]])
    }

    fn long(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.memory[at..at + 8].try_into().unwrap())
    }

    fn put(&mut self, at: usize, bytes: &[u8]) {
        self.memory[at..at + bytes.len()].copy_from_slice(bytes);
    }

    /// The device's own clock (ns).
    fn local_time(&self) -> u64 {
        let (pace, ahead) = self.clock.unwrap_or((1.0, 0));
        (now_ns() as f64 * pace) as u64 + ahead
    }

    /// Reads registers or buffers; returns whether it could.
    pub(super) fn read(&mut self, access: &mut Access<'_>) -> bool {
        let (from, length) = (access.address, access.data.len());
        if from + length > MEMORY || (self.clock.is_none() && clock_register(from)) {
            return false;
        }
        if from == SYSTEM_TIME {
            let offset = self.long(TIME_OFFSET);
            let time = self.local_time().wrapping_add(offset);
            self.put(SYSTEM_TIME, &time.to_le_bytes());
        }
        let full = SYNC_MANAGER + 8 + 5;
        if overlaps(from, length, MAILBOX[1], MAILBOX_LENGTH) {
            if self.memory[full] & 0x08 == 0 {
                return false;
            }
            if from + length >= MAILBOX[1] + MAILBOX_LENGTH {
                self.memory[full] &= !0x08;
            }
        }
        access
            .data
            .copy_from_slice(&self.memory[from..from + length]);
        true
    }

    /// Writes registers or buffers; returns whether it could.
    pub(super) fn write(&mut self, access: &Access<'_>) -> bool {
        let (to, length) = (access.address, access.data.len());
        if to + length > MEMORY || (self.clock.is_none() && clock_register(to)) {
            return false;
        }
        if to == SYSTEM_TIME {
            // The reference's time; zeros only blank the register. A control loop draws a real clock to it,
            // this one is set.
            let bytes = access.data.get(..8).and_then(|bytes| bytes.try_into().ok());
            let time = bytes.map_or(0, u64::from_le_bytes);
            if time > 0 {
                let offset = time.wrapping_sub(self.local_time());
                self.put(TIME_OFFSET, &offset.to_le_bytes());
            }
            return true;
        }
        if to < 0x0010 || (AL_STATUS..AL_STATUS + 8).contains(&to) {
            return true;
        }
        self.put(to, access.data);
        match to {
            AL_CONTROL => self.request_state(),
            EEPROM_CONTROL => self.read_eeprom(),
            PORT_TIMES => self.latch_times(),
            _ => {}
        }
        if overlaps(to, length, MAILBOX[0], MAILBOX_LENGTH)
            && to + length >= MAILBOX[0] + MAILBOX_LENGTH
        {
            self.answer_mailbox();
        }
        true
    }

    fn latch_times(&mut self) {
        let now = self.local_time();
        for (port, later) in [0_u64, 600, 0, 0].into_iter().enumerate() {
            let time = (now + later) as u32;
            self.put(PORT_TIMES + 4 * port, &time.to_le_bytes());
        }
        self.put(RECEIVE_TIME, &now.to_le_bytes());
    }

    fn read_eeprom(&mut self) {
        let control = self.word(EEPROM_CONTROL);
        if control & 0x0100 != 0 {
            let word = usize::from(self.word(EEPROM_CONTROL + 2));
            let mut data = [0xFF; 4];
            for (place, byte) in data.iter_mut().enumerate() {
                if let Some(found) = self.eeprom.get(2 * word + place) {
                    *byte = *found;
                }
            }
            self.put(EEPROM_DATA, &data);
        }
        // Never busy, four bytes at once, no error.
        self.put(EEPROM_CONTROL, &[0, 0]);
    }

    /// The master asks for a state.
    fn request_state(&mut self) {
        let wanted = self.memory[AL_CONTROL] & 0x0F;
        let now = self.memory[AL_STATUS] & 0x0F;
        let code: u16 = match (now, wanted) {
            (_, 1) => 0,
            (1, 2) if !self.has_buffers([0, 1]) => 0x0016,
            (1 | 2 | 4 | 8, 2) => 0,
            (2, 4) if self.sizes()[0] != self.dictionary.length(0x1C12) => 0x001D,
            (2, 4) if self.sizes()[1] != self.dictionary.length(0x1C13) => 0x001E,
            (2 | 4 | 8, 4) | (4 | 8, 8) => 0,
            _ => 0x0011,
        };
        if code == 0 {
            self.memory[AL_STATUS] = wanted;
            self.heard_ns = (wanted == 8).then(now_ns);
        } else {
            self.memory[AL_STATUS] = now | 0x10;
        }
        if wanted != 8 {
            self.servo.lose_bus(false);
        }
        self.put(AL_CODE, &code.to_le_bytes());
    }

    fn has_buffers(&self, managers: [usize; 2]) -> bool {
        let enabled = |manager: usize| self.memory[SYNC_MANAGER + 8 * manager + 6] & 1 != 0;
        managers.into_iter().all(enabled)
    }

    /// Lengths of the process data buffers.
    fn sizes(&self) -> [usize; 2] {
        [2, 3].map(|manager| usize::from(self.word(SYNC_MANAGER + 8 * manager + 2)))
    }

    fn answer_mailbox(&mut self) {
        let request = self.memory[MAILBOX[0]..MAILBOX[0] + MAILBOX_LENGTH].to_vec();
        if let Some(answer) = self.dictionary.answer(&request) {
            self.put(MAILBOX[1], &[0; MAILBOX_LENGTH]);
            self.put(MAILBOX[1], &answer);
            self.memory[SYNC_MANAGER + 8 + 5] |= 0x08;
        }
    }

    /// A logical access: returns what it adds to the working counter.
    pub(super) fn exchange(&mut self, start: usize, data: &mut [u8], command: u8) -> u16 {
        let mut counter = 0;
        for number in 0..4 {
            let at = FMMU + 16 * number;
            if self.memory[at + 12] & 1 == 0 {
                continue;
            }
            let logical = u32::from_le_bytes(self.memory[at..at + 4].try_into().unwrap()) as usize;
            let length = usize::from(self.word(at + 4));
            let physical = usize::from(self.word(at + 8));
            if logical < start || logical + length > start + data.len() {
                continue;
            }
            let place = &mut data[logical - start..logical - start + length];
            let kind = self.memory[at + 11];
            if kind & 1 != 0 && command != 11 {
                place.copy_from_slice(&self.memory[physical..physical + length]);
                counter += 1;
            } else if kind & 2 != 0 && command != 10 {
                let bytes = place.to_vec();
                self.put(physical, &bytes);
                counter += if command == 12 { 2 } else { 1 };
            }
        }
        if counter >= 2 && self.memory[AL_STATUS] == 8 {
            self.heard_ns = Some(now_ns());
            let (at, length) = (PROCESS[0], self.sizes()[0]);
            let outputs = self.memory[at..at + length].to_vec();
            let inputs = self.dictionary.exchange(&outputs, &mut self.servo);
            self.put(PROCESS[1], &inputs);
        }
        counter
    }

    /// Time goes on: the watchdog, and the servo.
    pub(super) fn go_on(&mut self, now: u64) {
        if let Some(heard) = self.heard_ns {
            let unit = f64::from(self.word(WATCHDOG_DIVIDER) + 2) * 40e-9;
            let limit = Duration::from_secs_f64(unit * f64::from(self.word(WATCHDOG)));
            if !limit.is_zero() && now.saturating_sub(heard) > limit.as_nanos() as u64 {
                // The watchdog of the process data: back to SAFE-OP with an error.
                self.memory[AL_STATUS] = 0x14;
                self.put(AL_CODE, &0x001B_u16.to_le_bytes());
                self.heard_ns = None;
                self.servo.lose_bus(true);
            }
        }
        self.servo.go_on(now, &self.dictionary);
        if self.memory[AL_STATUS] == 8 {
            let inputs = self.dictionary.inputs(&self.servo);
            self.put(PROCESS[1], &inputs);
        }
    }

    /// How far the frame is from the middle between two pulses (ns); none without pulses.
    pub(super) fn phase(&self) -> Option<f64> {
        if self.clock.is_none() || self.memory[SYNC_ACTIVE] & 3 != 3 {
            return None;
        }
        let cycle = self.long(SYNC_CYCLE) & 0xFFFF_FFFF;
        let time = self.local_time().wrapping_add(self.long(TIME_OFFSET));
        let since = time.wrapping_sub(self.long(SYNC_START)) % cycle.max(1);
        Some(since as f64 - cycle as f64 / 2.0)
    }
}

fn clock_register(at: usize) -> bool {
    (PORT_TIMES..CLOCK_END).contains(&at)
}

fn overlaps(from: usize, length: usize, start: usize, size: usize) -> bool {
    from < start + size && start < from + length
}
