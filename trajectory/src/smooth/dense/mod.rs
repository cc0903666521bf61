//! Lists that are dense in poses: the curve is nearly known, so it is fitted first and then timed.
//!
//! A curve of least change of curvature is laid through the balls, in time linear in the list; the
//! path timing finds its fastest law under the limits of the tool; curve and law together become
//! spans, which are certified as those of any smooth motion. Where the way turns back the motion
//! rests.

mod basis;
mod chords;
mod curve;
mod fit;
mod pace;
mod places;
mod spans;

use nalgebra::{Isometry3, UnitQuaternion};

use super::certificate::{Certificate, certify};
use super::choose::Motion;
use super::options::SmoothOptions;
use super::pass::{Pass, RESOLUTION};
use super::plan::Method;
use super::span::Span;
use crate::line::{Line, body_turn};
use crate::{Boundary, JointLimits, TimingOptions, time_path};
use chords::Chords;
use curve::Curve;
use fit::Fit;
use pace::Pace;
use places::Units;

/// Times that a section is fitted again with smaller balls where they were missed.
const ATTEMPTS: usize = 4;
/// Longest turn from one pose to the next that a straight line of quaternions stands for, rad.
const TURN: f64 = 0.1;
/// Share of the tolerance that the spans may cut off corners.
const CUT: f64 = 0.1;
/// Least number of knots of the spans in a ramp of the acceleration.
const KNOTS_PER_RAMP: f64 = 20.0;

