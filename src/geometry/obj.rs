//! Wavefront OBJ: the faces of all groups as one mesh; materials, lines, points and curves are left out.
//!
//! What can be repaired is, with a warning that says how often and where first; what cannot is refused at its line.
//! Every line is read here, and not by a crate, because the two things that users need are lost by readers that hand
//! back plain arrays: the place of a mistake, and a mesh that is right where only some corners name a normal or a uv.
//! The time is linear in the file, but for polygons, whose size is bounded; nothing is reserved that a file only claims.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::str::FromStr;

use glam::{Vec2, Vec3};

use crate::geometry::mesh::Mesh;
use crate::geometry::polygon;
use crate::problem::{At, Problem};

/// The mesh of an OBJ file, and what was repaired in it. Its normals are empty if no face names any (see
/// [`Mesh::with_normals`]), and so are its uvs. Vertices are those that faces use; the same position with another
/// normal or uv is another vertex. `path` is for messages.
pub fn read_obj(bytes: &[u8], path: &Path) -> Result<(Mesh, Vec<Problem>), Problem> {
    let mut obj = Obj::default();
    if bytes.contains(&0) {
        return Err(whole(path, "this is binary data, not OBJ text").hint("export the mesh as Wavefront OBJ"));
    }
    for (number, line) in lines(bytes) {
        obj.read(number, &line).map_err(|fault| fault.problem(path, number, &line))?;
    }
    // Faces may name what comes after them, so only now is it known what exists.
    if let Some((number, fault)) = obj.out_of_range() {
        let line = lines(bytes).find(|(n, _)| *n == number).map(|(_, line)| line).unwrap_or_default();
        return Err(fault.problem(path, number, &line));
    }
    if obj.faces.is_empty() {
        let what = if obj.positions.is_empty() { "there is no mesh in this file" } else { "there are no faces" };
        return Err(whole(path, what).hint("an OBJ mesh has lines `v x y z` and faces `f 1 2 3`"));
    }
    obj.mesh(path)
}

fn whole(path: &Path, what: impl Into<String>) -> Problem {
    Problem::files(what).at(At::file(path))
}

/// The lines with their 1-based numbers; one that ends in `\` goes on in the next. Not everything in OBJ files is
/// UTF-8 (names are not), and all that matters is ASCII.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut rest = bytes.split(|&b| b == b'\n').map(String::from_utf8_lossy).enumerate();
    std::iter::from_fn(move || {
        let (i, mut line) = rest.next()?;
        let mut joined = String::new();
        while let Some(head) = line.trim_end().strip_suffix('\\') {
            joined.push_str(head);
            joined.push(' ');
            line = rest.next().map(|(_, next)| next).unwrap_or_default();
        }
        Some((i + 1, if joined.is_empty() { line } else { Cow::Owned(joined + &line) }))
    })
}

/// Something wrong at one word of a line.
struct Fault {
    /// Which word, the keyword being 0.
    word: usize,
    what: String,
    hint: &'static str,
}

impl Fault {
    fn problem(self, path: &Path, number: usize, line: &str) -> Problem {
        // Lines that no one could read in a terminal are not shown.
        const LONGEST: usize = 200;
        let word = line.split_whitespace().nth(self.word).unwrap_or(&line[..0]);
        let start = word.as_ptr() as usize - line.as_ptr() as usize;
        let column = line[..start].chars().count() + 1;
        let readable = line.chars().count() <= LONGEST;
        let at = At {
            file: path.to_path_buf(),
            line: number,
            column,
            source: if readable { line.trim_end().to_string() } else { String::new() },
            width: if readable { word.chars().count().max(1) } else { 1 },
        };
        Problem::files(self.what).at(at).hint(self.hint)
    }
}

/// A word as a message shows it.
fn shown(word: &str) -> String {
    match word.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_string(),
    }
}

/// How often something was repaired, and the line of the first time.
#[derive(Default)]
struct Count {
    times: usize,
    first: usize,
}

impl Count {
    fn add(&mut self, line: usize) {
        if self.times == 0 {
            self.first = line;
        }
        self.times += 1;
    }
}

/// Position, uv and normal of a face's corner as the file counts them, from 0; `NONE` where it names none.
type Corner = [u32; 3];
const NONE: u32 = u32::MAX;
const KINDS: [&str; 3] = ["position", "uv", "normal"];

struct Face {
    line: usize,
    corners: std::ops::Range<usize>,
}

#[derive(Default)]
struct Obj {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    corners: Vec<Corner>,
    faces: Vec<Face>,
    bad_uvs: Count,
    short_faces: Count,
    no_faces: Count,
    unknown: Count,
}

