//! What an edit costs: for each kind of edit, how many steps run again and how long that takes, as a share of a cold
//! render.
//!
//! `cargo bench --bench edits` prints a table; `cargo bench --bench edits -- --write` also writes the raw numbers, with the
//! machine, to `tools/runs/edits.txt`. `--repetitions N` and `--size WxH` make it shorter.
//!
//! Each repetition begins *cold*, with nothing in memory or on disk, draws, edits one file, and draws again; the share is
//! that of the two in the same repetition. The device is open, and its pipelines are compiled, since that is part of the
//! first picture only: so an edit's share is rather too large. The time is that from the moment when the files are saved
//! until the picture is encoded as PNG.

use diaphane::bench::Machine;
use diaphane::gpu::Shaders;
use diaphane::image::{Display, Format};
use diaphane::problem::Problems;
use diaphane::render::Look;
use diaphane::scene::Reader;
use diaphane::session::{Options, Session};
use diaphane::store::{Disk, Finished, Origin, Store, Watch};
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Every kind of light, two translucent things of some ten thousand vertices and a floor with a texture.
const SCENE: &str = r#"Scene(
    version: 1,
    mm_per_unit: 10,
    camera: (eye: (0, 4, 11), target: (0, 1.2, 0), fov_y_deg: 30),
    lights: [
        Directional(name: "sun", direction: (-1, -2, -1), irradiance: (2, 1.9, 1.7)),
        Point(name: "lamp", position: (3, 4, 3), intensity: (8, 8, 9)),
        Rect(name: "window", center: (-4, 4, -3), u: (0.6, 0.6, 0), v: (0, 0, 1), radiance: (6, 6, 6)),
        Environment(name: "room", radiance: (0.2, 0.25, 0.3)),
    ],
    objects: [
        (name: "mesh", mesh: File("mesh.obj"), material: "wax.ron", transform: (translate: (-1.5, 1.2, 0))),
        (name: "knot", mesh: TorusKnot(p: 2, q: 3, radius: 0.8, tube: 0.25, segments: (256, 32)), material: "jade.ron",
         transform: (translate: (1.5, 1.4, 0))),
        (name: "floor", mesh: Slab(size: (14, 14, 0.5), segments: (32, 32)), material: "floor.ron",
         transform: (translate: (0, -0.25, 0), rotate_deg: (-90, 0, 0))),
    ],
    view: (technique: FilteredNormals(), size: (SIZE), exposure_ev: 0),
)
"#;
const WAX: &str = r#"Material(
    version: 1,
    surface: (ior: 1.44, roughness: 0.38),
    medium: AlbedoMfp(albedo: (0.9997, 0.9988, 0.9935), mfp: (0.9, 0.7, 0.45), g: 0.3),
    filter: Neighbours(sigma_tr: 0.5, radius: 3),
)
"#;
const JADE: &str = r#"Material(
    version: 1,
    surface: (ior: 1.6, roughness: 0.1),
    medium: AlbedoMfp(albedo: (0.98, 0.99, 0.97), mfp: (0.6, 0.9, 0.5)),
    filter: Neighbours(sigma_tr: 0.6, radius: 2),
)
"#;
const FLOOR: &str = r#"Material(
    version: 1,
    surface: (color: Texture(image: "floor.png")),
    medium: Opaque(albedo: 0.8),
)
"#;
const SHADER: &str = "shaders/frame/compose.wgsl";

/// A kind of edit; which file it changes; and what that file's text becomes, the n-th time.
type Edit = (&'static str, &'static str, fn(&str, u32) -> Vec<u8>);

