//! What is measured: scenes, and the techniques with their settings that contend on each.

use super::edits::{Edit, KINDS};
use super::samples::Subject;
use crate::frame::Part;
use crate::gpu::{Images, Shaders};
use crate::image::{Display, Image};
use crate::problem::{At, Cause, Problem, Problems};
use crate::render::{self, Look};
use crate::scene::{BenchSettings, Scene, TechniqueText, Truth, bench_beside};
use crate::session::Session;
use crate::store::{Plan, Slot};
use crate::techniques::{self, REGISTRY, reference::Reference};
use std::path::{Path, PathBuf};

/// What the words of the command ask for, in place of what the scenes' own files say.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// In place of those of the files.
    pub techniques: Vec<TechniqueText>,
    /// Every technique at its defaults, with every setting that it says is worth it, and those of the files.
    pub all: bool,
    /// Few repetitions and a coarse truth.
    pub quick: bool,
    pub size: Option<(u32, u32)>,
    pub repetitions: Option<u32>,
    pub max_error: Option<f64>,
}

/// How often a frame is drawn at most, and how much larger the truth's error may be, when it has to be quick.
const QUICK_REPETITIONS: u32 = 3;
const QUICK_ERROR: f64 = 4.0;

/// A scene, and who contends on it.
pub struct Case {
    /// The stem of its file.
    pub name: String,
    /// Without the techniques that its objects name: each contender draws all that is translucent.
    pub scene: Scene,
    pub look: Look,
    pub truths: Vec<Truth>,
    /// The relative standard error at which a truth is good enough, and the samples that are enough in any case.
    pub max_error: f64,
    pub max_samples: u64,
    pub repetitions: u32,
    pub contenders: Vec<Contender>,
}

/// A technique with its settings on a scene: the plans of what is measured.
pub struct Contender {
    pub subject: Subject,
    /// The whole picture, as a display is sent it: what is timed.
    pub frame: (Plan, Slot<Images>),
    /// A frame a moment later: what it shares with `frame` stays from frame to frame.
    pub next: Plan,
    /// The same after an edit, for every kind that changes this picture.
    pub edits: Vec<Edit>,
    /// What is held against the truths.
    pub picture: (Plan, Slot<Image>),
}

impl Case {
    /// The case of a scene's file, and what is to be said of it.
    pub fn read(session: &Session, path: &Path, wishes: &Wishes) -> Result<(Case, Vec<Problem>), Problems> {
        let (mut scene, mut told) = session.scene(path)?;
        scene.objects.iter_mut().for_each(|object| object.technique = None);
        let beside = bench_beside(path);
        let settings = match beside.is_file() {
            true => session.reader.bench(&beside)?,
            false => BenchSettings::default(),
        };
        let mut look = Look::of(&scene);
        if let Some(size) = wishes.size.or(settings.size) {
            look.view.size = size;
        }
        let usual = settings.max_error.unwrap_or(scene.reference.max_error);
        let max_error = wishes.max_error.unwrap_or(if wishes.quick { QUICK_ERROR * usual } else { usual });
        let most = if wishes.quick { settings.repetitions.min(QUICK_REPETITIONS) } else { settings.repetitions };
        let mut case = Case {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            truths: settings.truths.clone(),
            max_error,
            max_samples: u64::from(settings.max_spp.unwrap_or(scene.reference.max_spp)).max(2),
            repetitions: wishes.repetitions.unwrap_or(most),
            contenders: Vec::new(),
            scene,
            look,
        };
        let mut wrong = Vec::new();
        let texts = texts(&settings, wishes)?;
        for text in &texts {
            match case.contender(text, &session.shaders) {
                Ok(Ok(contender)) => case.contenders.push(contender),
                Ok(Err(refused)) => told.push(left_out(&case.name, text, refused)),
                Err(problem) => wrong.push(problem),
            }
        }
        if wrong.is_empty() && case.contenders.is_empty() {
            let what = format!("{}: none of {} techniques can draw it", case.name, texts.len());
            told.push(Problem::files(what).at(At::file(path)).hint("see the warnings for what each refuses"));
            wrong = told.split_off(0);
        }
        if wrong.is_empty() { Ok((case, told)) } else { Err(Problems(wrong)) }
    }

