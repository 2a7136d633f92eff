//! Meshes as no modeller would leave them and every scanner does, as OBJ texts of things about as large as a sphere of
//! radius 1.

use glam::{DVec3, dvec3};
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Vertices and counter-clockwise faces, counted from 0.
#[derive(Clone, Default)]
struct Soup {
    vertices: Vec<DVec3>,
    faces: Vec<[usize; 3]>,
}

impl Soup {
    /// Rings of a sphere at the given latitudes, radians from south to north, and its two poles.
    fn sphere(latitudes: &[f64], around: usize) -> Soup {
        let mut soup = Soup::default();
        for latitude in latitudes {
            for i in 0..around {
                let phi = 2.0 * PI * i as f64 / around as f64;
                let (sin, cos) = phi.sin_cos();
                soup.vertices.push(dvec3(latitude.cos() * cos, latitude.sin(), -latitude.cos() * sin));
            }
        }
        let rings = latitudes.len();
        let at = |ring: usize, i: usize| ring * around + i % around;
        let (south, north) = (soup.vertices.len(), soup.vertices.len() + 1);
        soup.vertices.extend([DVec3::NEG_Y, DVec3::Y]);
        for i in 0..around {
            soup.faces.push([south, at(0, i + 1), at(0, i)]);
            soup.faces.push([north, at(rings - 1, i), at(rings - 1, i + 1)]);
            for ring in 1..rings {
                let (a, b, c, d) = (at(ring - 1, i), at(ring - 1, i + 1), at(ring, i + 1), at(ring, i));
                soup.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        soup
    }

    fn even(rings: usize, around: usize) -> Soup {
        let latitudes: Vec<f64> = (1..rings).map(|i| PI * (i as f64 / rings as f64 - 0.5)).collect();
        Soup::sphere(&latitudes, around)
    }

    fn moved(mut self, scale: DVec3, by: DVec3) -> Soup {
        self.vertices.iter_mut().for_each(|v| *v = *v * scale + by);
        self
    }

    fn with(mut self, other: Soup) -> Soup {
        let first = self.vertices.len();
        self.vertices.extend(other.vertices);
        self.faces.extend(other.faces.into_iter().map(|face| face.map(|v| v + first)));
        self
    }

    fn turned(mut self) -> Soup {
        self.faces.iter_mut().for_each(|face| face.swap(1, 2));
        self
    }

    fn obj(&self) -> String {
        let mut text = String::new();
        for v in &self.vertices {
            writeln!(text, "v {:?} {:?} {:?}", v.x, v.y, v.z).expect("a text grows");
        }
        for [a, b, c] in &self.faces {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("a text grows");
        }
        text
    }
}

/// Names and texts of hard meshes.
pub fn hard() -> Vec<(&'static str, String)> {
    let ball = || Soup::even(8, 12);
    let one = DVec3::ONE;
    // Pairs of rings so close that the triangles between them have angles of a ten-millionth.
    let pairs: Vec<f64> = (1..6).flat_map(|i| [i as f64, i as f64 + 3e-7]).map(|i| PI * (i / 6.0 - 0.5)).collect();
    let slivers = Soup::sphere(&pairs, 16);
    let mut flat = ball();
    let middle = flat.vertices.len();
    let [a, b] = [0, 1].map(|v| flat.vertices[v]);
    flat.vertices.push(0.5 * (a + b));
    flat.faces.extend([[0, 1, middle], [5, 5, 5], [3, 4, 3]]);
    let mut open = ball();
    open.faces.retain(|face| face.iter().all(|v| open.vertices[*v].x <= 0.35));
    let mut fins = ball();
    let first = fins.vertices.len();
    fins.vertices.extend([dvec3(0.0, -1.4, 0.0), dvec3(0.0, 1.4, 0.0)]);
    for i in 0..5 {
        let phi = 1.2 * i as f64;
        fins.vertices.push(dvec3(1.3 * phi.cos(), 0.0, 1.3 * phi.sin()));
        fins.faces.push([first, first + 2 + i, first + 1]);
    }
    let crossing = ball()
        .moved(dvec3(1.0, 0.5, 0.5), DVec3::ZERO)
        .with(ball().moved(dvec3(0.5, 1.0, 0.5), DVec3::ZERO))
        .with(ball().moved(dvec3(0.5, 0.5, 1.0), dvec3(0.1, 0.0, 0.0)));
    let nested = (1..6).fold(Soup::default(), |soup, i| soup.with(ball().moved(one * 0.2 * i as f64, DVec3::ZERO)));
    let specks = (0..20).fold(ball().moved(0.6 * one, DVec3::ZERO), |soup, i| {
        let place = dvec3((i as f64).sin(), 0.1 * i as f64 - 1.0, (1.7 * i as f64).cos());
        soup.with(ball().moved(one * 10f64.powi(-i % 7), place))
    });
    let mut doubled = Soup::default();
    for face in ball().faces {
        let first = doubled.vertices.len();
        doubled.vertices.extend(face.map(|v| ball().vertices[v]));
        doubled.vertices.push(dvec3(1e9, -1e9, 1e9)); // nobody's
        doubled.faces.push([first, first + 1, first + 2]);
    }
    let sheet = Soup {
        vertices: vec![dvec3(-1.0, -1.0, 0.0), dvec3(1.0, -1.0, 0.0), dvec3(1.0, 1.0, 0.0), dvec3(-1.0, 1.0, 0.0)],
        faces: vec![[0, 1, 2], [0, 2, 3]],
    };
    let mut one_face = sheet.clone();
    one_face.faces.truncate(1);
    let far = ball().moved(one, dvec3(1e5, -1e5, 1e5));
    let mut half_turned = ball();
    half_turned.faces.iter_mut().step_by(2).for_each(|face| face.swap(1, 2));
    let normals = ball().obj().replace("f ", "vn 0 0 0\nf ");
    vec![
        ("slivers of 1e-7 rad", slivers.obj()),
        ("faces without area", flat.obj()),
        ("an open mesh", open.obj()),
        ("edges of many faces", fins.obj()),
        ("self-intersecting", crossing.obj()),
        ("one in another", nested.obj()),
        ("specks", specks.obj()),
        ("doubled and stray vertices", doubled.obj()),
        ("inside out", ball().turned().obj()),
        ("every other face turned", half_turned.obj()),
        ("two faces back to back", sheet.clone().with(sheet.clone().turned()).obj()),
        ("a sheet", sheet.obj()),
        ("one triangle", one_face.obj()),
        ("a needle", ball().moved(dvec3(1e-6, 1.0, 1e-6), DVec3::ZERO).obj()),
        ("a wafer", ball().moved(dvec3(1.0, 1.0, 1e-6), DVec3::ZERO).obj()),
        ("far from its own origin", far.obj()),
        ("normals of no length", normals),
    ]
}

/// The meshes that `tools/fetch-models` brought, with the scale that makes each about as large as the others. What is
/// not there is announced.
pub fn scans() -> Vec<(String, PathBuf, f64)> {
    let folder = Path::new("models");
    let listed = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut paths: Vec<PathBuf> = listed.filter(|path| path.extension().is_some_and(|e| e == "obj")).collect();
    paths.sort();
    if paths.is_empty() {
        eprintln!("\n*** NOT STRESSED: scanned meshes. models/ has none: tools/fetch-models brings them. ***\n");
    }
    let measured = |path: PathBuf| {
        let bytes = std::fs::read(&path).expect("it was listed");
        let (mesh, _) = diaphane::geometry::obj::read_obj(&bytes, &path).unwrap_or_else(|problem| panic!("{problem}"));
        let name = path.file_stem().expect("a mesh has a name").to_string_lossy().into_owned();
        let whole = std::path::absolute(&path).expect("the current folder is there");
        (name, whole, 2.0 / mesh.bounds().size().max_element())
    };
    paths.into_iter().map(measured).collect()
}