const EDITS: [Edit; 11] = [
    ("exposure", "scene.ron", |text, _| put(text, "exposure_ev: 0", "exposure_ev: 0.5")),
    ("light colour", "scene.ron", |text, _| put(text, "(2, 1.9, 1.7)", "(2, 1.9, 1.5)")),
    ("camera", "scene.ron", |text, _| put(text, "eye: (0,", "eye: (0.1,")),
    ("material surface", "wax.ron", |text, _| put(text, "roughness: 0.38", "roughness: 0.4")),
    ("medium", "wax.ron", |text, _| put(text, "mfp: (0.9,", "mfp: (0.8,")),
    ("kernel", "wax.ron", |text, _| put(text, "sigma_tr: 0.5", "sigma_tr: 0.6")),
    ("mesh", "mesh.obj", |_, _| ball(1.1).into()),
    ("texture", "floor.png", |_, _| floor(200)),
    // The device keeps the pipelines of every shader that it saw.
    ("shader", SHADER, |text, n| format!("{text}\n// edit {n}\n").into()),
    ("an object more", "scene.ron", |text, _| {
        let new = "(name: \"new\", mesh: Sphere(radius: 0.4, subdivisions: 4), material: \"wax.ron\", \
                   transform: (translate: (0, 0.4, 2.5))),";
        put(text, "objects: [", &format!("objects: [\n        {new}"))
    }),
    ("an object less", "scene.ron", |text, _| put(text, "(name: \"mesh\",", "(name: \"mesh\", visible: false,")),
];

fn put(text: &str, says: &str, then: &str) -> Vec<u8> {
    assert!(text.contains(says), "{says} stands in the text");
    text.replacen(says, then, 1).into()
}

/// A sphere of 20480 faces as OBJ.
fn ball(radius: f64) -> String {
    let mesh = diaphane::geometry::shapes::sphere(radius, 5);
    let mut text = String::new();
    for p in &mesh.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("a text takes any line");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("a text takes any line");
    }
    text
}

/// Checks of 256 x 256 pixels, as PNG.
fn floor(blue: u8) -> Vec<u8> {
    let checks = |i: u32| ((i / 32 + i / 8192) % 2) as u8 * 120 + 60;
    let pixels: Vec<u8> = (0..256 * 256).flat_map(|i| [checks(i), checks(i), blue]).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 256, 256);
    encoder.set_color(png::ColorType::Rgb);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels));
    written.expect("a picture can be kept in memory");
    bytes
}

#[derive(Default)]
struct Ran(Mutex<usize>);
impl Watch for Ran {
    fn finished(&self, finished: &Finished) {
        *self.0.lock().expect("nobody panics while counting") += usize::from(finished.origin == Origin::Ran);
    }
}

/// Scene, materials, shaders and bakes in a folder, and who draws them.
struct Desk {
    folder: tempfile::TempDir,
    session: Session,
}

/// One picture: how long it took, how many steps ran for it, of how many.
struct Shot {
    time: Duration,
    ran: usize,
    steps: usize,
}

