//! Valid recordings of another motion than the one that was asked for.

use crcl::{Command, CoordinateFrame, LengthUnit, Pose};
use planner::recorded::Rule;

use crate::damage::{Kind, program};
use crate::scene::Scene;

const SPEED: usize = 1;
const ACCELERATION: usize = 2;
const TOLERANCE: usize = 3;
const JOINT: usize = 4;
const STRAIGHT: usize = 5;
const DWELL: usize = 7;
const SMOOTH: usize = 8;
const TURN: usize = 10;

pub(crate) const KINDS: [Kind; 30] = [
    program(
        "speed: 10 % beyond the program's",
        &[Rule::ToolSpeed, Rule::AngularSpeed],
        |scene| {
            changed(scene, |doing, asked| {
                doing[ACCELERATION] = Command::SetRelativeAcceleration { percent: 60.0 };
                asked[ACCELERATION] = doing[ACCELERATION].clone();
                asked[SPEED] = Command::SetRelativeSpeed { percent: 5.0 };
                doing[SPEED] = Command::SetRelativeSpeed { percent: 5.5 };
            })
        },
    ),
    program(
        "acceleration: 20 % beyond the program's",
        &[Rule::ToolAcceleration, Rule::AngularAcceleration],
        |scene| {
            changed(scene, |doing, _| {
                doing[ACCELERATION] = Command::SetRelativeAcceleration { percent: 14.4 };
            })
        },
    ),
    program(
        "acceleration: 5 % beyond the program's",
        &[Rule::ToolAcceleration, Rule::AngularAcceleration],
        |scene| {
            changed(scene, |doing, _| {
                doing[ACCELERATION] = Command::SetRelativeAcceleration { percent: 12.6 };
            })
        },
    ),
    program(
        "angular speed: twice the one in force",
        &[Rule::AngularSpeed],
        |scene| {
            changed(scene, |doing, asked| {
                for commands in [&mut *doing, &mut *asked] {
                    commands[ACCELERATION] = Command::SetRelativeAcceleration { percent: 60.0 };
                    commands[TURN] = turn_only(scene);
                }
                asked[SPEED] = Command::SetRelativeSpeed { percent: 3.0 };
                doing[SPEED] = Command::SetRelativeSpeed { percent: 6.0 };
            })
        },
    ),
    program(
        "angular acceleration: doubled",
        &[Rule::AngularAcceleration],
        |scene| {
            changed(scene, |doing, asked| {
                for commands in [&mut *doing, &mut *asked] {
                    commands[TURN] = turn_only(scene);
                }
                doing[ACCELERATION] = Command::SetRelativeAcceleration { percent: 6.0 };
                asked[ACCELERATION] = Command::SetRelativeAcceleration { percent: 3.0 };
            })
        },
    ),
    program("MoveTo: ends 1 mm away", &[Rule::End], |scene| {
        changed(scene, |doing, _| {
            doing[JOINT] = Command::MoveTo {
                pose: scene.pose([31.0, 10.0, -20.0], [0.1, 0.0, 0.1]),
            };
        })
    }),
    program("MoveTo: ends turned by 0.001 rad", &[Rule::End], |scene| {
        changed(scene, |doing, _| {
            doing[JOINT] = Command::MoveTo {
                pose: scene.pose([30.0, 10.0, -20.0], [0.1, 0.001, 0.1]),
            };
        })
    }),
    program("straight: ends 0.01 mm away", &[Rule::End], |scene| {
        changed(scene, |doing, _| {
            doing[STRAIGHT] = Command::MoveStraightTo {
                pose: scene.pose([-30.0, 10.01, -20.0], [0.0, 0.25, 0.1]),
            };
        })
    }),
    program("straight: in joint space", &[Rule::StraightLine], |scene| {
        changed(scene, |doing, _| {
            doing[STRAIGHT] = Command::MoveTo {
                pose: scene.straight_goal(),
            };
        })
    }),
    program(
        "straight: with a kink of 0.1 mm",
        &[Rule::StraightLine],
        |scene| by_way_of(scene, &[scene.pose([0.0, 10.1, -20.0], [0.05, 0.125, 0.1])]),
    ),
    program(
        "straight: turns first, then goes",
        &[Rule::OrientationInStep],
        |scene| by_way_of(scene, &[scene.pose([30.0, 10.0, -20.0], [0.0, 0.25, 0.1])]),
    ),
    program(
        "straight: goes first, then turns",
        &[Rule::OrientationInStep],
        |scene| by_way_of(scene, &[scene.pose([-30.0, 10.0, -20.0], [0.1, 0.0, 0.1])]),
    ),
    program(
        "straight: goes back on its way",
        &[Rule::NoReturn],
        |scene| {
            let way = |x: f64| scene.pose([x, 10.0, -20.0], [0.05, 0.125, 0.1]);
            by_way_of(scene, &[way(-10.0), way(10.0)])
        },
    ),
    program(
        "straight: the tool turns about another axis",
        &[Rule::OrientationInStep],
        |scene| by_way_of(scene, &[scene.pose([0.0, 10.0, -20.0], [0.1, 0.125, 0.0])]),
    ),
    program(
        "straight: turns the long way round",
        &[Rule::OrientationInStep],
        |scene| by_way_of(scene, &[scene.pose([0.0, 10.0, -20.0], [0.2, -0.25, 0.1])]),
    ),
    program(
        "turn on the spot: about another axis",
        &[Rule::OrientationInStep],
        |scene| {
            changed(scene, |doing, asked| {
                let goal = turn_only(scene);
                asked[TURN] = goal.clone();
                doing[TURN] = through(&goal, &[scene.pose([-30.0, -20.0, -30.0], [0.2, 0.1, 0.0])]);
            })
        },
    ),
    program(
        "smooth: a pose passed at 1.3 times its tolerance",
        &[Rule::Pass],
        |scene| {
            let mut doing = scene.program();
            let mut asked = scene.program();
            doing[TOLERANCE] = Command::SetIntermediatePointTolerance { tolerance: 5.0 };
            let deviation = scene.largest_deviation(&doing, SMOOTH);
            let tolerance = deviation * 1e3 / 1.3;
            asked[TOLERANCE] = Command::SetIntermediatePointTolerance { tolerance };
            [doing, asked]
        },
    ),
    program(
        "smooth: a pose passed at 1.05 times its tolerance",
        &[Rule::Pass],
        |scene| {
            let mut asked = scene.program();
            let deviation = scene.largest_deviation(&asked, SMOOTH);
            let tolerance = deviation * 1e3 / 1.05;
            asked[TOLERANCE] = Command::SetIntermediatePointTolerance { tolerance };
            [scene.program(), asked]
        },
    ),
    program("smooth: a pose left out", &[Rule::Pass], |scene| {
        smooth(scene, |poses| {
            poses.remove(1);
        })
    }),
    program(
        "smooth: two poses in the other order",
        &[Rule::Corridor],
        |scene| smooth(scene, |poses| poses.swap(0, 1)),
    ),
    program(
        "smooth: the corridor left by 40 mm",
        &[Rule::Corridor],
        |scene| {
            smooth(scene, |poses| {
                poses.insert(1, scene.pose([-10.0, 50.0, -50.0], [0.0, 0.2, 0.1]));
            })
        },
    ),
    program(
        "smooth: the corridor left by 6 mm",
        &[Rule::Corridor],
        |scene| {
            smooth(scene, |poses| {
                for x in [-15.0, -5.0] {
                    poses.insert(1, scene.pose([x, 21.0, -50.0], [0.0, 0.2, 0.1]));
                }
            })
        },
    ),
    program(
        "smooth: a straight line in joint space",
        &[Rule::Pass],
        |scene| {
            changed(scene, |doing, _| {
                doing[SMOOTH] = Command::MoveTo {
                    pose: scene.corners()[3],
                };
            })
        },
    ),
    program(
        "smooth: orientation out of its tolerance at a pose",
        &[Rule::PassOrientation],
        |scene| {
            smooth(scene, |poses| {
                poses[1] = scene.pose([10.0, 10.0, -50.0], [0.0, 0.5, 0.1]);
            })
        },
    ),
    program("smooth: ends 0.01 mm away", &[Rule::End], |scene| {
        smooth(scene, |poses| {
            poses[3] = scene.pose([-30.0, -20.01, -30.0], [0.0, 0.0, 0.0]);
        })
    }),
    program(
        "smooth, tolerance 0: a corner cut by 0.1 mm",
        &[Rule::Pass],
        |scene| {
            changed(scene, |doing, asked| {
                doing[TOLERANCE] = Command::SetIntermediatePointTolerance { tolerance: 0.1 };
                asked[TOLERANCE] = Command::SetIntermediatePointTolerance { tolerance: 0.0 };
            })
        },
    ),
    program("Dwell: 0.1 s of 0.2 s", &[Rule::Duration], |scene| {
        changed(scene, |doing, _| {
            doing[DWELL] = Command::Dwell { seconds: 0.1 };
        })
    }),
    program("units: numbers read as inches", &[Rule::End], |scene| {
        changed(scene, |doing, asked| {
            let small = |command: &mut Command| {
                *command = Command::MoveTo {
                    pose: scene.pose([30.0, 10.0, -20.0], [0.1, 0.0, 0.1]),
                };
            };
            small(&mut doing[JOINT]);
            asked[0] = Command::InitCanon;
            asked[SPEED] = Command::SetLengthUnits {
                unit: LengthUnit::Inch,
            };
        })
    }),
    program("frame: poses meant from the tool", &[Rule::End], |scene| {
        changed(scene, |doing, asked| {
            asked[TOLERANCE] = Command::SetCoordinateFrame {
                frame: CoordinateFrame::ToolTip,
            };
            doing[TOLERANCE] = Command::Message {
                text: String::new(),
            };
        })
    }),
    program(
        "language: a gripper used without one",
        &[Rule::Language],
        |scene| {
            changed(scene, |_, asked| {
                asked[0] = Command::Message {
                    text: "no InitCanon".into(),
                };
            })
        },
    ),
];

