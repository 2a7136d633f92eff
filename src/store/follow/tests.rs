use super::*;
use std::fs;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Instant, SystemTime};

/// Nothing takes so long, unless it never comes.
const DEADLINE: Duration = Duration::from_secs(20);

struct Desk {
    folder: tempfile::TempDir,
    files: Files,
    follow: Follow,
    woken: Receiver<()>,
}

impl Desk {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, content: &str) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), content).unwrap();
    }

    /// As editors do that never leave half a file behind.
    fn replace(&self, name: &str, content: &str) {
        self.write("aside.tmp", content);
        fs::rename(self.path("aside.tmp"), self.path(name)).unwrap();
    }

    fn rename(&self, from: &str, to: &str) {
        fs::rename(self.path(from), self.path(to)).unwrap();
    }

    /// Reads files, and follows them from here on: what happens next is seen only if it is heard of.
    fn read(&mut self, names: &[&str]) {
        self.files.forget();
        names.iter().for_each(|name| drop(self.files.read(&self.path(name))));
        self.follow.depend_on(&self.files);
        self.follow.changed();
    }

    /// Waits until exactly these differ from what was read.
    #[track_caller]
    fn sees(&mut self, names: &[&str]) {
        let expected: Vec<PathBuf> = names.iter().map(|name| self.path(name)).collect();
        self.waits(|changed| changed == expected, &expected);
    }

    /// That nothing is reported of all that was done so far: the first report is of another file.
    #[track_caller]
    fn sees_nothing_until(&mut self, other: &str) {
        self.write(other, "a real change");
        let expected = [self.path(other)];
        self.waits(|changed| !changed.is_empty(), &expected);
        assert_eq!(self.follow.changed(), expected);
    }

    #[track_caller]
    fn waits(&mut self, done: impl Fn(&[PathBuf]) -> bool, expected: &[PathBuf]) {
        let started = Instant::now();
        loop {
            let changed = self.follow.changed();
            if done(&changed) {
                return;
            }
            let left = DEADLINE.checked_sub(started.elapsed());
            let left = left.unwrap_or_else(|| panic!("{expected:?} never changed, but {changed:?}"));
            self.woken.recv_timeout(left).ok();
        }
    }
}

/// Runs a test where the system reports changes, and where it does not.
fn both(test: fn(&mut Desk)) {
    for polls in [false, true] {
        let (wake, woken) = channel();
        let wake = move || _ = wake.send(());
        let mut follow = if polls { Follow::polling(wake) } else { Follow::new(wake) };
        if polls {
            start_polling(Arc::downgrade(&follow.shared));
        } else {
            assert_eq!(follow.warning(), None, "this system reports changes");
        }
        test(&mut Desk { folder: tempfile::tempdir().unwrap(), files: Files::default(), follow, woken });
    }
}

#[test]
fn a_file_saved_in_place_or_by_renaming_is_seen() {
    both(|desk| {
        desk.write("a", "one");
        desk.write("b", "one");
        for round in 0..3 {
            desk.read(&["a", "b"]);
            desk.write("a", &format!("in place {round}"));
            desk.sees(&["a"]);
            desk.read(&["a", "b"]);
            // As long as before, and soon after.
            desk.replace("a", &format!("replaced {round}"));
            desk.replace("b", &format!("tw{round}"));
            desk.sees(&["a", "b"]);
        }
    });
}

#[test]
fn what_was_taken_back_is_no_change() {
    both(|desk| {
        desk.write("a", "one");
        desk.write("b", "one");
        desk.read(&["a", "b"]);
        desk.write("a", "two");
        desk.sees(&["a"]);
        assert_eq!(desk.follow.changed(), [desk.path("a")], "until it is read");
        desk.replace("a", "one");
        desk.sees(&[]);
        desk.sees_nothing_until("b");
    });
}

#[test]
fn touches_reads_and_other_files_are_no_change() {
    both(|desk| {
        desk.write("a", "one");
        desk.write("b", "one");
        desk.read(&["a", "b"]);
        for i in 0..5 {
            fs::File::options().write(true).open(desk.path("a")).unwrap().set_modified(SystemTime::now()).unwrap();
            desk.write("a", "one");
            desk.replace("a", "one");
            desk.write("picture.png", &i.to_string());
            desk.replace("picture.png", "another");
            fs::read(desk.path("a")).unwrap();
        }
        desk.sees_nothing_until("b");
    });
}