impl Desk {
    fn new(size: &str) -> Desk {
        let session = Session::new(Options { no_cache: true, ..Options::default() });
        let desk = Desk { folder: tempfile::tempdir().expect("a folder can be made"), session };
        desk.write("scene.ron", SCENE.replace("SIZE", &size.replace('x', ", ")));
        desk.write("mesh.obj", ball(1.0));
        desk.write("floor.png", floor(90));
        [("wax.ron", WAX), ("jade.ron", JADE), ("floor.ron", FLOOR)]
            .into_iter()
            .for_each(|(name, text)| desk.write(name, text));
        for name in Shaders::names() {
            let text = std::fs::read(Path::new("shaders").join(name)).expect("this runs where the shaders are");
            desk.write(&format!("shaders/{name}"), text);
        }
        desk
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("it lies in the folder")).expect("a folder can be made");
        std::fs::write(path, content).expect("a file can be written");
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path().join(name)).expect("it was written before")
    }

    /// Forgets everything but the device.
    fn cool(&mut self) {
        let files = self.session.files.clone();
        self.session.reader = Reader::new(files.clone());
        self.session.shaders = Shaders::new(Some(self.folder.path().join("shaders")), files);
        let bakes = self.folder.path().join("bakes");
        std::fs::remove_dir_all(&bakes).ok(); // at first there are none
        self.session.store = Store::on_disk(Disk::new(bakes));
    }

    /// The picture of the files as they are.
    fn shoot(&mut self) -> Result<Shot, Problems> {
        let watch = Ran::default();
        let started = Instant::now();
        let (scene, _) = self.session.scene(&self.folder.path().join("scene.ron"))?;
        let (plan, image) = self.session.render(&scene, &Look::of(&scene), &watch)?;
        let display = Display { tone: scene.view.tone, exposure_ev: scene.view.exposure_ev as f32 };
        image.encode(Format::Png, display, &[])?;
        let time = started.elapsed();
        let steps = plan.steps().iter().filter(|step| !step.is_given()).count();
        Ok(Shot { time, ran: watch.0.into_inner().expect("nobody panics while counting"), steps })
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn machine(session: &mut Session) -> Result<String, Problems> {
    let machine = Machine::of(session.gpu()?);
    Ok(format!(
        "adapter: {}\ndriver:  {}\nCPU:     {}, {} threads\ncommit:  {}\ndate:    {}\n",
        machine.adapter, machine.driver, machine.cpu, machine.threads, machine.commit, machine.date,
    ))
}

fn main() -> ExitCode {
    match measure() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn measure() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let value = |flag: &str| words.iter().position(|word| word == flag).and_then(|i| words.get(i + 1));
    let repetitions: u32 = value("--repetitions").map_or(Ok(5), |n| n.parse())?;
    let size = value("--size").map_or("960x540", String::as_str);
    let writes = words.iter().any(|word| word == "--write");
    if writes && cfg!(debug_assertions) {
        return Err("numbers of a build without optimisation are not kept: leave --profile away".into());
    }
    if !(1..=99).contains(&repetitions) {
        return Err("--repetitions: 1 to 99".into());
    }

    let mut desk = Desk::new(size);
    let mut report = machine(&mut desk.session)?;
    report += &format!("size:    {size}, medians of {repetitions} repetitions, times in ms\n\n");
    print!("{report}");
    let mut table = format!("{:<18} {:>12} {:>10} {:>10} {:>10}\n", "edit", "steps ran", "cold", "edit", "share");
    print!("{table}");
    let mut raw = String::from("kind,repetition,steps,ran,cold_ms,edit_ms\n");
    desk.cool();
    desk.shoot()?; // compiles the pipelines
    for (kind, file, edit) in EDITS {
        let original = desk.read(file);
        let edited = |n| edit(&String::from_utf8_lossy(&original), n);
        // Pipelines that only the edited picture has; a shader is another one each time.
        desk.write(file, edited(0));
        desk.shoot()?;
        let mut pairs = Vec::new();
        for n in 1..=repetitions {
            desk.write(file, &original);
            desk.cool();
            let cold = desk.shoot()?;
            desk.write(file, edited(n));
            let shot = desk.shoot()?;
            let [cold_ms, edit_ms] = [&cold, &shot].map(|shot| 1e3 * shot.time.as_secs_f64());
            writeln!(raw, "{kind},{n},{},{},{cold_ms:.3},{edit_ms:.3}", shot.steps, shot.ran)?;
            pairs.push((cold_ms, edit_ms, shot));
        }
        desk.write(file, &original);
        let (ran, steps) = (pairs[0].2.ran, pairs[0].2.steps);
        if pairs.iter().any(|(.., shot)| shot.ran != ran) {
            return Err(format!("{kind}: not every repetition ran {ran} steps").into());
        }
        let line = format!(
            "{kind:<18} {:>12} {:>10.2} {:>10.2} {:>8.1} %\n",
            format!("{ran} of {steps}"),
            median(pairs.iter().map(|pair| pair.0)),
            median(pairs.iter().map(|pair| pair.1)),
            100.0 * median(pairs.iter().map(|pair| pair.1 / pair.0)),
        );
        print!("{line}");
        table += &line;
    }
    if writes {
        let file = "tools/runs/edits.txt";
        let head = "cargo bench --bench edits -- --write; benches/edits.rs says what is measured.\n";
        std::fs::write(file, format!("{head}{report}{table}\n{raw}"))?;
        println!("{file}");
    }
    Ok(())
}
