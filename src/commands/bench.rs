use super::look::parse_size;
use super::progress::{Progress, seconds};
use super::{Answer, counted, session};
use crate::bench::errors::{PART, Traced};
use crate::bench::summary::{Line, milliseconds, number, sentences};
use crate::bench::{Case, Machine, Measured, Record, Wishes, cases, checks, measure, page, plot, record};
use crate::image::{Display, write_file};
use crate::problem::{Cause, Problem, Problems};
use crate::scene::TechniqueText;
use crate::session::Options;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// Measure time against error: techniques and settings on scenes, against the truth
///
/// What is measured of SCENE.ron stands in SCENE.bench.ron beside it, when there is one; else every technique is, at its
/// defaults. Every sample goes to samples.csv in DIR as it is measured, and the same command goes on where it was; then
/// come a plot for each scene, SCENE.svg, and index.html with everything on one page.
#[derive(clap::Args)]
pub struct Bench {
    /// The scenes' files
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// The folder for what was measured
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Every technique, with every setting that it says is worth measuring, beside what the scenes' files name
    #[arg(long)]
    all: bool,
    /// Three repetitions, and truths with an error four times as large
    #[arg(long)]
    quick: bool,
    /// This technique with its settings, in place of those of the scenes' files; may stand several times
    #[arg(long, value_name = "RON")]
    technique: Vec<String>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// How often each frame is drawn
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: Option<u32>,
    /// The relative standard error at which a truth is good enough
    #[arg(long, value_name = "E")]
    max_error: Option<f64>,
    /// Fail with status 4 when something became slower or wronger than in the folder of an earlier run
    #[arg(long, value_name = "DIR")]
    against: Option<PathBuf>,
}

impl Bench {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        let started = Instant::now();
        let wishes = self.wishes()?;
        let before = self.against.as_deref().map(record::earlier).transpose()?;
        let mut session = session(options);
        let mut warnings = Vec::new();
        let mut found = Vec::new();
        let mut wrong = Vec::new();
        for path in cases::scenes(&self.scenes)? {
            match Case::read(&session, &path, &wishes) {
                Ok((case, told)) => {
                    warnings.extend(told);
                    found.push(case);
                }
                Err(Problems(problems)) => wrong.extend(problems),
            }
        }
        if !wrong.is_empty() {
            return Err(Problems(wrong));
        }

        let progress = Progress::new();
        let mut record = Record::open(&self.output, Machine::of(session.gpu()?))?;
        let mut chapters = Vec::new();
        for case in &found {
            let measured = measure(&mut session, case, &mut record, &progress, &|line| progress.tell(line))?;
            warnings.extend(measured.warnings.iter().cloned());
            chapters.push(Written::new(case, measured, &record)?);
        }
        let pages: Vec<page::Chapter> = chapters.iter().map(Written::chapter).collect();
        let index = record.path("index.html");
        write_file(&index, page::html(&pages, &record.machine)?.as_bytes())?;

        let new: usize = chapters.iter().map(|chapter| chapter.measured.new_rows).sum();
        let mut text: String = chapters.iter().map(Written::text).collect();
        let samples = record.path(record::SAMPLES);
        text += &format!(
            "{}  {} samples, {new} of them new  {}\n{}\n",
            samples.display(),
            record.samples.0.len(),
            seconds(started.elapsed()),
            index.display()
        );
        let facts = json!({
            "samples": samples.display().to_string(),
            "html": index.display().to_string(),
            "machine": record.machine,
            "rows": record.samples.0.len(),
            "new_rows": new,
            "seconds": started.elapsed().as_secs_f64(),
            "scenes": chapters.iter().map(Written::facts).collect::<Vec<_>>(),
        });
        warnings.extend(progress.take().1);
        let mut answer = Answer::new(text, facts).warn(warnings);
        if let Some((before, machine)) = before {
            let times_too = machine.times_as(&record.machine);
            if !times_too {
                let what =
                    format!("{} is not the machine of the earlier run: its times say nothing", machine.drawn_on());
                answer = answer.warn([Problem::warning(what).hint("only errors are compared")]);
            }
            // Of what was measured now: the folder may hold more.
            let mut now = record.samples.clone();
            let is_now = |subject: &_| found.iter().flat_map(|case| &case.contenders).any(|c| c.subject == *subject);
            now.0.retain(|sample| is_now(&sample.subject));
            let failure = |worse: checks::Worse| Problem::new(Cause::Comparison, worse.words());
            answer.failures = checks::worse(&before, &now, times_too).into_iter().map(failure).collect();
        }
        Ok(answer)
    }

    fn wishes(&self) -> Result<Wishes, Problem> {
        if let Some(error) = self.max_error
            && !(error.is_finite() && error > 0.0)
        {
            let what = format!("--max-error: {error} can never be reached");
            return Err(Problem::new(Cause::Words, what).hint("a number above 0, like 0.02"));
        }
        let techniques = self.technique.iter().map(|ron| TechniqueText::from_flag("--technique", ron));
        Ok(Wishes {
            techniques: techniques.collect::<Result<_, _>>()?,
            all: self.all,
            quick: self.quick,
            size: self.size,
            repetitions: self.repetitions,
            max_error: self.max_error,
        })
    }
}

