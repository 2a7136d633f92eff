//! RON as a tree in which every value knows where it was written.
//!
//! serde forgets positions, and `ron::Value` forgets the names of enum variants, but errors of meaning, `base:`, `--set`
//! and `--defaults` need both. So a file is parsed once into a [`Node`]; [`super::de`] reads typed values from it, and a
//! node that was inherited or set on the command line still points to the text that it came from. The parser is
//! tolerant, since the ron crate has the last word on what is RON; it is bounded in depth and in the number of values.

use crate::problem::At;
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How deep brackets may be nested.
pub(super) const MAX_DEPTH: usize = 64;
/// How many values a text may hold: a scene has thousands.
const MAX_NODES: usize = 1_000_000;

/// A text that values are read from.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// As shown in messages.
    pub file: PathBuf,
    /// What paths in it are relative to.
    pub dir: PathBuf,
    pub text: String,
}

impl Source {
    pub fn at(&self, span: Range<usize>) -> At {
        At::span(&self.file, &self.text, span)
    }
    /// A text that is the content of `path`.
    pub fn of_file(path: &Path, text: String) -> Arc<Source> {
        let dir = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Arc::new(Source { file: shown(path), dir, text })
    }
    /// Words of the command line; paths in them are relative to `dir`.
    pub fn of_flag(flag: &str, dir: &Path, text: String) -> Arc<Source> {
        Arc::new(Source { file: PathBuf::from(flag), dir: dir.to_path_buf(), text })
    }
}

/// `scenes/../materials/a.ron` as `materials/a.ron`, for messages only: behind a symbolic link it may be another file.
pub fn shown(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut out = PathBuf::new();
    for part in path.components() {
        match (part, out.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                out.pop();
            }
            _ => out.push(part),
        }
    }
    if out.as_os_str().is_empty() { PathBuf::from(".") } else { out }
}

/// One value and its place.
#[derive(Clone, Debug)]
pub struct Node {
    pub source: Arc<Source>,
    pub span: Range<usize>,
    pub value: Value,
}

#[derive(Clone, Debug)]
pub enum Value {
    /// The value as f64; the text has the digits of an integer. NaN and infinities are numbers here.
    Number(f64),
    Bool(bool),
    Text(String),
    Char(char),
    List(Vec<Node>),
    Map(Vec<(Node, Node)>),
    /// `Name`
    Word(String),
    /// `Name(a, b)` or `(a, b)`; also `Name()` and `()`
    Tuple(Option<String>, Vec<Node>),
    /// `Name(a: 1)` or `(a: 1)`
    Struct(Option<String>, Vec<Field>),
}

#[derive(Clone, Debug)]
pub struct Field {
    pub name: String,
    pub source: Arc<Source>,
    pub name_span: Range<usize>,
    pub value: Node,
}

/// What is wrong with the text, and where in it.
#[derive(Debug)]
pub struct SyntaxError {
    pub span: Range<usize>,
    pub what: String,
    pub hint: Option<String>,
}

impl Node {
    /// Parses the part of `source` from byte `start` on.
    pub fn parse(source: &Arc<Source>, start: usize) -> Result<Node, SyntaxError> {
        let mut parser = Parser { source, text: &source.text, at: start, nodes: 0 };
        parser.attributes()?;
        let root = parser.value(0)?;
        parser.blank()?;
        if parser.at < parser.text.len() {
            return Err(parser.wrong("there is more text after the end of the value").hint("one file holds one value"));
        }
        Ok(root)
    }

    pub fn at(&self) -> At {
        self.source.at(self.span.clone())
    }
    pub fn text(&self) -> &str {
        &self.source.text[self.span.clone()]
    }
    /// `Sphere` of `Sphere(radius: 2)`.
    pub fn name(&self) -> Option<&str> {
        match &self.value {
            Value::Word(name) | Value::Tuple(Some(name), _) | Value::Struct(Some(name), _) => Some(name),
            _ => None,
        }
    }
    /// The fields of a struct; `()` and `Name()` are structs without fields too.
    pub fn fields(&self) -> Option<&[Field]> {
        match &self.value {
            Value::Struct(_, fields) => Some(fields),
            Value::Tuple(_, items) if items.is_empty() => Some(&[]),
            _ => None,
        }
    }
    pub fn field(&self, name: &str) -> Option<&Node> {
        self.fields()?.iter().find(|f| f.name == name).map(|f| &f.value)
    }

