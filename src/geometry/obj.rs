//! Wavefront OBJ: the faces of all groups as one mesh; materials, lines, points and curves are left out.
//!
//! The crate `tobj` reads the file; here is what comes before and after it.
//! - Before: a check of every line. What can be repaired is, with a warning that says how often and where first; what
//!   cannot is refused at its line. tobj says neither where a mistake is nor what it guesses (a corner without a uv gets
//!   its neighbour's), so it is handed a plain text: the numbers of the file, and faces whose corners count from the
//!   start and all name as much. Left out are comments behind words and continued lines, which it cannot read, weights
//!   and colours, and groups, each of which would be a mesh with positions of its own.
//! - After: its arrays become triangles and vertices. Corners that name the same are one vertex, polygons are clipped,
//!   faces without an area dropped, and normals without a direction computed.
//!
//! The time is linear in the file, but for polygons, whose size is bounded; nothing is reserved that a file only claims.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::str::{FromStr, SplitWhitespace};

use glam::{Vec2, Vec3};

use crate::geometry::mesh::Mesh;
use crate::geometry::polygon;
use crate::problem::{At, Problem};

/// The mesh of an OBJ file, and what was repaired in it. Its normals are empty if no face names any (see
/// [`Mesh::with_normals`]), and so are its uvs. Vertices are those that faces use; the same position with another
/// normal or uv is another vertex. `path` is for messages.
pub fn read_obj(bytes: &[u8], path: &Path) -> Result<(Mesh, Vec<Problem>), Problem> {
    if bytes.contains(&0) {
        return Err(whole(path, "this is binary data, not OBJ text").hint("export the mesh as Wavefront OBJ"));
    }
    // Some editors begin a text with a mark of its encoding, which would hide the first vertex and shift all others.
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let mut checked = Checked::default();
    // Faces may name what comes after them.
    for (_, line) in lines(bytes) {
        let keyword = words(&line).next();
        if let Some(kind) = KEYWORDS.iter().position(|&k| keyword == Some(k)) {
            checked.totals[kind] += 1;
        }
    }
    for (number, line) in lines(bytes) {
        checked.add(number, &line).map_err(|fault| fault.problem(path, bytes, number, &line))?;
    }
    if checked.faces.is_empty() {
        let what = if checked.totals[0] == 0 { "there is no mesh in this file" } else { "there are no faces" };
        return Err(whole(path, what).hint("an OBJ mesh has lines `v x y z` and faces `f 1 2 3`"));
    }
    let read = checked.read().map_err(|error| whole(path, error.to_string()))?;
    checked.mesh(&read, path)
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

/// Without the comment.
fn words(line: &str) -> SplitWhitespace<'_> {
    line.split('#').next().unwrap_or_default().split_whitespace()
}

/// Something wrong at one word of a line.
struct Fault {
    /// Which word, the keyword being 0.
    word: usize,
    what: String,
    hint: &'static str,
}

