//! What came of each input with each column, as one table.

use crate::columns::Column;
use crate::inputs::Input;
use std::collections::BTreeMap;
use std::fmt::Write;

#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    Kept,
    /// It says itself that it cannot do this.
    Refused(String),
    /// It fails, as is known, and why.
    Known(String),
    Failed(String),
}

/// By the places of input and column.
pub type Cells = BTreeMap<(usize, usize), Cell>;

pub fn table(inputs: &[Input], columns: &[Column], cells: &Cells) -> String {
    let mut text = String::new();
    let wide = inputs.iter().map(|input| input.name.chars().count()).max().unwrap_or(0);
    let line = |name: &str, cells: Vec<String>| {
        let cells = cells.iter().zip(columns).map(|(cell, column)| format!("  {cell:<0$}", column.name.len()));
        format!("{name:<wide$}{}", cells.collect::<String>()).trim_end().to_string()
    };
    writeln!(text, "{}", line("", columns.iter().map(|column| column.name.clone()).collect())).expect("a text grows");
    for (i, input) in inputs.iter().enumerate() {
        let row: Vec<Option<&Cell>> = (0..columns.len()).map(|c| cells.get(&(i, c))).collect();
        if row.iter().any(Option::is_some) {
            let words = row.iter().map(|cell| cell.map_or("", Cell::word).to_string()).collect();
            writeln!(text, "{}", line(&input.name, words)).expect("a text grows");
        }
    }
    for (heading, pick) in [
        (
            "FAILED",
            (|cell| if let Cell::Failed(why) = cell { Some(why) } else { None }) as fn(&Cell) -> Option<&String>,
        ),
        ("known to fail", |cell| if let Cell::Known(why) = cell { Some(why) } else { None }),
        ("refused", |cell| if let Cell::Refused(why) = cell { Some(why) } else { None }),
    ] {
        let mut told = cells.iter().filter_map(|(place, cell)| Some((place, pick(cell)?))).peekable();
        if told.peek().is_some() {
            writeln!(text, "\n{heading}:").expect("a text grows");
        }
        for ((i, c), why) in told {
            writeln!(text, "  {} with {}: {why}", inputs[*i].name, columns[*c].name).expect("a text grows");
        }
    }
    text
}

impl Cell {
    fn word(&self) -> &'static str {
        match self {
            Cell::Kept => "ok",
            Cell::Refused(_) => "refused",
            Cell::Known(_) => "known",
            Cell::Failed(_) => "FAILED",
        }
    }
}
