use super::super::{Bake, Step};
use super::*;
use crate::problem::Cause;
use std::sync::Mutex;

/// Counts upwards from what it reads; a bake.
#[derive(serde::Serialize)]
struct Add {
    to: Vec<Slot<i64>>,
    what: i64,
}
impl Step for Add {
    type Output = i64;
    fn name(&self) -> &'static str {
        "test.add"
    }
    fn about(&self) -> String {
        format!("{} more", self.what)
    }
    fn run(&self, run: &Run) -> Result<i64, Problem> {
        if self.what == 13 {
            return Err(Problem::new(Cause::Unfinished, "13 brings bad luck"));
        }
        Ok(self.what + self.to.iter().map(|&slot| *run.get(slot)).sum::<i64>())
    }
}
impl Bake for Add {
    const CODE: &'static [&'static str] = &["src/store/get/"];
}

/// The same, kept in memory only.
#[derive(serde::Serialize)]
struct Show(Slot<i64>);
impl Step for Show {
    type Output = String;
    fn name(&self) -> &'static str {
        "test.show"
    }
    fn about(&self) -> String {
        "a text".into()
    }
    fn run(&self, run: &Run) -> Result<String, Problem> {
        Ok(run.get(self.0).to_string())
    }
}

#[derive(Default)]
struct Log(Mutex<Vec<(String, Origin)>>, Mutex<Vec<String>>);
impl Watch for Log {
    fn finished(&self, finished: &Finished) {
        self.0.lock().unwrap().push((finished.about.clone(), finished.origin));
    }
    fn warn(&self, problem: &Problem) {
        self.1.lock().unwrap().push(problem.what.clone());
    }
}
impl Log {
    fn took(&self) -> Vec<(String, Origin)> {
        std::mem::take(&mut self.0.lock().unwrap())
    }
}

fn chain(first: i64) -> (Plan, Slot<String>) {
    let mut plan = Plan::default();
    let a = plan.bake(Add { to: vec![], what: first });
    let b = plan.bake(Add { to: vec![a], what: 10 });
    let c = plan.bake(Add { to: vec![a, b], what: 100 });
    let text = plan.add(Show(c));
    (plan, text)
}

fn ran(names: &[&str]) -> Vec<(String, Origin)> {
    names.iter().map(|n| (n.to_string(), Origin::Ran)).collect()
}

#[test]
fn only_what_is_downstream_of_an_edit_runs_again_and_undo_is_free() {
    let log = Log::default();
    let mut store = Store::in_memory();
    let ask = |store: &mut Store, first| {
        let (plan, text) = chain(first);
        store.get_with(&plan, text, None, &log).unwrap()
    };
    assert_eq!(*ask(&mut store, 1), "112");
    assert_eq!(log.took(), ran(&["1 more", "10 more", "100 more", "a text"]));
    assert_eq!(*ask(&mut store, 2), "114");
    assert_eq!(log.took().len(), 4);
    assert_eq!(*ask(&mut store, 1), "112"); // undo
    assert_eq!(log.took(), []);
}

#[test]
fn nothing_that_nobody_asked_for_is_made() {
    let log = Log::default();
    let mut plan = Plan::default();
    let wanted = plan.bake(Add { to: vec![], what: 1 });
    plan.bake(Add { to: vec![wanted], what: 2 });
    Store::in_memory().get_with(&plan, wanted, None, &log).unwrap();
    assert_eq!(log.took(), ran(&["1 more"]));
}

#[test]
fn what_no_recent_plan_names_is_dropped() {
    let mut store = Store::in_memory().keep_plans(2);
    for first in 0..10 {
        let (plan, text) = chain(first);
        store.get(&plan, text).unwrap();
    }
    assert_eq!(store.len(), 8);
}

