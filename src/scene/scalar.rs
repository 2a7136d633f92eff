//! The single values of RON: numbers, texts and characters.

use crate::scene::tree::{Parser, SyntaxError, Value, word_char};

impl Parser<'_> {
    pub(super) fn number(&mut self) -> Result<Value, SyntaxError> {
        let start = self.at;
        let negative = self.peek() == Some('-');
        let signed = self.eat("-") || self.eat("+");
        if signed && self.peek().is_some_and(char::is_alphabetic) {
            let value = match self.run(word_char) {
                "inf" | "inff32" | "inff64" => f64::INFINITY,
                "NaN" | "NaNf32" | "NaNf64" => f64::NAN,
                _ => return Err(self.error(start..self.at, "this is not a number").hint("like 1, -0.5 or 1e-3")),
            };
            return Ok(Value::Number(if negative { -value } else { value }));
        }
        let digits = self.at;
        loop {
            self.run(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.'));
            let so_far = &self.text[digits..self.at];
            let exponent = so_far.ends_with(['e', 'E']) && !so_far.starts_with("0x");
            if !(exponent && (self.eat("-") || self.eat("+"))) {
                break;
            }
        }
        match number(&self.text[digits..self.at]) {
            Some(value) => Ok(Value::Number(if negative { -value } else { value })),
            None => Err(self.error(start..self.at.max(start + 1), "this is not a number").hint("like 1, -0.5 or 1e-3")),
        }
    }

    pub(super) fn string(&mut self) -> Result<String, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let mut out = String::new();
        loop {
            out.push_str(self.run(|c| c != '"' && c != '\\'));
            if self.eat("\"") {
                return Ok(out);
            }
            if self.peek().is_none() {
                return Err(self.error(start..start + 1, "this text never ends").hint("close it with \""));
            }
            out.extend(self.escape()?);
        }
    }

    /// What a backslash and what follows it stand for; nothing, at the end of a line.
    fn escape(&mut self) -> Result<Option<char>, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let c = self.peek();
        self.at += c.map_or(0, char::len_utf8);
        let code = match c {
            Some('n') => return Ok(Some('\n')),
            Some('r') => return Ok(Some('\r')),
            Some('t') => return Ok(Some('\t')),
            Some('0') => return Ok(Some('\0')),
            Some(c @ ('\\' | '"' | '\'')) => return Ok(Some(c)),
            Some('\n') => {
                self.run(char::is_whitespace);
                return Ok(None);
            }
            Some('x') => {
                let rest = self.rest();
                let digits = rest.get(..2).unwrap_or("");
                self.at += digits.len();
                digits
            }
            Some('u') if self.eat("{") => {
                let digits = self.run(|c| c.is_ascii_hexdigit());
                self.eat("}");
                digits
            }
            _ => "",
        };
        let char = u32::from_str_radix(code, 16).ok().and_then(char::from_u32);
        match char {
            Some(c) => Ok(Some(c)),
            None => Err(self
                .error(start..self.at, "this escape means nothing")
                .hint("write \\\\ for one backslash, and / between folders")),
        }
    }

    pub(super) fn char(&mut self) -> Result<Value, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let c = match self.peek() {
            Some('\\') => self.escape()?,
            c => {
                self.at += c.map_or(0, char::len_utf8);
                c
            }
        };
        match (c, self.eat("'")) {
            (Some(c), true) => Ok(Value::Char(c)),
            _ => Err(self.error(start..start + 1, "expected one character between two '").hint("texts stand in \"")),
        }
    }

    /// `r"…"`, `r#"…"#`, or the raw identifier `r#name`.
    pub(super) fn raw(&mut self) -> Result<Value, SyntaxError> {
        let start = self.at;
        self.at += 1;
        let hashes = self.run(|c| c == '#');
        if !self.eat("\"") {
            return Ok(Value::Word(self.run(word_char).to_string()));
        }
        let end = format!("\"{hashes}");
        match self.rest().find(&end) {
            Some(len) => {
                let text = self.rest()[..len].to_string();
                self.at += len + end.len();
                Ok(Value::Text(text))
            }
            None => Err(self.error(start..start + 2, "this text never ends").hint(format!("close it with {end}"))),
        }
    }
}

/// The value of an unsigned number as RON writes it: `1_000`, `1.5e3`, `0xff`, `2u8`, `0.5f32`.
fn number(text: &str) -> Option<f64> {
    let plain = text.replace('_', "");
    for (prefix, radix) in [("0x", 16), ("0o", 8), ("0b", 2)] {
        if let Some(digits) = plain.strip_prefix(prefix) {
            return u128::from_str_radix(digits, radix).ok().map(|n| n as f64);
        }
    }
    const SUFFIXES: [&str; 12] = ["u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "u128", "i128", "f32", "f64"];
    let digits = SUFFIXES.iter().find_map(|s| plain.strip_suffix(s)).unwrap_or(&plain);
    // Rust would also read "infinity" and "nan".
    digits.starts_with(|c: char| c.is_ascii_digit() || c == '.').then(|| digits.parse().ok())?
}
