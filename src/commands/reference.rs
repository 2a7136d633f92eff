use super::look::LookFlags;
use super::progress::{Progress, seconds};
use super::{Answer, counted, session};
use crate::image::{Display, Format, Image, decode, exr_text, write_file};
use crate::problem::{At, Cause, Problem, Problems};
use crate::reference::{self, film, volume::Light};
use crate::session::{Goal, Options, whole};
use crate::store::{Key, Origin};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Make the truth, by following light on the CPU; needs no adapter
///
/// Samples are doubled until the picture is good enough; each doubling is kept, and the same command goes on from there.
///
/// To spread a picture over machines, give each of n jobs the same words and --tile i/n, with i from 1 to n, and merge what
/// they write: a Slurm array of 8 with `--tile $SLURM_ARRAY_TASK_ID/8`, or GNU parallel with `parallel diaphane reference
/// S.ron --spp 256 --tile {}/8 -o {}.exr ::: 1 2 3 4 5 6 7 8`, then `diaphane reference merge *.exr -o S.exr`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Reference {
    #[command(subcommand)]
    merge: Option<Words>,
    #[command(flatten)]
    trace: Trace,
}

#[derive(clap::Subcommand)]
enum Words {
    Merge(Merge),
}

/// Put tiles together: the same bits as one run
#[derive(clap::Args)]
struct Merge {
    /// What `reference --tile` wrote: every tile of one picture
    #[arg(required = true, value_name = "TILE")]
    tiles: Vec<PathBuf>,
    /// Where to: .exr
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(clap::Args)]
struct Trace {
    /// The scene's file
    // Required, but not by `merge`: so these two are always there when a picture is asked for.
    #[arg(required = true)]
    scene: Option<PathBuf>,
    /// Where to: .exr (linear light) or .png
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Option<PathBuf>,
    #[command(flatten)]
    look: LookFlags,
    /// volume (random walks through the media and their layers), layered (the same, scattered only once between coming in
    /// and going out), or bssrdf (each material's profile, with nothing else approximated)
    #[arg(long, value_enum, default_value = "volume")]
    integrator: Integrator,
    /// full, or direct: light source, object, eye
    #[arg(long, value_enum, default_value = "full")]
    light: LightFlag,
    /// So many samples per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["max_error", "seconds"])]
    spp: Option<u64>,
    /// Until the relative standard error of the part is at most this, or the scene's max_spp is reached
    #[arg(long, value_name = "E", conflicts_with = "seconds")]
    max_error: Option<f64>,
    /// As many samples as can be finished in this time
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// The random numbers: another seed, another picture of the same truth
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Also write the variance of each pixel, the square of its standard error: .exr
    #[arg(long, value_name = "FILE")]
    variance: Option<PathBuf>,
    /// Only every n-th row, from the i-th on, to be merged later; needs --spp
    #[arg(long, value_name = "i/n", value_parser = parse_tile)]
    tile: Option<(u32, u32)>,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Integrator {
    Volume,
    Bssrdf,
    Layered,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum LightFlag {
    Full,
    Direct,
}

/// `2/8`: 1-based.
fn parse_tile(text: &str) -> Result<(u32, u32), String> {
    text.split_once('/')
        .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)))
        .filter(|(i, n): &(u32, u32)| (1..=*n).contains(i))
        .ok_or_else(|| "a tile is i/n with i from 1 to n, as in 2/8".into())
}

impl Reference {
    pub fn run(self, options: Options) -> Result<Answer, Problems> {
        match self.merge {
            Some(Words::Merge(merge)) => Ok(merge.run()?),
            None => self.trace.run(options),
        }
    }
}

/// What travels with the picture of a tile, and must be the same for all of them but for the tile itself.
const TILE: &str = "diaphane:tile";

fn words(what: impl Into<String>, hint: &str) -> Problem {
    Problem::new(Cause::Words, what).hint(hint)
}

