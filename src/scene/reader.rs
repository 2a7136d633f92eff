//! Reads scenes and materials, and remembers what was costly: meshes and images of the same content are read once.

use crate::problem::{Problem, Problems};
use crate::scene::bench_file::{self, BenchFile, BenchSettings};
use crate::scene::document::{self, Kind, at_its_name, check_head, has_line, named, typed};
use crate::scene::material::{build as build_material, complete};
use crate::scene::material_file::MaterialFile;
use crate::scene::meaning::Judge;
use crate::scene::outside::{Encoding, Mesh, Texture, decode, read_obj};
use crate::scene::scene_file::SceneFile;
use crate::scene::tree::Node;
use crate::scene::{Material, MeshSource, Scene, build, warn};
use crate::store::{File, Files, Key};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

/// A mesh or an image stays remembered for this many reads after the last that named it, so that undoing an edit is free.
const KEPT_READS: u64 = 16;

/// Lives as long as the program, across edits.
pub struct Reader {
    files: Arc<Files>,
    meshes: Memory<Key, ReadMesh>,
    textures: Memory<(Key, Encoding), ReadTexture>,
    materials: Mutex<BTreeMap<PathBuf, Option<Arc<Material>>>>,
    default_material: OnceLock<Arc<Material>>,
}

#[derive(Clone)]
struct ReadMesh {
    mesh: Arc<Mesh>,
    warnings: Vec<Problem>,
    closed: bool,
    extent: f64,
}

#[derive(Clone)]
struct ReadTexture {
    texture: Arc<Texture>,
    warnings: Vec<Problem>,
}

impl Reader {
    pub fn new(files: Arc<Files>) -> Reader {
        let (meshes, textures) = (Memory::new(), Memory::new());
        Reader { files, meshes, textures, materials: Mutex::default(), default_material: OnceLock::new() }
    }

    /// A scene with all that it names, and the warnings. `sets` are pairs of PATH and RON.
    pub fn scene(&self, path: &Path, sets: &[(String, String)]) -> Result<(Scene, Vec<Problem>), Problems> {
        self.forget();
        let (file, root) = self.scene_file(path, sets)?;
        let mut judge = Judge::new(&root);
        let scene = build::build(&file, self, &mut judge);
        // Warnings measure what is known to be sound.
        match scene.filter(|_| !judge.problems.iter().any(Problem::is_error)) {
            Some(scene) => {
                warn::scene(&scene, self, &mut judge);
                Ok((scene, in_order(judge.problems).0))
            }
            None => Err(in_order(judge.problems)),
        }
    }

    /// A material with its bases and textures, and the warnings.
    pub fn material(&self, path: &Path) -> Result<(Material, Vec<Problem>), Problems> {
        self.forget();
        let file = document::read(&self.files, path)?;
        let (material, problems) = self.material_of(&file)?;
        match material {
            Some(material) => Ok((material, problems)),
            None => Err(in_order(problems)),
        }
    }

    /// What is to be measured of a scene, as a file beside it says.
    pub fn bench(&self, path: &Path) -> Result<BenchSettings, Problems> {
        let (file, root) = self.bench_file(path)?;
        bench_file::build(&file, &root).map_err(|Problems(problems)| in_order(problems))
    }

    /// An image that nothing names but the user, and the warnings about its pixels; what is no number is an error.
    /// `encoding` is that of PNG and JPEG.
    pub fn image(&self, path: &Path, encoding: Encoding) -> Result<(Texture, Vec<Problem>), Problems> {
        let file = document::read(&self.files, path)?;
        let texture = decode(&file.bytes, path, encoding)?;
        let problems = texture.check(path);
        match problems.iter().any(Problem::is_error) {
            true => Err(in_order(problems)),
            false => Ok((texture, problems)),
        }
    }