/// Whoever looks because a file was read, and reads it for that, never ends.
#[test]
fn reading_wakes_nobody_nor_do_strangers() {
    use notify::event::{AccessKind, AccessMode, CreateKind, DataChange, Flag, RemoveKind};
    let trail = Trail::to([PathBuf::from("/there/is/none")].iter());
    let event = |kind, path: &str| DebouncedEvent::new(notify::Event::new(kind).add_path(path.into()), Instant::now());
    let modified = EventKind::Modify(ModifyKind::Data(DataChange::Any));
    let written = EventKind::Access(AccessKind::Close(AccessMode::Write));
    for kind in [modified, written, EventKind::Create(CreateKind::Any), EventKind::Remove(RemoveKind::Any)] {
        assert!(trail.is_met_by(&event(kind, "/there")) && trail.is_met_by(&event(kind, "/THERE")), "{kind:?}");
        assert!(!trail.is_met_by(&event(kind, "/picture.png")), "{kind:?}");
    }
    for mode in [AccessMode::Any, AccessMode::Read] {
        for kind in [AccessKind::Open(mode), AccessKind::Close(mode), AccessKind::Read] {
            assert!(!trail.is_met_by(&event(EventKind::Access(kind), "/there")), "{kind:?}");
        }
    }
    let missed = notify::Event::new(EventKind::Other).set_flag(Flag::Rescan);
    let missed = DebouncedEvent::new(missed, Instant::now());
    assert!(trail.is_met_by(&missed) && trail.is_moved_by(&missed));
    assert!(trail.is_moved_by(&event(EventKind::Remove(RemoveKind::Folder), "/")));
    assert!(!trail.is_moved_by(&event(modified, "/")));
}

#[test]
fn files_that_were_read_before_an_edit_and_followed_after_it_are_seen() {
    both(|desk| {
        desk.write("a", "one");
        desk.files.forget();
        desk.files.read(&desk.path("a")).unwrap();
        desk.write("a", "two");
        // Read again meanwhile, as a material of two things: one of them is made of the old content.
        desk.files.read(&desk.path("a")).unwrap();
        desk.follow.depend_on(&desk.files);
        desk.sees(&["a"]);
    });
}

#[test]
fn files_may_vanish_and_come_back_and_appear() {
    both(|desk| {
        desk.write("a", "one");
        desk.read(&["a", "missing", "no/such/folder/missing"]);
        fs::remove_file(desk.path("a")).unwrap();
        desk.sees(&["a"]);
        desk.read(&["a", "missing", "no/such/folder/missing"]);
        desk.write("a", "one");
        desk.sees(&["a"]);
        desk.write("missing", "here");
        desk.sees(&["a", "missing"]);
        desk.write("no/such/folder/missing", "here");
        desk.sees(&["a", "missing", "no/such/folder/missing"]);
        desk.read(&["no/such/folder/missing"]);
        desk.write("no/such/folder/missing", "new");
        desk.sees(&["no/such/folder/missing"]);
        // A folder where the file was cannot be read.
        fs::remove_file(desk.path("a")).unwrap();
        desk.read(&["a"]);
        fs::create_dir(desk.path("a")).unwrap();
        desk.write("b", "one");
        desk.read(&["a", "b"]);
        fs::remove_dir(desk.path("a")).unwrap();
        desk.sees_nothing_until("b");
    });
}