#[test]
fn a_second_store_reads_bakes_from_disk_and_makes_passes() {
    let folder = tempfile::tempdir().unwrap();
    let log = Log::default();
    let (plan, text) = chain(1);
    Store::on_disk(Disk::new(folder.path())).get_with(&plan, text, None, &log).unwrap();
    log.took();
    let mut second = Store::on_disk(Disk::new(folder.path()));
    let states = second.states(&plan, text);
    assert_eq!(states[2], State { origin: Origin::Disk, needed: true });
    assert_eq!(states[0], State { origin: Origin::Disk, needed: false });
    assert_eq!(*second.get_with(&plan, text, None, &log).unwrap(), "112");
    // The last bake is read; what it was made of is not even looked at.
    assert_eq!(log.took(), [("100 more".into(), Origin::Disk), ("a text".into(), Origin::Ran)]);
}

#[test]
fn a_broken_file_is_reported_and_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, text) = chain(1);
    Store::on_disk(Disk::new(folder.path())).get(&plan, text).unwrap();
    let entries = Disk::new(folder.path()).entries().unwrap();
    assert_eq!(entries.len(), 3);
    let whole: Vec<Vec<u8>> = entries.iter().map(|e| std::fs::read(&e.path).unwrap()).collect();
    let shortest = whole.iter().map(Vec::len).min().unwrap();
    for i in 0..shortest {
        for (entry, bytes) in entries.iter().zip(&whole) {
            let mut broken = bytes.clone();
            broken[i] ^= 1;
            std::fs::write(&entry.path, broken).unwrap();
        }
        let log = Log::default();
        let mut store = Store::on_disk(Disk::new(folder.path()));
        assert_eq!(*store.get_with(&plan, text, None, &log).unwrap(), "112");
        assert_eq!(log.took(), ran(&["1 more", "10 more", "100 more", "a text"]), "byte {i} was not noticed");
        assert_eq!(log.1.lock().unwrap().len(), 3);
    }
    // One bake's file in another's place is noticed as well.
    std::fs::copy(&entries[0].path, &entries[1].path).unwrap();
    let mut store = Store::on_disk(Disk::new(folder.path()));
    assert_eq!(*store.get(&plan, text).unwrap(), "112");
}

#[test]
fn a_step_that_fails_loses_nothing_else() {
    let log = Log::default();
    let mut store = Store::in_memory();
    let mut plan = Plan::default();
    let a = plan.bake(Add { to: vec![], what: 1 });
    let bad = plan.bake(Add { to: vec![a], what: 13 });
    let problem = store.get_with(&plan, bad, None, &log).unwrap_err();
    assert_eq!((problem.what.as_str(), problem.cause), ("13 brings bad luck", Cause::Unfinished));
    assert_eq!(*store.get_with(&plan, a, None, &log).unwrap(), 1);
    assert_eq!(log.took(), ran(&["1 more"]));
}

#[test]
fn cancelled_work_stops_and_says_so() {
    let mut store = Store::in_memory();
    store.cancel.cancel();
    let (plan, text) = chain(1);
    let problem = store.get(&plan, text).unwrap_err();
    assert_eq!(problem.cause, Cause::Unfinished);
    assert!(problem.what.contains("interrupted"), "{}", problem.what);
}

#[test]
fn the_name_of_a_bake_holds_its_code() {
    #[derive(serde::Serialize)]
    struct Same(i64);
    impl Step for Same {
        type Output = i64;
        fn name(&self) -> &'static str {
            "test.same"
        }
        fn about(&self) -> String {
            String::new()
        }
        fn run(&self, _: &Run) -> Result<i64, Problem> {
            Ok(self.0)
        }
    }
    impl Bake for Same {
        const CODE: &'static [&'static str] = &["src/store/"];
    }
    let mut plan = Plan::default();
    assert_ne!(plan.bake(Same(1)).key(), plan.add(Same(1)).key());
}