impl Obj {
    fn read(&mut self, number: usize, line: &str) -> Result<(), Fault> {
        let mut words = line.split('#').next().unwrap_or("").split_whitespace();
        match words.next() {
            Some("v") => {
                let p = numbers(words, [None, None, None])?;
                if let Some(i) = p.iter().position(|x| !x.is_finite()) {
                    let what = format!("the {} coordinate of a position is not a finite number", ["x", "y", "z"][i]);
                    return Err(Fault {
                        word: i + 1,
                        what,
                        hint: "finite f32 numbers, below 3e38; export the mesh again",
                    });
                }
                self.positions.push(Vec3::from_array(p));
            }
            Some("vt") => {
                let uv = Vec2::from_array(numbers(words, [None, Some(0.0)])?);
                if !uv.is_finite() {
                    self.bad_uvs.add(number);
                }
                self.uvs.push(if uv.is_finite() { uv } else { Vec2::ZERO });
            }
            // Normals without a direction count as missing, at the corners that name them.
            Some("vn") => self.normals.push(Vec3::from_array(numbers(words, [None, None, None])?)),
            Some("f" | "fo") => self.read_face(number, words)?,
            Some("l" | "p" | "curv" | "curv2" | "surf") => self.no_faces.add(number),
            Some(
                "g" | "o" | "s" | "mg" | "usemtl" | "mtllib" | "vp" | "cstype" | "deg" | "bmat" | "step" | "parm"
                | "trim" | "hole" | "scrv" | "sp" | "end" | "con" | "bevel" | "c_interp" | "d_interp" | "lod"
                | "usemap" | "maplib" | "shadow_obj" | "trace_obj" | "ctech" | "stech",
            )
            | None => (),
            Some(_) => self.unknown.add(number),
        }
        Ok(())
    }

    fn read_face<'w>(&mut self, line: usize, words: impl Iterator<Item = &'w str>) -> Result<(), Fault> {
        let start = self.corners.len();
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for (i, word) in words.enumerate() {
            self.corners.push(corner(word, counts).map_err(|what| Fault {
                word: i + 1,
                what,
                hint: "a corner is v, v/vt, v//vn or v/vt/vn: numbers from 1, or from -1 back from the last one",
            })?);
        }
        if self.corners.len() - start < 3 {
            self.corners.truncate(start);
            self.short_faces.add(line);
        } else {
            self.faces.push(Face { line, corners: start..self.corners.len() });
        }
        Ok(())
    }

    /// The first corner that names what the file does not hold.
    fn out_of_range(&self) -> Option<(usize, Fault)> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        self.faces.iter().find_map(|face| {
            self.corners[face.corners.clone()].iter().enumerate().find_map(|(i, corner)| {
                let kind = (0..3).find(|&k| corner[k] != NONE && corner[k] as usize >= counts[k])?;
                let what = match counts[kind] {
                    0 => format!("{} {} is named, but the file has none", KINDS[kind], corner[kind] as u64 + 1),
                    n => format!("{} {} is named, but the file has only {n}", KINDS[kind], corner[kind] as u64 + 1),
                };
                Some((face.line, Fault { word: i + 1, what, hint: "the file may be cut off; export it again" }))
            })
        })
    }

    fn mesh(mut self, path: &Path) -> Result<(Mesh, Vec<Problem>), Problem> {
        // A uv or normal counts only where it can be used.
        let has_direction = |n: Vec3| n.is_finite() && n != Vec3::ZERO;
        let mut no_direction = Count::default();
        for face in &self.faces {
            for corner in &mut self.corners[face.corners.clone()] {
                if corner[2] != NONE && !has_direction(self.normals[corner[2] as usize]) {
                    corner[2] = NONE;
                    no_direction.add(face.line);
                }
            }
        }
        let named = |kind: usize| self.corners.iter().any(|corner| corner[kind] != NONE);
        let (with_uvs, with_normals) = (named(1), named(2));

        let mut mesh = Mesh::default();
        let mut vertices: HashMap<Corner, u32> = HashMap::new();
        let mut undirected: Vec<u32> = Vec::new();
        let (mut no_area, mut fans, mut no_uv, mut no_normal) =
            (Count::default(), Count::default(), Count::default(), Count::default());
        for face in &self.faces {
            let corners = &self.corners[face.corners.clone()];
            let places: Vec<_> = corners.iter().map(|c| self.positions[c[0] as usize].as_dvec3()).collect();
            let triangles = polygon::triangulate(&places).unwrap_or_else(|| {
                fans.add(face.line);
                (1..corners.len() - 1).map(|i| [0, i, i + 1]).collect()
            });
            let has_area = |t: &[usize; 3]| {
                let [a, b, c] = t.map(|i| places[i]);
                (b - a).cross(c - a).length_squared() > 0.0
            };
            if !triangles.iter().any(has_area) {
                no_area.add(face.line);
                continue;
            }
            if with_uvs && corners.iter().any(|c| c[1] == NONE) {
                no_uv.add(face.line);
            }
            if with_normals && corners.iter().any(|c| c[2] == NONE) {
                no_normal.add(face.line);
            }
            for triangle in triangles.iter().filter(|t| has_area(t)) {
                mesh.triangles.push(triangle.map(|i| {
                    *vertices.entry(corners[i]).or_insert_with(|| {
                        let [v, vt, vn] = corners[i];
                        let new = mesh.positions.len() as u32;
                        mesh.positions.push(self.positions[v as usize]);
                        if with_uvs {
                            mesh.uvs.push(self.uvs.get(vt as usize).copied().unwrap_or_default());
                        }
                        if with_normals {
                            // In f64 every f32 vector has a length.
                            let normal = self.normals.get(vn as usize).map(|n| n.as_dvec3().normalize().as_vec3());
                            undirected.extend(normal.is_none().then_some(new));
                            mesh.normals.push(normal.unwrap_or_default());
                        }
                        new
                    })
                }));
            }
        }
        if mesh.triangles.is_empty() {
            return Err(whole(path, "none of the faces has an area").hint("the mesh is flattened to a line or a point"));
        }
        if !undirected.is_empty() {
            let smooth = mesh.smooth_normals();
            for v in undirected {
                mesh.normals[v as usize] = smooth[v as usize];
            }
        }
        // Faces whose normals have no direction have been counted once already.
        no_normal.times = if no_direction.times > 0 { 0 } else { no_normal.times };

        let mut used = vec![false; self.positions.len()];
        for corner in &self.corners {
            used[corner[0] as usize] = true;
        }
        let unused = Count { times: used.iter().filter(|used| !**used).count(), first: 0 };
        let repairs = [
            (unused, "vertex belongs", "vertices belong", "to no face; left out"),
            (no_area, "face has", "faces have", "no area; dropped"),
            (self.short_faces, "face has", "faces have", "less than three corners; dropped"),
            (self.no_faces, "line, point or curve is", "lines, points or curves are", "not rendered"),
            (fans, "polygon has", "polygons have", "too many corners; cut as a fan, right only where it is convex"),
            (self.bad_uvs, "uv is", "uvs are", "not finite; set to (0, 0)"),
            (no_uv, "face has", "faces have", "corners without a uv; set to (0, 0)"),
            (no_direction, "corner has", "corners have", "a normal without a direction; computed from the faces"),
            (no_normal, "face has", "faces have", "corners without a normal; computed from the faces"),
            (self.unknown, "line is", "lines are", "of a kind that OBJ does not have; skipped"),
        ];
        let warnings = repairs.into_iter().filter(|repair| repair.0.times > 0).map(|(count, one, many, what)| {
            let subject = if count.times == 1 { one } else { many };
            let at = At { line: count.first, column: usize::from(count.first > 0), ..At::file(path) };
            Problem::warning(format!("{} {subject} {what}", count.times)).at(at)
        });
        Ok((mesh, warnings.collect()))
    }
}

