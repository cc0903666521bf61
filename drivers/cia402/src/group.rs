//! The devices in operation, with a distributed clock or without.

use ethercrab::error::Error;
use ethercrab::subdevice_group::{HasDc, NoDc, Op};
use ethercrab::{DefaultLock, MainDevice, SubDeviceGroup, SubDeviceState};

use crate::MAX_DEVICES;

/// Room for the process data of all devices (bytes).
pub(crate) const MAX_DATA: usize = 1024;

/// A group of devices in a state, with a clock or without.
pub(crate) type Devices<S, DC> = SubDeviceGroup<MAX_DEVICES, MAX_DATA, DefaultLock, S, DC>;

/// The devices in operation.
pub(crate) enum Group {
    /// They follow at the arrival of the process data.
    Free(Devices<Op, NoDc>),
    /// They follow a common clock.
    Clocked(Devices<Op, HasDc>),
}

/// What a cycle brought.
pub(crate) struct Exchanged {
    pub(crate) working_counter: u16,
    /// The state of each device, in the order of the bus.
    pub(crate) states: [SubDeviceState; MAX_DEVICES],
    /// How long after the beginning of the drives' cycle the frame passed (ns); none without a clock.
    pub(crate) offset_ns: Option<u64>,
}

impl Group {
    /// How many devices there are.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Free(devices) => devices.len(),
            Self::Clocked(devices) => devices.len(),
        }
    }

    /// Exchanges the process data of all devices.
    pub(crate) async fn exchange<'a>(
        &self,
        master: &'a MainDevice<'a>,
    ) -> Result<Exchanged, Error> {
        let mut states = [SubDeviceState::None; MAX_DEVICES];
        match self {
            Self::Free(devices) => {
                let answer = devices.tx_rx(master).await?;
                for (to, from) in states.iter_mut().zip(&answer.subdevice_states) {
                    *to = *from;
                }
                Ok(Exchanged {
                    working_counter: answer.working_counter,
                    states,
                    offset_ns: None,
                })
            }
            Self::Clocked(devices) => {
                let answer = devices.tx_rx_dc(master).await?;
                for (to, from) in states.iter_mut().zip(&answer.subdevice_states) {
                    *to = *from;
                }
                Ok(Exchanged {
                    working_counter: answer.working_counter,
                    states,
                    offset_ns: u64::try_from(answer.extra.cycle_start_offset.as_nanos()).ok(),
                })
            }
        }
    }

    /// Inputs and outputs of the device at a place of the bus; nothing if there is none.
    pub(crate) fn with<'a, T>(
        &self,
        master: &'a MainDevice<'a>,
        place: usize,
        work: impl FnOnce(&[u8], &mut [u8]) -> T,
    ) -> Option<T> {
        // The inputs are copied: both cannot be borrowed at once.
        let mut inputs = [0_u8; 64];
        macro_rules! on {
            ($devices:expr) => {{
                let device = $devices.subdevice(master, place).ok()?;
                let mut data = device.io_raw_mut();
                let length = data.inputs().len().min(inputs.len());
                inputs[..length].copy_from_slice(&data.inputs()[..length]);
                Some(work(&inputs[..length], data.outputs()))
            }};
        }
        match self {
            Self::Free(devices) => on!(devices),
            Self::Clocked(devices) => on!(devices),
        }
    }

    /// The working counter when all devices take part: one for inputs, two for outputs of each.
    pub(crate) fn full_counter<'a>(&self, master: &'a MainDevice<'a>) -> u16 {
        let of = |place| {
            self.with(master, place, |inputs, outputs| {
                u16::from(!inputs.is_empty()) + 2 * u16::from(!outputs.is_empty())
            })
        };
        (0..self.len()).filter_map(of).sum()
    }
}
