//! The command line as it is seen from outside: words in; stdout, stderr, exit status and files out.

mod benchmark;
mod comparing;
mod files;
mod mistakes;
mod pictures;
mod truth;
mod words;

use assert_cmd::cargo::cargo_bin_cmd;
use std::path::{Path, PathBuf};

/// A scene that is drawn in no time.
const SCENE: &str = r#"Scene(
    version: 1,
    mm_per_unit: 10,
    camera: (eye: (0, 0, 6)),
    bookmarks: { "close": (eye: (0, 0, 3)) },
    lights: [Directional(name: "sun", direction: (0, 0, -1), irradiance: 3)],
    objects: [(name: "ball", mesh: Sphere(radius: 1, subdivisions: 2), material: "stone.ron")],
    view: (technique: Opaque(), size: (24, 16), antialias: 1),
)
"#;
const MATERIAL: &str = r#"Material(
    version: 1,
    medium: Preset("marble"),
    filter: Neighbours(sigma_tr: 1, radius: 2),
)
"#;

/// A folder to work in, with a cache of its own.
struct Desk(tempfile::TempDir);

/// What a run left behind.
#[derive(Debug)]
struct Ran {
    words: String,
    status: i32,
    out: String,
    err: String,
}

impl Desk {
    /// With `scene.ron` and the `stone.ron` that it names.
    fn new() -> Desk {
        let desk = Desk(tempfile::tempdir().unwrap());
        desk.write("scene.ron", SCENE);
        desk.write("stone.ron", MATERIAL);
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn run(&self, words: &[&str]) -> Ran {
        self.run_with(&[], words)
    }

    fn run_with(&self, env: &[(&str, &str)], words: &[&str]) -> Ran {
        let mut command = cargo_bin_cmd!("diaphane");
        command.current_dir(self.0.path()).args(words);
        // As on a machine without a desktop, whose user wants to see every trace.
        for name in ["NODEVICE_SELECT", "XDG_RUNTIME_DIR", "DIAPHANE_SHADERS"] {
            command.env_remove(name);
        }
        command.env("DIAPHANE_CACHE", self.path("cache")).env("RUST_BACKTRACE", "1").envs(env.iter().copied());
        let output = command.output().unwrap();
        let text = |bytes| String::from_utf8(bytes).expect("what is said is UTF-8");
        let ran = Ran {
            words: words.join(" "),
            status: output.status.code().unwrap_or(-1),
            out: text(output.stdout),
            err: text(output.stderr),
        };
        // Whatever happens, nobody sees the program's insides, the driver's noise, or a bar in a pipe.
        for noise in ["panicked", "backtrace", "XDG_RUNTIME_DIR", "\u{1b}", "\r", "mistake in the program"] {
            assert!(!ran.out.contains(noise) && !ran.err.contains(noise), "{noise:?} in {ran:#?}");
        }
        ran
    }

    /// Whether there is anything to draw with; says so when there is not.
    fn draws(&self) -> bool {
        let draws = self.run(&["doctor"]).status == 0;
        if !draws {
            eprintln!("SKIPPED: there is no adapter to draw with");
        }
        draws
    }

    /// Every file below a folder, sorted.
    fn files(&self, name: &str) -> Vec<PathBuf> {
        fn below(folder: &Path, found: &mut Vec<PathBuf>) {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                match entry.path() {
                    path if path.is_dir() => below(&path, found),
                    path => found.push(path),
                }
            }
        }
        let mut found = Vec::new();
        below(&self.path(name), &mut found);
        found.sort();
        found
    }
}

impl Ran {
    #[track_caller]
    fn ok(self) -> Ran {
        assert_eq!(self.status, 0, "diaphane {}: {self:#?}", self.words);
        self
    }

    /// It ended with `status`, kept stdout free, and said all of `words` on stderr.
    #[track_caller]
    fn fails(self, status: i32, words: &[&str]) -> Ran {
        assert_eq!(self.status, status, "{self:#?}");
        assert!(self.out.is_empty(), "{self:#?}");
        for word in words {
            assert!(self.err.contains(word), "no {word:?} in {self:#?}");
        }
        self
    }

    #[track_caller]
    fn says(self, words: &[&str]) -> Ran {
        for word in words {
            assert!(self.out.contains(word), "no {word:?} in {self:#?}");
        }
        self
    }

    #[track_caller]
    fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error} in {self:#?}"))
    }
}

/// No driver is found with these.
const NO_ADAPTER: [(&str, &str); 2] = [("VK_ICD_FILENAMES", "/nowhere.json"), ("VK_DRIVER_FILES", "/nowhere.json")];