    /// What a file holds.
    pub fn kind_of(&self, path: &Path) -> Result<Kind, Problem> {
        let root = document::open(&self.files, path)?;
        Kind::of(&root).ok_or_else(|| {
            Problem::files("this is neither a scene nor a material")
                .at(root.at())
                .hint("begin with Scene(version: 1, …) or Material(version: 1, …)")
        })
    }

    /// The file's text with every default written out; it reads as the same.
    pub fn defaults(&self, path: &Path) -> Result<String, Problems> {
        match self.kind_of(path)? {
            Kind::Scene => {
                self.scene(path, &[])?;
                let (file, root) = self.scene_file(path, &[])?;
                Ok(written("Scene", &build::complete(&file, &root)))
            }
            Kind::Material => {
                self.material(path)?;
                let mut root = self.material_tree(&document::read(&self.files, path)?)?;
                document::rebase(&mut root, path);
                Ok(written("Material", &complete(&typed::<MaterialFile>(&root, "")?)))
            }
            Kind::Bench => {
                self.bench(path)?;
                let (file, root) = self.bench_file(path)?;
                Ok(written("Bench", &bench_file::complete(&file, &root)))
            }
        }
    }

    fn scene_file(&self, path: &Path, sets: &[(String, String)]) -> Result<(SceneFile, Node), Problem> {
        let mut root = document::open(&self.files, path)?;
        check_head(&root, Kind::Scene)?;
        let dir = root.source.dir.clone();
        for (at, ron) in sets {
            root.set_from_flag(at, ron, &dir)?;
        }
        check_head(&root, Kind::Scene)?;
        Ok((typed(&root, "")?, root))
    }

    fn bench_file(&self, path: &Path) -> Result<(BenchFile, Node), Problem> {
        let root = document::open(&self.files, path)?;
        check_head(&root, Kind::Bench)?;
        Ok((typed(&root, "")?, root))
    }

    fn material_tree(&self, file: &File) -> Result<Node, Problem> {
        document::material(&self.files, file, &|root| typed::<MaterialFile>(root, "").map(drop))
    }

    /// The material, if it is sound, and all that there is to say of it.
    fn material_of(&self, file: &File) -> Result<(Option<Material>, Vec<Problem>), Problem> {
        let root = self.material_tree(file)?;
        let spelled: MaterialFile = typed(&root, "")?;
        let mut judge = Judge::new(&root);
        let material = build_material(&spelled, self, &mut judge);
        if let Some(material) = &material {
            warn::material(material, &mut judge);
        }
        Ok((material, judge.problems))
    }

    pub(super) fn default_material(&self) -> Arc<Material> {
        self.default_material.get_or_init(|| Arc::new(build::default_material(self))).clone()
    }

    /// The material of an object; its problems are told once, however many objects share it.
    pub(super) fn material_named(&self, path: &str, name: &str, judge: &mut Judge<'_>) -> Option<Arc<Material>> {
        let file = match named(&self.files, judge.node(path), name) {
            Ok(file) => file,
            Err(problem) => {
                judge.found(path, problem);
                return None;
            }
        };
        if let Some(material) = self.materials.lock().expect("nobody panics while reading").get(&file.path) {
            return material.clone();
        }
        let material = match self.material_of(&file) {
            Ok((material, problems)) => {
                problems.into_iter().for_each(|problem| judge.add(problem));
                material.map(Arc::new)
            }
            Err(problem) => {
                judge.add(match has_line(&problem) {
                    true => problem,
                    false => at_its_name(problem, judge.node(path)).path(path),
                });
                None
            }
        };
        self.materials.lock().expect("nobody panics while reading").insert(file.path, material.clone());
        material
    }

