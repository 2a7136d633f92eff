use super::*;
use crate::geometry::normals::Normals;
use crate::geometry::shapes;
use glam::DVec3;
use proptest::prelude::*;
use std::fmt::Write;

fn read(text: &str) -> Result<(Mesh, Vec<String>), Problem> {
    let (mesh, warnings) = read_obj(text.as_bytes(), Path::new("m.obj"))?;
    assert!(warnings.iter().all(|w| !w.is_error()));
    assert_eq!(mesh.normals.len() * mesh.uvs.len() % mesh.positions.len(), 0);
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < mesh.positions.len()));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    Ok((mesh, warnings.iter().map(|w| w.to_string()).collect()))
}

fn clean(text: &str) -> Mesh {
    let (mesh, warnings) = read(text).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    mesh
}

/// The one warning of a file that has exactly one.
fn warning(text: &str) -> (Mesh, String) {
    let (mesh, warnings) = read(text).unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    (mesh, warnings[0].clone())
}

fn refused(text: &str) -> String {
    read(text).unwrap_err().to_string()
}

fn write(mesh: &Mesh) -> String {
    let mut text = String::new();
    let mut line = |kind: &str, numbers: &[f32]| {
        let numbers: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
        writeln!(text, "{kind} {}", numbers.join(" ")).unwrap();
    };
    mesh.positions.iter().for_each(|p| line("v", &p.to_array()));
    mesh.uvs.iter().for_each(|uv| line("vt", &uv.to_array()));
    mesh.normals.iter().for_each(|n| line("vn", &n.to_array()));
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| v + 1);
        writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}").unwrap();
    }
    text
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn what_is_written_is_read() {
    for mesh in [shapes::sphere(1.0, 2), shapes::torus(1.0, 0.3, (8, 6)), shapes::cuboid(DVec3::ONE)] {
        let again = clean(&write(&mesh));
        // Vertices are numbered as the faces meet them.
        assert_eq!(again.triangles.len(), mesh.triangles.len());
        assert_eq!(again.positions.len(), mesh.positions.len());
        for (a, b) in again.triangles.iter().zip(&mesh.triangles) {
            for (&a, &b) in a.iter().zip(b) {
                let (a, b) = (a as usize, b as usize);
                assert_eq!((again.positions[a], again.uvs[a]), (mesh.positions[b], mesh.uvs[b]));
                assert!(again.normals[a].distance(mesh.normals[b]) < 1e-6);
            }
        }
    }
}

#[test]
fn a_plain_file_is_as_tobj_reads_it() {
    let text = write(&shapes::torus(1.0, 0.3, (8, 6)));
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default())).unwrap();
    let (theirs, ours) = (&models[0].mesh, clean(&text));
    assert_eq!(theirs.indices, ours.triangles.concat());
    assert_eq!(theirs.positions, ours.positions.iter().flat_map(|p| p.to_array()).collect::<Vec<_>>());
}

#[test]
fn what_tobj_would_misread_is_read() {
    // A corner without a uv does not get its neighbour's, nor one without a normal.
    let (mesh, _) = read(&format!("{SQUARE}vt 1 1\nvn 0 1 0\nf 1/1/1 2 3//1\nf 1 3/1 4\n")).unwrap();
    let (uv, normal) = (|v: usize| mesh.uvs[v] == Vec2::ONE, |v: usize| mesh.normals[v] == Vec3::Y);
    let first = mesh.triangles[0].map(|v| (uv(v as usize), normal(v as usize)));
    let second = mesh.triangles[1].map(|v| (uv(v as usize), normal(v as usize)));
    assert_eq!(first, [(true, true), (false, false), (false, true)]);
    assert_eq!(second, [(false, false), (true, false), (false, false)]);
    // Groups share their vertices, and name what comes after them.
    let grouped = clean(&format!("g a\nf 1 2 3\ng b\nusemtl c\nf 1 3 4\n{SQUARE}"));
    assert_eq!((grouped.positions.len(), grouped.area()), (4, 1.0));
    // Words that it refuses, or takes for a scale.
    for more in ["0", "2", "1 1", "1 0 0", "1 1 1 1"] {
        let mesh =
            clean(&format!("{SQUARE}v 2 2 2 {more}\nvt 0.5\nvn 1 0 0 0\nusemtl\nf 1 2 3 4\nf 5 2 1 # the end\n"));
        assert_eq!((mesh.positions[4], mesh.triangles.len()), (Vec3::splat(2.0), 3));
    }
}