/// A motion from rest in the first pose to rest in the last, certified section by section; `None`
/// where this way of planning does not lead to one. The options are finite.
pub(super) fn plan(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Option<Motion> {
    if options.tolerance <= RESOLUTION || options.corridor() <= RESOLUTION {
        return None;
    }
    let poses = moved(poses);
    if poses.len() < 3 {
        return None;
    }
    let turned = poses.windows(2).any(|pair| {
        body_turn(&pair[0].rotation, &pair[1].rotation).norm() > RESOLUTION
    });
    let spans = if turned {
        (options.angular_tolerance() > 1e3 * RESOLUTION).then(|| sections::<7>(&poses, options))
    } else {
        Some(sections::<3>(&poses, options))
    };
    let spans = spans??;
    let count = spans.len();
    Some(Motion { spans, parts: vec![(Method::Fit, count)] })
}

/// The poses without repeats, and with more of them where the tool turns far.
fn moved(given: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let mut poses = vec![given[0]];
    for pose in &given[1..] {
        let from = poses[poses.len() - 1];
        if Line::new(from, *pose).is_still() {
            continue;
        }
        let turn = body_turn(&from.rotation, &pose.rotation);
        let way = pose.translation.vector - from.translation.vector;
        let parts = (turn.norm() / TURN).ceil().max(1.0);
        for part in 1..parts as usize {
            let share = part as f64 / parts;
            let place = from.translation.vector + way * share;
            let rotation = from.rotation * UnitQuaternion::from_scaled_axis(turn * share);
            poses.push(Isometry3::from_parts(place.into(), rotation));
        }
        poses.push(*pose);
    }
    poses
}

/// The spans of all sections between places where the way turns back.
fn sections<const D: usize>(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> Option<Vec<Span>> {
    let units = Units::new(options);
    let points = units.points::<D>(poses);
    let turning = Chords::new(&points).turning_points(&points);
    let mut spans: Vec<Span> = Vec::new();
    let mut from = 0;
    for to in turning.into_iter().chain([poses.len() - 1]) {
        let section = Section::<D> { poses: &poses[from..=to], options, units };
        let offset = spans.last().map_or(0.0, Span::end);
        spans.extend(section.plan()?.into_iter().map(|mut span| {
            span.start += offset;
            span
        }));
        from = to;
    }
    Some(spans)
}

/// A part of the list that one curve is laid through.
struct Section<'a, const D: usize> {
    poses: &'a [Isometry3<f64>],
    options: &'a SmoothOptions,
    units: Units,
}

impl<const D: usize> Section<'_, D> {
    /// Certified spans from rest to rest.
    fn plan(&self) -> Option<Vec<Span>> {
        let points = self.units.points::<D>(self.poses);
        let mut radii = vec![1.0; points.len()];
        let mut parameters = Chords::new(&points).parameters(&points);
        let mut limits = self.options.limits;
        let n2:usize=std::env::var("REFIT").ok().and_then(|x|x.parse().ok()).unwrap_or(2);let fine:f64=std::env::var("FINE").ok().and_then(|x|x.parse().ok()).unwrap_or(6.0);
        for attempt in 0..ATTEMPTS+n2 {
            let fit = Fit::new(&points, &parameters, &radii)?;
            parameters.clone_from(&fit.parameters);
            let curve = Curve::new(fit, self.units, &self.poses[0]);
            let timing = TimingOptions {
                start: Boundary::Rest,
                end: Boundary::Rest,
                cells:{let f:f64=std::env::var("CELLS").ok().and_then(|x|x.parse().ok()).unwrap_or(0.0); if f>0.0 {Some(1+(f*curve.fit.spans() as f64) as usize)} else {None}},
                ..TimingOptions::default()
            };
            let free = JointLimits::uniform(f64::INFINITY, f64::INFINITY, f64::INFINITY);
            let timed = time_path(&curve, &free, &limits, &timing).ok()?;
            if std::env::var("LAB").is_ok() { eprintln!("K {} cells {} it {} stretch {:.4} T {:.4} lb {:.4}", curve.fit.spans(), timed.certificate.cells, timed.certificate.iterations, timed.certificate.stretch, timed.certificate.duration, timed.certificate.lower_bound); }
            if std::env::var("DUMP").is_ok() { for k in 0..=curve.fit.spans()*2 { let u=k as f64*0.5; use crate::Path; let p=curve.tool_at(u); let v=p.linear[0]; let n=v.norm(); let kap=v.cross(&p.linear[1]).norm()/n.powi(3); println!("D {attempt} {u} {:.5} k {:.4} sp {:.4}", p.pose.translation.vector.norm()*1e3, kap, n*1e3); } for i in 0..=60 { let t=timed.law.duration()*i as f64/60.0; let sa=timed.law.sample(t); println!("L {attempt} {t:.4} {:.3} {:.3}", sa.position[0], sa.velocity[0]); } }
            if attempt<n2 { let ramp=limits.acceleration/limits.jerk; parameters=Pace::new(&curve, &timed.law, (ramp, ramp/fine)).map(&parameters); continue; }
            let ends = [&self.poses[0], &self.poses[self.poses.len() - 1]];
            let mut spans = spans::spans(&curve, &timed.law, ends, self.spacing());
            let (mut certificate, mut passes) = certify(&spans, self.poses, self.options);
            if certificate.worst_limit() > 1.0 && certificate.worst_limit() < 1.01 {
                super::choose::stretch(&mut spans, certificate.stretch() * (1.0 + 1e-12));
                (certificate, passes) = certify(&spans, self.poses, self.options);
            }
            if certificate.holds() {
                return Some(spans);
            }
            self.narrow(&mut radii, &certificate, &passes);
            let over = certificate.worst_limit();
            if over > 1.0 {
                for limit in [
                    &mut limits.angular_speed,
                    &mut limits.angular_acceleration,
                    &mut limits.angular_jerk,
                    &mut limits.speed,
                    &mut limits.acceleration,
                    &mut limits.jerk,
                ] {
                    *limit *= 0.999 / over;
                }
            }
        }
        None
    }

    /// Knot spacing of the spans, s.
    fn spacing(&self) -> f64 {
        let limits = &self.options.limits;
        let ramp = limits.acceleration / limits.jerk;
        let cut = (CUT * self.units.length * 4.8 / limits.acceleration).sqrt();
        cut.min(ramp / KNOTS_PER_RAMP)
    }

    /// Makes the balls smaller where a motion missed them.
    fn narrow(&self, radii: &mut [f64], certificate: &Certificate, passes: &[Pass]) {
        let _ = certificate;
        for pass in passes.iter().filter(|pass| !pass.holds()) {
            let over = (pass.deviation / pass.tolerance).max(pass.angle / pass.angular_tolerance);
            let last = radii.len();
            let near = pass.index.saturating_sub(3)..(pass.index + 4).min(last);
            for radius in &mut radii[near] {
                *radius *= (0.95 / over).max(0.5);
            }
        }
    }
}
