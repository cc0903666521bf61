//! The live view in a real browser.
//!
//! Without a browser these tests are reported as ignored: `apt-get install chromium-headless-shell`
//! brings one. `UPDATE_EXPECT=1` renews the pictures of docs/view.md.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]
#![allow(clippy::print_stdout, reason = "measured values are printed")]
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(dead_code, reason = "helpers that the other tests use")]

#[path = "../suite/canter.rs"]
mod canter;
mod crowd;
mod devtools;
mod jogs;
mod pages;
mod planned;
mod relay;
mod scene;
mod shapes;
mod strangers;
mod viewers;
mod watcher;

use libtest_mimic::{Arguments, Trial};

macro_rules! trials {
    ($($module:ident::$name:ident)*) => {
        vec![$((concat!(stringify!($module), "::", stringify!($name)), $module::$name as fn())),*]
    };
}

fn main() {
    let alone: Vec<(&str, fn())> = trials! {
        strangers::strangers_are_refused
        viewers::viewers_of_other_programs_look_on
        crowd::ten_pages_at_once
    };
    // Minutes: --run-ignored (nextest) or --ignored runs it.
    let long: Vec<(&str, fn())> = trials! {
        crowd::ten_pages_for_half_an_hour
    };
    let seen: Vec<(&str, fn())> = trials! {
        pages::the_arm_stands_where_the_engine_says
        pages::a_program_is_led_from_the_page
        pages::a_program_goes_step_by_step
        pages::the_past_is_looked_at
        jogs::a_jog_ends_with_every_doubt
        jogs::steps_and_taught_poses
        jogs::a_gamepad_needs_its_enabling_button
        shapes::meshes_of_an_imported_robot_are_drawn
        shapes::objects_of_the_world_are_drawn
        pages::two_pages_fight_for_the_hand
        pages::a_page_of_another_origin_gets_nothing
        pages::a_recording_is_shown
        planned::a_planned_program_is_shown
        planned::lists_of_poses_are_shown
    };
    let mut arguments = Arguments::from_args();
    // Each has an engine and a browser: side by side they would take each other's time.
    arguments.test_threads = Some(1);
    let missing = devtools::installed().is_none();
    if missing {
        eprintln!("no browser is installed: apt-get install chromium-headless-shell brings one");
    }
    let trial = |(name, test): (&str, fn()), ignored: bool| {
        Trial::test(name, move || {
            test();
            Ok(())
        })
        .with_ignored_flag(ignored)
    };
    let mut trials: Vec<Trial> = alone.into_iter().map(|found| trial(found, false)).collect();
    trials.extend(long.into_iter().map(|found| trial(found, true)));
    trials.extend(seen.into_iter().map(|found| trial(found, missing)));
    libtest_mimic::run(&arguments, trials).exit();
}