#[test]
fn groups_polygons_negative_indices_and_continued_lines() {
    let square = clean(&format!("# a comment\nmtllib nowhere.mtl\no a\n{SQUARE}g b\nusemtl stone\ns 1\nf 1 2 3 4\n"));
    assert_eq!((square.positions.len(), square.triangles.len(), square.area()), (4, 2, 1.0));
    assert!(square.normals.is_empty() && square.uvs.is_empty());
    assert_eq!(clean(&format!("{SQUARE}f -4 -3 -2 -1")).triangles, square.triangles);
    assert_eq!(clean(&format!("{SQUARE}f 1 2 \\\r\n 3 \\\r\n4\r\n")).triangles, square.triangles);
    assert_eq!(clean(&format!("f 1 2 3 4\n{SQUARE}")).triangles, square.triangles);
    // Weights and colours after a position; a byte that is no UTF-8 in a name.
    let bytes = b"g \xff\nv 0 0 0 1 1 0 0\nv 1 0 0 1\nv 0 1 0\nf 1 2 3 # the end\n";
    assert_eq!(read_obj(bytes, Path::new("m.obj")).unwrap().0.triangles.len(), 1);
    // A concave polygon, whose fan from its first corner would cover more than it.
    let arrow = clean("v 1 0 0\nv 0 2 0\nv -1 0 0\nv 0 0.5 0\nf 1 2 3 4\n");
    assert!((arrow.area() - 1.5).abs() < 1e-6);
    // Corners with other normals are other vertices.
    let corner = clean(&format!("{SQUARE}vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"));
    assert_eq!(corner.positions.len(), 6);
}

#[test]
fn repairs_are_told_and_counted() {
    let face = "f 1 2 3 4\n";
    let (mesh, told) = warning(&format!("{SQUARE}v 9 9 9\nv 8 8 8\n{face}"));
    assert_eq!((mesh.positions.len(), told.as_str()), (4, "m.obj: warning: 2 vertices belong to no face; left out"));
    let (mesh, told) = warning(&format!("{SQUARE}{face}f 1 1 2\nf 1 2 2\n"));
    assert_eq!(mesh.triangles.len(), 2);
    assert!(told.starts_with("m.obj:6:1: warning: 2 faces have no area; dropped"), "{told}");
    for (more, about) in [
        ("f 1 2\n", "1 face has less than three corners"),
        ("l 1 2\np 1\n", "2 lines, points or curves are not rendered"),
        ("facet 1 2 3\n", "1 line is of a kind that OBJ does not have"),
        ("vt nan 0\n", "1 uv is not finite"),
        ("vt 0 1\nf 1/1 2/1 3/1\n", "1 face has corners without a uv"),
        ("vn 0 0 -1\nf 1//1 3//1 2//1\n", "1 face has corners without a usable normal"),
    ] {
        let (mesh, told) = warning(&format!("{SQUARE}{face}{more}"));
        assert!(told.contains(about) && told.starts_with("m.obj:"), "{told}");
        assert!(!mesh.triangles.is_empty());
    }
    for normal in ["0 0 0", "nan 0 1", "inf 0 0"] {
        let (mesh, told) = warning(&format!("{SQUARE}vn {normal}\nvn 0 1 0\nf 1//2 2//1 3//2\nf 1//2 3//2 4//2\n"));
        assert!(told.contains("1 face has corners without a usable normal"), "{told}");
        assert_eq!(mesh.normals[0], Vec3::Y);
        assert_eq!(mesh.normals[1], Vec3::Z);
        assert_eq!(mesh.clone().with_normals(Normals::Auto), mesh);
    }
    let (mesh, _) = warning(&format!("{SQUARE}vn 0 0 0\nf 1//1 2//1 3//1\n").replace("v 0 1 0\n", ""));
    assert!(mesh.normals.is_empty(), "there is no normal that could be kept");
    // A polygon beyond what is clipped.
    let mut round = String::new();
    for i in 0..600 {
        let (sin, cos) = (i as f32 / 600.0 * 6.2831855).sin_cos();
        writeln!(round, "v {cos} {sin} 0").unwrap();
    }
    let all: Vec<String> = (1..=600).map(|i| i.to_string()).collect();
    let (mesh, told) = warning(&format!("{round}f {}\n", all.join(" ")));
    assert!(told.contains("1 polygon has too many corners") && (mesh.area() - std::f64::consts::PI).abs() < 1e-3);
}