impl Fault {
    /// `line` begins as the line `number` of `bytes`, and may go on in those after it.
    fn problem(self, path: &Path, bytes: &[u8], number: usize, line: &str) -> Problem {
        let word = line.split_whitespace().nth(self.word).unwrap_or(&line[..0]);
        let mut start = word.as_ptr() as usize - line.as_ptr() as usize;
        let mut own = bytes.split(|&b| b == b'\n').map(String::from_utf8_lossy).zip(1..).skip(number - 1);
        let (mut text, mut number) = own.next().expect("the line is one of them");
        while let Some(head) = text.trim_end().strip_suffix('\\').map(str::len).filter(|&head| start > head) {
            start -= head + 1;
            (text, number) = own.next().expect("the word stands in one of them");
        }
        Problem::files(self.what).at(At::in_line(path, number, &text, start..start + word.len())).hint(self.hint)
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

const KEYWORDS: [&str; 3] = ["v", "vt", "vn"];
const KINDS: [&str; 3] = ["position", "uv", "normal"];

/// A file whose lines have been checked.
#[derive(Default)]
struct Checked {
    /// The file in plain form.
    text: String,
    /// How many positions, uvs and normals the file holds, and how many of them stand before the next line.
    totals: [usize; 3],
    seen: [usize; 3],
    /// Whether any face names a position, uv or normal.
    named: [bool; 3],
    /// The line of each face of the text.
    faces: Vec<usize>,
    bad_uvs: Count,
    no_uv: Count,
    short_faces: Count,
    no_faces: Count,
    unknown: Count,
}

impl Checked {
    fn add(&mut self, line_number: usize, line: &str) -> Result<(), Fault> {
        let mut words = words(line);
        match words.next() {
            Some("v") => {
                let (p, bad) = numbers::<3>(words, 3)?;
                if let Some(i) = bad {
                    let what = format!("the {} coordinate of a position is not a finite number", ["x", "y", "z"][i]);
                    let hint = "finite f32 numbers, below 3e38; export the mesh again";
                    return Err(Fault { word: i + 1, what, hint });
                }
                self.hand_on(0, &p);
            }
            Some("vt") => {
                let (uv, bad) = numbers::<2>(words, 1)?;
                if bad.is_some() {
                    self.bad_uvs.add(line_number);
                }
                self.hand_on(1, if bad.is_some() { &["0"; 2] } else { &uv });
            }
            // Normals without a direction count as missing, at the corners that name them.
            Some("vn") => self.hand_on(2, &numbers::<3>(words, 3)?.0),
            Some("f" | "fo") => self.add_face(line_number, words)?,
            Some("l" | "p" | "curv" | "curv2" | "surf") => self.no_faces.add(line_number),
            Some(
                "g" | "o" | "s" | "mg" | "usemtl" | "mtllib" | "vp" | "cstype" | "deg" | "bmat" | "step" | "parm"
                | "trim" | "hole" | "scrv" | "sp" | "end" | "con" | "bevel" | "c_interp" | "d_interp" | "lod"
                | "usemap" | "maplib" | "shadow_obj" | "trace_obj" | "ctech" | "stech",
            )
            | None => (),
            Some(_) => self.unknown.add(line_number),
        }
        Ok(())
    }

    fn hand_on(&mut self, kind: usize, numbers: &[&str]) {
        self.seen[kind] += 1;
        self.text += &format!("{} {}\n", KEYWORDS[kind], numbers.join(" "));
    }

    /// Every corner names a uv if the file holds any, and a normal; where it names none, one behind the last.
    fn add_face(&mut self, line_number: usize, words: SplitWhitespace<'_>) -> Result<(), Fault> {
        if words.clone().count() < 3 {
            self.short_faces.add(line_number);
            return Ok(());
        }
        self.faces.push(line_number);
        self.text.push('f');
        let mut has_uvs = true;
        for (i, word) in words.enumerate() {
            let hint = "a corner is v, v/vt, v//vn or v/vt/vn: numbers from 1, or from -1 back from the last one";
            let corner = self.corner(word).map_err(|what| Fault { word: i + 1, what, hint })?;
            has_uvs &= corner[1].is_some();
            for (kind, index) in corner.into_iter().enumerate() {
                self.named[kind] |= index.is_some();
                self.text.push(if kind == 0 { ' ' } else { '/' });
                if self.totals[kind] > 0 {
                    self.text += &index.unwrap_or(self.totals[kind] + 1).to_string();
                }
            }
        }
        self.text.push('\n');
        if !has_uvs {
            self.no_uv.add(line_number);
        }
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1.
    fn corner(&self, word: &str) -> Result<[Option<usize>; 3], String> {
        if word.split('/').nth(3).is_some() {
            return Err(format!("`{}` has more than three parts", shown(word)));
        }
        let mut corner = [None; 3];
        for (kind, (index, part)) in corner.iter_mut().zip(word.split('/')).enumerate() {
            if part.is_empty() && kind > 0 {
                continue;
            }
            let number = isize::from_str(part).map_err(|_| format!("`{}` is not a corner of a face", shown(word)))?;
            let (name, seen, total) = (KINDS[kind], self.seen[kind], self.totals[kind]);
            let distance = number.unsigned_abs();
            *index = Some(match number {
                0 => return Err(format!("{name} 0 does not exist: OBJ counts from 1")),
                1.. if distance <= total => distance,
                1.. if total == 0 => return Err(format!("{name} {number} is named, but the file has none")),
                1.. => return Err(format!("{name} {number} is named, but the file has only {total}")),
                _ if distance <= seen => seen + 1 - distance,
                _ => return Err(format!("{name} {number} is named, but only {seen} stand before it")),
            });
        }
        Ok(corner)
    }

    /// What tobj reads: one mesh, since the text has no groups, that holds what its faces use.
    fn read(&mut self) -> Result<tobj::Mesh, tobj::LoadError> {
        // What corners name that name nothing; no direction marks the normals to compute.
        for (kind, filler) in [(1, "vt 0 0\n"), (2, "vn 0 0 0\n")] {
            if self.totals[kind] > 0 {
                self.text += filler;
            }
        }
        let text = std::mem::take(&mut self.text);
        let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
        let (mut models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default()))?;
        Ok(models.swap_remove(0).mesh)
    }

    fn mesh(self, read: &tobj::Mesh, path: &Path) -> Result<(Mesh, Vec<Problem>), Problem> {
        let positions: Vec<Vec3> = read.positions.chunks_exact(3).map(Vec3::from_slice).collect();
        let uvs: Vec<Vec2> = read.texcoords.chunks_exact(2).map(Vec2::from_slice).collect();
        // In f64 every f32 vector has a length; zero stands for no direction.
        let direction = |n: &[f32]| Vec3::from_slice(n).as_dvec3().normalize_or_zero().as_vec3();
        let normals: Vec<Vec3> = read.normals.chunks_exact(3).map(direction).collect();
        let with_normals = normals.iter().any(|&n| n != Vec3::ZERO);
        // Empty arrays are left out of what corners name.
        let named = |indices: &[u32], i: usize| indices.get(i).copied().unwrap_or_default();
        let corner = |i| [read.indices[i], named(&read.texcoord_indices, i), named(&read.normal_indices, i)];
        let corners: Vec<[u32; 3]> = (0..read.indices.len()).map(corner).collect();

        let mut mesh = Mesh::default();
        let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
        let (mut no_area, mut fans, mut no_normal) = (Count::default(), Count::default(), Count::default());
        let mut rest = &corners[..];
        for (i, &line) in self.faces.iter().enumerate() {
            // tobj leaves the arities out where all are 3.
            let (corners, after) = rest.split_at(read.face_arities.get(i).map_or(3, |&arity| arity as usize));
            rest = after;
            let places: Vec<_> = corners.iter().map(|c| positions[c[0] as usize].as_dvec3()).collect();
            let triangles = polygon::triangulate(&places).unwrap_or_else(|| {
                fans.add(line);
                (1..corners.len() - 1).map(|i| [0, i, i + 1]).collect()
            });
            let has_area = |t: &[usize; 3]| {
                let [a, b, c] = t.map(|i| places[i]);
                (b - a).cross(c - a).length_squared() > 0.0
            };
            if !triangles.iter().any(has_area) {
                no_area.add(line);
                continue;
            }
            if self.named[2] && corners.iter().any(|c| normals[c[2] as usize] == Vec3::ZERO) {
                no_normal.add(line);
            }
            for triangle in triangles.iter().filter(|t| has_area(t)) {
                mesh.triangles.push(triangle.map(|i| {
                    *vertices.entry(corners[i]).or_insert_with(|| {
                        let [v, vt, vn] = corners[i];
                        let new = mesh.positions.len() as u32;
                        mesh.positions.push(positions[v as usize]);
                        if self.named[1] {
                            mesh.uvs.push(uvs[vt as usize]);
                        }
                        if with_normals {
                            mesh.normals.push(normals[vn as usize]);
                        }
                        new
                    })
                }));
            }
        }
        if mesh.triangles.is_empty() {
            return Err(whole(path, "none of the faces has an area").hint("the mesh is flattened to a line or a point"));
        }
        if mesh.normals.contains(&Vec3::ZERO) {
            let smooth = mesh.smooth_normals();
            for (normal, smooth) in mesh.normals.iter_mut().zip(smooth).filter(|pair| *pair.0 == Vec3::ZERO) {
                *normal = smooth;
            }
        }
        // tobj keeps the positions that faces name.
        let unused = Count { times: self.totals[0] - positions.len(), first: 0 };
        let no_uv = if self.named[1] { self.no_uv } else { Count::default() };
        let repairs = [
            (unused, "vertex belongs", "vertices belong", "to no face; left out"),
            (no_area, "face has", "faces have", "no area; dropped"),
            (self.short_faces, "face has", "faces have", "less than three corners; dropped"),
            (self.no_faces, "line, point or curve is", "lines, points or curves are", "not rendered"),
            (fans, "polygon has", "polygons have", "too many corners; cut as a fan, right only where it is convex"),
            (self.bad_uvs, "uv is", "uvs are", "not finite; set to (0, 0)"),
            (no_uv, "face has", "faces have", "corners without a uv; set to (0, 0)"),
            (no_normal, "face has", "faces have", "corners without a usable normal; computed from the faces"),
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

/// The words of `N` numbers, and the place of the first that is not finite. Only `needed` of them must be there, the
/// others are 0; more words may follow (weights, colours).
fn numbers<const N: usize>(mut words: SplitWhitespace<'_>, needed: usize) -> Result<([&str; N], Option<usize>), Fault> {
    let mut found = ["0"; N];
    let mut bad = None;
    for (i, place) in found.iter_mut().enumerate() {
        let Some(word) = words.next() else {
            if i >= needed {
                break;
            }
            let what = format!("{i} numbers, but {needed} are needed");
            return Err(Fault { word: 0, what, hint: "the file may be cut off; export it again" });
        };
        let number = f32::from_str(word).map_err(|_| Fault {
            word: i + 1,
            what: format!("`{}` is not a number", shown(word)),
            hint: "numbers like 1.5 or -2e-3, parted by spaces",
        })?;
        bad = bad.or((!number.is_finite()).then_some(i));
        *place = word;
    }
    Ok((found, bad))
}

#[cfg(test)]
mod tests;