    /// `x` of `Some(x)`, which may be left out.
    pub fn unwrapped(&self) -> &Node {
        match &self.value {
            Value::Tuple(Some(name), items) if name == "Some" && items.len() == 1 => items[0].unwrapped(),
            _ => self,
        }
    }
    /// What stands in the brackets of `Name(a: 1)`: the same without its name. `Name` alone has nothing there.
    pub fn content(&self) -> Node {
        let value = match &self.value {
            Value::Word(_) => Value::Tuple(None, Vec::new()),
            Value::Tuple(_, items) => Value::Tuple(None, items.clone()),
            Value::Struct(_, fields) => Value::Struct(None, fields.clone()),
            value => value.clone(),
        };
        Node { value, ..self.clone() }
    }

    /// The value again as RON in one line, without comments: the same for every way of writing the same thing.
    pub fn canonical(&self) -> String {
        fn join<'a, T: 'a>(items: impl IntoIterator<Item = &'a T>, one: impl Fn(&T) -> String) -> String {
            items.into_iter().map(one).collect::<Vec<_>>().join(", ")
        }
        let name = self.name().unwrap_or_default();
        match &self.value {
            Value::Word(_) => name.to_string(),
            Value::Tuple(_, items) => {
                let comma = if items.len() == 1 && name.is_empty() { "," } else { "" };
                format!("{name}({}{comma})", join(items, Node::canonical))
            }
            Value::Struct(_, fields) => {
                format!("{name}({})", join(fields, |f| format!("{}: {}", f.name, f.value.canonical())))
            }
            Value::List(items) => format!("[{}]", join(items, Node::canonical)),
            Value::Map(items) => {
                format!("{{{}}}", join(items, |(k, v)| format!("{}: {}", k.canonical(), v.canonical())))
            }
            Value::Number(_) | Value::Bool(_) | Value::Text(_) | Value::Char(_) => self.text().to_string(),
        }
    }
}

impl SyntaxError {
    pub(super) fn hint(mut self, hint: impl Into<String>) -> SyntaxError {
        self.hint = Some(hint.into());
        self
    }
}

pub(super) struct Parser<'a> {
    source: &'a Arc<Source>,
    pub(super) text: &'a str,
    /// The byte that is read next.
    pub(super) at: usize,
    nodes: usize,
}

fn word_start(c: char) -> bool {
    c == '_' || c.is_alphabetic()
}
pub(super) fn word_char(c: char) -> bool {
    c == '_' || c.is_alphanumeric()
}