/// As many numbers as there are places; a place with a value may be missing, and more words may follow (weights,
/// colours).
fn numbers<'w, const N: usize>(
    mut words: impl Iterator<Item = &'w str>,
    default: [Option<f32>; N],
) -> Result<[f32; N], Fault> {
    let mut found = [0.0; N];
    for (i, (number, default)) in found.iter_mut().zip(default).enumerate() {
        *number = match (words.next(), default) {
            (Some(word), _) => f32::from_str(word).map_err(|_| Fault {
                word: i + 1,
                what: format!("`{}` is not a number", shown(word)),
                hint: "numbers like 1.5 or -2e-3, parted by spaces",
            })?,
            (None, Some(default)) => default,
            (None, None) => {
                let what = format!("{i} numbers, but {N} are needed");
                return Err(Fault { word: 0, what, hint: "the file may be cut off; export it again" });
            }
        };
    }
    Ok(found)
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 0; whether positive ones exist is told later.
fn corner(word: &str, counts: [usize; 3]) -> Result<Corner, String> {
    let mut corner = [NONE; 3];
    let mut parts = word.split('/');
    for (kind, (index, count)) in corner.iter_mut().zip(counts).enumerate() {
        let Some(part) = parts.next() else { break };
        if part.is_empty() && kind > 0 {
            continue;
        }
        let number = i64::from_str(part).map_err(|_| format!("`{}` is not a corner of a face", shown(word)))?;
        let from_zero = match number {
            0 => return Err(format!("{} 0 does not exist: OBJ counts from 1", KINDS[kind])),
            1.. => number - 1,
            _ if number.unsigned_abs() as usize <= count => count as i64 + number,
            _ => return Err(format!("{} {number} is named, but only {count} stand before it", KINDS[kind])),
        };
        *index = u32::try_from(from_zero)
            .ok()
            .filter(|&i| i != NONE)
            .ok_or_else(|| format!("{} {number} is beyond what a mesh can hold", KINDS[kind]))?;
    }
    if parts.next().is_some() {
        return Err(format!("`{}` has more than three parts", shown(word)));
    }
    Ok(corner)
}

#[cfg(test)]
mod tests;
