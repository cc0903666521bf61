use std::io::Read;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use view::Source;

use crate::client::ArmOption;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::printer::Printer;
use crate::{viewing, world_boxes};

/// Show a running arm in the browser, and lead it by hand
///
/// Serves a page on this machine only and prints its address: picture, plots, program and pendant. The
/// address has a token; whoever has it may move the arm, with the second address only watch. From
/// another machine: `ssh -L 8230:127.0.0.1:8230 HOST`, and the same address there. It is a client of
/// the engine and no safety function.
#[derive(Args, Debug)]
pub(crate) struct View {
    #[command(flatten)]
    arm: ArmOption,
    /// Port on 127.0.0.1; 0 takes a free one [default: 8230, or a free one where that is taken]
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// Show the objects of this world too: the database of a plan as it changes, or a workstation
    /// file
    #[arg(long, value_name = "WORLD")]
    world: Option<PathBuf>,
    /// End when standard input ends
    #[arg(long, hide = true)]
    until_end_of_input: bool,
}

impl View {
    /// Serves until it is told to end.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let arm = self.arm.open()?;
        let ended = Arc::new(AtomicBool::new(false));
        if self.until_end_of_input {
            let tell = Arc::clone(&ended);
            std::thread::spawn(move || {
                // Any byte, the end and an error all mean the same.
                let _ = std::io::stdin().read(&mut [0]);
                tell.store(true, Ordering::Relaxed);
            });
        }
        let world = self.world.as_deref().map(world_boxes::reader).transpose()?;
        viewing::serve(printer, (Source::Arm(arm), world), self.port, || {
            ended.load(Ordering::Relaxed)
        })
    }
}
