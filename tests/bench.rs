//! The benchmark has teeth: a pass that takes longer and a technique that is wrong are found by its own checks.

mod studio;

use diaphane::bench::{Case, Contender, Machine, Record, Samples, Wishes, checks, measure};
use diaphane::gpu::Images;
use diaphane::image::Image;
use diaphane::problem::Problem;
use diaphane::scene::TechniqueText;
use diaphane::store::{Run, Slot, Step};
use serde::Serialize;
use std::collections::BTreeSet;
use std::time::Duration;
use studio::{Nobody, Studio, studio};

const SCENE: &str = r#"Scene(version: 1, mm_per_unit: 10, camera: (eye: (0, 0, 6)),
    lights: [Directional(direction: (-1, -1, -1), irradiance: 3), Environment(radiance: 0.3)],
    objects: [(mesh: Sphere(radius: 1, subdivisions: 2), material: "stone.ron")],
    view: (size: (32, 32), antialias: 1))"#;
const BENCH: &str = "Bench(version: 1, techniques: [Opaque()], repetitions: 3, max_error: 0.2, max_spp: 16)";

/// A pass more, which tells of more time than any of ours takes.
#[derive(Serialize)]
struct Slow {
    frame: Slot<Images>,
}

impl Step for Slow {
    type Output = Images;
    fn name(&self) -> &'static str {
        "test.slow"
    }
    fn about(&self) -> String {
        "the same frame, later".into()
    }
    fn run(&self, run: &Run) -> Result<Images, Problem> {
        run.get(self.frame);
        run.took(Duration::from_secs(600));
        Ok(Images(Vec::new()))
    }
}

/// The picture with too much light.
#[derive(Serialize)]
struct Biased {
    picture: Slot<Image>,
    factor: f32,
}

impl Step for Biased {
    type Output = Image;
    fn name(&self) -> &'static str {
        "test.biased"
    }
    fn about(&self) -> String {
        format!("the picture times {}", self.factor)
    }
    fn run(&self, run: &Run) -> Result<Image, Problem> {
        let mut image = run.get(self.picture).as_ref().clone();
        image.pixels.as_flattened_mut().iter_mut().for_each(|v| *v *= self.factor);
        Ok(image)
    }
}

/// The samples of the scene, whose contender was changed.
fn samples(studio: &mut Studio, change: impl Fn(&mut Contender)) -> Samples {
    studio.write("stone.ron", "Material(version: 1, medium: Preset(\"marble\"))");
    studio.write("ball.bench.ron", BENCH);
    let path = studio.write("ball.ron", SCENE);
    let (mut case, _) = Case::read(&studio.session, &path, &Wishes::default()).unwrap();
    case.contenders.iter_mut().for_each(change);
    let folder = tempfile::tempdir().unwrap();
    let machine = Machine::of(studio.session.gpu().unwrap());
    let mut record = Record::open(folder.path(), machine).unwrap();
    let measured = measure(&mut studio.session, &case, &mut record, &Nobody, &|_| ()).unwrap();
    assert_eq!(measured.new_rows, record.samples.0.len());
    record.samples
}

#[test]
fn a_slow_pass_and_a_wrong_technique_are_found() {
    let mut studio = studio();
    let plain = samples(&mut studio, |_| ());
    let slow = samples(&mut studio, |contender| {
        let (plan, frame) = &mut contender.frame;
        *frame = plan.add(Slow { frame: *frame });
    });
    let biased = samples(&mut studio, |contender| {
        let (plan, picture) = &mut contender.picture;
        *picture = plan.add(Biased { picture: *picture, factor: 3.0 });
    });
    let worse = |now: &Samples, times: bool| {
        checks::worse(&plain, now, times).into_iter().map(|worse| worse.measure).collect::<BTreeSet<_>>()
    };
    assert!(worse(&slow, true).contains("frame"), "{:?}", worse(&slow, true));
    assert_eq!(worse(&slow, false), BTreeSet::new());
    let wrong = worse(&biased, false);
    for measure in ["relmse@volume", "relmse@bssrdf", "bias@volume", "bias@bssrdf", "flip_mean@volume"] {
        assert!(wrong.contains(measure), "{measure} is not in {wrong:?}");
    }
    let none: BTreeSet<_> = ["frame"].map(String::from).into();
    assert!(wrong.is_disjoint(&none));

    let subject = plain.subjects()[0].clone();
    // A frame is the sum of its passes, and a repetition draws all of them again.
    let frames: Vec<f64> = plain.values(&subject, "frame").collect();
    let passes: Vec<Vec<f64>> = plain
        .measures(&subject)
        .into_iter()
        .filter(|measure| measure.starts_with("pass:"))
        .map(|measure| plain.values(&subject, measure).collect())
        .collect();
    assert_eq!(frames.len(), 3);
    for (n, frame) in frames.iter().enumerate() {
        let sum: f64 = passes.iter().map(|times| times[n]).sum();
        assert!((sum / frame - 1.0).abs() < 1e-9 && *frame > 0.0);
    }
    let names = plain.measures(&subject);
    for pass in ["pass:frame.gbuffer", "pass:frame.shadow", "pass:technique.local", "pass:frame.display"] {
        assert!(names.contains(&pass), "{names:?}");
    }
    // Shapes at rest and what was uploaded of them stay.
    assert!(!names.iter().any(|name| name.contains("geometry.") || name.contains("upload")), "{names:?}");
    // What an edit does not change has no row: shading knows no kernel.
    let edits: BTreeSet<_> = names.iter().filter_map(|name| name.strip_prefix("edit:")).collect();
    assert_eq!(edits, BTreeSet::from(["camera", "light", "medium", "surface"]));
    assert!(plain.values(&subject, "edit:light").all(|time| time > 0.0));
    assert_eq!(slow.values(&subject, "pass:test.slow").collect::<Vec<_>>(), [600_000.0; 3]);
    assert!(slow.values(&subject, "frame").all(|time| time > 600_000.0));
}

#[test]
fn errors_are_those_of_a_known_difference() {
    let mut studio = studio();
    // Nothing drawn at all: every bit of light is missing.
    let black = samples(&mut studio, |contender| {
        let (plan, picture) = &mut contender.picture;
        *picture = plan.add(Biased { picture: *picture, factor: 0.0 });
    });
    let subject = black.subjects()[0].clone();
    for truth in ["volume", "bssrdf"] {
        let value = |measure: &str| black.value(&subject, &format!("{measure}@{truth}")).unwrap();
        assert!((value("bias") + 1.0).abs() < 1e-6);
        assert!((0.5..1.0).contains(&value("relmse")), "{}", value("relmse"));
        assert!(value("relmse_se") > 0.0 && value("relmse_se") < 0.2 && value("bias_se") == 0.0);
    }
    let unknown = TechniqueText::from_flag("--technique", "Nothing()").unwrap();
    let wishes = Wishes { techniques: vec![unknown], ..Wishes::default() };
    let path = studio.write("ball.ron", SCENE);
    let refused = Case::read(&studio.session, &path, &wishes).err().unwrap();
    assert!(refused.to_string().contains("there is no technique `Nothing`"));
}
