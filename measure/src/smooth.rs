//! One case of a benchmark of smooth motions, planned and measured.

use std::time::Instant;

use nalgebra::Isometry3;
use trajectory::smooth::{RESOLUTION, SmoothOptions, Windows, plan};

/// The result of planning one list of poses: a row of `canter bench motion`.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// Number of poses, the start included.
    pub poses: usize,
    /// Time of the motion, s; `None` when the list could not be planned.
    pub motion: Option<f64>,
    /// Time with a stop at each pose, s.
    pub exact_stop: Option<f64>,
    /// Time until the whole motion was planned and certified, s.
    pub planning: f64,
    /// Time until the first part of the motion could start, s.
    pub first: f64,
    /// Greatest deviation / tolerance over the intermediate poses; with
    /// tolerance zero, 0 when all are passed exactly.
    pub deviation_ratio: f64,
    /// Greatest distance from the leg / corridor.
    pub corridor_ratio: f64,
    /// Greatest speed / limit, linear and angular.
    pub velocity_ratio: f64,
    /// Greatest acceleration / limit, linear and angular.
    pub acceleration_ratio: f64,
    /// Greatest jerk / limit, linear and angular.
    pub jerk_ratio: f64,
    /// The certificate holds.
    pub certified: bool,
    /// Parts of the motion that are not the time-optimal spline.
    pub fallbacks: usize,
    /// Why there is no motion.
    pub reason: Option<String>,
}

impl Measure {
    /// A list of so many poses that could not be planned, and why.
    #[must_use]
    pub fn unplanned(poses: usize, reason: String) -> Self {
        Self {
            poses,
            motion: None,
            exact_stop: None,
            planning: 0.0,
            first: 0.0,
            deviation_ratio: 0.0,
            corridor_ratio: 0.0,
            velocity_ratio: 0.0,
            acceleration_ratio: 0.0,
            jerk_ratio: 0.0,
            certified: false,
            fallbacks: 0,
            reason: Some(reason),
        }
    }
}

/// Plans one list of poses for a tool without an arm and measures the result. Poses in m; the first
/// is the start.
///
/// ```
/// use nalgebra::Isometry3;
/// use trajectory::{ToolLimits, smooth};
/// let limits = ToolLimits { speed: 0.5, acceleration: 5.0, jerk: 100.0, ..ToolLimits::UNLIMITED };
/// let poses = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]].map(|[x, y]| Isometry3::translation(x, y, 0.0));
/// let row = measure::smooth::measure(&poses, &smooth::SmoothOptions::new(0.001, limits));
/// assert!(row.certified && row.motion <= row.exact_stop);
/// ```
#[must_use]
pub fn measure(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Measure {
    let clock = Instant::now();
    if let Ok(mut windows) = Windows::new(poses, options) {
        windows.advance();
    }
    let first = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let plan = plan(poses, options);
    let planning = clock.elapsed().as_secs_f64();
    let plan = match plan {
        Ok(plan) => plan,
        Err(error) => {
            return Measure {
                planning,
                first: planning,
                ..Measure::unplanned(poses.len(), error.to_string())
            };
        }
    };
    let certificate = plan.certificate();
    let ratio = |deviation: f64, tolerance: f64| {
        if tolerance > 0.0 {
            deviation / tolerance
        } else {
            deviation / RESOLUTION * 1e-3
        }
    };
    let deviations = plan
        .crossings()
        .iter()
        .map(|pass| ratio(pass.deviation, pass.tolerance));
    Measure {
        motion: Some(plan.duration()),
        exact_stop: Some(plan.exact_stop()),
        deviation_ratio: deviations.fold(0.0, f64::max),
        corridor_ratio: certificate.corridor.ratio,
        velocity_ratio: certificate.speed.ratio.max(certificate.angular_speed.ratio),
        acceleration_ratio: certificate
            .acceleration
            .ratio
            .max(certificate.angular_acceleration.ratio),
        jerk_ratio: certificate.jerk.ratio.max(certificate.angular_jerk.ratio),
        certified: certificate.holds(),
        fallbacks: plan.fallbacks(),
        poses: poses.len(),
        planning,
        first,
        reason: None,
    }
}