    pub(super) fn mesh_named(&self, path: &str, name: &str, judge: &mut Judge<'_>) -> Option<MeshSource> {
        let node = judge.node(&format!("{path}.0"));
        let read = named(&self.files, node, name).and_then(|file| {
            let read = self.meshes.get(&file.key, || {
                let (mesh, warnings) = read_obj(&file)?;
                Ok(ReadMesh {
                    closed: mesh.is_closed(),
                    extent: mesh.bounds().size().max_element(),
                    mesh: Arc::new(mesh),
                    warnings,
                })
            });
            Ok((read.map_err(|problem| at_its_name(problem, node))?, file))
        });
        match read {
            Ok((read, file)) => {
                read.warnings.into_iter().for_each(|w| judge.found(path, at_its_name(w, node)));
                Some(MeshSource::File { path: file.path, key: file.key, mesh: read.mesh })
            }
            Err(problem) => {
                judge.found(path, problem);
                None
            }
        }
    }

    pub(super) fn texture(
        &self,
        node: &Node,
        name: &str,
        encoding: Encoding,
    ) -> Result<(Arc<Texture>, File, Vec<Problem>), Problem> {
        let file = named(&self.files, node, name)?;
        let read = self.textures.get(&(file.key, encoding), || {
            let texture = decode(&file.bytes, &file.path, encoding)?;
            let (errors, warnings): (Vec<_>, Vec<_>) =
                texture.check(&file.path).into_iter().partition(Problem::is_error);
            match errors.into_iter().next() {
                Some(error) => Err(error),
                None => Ok(ReadTexture { texture: Arc::new(texture), warnings }),
            }
        });
        let read = read.map_err(|problem| at_its_name(problem, node))?;
        Ok((read.texture, file, read.warnings.into_iter().map(|w| at_its_name(w, node)).collect()))
    }

    pub(super) fn is_closed(&self, mesh: &Key) -> bool {
        self.meshes.peek(mesh).is_some_and(|m| m.closed)
    }
    /// The longest side of the mesh's box.
    pub(super) fn extent(&self, mesh: &Key) -> f64 {
        self.meshes.peek(mesh).map_or(0.0, |m| m.extent)
    }

    fn forget(&self) {
        self.meshes.forget();
        self.textures.forget();
        self.materials.lock().expect("nobody panics while reading").clear();
    }
}

/// Once each, by file, then by place; what was found in the order of meaning is shown in the order of the text.
fn in_order(mut problems: Vec<Problem>) -> Problems {
    let mut files: Vec<PathBuf> = Vec::new();
    for at in problems.iter().filter_map(|p| p.at.as_ref()) {
        if !files.contains(&at.file) {
            files.push(at.file.clone());
        }
    }
    problems.sort_by_key(|p| p.at.as_ref().map(|at| (files.iter().position(|f| *f == at.file), at.line, at.column)));
    Problems(problems)
}

fn written(name: &str, value: &impl Serialize) -> String {
    let pretty = ron::ser::PrettyConfig::new().indentor("    ").new_line("\n").compact_arrays(false);
    let text = document::ron().to_string_pretty(value, pretty).expect("what was read can be written");
    format!("{name}{text}\n")
}

/// What was made of content, by its name.
struct Memory<K, T> {
    made: Mutex<Made<K, T>>,
}

struct Made<K, T> {
    now: u64,
    /// With the read that last used it.
    values: BTreeMap<K, (u64, Result<T, Problem>)>,
}

impl<K: Ord + Clone, T: Clone> Memory<K, T> {
    fn new() -> Memory<K, T> {
        Memory { made: Mutex::new(Made { now: 0, values: BTreeMap::new() }) }
    }
    fn get(&self, key: &K, make: impl FnOnce() -> Result<T, Problem>) -> Result<T, Problem> {
        let mut made = self.made.lock().expect("nobody panics while reading");
        let now = made.now;
        let entry = made.values.entry(key.clone()).or_insert_with(|| (now, make()));
        entry.0 = now;
        entry.1.clone()
    }
    fn peek(&self, key: &K) -> Option<T> {
        self.made.lock().expect("nobody panics while reading").values.get(key)?.1.clone().ok()
    }
    fn forget(&self) {
        let mut made = self.made.lock().expect("nobody panics while reading");
        made.now += 1;
        let now = made.now;
        made.values.retain(|_, (used, _)| now - *used <= KEPT_READS);
    }
}