#[test]
fn what_cannot_be_repaired_is_refused_at_its_line() {
    for (text, place, about) in [
        ("", "m.obj: ", "no mesh in this file"),
        ("# nothing\n", "m.obj: ", "no mesh in this file"),
        (SQUARE, "m.obj: ", "no faces"),
        ("v 0 0 0\nl 1 1\np 1\n", "m.obj: ", "no faces"),
        ("solid stl\nfacet normal 0 0 1\n", "m.obj: ", "no mesh in this file"),
        ("\0\u{1}binary", "m.obj: ", "binary"),
        ("v 0 0 0\nv 1 nan 0\n", "m.obj:2:5: ", "the y coordinate of a position is not a finite number"),
        ("v 0 0 0\n  v 1 0 1e39\n", "m.obj:2:9: ", "the z coordinate"),
        ("v 0 zero 0\n", "m.obj:1:5: ", "`zero` is not a number"),
        ("v 0 0\n", "m.obj:1:1: ", "2 numbers, but 3 are needed"),
        ("v 0 0 0\nf 1 1 1\n", "m.obj: ", "none of the faces has an area"),
        ("v 0 0 0\n\nf 1 1 7 # x\n", "m.obj:3:7: ", "position 7 is named, but the file has only 1"),
        ("v 0 0 0\nf 1/2 1 1\n", "m.obj:2:3: ", "uv 2 is named, but the file has none"),
        ("v 0 0 0\nf 1 1//9 1\n", "m.obj:2:5: ", "normal 9 is named"),
        ("v 0 0 0\nf 1 -2 1\n", "m.obj:2:5: ", "position -2 is named, but only 1 stand before it"),
        ("v 0 0 0\nf 1 0 1\n", "m.obj:2:5: ", "OBJ counts from 1"),
        ("v 0 0 0\nf 1 99999999999 1\n", "m.obj:2:5: ", "position 99999999999 is named, but the file has only 1"),
        ("v 0 0 0\nf 1 99999999999999999999999 1\n", "m.obj:2:5: ", "not a corner"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "m.obj:2:3: ", "more than three parts"),
        ("v 0 0 0\nf x 1 1\n", "m.obj:2:3: ", "`x` is not a corner"),
    ] {
        let told = refused(text);
        assert!(told.starts_with(place) && told.contains(about), "{text:?}: {told}");
    }
}

#[test]
fn a_mistake_in_a_continued_line_is_told_where_it_stands() {
    let told = refused("v 0 0 0\nf 1 \\\n 1 \\\r\n  one\nf 1 1 1\n");
    assert!(told.starts_with("m.obj:4:3:") && told.contains("4 |   one\n  |   ^^^\n"), "{told}");
    assert!(refused("v 0 0 0\nv 1 2 \\\n").starts_with("m.obj:2:1:"));
}

#[test]
fn a_mark_of_the_encoding_hides_no_vertex() {
    let text = format!("{SQUARE}f 1 2 3 4\n");
    assert_eq!(clean(&format!("\u{feff}{text}")), clean(&text));
}

#[test]
fn long_lines_are_read_in_linear_time_and_not_printed() {
    let told = refused(&format!("v 0 0 0\nf {}x\n", "1 ".repeat(100_000)));
    assert!(told.starts_with("m.obj:2:200003:") && told.len() < 1000, "{told}");
    assert!(refused(&"\\\n".repeat(200_000)).contains("no mesh"));
    assert!(refused(&format!("v {}\n", "9".repeat(100_000))).len() < 1000);
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_obj(&bytes, Path::new("m.obj"));
    }

    #[test]
    fn no_words_make_it_panic(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "v", "vt", "vn", "f", "l", "\n", "\n", "\n", "1", "2", "3", "-1", "0", "1/1", "1//1", "2/1/1", "-1/-1/-1",
                "/", "//", "1/", "nan", "1e39", "0.5", "-7", "4294967295", "4294967296", "\\\n", "#", "é",
            ]),
            0..300,
        ),
    ) {
        let _ = read(&words.join(" "));
    }

    #[test]
    fn a_damaged_file_is_read_or_refused(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = write(&shapes::torus(1.0, 0.3, (5, 4))).into_bytes();
        for (place, byte) in edits {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        bytes.truncate(cut.index(bytes.len()).max(bytes.len() / 2));
        match read_obj(&bytes, Path::new("m.obj")) {
            Ok((mesh, _)) => {
                prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
                prop_assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
                prop_assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
                prop_assert!(mesh.uvs.is_empty() || mesh.uvs.len() == mesh.positions.len());
            }
            Err(problem) => prop_assert!(problem.is_error() && problem.at.is_some()),
        }
    }
}