impl Trace {
    fn run(self, options: Options) -> Result<Answer, Problems> {
        let started = Instant::now();
        let (scene, output) = self.scene.as_ref().zip(self.output.as_ref()).expect("both are required");
        let format = Format::of(output)?;
        if let Some(variance) = &self.variance
            && Format::of(variance)? != Format::Exr
        {
            return Err(words("--variance: a variance is no colour", "write it to a file that ends in .exr").into());
        }
        let (integrator, name) = match self.integrator {
            Integrator::Volume => (reference::Integrator::Volume, "volume"),
            Integrator::Bssrdf => (reference::Integrator::Bssrdf, "bssrdf"),
            Integrator::Layered => (reference::Integrator::Layered, "layered"),
        };
        let positive = |flag: &str, value: Option<f64>| match value {
            Some(value) if !(value.is_finite() && value > 0.0) => {
                Err(words(format!("{flag} {value}: this can never be reached"), "a number above 0"))
            }
            _ => Ok(()),
        };
        positive("--max-error", self.max_error)?;
        positive("--seconds", self.seconds)?;
        if self.tile.is_some() && (self.spp.is_none() || format != Format::Exr) {
            let hint = "give every tile the same --spp, and a file that ends in .exr";
            return Err(words("--tile: tiles fit together only with the same samples, unrounded", hint).into());
        }
        let mut session = session(options);
        let (scene, warnings) = session.scene(scene)?;
        let look = self.look.look(&scene)?;
        let part = look.view.part;
        let own = &scene.reference;
        let (first, step) = self.tile.map_or((0, 1), |(i, n)| (i - 1, n));
        let settings = reference::Settings {
            integrator,
            light: match self.light {
                LightFlag::Full => Light::Full,
                LightFlag::Direct => Light::Direct,
            },
            camera: look.view.camera,
            size: look.view.size,
            time_s: look.view.time_s,
            max_depth: own.max_depth,
            seed: self.seed.unwrap_or(own.seed),
            bands: (first, step),
        };
        let max_samples = own.max_spp.max(1) as u64;
        let goal = match (self.spp, self.seconds) {
            (Some(count), _) => Goal::Samples(count),
            (None, Some(seconds)) => Goal::Seconds(seconds),
            (None, None) => {
                let at_most = self.max_error.unwrap_or(own.max_error);
                Goal::Error { part, at_most, min_samples: 2, max_samples }
            }
        };
        let progress = Progress::new();
        let film =
            session.trace(&scene, &settings, &goal, &progress, |film| progress.tell(&film.level(part).to_string()))?;
        let picture = film.picture(part);
        whole(&picture)?;
        let scene_key = Key::of(&scene).to_string();
        let made_by = format!(
            "{name}, {:?} light, {part:?} part, {} samples, seed {}",
            settings.light, film.samples, settings.seed
        );
        let mut text = vec![
            ("Software", concat!("diaphane ", env!("CARGO_PKG_VERSION")).to_string()),
            ("diaphane:scene", scene_key),
            ("diaphane:reference", made_by),
        ];
        if let Some((i, n)) = self.tile {
            text.push((TILE, format!("{i}/{n}")));
        }
        let text: Vec<(&str, &str)> = text.iter().map(|(key, value)| (*key, value.as_str())).collect();
        let display = Display { tone: scene.view.tone, exposure_ev: scene.view.exposure_ev as f32 };
        write_file(output, &picture.encode(format, display, &text)?)?;
        if let Some(file) = &self.variance {
            write_file(file, &film.variance(part).encode(Format::Exr, display, &text)?)?;
        }
        let (finished, told) = progress.take();
        let from_disk = finished.iter().filter(|step| step.origin == Origin::Disk).count();
        let (error, time) = (film.relative_standard_error(part), started.elapsed());
        let facts = json!({
            "path": output.display().to_string(),
            "variance": self.variance.as_ref().map(|file| file.display().to_string()),
            "width": film.width,
            "height": film.height,
            "samples": film.samples,
            "relative_standard_error": error.is_finite().then_some(error),
            "seconds": time.as_secs_f64(),
            "from_disk": from_disk,
        });
        let goal_missed = match goal {
            Goal::Error { at_most, .. } if error > at_most => Some(
                Problem::warning(format!(
                    "after {} samples the relative standard error is {error:.4}, not {at_most}",
                    film.samples
                ))
                .hint("raise reference.max_spp in the scene"),
            ),
            _ => None,
        };
        let line = format!(
            "{}  {} x {}  {}  {}  {} from disk\n",
            output.display(),
            film.width,
            film.height,
            film.level(part),
            seconds(time),
            counted(from_disk, "step"),
        );
        Ok(Answer::new(line, facts).warn(warnings).warn(told).warn(goal_missed))
    }
}