    /// A technique with its settings on this scene; or what it cannot draw of it; or what is wrong with the text.
    fn contender(&self, text: &TechniqueText, shaders: &Shaders) -> Result<Result<Contender, Problems>, Problem> {
        if text.name == Reference::NAME {
            return Err(text
                .problem("", "the reference is the truth that others are measured against")
                .hint("leave it out: it is traced in any case"));
        }
        techniques::read(text)?;
        if let Err(refused) = render::check(&self.scene, text) {
            return Ok(Err(refused));
        }
        let look = Look { technique: text.clone(), ..self.look.clone() };
        let display = Display { tone: self.scene.view.tone, exposure_ev: self.scene.view.exposure_ev as f32 };
        let mut judged = look.clone();
        judged.view.part = Part::Scattered;
        let shown = |scene: &Scene, look: &Look| {
            let drawn = |_: &Plan, _: &[_]| unreachable!("the reference is no contender");
            render::plan_shown(scene, look, display, shaders, drawn).map(|shown| (shown.plan, shown.picture))
        };
        let (moved, moment) = super::timing::later(&self.scene, &look);
        let frame = shown(&self.scene, &look)?;
        let mut edits = Vec::new();
        for (kind, change) in KINDS {
            let (mut scene, mut look) = (self.scene.clone(), look.clone());
            change(&mut scene, &mut look);
            let edited = shown(&scene, &look)?;
            if edited.1.key() != frame.1.key() {
                edits.push(Edit { kind, frame: edited });
            }
        }
        let (width, height) = look.view.size;
        let settings = text.ron.strip_prefix(&text.name).unwrap_or_default();
        let settings = settings.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')).unwrap_or_default();
        Ok(Ok(Contender {
            subject: Subject {
                scene: self.name.clone(),
                technique: text.name.clone(),
                settings: settings.to_string(),
                size: format!("{width}x{height}"),
            },
            frame,
            edits,
            next: shown(&moved, &moment)?.0,
            picture: render::plan(&self.scene, &judged, shaders)?,
        }))
    }
}

/// Who is to contend.
fn texts(settings: &BenchSettings, wishes: &Wishes) -> Result<Vec<TechniqueText>, Problem> {
    let read = |ron: &str| TechniqueText::from_flag("techniques", ron);
    let drawn = || REGISTRY.iter().filter(|entry| entry.name != Reference::NAME);
    let defaults = || drawn().map(|entry| read(&format!("{}()", entry.name))).collect::<Result<Vec<_>, _>>();
    let mut texts = match (&wishes.techniques[..], &settings.techniques) {
        ([], Some(listed)) => listed.clone(),
        ([], None) => defaults()?,
        (asked, _) => asked.to_vec(),
    };
    if wishes.all {
        texts.extend(defaults()?);
        for ron in drawn().flat_map(|entry| entry.sweep) {
            texts.push(read(ron)?);
        }
    }
    // `Opaque` and `Opaque()` are one.
    let name = |text: &TechniqueText| text.ron.strip_suffix("()").unwrap_or(&text.ron).to_string();
    let mut seen = std::collections::BTreeSet::new();
    texts.retain(|text| seen.insert(name(text)));
    Ok(texts)
}

fn left_out(scene: &str, text: &TechniqueText, Problems(refused): Problems) -> Problem {
    let why: Vec<String> = refused.iter().map(|problem| problem.what.clone()).collect();
    Problem::warning(format!("{scene}: {} is left out: {}", text.ron, why.join("; ")))
        .hint("its material asks for what this technique cannot do")
}

/// The scenes that words name, each once: a pattern like `scenes/*.ron` meets the files beside them too.
pub fn scenes(words: &[PathBuf]) -> Result<Vec<PathBuf>, Problem> {
    let mut scenes: Vec<PathBuf> = Vec::new();
    for word in words {
        let name = word.file_name().unwrap_or_default().to_string_lossy();
        let scene = match name.strip_suffix(".bench.ron") {
            Some(stem) => word.with_file_name(format!("{stem}.ron")),
            None => word.clone(),
        };
        if scenes.contains(&scene) {
            continue;
        }
        if let Some(twin) = scenes.iter().find(|other| other.file_stem() == scene.file_stem()) {
            let what = format!("{} and {} have the same name", twin.display(), scene.display());
            return Err(Problem::new(Cause::Words, what).hint("rename one, or give each a run and a folder of its own"));
        }
        scenes.push(scene);
    }
    Ok(scenes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_beside_scenes_stand_for_them() {
        let paths = |words: &[&str]| scenes(&words.iter().map(PathBuf::from).collect::<Vec<_>>());
        let found = paths(&["s/a.bench.ron", "s/a.ron", "s/b.ron"]).unwrap();
        assert_eq!(found, [Path::new("s/a.ron"), Path::new("s/b.ron")]);
        assert!(paths(&["s/a.ron", "t/a.ron"]).unwrap_err().what.contains("same name"));
    }

    #[test]
    fn who_contends_follows_from_file_and_words() {
        let read = |ron: &str| TechniqueText::from_flag("--technique", ron).unwrap();
        let of = |settings: &BenchSettings, wishes: &Wishes| {
            texts(settings, wishes).unwrap().into_iter().map(|text| text.ron).collect::<Vec<_>>()
        };
        let (plain, none) = (BenchSettings::default(), Wishes::default());
        let every = of(&plain, &none);
        assert!(every.contains(&"Opaque()".to_string()) && !every.iter().any(|ron| ron.contains("Reference")));
        let listed = BenchSettings { techniques: Some(vec![read("Opaque"), read("X(a: 1)")]), ..plain };
        assert_eq!(of(&listed, &none), ["Opaque", "X(a: 1)"]);
        let asked = Wishes { techniques: vec![read("Y()")], ..Wishes::default() };
        assert_eq!(of(&listed, &asked), ["Y()"]);
        let all = of(&listed, &Wishes { all: true, ..Wishes::default() });
        assert!(all.len() > every.len() && all[1] == "X(a: 1)" && !all.contains(&"Opaque()".to_string()));
    }
}
