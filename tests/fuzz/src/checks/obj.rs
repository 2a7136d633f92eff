//! Meshes: what is read can be rendered, and is what stood there.

use super::{memory, problems};
use diaphane::geometry::mesh::Mesh;
use diaphane::geometry::obj::read_obj;
use std::fmt::Write;
use std::path::Path;

const FILE: &str = "in/fuzz.obj";

pub fn check(bytes: &[u8]) {
    let (path, files) = (Path::new(FILE), [(Path::new(FILE), bytes)]);
    let (read, most) = memory::most(|| read_obj(bytes, path));
    // A face of a few bytes is three corners with three indices each, in several forms at once.
    assert!(most <= (1 << 20) + 1024 * bytes.len(), "{} bytes of file take {most} bytes of memory", bytes.len());
    let (mesh, warnings) = match read {
        Ok(read) => read,
        Err(problem) => return problems::sound(&problem, &files),
    };
    assert!(!warnings.iter().any(|warning| warning.is_error()));
    problems::warnings_sound(&warnings, &files);
    sound(&mesh);

    let (again, warnings) = read_obj(written(&mesh).as_bytes(), path).expect("what was read is read again");
    assert!(warnings.is_empty(), "{warnings:?}");
    sound(&again);
    assert!(again.triangles == mesh.triangles && again.positions == mesh.positions && again.uvs == mesh.uvs);
    let far = mesh.normals.iter().zip(&again.normals).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(far < 1e-6 && again.normals.len() == mesh.normals.len(), "a normal moves by {far}");
}

fn sound(mesh: &Mesh) {
    let count = mesh.positions.len();
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < count), "a corner is no vertex");
    let mut used = vec![false; count];
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|used| *used), "a vertex belongs to no triangle");
    assert!(mesh.positions.iter().all(|p| p.is_finite()) && mesh.uvs.iter().all(|uv| uv.is_finite()));
    assert!([0, count].contains(&mesh.normals.len()) && [0, count].contains(&mesh.uvs.len()));
    for normal in mesh.normals.iter().copied().chain(mesh.smooth_normals()) {
        assert!((normal.length() - 1.0).abs() < 1e-5, "{normal} is no direction");
    }
    assert!(mesh.area() > 0.0 && mesh.area().is_finite() && mesh.signed_volume().is_finite());
    assert!(mesh.bounds().size().is_finite() && mesh.bounds().diagonal() > 0.0);
    let topology = mesh.topology();
    assert_eq!(mesh.is_closed(), topology.faces > 0 && topology.open_edges + topology.irregular_edges == 0);
}

/// A mesh as OBJ.
fn written(mesh: &Mesh) -> String {
    let mut text = String::new();
    let mut line = |words: std::fmt::Arguments| writeln!(text, "{words}").expect("a text takes any line");
    mesh.positions.iter().for_each(|p| line(format_args!("v {} {} {}", p.x, p.y, p.z)));
    mesh.uvs.iter().for_each(|uv| line(format_args!("vt {} {}", uv.x, uv.y)));
    mesh.normals.iter().for_each(|n| line(format_args!("vn {} {} {}", n.x, n.y, n.z)));
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| match (v + 1, mesh.uvs.is_empty(), mesh.normals.is_empty()) {
            (v, true, true) => format!("{v}"),
            (v, false, true) => format!("{v}/{v}"),
            (v, true, false) => format!("{v}//{v}"),
            (v, false, false) => format!("{v}/{v}/{v}"),
        });
        line(format_args!("f {a} {b} {c}"));
    }
    text
}
