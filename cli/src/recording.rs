use std::io::{self, Write};

use engine::off_path::OffPath;
use engine::session::RunSample;

use crate::samples::{SampleRow, SampleWriter};

/// Records what was published and measured: writes it to a file if there is one, and summarises it.
pub(crate) struct Recording<W: Write> {
    writer: Option<SampleWriter<W>>,
    period: f64,
    first: Option<u64>,
    last: u64,
    off_path: OffPath,
    command: u32,
}

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
            off_path: OffPath::default(),
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
            self.off_path.take(sample);
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
        self.off_path.largest()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.writer.map_or(Ok(()), SampleWriter::finish)
    }
}
