//! Knows when the content of files changed.
//!
//! What is watched are folders, not files: an editor that saves by renaming puts another file into the old one's place,
//! and a watch on the old one would stay with it. Watched is every folder that the system looks into on the way to a
//! file, the targets of links included, so that a folder may vanish and come back, and a link may be turned.
//!
//! That something happened in a folder only says that it is time to look. What counts is whether the content is that which
//! was read: neither a mere touch nor the pictures that the program itself writes beside its scene are changes.

use super::files::{Files, Held};
use crate::problem::Problem;
use notify_debouncer_full::notify::event::{AccessKind, AccessMode, ModifyKind};
use notify_debouncer_full::notify::{self, Config, EventKind, RecommendedWatcher, RecursiveMode};
use notify_debouncer_full::{DebounceEventResult, DebouncedEvent, Debouncer, NoCache, new_debouncer_opt};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, Weak};
use std::time::Duration;

/// How long the system's reports are gathered: editors do several things in a row.
const GATHER: Duration = Duration::from_millis(40);
/// How often is looked where the system does not report.
const POLL: Duration = Duration::from_millis(500);
/// A path with more links on its way leads in a circle.
const LINKS: usize = 40;

/// Follows the files that a picture depends on.
pub struct Follow {
    followed: BTreeMap<PathBuf, Followed>,
    /// None: the files are looked at in intervals.
    watcher: Option<Debouncer<RecommendedWatcher, NoCache>>,
    shared: Arc<Shared>,
    warning: Option<Problem>,
}

struct Followed {
    when_read: Held,
    now: Held,
}

/// What this shares with the thread that hears of events.
struct Shared {
    heard: Mutex<Heard>,
    wake: Mutex<Box<dyn Fn() + Send>>,
}

#[derive(Default)]
struct Heard {
    /// Whether anything happened since the files were last looked at.
    something: bool,
    /// Whether a watched folder came, went or changed its name: a watch stays with the folder, not with the path.
    moved: bool,
    trail: Trail,
}

/// The way to files.
#[derive(Clone, Default, PartialEq, Eq)]
struct Trail {
    /// Free of links. True: not to be told of what happens in it is to miss an edit.
    folders: BTreeMap<PathBuf, bool>,
    /// What is looked up in them, in small letters.
    names: BTreeSet<OsString>,
}

impl Follow {
    /// `wake` is called, mostly from another thread, whenever something may have changed: [`Follow::changed`] says what.
    pub fn new(wake: impl Fn() + Send + 'static) -> Follow {
        let mut follow = Follow::polling(wake);
        match watcher(follow.shared.clone()) {
            Ok(watcher) => follow.watcher = Some(watcher),
            Err(error) => follow.poll(&error),
        }
        follow
    }

    /// From now on these are followed, and only these: all paths that were asked for since [`Files::forget`], found or
    /// not, with what each held when it was read. What changed since then makes a call of `wake`.
    pub fn depend_on(&mut self, files: &Files) {
        let followed = |(path, held)| (path, Followed { when_read: held, now: held });
        self.followed = files.held().into_iter().map(followed).collect();
        self.place();
        // A file may have changed after it was read and before its folder was watched.
        self.shared.hear(false);
    }

    /// The paths whose content differs from what was read, files that came or went included, until
    /// [`Follow::depend_on`] is told that they were read again. It never waits, and costs nothing where nothing happened.
    pub fn changed(&mut self) -> Vec<PathBuf> {
        let something = std::mem::take(&mut self.shared.heard().something);
        if something {
            self.place();
            for (path, followed) in &mut self.followed {
                followed.now = followed.now.now(path);
            }
        }
        let differs = |(_, followed): &(&PathBuf, &Followed)| followed.now.key != followed.when_read.key;
        self.followed.iter().filter(differs).map(|(path, _)| path.clone()).collect()
    }

    /// What there is to say of how the files are followed; once.
    pub fn warning(&mut self) -> Option<Problem> {
        self.warning.take()
    }

    fn polling(wake: impl Fn() + Send + 'static) -> Follow {
        let shared = Shared { heard: Mutex::default(), wake: Mutex::new(Box::new(wake)) };
        Follow { followed: BTreeMap::new(), watcher: None, shared: Arc::new(shared), warning: None }
    }

    /// Watches the folders on the way to the files that are followed.
    fn place(&mut self) {
        let Some(watcher) = &mut self.watcher else { return };
        // What was made or turned while watches were placed may not have been seen: the trail is walked until it stays
        // the same. Somebody may make folders without end, and then is heard of in any case.
        for _ in 0..LINKS {
            let trail = Trail::to(self.followed.keys());
            let old = {
                let mut heard = self.shared.heard();
                let moved = std::mem::take(&mut heard.moved);
                if !moved && heard.trail == trail {
                    return;
                }
                let old = std::mem::replace(&mut heard.trail, trail.clone());
                // A folder that moved took its watch along; nobody knows which one, so all are placed again.
                for folder in old.folders.keys().filter(|folder| moved || !trail.folders.contains_key(*folder)) {
                    watcher.unwatch(folder).ok(); // it may be gone, and its watch with it
                }
                if moved { Trail::default() } else { old }
            };
            for (folder, needed) in trail.folders.iter().filter(|(folder, _)| !old.folders.contains_key(*folder)) {
                match watcher.watch(folder, RecursiveMode::NonRecursive) {
                    Err(error) if *needed && folder.is_dir() => return self.poll(&error),
                    // Of a folder that is passed through little is to be heard, and one that vanished is not on the trail.
                    Err(_) | Ok(()) => {}
                }
            }
        }
    }