#[test]
fn folders_may_be_renamed_made_anew_and_renamed_back() {
    both(|desk| {
        desk.write("outer/inner/a", "one");
        for moved in ["outer", "outer/inner"] {
            desk.read(&["outer/inner/a"]);
            desk.rename(moved, "elsewhere");
            desk.sees(&["outer/inner/a"]);
            // While it is away it is read, and cannot be.
            desk.read(&["outer/inner/a"]);
            desk.rename("elsewhere", moved);
            desk.sees(&["outer/inner/a"]);
            desk.read(&["outer/inner/a"]);
            desk.write("outer/inner/a", moved);
            desk.sees(&["outer/inner/a"]);
            // Away and back before anybody reads it, and another in its place.
            desk.read(&["outer/inner/a"]);
            desk.rename(moved, "elsewhere");
            desk.sees(&["outer/inner/a"]);
            desk.write("outer/inner/a", moved);
            desk.sees(&[]);
            desk.write("outer/inner/a", "two");
            desk.sees(&["outer/inner/a"]);
            fs::remove_dir_all(desk.path("elsewhere")).unwrap();
            // Another with the same content in its place, before anybody looks: the watch went with the first.
            desk.read(&["outer/inner/a", "b"]);
            desk.rename(moved, "elsewhere");
            desk.write("outer/inner/a", "two");
            desk.sees_nothing_until("b");
            for round in ["three", "four", "five"] {
                desk.read(&["outer/inner/a", "b"]);
                desk.write("outer/inner/a", round);
                desk.sees(&["outer/inner/a"]);
            }
            fs::remove_dir_all(desk.path("elsewhere")).unwrap();
            fs::remove_file(desk.path("b")).unwrap();
        }
    });
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_may_be_turned() {
    use std::os::unix::fs::symlink;
    both(|desk| {
        for name in ["first/a", "second/a", "third/c", "fourth/c"] {
            desk.write(name, name);
        }
        desk.write("here/b", "one");
        symlink("../third/c", desk.path("here/file")).unwrap();
        symlink("first", desk.path("folder")).unwrap();
        let turn = |desk: &Desk, link: &str, target: &str| {
            symlink(target, desk.path("aside")).unwrap();
            desk.rename("aside", link);
        };
        let all = ["folder/a", "here/file"];
        desk.read(&all);
        desk.replace("first/a", "new");
        desk.sees(&all[..1]);
        desk.read(&all);
        desk.replace("third/c", "new");
        desk.sees(&all[1..]);
        desk.read(&all);
        turn(desk, "here/file", "../fourth/c");
        desk.sees(&["here/file"]);
        turn(desk, "folder", "second");
        desk.sees(&all);
        desk.read(&all);
        desk.write("second/a", "newer");
        desk.write("fourth/c", "newer");
        desk.sees(&all);
        // Nowhere, and in a circle.
        desk.read(&all);
        turn(desk, "folder", "nowhere");
        turn(desk, "here/file", "file");
        desk.sees(&all);
        desk.read(&all);
        desk.write("nowhere/a", "somewhere");
        desk.sees(&["folder/a"]);
    });
}

#[test]
fn the_way_to_a_file_is_that_of_the_system() {
    let folder = tempfile::tempdir().unwrap();
    let folder = fs::canonicalize(folder.path()).unwrap();
    let walked = Trail::to([folder.join("there/../a")].iter());
    let ends: Vec<_> = walked.folders.iter().filter(|(_, is_end)| **is_end).map(|(folder, _)| folder).collect();
    assert_eq!(ends, [&folder], "there is nothing: the way ends before it turns");
    fs::create_dir(folder.join("there")).unwrap();
    let walked = Trail::to([folder.join("there/../a")].iter());
    assert!(walked.folders[&folder] && !walked.folders.contains_key(&folder.join("there")));
    assert!(walked.names.contains(OsStr::new("a")) && walked.names.contains(OsStr::new("there")));
}

#[test]
fn a_watch_that_cannot_be_had_is_told_once_and_the_files_are_looked_at() {
    let (wake, woken) = channel();
    let mut follow = Follow::new(move || _ = wake.send(()));
    follow.poll(&notify::Error::new(notify::ErrorKind::MaxFilesWatch));
    let warning = follow.warning().expect("it is told").to_string();
    assert!(warning.starts_with("warning: ") && warning.contains("twice a second"), "{warning}");
    assert_eq!(follow.warning(), None);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a"), "one").unwrap();
    let mut desk = Desk { folder, files: Files::default(), follow, woken };
    desk.read(&["a"]);
    desk.write("a", "two");
    desk.sees(&["a"]);
}