impl Merge {
    fn run(self) -> Result<Answer, Problem> {
        let started = Instant::now();
        if Format::of(&self.output)? != Format::Exr {
            return Err(words("tiles merge into linear light", "write to a file that ends in .exr"));
        }
        let tiles: Vec<Tile> = self.tiles.iter().map(|file| Tile::read(file)).collect::<Result<_, Problem>>()?;
        let (first, file) = (&tiles[0], &self.tiles[0]);
        let mut picture = Image::filled(first.image.width, first.image.height, [f32::NAN; 3]);
        // As many as a tile says there are need not fit into memory.
        let mut there = BTreeMap::new();
        for (tile, path) in tiles.iter().zip(&self.tiles) {
            let same = tile.of == first.of
                && tile.text == first.text
                && (tile.image.width, tile.image.height) == (picture.width, picture.height);
            if !same {
                let what = format!("this tile is of another picture than {}", file.display());
                return Err(Problem::files(what)
                    .at(At::file(path))
                    .hint("merge tiles of one scene, size, seed and --spp"));
            }
            if let Some(twin) = there.insert(tile.place, path) {
                let what = format!("tile {}/{} is there twice: {} too", tile.place, tile.of, twin.display());
                return Err(Problem::files(what).at(At::file(path)).hint("name each tile once"));
            }
            let width = picture.width as usize;
            for y in film::rows((tile.place - 1, tile.of), picture.height).map(|y| y as usize) {
                picture.pixels[y * width..][..width].copy_from_slice(&tile.image.pixels[y * width..][..width]);
            }
        }
        if let Some(missing) = (1..=first.of).find(|place| !there.contains_key(place)) {
            let what = format!("tile {missing}/{} is missing", first.of);
            return Err(words(what, "name all tiles"));
        }
        let text: Vec<(&str, &str)> = first.text.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        write_file(&self.output, &picture.encode(Format::Exr, Display::default(), &text)?)?;
        let time = started.elapsed();
        let facts = json!({
            "path": self.output.display().to_string(),
            "tiles": tiles.len(),
            "width": picture.width,
            "height": picture.height,
            "seconds": time.as_secs_f64(),
        });
        let line = format!("{}  {}  {}\n", self.output.display(), counted(tiles.len(), "tile"), seconds(time));
        Ok(Answer::new(line, facts))
    }
}

struct Tile {
    image: Image,
    place: u32,
    of: u32,
    /// All that the file says of itself, but for the tile.
    text: Vec<(String, String)>,
}

impl Tile {
    fn read(file: &Path) -> Result<Tile, Problem> {
        let wrong =
            |what: String| Problem::files(what).at(At::file(file)).hint("name what `reference --tile i/n` wrote");
        let bytes = std::fs::read(file).map_err(|error| wrong(format!("the tile cannot be read: {error}")))?;
        let mut text = exr_text(&bytes, file)?;
        let place = text.iter().position(|(key, _)| key == TILE).ok_or_else(|| wrong("this is no tile".into()))?;
        let (_, tile) = text.remove(place);
        let (place, of) = parse_tile(&tile).map_err(|_| wrong(format!("its tile is {tile}")))?;
        // Its other keys stand as `encode` wrote them; a whole picture has them in the same order.
        text.retain(|(key, _)| key.starts_with("diaphane") || key == "Software");
        let texture = decode(&bytes, file, crate::image::Encoding::Linear)?;
        let pixels = texture.texels.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
        Ok(Tile { image: Image { width: texture.width, height: texture.height, pixels }, place, of, text })
    }
}