impl<'a> Parser<'a> {
    pub(super) fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }
    pub(super) fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }
    pub(super) fn eat(&mut self, token: &str) -> bool {
        let found = self.rest().starts_with(token);
        if found {
            self.at += token.len();
        }
        found
    }
    pub(super) fn run(&mut self, of: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let len = rest.find(|c| !of(c)).unwrap_or(rest.len());
        self.at += len;
        &rest[..len]
    }
    pub(super) fn error(&self, span: Range<usize>, what: impl Into<String>) -> SyntaxError {
        SyntaxError { span, what: what.into(), hint: None }
    }
    /// An error at the next character.
    fn wrong(&self, what: impl Into<String>) -> SyntaxError {
        self.error(self.at..self.at + self.peek().map_or(0, char::len_utf8), what)
    }
    fn found(&self) -> String {
        match self.peek() {
            Some(c) => format!("found `{}`", c.escape_debug()),
            None => "found the end of the text".to_string(),
        }
    }

    /// Skips white space and comments.
    fn blank(&mut self) -> Result<(), SyntaxError> {
        loop {
            self.run(|c| matches!(c, ' ' | '\t'..='\r' | '\u{85}' | '\u{200e}' | '\u{200f}' | '\u{2028}' | '\u{2029}'));
            if self.eat("//") {
                self.run(|c| c != '\n');
            } else if self.rest().starts_with("/*") {
                let start = self.at;
                let mut level = 0;
                loop {
                    if self.eat("/*") {
                        level += 1;
                    } else if self.eat("*/") {
                        level -= 1;
                        if level == 0 {
                            break;
                        }
                    } else if let Some(c) = self.peek() {
                        self.at += c.len_utf8();
                    } else {
                        return Err(self.error(start..start + 2, "this comment never ends").hint("close it with */"));
                    }
                }
            } else {
                return Ok(());
            }
        }
    }

    /// `#![enable(implicit_some)]` and its like stand before the value.
    fn attributes(&mut self) -> Result<(), SyntaxError> {
        self.blank()?;
        while self.rest().starts_with("#!") {
            let start = self.at;
            self.run(|c| c != ']' && c != '\n');
            if !self.eat("]") {
                return Err(self.error(start..start + 2, "this attribute never ends").hint("close it with ]"));
            }
            self.blank()?;
        }
        Ok(())
    }

    fn node(&mut self, start: usize, value: Value) -> Result<Node, SyntaxError> {
        self.nodes += 1;
        if self.nodes > MAX_NODES {
            let what = format!("the text holds more than {MAX_NODES} values");
            return Err(self.error(start..self.at, what).hint("put what is large into a mesh or an image"));
        }
        Ok(Node { source: self.source.clone(), span: start..self.at, value })
    }

    fn value(&mut self, depth: usize) -> Result<Node, SyntaxError> {
        self.blank()?;
        let start = self.at;
        if depth > MAX_DEPTH {
            return Err(self
                .wrong(format!("brackets are nested more than {MAX_DEPTH} deep"))
                .hint("close some before"));
        }
        let value = match self.peek() {
            Some('(') => self.parens(None, depth)?,
            Some('[') => Value::List(self.items('[', ']', |p| p.value(depth + 1))?),
            Some('{') => self.map(depth)?,
            Some('"') => Value::Text(self.string()?),
            Some('\'') => self.char()?,
            Some('0'..='9' | '+' | '-' | '.') => self.number()?,
            Some('r') if self.rest().starts_with("r\"") || self.rest().starts_with("r#") => self.raw()?,
            Some('b') if matches!(self.rest().as_bytes().get(1), Some(b'"' | b'\'')) => {
                self.at += 1;
                return Err(self.wrong("bytes are not a value of these files").hint("leave out the b"));
            }
            Some(c) if word_start(c) => match self.run(word_char) {
                "true" => Value::Bool(true),
                "false" => Value::Bool(false),
                "inf" | "inff32" | "inff64" => Value::Number(f64::INFINITY),
                "NaN" | "NaNf32" | "NaNf64" => Value::Number(f64::NAN),
                name => {
                    let end = self.at;
                    self.blank()?;
                    if self.peek() == Some('(') {
                        self.parens(Some(name.to_string()), depth)?
                    } else {
                        self.at = end;
                        Value::Word(name.to_string())
                    }
                }
            },
            _ => {
                let hint = "a number, true or false, a \"text\", a [list], a {map}, a (struct) or a Name(…)";
                return Err(self.wrong(format!("expected a value, {}", self.found())).hint(hint));
            }
        };
        self.node(start, value)
    }

    fn map(&mut self, depth: usize) -> Result<Value, SyntaxError> {
        let mut seen = BTreeSet::new();
        let items = self.items('{', '}', |p| {
            let key = p.value(depth + 1)?;
            if !seen.insert(key.canonical()) {
                let what = format!("{} is given twice", key.text());
                return Err(p.error(key.span, what).hint("keep one of them"));
            }
            p.colon("a key")?;
            Ok((key, p.value(depth + 1)?))
        })?;
        Ok(Value::Map(items))
    }

    fn colon(&mut self, after: &str) -> Result<(), SyntaxError> {
        self.blank()?;
        match self.eat(":") {
            true => Ok(()),
            false => Err(self.wrong(format!("expected `:` after {after}, {}", self.found())).hint("name: value")),
        }
    }

    /// What stands between `open` and `close`, separated by commas; the last comma may be left out.
    fn items<T>(
        &mut self,
        open: char,
        close: char,
        mut item: impl FnMut(&mut Self) -> Result<T, SyntaxError>,
    ) -> Result<Vec<T>, SyntaxError> {
        let start = self.at;
        self.at += open.len_utf8();
        let mut items = Vec::new();
        loop {
            self.blank()?;
            if self.peek().is_none() {
                return Err(self
                    .error(start..start + 1, format!("this `{open}` is never closed"))
                    .hint(format!("write `{close}` where it ends")));
            }
            if self.peek() == Some(close) {
                self.at += close.len_utf8();
                return Ok(items);
            }
            items.push(item(self)?);
            self.blank()?;
            if !self.eat(",") && self.peek() != Some(close) && self.peek().is_some() {
                return Err(self
                    .wrong(format!("expected `,` or `{close}`, {}", self.found()))
                    .hint("a comma stands between two values"));
            }
        }
    }

    /// A struct when `name:` follows, else a tuple.
    fn parens(&mut self, name: Option<String>, depth: usize) -> Result<Value, SyntaxError> {
        let start = self.at;
        self.at += 1;
        self.blank()?;
        let is_struct = self.field_name().is_some() && self.blank().is_ok() && self.peek() == Some(':');
        self.at = start;
        if !is_struct {
            return Ok(Value::Tuple(name, self.items('(', ')', |p| p.value(depth + 1))?));
        }
        let mut fields: Vec<Field> = Vec::new();
        let all = self.items('(', ')', |p| {
            let at = p.at;
            let Some(name) = p.field_name() else {
                return Err(p.wrong(format!("expected the name of a field, {}", p.found())).hint("name: value"));
            };
            let name_span = at..p.at;
            p.colon(&format!("`{name}`"))?;
            let value = p.value(depth + 1)?;
            Ok(Field { name: name.to_string(), source: p.source.clone(), name_span, value })
        })?;
        let mut seen = BTreeSet::new();
        for field in all {
            if !seen.insert(field.name.clone()) {
                let what = format!("`{}` is given twice", field.name);
                return Err(self.error(field.name_span, what).hint("keep one of them"));
            }
            fields.push(field);
        }
        Ok(Value::Struct(name, fields))
    }

    fn field_name(&mut self) -> Option<&'a str> {
        self.eat("r#");
        self.peek().filter(|c| word_start(*c))?;
        Some(self.run(word_char))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Node, SyntaxError> {
        Node::parse(&Source::of_file(Path::new("a.ron"), text.to_string()), 0)
    }

    #[test]
    fn every_form_of_value_is_read() {
        let text = r##"/* a /* nested */ comment */ Name( // to the end
            a: -1.5e-3, b: [0xff, 1_000, 2u8,], c: {"k": 'x', "l": '\''}, d: r#"raw " text"#, e: "\u{e9}\n\
              joined", f: Word, g: Name(), h: (), i: (1,), j: Variant(x: Some(true)), r#k: -inf, )"##;
        assert_eq!(
            parse(text).unwrap().canonical(),
            "Name(a: -1.5e-3, b: [0xff, 1_000, 2u8], c: {\"k\": 'x', \"l\": '\\''}, d: r#\"raw \" text\"#, \
             e: \"\\u{e9}\\n\\\n              joined\", f: Word, g: Name(), h: (), i: (1,), j: Variant(x: Some(true)), k: -inf)"
        );
    }

    #[test]
    fn depth_is_bounded() {
        assert!(parse(&format!("{}1{}", "[".repeat(60), "]".repeat(60))).is_ok());
        for open in ["[", "(", "{", "a(", "(a:", "{1:"] {
            assert!(parse(&open.repeat(100_000)).is_err());
        }
    }
}