/// A case that was measured, and its plot on disk.
struct Written<'a> {
    case: &'a Case,
    measured: Measured,
    lines: Vec<Line>,
    size: String,
    plot: String,
    path: PathBuf,
}

impl Written<'_> {
    fn new<'a>(case: &'a Case, measured: Measured, record: &Record) -> Result<Written<'a>, Problem> {
        let line = |shown: &crate::bench::Shown| Line::of(&record.samples, &shown.subject, &case.truths);
        let lines: Vec<Line> = measured.shown.iter().map(line).collect();
        let size = format!("{} x {}", case.look.view.size.0, case.look.view.size.1);
        let plot = plot::svg(&case.name, &size, &case.truths, &lines, &record.machine);
        let path = record.path(&format!("{}.svg", case.name));
        write_file(&path, plot.as_bytes())?;
        Ok(Written { case, measured, lines, size, plot, path })
    }

    fn chapter(&self) -> page::Chapter<'_> {
        let view = &self.case.scene.view;
        page::Chapter {
            name: &self.case.name,
            size: self.size.clone(),
            display: Display { tone: view.tone, exposure_ev: view.exposure_ev as f32 },
            truths: &self.measured.truths,
            shown: &self.measured.shown,
            lines: &self.lines,
            plot: &self.plot,
        }
    }

    /// A table, and what its numbers say.
    fn text(&self) -> String {
        let mut text = format!("{}, {}\n", self.case.name, self.size);
        let mut head = format!("  {:<36} {:>28} {:>10}", "technique", "frame", "bake");
        for truth in &self.case.truths {
            head += &format!(" {:>30}", format!("relmse@{} ± se", truth.word()));
        }
        text += &format!("{head}\n");
        for line in &self.lines {
            let frame = line.frame.as_ref().map(milliseconds).unwrap_or_default();
            let bake = line.bake.map(|time| format!("{} ms", number(time))).unwrap_or_default();
            text += &format!("  {:<36} {frame:>28} {bake:>10}", line.words);
            for (_, error) in &line.errors {
                let beside = format!("{} ± {}", error.words(), number(error.relmse_se));
                text += &format!(" {beside:>30}");
            }
            text.push('\n');
        }
        for truth in &self.case.truths {
            sentences(&self.lines, *truth).iter().for_each(|sentence| text += &format!("  {sentence}\n"));
        }
        let written = counted(self.lines.len(), "technique");
        text + &format!("{}  {written}\n", self.path.display())
    }

    fn facts(&self) -> Value {
        let said = |truth: &crate::scene::Truth| sentences(&self.lines, *truth);
        let truth = |traced: &Traced| {
            let error = traced.film.relative_standard_error(PART);
            let facts = json!({ "samples": traced.film.samples, "relative_standard_error": error });
            (traced.truth.word().to_string(), facts)
        };
        json!({
            "scene": self.case.name,
            "size": self.size,
            "svg": self.path.display().to_string(),
            "truths": self.measured.truths.iter().map(truth).collect::<serde_json::Map<_, _>>(),
            "techniques": self.lines,
            "sentences": self.case.truths.iter().flat_map(said).collect::<Vec<_>>(),
        })
    }
}
