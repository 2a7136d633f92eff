//! A desktop that nobody sees, and a window on it.

use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

const DEADLINE: Duration = Duration::from_secs(300);

/// A scene that is drawn in no time.
pub fn scene(irradiance: &str) -> String {
    format!(
        r#"Scene(
    version: 1,
    mm_per_unit: 10,
    camera: (eye: (0, 0, 6)),
    bookmarks: {{ "close": (eye: (1, 2, 3)) }},
    lights: [Directional(name: "sun", direction: (-1, 0, -1), irradiance: {irradiance})],
    objects: [(name: "ball", mesh: Sphere(radius: 1, subdivisions: 2), material: "stone.ron")],
    view: (technique: Opaque(), antialias: 1),
)
"#
    )
}

pub const MATERIAL: &str = r#"Material(
    version: 1,
    medium: Preset("marble"),
    filter: Neighbours(sigma_tr: 1, radius: 2),
)
"#;

/// A desktop, a folder, and a window on a scene in it.
pub struct Window {
    xvfb: Child,
    child: Child,
    stdin: ChildStdin,
    events: Receiver<Value>,
    pub seen: Vec<Value>,
    folder: tempfile::TempDir,
    /// The name of the desktop.
    pub display: String,
}

impl Drop for Window {
    fn drop(&mut self) {
        for child in [&mut self.child, &mut self.xvfb] {
            child.kill().ok(); // it may have ended by itself
            child.wait().ok();
        }
    }
}

/// None, and says so where everybody sees it, when there is no desktop to be had.
pub fn window(scene: &str, env: &[(&str, &Path)]) -> Option<Window> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("work")).unwrap();
    std::fs::write(folder.path().join("work/scene.ron"), scene).unwrap();
    std::fs::write(folder.path().join("work/stone.ron"), MATERIAL).unwrap();
    let xvfb = Command::new("Xvfb")
        .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let Ok(mut xvfb) = xvfb else {
        // What is printed by the usual words is swallowed when a test passes.
        std::io::stderr().write_all(b"SKIPPED: no Xvfb, so no window was tried: tools/test installs it\n").unwrap();
        return None;
    };
    let mut display = ":".to_string();
    BufReader::new(xvfb.stdout.take().unwrap()).read_line(&mut display).unwrap();
    let display = display.trim().to_string();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("diaphane"))
        .args(["preview", "work/scene.ron", "--json", "--size", "160x120"])
        .current_dir(folder.path())
        .env("DISPLAY", &display)
        .env("DIAPHANE_CACHE", folder.path().join("cache"))
        .env("NODEVICE_SELECT", "1")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("DIAPHANE_SHADERS")
        .envs(env.iter().copied())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (sender, events) = channel();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    std::thread::spawn(move || {
        for line in lines.map_while(Result::ok) {
            let event = serde_json::from_str(&line).unwrap_or_else(|_| panic!("{line:?} is no event"));
            if sender.send(event).is_err() {
                break;
            }
        }
    });
    let stdin = child.stdin.take().unwrap();
    Some(Window { xvfb, child, stdin, events, seen: Vec::new(), folder, display })
}

impl Window {
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: &str) {
        std::fs::write(self.path(name), content).unwrap();
    }

    pub fn tell(&mut self, words: &str) {
        writeln!(self.stdin, "{words}").unwrap();
    }

    /// The next event for which this holds.
    #[track_caller]
    pub fn until(&mut self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            match self.events.recv_timeout(DEADLINE.saturating_sub(began.elapsed())) {
                Ok(event) => {
                    self.seen.push(event.clone());
                    if holds(&event) {
                        return event;
                    }
                }
                Err(RecvTimeoutError::Timeout) => panic!("no {what}: {:#?}", self.seen),
                Err(RecvTimeoutError::Disconnected) => panic!("it ended without {what}: {:#?}", self.seen),
            }
        }
    }

    #[track_caller]
    pub fn event(&mut self, name: &str) -> Value {
        self.until(name, |event| event["event"] == name)
    }

    /// The next whole picture of what is wanted.
    #[track_caller]
    pub fn picture(&mut self) -> Value {
        self.until("picture", |event| event["event"] == "drawn" && event["current"] == true && event["whole"] == true)
    }

    /// The picture that is shown, or the next one, for which this holds.
    #[track_caller]
    pub fn shows(&mut self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        let drawn = |event: &Value| event["event"] == "drawn";
        match self.seen.iter().rfind(|event| drawn(event)) {
            Some(last) if holds(last) => last.clone(),
            _ => self.until(what, |event| drawn(event) && holds(event)),
        }
    }

    #[track_caller]
    pub fn picture_that_is(&mut self, hash: &Value) -> Value {
        self.shows("such picture", |event| event["picture"] == *hash)
    }

    #[track_caller]
    pub fn status(&mut self) -> Value {
        self.tell("status");
        self.event("status")
    }

    /// Does something again and again until it shows in how things stand.
    #[track_caller]
    pub fn until_status(&mut self, what: &str, mut again: impl FnMut(), holds: impl Fn(&Value) -> bool) -> Value {
        let began = Instant::now();
        loop {
            again();
            // What a hand did is noticed when the window gets to it.
            std::thread::sleep(Duration::from_millis(20));
            match self.status() {
                status if holds(&status) => return status,
                _ if began.elapsed() > DEADLINE => panic!("no {what}: {:#?}", self.seen),
                _ => {}
            }
        }
    }

    #[track_caller]
    pub fn close(mut self) -> ExitStatus {
        self.tell("close");
        self.event("closed");
        let began = Instant::now();
        loop {
            match self.child.try_wait().unwrap() {
                Some(status) => return status,
                None if began.elapsed() > DEADLINE => panic!("it never ended: {:#?}", self.seen),
                None => std::thread::sleep(Duration::from_millis(10)),
            }
        }
    }
}
