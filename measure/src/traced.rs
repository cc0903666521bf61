//! A motion through a list of poses as points in time, to be drawn.

use nalgebra::{Isometry3, Vector3};
use planner::motion::MoveCertificate;
use trajectory::ToolCurve;
use trajectory::smooth::{SmoothOptions, SmoothPlan, plan};

/// Most points of a motion.
const POINTS: f64 = 4000.0;

/// Least time between two points (s).
const STEP_S: f64 = 0.002;

/// How an intermediate pose is passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedPass {
    /// Which pose of the list; the start is 0.
    pub index: usize,
    /// Distance at the pass (m).
    pub deviation: f64,
    /// Tolerance in force (m).
    pub tolerance: f64,
    /// When (s).
    pub time: f64,
}

/// An interval in which one limit decides the speed.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedLimit {
    /// Name of the limit.
    pub limit: String,
    /// From when (s).
    pub start: f64,
    /// Until when (s).
    pub end: f64,
}

/// A motion through a list of poses, as points at equal times.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// Where the poses are, the start first (m).
    pub poses: Vec<[f64; 3]>,
    /// Time of the motion (s).
    pub duration: f64,
    /// No motion through the list is shorter (s).
    pub lower_bound: f64,
    /// Time with a stop at each pose (s).
    pub exact_stop: Option<f64>,
    /// Time between two points (s).
    pub step: f64,
    /// The controlled point (m).
    pub points: Vec<[f64; 3]>,
    /// Positions, velocities and accelerations of the joints at the points; empty without an arm.
    pub joints: Vec<[Vec<f64>; 3]>,
    /// How the intermediate poses are passed.
    pub passes: Vec<TracedPass>,
    /// Which limit is active when.
    pub active: Vec<TracedLimit>,
}

/// Where poses are.
pub(crate) fn places(poses: &[Isometry3<f64>]) -> Vec<[f64; 3]> {
    let place = |pose: &Isometry3<f64>| pose.translation.vector.into();
    poses.iter().map(place).collect()
}

/// Times of the points of a motion: the step, and how many there are.
pub(crate) fn times(duration: f64) -> (f64, usize) {
    let step = STEP_S.max(duration / POINTS);
    (step, (duration / step).ceil() as usize + 1)
}

impl Traced {
    /// The motion through a list of poses (m) of a tool without an arm.
    ///
    /// # Errors
    /// Why there is no motion.
    ///
    /// ```
    /// use measure::Traced;
    /// use nalgebra::Isometry3;
    /// use trajectory::{ToolLimits, smooth};
    /// let limits = ToolLimits { speed: 0.5, acceleration: 5.0, jerk: 100.0, ..ToolLimits::UNLIMITED };
    /// let poses = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]].map(|[x, y]| Isometry3::translation(x, y, 0.0));
    /// let traced = Traced::free(&poses, &smooth::SmoothOptions::new(0.001, limits)).unwrap();
    /// assert_eq!(traced.points[0], [0.0, 0.0, 0.0]);
    /// assert_eq!(traced.passes[0].index, 1);
    /// assert!(traced.duration > traced.lower_bound);
    /// ```
    pub fn free(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<Self, String> {
        let plan = plan(poses, options).map_err(|error| error.to_string())?;
        let certificate = plan.certificate();
        let pass = |pass: &trajectory::smooth::Crossing| TracedPass {
            index: pass.index,
            deviation: pass.deviation,
            tolerance: pass.tolerance,
            time: pass.time,
        };
        let active = |span: &trajectory::timing::ActiveSpan| TracedLimit {
            limit: span.limit.to_string(),
            start: span.start,
            end: span.end,
        };
        let (step, count) = times(plan.duration());
        Ok(Self {
            poses: places(poses),
            duration: plan.duration(),
            lower_bound: certificate.lower_bound,
            exact_stop: Some(plan.exact_stop()),
            step,
            points: (0..count).map(|k| point(&plan, k as f64 * step)).collect(),
            joints: Vec::new(),
            passes: plan.crossings().iter().map(pass).collect(),
            active: certificate.active.iter().map(active).collect(),
        })
    }

    /// What a certificate says of passes and limits.
    pub(crate) fn certified(self, certificate: &MoveCertificate) -> Self {
        let passes = certificate.poses.iter().map(|pass| TracedPass {
            index: pass.index,
            deviation: pass.deviation_m,
            tolerance: pass.tolerance_m,
            time: pass.time_s,
        });
        let active = certificate.active.iter().map(|span| TracedLimit {
            limit: span.limit.clone(),
            start: span.start_s,
            end: span.end_s,
        });
        Self {
            lower_bound: certificate.lower_bound_s,
            passes: passes.collect(),
            active: active.collect(),
            ..self
        }
    }
}

fn point(plan: &SmoothPlan, time: f64) -> [f64; 3] {
    let place: Vector3<f64> = plan.at(time).pose.translation.vector;
    place.into()
}
