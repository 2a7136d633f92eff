//! Words → one library call → print. No logic.

use diaphane::commands::{self, Said};
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    // Mesa's choice of a device complains on stderr wherever there is no desktop.
    if std::env::var_os("NODEVICE_SELECT").is_none() {
        // SAFETY: this is the only thread yet, so nobody reads the environment meanwhile.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
    std::panic::set_hook(Box::new(|panic| _ = writeln!(std::io::stderr(), "{}", commands::mistake(panic))));
    let said = std::panic::catch_unwind(|| commands::answer(std::env::args_os()));
    // The hook has said what there is to say.
    let Said { facts, talk, status } = said.unwrap_or_else(|_| Said::unfinished());
    if !talk.is_empty() {
        writeln!(std::io::stderr(), "{}", talk.trim_end()).ok(); // there is no better place to complain
    }
    match commands::print(&facts) {
        Ok(()) => ExitCode::from(status),
        Err(_) => ExitCode::from(Said::unfinished().status),
    }
}
