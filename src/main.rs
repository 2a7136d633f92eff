//! Words → one library call → print. No logic.

use clap::Parser;
use diaphane::commands::Words;
use std::process::ExitCode;

fn main() -> ExitCode {
    let words = Words::parse();
    let json = words.wants_json();
    match words.run() {
        Ok(answer) => {
            answer.talk.iter().for_each(|line| eprintln!("{line}"));
            match json {
                true => println!("{:#}", answer.json),
                false => print!("{}", answer.text),
            }
            ExitCode::SUCCESS
        }
        Err(problems) => {
            if json {
                let all: Vec<_> = problems.0.iter().map(|problem| problem.json()).collect();
                println!("{:#}", serde_json::json!({ "problems": all }));
            }
            eprintln!("{problems}");
            ExitCode::from(problems.cause().exit_status())
        }
    }
}
