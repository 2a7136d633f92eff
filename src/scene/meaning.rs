//! Errors of meaning: ranges, names, combinations. They are collected, each at its place.

use crate::problem::Problem;
use crate::scene::de::suggest;
use crate::scene::path::join;
use crate::scene::tree::{Node, Value};
use std::collections::BTreeSet;

/// Nobody reads more errors, nor more warnings, and each costs a look at the whole text.
const MOST: usize = 100;

/// Pictures are drawn with 32-bit numbers, which end at 3e38.
const LARGEST: f64 = 1e30;

fn is_computable(number: f64) -> bool {
    number.abs() <= LARGEST
}

/// What is wrong with what the files mean: found all at once, each thing at its place.
pub struct Judge<'a> {
    pub root: &'a Node,
    pub problems: Vec<Problem>,
    errors: usize,
}

impl<'a> Judge<'a> {
    /// Numbers that are none, or too large, are found at once, wherever they are.
    pub fn new(root: &'a Node) -> Judge<'a> {
        let mut judge = Judge { root, problems: Vec::new(), errors: 0 };
        root.walk("", &mut |path, node| {
            if let Value::Number(n) = node.value
                && !is_computable(n)
                && !judge.full()
            {
                let (what, hint) = match n.is_finite() {
                    true => ("is too large to compute with", format!("at most {LARGEST:e}")),
                    false => ("is not a finite number", "write a number".to_string()),
                };
                judge.add(Problem::files(format!("{} {what}", node.text())).at(node.at()).path(path).hint(hint));
            }
        });
        judge
    }
    /// Whether there are so many errors that looking for more would help nobody.
    pub fn full(&self) -> bool {
        self.errors >= MOST
    }
    fn warnings(&self) -> usize {
        self.problems.len() - self.errors
    }
    /// What is one too many is left out. Warnings leave room for every error: where there is one, there is no scene.
    pub fn add(&mut self, problem: Problem) {
        let alike = if problem.is_error() { self.errors } else { self.warnings() };
        if alike < MOST {
            self.errors += usize::from(problem.is_error());
            self.problems.push(problem);
        }
    }
    pub fn node(&self, path: &str) -> &'a Node {
        self.root.nearest(path)
    }
    /// The value as it was written, or `the default` where it was not.
    pub fn written(&self, path: &str) -> String {
        let text = self.root.get(path).map_or("the default", |node| node.text());
        if text.chars().count() > 40 || text.contains('\n') { "this".to_string() } else { text.to_string() }
    }
    pub fn wrong(&mut self, path: &str, what: impl Into<String>, hint: impl Into<String>) {
        if !self.full() {
            self.add(Problem::files(what).at(self.node(path).at()).path(path).hint(hint));
        }
    }
    pub fn warn(&mut self, path: &str, what: impl Into<String>, hint: impl Into<String>) {
        if self.warnings() < MOST {
            self.add(Problem::warning(what).at(self.node(path).at()).path(path).hint(hint));
        }
    }
    /// What was found elsewhere, on behalf of the value at `path`.
    pub fn found(&mut self, path: &str, problem: Problem) {
        self.add(Problem { path: Some(path.to_string()), ..problem });
    }

    /// That each of `values` is `allowed`; what cannot be computed with was said already.
    pub fn all(&mut self, path: &str, values: &[f64], allowed: impl Fn(f64) -> bool, range: &str) {
        if !self.full() && values.iter().all(|v| is_computable(*v)) && !values.iter().all(|v| allowed(*v)) {
            // One number of several is marked by itself where it is written by itself.
            let member = values.iter().position(|v| !allowed(*v)).map(|i| format!("{path}.{i}"));
            let place = match member.filter(|m| values.len() > 1 && self.root.get(m).is_some()) {
                Some(member) => member,
                None => path.to_string(),
            };
            let node = self.node(&place);
            let what = format!("{} is not allowed", self.written(&place));
            self.add(Problem::files(what).at(node.at()).path(path).hint(range));
        }
    }
    /// That a name is not empty and not among `seen`.
    pub fn name(&mut self, path: &str, name: &str, seen: &mut BTreeSet<String>) {
        if name.trim().is_empty() {
            self.wrong(&join(path, "name"), "a name cannot be empty", "give it a name: messages and --set use it");
        } else if !seen.insert(name.to_string()) {
            self.wrong(&join(path, "name"), format!("`{name}` is the name of another one too"), "choose another name");
        }
    }
    /// That `word`, in the brackets of the value at `path`, is one of `known`.
    pub fn known(&mut self, path: &str, word: &str, what: &str, known: &[&str]) {
        if !known.contains(&word) {
            let problem = Problem::files(format!("there is no {what} `{word}`"));
            let at = self.node(&format!("{path}.0")).at();
            self.add(problem.at(at).path(path).hint(suggest(word, known.iter().copied())));
        }
    }
}