#[test]
fn a_folder_that_cannot_be_written_is_one_warning() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("in-the-way");
    std::fs::write(&file, "").unwrap();
    let log = Log::default();
    let (plan, text) = chain(1);
    let mut store = Store::on_disk(Disk::new(&file));
    assert_eq!(*store.get_with(&plan, text, None, &log).unwrap(), "112");
    let warnings = log.1.lock().unwrap().clone();
    assert_eq!(warnings.iter().filter(|w| w.contains("cannot be kept")).count(), 1, "{warnings:?}");
}

/// A text that only the host can write.
#[derive(serde::Serialize)]
struct Write(Slot<i64>);
impl Step for Write {
    type Output = String;
    fn name(&self) -> &'static str {
        "test.write"
    }
    fn about(&self) -> String {
        "a text of the host".into()
    }
    fn run(&self, run: &Run) -> Result<String, Problem> {
        Ok(format!("{}{}", run.host::<&str>(), run.get(self.0)))
    }
}

#[test]
fn another_thread_makes_what_needs_no_host_and_hands_it_over() {
    let mut plan = Plan::default();
    let a = plan.bake(Add { to: vec![], what: 1 });
    let b = plan.bake(Add { to: vec![a], what: 2 });
    plan.bake(Add { to: vec![a], what: 13 }); // nobody asks for it
    let text = plan.add(Write(b));
    let log = Log::default();
    let mut here = Store::in_memory();
    let missing = here.missing_without_host(&plan, text);
    assert_eq!(missing, [0, 1]);
    let (plan, values) = std::thread::spawn(move || {
        let mut there = Store::in_memory();
        there.bake_each(&plan, missing, &Nobody).unwrap();
        let values = there.held(&plan);
        (plan, values)
    })
    .join()
    .unwrap();
    here.adopt(&plan, values);
    assert!(here.missing_without_host(&plan, text).is_empty());
    assert_eq!(*here.get_with(&plan, text, Some(&"= "), &log).unwrap(), "= 3");
    assert_eq!(log.took(), ran(&["a text of the host"]));
}

#[test]
fn what_is_on_disk_is_work_for_another_thread_too_but_not_what_it_was_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, text) = chain(1);
    Store::on_disk(Disk::new(folder.path())).bake(&plan, &Nobody).unwrap();
    assert_eq!(Store::on_disk(Disk::new(folder.path())).missing_without_host(&plan, text), [2]);
    assert_eq!(Store::in_memory().missing_without_host(&plan, text), [0, 1, 2]);
}

/// A number that goes on from an earlier one.
#[derive(serde::Serialize)]
struct GoOn(Option<Slot<i64>>);
impl Step for GoOn {
    type Output = i64;
    fn name(&self) -> &'static str {
        "test.go_on"
    }
    fn about(&self) -> String {
        "one more".into()
    }
    fn run(&self, run: &Run) -> Result<i64, Problem> {
        Ok(1 + self.0.map_or(0, |slot| *run.get(slot)))
    }
    fn continues(&self) -> Option<Slot<i64>> {
        self.0
    }
}
impl Bake for GoOn {
    const CODE: &'static [&'static str] = &["src/store/get/"];
}

#[test]
fn what_was_gone_on_from_leaves_memory_and_stays_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::on_disk(Disk::new(folder.path()));
    let mut plan = Plan::default();
    let first = plan.bake(GoOn(None));
    let second = plan.bake(GoOn(Some(first)));
    let third = plan.bake(GoOn(Some(second)));
    assert_eq!((*store.get(&plan, third).unwrap(), store.len()), (3, 1));
    assert!(store.has(&plan, first) && store.has(&plan, second));
    // Another store that has it already drops it when it takes over what follows.
    let mut other = Store::in_memory();
    other.get(&plan, first).unwrap();
    assert!(other.has(&plan, first) && !other.has(&plan, third));
    other.adopt(&plan, store.held(&plan));
    assert!(!other.has(&plan, first) && other.has(&plan, third));
    assert_eq!(*store.get(&plan, first).unwrap(), 1);
}
