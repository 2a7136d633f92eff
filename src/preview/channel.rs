//! For programs: each thing that happens is a line of JSON on stdout, and lines on stdin stand for hands.

use crate::problem::{Cause, Problem};
use serde_json::{Value, json};
use std::io::{BufRead, Write};
use std::path::PathBuf;

/// The words, for people who read the help.
pub const WORDS: &str = "\
With --json each thing that happens is a line on stdout, with `event` one of
  ready drawn baking problem mended screenshot captured refused rebuilt status closed
and these lines on stdin stand for hands:
  resize WxH          the window's size in pixels; 0x0 is a minimised one
  hide, show          the window leaves the screen and comes back
  camera BOOKMARK     look from one of the scene's bookmarks
  orbit X Y           drag by so many pixels; pan X Y, zoom NOTCHES likewise
  frame [OBJECT]      look at one object, or at all
  technique RON       show with this technique
  exposure EV         time S          play, pause
  panel               show or hide the panel
  screenshot [FILE]   write the picture; without a name beside the scene, under a free one
  capture FILE        write the whole window
  status              say how many frames were drawn so far, and what is wrong
  lose-device         as if the driver had crashed
  close";

/// A line of stdin.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    Resize(u32, u32),
    Visible(bool),
    Camera(String),
    Orbit(f64, f64),
    Pan(f64, f64),
    Zoom(f64),
    Frame(Option<String>),
    Technique(String),
    Exposure(f64),
    Time(f64),
    Play(bool),
    Panel,
    Screenshot(Option<PathBuf>),
    Capture(PathBuf),
    Status,
    LoseDevice,
    Close,
}

impl Order {
    fn read(line: &str) -> Option<Order> {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        let rest = rest.trim();
        let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite());
        let two = || rest.split_once(' ').and_then(|(x, y)| Some((number(x)?, number(y.trim())?)));
        let name = || (!rest.is_empty()).then(|| rest.to_string());
        Some(match word {
            "resize" => {
                let (width, height) = rest.split_once('x')?;
                Order::Resize(width.parse().ok()?, height.parse().ok()?)
            }
            "hide" | "show" => Order::Visible(word == "show"),
            "camera" => Order::Camera(name()?),
            "orbit" => two().map(|(x, y)| Order::Orbit(x, y))?,
            "pan" => two().map(|(x, y)| Order::Pan(x, y))?,
            "zoom" => Order::Zoom(number(rest)?),
            "frame" => Order::Frame(name()),
            "technique" => Order::Technique(name()?),
            "exposure" => Order::Exposure(number(rest)?),
            "time" => Order::Time(number(rest)?),
            "play" | "pause" => Order::Play(word == "play"),
            "panel" => Order::Panel,
            "screenshot" => Order::Screenshot(name().map(PathBuf::from)),
            "capture" => Order::Capture(name()?.into()),
            "status" => Order::Status,
            "lose-device" => Order::LoseDevice,
            "close" => Order::Close,
            _ => return None,
        })
    }
}

/// Speaks when programs listen.
pub struct Channel {
    pub open: bool,
}

impl Channel {
    /// Whoever stops listening has heard enough.
    pub fn say(&self, event: &str, mut facts: Value) {
        if self.open {
            if let Value::Object(facts) = &mut facts {
                facts.insert("event".into(), event.into());
            }
            let mut out = std::io::stdout().lock();
            writeln!(out, "{facts}").and_then(|()| out.flush()).ok();
        }
    }

    /// Hands on each line of stdin, on a thread of its own, until it ends.
    pub fn listen(&self, tell: impl Fn(Order) + Send + 'static) {
        if !self.open {
            return;
        }
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                match Order::read(line.trim()) {
                    Some(order) => tell(order),
                    None => {
                        let problem = Problem::new(Cause::Words, format!("`{line}` is no word for a window"));
                        Channel { open: true }.say("refused", json!({ "problems": [problem.json()] }));
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_and_nonsense_is_not() {
        assert_eq!(Order::read("resize 160x120"), Some(Order::Resize(160, 120)));
        assert_eq!(Order::read("orbit 3 -4.5"), Some(Order::Orbit(3.0, -4.5)));
        assert_eq!(
            Order::read("technique FilteredNormals(a: 1)"),
            Some(Order::Technique("FilteredNormals(a: 1)".into()))
        );
        assert_eq!(Order::read("screenshot"), Some(Order::Screenshot(None)));
        for nonsense in ["", "resize", "resize 3", "resize -1x2", "orbit 3", "zoom nan", "camera", "jump"] {
            assert_eq!(Order::read(nonsense), None, "{nonsense}");
        }
    }

    #[test]
    fn every_word_of_the_help_is_understood() {
        for line in WORDS.lines().skip(3) {
            let words = line.trim();
            let filled =
                [("WxH", "9x9"), ("BOOKMARK", "a"), ("X Y", "1 2"), ("RON", "A()"), ("EV", "1"), ("FILE", "a")];
            let first = words.split("  ").next().unwrap_or_default().split(',').next().unwrap_or_default();
            let line = filled.iter().fold(first.to_string(), |line, (a, b)| line.replace(a, b));
            assert!(Order::read(&line).is_some(), "{line}");
        }
    }
}