/// The scene's program twice: what is done and what was asked for, both to be changed.
fn changed(
    scene: &Scene,
    change: impl Fn(&mut Vec<Command>, &mut Vec<Command>),
) -> [Vec<Command>; 2] {
    let (mut doing, mut asked) = (scene.program(), scene.program());
    change(&mut doing, &mut asked);
    [doing, asked]
}

/// The smooth move goes through other poses.
fn smooth(scene: &Scene, change: impl Fn(&mut Vec<Pose>)) -> [Vec<Command>; 2] {
    changed(scene, |doing, _| {
        let mut poses = scene.corners();
        change(&mut poses);
        doing[SMOOTH] = Command::MoveSmoothlyTo { poses };
    })
}

/// The straight move goes through other poses first, and stops at each.
fn by_way_of(scene: &Scene, poses: &[Pose]) -> [Vec<Command>; 2] {
    changed(scene, |doing, asked| {
        for commands in [&mut *doing, &mut *asked] {
            commands[TOLERANCE] = Command::SetIntermediatePointTolerance { tolerance: 0.0 };
        }
        doing[STRAIGHT] = through(&asked[STRAIGHT].clone(), poses);
    })
}

/// A smooth move through poses to where a move goes.
fn through(goal: &Command, poses: &[Pose]) -> Command {
    let poses = poses.iter().chain(goal.poses()).copied().collect();
    Command::MoveSmoothlyTo { poses }
}

/// A turn where the smooth move ends.
fn turn_only(scene: &Scene) -> Command {
    Command::MoveStraightTo {
        pose: scene.pose([-30.0, -20.0, -30.0], [0.0, 0.4, -0.3]),
    }
}
