use std::io::{self, Write};

use nalgebra::Isometry3;

/// State at one time, as it is written.
pub(crate) struct SampleRow<'a> {
    /// Time, s.
    pub(crate) t_s: f64,
    /// Number of the command, from 0.
    pub(crate) command: usize,
    /// Positions, velocities, accelerations.
    pub(crate) joints: [&'a [f64]; 3],
    /// The controlled point in the workstation.
    pub(crate) pose: &'a Isometry3<f64>,
}

/// Writes motion samples as CSV: `t_s,command,q1..qN,dq1..dqN,ddq1..ddqN,x_m,y_m,z_m,qw,qx,qy,qz`
/// in s, rad (m for sliding joints) and the controlled point in the workstation.
///
/// Numbers have as many digits as are needed to read the same bits back. Quaternions keep the sign
/// that makes them continuous from row to row.
pub(crate) struct SampleWriter<W: Write> {
    out: W,
    last_turn: [f64; 4],
    extra: usize,
}

impl<W: Write> SampleWriter<W> {
    /// Writes the header for `joints` joints, with the columns of `extra` after the usual ones.
    ///
    /// # Errors
    /// The sink cannot be written.
    pub(crate) fn new(mut out: W, joints: usize, extra: &[String]) -> io::Result<Self> {
        write!(out, "t_s,command")?;
        for name in ["q", "dq", "ddq"] {
            for joint in 1..=joints {
                write!(out, ",{name}{joint}")?;
            }
        }
        write!(out, ",x_m,y_m,z_m,qw,qx,qy,qz")?;
        for column in extra {
            write!(out, ",{column}")?;
        }
        writeln!(out)?;
        Ok(Self {
            out,
            last_turn: [1.0, 0.0, 0.0, 0.0],
            extra: extra.len(),
        })
    }

    /// Writes one row; `extra` has one value for each extra column.
    ///
    /// # Errors
    /// The sink cannot be written.
    pub(crate) fn write(&mut self, row: &SampleRow, extra: &[f64]) -> io::Result<()> {
        debug_assert_eq!(extra.len(), self.extra);
        write!(self.out, "{},{}", row.t_s, row.command)?;
        for value in row.joints.into_iter().flatten() {
            write!(self.out, ",{value}")?;
        }
        let place = row.pose.translation;
        let turn = self.turn(row.pose);
        for value in [place.x, place.y, place.z].iter().chain(&turn).chain(extra) {
            write!(self.out, ",{value}")?;
        }
        writeln!(self.out)
    }

    /// Ends the file.
    ///
    /// # Errors
    /// The sink cannot be written.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn turn(&mut self, pose: &Isometry3<f64>) -> [f64; 4] {
        let r = pose.rotation;
        let mut turn = [r.w, r.i, r.j, r.k];
        let along: f64 = turn.iter().zip(&self.last_turn).map(|(a, b)| a * b).sum();
        if along < 0.0 {
            turn = turn.map(|part| -part);
        }
        self.last_turn = turn;
        turn
    }
}