    /// Looks in intervals from now on.
    fn poll(&mut self, why: &notify::Error) {
        self.watcher = None;
        let what = format!("the system does not report changes of files: {why}");
        self.warning = Some(Problem::warning(what).hint("they are looked at twice a second instead"));
        start_polling(Arc::downgrade(&self.shared));
    }
}

fn watcher(shared: Arc<Shared>) -> notify::Result<Debouncer<RecommendedWatcher, NoCache>> {
    let hear = move |events: DebounceEventResult| {
        let mut moved = false;
        let matters = match events {
            Ok(events) => {
                let heard = shared.heard();
                moved = events.iter().any(|event| heard.trail.is_moved_by(event));
                moved || events.iter().any(|event| heard.trail.is_met_by(event))
            }
            // Whatever was missed, looking finds it.
            Err(_) => true,
        };
        if matters {
            shared.hear(moved);
        }
    };
    new_debouncer_opt(GATHER, Some(GATHER), hear, NoCache, Config::default())
}

fn start_polling(shared: Weak<Shared>) {
    std::thread::spawn(move || {
        while let Some(shared) = shared.upgrade() {
            shared.hear(false);
            drop(shared);
            std::thread::sleep(POLL);
        }
    });
}

impl Shared {
    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().expect("nobody panics while listening")
    }

    fn hear(&self, moved: bool) {
        {
            let mut heard = self.heard();
            heard.something = true;
            heard.moved |= moved;
        }
        (self.wake.lock().expect("nobody panics while waking"))();
    }
}

impl Trail {
    fn to<'a>(files: impl Iterator<Item = &'a PathBuf>) -> Trail {
        let mut trail = Trail::default();
        files.for_each(|file| trail.walk(file));
        trail
    }

    /// Goes to a file as the system does, one name after another, along each link.
    fn walk(&mut self, file: &Path) {
        // Where there is no current folder there are no relative files either.
        let Ok(file) = std::path::absolute(file) else { return };
        let mut left: Vec<OsString> = parts(&file);
        let mut here = PathBuf::new();
        let mut links = 0;
        while let Some(part) = left.pop() {
            if part == ".." {
                here.pop();
                continue;
            }
            let next = here.join(&part);
            // The root is looked up nowhere.
            if next.parent().is_none() {
                here = next;
                continue;
            }
            let link = std::fs::read_link(&next).ok().filter(|_| links < LINKS);
            let is_end = left.is_empty() || link.is_some() || !next.is_dir();
            self.names.insert(part.to_ascii_lowercase());
            // Nothing below the root comes and goes, but for what is asked for there.
            if is_end || here.parent().is_some() {
                *self.folders.entry(here.clone()).or_default() |= is_end;
            }
            match link {
                Some(target) => {
                    links += 1;
                    left.extend(parts(&target));
                }
                None if is_end => return,
                None => here = next,
            }
        }
    }

    /// Whether an event is one of something that is looked up. Merely being read is not.
    fn is_met_by(&self, event: &DebouncedEvent) -> bool {
        let is_read = match event.kind {
            EventKind::Access(AccessKind::Close(AccessMode::Write)) => false,
            EventKind::Access(_) => true,
            _ => false,
        };
        let is_known = |name: &OsStr| self.names.contains(&name.to_ascii_lowercase());
        let is_known = |path: &PathBuf| path.file_name().is_none_or(is_known);
        event.need_rescan() || !is_read && event.paths.iter().any(is_known)
    }

    fn is_moved_by(&self, event: &DebouncedEvent) -> bool {
        let is_move =
            matches!(event.kind, EventKind::Create(_) | EventKind::Remove(_) | EventKind::Modify(ModifyKind::Name(_)));
        event.need_rescan() || is_move && event.paths.iter().any(|path| self.folders.contains_key(path))
    }
}

/// The names of a path, the last one first. An absolute one begins with its root, which replaces what it is joined to.
fn parts(path: &Path) -> Vec<OsString> {
    let mut parts: Vec<OsString> = Vec::new();
    let mut root = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Prefix(_) | Component::RootDir => root.push(component),
            Component::CurDir => {}
            Component::ParentDir | Component::Normal(_) => parts.push(component.as_os_str().to_os_string()),
        }
    }
    parts.reverse();
    if root.has_root() {
        parts.push(root.into_os_string());
    }
    parts
}

#[cfg(test)]
mod tests;
