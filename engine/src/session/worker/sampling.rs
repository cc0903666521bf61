//! Turns what the servo thread has recorded into samples of the session.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use kinematics::Chain;
use nalgebra::SVector;
use servo::{Recorded, Samples};

use super::super::RunSample;

/// Number of commands whose tool is kept, for late samples.
const CHAINS: usize = 72;

/// Reads the samples of the servo thread. The worker and whoever asks for the samples share it: one
/// that plans for a long time does not keep the samples back.
#[derive(Debug)]
pub(super) struct Sampling<const N: usize> {
    samples: Samples<N>,
    /// Chains of the last commands, with the tool that each began with.
    chains: VecDeque<(u32, Chain<N>)>,
}

impl<const N: usize> Sampling<N> {
    /// `chain` is the one before the first command.
    pub(super) fn new(samples: Samples<N>, chain: Chain<N>) -> Self {
        let chains = VecDeque::from([(0, chain)]);
        Self { samples, chains }
    }

    /// Command number `id` begins with this chain.
    pub(super) fn begin(&mut self, id: u32, chain: Chain<N>) {
        self.chains.push_back((id, chain));
        if self.chains.len() > CHAINS {
            self.chains.pop_front();
        }
    }

    /// Appends what was recorded since the last call. The chain of a command that is not known any
    /// more, or that is a jog, is the one in use now.
    pub(super) fn read(&mut self, in_use: &Mutex<Chain<N>>, into: &Mutex<Vec<RunSample>>) {
        let Some(first) = self.samples.sample() else {
            return;
        };
        let now = *in_use.lock().unwrap_or_else(PoisonError::into_inner);
        let mut samples = Vec::new();
        let mut next = Some(first);
        while let Some(sample) = next {
            samples.push(self.sample(&sample, &now));
            next = self.samples.sample();
        }
        into.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .append(&mut samples);
    }

    fn sample(&self, sample: &Recorded<N>, now: &Chain<N>) -> RunSample {
        let mut known = self.chains.iter().rev();
        let chain = known
            .find_map(|(id, chain)| (*id == sample.command).then_some(chain))
            .unwrap_or(now);
        let list = |vector: &SVector<f64, N>| vector.as_slice().to_vec();
        let measured = SVector::from(sample.measured);
        RunSample {
            tick: sample.tick,
            command: sample.command,
            path_time: sample.path_time,
            time_scaling: sample.time_scaling,
            q: list(&sample.setpoint.position),
            dq: list(&sample.setpoint.velocity),
            ddq: list(&sample.setpoint.acceleration),
            measured: sample.measured.to_vec(),
            workstation_from_tool: chain.forward(&sample.setpoint.position),
            measured_pose: chain.forward(&measured),
        }
    }
}
