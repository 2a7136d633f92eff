//! Panics that a reader catches: allowed in other people's code, never in the project's own.

use std::cell::Cell;
use std::panic::{PanicHookInfo, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static LISTENING: Cell<bool> = const { Cell::new(false) };
    static OWN: Cell<Option<String>> = const { Cell::new(None) };
}

/// Other people's code lies in cargo's registry, and the standard library where it was compiled.
fn is_own(panic: &PanicHookInfo) -> bool {
    let file = panic.location().map(|place| place.file().replace('\\', "/")).unwrap_or_default();
    !(file.contains("/registry/") || file.starts_with("/rustc/") || file.contains("/library/"))
}

/// Does work that may catch panics of other people's code, without a word about them.
pub fn caught<T>(work: impl FnOnce() -> T) -> T {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| match LISTENING.get() {
            true if is_own(panic) => OWN.set(Some(panic.to_string())),
            true => {}
            false => usual(panic),
        }));
    });
    LISTENING.set(true);
    let value = work();
    LISTENING.set(false);
    if let Some(panic) = OWN.take() {
        panic!("caught, but it is the project's own: {panic}");
    }
    value
}
