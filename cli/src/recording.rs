use std::collections::VecDeque;
use std::io::{self, Write};

use engine::session::RunSample;
use nalgebra::Vector3;

use crate::samples::{SampleRow, SampleWriter};

/// Records what was published and measured: writes it to a file if there is one, and summarises it.
pub(crate) struct Recording<W: Write> {
    writer: Option<SampleWriter<W>>,
    period: f64,
    first: Option<u64>,
    last: u64,
    worst: f64,
    path: VecDeque<Vector3<f64>>,
    command: u32,
}

/// Number of published points that the measured one is compared with: the arm is behind by less.
const BEHIND: usize = 100;

impl<W: Write> Recording<W> {
    /// A recording of `joints` joints at `rate_hz`; the file gets the columns of a plan and, beside
    /// them, the time on the path and the measured joints and controlled point.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn new(joints: usize, rate_hz: f64, sink: Option<W>) -> io::Result<Self> {
        let mut extra = vec!["path_time_s".to_owned()];
        extra.extend((1..=joints).map(|joint| format!("measured_q{joint}")));
        extra.extend(["x", "y", "z"].map(|axis| format!("measured_{axis}_m")));
        let writer = sink
            .map(|sink| SampleWriter::new(sink, joints, &extra))
            .transpose()?;
        let period = (1e9 / rate_hz).round() * 1e-9;
        Ok(Self {
            writer,
            period,
            first: None,
            last: 0,
            worst: 0.0,
            path: VecDeque::with_capacity(BEHIND + 1),
            command: 0,
        })
    }

    /// Takes samples, oldest first.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn take(&mut self, samples: &[RunSample]) -> io::Result<()> {
        for sample in samples {
            let first = *self.first.get_or_insert(sample.tick);
            self.last = sample.tick;
            self.hold_against_path(sample);
            // The time at which a command begins belongs to the one that ends there.
            if sample.path_time > 0.0 {
                self.command = sample.command;
            }
            let Some(writer) = &mut self.writer else {
                continue;
            };
            let place = sample.measured_pose.translation;
            let mut extra = vec![sample.path_time];
            extra.extend(&sample.measured);
            extra.extend([place.x, place.y, place.z]);
            let row = SampleRow {
                t_s: (sample.tick - first) as f64 * self.period,
                command: self.command.saturating_sub(1) as usize,
                joints: [&sample.q, &sample.dq, &sample.ddq],
                pose: &sample.workstation_from_tool,
            };
            writer.write(&row, &extra)?;
        }
        Ok(())
    }

    /// Distance of the measured point from the path that was published recently: off the path, not
    /// behind on it.
    fn hold_against_path(&mut self, sample: &RunSample) {
        self.path
            .push_back(sample.workstation_from_tool.translation.vector);
        if self.path.len() > BEHIND {
            self.path.pop_front();
        }
        let measured = sample.measured_pose.translation.vector;
        let mut nearest = f64::INFINITY;
        for (from, to) in self.path.iter().zip(self.path.iter().skip(1)) {
            nearest = nearest.min(off_line(&measured, from, to));
        }
        if nearest.is_finite() {
            self.worst = self.worst.max(nearest);
        }
    }

    /// Length of a servo period, s.
    pub(crate) fn period(&self) -> f64 {
        self.period
    }

    /// Time from the first to the last sample, s.
    pub(crate) fn duration(&self) -> f64 {
        self.first
            .map_or(0.0, |first| (self.last - first) as f64 * self.period)
    }

    /// Largest distance of the measured controlled point from the published path, m.
    pub(crate) fn worst(&self) -> f64 {
        self.worst
    }

    /// Ends the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.writer.map_or(Ok(()), SampleWriter::finish)
    }
}

/// Distance of a point from the line between two others.
fn off_line(point: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let way = to - from;
    let squared = way.norm_squared();
    let part = if squared > 0.0 {
        ((point - from).dot(&way) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (from + way * part - point).norm()
}
